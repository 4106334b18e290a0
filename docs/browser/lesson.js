"use strict";
// The lesson: five tasks, a map, a section and a puck of one contact of 20 mm.

const SHAPE_NAMES = {disc: "disc", fingertip: "soft fingertip", square: "square", ring: "ring", bar: "bar", pads: "two pads"};
const FIRST = {shape: "disc", mu: 1, load: 1, vx: 10, vy: 0, omega: 2, force: 0, torque: 0, task: 1, done: "", width: 20, height: 20};
const VIEW = 0.022;

// Question, formula and answer of each task, and the buttons that set the page.
const TASKS = [
  {
    title: "1. Why does a spinning polisher glide?",
    question: `A polisher moves at 10 mm/s and does not spin. Then its spin grows to 10 rad/s, and nothing else changes. How much of the force of 1 N against its motion is left?`,
    tries: {"no spin": {shape: "disc", vx: 10, vy: 0, omega: 0}, "1 rad/s": {shape: "disc", vx: 10, vy: 0, omega: 1}, "4 rad/s": {shape: "disc", vx: 10, vy: 0, omega: 4}, "10 rad/s": {shape: "disc", vx: 10, vy: 0, omega: 10}},
    drag: `Move the slider <b>spin</b> from 0 to 10 rad/s at vx = 10 mm/s.`,
    see: `The blue arrow gets short although the contact is pressed as before. The thin grey arrows turn sideways.`,
    formula: `f = μN |mean of u/|u||; for a fast spin f ≈ μN v/(ωR)`,
    answer: `At 0, 1, 4 and 10 rad/s the force is <b id="force">1.00, 0.85, 0.25, 0.10</b> N. Friction is spent on the spin: the sideways parts cancel. At 10 rad/s a ring keeps <b id="ring">0.056</b> N and a bar <b id="bar">0.28</b> N.`,
  },
  {
    title: "2. About which point does it turn, and what does that cost?",
    question: `A disc turns about a point at the distance c from its middle. At which c does it have the same share of its largest force and of its largest torque?`,
    tries: {"about the middle": {shape: "disc", vx: 0, vy: 0, omega: 2}, "4 mm": {shape: "disc", vx: 0, vy: -8, omega: 2}, "6.7 mm": {shape: "disc", vx: 0, vy: -13.4, omega: 2}, "10 mm": {shape: "disc", vx: 0, vy: -20, omega: 2}, "20 mm": {shape: "disc", vx: 0, vy: -40, omega: 2}},
    drag: `Drag the ring with the dot from the middle outwards, to 4, 6.7, 10 and 20 mm.`,
    see: `Torque goes, force comes. The blue dot in the section runs along the black line.`,
    formula: `c = v/ω; the largest torque is μNr with r = 2R/3 for a disc`,
    answer: `At 0, 4, 6.7, 10 and 20 mm the force is <b id="shares">0.00, 0.39, 0.63, 0.85, 0.97</b> of μN and the torque <b id="torques">1.00, 0.88, 0.69, 0.42, 0.19</b> of μNr. Both are <b id="both">0.66</b> at <b id="equal">7.1</b> mm. The ellipsoid has 0.71 at c = r = 6.7 mm, which is <b id="much">7</b> % too much.`,
  },
  {
    title: "3. Where does the ellipsoid fail?",
    question: `Two pads turn about the middle of the right pad. How much force and torque does that take, and what does the ellipsoid say?`,
    tries: {"about the right pad": {shape: "pads", vx: 0, vy: -17, omega: 2}, "above the middle": {shape: "pads", vx: 17, vy: 0, omega: 2}},
    drag: `Take two pads. Drag the ring onto the right pad, 8.5 mm from the middle. Then drag it to 8.5 mm above the middle.`,
    see: `About a pad, the black line in the section is straight from corner to corner while the green one is an ellipse. Above the middle both lines meet.`,
    formula: `two points, moved across their line: f/μN + |τ|/μNr = 1; the ellipsoid adds squares`,
    answer: `About the right pad friction is <b id="pad">0.50</b> N and <b id="padtorque">4.95</b> N mm. The ellipsoid has <b id="padellipsoid">0.70</b> N and <b id="padellipsoidtorque">6.09</b> N mm, <b id="padmuch">41 and 23</b> % too much. A pad that turns about itself has almost no force, so only the other pad does. Above the middle both pads slide equally fast.`,
  },
  {
    title: "4. Will it hold?",
    question: `A plate of 0.2 kg hangs between two fingers, its centre of mass 12 mm aside of them. Each finger carries 0.98 N and 11.8 N mm; μ = 0.6. Which shape of the fingertip holds the plate with the smallest normal force N?`,
    tries: Object.fromEntries(Object.entries(SHAPE_NAMES).map(([shape, name]) => [name, {shape, mu: 0.6, load: 3, force: 0.981, torque: 11.77, vx: 0, vy: -10, omega: -1}])),
    drag: `Choose a shape, then move the slider <b>normal force N</b> until the load is inside the black line. You can drag the load itself in the section.`,
    see: `The black line grows with N. The load stays where it is.`,
    formula: `N = max over motions of (load · motion) / (μ × dissipation at N = 1)`,
    answer: `Least normal force: ring <b id="holdring">3.0</b> N, square <b id="holdsquare">3.2</b> N, disc <b id="holddisc">3.5</b> N, two pads <b id="holdpads">3.6</b> N, fingertip <b id="holdfingertip">3.8</b> N, bar <b id="holdbar">4.5</b> N. For two pads the ellipsoid says <b id="holdellipsoid">2.8</b> N, and the plate falls. In practice add 25 %.`,
  },
  {
    title: "5. A thrown puck: which stops first, slide or spin?",
    question: `A puck is thrown at 100 mm/s, once without spin and once with 10 rad/s; μ = 0.2. Which one slides further, and does its slide end before its spin?`,
    tries: {"no spin": {shape: "disc", mu: 0.2, vx: 100, vy: 0, omega: 0}, "10 rad/s": {shape: "disc", mu: 0.2, vx: 100, vy: 0, omega: 10}, "160 mm/s, 4 rad/s": {shape: "disc", mu: 0.2, vx: 160, vy: 0, omega: 4}, "a bar": {shape: "bar", mu: 0.2, vx: 100, vy: 0, omega: 10}},
    drag: `Press a button above, then play. The slider below the puck moves the time.`,
    see: `Two curves that reach zero together, for a disc, a ring and a square. For a bar one of them fades first.`,
    formula: `dv/dt = −μ g f(v/ωr), dω/dt = −μ g τ/k²`,
    answer: `Without spin it slides <b id="slide">2.5</b> mm in <b id="slidetime">51</b> ms, with spin <b id="spun">3.2</b> mm in <b id="spuntime">68</b> ms: it slides further because it spins. From every start with both, a disc ends near v/(ωR) = <b id="ratio">0.65</b>, so slide and spin stop together.`,
  },
];

let contact, map, section, player, rows = [], last = "", showsPieces = false, curves = {};
const state = new State(FIRST, () => contact && draw());

// ---------------------------------------------------------------------- cards

function makeTasks() {
  const done = () => new Set([...state.values.done].filter((each) => "12345".includes(each)));
  TASKS.forEach((task, i) => {
    const answer = element("div", {class: "answer", id: `answer${i + 1}`, hidden: ""}), tick = element("span", {class: "tick"});
    const guess = element("input", {type: "text", id: `guess${i + 1}`, placeholder: "your guess", oninput: () => { show.disabled = !guess.value.trim(); },
      onkeydown: (event) => { if (event.key === "Enter" && !show.disabled) show.click(); }});
    const show = element("button", {id: `show${i + 1}`, disabled: "", onclick: () => state.set({done: [...done().add(String(i + 1))].sort().join("")})}, "Show the answer");
    const tries = element("div", {class: "row tries"}, "Try:", ...Object.entries(task.tries).map(([name, more]) =>
      element("button", {onclick: () => { state.set({...FIRST, task: i + 1, done: state.values.done, ...more}); if (i === 4) player.play(); }}, name)));
    const body = element("div");
    answer.innerHTML = `<p>${task.answer}</p>`;
    body.innerHTML = `<p>${task.question}</p>`;
    const more = element("div");
    more.innerHTML = `<p><b>Drag.</b> ${task.drag}</p><p><b>See.</b> ${task.see}</p><p><b>Formula.</b> <span class="formula">${task.formula}</span></p>`;
    body.append(tries, more, element("label", {class: "guess"}, guess, show), answer);
    const card = element("details", {class: "card", id: `task${i + 1}`}, element("summary", {}, task.title, tick), body);
    card.querySelector("summary").addEventListener("click", (event) => {
      event.preventDefault();
      const opens = state.values.task !== i + 1;
      state.set({...(opens ? {...FIRST, done: state.values.done, ...Object.values(task.tries)[0]} : {}), task: opens ? i + 1 : 0});
    });
    $("tasks").append(card);
    state.shown.push(() => {
      const known = done().has(String(i + 1));
      card.open = state.values.task === i + 1;
      answer.hidden = !known;
      tick.textContent = known ? "✓ answered" : "";
    });
  });
}

// ---------------------------------------------------------------------- the widgets

const twistOf = ({vx, vy, omega}) => [1e-3 * vx, 1e-3 * vy, omega];
// Bristles of 1 nm: friction of Coulomb, as in the formulas.
const law = (mu) => ({mu_c: mu, mu_s: mu, sigma_0: 1e9, sigma_1: 0, sigma_2: 0, elasto_plastic: 0.9});

// Direction of the section: that of the motion, or of the weight while there is a load.
function direction({vx, vy, force, torque}) {
  if (force || torque) return [0, -1, 0];
  const speed = Math.hypot(vx, vy);
  return speed ? [vx / speed, vy / speed, 0] : [1, 0, 0];
}

function draw() {
  const now = state.values, twist = twistOf(now), strength = now.mu * now.load, way = direction(now);
  if (last !== now.shape) { contact.setPatch(discsOf(now)); last = now.shape; curves = {}; }
  contact.setLaw(law(now.mu));
  const wrenches = [contact.surface([twist])[0], contact.surface([twist], true)[0]];
  map = drawMap($("map"), {contact, state: now, twist, view: VIEW, wrenches, friction: showsPieces});

  $("numbers").innerHTML = "<tr><th></th><th>fx [N]</th><th>fy [N]</th><th>torque [N mm]</th></tr>" + wrenches.map((each, k) =>
    `<tr class="${["friction", "ellipsoid"][k]}"><td>${["Friction", "Ellipsoid"][k]}</td>` +
    each.map((part, i) => `<td>${minus((strength * part * (i === 2 ? 1e3 : 1)).toFixed(3))}</td>`).join("") + "</tr>").join("");

  const name = way.join();
  curves[name] ||= sectionOf(contact, way, [0, 0, now.force || now.torque ? -1 : 1]);
  const sign = now.force || now.torque ? -1 : 1;
  const loadOf = ([fx, fy, tau]) => [-(fx * way[0] + fy * way[1]), -sign * tau / contact.radius];
  const weighs = now.force || now.torque, scale = [strength, 1e3 * strength * contact.radius];
  const load = weighs ? [now.force / scale[0], now.torque / scale[1]] : null;
  section = drawSection($("section"), curves[name], {
    xName: weighs ? "force down / μN" : "force along the motion / μN", yName: "torque / μNr", second: [[scale[0], "[N]"], [scale[1], "[N mm]"]],
    points: weighs ? [] : wrenches.map(loadOf), load,
  });
  const verdict = $("verdict");
  verdict.hidden = !weighs;
  if (weighs) {
    const {force, ellipsoid} = contact.holding([0, -now.force, -1e-3 * now.torque], now.mu), holds = now.load >= force;
    verdict.className = `verdict ${holds ? "holds" : "slips"}`;
    verdict.textContent = `${holds ? `Holds, ${(100 * (now.load / force - 1)).toFixed(0)} % in hand` : `Slips, ${(100 * (1 - now.load / force)).toFixed(0)} % too little`}: needs ${force.toFixed(2)} N. The ellipsoid says ${ellipsoid.toFixed(2)} N.`;
  }

  const inertia = gyration(contact);
  rows = puckRun(contact, twist, now.mu, 1, inertia);
  player.end = rows[rows.length - 1].t || 1e-3;
  player.show();
  $("ends").textContent = `${puckEnd(rows, contact)} Slide and spin of a disc, a ring and a square end together; those of a bar do not.`;
}

const drawRun = (t) => drawPuck($("puck"), $("history"), {rows, t, contact, state: state.values, mu: state.values.mu});

async function begin() {
  makeTasks();
  player = new Player(drawRun, 5);
  $("player").append(player.row);
  $("key").append(key({velocity: "velocity of each piece (its length: the key in the map)", friction: "friction on the body, where it acts", ellipsoid: "what the ellipsoid says", rotation: "centre of rotation", pressure: "middle of the load", discs: "24 discs that stand for the contact"}));
  $("sectionkey").append(key({limit: "limit surface: inside, friction holds a load", other: "the ellipsoid", load: "load on the body (down, as a weight)"}));
  $("sectionkey").append(element("p", {class: "small"}, "Dot and diamond: the load that keeps the present motion going, friction with its sign turned."));
  $("motion").append(choice(state, "shape", "Contact", SHAPE_NAMES),
    slider(state, "mu", "Coefficient μ", "", [0.05, 1.5, 0.05]), slider(state, "load", "Normal force N", "N", [0.5, 10, 0.1]),
    slider(state, "vx", "Velocity vx", "mm/s", [-160, 160, 1]), slider(state, "vy", "Velocity vy", "mm/s", [-160, 160, 1]), slider(state, "omega", "Spin", "rad/s", [-10, 10, 0.1]));
  $("loads").append(slider(state, "force", "Load: force down", "N", [0, 5, 0.01]), slider(state, "torque", "Load: torque", "N mm", [-40, 40, 0.1]));
  $("reset").onclick = () => state.set({...FIRST, task: state.values.task, done: state.values.done});
  $("pieces").onclick = (event) => {
    showsPieces = !showsPieces;
    event.target.textContent = showsPieces ? "Show the velocity of each piece" : "Show the friction of each piece";
    event.target.setAttribute("aria-pressed", showsPieces);
    state.show();
  };
  const clip = (value, most) => Math.round(10 * Math.min(most, Math.max(-most, value))) / 10;
  draggable($("map"), (event) => map.back(event), (x, y) => {
    const omega = state.values.omega || 1, reach = 160 / Math.abs(omega);
    state.set({omega, vx: Number((clip(1e3 * y, reach) * omega).toFixed(2)), vy: Number((-clip(1e3 * x, reach) * omega).toFixed(2))});
  }, () => { const {vx, vy, omega} = state.values; return omega ? [-1e-3 * vy / omega, 1e-3 * vx / omega] : [0, 0]; }, () => 5e-4);
  const scales = () => { const strength = state.values.mu * state.values.load; return [strength, 1e3 * strength * contact.radius]; };
  draggable($("section"), (event) => section.back(event), (x, y) => {
    const [a, b] = scales();
    state.set({force: Math.round(1e3 * Math.min(5, Math.max(0, a * x))) / 1e3, torque: Math.round(100 * Math.min(40, Math.max(-40, b * y))) / 100});
  }, () => { const [a, b] = scales(); return [state.values.force / a, state.values.torque / b]; }, () => 0.02);
  if (location.protocol === "file:") $("theory").href = "../physics.md";
  Object.assign(state.legal, {task: [0, 5], done: (text) => /^[1-5]{1,5}$/.test(text)});
  state.read();
  contact = await Contact.of(moduleBytes(), discsOf(state.values), law(1));
  onResize(draw);
  window.addEventListener("beforeprint", () => { for (const card of document.querySelectorAll("details.card")) card.open = true; });
  window.addEventListener("afterprint", () => state.show());
  state.show();
}

begin();
