"""The step of the reduced model, differentiated, and what needs its derivatives one contact at a time.

One contact has a row of numbers: the law (`kernels.law`) and the shape (cop_x, cop_y, r, <rho^2>), as in
`published_step.step_one`; its gradients have the same order. `surface` is `(kind, start, size)` of `kernels.surfaces`,
whose numbers are held fixed: `r` acts through `V_S` alone.

With cotangents `W'` of the wrench and `z'` of the new state, one step backwards is

    t = -((sigma_0 - sigma_1 k) n + sigma_1 u),   n' = -(sigma_0 - sigma_1 k) F + S z',   k' = sigma_1 F . n

with `F` the cotangent of the scaled traction `t`, then `bristle_step.pull_back`, and `V_S' = (du/dV_S)' u' + v' V_S/v`.
A step without load forgets its bristle: it passes on no gradient but that of the load, the wrench per unit load that
the smallest load would have. `linearise` and `pull_back` have no branches, so that loops over contacts vectorise.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.kernels import bristle_step, inlined, jit, kernel
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels.bristle_step import BristleStep
from planarfriction.kernels.law import LAW, law_of
from planarfriction.kernels.surfaces import sliding, sliding_jacobian

NUMBERS = LAW + 4
"""Numbers of a contact."""


class Shape(NamedTuple):
    """Numbers of a reduced shape."""

    x: float
    """Centre of pressure."""
    y: float
    r: float
    moment: float
    """<rho^2>"""


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
    h: float
    q: float
    """Grip."""
    stribeck: tuple
    """Friction coefficient and its partial derivatives."""
    zx: float
    """Scaled bristle before the step."""
    zy: float
    zs: float
    bristle: BristleStep


class Cotangents(NamedTuple):
    """Cotangents of all inputs of a step; the numbers of law and shape in the order of a contact's row."""

    zx: float
    zy: float
    zt: float
    vx: float
    vy: float
    omega: float
    load: float
    sigma_0: float
    sigma_1: float
    sigma_2: float
    mu_c: float
    mu_s: float
    v_s: float
    gamma: float
    elasto_plastic: float
    breakaway_ratio: float
    creep_speed: float
    """Held: zero."""
    centre_x: float
    centre_y: float
    contact_radius: float
    second_moment: float


@inlined
def scaled_twist(shape, vx, vy, omega):
    """Twist at the centre of pressure, spin times the contact radius."""
    return vx - omega * shape.y, vy + omega * shape.x, shape.r * omega


@inlined
def linearise(law, shape, x, y, s, ux, uy, us, zx, zy, zt, dt):
    """Step from the raw state `z` at the scaled twist `(x, y, s)`, whose sliding is `u`."""
    v = math.sqrt(x * x + y * y + s * s)
    h = math.sqrt(ux * ux + uy * uy + us * us) / xp.where(v > 0.0, v, 1.0)
    h = xp.where(v > 0.0, h, 1.0)
    stribeck = formulas.stribeck_partials(xp, v, law)
    q = law.sigma_0 / stribeck[0]
    zs = zt / shape.r
    bristle = bristle_step.linearise(law, zx, zy, zs, ux, uy, us, v, 1.0 / h, q, dt)
    return Step(x, y, s, v, ux, uy, us, h, q, stribeck, zx, zy, zs, bristle)


@inlined
def traction(law, step):
    """Scaled traction about the centre of pressure; its third component without the viscous term."""
    b = step.bristle
    fx = formulas.traction(b.nx, step.ux - b.k * b.nx, step.x, law)
    fy = formulas.traction(b.ny, step.uy - b.k * b.ny, step.y, law)
    return fx, fy, formulas.traction(b.ns, step.us - b.k * b.ns, 0.0, law)


@inlined
def wrench(law, shape, step, omega):
    """Wrench about the origin per unit load."""
    fx, fy, fs = traction(law, step)
    spin = formulas.traction(0.0, 0.0, shape.moment * omega, law)
    return fx, fy, shape.r * fs + spin + shape.x * fy - shape.y * fx


@inlined
def pull_back(law, shape, step, slope, omega, load, dt, wx, wy, wt, zx, zy, zt):
    """`Cotangents` from those of the wrench and of the new raw state; `slope`: `du/dV_S`, nine numbers."""
    b, cx, cy, r = step.bristle, shape.x, shape.y, shape.r
    f = traction(law, step)
    w = wrench(law, shape, step, omega)
    load_bar = wx * w[0] + wy * w[1] + wt * w[2]
    loaded = xp.where(load == 0.0, 0.0, 1.0)
    zx, zy, zt = loaded * zx, loaded * zy, loaded * zt
    wt = load * wt
    gx, gy, gs = load * wx - cy * wt, load * wy + cx * wt, r * wt
    g_n = gx * b.nx + gy * b.ny + gs * b.ns
    g_u = gx * step.ux + gy * step.uy + gs * step.us
    pull = law.sigma_0 - law.sigma_1 * b.k
    nx, ny, ns, ux, uy, us, v_bar, h_bar, q_bar, breakaway_bar = bristle_step.pull_back(
        b, step.zx, step.zy, step.zs, step.ux, step.uy, step.us, 1.0 / step.h, step.q, dt,
        zx - pull * gx, zy - pull * gy, r * zt - pull * gs, law.sigma_1 * g_n,
    )  # fmt: skip
    # h = |u|/v, and the grip q = sigma_0/g(v)
    per_v = xp.where(step.v > 0.0, 1.0 / xp.where(step.v > 0.0, step.v, 1.0), 0.0)
    stretch = h_bar * per_v * per_v / step.h
    ux, uy, us = ux - law.sigma_1 * gx, uy - law.sigma_1 * gy, us - law.sigma_1 * gs
    ux, uy, us = ux + stretch * step.ux, uy + stretch * step.uy, us + stretch * step.us
    g, by_speed, by_mu_c, by_mu_s, by_v_s, by_gamma = step.stribeck
    g_bar = -q_bar * step.q / g
    along = (v_bar + g_bar * by_speed - h_bar * per_v * step.h) * per_v
    x_bar = slope[0] * ux + slope[3] * uy + slope[6] * us + along * step.x - law.sigma_2 * gx
    y_bar = slope[1] * ux + slope[4] * uy + slope[7] * us + along * step.y - law.sigma_2 * gy
    s_bar = slope[2] * ux + slope[5] * uy + slope[8] * us + along * step.s
    turn = law.sigma_2 * wt
    return Cotangents(
        nx, ny, ns / r,
        # V_S = (vx - cy omega, vy + cx omega, r omega)
        x_bar, y_bar, r * s_bar + cx * y_bar - cy * x_bar - turn * shape.moment, load_bar,
        q_bar / g - g_n, b.k * g_n - g_u, -(gx * step.x + gy * step.y + wt * shape.moment * omega),
        g_bar * by_mu_c, g_bar * by_mu_s, g_bar * by_v_s, g_bar * by_gamma, 0.0, breakaway_bar, 0.0,
        wt * f[1] + omega * y_bar, -wt * f[0] - omega * x_bar,
        wt * f[2] + zt * b.ns - ns * step.zs / r + omega * s_bar, -turn * omega,
    )  # fmt: skip


# ---------------------------------------------------------------------- one contact at a time


@inlined
def shape_of(row):
    """Shape of a contact's row."""
    return Shape(row[LAW], row[LAW + 1], row[LAW + 2], row[LAW + 3])


@inlined
def row_of(b, count):
    """Which of `count` rows belongs to contact b: its own, or the one that all share."""
    return b if count > 1 else 0


@kernel
def _jacobian(row, surface, data, z, twist, load, dt, work, out):
    """Slopes of wrench and new state (6 rows) to `z` (3), `twist` (3), load and row into `out` [6, 7 + NUMBERS].

    Returns the wrench per unit load and the new state.
    """
    law, shape, j = law_of(row), shape_of(row), work[:9]
    x, y, s = scaled_twist(shape, twist[0], twist[1], twist[2])
    v = math.sqrt(x * x + y * y + s * s)
    ux, uy, us = sliding(surface[0], data, surface[1], surface[2], x, y, s, v)
    sliding_jacobian(surface[0], data, surface[1], surface[2], x, y, s, v, j)
    slope = (j[0], j[1], j[2], j[3], j[4], j[5], j[6], j[7], j[8])
    step = linearise(law, shape, x, y, s, ux, uy, us, z[0], z[1], z[2], dt)
    unit = work[9:]
    for i in range(6):
        for m in range(6):
            unit[m] = 1.0 if m == i else 0.0
        found = pull_back(
            law, shape, step, slope, twist[2], load, dt, unit[0], unit[1], unit[2], unit[3], unit[4], unit[5]
        )
        for m in range(7 + NUMBERS):
            out[i, m] = found[m]
    w, b = wrench(law, shape, step, twist[2]), step.bristle
    return w[0], w[1], w[2], b.nx, b.ny, shape.r * b.ns


@jit
def jacobians(rows, surface, data, z, twist, load, dt, out):
    """`_jacobian` of each of B steps into `out` [B, 6, 7 + NUMBERS]: `z`, `twist` [B, 3], `load`, `dt` [B]."""
    work = np.empty(15)
    for b in range(z.shape[0]):
        _jacobian(rows[row_of(b, len(rows))], surface, data, z[b], twist[b], load[b], dt[b], work, out[b])


@jit
def sensitivities(rows, surface, data, z, twist, load, dt, columns, first, last, wrenches, d_wrench):
    """Roll-outs with the derivatives of the wrenches to the numbers `columns` [P] into `d_wrench` [B, T, 3, P].

    Arguments as those of `published_rollout.rollout`.
    """
    count = columns.shape[0]
    work, slopes, d_z, new = np.empty(15), np.empty((6, 7 + NUMBERS)), np.empty((3, count)), np.empty((3, count))
    for b in range(first, last):
        row, twists, loads = rows[row_of(b, len(rows))], twist[row_of(b, len(twist))], load[row_of(b, len(load))]
        d_z[:] = 0.0
        for t in range(dt.shape[0]):
            found = _jacobian(row, surface, data, z[b], twists[t], loads[t], dt[t], work, slopes)
            for i in range(3):
                wrenches[b, t, i] = loads[t] * found[i] if loads[t] != 0.0 else 0.0
                z[b, i] = found[3 + i] if loads[t] != 0.0 else 0.0
            for i in range(3):
                for p in range(count):
                    d_wrench[b, t, i, p] = slopes[i, 7 + columns[p]]
                    new[i, p] = slopes[3 + i, 7 + columns[p]]
                    for j in range(3):
                        d_wrench[b, t, i, p] += slopes[i, j] * d_z[j, p]
                        new[i, p] += slopes[3 + i, j] * d_z[j, p]
            d_z[:] = new
