"""The step of the distributed model and its derivatives, cell by cell (see `steps.StepFunctions`).

A cell sees the velocity `u = B V` of its lever B (see `cells.Lever`); see `bristle_step` for the step of a bristle and
docs/physics.md, "Distributed model".
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import at
from planarfriction.kernels import bristle_step, cells
from planarfriction.kernels.derive import derive
from planarfriction.kernels.law import grip, squared
from planarfriction.kernels.steps import SLOPES, step_functions
from planarfriction.kernels.vectors import norm, plus, put, put_all, three, times


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
def pulled(back, results, tape):
    """Return `CellSlopes` from the way back of two vectors by z and u."""
    (new, traction), none, x, y = results, (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)
    (new_zx, new_ux), (new_zy, new_uy) = back(tape, (x, none)), back(tape, (y, none))
    (zx, ux), (zy, uy) = back(tape, (none, x)), back(tape, (none, y))
    return CellSlopes(new, traction, (*new_zx, *new_zy), (*new_ux, *new_uy), (*zx, *zy), (*ux, *uy))


@kernel
def _step(lever, law, own, z, twist, dt, new, out):
    n, total = own.count, (0.0, 0.0, 0.0)
    for i in range(n):  # apart: in one loop the vectors do not fit into the processor's registers
        u = lever.seen(lever.of(own, i), twist)
        speed = norm(u)
        new[i] = bristle_step.predict(law, (z[i], z[n + i]), u, speed, 1.0, grip(law, speed), dt)[1]
    for i in range(n):
        one, bristle = lever.of(own, i), (z[i], z[n + i])
        u = lever.seen(one, twist)
        speed = norm(u)
        q = grip(law, speed)
        moved, k = bristle_step.finish(law, bristle, u, speed, 1.0, q, dt, norm(bristle) * q, new[i])
        new[i], new[n + i] = moved
        total = plus(total, own.weights[i], lever.wrench(one, _traction(law, moved, k, u)))
    put(out, total)


@kernel
def step(lever, contact, z, v, dt, new, out):
    """Advance the bristles by `dt` at a held twist (see `formulas.relaxation`), and write the wrench at the end."""
    own = cells.read(contact)
    if own.law.gamma == 2.0:
        _step(lever, squared(own.law), own, z, three(v), dt, new, out)
    else:
        _step(lever, own.law, own, z, three(v), dt, new, out)


@kernel
def _slopes(lever, whole, law, own, z, twist, dt, new, out):
    n, total, by_twist = own.count, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(n):
        one = lever.of(own, i)
        results, tape = _forth(law, (z[i], z[n + i]), lever.seen(one, twist), dt)
        found = pulled(_back, results, tape)
        new[i], new[n + i] = found.new
        total = plus(total, own.weights[i], lever.wrench(one, found.traction))
        by_twist = plus(by_twist, own.weights[i], lever.around(one, found.traction_u))
        if whole:
            put_cell(lever, one, own.weights[i], found, i, n, at(out, SLOPES))
    put(out, total)
    put_all(at(out, 3), by_twist)


@kernel
def put_cell(lever, one, weight, found, i, n, out):
    """Write the derivatives of cell i to its places in d new/dV [2, n, 3], dW/dz [3, 2, n] and d new/dz [2, 2, n]."""
    (xx, xy, yx, yy), (ux, uy, vx, vy) = times(weight, found.traction_z), found.new_u
    put(at(out, 3 * i), lever.wrench(one, (ux, uy)))
    put(at(out, 3 * (n + i)), lever.wrench(one, (vx, vy)))
    by_x, by_y = lever.wrench(one, (xx, yx)), lever.wrench(one, (xy, yy))
    for m in range(3):
        out[(6 + 2 * m) * n + i], out[(7 + 2 * m) * n + i] = by_x[m], by_y[m]
    for m in range(4):
        out[(12 + m) * n + i] = found.new_z[m]


@kernel
def slopes(lever, whole, contact, z, v, dt, new, out):
    """Step with the slopes of the wrench, or with all derivatives."""
    own = cells.read(contact)
    if own.law.gamma == 2.0 and not whole:
        _slopes(lever, whole, squared(own.law), own, z, three(v), dt, new, out)
    else:
        _slopes(lever, whole, own.law, own, z, three(v), dt, new, out)


TEMPLATES = step, slopes
ISOTROPIC = step_functions("isotropic", TEMPLATES, lever=cells.POSITIONS)
TURNED = step_functions("turned", TEMPLATES, lever=cells.LEVERS)
