"use strict";
// What the pages share: shapes, controls, plots, and motions of bodies under the friction of a contact (contact.js).

const G = 9.81, TURN = 2 * Math.PI;
const $ = (id) => document.getElementById(id);
const range = (count) => [...Array(count).keys()];

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== false) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

// ---------------------------------------------------------------------- shapes

// Outlines for the eye [m]; discs of the shapes come from the library (SHAPES, half a size of 1).
function outline(pen, state) {
  const a = 0.5e-3 * state.width, b = 0.5e-3 * state.height, name = state.shape;
  const box = (x, y, w, h) => pen.rect(x - w, y - h, 2 * w, 2 * h);
  pen.beginPath();
  if (name === "disc" || name === "fingertip") pen.arc(0, 0, a, 0, TURN);
  else if (name === "ring") { pen.arc(0, 0, a, 0, TURN); pen.moveTo(0.8 * a, 0); pen.arc(0, 0, 0.8 * a, 0, TURN, true); }
  else if (name === "pads") { box(-0.85 * a, 0, 0.15 * a, 0.2 * a); box(0.85 * a, 0, 0.15 * a, 0.2 * a); }
  else if (name === "bar") box(0, 0, a, 0.1 * a);
  else if (name === "square") box(0, 0, a, a);
  else if (name === "rectangle") box(0, 0, a, b);
  else if (name === "draw") for (const [x, y, radius] of discsOf(state)) { const half = radius * Math.sqrt(3) / 2; box(x, y, half, half); }
}

// Columns and rows of a rectangle that is cut into at most 24 pieces, about square ones.
function grid(width, height) {
  let best = [1, 24], least = Infinity;
  for (let columns = 1; columns <= 24; columns++) {
    const rows = Math.floor(24 / columns), off = Math.abs(Math.log((width / columns) / (height / rows))) + 0.02 * (24 - rows * columns);
    if (off < least) [best, least] = [[columns, rows], off];
  }
  return best;
}

function discsOf(state) {
  const a = 0.5e-3 * state.width, b = 0.5e-3 * state.height;
  if (state.shape === "draw") {
    const side = 1e-3 * state.cell, radius = side / Math.sqrt(3);
    return [...state.map].flatMap((digit, i) => (digit === "0" ? [] :
      [[(i % MAP - (MAP - 1) / 2) * side, ((MAP - 1) / 2 - Math.floor(i / MAP)) * side, radius, Number(digit)]]));
  }
  if (state.shape !== "rectangle") return SHAPES[state.shape].map(([x, y, radius, weight]) => [a * x, a * y, a * radius, weight]);
  const [columns, rows] = grid(state.width, state.height), dx = 2 * a / columns, dy = 2 * b / rows;
  return range(rows * columns).map((i) => [
    (i % columns + 0.5) * dx - a, b - (Math.floor(i / columns) + 0.5) * dy, Math.hypot(dx, dy) / Math.sqrt(6), 1]);
}

const MAP = 12;  // cells of a side of a drawn map
const halfSize = (state) => 1e-3 * (state.shape === "draw" ? 0.5 * MAP * state.cell
  : 0.5 * (state.shape === "rectangle" ? Math.max(state.width, state.height) : state.width));

// Square radius of gyration of a body whose mass is spread like the pressure.
const gyration = ({discs, x, y}) => {
  const total = discs.reduce((sum, disc) => sum + disc[3], 0);
  return discs.reduce((sum, [dx, dy, radius, weight]) => sum + weight * ((dx - x) ** 2 + (dy - y) ** 2 + 0.5 * radius * radius), 0) / total;
};

// ---------------------------------------------------------------------- controls

// The state of a page is a record of numbers and words; the address keeps what differs from the first.
class State {
  constructor(defaults, changed) {
    Object.assign(this, {defaults, changed, values: {...defaults}, shown: [], legal: {}});
    window.addEventListener("hashchange", () => { this.read(); this.show(); });
  }

  // Take what the address has, but for what is not legal: [least, most] of numbers, a test of words.
  read() {
    this.values = {...this.defaults};
    for (const [name, text] of new URLSearchParams(location.hash.slice(1))) {
      const rule = this.legal[name];
      if (Array.isArray(rule) && text !== "" && isFinite(text)) this.values[name] = Math.min(rule[1], Math.max(rule[0], Number(text)));
      else if (typeof rule === "function" && rule(text)) this.values[name] = text;
    }
  }

  set(more) {
    Object.assign(this.values, more);
    const told = new URLSearchParams();
    for (const [name, value] of Object.entries(this.values)) if (value !== this.defaults[name]) told.set(name, value);
    clearTimeout(this.later);
    this.later = setTimeout(() => { try { history.replaceState(null, "", "#" + told); } catch { /* the address stays */ } }, 150);
    this.show();
  }

  show() {
    for (const each of this.shown) each();
    if (!this.waiting) {
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; this.changed(); });
    }
  }
}

const rounded = (value, digits = 3) => String(Number(value.toFixed(digits)) || 0);

// A slider with a field for its number. Arrow keys move either by a step.
function slider(state, key, words, unit, [least, most, step]) {
  state.legal[key] = [least, most];
  const put = (text) => { const value = Number(text); if (text !== "" && isFinite(value)) state.set({[key]: Math.min(most, Math.max(least, value))}); };
  const bar = element("input", {type: "range", min: least, max: most, step, "aria-label": words, oninput: () => put(bar.value)});
  const field = element("input", {type: "number", min: least, max: most, step, id: key, "aria-label": `${words} [${unit}]`, onchange: () => { put(field.value); }});
  state.shown.push(() => { bar.value = state.values[key]; if (document.activeElement !== field || Number(field.value) !== state.values[key]) field.value = rounded(state.values[key]); });
  return element("div", {class: "control"}, element("span", {}, words), bar, field, element("span", {}, unit));
}

function choice(state, key, words, options, also = {}) {
  state.legal[key] = (text) => Object.hasOwn(options, text);
  const list = element("select", {id: key, "aria-label": words, onchange: () => state.set({[key]: list.value, ...also[list.value]})},
    ...Object.entries(options).map(([value, text]) => element("option", {value}, text)));
  state.shown.push(() => { list.value = state.values[key]; });
  return element("div", {class: "control choice"}, element("span", {}, words), list);
}

// ---------------------------------------------------------------------- drawing

// A canvas in CSS pixels, `ratio` as high as it is wide.
function pen(canvas, ratio) {
  const width = canvas.clientWidth, scale = window.devicePixelRatio || 1, height = Math.round(ratio * width);
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const made = canvas.getContext("2d");
  made.setTransform(scale, 0, 0, scale, 0, 0);
  made.clearRect(0, 0, width, height);
  made.font = "13px system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif";
  return Object.assign(made, {wide: width, high: height});
}

function path(pen, points, colour, width = 1.8, dash = []) {
  pen.strokeStyle = colour; pen.lineWidth = width; pen.setLineDash(dash); pen.lineJoin = "round"; pen.beginPath();
  points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke(); pen.setLineDash([]);
}

function words(pen, text, x, y, {align = "center", colour = "#222", base = "middle", halo = false} = {}) {
  pen.textAlign = align; pen.textBaseline = base;
  if (halo) { pen.strokeStyle = "white"; pen.lineWidth = 4; pen.lineJoin = "round"; pen.strokeText(text, x, y); }
  pen.fillStyle = colour; pen.fillText(text, x, y);
}

const DASHES = {ellipsoid: [9, 3, 2, 3], reference: [6, 4]};

const SYMBOLS = {
  friction(pen, [x, y], [dx, dy], colour = COLOURS.friction, width = 4.5) {  // thick, filled head
    const size = Math.hypot(dx, dy), head = Math.min(3.4 * width, size), [c, s] = [dx / size, dy / size];
    if (size < 1.5) return;
    path(pen, [[x, y], [x + dx - 0.9 * head * c, y + dy - 0.9 * head * s]], colour, width);
    pen.fillStyle = colour; pen.beginPath(); pen.moveTo(x + dx, y + dy);
    for (const side of [1, -1]) pen.lineTo(x + dx - head * c - side * 0.5 * head * s, y + dy - head * s + side * 0.5 * head * c);
    pen.fill();
  },
  velocity(pen, [x, y], [dx, dy]) {  // thin, open head
    const size = Math.hypot(dx, dy), head = Math.min(6, 0.6 * size), angle = Math.atan2(dy, dx);
    if (size < 1) return;
    const barb = (turn) => [x + dx - head * Math.cos(angle + turn), y + dy - head * Math.sin(angle + turn)];
    path(pen, [[x, y], [x + dx, y + dy]], COLOURS.velocity, 1.2);
    path(pen, [barb(0.5), [x + dx, y + dy], barb(-0.5)], COLOURS.velocity, 1.2);
  },
  load(pen, [x, y], [dx, dy], text = "", at = null) {  // hollow
    const size = Math.hypot(dx, dy), [c, s] = size ? [dx / size, dy / size] : [0, 0], head = Math.min(13, size);
    if (size > 1.5) {
      const place = (along, across) => [x + along * c - across * s, y + along * s + across * c];
      const corners = [[0, 3], [size - head, 3], [size - head, 8], [size, 0], [size - head, -8], [size - head, -3], [0, -3], [0, 3]];
      pen.fillStyle = "white"; pen.beginPath(); corners.forEach((each, k) => pen[k ? "lineTo" : "moveTo"](...place(...each))); pen.fill();
      path(pen, corners.map((each) => place(...each)), COLOURS.load, 1.3);
    }
    if (text) words(pen, text, ...(at || [x + dx + 8 * c, y + dy + 12 * s]), {colour: "#444", align: c > 0.3 ? "left" : c < -0.3 ? "right" : "center", halo: true});
  },
  rotation(pen, [x, y], radius = 7) {  // ring with a dot
    for (const [size, colour, width] of [[radius, "white", 5], [radius, "black", 1.8]]) {
      pen.strokeStyle = colour; pen.lineWidth = width; pen.beginPath(); pen.arc(x, y, size, 0, TURN); pen.stroke();
    }
    pen.fillStyle = "black"; pen.beginPath(); pen.arc(x, y, 2, 0, TURN); pen.fill();
  },
  pressure(pen, [x, y], size = 7) {  // upright plus
    for (const [colour, width] of [["white", 5], ["black", 2]]) {
      path(pen, [[x - size, y], [x + size, y]], colour, width); path(pen, [[x, y - size], [x, y + size]], colour, width);
    }
  },
  mass(pen, [x, y], radius = 7) {  // quartered disc
    pen.fillStyle = "white"; pen.beginPath(); pen.arc(x, y, radius, 0, TURN); pen.fill();
    pen.fillStyle = "black";
    for (const from of [0, Math.PI]) { pen.beginPath(); pen.moveTo(x, y); pen.arc(x, y, radius, from, from + Math.PI / 2); pen.fill(); }
    pen.strokeStyle = "black"; pen.lineWidth = 1.2; pen.beginPath(); pen.arc(x, y, radius, 0, TURN); pen.stroke();
  },
  bar(pen, x, y, length, text) {
    path(pen, [[x, y], [x + length, y]], "black", 2.5); words(pen, text, x + length / 2, y - 9, {halo: true});
  },
};

// Explains a symbol with a small picture of it.
function key(entries) {
  const arrow = (colour, width, head) => `<line x1="1" y1="9" x2="24" y2="9" stroke="${colour}" stroke-width="${width}"/>${head}`;
  const filled = (colour) => `<path d="M34 9 L22 4 V14 Z" fill="${colour}"/>`;
  const pictures = {
    friction: arrow(COLOURS.friction, 4.5, filled(COLOURS.friction)), ellipsoid: arrow(COLOURS.ellipsoid, 3, filled(COLOURS.ellipsoid)),
    velocity: arrow(COLOURS.velocity, 1.3, `<path d="M20 5 L27 9 L20 13" fill="none" stroke="${COLOURS.velocity}" stroke-width="1.3"/>`),
    load: `<path d="M1 6 H20 V2 L32 9 L20 16 V12 H1 Z" fill="white" stroke="${COLOURS.load}" stroke-width="1.3"/>`,
    rotation: `<circle cx="15" cy="9" r="7" fill="white" stroke="black" stroke-width="1.8"/><circle cx="15" cy="9" r="2"/>`,
    pressure: `<path d="M15 2 V16 M8 9 H22" stroke="black" stroke-width="2"/>`,
    mass: `<circle cx="15" cy="9" r="7" fill="white" stroke="black"/><path d="M15 9 V2 A7 7 0 0 0 8 9 Z M15 9 V16 A7 7 0 0 0 22 9 Z"/>`,
    limit: `<line x1="1" y1="9" x2="33" y2="9" stroke="black" stroke-width="2"/>`,
    other: `<line x1="1" y1="9" x2="33" y2="9" stroke="${COLOURS.ellipsoid}" stroke-width="2" stroke-dasharray="9 3 2 3"/>`,
    discs: `<circle cx="10" cy="9" r="7" fill="${PRESSURES[3]}"/><circle cx="25" cy="9" r="7" fill="${PRESSURES[6]}"/>`,
  };
  const made = element("div", {class: "key"});
  for (const [name, text] of Object.entries(entries)) {
    const picture = element("span");
    picture.innerHTML = `<svg viewBox="0 0 34 18" aria-hidden="true">${pictures[name]}</svg>`;
    made.append(picture, element("span", {"data-key": name}, text));
  }
  return made;
}

// Round number not above the given one, or not below it.
function nice(value, up = false) {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  return (up ? [1, 2, 5, 10].find((each) => each * power >= value * 0.9999) : [5, 2, 1].find((each) => each * power <= value * 1.0001)) * power;
}

// Axes around a box with light lines; `right` and `top` give labels in another unit, [factor, name].
class Axes {
  constructor(pen, {x, y, xName, yName, left = 58, bottom = 40, top = null, right = null}) {
    Object.assign(this, {pen, x, y});
    this.box = [left, top ? 38 : 10, pen.wide - (right ? 52 : 12), pen.high - bottom];
    const [x0, y0, x1, y1] = this.box;
    pen.fillStyle = "white"; pen.fillRect(0, 0, pen.wide, pen.high);
    const digits = (step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const marks = ([least, most], count) => {
      const step = nice((most - least) / count, true), first = Math.ceil(least / step - 1e-9);
      return [range(Math.floor(most / step + 1e-9) - first + 1).map((i) => (first + i) * step), digits(step)];
    };
    const counts = {x: (x1 - x0) / 44, y: (y1 - y0) / 30};
    this.counts = counts;
    this.marks = {x: marks(x, counts.x), y: marks(y, counts.y)};
    this.below = () => {
      for (const each of this.marks.x[0]) path(pen, [[this.X(each), y0], [this.X(each), y1]], "#E3E6EA", 1);
      for (const each of this.marks.y[0]) path(pen, [[x0, this.Y(each)], [x1, this.Y(each)]], "#E3E6EA", 1);
    };
    this.labels = () => {
      const grey = {colour: "#444"};
      path(pen, [[x0, y0], [x0, y1], [x1, y1]], "#666", 1);
      for (const each of this.marks.x[0]) words(pen, minus(each.toFixed(this.marks.x[1])), this.X(each), y1 + 12, grey);
      for (const each of this.marks.y[0]) words(pen, minus(each.toFixed(this.marks.y[1])), x0 - 6, this.Y(each), {...grey, align: "right"});
      words(pen, xName, (x0 + x1) / 2, pen.high - 9);
      this.turned(yName, 11);
      if (top) this.second(top, "x", y0);
      if (right) this.second(right, "y", x1);
    };
    this.below();
  }

  // Ticks of a second unit at the largest and middle values.
  second([factor, name], axis, at) {
    const pen = this.pen, [x0, y0, x1, y1] = this.box, grey = {colour: "#777"};
    const ends = this[axis].map((each) => each * factor), step = nice((ends[1] - ends[0]) / (1.4 * this.counts[axis]), true);
    for (let k = Math.ceil(ends[0] / step); k * step <= ends[1]; k++) {
      const text = minus((k * step).toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)))), place = k * step / factor;
      if (axis === "x") words(pen, text, this.X(place), at - 9, grey); else words(pen, text, at + 5, this.Y(place), {...grey, align: "left"});
    }
    if (axis === "x") words(pen, name, (x0 + x1) / 2, 8, grey); else this.turned(name, pen.wide - 8, "#777");
  }

  turned(text, x, colour = "#222") {
    const pen = this.pen;
    pen.save(); pen.translate(x, (this.box[1] + this.box[3]) / 2); pen.rotate(-Math.PI / 2); words(pen, text, 0, 0, {colour}); pen.restore();
  }

  X(value) { const [x0, , x1] = this.box; return x0 + (x1 - x0) * (value - this.x[0]) / (this.x[1] - this.x[0]); }
  Y(value) { const [, y0, , y1] = this.box; return y1 - (y1 - y0) * (value - this.y[0]) / (this.y[1] - this.y[0]); }
  at([x, y]) { return [this.X(x), this.Y(y)]; }
  line(points, ...look) { path(this.pen, points.map((each) => this.at(each)), ...look); }
  dot(point, colour, radius = 5.5) {
    const pen = this.pen;
    pen.fillStyle = "white"; pen.beginPath(); pen.arc(...this.at(point), radius + 1.5, 0, TURN); pen.fill();
    pen.fillStyle = colour; pen.beginPath(); pen.arc(...this.at(point), radius, 0, TURN); pen.fill();
  }
  diamond(point, colour, size = 7) {
    const pen = this.pen, [x, y] = this.at(point);
    pen.fillStyle = colour; pen.strokeStyle = "white"; pen.lineWidth = 1.5; pen.beginPath(); pen.moveTo(x + size, y);
    pen.lineTo(x, y + size); pen.lineTo(x - size, y); pen.lineTo(x, y - size); pen.closePath(); pen.fill(); pen.stroke();
  }
}

const minus = (text) => text.replace(/^-(?=[\d.]*[1-9])/, "\u2212").replace(/^-/, "");

// ---------------------------------------------------------------------- the map of a contact

// Draws discs, velocities and friction of a contact seen from above; `view` is half the width that is seen [m].
function drawMap(canvas, {contact, state, twist, view, wrenches = [], friction = false, speed = true}) {
  const made = pen(canvas, 1), px = made.wide / (2 * view), middle = made.wide / 2, [vx, vy, omega] = twist;
  const place = (x, y) => [middle + px * x, middle - px * y];
  made.fillStyle = "white"; made.fillRect(0, 0, made.wide, made.high);
  made.save(); made.translate(middle, middle); made.scale(px, -px);
  if (state.shape === "draw") {
    const half = halfSize(state), side = 1e-3 * state.cell;
    made.strokeStyle = "#E3E6EA"; made.lineWidth = 1 / px; made.beginPath();
    for (let k = 0; k <= MAP; k++) { made.moveTo(-half, k * side - half); made.lineTo(half, k * side - half); made.moveTo(k * side - half, -half); made.lineTo(k * side - half, half); }
    made.stroke();
  } else { outline(made, state); made.fillStyle = COLOURS.body; made.fill(); }
  const pressures = contact.discs.map(([, , radius, weight]) => weight / (radius * radius)), most = Math.max(...pressures);
  contact.discs.forEach(([x, y, radius], i) => {
    made.fillStyle = PRESSURES[Math.round(1 + 5 * pressures[i] / most)];
    made.strokeStyle = "white"; made.lineWidth = 0.8 / px;
    if (state.shape === "draw") { const side = 1e-3 * state.cell; made.fillRect(x - side / 2, y - side / 2, side, side); }
    else { made.beginPath(); made.arc(x, y, radius, 0, TURN); made.fill(); made.stroke(); }
  });
  made.restore();
  const speeds = contact.discs.map(([x, y]) => [vx - omega * y, vy + omega * x]), fastest = Math.max(...speeds.map((each) => Math.hypot(...each)));
  const every = Math.ceil(contact.discs.length / 40);
  if (friction && fastest > 0) {
    const pieces = contact.pieces(twist), largest = Math.max(...contact.discs.map((disc) => disc[3])), total = contact.discs.reduce((sum, disc) => sum + disc[3], 0);
    pieces.forEach(([fx, fy], i) => { if (i % every === 0) SYMBOLS.friction(made, place(...contact.discs[i]), [0.1 * made.wide * fx * total / largest, -0.1 * made.wide * fy * total / largest], COLOURS.friction, 2); });
  } else if (fastest > 0) {
    const unit = 0.13 * made.wide / fastest, shown = nice(1e3 * fastest);
    speeds.forEach(([u, v], i) => { if (i % every === 0) SYMBOLS.velocity(made, place(...contact.discs[i]), [unit * u, -unit * v]); });
    if (speed) SYMBOLS.velocity(made, [made.wide - 18 - 1e-3 * unit * shown, made.high - 16], [1e-3 * unit * shown, 0]);
    if (speed) words(made, `${rounded(shown)} mm/s`, made.wide - 18, made.high - 30, {align: "right", halo: true});
  }
  const at = place(contact.x, contact.y);
  wrenches.forEach(([fx, fy], k) => {  // the second beside the first
    const aside = k * 8 / (Math.hypot(fx, fy) || 1), from = [at[0] - aside * fy, at[1] - aside * fx];
    SYMBOLS.friction(made, from, [0.23 * made.wide * fx, -0.23 * made.wide * fy], [COLOURS.friction, COLOURS.ellipsoid][k], [4.5, 3][k]);
  });
  SYMBOLS.pressure(made, at);
  if (omega) {
    const centre = [-vy / omega, vx / omega], far = Math.hypot(...centre), spot = place(...centre), edge = 14;
    if (spot.every((each) => each > edge && each < made.wide - edge)) SYMBOLS.rotation(made, spot);
    else {
      const [c, s] = [centre[0] / far, -centre[1] / far], reach = (middle - edge) / Math.max(Math.abs(c), Math.abs(s)), end = [middle + reach * c, middle + reach * s];
      path(made, [[middle + 0.8 * reach * c, middle + 0.8 * reach * s], end], "black", 1, [3, 3]);
      SYMBOLS.rotation(made, end, 5);
      const text = far < 10 ? `centre of rotation ${rounded(1e3 * far, 0)} mm away` : "centre of rotation far away";
      const room = made.measureText(text).width / 2 + 6, across = Math.min(Math.max(end[0], room), made.wide - room);
      words(made, text, across, end[1] + (end[1] > middle ? -16 : 18), {halo: true});
    }
  }
  const length = 1e-3 * nice(0.5e3 * view);
  SYMBOLS.bar(made, 14, made.high - 14, px * length, `${rounded(1e3 * length)} mm`);
  return {place, back: (event) => { const box = canvas.getBoundingClientRect(), scale = 2 * view / box.width; return [(event.clientX - box.x) * scale - view, view - (event.clientY - box.y) * scale]; }};
}

// Lets pointer and arrow keys move a point of a canvas; `moved` gets its new place [m] from `where()`.
function draggable(canvas, back, moved, where, step) {
  canvas.tabIndex = 0;
  for (const kind of ["pointerdown", "pointermove"]) canvas.addEventListener(kind, (event) => {
    if (!event.buttons) return;
    if (kind === "pointerdown") { canvas.setPointerCapture?.(event.pointerId); canvas.focus({preventScroll: true}); }
    moved(...back(event), kind === "pointerdown");
    event.preventDefault();
  });
  canvas.addEventListener("keydown", (event) => {
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
    if (!way) return;
    const [x, y] = where(), size = step() * (event.shiftKey ? 5 : 1);
    moved(x + way[0] * size, y + way[1] * size);
    event.preventDefault();
  });
}

// ---------------------------------------------------------------------- sections of the limit surface

// Loads (fx, fy, tau / r) in the plane of two directions that friction just holds, per mu f_N: of the discs and of the ellipsoid.
function sectionOf(contact, first, second, count = 96) {
  const points = range(count + 1).map((k) => {
    const [c, s] = [Math.cos(TURN * k / count), Math.sin(TURN * k / count)];
    const [fx, fy, tau] = range(3).map((i) => c * first[i] + s * second[i]);
    try {
      const {force, ellipsoid} = contact.holding([fx, fy, contact.radius * tau], 1);
      return [[c / force, s / force], [c / ellipsoid, s / ellipsoid]];
    } catch { return null; }
  }).filter((each) => each);
  return [points.map((each) => each[0]), points.map((each) => each[1])];
}

// Draws a section; `loads` are a friction and that of the ellipsoid with their signs turned, `load` one that is to be held.
function drawSection(canvas, curves, {xName, yName, second, points = [], load = null, ratio = 0.86, wide = 1.25}) {
  const made = pen(canvas, ratio), [limit, ellipsoid] = curves;
  const most = wide * Math.max(1, ...limit.flat().map(Math.abs)) / 1;
  const axes = new Axes(made, {x: [-most, most], y: [-most, most], xName, yName, top: second[0], right: second[1]});
  const [x0, y0, x1, y1] = axes.box;
  made.fillStyle = COLOURS.beyond; made.fillRect(x0, y0, x1 - x0, y1 - y0);
  made.fillStyle = COLOURS.holds; made.beginPath(); limit.forEach((each, k) => made[k ? "lineTo" : "moveTo"](...axes.at(each))); made.fill();
  made.globalAlpha = 0.6; axes.below(); made.globalAlpha = 1;
  axes.line([[0, -most], [0, most]], "#9AA3AD", 1); axes.line([[-most, 0], [most, 0]], "#9AA3AD", 1);
  axes.line(limit, "black", 2); axes.line(ellipsoid, COLOURS.ellipsoid, 2, DASHES.ellipsoid);
  axes.labels();
  if (points[1]) axes.diamond(points[1], COLOURS.ellipsoid);
  if (points[0]) axes.dot(points[0], COLOURS.friction);
  if (load) {
    const shown = load.map((each) => Math.min(most, Math.max(-most, each))), from = axes.at([0, 0]), to = axes.at(shown);
    made.save(); made.beginPath(); made.rect(x0, y0, x1 - x0, y1 - y0); made.clip();
    SYMBOLS.load(made, from, [to[0] - from[0], to[1] - from[1]]); made.restore();
    words(made, "load", to[0] + (to[0] > x1 - 50 ? -10 : 10), Math.max(y0 + 10, Math.min(y1 - 10, to[1] - 12)), {align: to[0] > x1 - 50 ? "right" : "left", halo: true});
  }
  return {axes, back: (event) => {
    const box = canvas.getBoundingClientRect(), x = (event.clientX - box.x) * made.wide / box.width, y = (event.clientY - box.y) * made.high / box.height;
    return [axes.x[0] + (axes.x[1] - axes.x[0]) * (x - x0) / (x1 - x0), axes.y[0] + (axes.y[1] - axes.y[0]) * (y1 - y) / (y1 - y0)];
  }};
}

// ---------------------------------------------------------------------- motions

// A free body on its contact until rest: rows {t, x, y, angle, twist}. Steps are short while the bristles bend at first, and
// beside the time that is left.
function puckRun(contact, twist, mu, mass, inertia) {
  const lever = Math.sqrt(inertia / mass), size = ([vx, vy, omega]) => Math.hypot(vx, vy, lever * omega), first = size(twist);
  const rows = [{t: 0, x: 0, y: 0, angle: 0, twist}];
  contact.rest();
  for (let k = 0; k < 3000 && first > 0; k++) {
    const last = rows[rows.length - 1], left = size(last.twist) / (mu * G);
    if (size(last.twist) < 1e-3 * first) break;
    const dt = Math.min(1e-7 * 1.3 ** k, first / (mu * G) / 250, 0.02 * left);
    const angle = last.angle + 0.5 * dt * last.twist[2];
    const next = contact.bodyStep({twist: last.twist, applied: [0, 0, 0], load: mass * G, dt, mass, inertia, place: [0, 0, angle]});
    const mean = range(3).map((i) => 0.5 * (last.twist[i] + next.twist[i]));
    rows.push({t: last.t + dt, x: last.x + dt * mean[0], y: last.y + dt * mean[1], angle: last.angle + dt * mean[2], twist: next.twist, friction: next.friction});
  }
  return rows;
}

// The row at a time, between those that are stored.
function rowAt(rows, t) {
  let low = 0, high = rows.length - 1;
  if (t >= rows[high].t) return rows[high];
  while (high - low > 1) { const half = (low + high) >> 1; if (rows[half].t <= t) low = half; else high = half; }
  const [a, b] = [rows[low], rows[high]], part = (t - a.t) / (b.t - a.t), mix = (from, to) => from + part * (to - from);
  return {...b, t, x: mix(a.x, b.x), y: mix(a.y, b.y), angle: mix(a.angle, b.angle), twist: range(3).map((i) => mix(a.twist[i], b.twist[i]))};
}

// Play, pause and a slider of time for a motion; `draw(t)` is called with the time.
class Player {
  constructor(draw, seconds = 5) {
    Object.assign(this, {draw, seconds, end: 1, part: 1, playing: false});
    this.button = element("button", {onclick: () => this.toggle(), "aria-label": "play or pause"}, "▶ play");
    this.bar = element("input", {type: "range", min: 0, max: 1, step: 0.001, value: 1, "aria-label": "time", oninput: () => { this.stop(); this.part = Number(this.bar.value); this.show(); }});
    this.clock = element("span", {class: "small"});
    this.row = element("div", {class: "row"}, this.button, this.bar, this.clock);
    this.bar.style.flex = "1 1 120px"; this.clock.style.flex = "1 1 190px";
  }
  toggle() { if (this.playing) this.stop(); else this.play(); }
  play() {
    this.playing = true; this.button.textContent = "❚❚ pause";
    if (this.part >= 1) this.part = 0;
    let before = performance.now();
    const frame = (now) => {
      if (!this.playing) return;
      this.part = Math.min(1, this.part + (now - before) / (1e3 * this.seconds)); before = now;
      if (this.part >= 1) this.stop();
      this.show();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }
  stop() { this.playing = false; this.button.textContent = "▶ play"; }
  show() {
    this.bar.value = this.part;
    const ms = 1e3 * this.end, digits = ms < 100 ? 1 : 0;
    this.clock.textContent = `${(ms * this.part).toFixed(digits)} of ${ms.toFixed(digits)} ms, ${rounded(1e3 * this.seconds / ms, 0)} times slower`;
    this.draw(this.part * this.end);
  }
}

// Draws a puck at a time of its run, with its path, and both speeds over time.
function drawPuck(canvas, history, {rows, t, contact, state, mu}) {
  const now = rowAt(rows, t), end = rows[rows.length - 1], size = halfSize(state);
  const made = pen(canvas, 0.5), span = Math.max(2.6 * size + Math.abs(end.x), 2 * (2.6 * size + Math.abs(end.y)), 4.2 * size), px = made.wide / span;
  const place = (x, y) => [made.wide / 2 + px * (x - end.x / 2), made.high / 2 - px * (y - end.y / 2)];
  made.fillStyle = "white"; made.fillRect(0, 0, made.wide, made.high);
  const body = (row, fill, edge) => {
    made.save(); made.translate(...place(row.x, row.y)); made.rotate(-row.angle); made.scale(px, -px);
    outline(made, state);
    if (fill) { made.fillStyle = fill; made.fill(); }
    if (state.shape !== "draw") { made.strokeStyle = edge; made.lineWidth = 1.2 / px; made.stroke(); }
    made.beginPath(); made.moveTo(0.55 * size, 0); made.lineTo(0.95 * size, 0); made.strokeStyle = "black"; made.lineWidth = 2.5 / px; made.stroke();
    made.restore();
  };
  body(rows[0], null, "#AAA");
  body(now, COLOURS.body, "#555");
  path(made, rows.map((row) => place(row.x, row.y)), COLOURS.path, 1.6);
  const speed = Math.hypot(now.twist[0], now.twist[1]), first = Math.hypot(rows[0].twist[0], rows[0].twist[1], size * rows[0].twist[2]) || 1, at = place(now.x, now.y);
  if (speed > 1e-3 * first) SYMBOLS.velocity(made, at, [0.15 * made.wide * now.twist[0] / first, -0.15 * made.wide * now.twist[1] / first]);
  if (now.friction && t < end.t) { const weight = mu * G; SYMBOLS.friction(made, at, [0.2 * made.wide * now.friction[0] / weight, -0.2 * made.wide * now.friction[1] / weight]); }
  const length = 1e-3 * nice(250 * span);
  SYMBOLS.bar(made, 14, made.high - 12, px * length, `${rounded(1e3 * length)} mm`);

  const radius = contact.radius, curve = (of) => rows.map((row) => [1e3 * row.t, 1e3 * of(row)]);
  const slide = (row) => Math.hypot(row.twist[0], row.twist[1]), spin = (row) => radius * Math.abs(row.twist[2]);
  const most = Math.max(1e-3, ...rows.map((row) => 1e3 * Math.max(slide(row), spin(row)))), all = 1e3 * (end.t || 1e-3);
  const axes = new Axes(pen(history, 0.5), {x: [0, all], y: [0, 1.2 * most], xName: "time [ms]", yName: "speed [mm/s]"});
  axes.line(curve(slide), COLOURS.friction, 2.2); axes.line(curve(spin), COLOURS.spin, 2.2, [7, 4]);
  axes.labels();
  axes.dot([1e3 * now.t, 1e3 * slide(now)], COLOURS.friction, 4.5); axes.dot([1e3 * now.t, 1e3 * spin(now)], COLOURS.spin, 4.5);
  const higher = slide(rows[0]) >= spin(rows[0]), early = rowAt(rows, 0.1 * end.t);
  const name = (text, of, colour, above) => { const [x, y] = axes.at([1e3 * early.t, 1e3 * of(early)]); words(axes.pen, text, x + 6, above ? y - 12 : Math.min(y + 20, axes.box[3] - 8), {align: above ? "left" : "center", colour, halo: true}); };
  if (rows.length > 1) { name("slide v", slide, COLOURS.friction, higher); name("spin ωr", spin, "#555", !higher); }
}

// Words about the end of a puck's run.
function puckEnd(rows, contact) {
  if (rows.length < 2) return "It is at rest.";
  const end = rows[rows.length - 1], both = Math.hypot(rows[0].twist[0], rows[0].twist[1]) && rows[0].twist[2];
  const ratio = Math.hypot(end.twist[0], end.twist[1]) / (Math.abs(end.twist[2]) * contact.radius);
  return `It slides ${rounded(1e3 * Math.hypot(end.x, end.y), 2)} mm and turns ${minus(rounded(end.angle * 180 / Math.PI, 1))}° in ${rounded(1e3 * end.t, 1)} ms, until 0.1 % of its motion is left.` +
    (both ? ` Then v/(ωr) is ${ratio.toPrecision(2)}.` : "");
}

const moduleBytes = () => Uint8Array.from(atob(MODULE), (letter) => letter.charCodeAt(0));

// Draws again when a canvas gets another width.
function onResize(redraw) {
  let width = window.innerWidth;
  window.addEventListener("resize", () => { if (window.innerWidth !== width) { width = window.innerWidth; redraw(); } });
}
