"use strict";
// The page "Try it": one contact, and four things that it does.

const SHAPE_NAMES = {disc: "disc", rectangle: "rectangle", fingertip: "soft fingertip", ring: "ring", pads: "two pads", draw: "draw the pressure"};
const TABS = {slide: "Slide and spin", hold: "Will it hold?", hand: "In the hand", puck: "A puck"};
const DRAWN = ["000000000000", "000333000000", "003555300000", "003575300000", "003575300000", "003555300000",
  "003555300000", "003555555300", "003557775300", "000355555300", "000033333000", "000000000000"].join("");
const FIRST = {tab: "slide", shape: "disc", width: 20, height: 12, cell: 2, map: DRAWN, mu: 0.6, load: 5, vx: 10, vy: 0, omega: 1.5,
  mass: 0.2, offset: 12, acceleration: 0, grip: 5, eased: 1.2, pause: 80, speed: 500, spin: 60};
const PLATE = [0.15, 0.08];
const SECTIONS = [[[1, 0, 0], [0, 0, 1]], [[0, 1, 0], [0, 0, 1]], [[1, 0, 0], [0, 1, 0]]];

let contact, map, made = "", curves = {}, paints = true, level = 5, cursor = [3, 3], plateRows = [], puckRows = [], ran = {};
const players = {};
const state = new State(FIRST, () => contact && draw());
const law = (mu) => ({mu_c: mu, mu_s: mu, sigma_2: 0, elasto_plastic: 0.9});

// ---------------------------------------------------------------------- the same in Python

const number = (value) => { const text = String(Number(value.toPrecision(9))); return /[.e]/.test(text) ? text : `${text}.0`; };

function patchCode(now) {
  const a = number(0.5e-3 * now.width);
  return {
    disc: [`patch = pf.ContactPatch.disc(${a})`],
    fingertip: [`pressure = pf.patch.SoftFinger(c=${a}, n=0.0, k=2.0)`, `patch = pf.ContactPatch.disc(${a}, pressure=pressure)`],
    ring: [`patch = pf.ContactPatch.ring(${number(0.4e-3 * now.width)}, ${a}, cells=41)`],
    rectangle: [`patch = pf.ContactPatch.rectangle(`, `    ${number(1e-3 * now.width)}, ${number(1e-3 * now.height)}, cells=(${grid(now.width, now.height).join(", ")})`, `)`],
    pads: ["pressure = np.zeros((4, 20))", "pressure[:, :3] = pressure[:, -3:] = 1.0", `patch = pf.ContactPatch.from_pressure(pressure, width=${number(1e-3 * now.width)})`],
    draw: [`rows = """`, ...range(MAP).map((i) => now.map.slice(MAP * i, MAP * (i + 1))), `""".split()`,
      "pressure = np.array([[int(digit) for digit in row] for row in rows])", `patch = pf.ContactPatch.from_pressure(pressure, cell_size=${number(1e-3 * now.cell)})`],
  }[now.shape];
}

function code(now) {
  const needs = ["pads", "draw"].includes(now.shape), discs = now.shape === "draw" ? "patch.discs()" : "patch.discs(24)";
  const begin = [...(needs ? ["import numpy as np", ""] : []), "import planarfriction as pf"];
  const motion = ["", ...patchCode(now), `law = pf.LuGre(mu_c=${number(now.mu)}, sigma_2=0.0, elasto_plastic=0.9)`,
    `model = pf.ReducedModel(patch, law${now.shape === "draw" ? `, cells=${MAP * MAP}` : ""})`];
  return [...begin, ...{
    slide: () => ["", ...patchCode(now), `surface = pf.LimitSurfaceCells(${discs})`,
      `wrench = surface.wrench((${[1e-3 * now.vx, 1e-3 * now.vy, now.omega].map(number).join(", ")}))`, `print(${number(now.mu)} * ${number(now.load)} * wrench)  # mu f_N W [N, N, N m]`],
    hold: () => ["from planarfriction.planning import holding_load", "", ...patchCode(now),
      `weight = 0.5 * ${number(now.mass)} * (9.81 + ${number(now.acceleration)})  # of one of two fingers [N]`,
      `load = (0.0, -weight, -${number(1e-3 * now.offset)} * weight)`, `print(holding_load(load, patch, mu=${number(now.mu)}))  # [N]`],
    hand: () => [...motion, `grip = pf.Signal.sampled([0.0, ${number(1e-3 * now.pause)}], [${number(now.eased)}, ${number(now.grip)}])`,
      "scene = pf.scenes.in_hand(", "    model,", `    centre_of_mass=(${number(1e-3 * now.offset)}, 0.0),`, "    normal_force=grip,", `    mass=${number(now.mass)},`, `    t_end=${number(HAND_END)},`, ")",
      "solution = pf.simulate(scene)", "print(solution.data.theta.values[-1])  # angle at the end [rad]"],
    puck: () => [...motion, "scene = pf.scenes.free_slide(", `    model, twist=(${number(1e-3 * now.speed)}, 0.0, ${number(now.spin)}), save_every=1e-3`, ")",
      "solution = pf.simulate(scene)", "end = solution.data.isel(time=-1)", "print(float((end.x**2 + end.y**2) ** 0.5))  # distance [m]"],
  }[now.tab]()].join("\n");
}

// ---------------------------------------------------------------------- the plate

const HAND_END = 0.5;

const needed = (now, angle, x) => {  // grip of a finger that holds the plate at rest
  const weight = 0.5 * now.mass * (G + (now.tab === "hold" ? now.acceleration : 0));
  return contact.holding([0, -weight, -weight * x], now.mu);
};

// The plate hangs from fingers at the origin, which share their bristles.
function handRun(now) {
  const inertia = now.mass * (PLATE[0] ** 2 + PLATE[1] ** 2) / 12, dt = 1e-3 * now.pause / Math.ceil(now.pause / 0.5);
  const rows = [{t: 0, x: 1e-3 * now.offset, y: 0, angle: 0, twist: [0, 0, 0], grip: now.eased}];
  contact.rest();
  for (let k = 0; k < HAND_END / dt; k++) {
    const last = rows[rows.length - 1], [vx, vy, omega] = last.twist;
    const grip = last.t + 0.5 * dt < 1e-3 * now.pause ? now.eased : now.grip, place = [-(last.x + 0.5 * dt * vx), -(last.y + 0.5 * dt * vy), 0];
    const next = contact.bodyStep({twist: last.twist, applied: [0, -now.mass * G, 0], load: 2 * grip, dt, mass: now.mass, inertia, place});
    const mean = range(3).map((i) => 0.5 * (last.twist[i] + next.twist[i]));
    rows.push({t: last.t + dt, x: last.x + dt * mean[0], y: last.y + dt * mean[1], angle: last.angle + dt * mean[2], twist: next.twist, friction: next.friction, grip});
    if (onPlate(rows[rows.length - 1]) > 1) break;
    if (last.t > 1.2e-3 * now.pause + 0.02 && Math.hypot(next.twist[0], next.twist[1], 0.05 * next.twist[2]) < 1e-5) { rows.push({...rows[rows.length - 1], t: HAND_END}); break; }
  }
  for (const [k, row] of rows.entries()) row.need = k % 8 && k < rows.length - 1 ? null : needed(now, row.angle, row.x).force;
  return rows;
}

// Place of the fingers in the plate, in half its sides: beyond 1 it falls out.
function onPlate({x, y, angle}) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return Math.max(Math.abs(-c * x - s * y) / (PLATE[0] / 2), Math.abs(s * x - c * y) / (PLATE[1] / 2));
}

function drawPlate(canvas, now, row, {others = [], trace = [], weight = true} = {}) {
  const made = pen(canvas, 0.72), px = made.wide / 0.3, place = (x, y) => [made.wide / 2 + px * x, 0.46 * made.high - px * y];
  made.fillStyle = "white"; made.fillRect(0, 0, made.wide, made.high);
  const body = (each, fill, edge) => {
    made.save(); made.translate(...place(each.x, each.y)); made.rotate(-each.angle); made.beginPath();
    made.rect(-px * PLATE[0] / 2, -px * PLATE[1] / 2, px * PLATE[0], px * PLATE[1]);
    if (fill) { made.fillStyle = fill; made.fill(); }
    made.strokeStyle = edge; made.lineWidth = 1.2; made.stroke(); made.restore();
  };
  others.forEach((each) => body(each, null, "#B8BEC5"));
  body(row, COLOURS.body, "#555");
  if (trace.length > 1) path(made, trace.map(({x, y}) => place(x, y)), COLOURS.path, 1.6);
  made.save(); made.translate(...place(0, 0)); made.scale(px, -px); outline(made, now); made.fillStyle = COLOURS.pad; made.fill(); made.restore();
  const at = place(row.x, row.y), unit = 0.2 * made.wide / (now.mass * G);
  if (weight) SYMBOLS.load(made, at, [0, 0.2 * made.wide], "weight");
  if (row.friction) SYMBOLS.friction(made, place(0, 0), [unit * row.friction[0], -unit * row.friction[1]]);
  SYMBOLS.mass(made, at);
  SYMBOLS.bar(made, 12, made.high - 10, px * 0.05, "50 mm");
}

// ---------------------------------------------------------------------- tabs

const DRAW = {
  slide(now) {
    const twist = [1e-3 * now.vx, 1e-3 * now.vy, now.omega], strength = now.mu * now.load;
    const wrenches = [contact.surface([twist])[0], contact.surface([twist], true)[0]];
    map = drawMap($("map"), {contact, state: now, twist, view: 2.2 * halfSize(now), wrenches});
    $("numbers").innerHTML = "<tr><th></th><th>fx [N]</th><th>fy [N]</th><th>torque [N mm]</th></tr>" + wrenches.map((each, k) =>
      `<tr class="${["friction", "ellipsoid"][k]}"><td>${["Friction", "Ellipsoid"][k]}</td>` +
      each.map((part, i) => `<td>${minus((strength * part * (i === 2 ? 1e3 : 1)).toFixed(3))}</td>`).join("") + "</tr>").join("");
    const names = ["fx / μN", "fy / μN", "torque / μNr"];
    SECTIONS.forEach((axes, k) => {
      curves[k] ||= sectionOf(contact, ...axes);
      const parts = axes.map((axis) => axis.indexOf(1)), units = [1, 1, contact.radius], scale = parts.map((i) => [strength * units[i] * (i === 2 ? 1e3 : 1), i === 2 ? "[N mm]" : "[N]"]);
      drawSection($(`section${k}`), curves[k], {xName: names[parts[0]], yName: names[parts[1]], second: scale, points: wrenches.map((each) => parts.map((i) => -each[i] / units[i])), ratio: 0.95});
    });
  },

  hold(now) {
    const {force, ellipsoid, twist} = needed(now, 0, 1e-3 * now.offset), holds = now.grip >= force, weight = 0.5 * now.mass * (G + now.acceleration);
    map = drawMap($("map"), {contact, state: now, twist, view: 2.2 * halfSize(now), wrenches: weight > 0 ? contact.surface([twist]) : [], speed: false});
    const verdict = $("verdict"), percent = Math.abs(100 * (now.grip / force - 1));
    verdict.className = `verdict ${holds ? "holds" : "slips"}`;
    verdict.textContent = force === 0 ? "Holds without a grip." : `${holds ? "Holds" : "Slips"}, ${percent < 1000 ? percent.toFixed(0) : "over 1000"} % ${holds ? "in hand" : "too little"}. A finger needs ${force.toFixed(2)} N; the ellipsoid says ${ellipsoid.toFixed(2)} N.`;
    drawPlate($("plate"), now, {x: 1e-3 * now.offset, y: 0, angle: 0});
    curves.hold ||= sectionOf(contact, [0, -1, 0], [0, 0, -1]);
    const scale = [now.mu * now.grip, 1e3 * now.mu * now.grip * contact.radius];
    drawSection($("holdsection"), curves.hold, {xName: "force down / μN", yName: "torque / μNr", second: [[scale[0], "[N]"], [scale[1], "[N mm]"]],
      load: [weight / scale[0], weight * now.offset / scale[1]], ratio: 0.8});
  },

  hand(now) {
    const told = JSON.stringify([made, now.mu, now.mass, now.offset, now.grip, now.eased, now.pause]);
    if (ran.hand !== told) {
      plateRows = handRun(now); ran.hand = told;
      players.hand.end = plateRows[plateRows.length - 1].t;
      const end = plateRows[plateRows.length - 1], out = onPlate(end) > 1;
      $("handend").textContent = out ? `The plate falls out of the fingers after ${rounded(1e3 * end.t, 0)} ms.` :
        `After ${rounded(1e3 * end.t, 0)} ms the plate has turned by ${minus(rounded(end.angle * 180 / Math.PI, 2))}° and its centre has moved by (${minus(rounded(1e3 * end.x - now.offset, 2))}, ${minus(rounded(1e3 * end.y, 2))}) mm.`;
    }
    players.hand.show();
  },

  puck(now) {
    const told = JSON.stringify([made, now.mu, now.speed, now.spin]);
    if (ran.puck !== told) {
      puckRows = puckRun(contact, [1e-3 * now.speed, 0, now.spin], now.mu, 0.2, 0.2 * gyration(contact)); ran.puck = told;
      players.puck.end = puckRows[puckRows.length - 1].t || 1e-3;
      $("puckend").textContent = puckEnd(puckRows, contact);
    }
    players.puck.show();
  },
};

function drawHand(t) {
  const now = state.values, rows = plateRows, row = rowAt(rows, t), moves = Math.hypot(row.twist[0], row.twist[1], 0.01 * row.twist[2]) > 1e-4, until = rows.filter((each) => each.t <= t), last = rows[rows.length - 1];
  if (now.tab !== "hand") return;
  map = drawMap($("map"), {contact, state: now, twist: moves ? row.twist : [0, 0, 0], view: 2.2 * halfSize(now), wrenches: row.friction ? [[0, 1].map((i) => row.friction[i] / (2 * now.mu * row.grip || 1))] : []});
  drawPlate($("hand"), now, row, {others: [rows[0], last], trace: until, weight: false});
  const x = [0, 1e3 * last.t], turns = new Axes(pen($("turns"), 0.55), {x, y: bounds(rows.map((each) => each.angle * 180 / Math.PI)), xName: "time [ms]", yName: "turn [°]"});
  turns.line(rows.map((each) => [1e3 * each.t, each.angle * 180 / Math.PI]), COLOURS.friction, 2.2); turns.labels();
  turns.dot([1e3 * row.t, row.angle * 180 / Math.PI], COLOURS.friction, 4.5);
  const most = 1.15 * Math.max(now.grip, now.eased, ...rows.map((each) => each.need || 0));
  const needs = new Axes(pen($("needs"), 0.55), {x, y: [0, most], xName: "time [ms]", yName: "grip of a finger [N]"});
  const pause = Math.min(now.pause, x[1]);
  needs.line([[0, now.eased], [pause, now.eased], ...(pause < x[1] ? [[pause, now.grip], [x[1], now.grip]] : [])], COLOURS.friction, 2.2);
  needs.line(rows.filter((each) => each.need !== null).map((each) => [1e3 * each.t, each.need]), "black", 1.6, DASHES.reference); needs.labels();
  words(needs.pen, "grip", needs.X(0.97 * x[1]), needs.Y(last.grip) - 10, {align: "right", colour: COLOURS.friction, halo: true});
  words(needs.pen, "needed at rest", needs.X(0.97 * x[1]), needs.Y(last.need) + (Math.abs(last.need / last.grip - 1.1) < 0.25 ? 14 : -10), {align: "right", halo: true});
  needs.dot([1e3 * row.t, row.grip], COLOURS.friction, 4.5);
}

const bounds = (values) => {
  const [least, most] = [Math.min(0, ...values), Math.max(0, ...values)], room = 0.08 * (most - least) || 1;
  return [least < 0 || most === 0 ? least - room : 0, most > 0 ? most + room : 0];
};

function drawThrow(t) {
  const now = state.values;
  if (now.tab !== "puck") return;
  const row = rowAt(puckRows, t);
  map = drawMap($("map"), {contact, state: now, twist: row.twist, view: 2.2 * halfSize(now), wrenches: row.twist.some((each) => each) ? contact.surface([row.twist]) : []});
  drawPuck($("puck"), $("history"), {rows: puckRows, t, contact, state: now, mu: now.mu});
}

function draw() {
  const now = state.values, key = [now.shape, now.width, now.height, now.cell, now.map].join();
  if (made !== key) { contact.setPatch(discsOf(now)); made = key; curves = {}; }
  contact.setLaw(law(now.mu));
  for (const tab of Object.keys(TABS)) {
    $(`tab-${tab}`).hidden = now.tab !== tab;
    $(`to-${tab}`).classList.toggle("on", now.tab === tab);
    $(`to-${tab}`).setAttribute("aria-pressed", now.tab === tab);
  }
  const drawn = now.shape === "draw";
  $("painting").hidden = !drawn;
  $("paint").classList.toggle("on", paints); $("move").classList.toggle("on", !paints);
  for (const [name, shows] of Object.entries({width: !drawn, height: now.shape === "rectangle", cell: drawn})) $(name).closest(".control").hidden = !shows;
  $("map").style.cursor = drawn && paints ? "cell" : "";
  DRAW[now.tab](now);
  if (drawn && paints && document.activeElement === $("map")) drawCursor(now);
  $("code").textContent = code(now);
}

// ---------------------------------------------------------------------- painting

function drawCursor(now) {
  const made = $("map").getContext("2d"), side = 1e-3 * now.cell, half = halfSize(now), [x0, y0] = map.place(cursor[0] * side - half, half - cursor[1] * side), [x1, y1] = map.place((cursor[0] + 1) * side - half, half - (cursor[1] + 1) * side);
  made.strokeStyle = "black"; made.lineWidth = 2; made.setLineDash([]); made.strokeRect(x0, y0, x1 - x0, y1 - y0);
}

function paintCell(column, row) {
  if (column < 0 || row < 0 || column >= MAP || row >= MAP) return;
  const at = MAP * row + column, text = state.values.map, painted = text.slice(0, at) + level + text.slice(at + 1);
  if (/[1-9]/.test(painted)) state.set({map: painted});
}

function moved(x, y) {
  const now = state.values;
  if (now.shape === "draw" && paints) {
    const side = 1e-3 * now.cell, half = halfSize(now);
    cursor = [Math.floor((x + half) / side), Math.floor((half - y) / side)].map((each) => Math.min(MAP - 1, Math.max(0, each)));
    if (Math.max(Math.abs(x), Math.abs(y)) < half) paintCell(...cursor);
    return;
  }
  if (now.tab !== "slide") return;
  const omega = now.omega || 1, reach = 300 / Math.abs(omega), clip = (value) => Math.round(10 * Math.min(reach, Math.max(-reach, 1e3 * value))) / 10;
  state.set({omega, vx: Number((clip(y) * omega).toFixed(2)), vy: Number((-clip(x) * omega).toFixed(2))});
}

// ---------------------------------------------------------------------- begin

async function copy(text, said) {
  try { await navigator.clipboard.writeText(text); $("copied").textContent = said; } catch { $("copied").textContent = "The browser does not let pages copy from disk: mark the text instead."; }
  setTimeout(() => { $("copied").textContent = ""; }, 4000);
}

async function begin() {
  $("contact").append(choice(state, "shape", "Shape", SHAPE_NAMES), slider(state, "width", "Width", "mm", [2, 100, 0.5]), slider(state, "height", "Height", "mm", [2, 100, 0.5]),
    slider(state, "cell", "Side of a cell", "mm", [0.2, 5, 0.1]), slider(state, "mu", "Coefficient μ", "", [0.05, 1.5, 0.05]));
  $("tabs").append(...Object.entries(TABS).map(([tab, name]) => element("button", {id: `to-${tab}`, onclick: () => state.set({tab})}, name)));
  $("motion").append(slider(state, "load", "Normal force N", "N", [0.1, 50, 0.1]), slider(state, "vx", "Velocity vx", "mm/s", [-300, 300, 1]),
    slider(state, "vy", "Velocity vy", "mm/s", [-300, 300, 1]), slider(state, "omega", "Spin ω", "rad/s", [-20, 20, 0.1]));
  $("held").append(slider(state, "mass", "Mass", "kg", [0.01, 2, 0.01]), slider(state, "offset", "Offset", "mm", [-60, 60, 0.5]),
    slider(state, "acceleration", "Acceleration up", "m/s²", [-9.8, 20, 0.1]), slider(state, "grip", "Grip of a finger", "N", [0, 40, 0.1]));
  const again = (key, ...given) => { const made = slider(state, key, ...given); made.querySelector("input[type=number]").id = `${key}2`; return made; };
  $("grips").append(again("mass", "Mass", "kg", [0.01, 2, 0.01]), again("offset", "Offset", "mm", [-60, 60, 0.5]), slider(state, "eased", "Eased grip", "N", [0, 40, 0.1]),
    slider(state, "pause", "Eased for", "ms", [5, 300, 5]), again("grip", "Then grip", "N", [0, 40, 0.1]));
  $("throw").append(slider(state, "speed", "Speed", "mm/s", [0, 1000, 10]), slider(state, "spin", "Spin ω", "rad/s", [-60, 60, 1]));
  players.hand = new Player(drawHand, 3); players.puck = new Player(drawThrow, 3);
  $("handplayer").append(players.hand.row); $("puckplayer").append(players.puck.row);
  $("key").append(key({velocity: "velocity of each disc (length: see the map)", friction: "friction on the body", ellipsoid: "what the ellipsoid says", rotation: "centre of rotation", pressure: "centre of pressure", discs: "discs, dark: more pressure"}));
  $("sectionkey").append(key({limit: "limit surface: friction holds loads inside", other: "the ellipsoid"}), element("p", {class: "small"}, "Dot and diamond: the load that keeps the present motion going, friction with its sign turned."));
  $("holdkey").append(key({limit: "limit surface at this grip", other: "the ellipsoid", load: "load of one finger", mass: "centre of mass"}), element("p", {class: "small"}, "The map shows the motion in which the plate would begin to slip. In practice add 25 % to the grip."));

  const bar = element("input", {type: "range", min: 0, max: 9, value: level, "aria-label": "pressure to paint", oninput: () => { level = Number(bar.value); field.textContent = level; }}), field = element("span", {}, String(level));
  $("level").append(element("div", {class: "control"}, element("span", {}, "Pressure"), bar, field, element("span", {}, "of 9")));
  for (const [id, value] of [["paint", true], ["move", false]]) $(id).onclick = () => { paints = value; state.show(); };
  $("clear").onclick = () => state.set({map: "0".repeat(65) + "55" + "0".repeat(10) + "55" + "0".repeat(65)});
  draggable($("map"), (event) => map.back(event), moved, () => { const {vx, vy, omega} = state.values; return omega ? [-1e-3 * vy / omega, 1e-3 * vx / omega] : [0, 0]; }, () => halfSize(state.values) / 20);
  $("map").addEventListener("keydown", (event) => {
    if (state.values.shape !== "draw" || !paints) return;
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
    if (way) cursor = cursor.map((each, i) => Math.min(MAP - 1, Math.max(0, each + way[i])));
    else if (event.key === "Enter" || event.key === " ") paintCell(...cursor);
    else return;
    event.preventDefault(); event.stopImmediatePropagation(); state.show();
  }, true);
  $("copy").onclick = () => copy($("code").textContent, "The code is copied.");
  $("link").onclick = () => copy(location.href, "The link is copied.");
  $("reset").onclick = () => state.set({...FIRST, tab: state.values.tab});
  Object.assign(state.legal, {tab: (text) => Object.hasOwn(TABS, text), map: (text) => new RegExp(`^[0-9]{${MAP * MAP}}$`).test(text) && /[1-9]/.test(text)});
  state.read();
  contact = await Contact.of(moduleBytes(), discsOf(state.values), law(state.values.mu));
  onResize(draw);
  state.show();
}

begin();
