"""Roll-outs of the reduced model's step, and their exact derivatives: backwards (adjoint) and forwards (sensitivities).

One contact has a row of numbers: the law (9, `kernels.law`) and the shape (cop_x, cop_y, r, <rho^2>), as in
`reduced.step_one`; its gradients have the same order. `surface` is `(kind, start, size)` of `kernels.surfaces`, whose
numbers are held fixed: `r` acts through `V_S` alone. Twist and load are held over each step.

With cotangents `W'` of the wrench and `z'` of the new state, one step backwards is

    t = -((sigma_0 - sigma_1 k) n + sigma_1 u),   n' = -(sigma_0 - sigma_1 k) F + S z',   k' = sigma_1 F . n

with `F` the cotangent of the scaled traction `t`, then `bristle_step.pull_back`, and `V_S' = (du/dV_S)' u' + v' V_S/v`.
A step without load forgets its bristle: it passes on no gradient but that of the load, the wrench per unit load that
the smallest load would have.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.kernels import bristle_step, inlined, jit, kernel, reduced
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels.bristle_step import BristleStep
from planarfriction.kernels.law import law_of
from planarfriction.kernels.surfaces import sliding, sliding_jacobian

NUMBERS = 13
"""Numbers of a contact."""

# Nearer to the spin axis (sine of the angle, squared) u is looked up: the product of its Jacobian with V_S, which is
# the same and costs less, loses digits to the large slopes there, and the Jacobian is not quite that of this place.
_NEAR_AXIS = 1e-6


class Step(NamedTuple):
    """A step with all that its cotangents need."""

    x: float
    """Scaled twist."""
    y: float
    s: float
    v: float
    ux: float
    uy: float
    us: float
    per_h: float
    q: float
    """Grip."""
    stribeck: tuple
    """Friction coefficient and its partial derivatives."""
    zx: float
    """Scaled bristle before the step."""
    zy: float
    zs: float
    bristle: BristleStep


@inlined
def _linearise(row, surface, data, z, twist, dt, slope):
    """Step from the raw state `z`; `du/dV_S` goes into `slope` [9]."""
    law = law_of(row)
    x, y, s = twist[0] - twist[2] * row[10], twist[1] + twist[2] * row[9], row[11] * twist[2]
    v = math.sqrt(x * x + y * y + s * s)
    sliding_jacobian(surface[0], data, surface[1], surface[2], x, y, s, v, slope)
    if x * x + y * y > _NEAR_AXIS * s * s:
        ux = slope[0] * x + slope[1] * y + slope[2] * s
        uy = slope[3] * x + slope[4] * y + slope[5] * s
        us = slope[6] * x + slope[7] * y + slope[8] * s
    else:
        ux, uy, us = sliding(surface[0], data, surface[1], surface[2], x, y, s, v)
    h = math.sqrt(ux * ux + uy * uy + us * us) / v if v > 0.0 else 1.0
    per_h = 1.0 / h
    curve = formulas.stribeck_partials(xp, v, law.mu_c, law.mu_s, law.v_s, law.gamma)
    q = law.sigma_0 / curve[0]
    zx, zy, zs = z[0], z[1], z[2] / row[11]
    bristle = bristle_step.linearise(law, zx, zy, zs, ux, uy, us, v, per_h, q, dt)
    return Step(x, y, s, v, ux, uy, us, per_h, q, curve, zx, zy, zs, bristle)


@inlined
def _pull_back(row, step, twist, load, dt, slope, w, out, z_bar, twist_bar, row_bar):
    """Write the cotangent of `z` and `twist`, add that of the row, return that of the load.

    `w`, `out`: cotangents of the wrench and of the new raw state; `z_bar` may be `out`.
    """
    law, b = law_of(row), step.bristle
    cx, cy, r, moment = row[9], row[10], row[11], row[12]
    omega = twist[2]
    # wrench: force and torque about the origin from traction about the centre of pressure
    zdx, zdy, zds = step.ux - b.k * b.nx, step.uy - b.k * b.ny, step.us - b.k * b.ns
    fx = formulas.traction(b.nx, zdx, step.x, law.sigma_0, law.sigma_1, law.sigma_2)
    fy = formulas.traction(b.ny, zdy, step.y, law.sigma_0, law.sigma_1, law.sigma_2)
    fs = formulas.traction(b.ns, zds, 0.0, law.sigma_0, law.sigma_1, law.sigma_2)
    drag = formulas.traction(0.0, 0.0, moment * omega, law.sigma_0, law.sigma_1, law.sigma_2)
    load_bar = w[0] * fx + w[1] * fy + w[2] * (r * fs + drag + cx * fy - cy * fx)
    if load == 0.0:
        for i in range(3):
            z_bar[i], twist_bar[i] = 0.0, 0.0
        return load_bar
    wt = load * w[2]
    gx, gy, gs = load * w[0] - cy * wt, load * w[1] + cx * wt, r * wt
    cx_bar, cy_bar, r_bar = wt * fy, -wt * fx, wt * fs + out[2] * b.ns
    row_bar[0] -= gx * b.nx + gy * b.ny + gs * b.ns
    row_bar[1] -= gx * zdx + gy * zdy + gs * zds
    row_bar[2] -= gx * step.x + gy * step.y + wt * moment * omega
    row_bar[12] -= law.sigma_2 * omega * wt
    pull = law.sigma_0 - law.sigma_1 * b.k
    zx, zy, zs, ux, uy, us, v_bar, h_bar, q_bar, breakaway_bar = bristle_step.pull_back(
        b, step.zx, step.zy, step.zs, step.ux, step.uy, step.us, step.per_h, step.q, dt,
        out[0] - pull * gx, out[1] - pull * gy, r * out[2] - pull * gs,
        law.sigma_1 * (gx * b.nx + gy * b.ny + gs * b.ns),
    )  # fmt: skip
    row_bar[8] += breakaway_bar
    z_bar[0], z_bar[1], z_bar[2] = zx, zy, zs / r
    r_bar -= z_bar[2] * step.zs
    # h = |u|/v, and the grip q = sigma_0/g(v)
    per_v = 1.0 / step.v if step.v > 0.0 else 0.0
    u_norm_bar = h_bar * per_v * per_v * step.per_h  # per |u|: its gradient is u/|u|
    ux, uy, us = ux - law.sigma_1 * gx, uy - law.sigma_1 * gy, us - law.sigma_1 * gs
    ux, uy, us = ux + u_norm_bar * step.ux, uy + u_norm_bar * step.uy, us + u_norm_bar * step.us
    g, by_speed, by_mu_c, by_mu_s, by_v_s, by_gamma = step.stribeck
    row_bar[0] += q_bar / g
    g_bar = -q_bar * step.q / g
    row_bar[3] += g_bar * by_mu_c
    row_bar[4] += g_bar * by_mu_s
    row_bar[5] += g_bar * by_v_s
    row_bar[6] += g_bar * by_gamma
    along = (v_bar + g_bar * by_speed - h_bar * per_v / step.per_h) * per_v
    x_bar = slope[0] * ux + slope[3] * uy + slope[6] * us + along * step.x - law.sigma_2 * gx
    y_bar = slope[1] * ux + slope[4] * uy + slope[7] * us + along * step.y - law.sigma_2 * gy
    s_bar = slope[2] * ux + slope[5] * uy + slope[8] * us + along * step.s
    # V_S = (vx - cy omega, vy + cx omega, r omega)
    twist_bar[0], twist_bar[1] = x_bar, y_bar
    twist_bar[2] = r * s_bar + cx * y_bar - cy * x_bar - law.sigma_2 * moment * wt
    row_bar[9] += cx_bar + omega * y_bar
    row_bar[10] += cy_bar - omega * x_bar
    row_bar[11] += r_bar + omega * s_bar
    return load_bar


@inlined
def _advance(row, shape, surface, data, z, twist, load, dt, wrench):
    fx, fy, tau = reduced.step(law_of(row), z, twist[0], twist[1], twist[2], shape, surface, data, dt, z)
    wrench[0], wrench[1], wrench[2] = load * fx, load * fy, load * tau
    if load == 0.0:
        z[0], z[1], z[2] = 0.0, 0.0, 0.0
        wrench[0], wrench[1], wrench[2] = 0.0, 0.0, 0.0


@inlined
def _of(b, count):
    """Which of `count` rows belongs to contact b: its own, or the one that all share."""
    return b if count > 1 else 0


@jit
def rollout(rows, surface, data, z, twist, load, dt, first, last, wrench, states):
    """Steps of the contacts `first` to `last`: `z` [B, 3] in place, wrenches into `wrench` [B, T, 3].

    `rows` [B or 1, 13], `twist` [B or 1, T, 3], `load` [B or 1, T], `dt` [T]. The state before each step goes into
    `states` [B, T, 3], unless that is empty.
    """
    for b in range(first, last):
        row, twists, loads = rows[_of(b, len(rows))], twist[_of(b, len(twist))], load[_of(b, len(load))]
        for t in range(dt.shape[0]):
            if states.shape[1] > 0:
                states[b, t, 0], states[b, t, 1], states[b, t, 2] = z[b, 0], z[b, 1], z[b, 2]
            _advance(row, row[9:], surface, data, z[b], twists[t], loads[t], dt[t], wrench[b, t])


@jit
def gradient(
    rows, surface, data, states, twist, load, dt, wrench_bar, first, last, z_bar, twist_bar, load_bar, row_bar
):
    """Adjoint of `rollout` with its `states`; `z_bar` [B, 3] comes in as the cotangent of the state at the end.

    `wrench_bar` [B or 1, T, 3]; `twist_bar` [B, T, 3] and `load_bar` [B, T] are written, `row_bar` [B, 13] is added to.
    """
    slope = np.empty(9)
    for b in range(first, last):
        row, twists, loads = rows[_of(b, len(rows))], twist[_of(b, len(twist))], load[_of(b, len(load))]
        cotangents = wrench_bar[_of(b, len(wrench_bar))]
        for t in range(dt.shape[0] - 1, -1, -1):
            step = _linearise(row, surface, data, states[b, t], twists[t], dt[t], slope)
            load_bar[b, t] = _pull_back(
                row, step, twists[t], loads[t], dt[t], slope, cotangents[t], z_bar[b], z_bar[b], twist_bar[b, t],
                row_bar[b],
            )  # fmt: skip


@kernel
def _jacobian(row, surface, data, z, twist, load, dt, work, out):
    """Slopes of wrench and new state (6 rows) to `z` (3), `twist` (3), load and row (13) into `out` [6, 20]."""
    slope, unit = work[:9], work[9:]
    step = _linearise(row, surface, data, z, twist, dt, slope)
    for i in range(6):
        for m in range(6):
            unit[m] = 0.0
        unit[i] = 1.0
        for m in range(20):
            out[i, m] = 0.0
        out[i, 6] = _pull_back(
            row, step, twist, load, dt, slope, unit[:3], unit[3:], out[i, :3], out[i, 3:6], out[i, 7:]
        )


@jit
def jacobians(rows, surface, data, z, twist, load, dt, out):
    """`_jacobian` of each of B steps into `out` [B, 6, 20]: `z`, `twist` [B, 3], `load`, `dt` [B]."""
    work = np.empty(15)
    for b in range(z.shape[0]):
        _jacobian(rows[_of(b, len(rows))], surface, data, z[b], twist[b], load[b], dt[b], work, out[b])


@jit
def sensitivities(rows, surface, data, z, twist, load, dt, columns, first, last, wrench, d_wrench):
    """`rollout` with the derivatives of the wrenches to the numbers `columns` [P] into `d_wrench` [B, T, 3, P]."""
    count = columns.shape[0]
    work, slopes, d_z, new = np.empty(15), np.empty((6, 20)), np.empty((3, count)), np.empty((3, count))
    for b in range(first, last):
        row, twists, loads = rows[_of(b, len(rows))], twist[_of(b, len(twist))], load[_of(b, len(load))]
        d_z[:] = 0.0
        for t in range(dt.shape[0]):
            _jacobian(row, surface, data, z[b], twists[t], loads[t], dt[t], work, slopes)
            _advance(row, row[9:], surface, data, z[b], twists[t], loads[t], dt[t], wrench[b, t])
            for i in range(3):
                for p in range(count):
                    d_wrench[b, t, i, p] = slopes[i, 7 + columns[p]]
                    new[i, p] = slopes[3 + i, 7 + columns[p]]
                    for j in range(3):
                        d_wrench[b, t, i, p] += slopes[i, j] * d_z[j, p]
                        new[i, p] += slopes[3 + i, j] * d_z[j, p]
            d_z[:] = new
