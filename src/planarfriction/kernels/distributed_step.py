"""The step of the distributed model and its derivatives, cell by cell, per unit normal load.

Twists and wrenches are about the contact frame's origin; see `bristle_step` for the step of a bristle and
docs/physics.md, "Distributed model".
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.kernels import bristle_step
from planarfriction.kernels.bristle_step import Bristle
from planarfriction.kernels.law import grip, grip_slope, squared
from planarfriction.kernels.vectors import norm, plus, times


class Cells(NamedTuple):
    """The n cells of a patch."""

    x: np.ndarray
    """Positions [m], [n]."""
    y: np.ndarray
    weights: np.ndarray
    """Shares of the load, one row for all contacts of a batch or one for each, [B or 1, n]."""


class CellJacobians(NamedTuple):
    """Derivatives of the steps of B contacts."""

    state_state: np.ndarray
    """Of the new bristles by the old, cell by cell, [B, 2, 2, n]."""
    state_twist: np.ndarray
    """[B, 2, n, 3]"""
    wrench_state: np.ndarray
    """[B, 3, 2, n]"""
    wrench_twist: np.ndarray
    """[B, 3, 3]"""
    wrench_load: np.ndarray
    """[B, 3]"""


@kernel
def _bristle(law, z, u):
    """A cell's bristle at the beginning of a step."""
    speed = norm(u)
    return Bristle(z, u, speed, 1.0, grip(law, speed))


@kernel
def _traction(law, u, end):
    """Traction of a cell at the end of its step, per unit load."""
    rate = plus(u, -end.stage.k, end.new)
    return formulas.traction(end.new[0], rate[0], u[0], law), formulas.traction(end.new[1], rate[1], u[1], law)


@kernel
def _step(law, z, twist, x, y, w, dt, out):
    n = x.shape[0]
    zx, zy, ox, oy = z[:n], z[n:], out[:n], out[n:]
    vx, vy, omega = twist
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):  # apart: in one loop the vectors do not fit into the processor's registers
        bristle = _bristle(law, (zx[i], zy[i]), (vx - omega * y[i], vy + omega * x[i]))
        ox[i] = bristle_step.predict(law, bristle, dt).decay_dt
    for i in range(n):
        bristle = _bristle(law, (zx[i], zy[i]), (vx - omega * y[i], vy + omega * x[i]))
        end = bristle_step.finish(law, bristle, dt, ox[i])
        ox[i], oy[i] = end.new
        tx, ty = times(w[i], _traction(law, bristle.u, end))
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    return fx, fy, tau


@kernel
def step(law, z, twist, x, y, w, dt, out):
    """Advance the bristles by `dt` at a held twist (see `formulas.relaxation`) and return the wrench at the end."""
    if law.gamma == 2.0:
        return _step(squared(law), z, twist, x, y, w, dt, out)
    return _step(law, z, twist, x, y, w, dt, out)


@jit
def step_batch(law, z, twist, cells, load, dt, out, wrench):
    """`step` for a batch: `z`, `out` [B, 2n], `twist`, `wrench` [B, 3], `load`, `dt` [B].

    Without load the bristles are forgotten.
    """
    for b in range(z.shape[0]):
        w, held = cells.weights[min(b, cells.weights.shape[0] - 1)], (twist[b, 0], twist[b, 1], twist[b, 2])
        fx, fy, tau = step(law, z[b], held, cells.x, cells.y, w, dt[b], out[b])
        wrench[b, 0], wrench[b, 1], wrench[b, 2] = load[b] * fx, load[b] * fy, load[b] * tau
        if load[b] == 0.0:
            out[b] = 0.0
            wrench[b] = 0.0


@jit
def step_sequence(law, z, twist, cells, load, dt, out, wrench):
    """`step` through the twists [T, 3] of one contact, `z` in place (`out`: scratch), wrenches into `wrench` [T, 3]."""
    n = z.shape[0]
    for t in range(twist.shape[0]):
        held = twist[t, 0], twist[t, 1], twist[t, 2]
        fx, fy, tau = step(law, z, held, cells.x, cells.y, cells.weights[0], dt, out)
        wrench[t, 0], wrench[t, 1], wrench[t, 2] = load * fx, load * fy, load * tau
        for i in range(n):
            z[i] = out[i]


@kernel
def _pull_back(law, step, new_bar, k_bar):
    """Cotangents of `z` and of the cell's velocity from those of the new bristle and of its decay."""
    bar, (_, u, speed, _, q) = bristle_step.pull_back(step, new_bar, k_bar), step.bristle
    per = 1.0 / xp.where(speed > 0.0, speed, math.inf)
    return bar.z, plus(bar.u, (bar.v + bar.q * grip_slope(law, speed, q)) * per, u)


class CellSlopes(NamedTuple):
    """A step of a cell, with the slopes of its traction row by row."""

    new: tuple
    traction: tuple
    """Per unit load."""
    by_z: tuple
    by_u: tuple
    """By the velocity of the cell."""


@kernel
def cell_slopes(law, z, u, dt):
    """`CellSlopes` of a step from the bristle z at the velocity u."""
    step = bristle_step.linearise(law, _bristle(law, z, u), dt)
    new, k = step.end.new, step.end.stage.k
    pull, damped = law.sigma_1 * k - law.sigma_0, -(law.sigma_1 + law.sigma_2)
    (a, b), (c, d) = _pull_back(law, step, (pull, 0.0), law.sigma_1 * new[0])
    (e, f), (g, h) = _pull_back(law, step, (0.0, pull), law.sigma_1 * new[1])
    return CellSlopes(new, _traction(law, u, step.end), (a, b, e, f), (c + damped, d, g, h + damped))


@jit
def jacobians(law, z, twist, cells, load, dt, out):
    """`CellJacobians` of steps into `out`, which comes in as zeros: `z` [B, 2, n], `twist` [B, 3], `load`, `dt` [B]."""
    for b in range(z.shape[0]):
        weights = cells.weights[min(b, cells.weights.shape[0] - 1)]
        for m in range(weights.shape[0]):
            px, py = cells.x[m], cells.y[m]
            u = twist[b, 0] - twist[b, 2] * py, twist[b, 1] + twist[b, 2] * px
            step = bristle_step.linearise(law, _bristle(law, (z[b, 0, m], z[b, 1, m]), u), dt[b])
            new, k = step.end.new, step.end.stage.k
            fx, fy = times(weights[m], _traction(law, u, step.end))
            out.wrench_load[b, 0] += fx
            out.wrench_load[b, 1] += fy
            out.wrench_load[b, 2] += px * fy - py * fx
            if load[b] == 0.0:
                continue
            share = load[b] * weights[m]
            pull = share * (law.sigma_0 - law.sigma_1 * k)
            for i in range(2):
                unit = (1.0, 0.0) if i == 0 else (0.0, 1.0)
                a, v = _pull_back(law, step, unit, 0.0)
                out.state_state[b, i, 0, m], out.state_state[b, i, 1, m] = a
                slopes = out.state_twist[b, i, m]
                slopes[0], slopes[1], slopes[2] = v[0], v[1], px * v[1] - py * v[0]
                # the force of the cell, -(sigma_0 n + sigma_1 (u - k n) + sigma_2 u)
                k_bar = share * law.sigma_1 * (new[0] if i == 0 else new[1])
                a, v = _pull_back(law, step, times(-pull, unit), k_bar)
                v = plus(v, -share * (law.sigma_1 + law.sigma_2), unit)
                lever, turn = (-py if i == 0 else px), px * v[1] - py * v[0]
                out.wrench_state[b, i, 0, m], out.wrench_state[b, i, 1, m] = a
                out.wrench_state[b, 2, 0, m] += lever * a[0]
                out.wrench_state[b, 2, 1, m] += lever * a[1]
                for row, arm in ((i, 1.0), (2, lever)):
                    slopes = out.wrench_twist[b, row]
                    slopes[0] += arm * v[0]
                    slopes[1] += arm * v[1]
                    slopes[2] += arm * turn
