"use strict";
// The friction of one contact: all numbers come from the module that docs/make_wasm.py compiles from the library.

class Contact {
  static async of(module, discs, law) {
    const {instance} = await WebAssembly.instantiate(module, {}), contact = new Contact(instance.exports);
    contact.setPatch(discs);
    contact.setLaw(law);
    return contact;
  }

  constructor(kernels) {
    this.kernels = kernels;
    this.room = new Float64Array(kernels.memory.buffer, kernels.room());
  }

  call(name, numbers, ...given) {
    this.room.set(numbers);
    const code = this.kernels[name](...given);
    if (code) throw new Error(`${name}: ${{2: "a number is out of range", 3: "no twist found", 4: "not converged"}[code]}`);
    return this.room;
  }

  // Discs [x, y, radius, weight] in m; only ratios of the weights matter.
  setPatch(discs) {
    if (discs.length > this.kernels.most()) throw new Error(`at most ${this.kernels.most()} discs`);
    const room = this.call("patch", [0, 1, 2, 3].flatMap((i) => discs.map((disc) => disc[i])), discs.length);
    this.discs = discs;
    [this.x, this.y, this.radius] = room;
  }

  // Numbers of `planarfriction.LuGre`; with `elasto_plastic`, the breakaway ratio, bristles are elastic up to that.
  setLaw({sigma_0 = 1e6, sigma_1 = 8e2, sigma_2 = 0.2, mu_c = 1, mu_s = mu_c, v_s = 1e-3, elasto_plastic = 0} = {}) {
    this.call("law", [sigma_0, sigma_1, sigma_2, mu_c, mu_s, v_s, elasto_plastic || 0.5, elasto_plastic ? 1 : 0]);
  }

  rest() { this.kernels.rest(); }

  // Wrench (fx, fy, tau) at the end of a step at a twist (vx, vy, omega).
  step(twist, load, dt) { return [...this.call("step", [...twist, load, dt]).slice(0, 3)]; }

  // Wrench of steady sliding.
  steady(twist, load) { return [...this.call("steady", [...twist, load]).slice(0, 3)]; }

  // Wrenches of sliding per unit of mu f_N, of the discs or of the ellipsoid with their largest force and torque.
  surface(twists, ellipsoid = false) {
    const room = this.call("surface", twists.flat(), twists.length, ellipsoid ? 1 : 0);
    return twists.map((_, i) => [...room.slice(3 * i, 3 * i + 3)]);
  }

  // Friction (fx, fy) of each disc in that.
  pieces(twist) {
    const room = this.call("pieces", twist);
    return this.discs.map((_, i) => [room[2 * i], room[2 * i + 1]]);
  }

  // Least normal force that holds a load (fx, fy, tau), the twist in which it would begin to slip, and what the ellipsoid says.
  holding(load, mu) {
    const [force, vx, vy, omega, ellipsoid] = this.call("holding", [...load, mu]);
    return {force, twist: [vx, vy, omega], ellipsoid};
  }

  // A body on the contact, whose place [x, y, angle] is seen from the centre of mass: its twist after dt, and the friction on it.
  bodyStep({twist, applied, load, dt, mass, inertia, place}) {
    const room = this.call("body_step", [...twist, ...applied, load, dt, mass, inertia, ...place]);
    return {twist: [...room.slice(0, 3)], friction: [...room.slice(3, 6)]};
  }
}

if (typeof module !== "undefined") module.exports = {Contact};
