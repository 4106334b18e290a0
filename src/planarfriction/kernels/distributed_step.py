"""The step of the distributed model and its derivatives, cell by cell, per unit normal load.

Twists and wrenches are about the contact frame's origin; see `bristle_step` for the step of a bristle and
docs/physics.md, "Distributed model".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.compiler import jit, kernel
from planarfriction.kernels import bristle_step
from planarfriction.kernels.derive import derive
from planarfriction.kernels.law import grip, squared
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
    """Derivatives of the new bristles by the old, cell by cell, [B, 2, 2, n]."""
    state_twist: np.ndarray
    """[B, 2, n, 3]"""
    wrench_state: np.ndarray
    """[B, 3, 2, n]"""
    wrench_twist: np.ndarray
    """[B, 3, 3]"""
    wrench_load: np.ndarray
    """[B, 3]"""


@kernel
def _traction(law, new, k, u):
    """Return the traction of a cell at the end of its step, per unit load."""
    return plus(plus(times(-law.sigma_0, new), -law.sigma_1, plus(u, -k, new)), -law.sigma_2, u)


@kernel
def cell(law, z, u, dt):
    """Return the new bristle and the traction of a cell that moves at u."""
    speed = norm(u)
    new, k = bristle_step.step(law, z, u, speed, 1.0, grip(law, speed), dt)
    return new, _traction(law, new, k, u)


_CELL = derive(cell, ("z", "u"), ("z", "u"))
_forth, _back = _CELL.forth, _CELL.back


@kernel
def _step(law, z, twist, x, y, w, dt, out):
    n = x.shape[0]
    zx, zy, ox, oy = z[:n], z[n:], out[:n], out[n:]
    vx, vy, omega = twist
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):  # apart: in one loop the vectors do not fit into the processor's registers
        u = vx - omega * y[i], vy + omega * x[i]
        speed = norm(u)
        ox[i] = bristle_step.predict(law, (zx[i], zy[i]), u, speed, 1.0, grip(law, speed), dt)[1]
    for i in range(n):
        u, bristle = (vx - omega * y[i], vy + omega * x[i]), (zx[i], zy[i])
        speed = norm(u)
        q = grip(law, speed)
        new, k = bristle_step.finish(law, bristle, u, speed, 1.0, q, dt, norm(bristle) * q, ox[i])
        ox[i], oy[i] = new
        tx, ty = times(w[i], _traction(law, new, k, u))
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
    """Take a `step` of each contact: `z`, `out` [B, 2n], `twist`, `wrench` [B, 3], `load`, `dt` [B].

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
    """Take a `step` at each twist [T, 3] of one contact, `z` in place (`out`: scratch), `wrench` [T, 3]."""
    n = z.shape[0]
    for t in range(twist.shape[0]):
        held = twist[t, 0], twist[t, 1], twist[t, 2]
        fx, fy, tau = step(law, z, held, cells.x, cells.y, cells.weights[0], dt, out)
        wrench[t, 0], wrench[t, 1], wrench[t, 2] = load * fx, load * fy, load * tau
        for i in range(n):
            z[i] = out[i]


class CellSlopes(NamedTuple):
    """A step of a cell with its derivatives by the bristle and by the velocity of the cell, [2, 2] row by row."""

    new: tuple
    traction: tuple
    """Per unit load."""
    new_z: tuple
    new_u: tuple
    traction_z: tuple
    traction_u: tuple


@kernel
def cell_slopes(law, z, u, dt):
    """Return `CellSlopes` of a step from the bristle z at the velocity u."""
    (new, traction), tape = _forth(law, z, u, dt)
    none, x, y = (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)
    (new_zx, new_ux), (new_zy, new_uy) = _back(tape, (x, none)), _back(tape, (y, none))
    (zx, ux), (zy, uy) = _back(tape, (none, x)), _back(tape, (none, y))
    return CellSlopes(new, traction, (*new_zx, *new_zy), (*new_ux, *new_uy), (*zx, *zy), (*ux, *uy))


@kernel
def by_twist(by_x, by_y, x, y):
    """Return derivatives by the twist from those by the velocity of a cell at (x, y)."""
    return by_x, by_y, x * by_y - y * by_x


@jit
def jacobians(law, z, twist, cells, load, dt, out):
    """Write `CellJacobians` of steps to `out`, which comes in as zeros.

    `z` [B, 2, n], `twist` [B, 3], `load`, `dt` [B].
    """
    for b in range(z.shape[0]):
        weights = cells.weights[min(b, cells.weights.shape[0] - 1)]
        for m in range(weights.shape[0]):
            px, py = cells.x[m], cells.y[m]
            u = twist[b, 0] - twist[b, 2] * py, twist[b, 1] + twist[b, 2] * px
            cell = cell_slopes(law, (z[b, 0, m], z[b, 1, m]), u, dt[b])
            fx, fy = times(weights[m], cell.traction)
            out.wrench_load[b, 0] += fx
            out.wrench_load[b, 1] += fy
            out.wrench_load[b, 2] += px * fy - py * fx
            if load[b] == 0.0:
                continue
            for i in range(2):
                for j in range(2):
                    out.state_state[b, i, j, m] = cell.new_z[2 * i + j]
                slopes = out.state_twist[b, i, m]
                slopes[0], slopes[1], slopes[2] = by_twist(cell.new_u[2 * i], cell.new_u[2 * i + 1], px, py)
            by_z, by_u = times(load[b] * weights[m], cell.traction_z), times(load[b] * weights[m], cell.traction_u)
            for i in range(3):  # the wrench is the traction times (1, 0), (0, 1) and the lever
                x, y = (1.0, 0.0) if i == 0 else ((0.0, 1.0) if i == 1 else (-py, px))
                out.wrench_state[b, i, 0, m] = x * by_z[0] + y * by_z[2]
                out.wrench_state[b, i, 1, m] = x * by_z[1] + y * by_z[3]
                vx, vy, omega = by_twist(x * by_u[0] + y * by_u[2], x * by_u[1] + y * by_u[3], px, py)
                slopes = out.wrench_twist[b, i]
                slopes[0], slopes[1], slopes[2] = slopes[0] + vx, slopes[1] + vy, slopes[2] + omega
