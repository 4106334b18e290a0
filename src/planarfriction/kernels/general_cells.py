"""A contact of n cells whose bristles follow any law, `z' = f(z, u)` with the traction `t(z, u)` (see `Bristle`).

With `u = B V` of a cell (see `cells.Lever`) and the derivatives `A = df/dz`, `F = df/du`, `C = dt/dz`, `E = dt/du`,
each [2, 2], `D = shift I - A` is inverted cell by cell; `W = sum w B' t`. The functions are those of
`contacts.ModelFunctions` and `steps.StepFunctions`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import arrays_at, at
from planarfriction.kernels.contacts import ROWS
from planarfriction.kernels.derive import derive
from planarfriction.kernels.steps import SLOPES
from planarfriction.kernels.vectors import plus, put, put_all, three, times

ROWS_OF_A_CELL = 20
"""Numbers of a cell in a linearisation: A, F, C, E and the inverse of D, row by row."""


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
def _pulled(back, results, tape):
    """Return `CellSlopes` from the way back of two vectors by z and u."""
    (new, traction), none, x, y = results, (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)
    (new_zx, new_ux), (new_zy, new_uy) = back(tape, (x, none)), back(tape, (y, none))
    (zx, ux), (zy, uy) = back(tape, (none, x)), back(tape, (none, y))
    return CellSlopes(new, traction, (*new_zx, *new_zy), (*new_ux, *new_uy), (*zx, *zy), (*ux, *uy))


class Bristle(NamedTuple):
    """Compiled functions of a bristle; `law` is what `Lever.law` returns."""

    evaluate: Any
    """`(law, z, u)`: return z' and the traction."""
    step: Any
    """`(law, z, u, dt)`: return the bristle after dt and its traction."""
    linearise: Any
    """`(law, z, u)`: return z' and the traction with their derivatives, as `CellSlopes`."""
    linearise_step: Any
    """`(law, z, u, dt)`: return the bristle and its traction after dt with their derivatives."""


def bristle(evaluate: Any, step: Any) -> Bristle:
    """Return the functions of a bristle, with the derivatives that `derive` writes."""
    return Bristle(evaluate, step, slopes_of(evaluate), slopes_of(step))


def slopes_of(function: Any) -> Any:
    """Return a function that returns two vectors with their derivatives by z and u, as `CellSlopes`."""
    written = derive(function, ("z", "u"), ("z", "u"))
    forth, back = written.forth, written.back

    @kernel
    def slopes(*arguments):
        found, tape = forth(*arguments)
        return _pulled(back, found, tape)

    return slopes


@kernel
def _matrix(m, i):
    """Return the matrix [2, 2] whose four numbers begin at `m[i]`."""
    return m[i], m[i + 1], m[i + 2], m[i + 3]


@kernel
def _applied(m, a):
    return m[0] * a[0] + m[1] * a[1], m[2] * a[0] + m[3] * a[1]


@kernel
def _applied_back(m, a):
    return m[0] * a[0] + m[2] * a[1], m[1] * a[0] + m[3] * a[1]


@kernel
def _product(m, n):
    a, b = _applied(m, (n[0], n[2])), _applied(m, (n[1], n[3]))
    return a[0], b[0], a[1], b[1]


def evaluate(lever, bristle, read, contact, z, v, zdot, w):
    """Write `z'`, and `W`."""
    own, twist, total = read(contact), three(v), (0.0, 0.0, 0.0)
    n = own.count
    for i in range(n):
        cell = lever.of(own, i)
        rate, t = bristle.evaluate(lever.law(own, i), (z[i], z[n + i]), lever.seen(cell, twist))
        zdot[i], zdot[n + i] = rate
        total = plus(total, own.weights[i], lever.wrench(cell, t))
    put(w, total)


def linearise(lever, bristle, read, contact, z, v, lin):
    """Write A, F, C and E of each cell."""
    own, twist = read(contact), three(v)
    n = own.count
    for i in range(n):
        found = bristle.linearise(lever.law(own, i), (z[i], z[n + i]), lever.seen(lever.of(own, i), twist))
        put_all(at(lin, ROWS_OF_A_CELL * i), (*found.new_z, *found.new_u, *found.traction_z, *found.traction_u))


def factor(lever, read, contact, z, shift, lin, stiffness):
    """Invert D, write `sum w B' (C D^-1 F + E) B`."""
    own, total = read(contact), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(own.count):
        m = at(lin, ROWS_OF_A_CELL * i)
        a, b, c, d = shift - m[0], -m[1], -m[2], shift - m[3]
        per = 1.0 / (a * d - b * c)
        inverse = per * d, -per * b, -per * c, per * a
        m[16], m[17], m[18], m[19] = inverse
        p = plus(_product(_matrix(m, 8), _product(inverse, _matrix(m, 4))), 1.0, _matrix(m, 12))
        total = plus(total, own.weights[i], lever.around(lever.of(own, i), p))
    put_all(stiffness, total)


def eliminate(lever, read, contact, z, shift, r, lin, w):
    """Write `sum w B' C D^-1 r`."""
    own, total = read(contact), (0.0, 0.0, 0.0)
    n = own.count
    for i in range(n):
        m = at(lin, ROWS_OF_A_CELL * i)
        t = _applied(_matrix(m, 8), _applied(_matrix(m, 16), (r[i], r[n + i])))
        total = plus(total, own.weights[i], lever.wrench(lever.of(own, i), t))
    put(w, total)


def back_substitute(lever, read, contact, z, r, dv, lin, out):
    """Solve `D out = r + F B dV`."""
    own, twist = read(contact), three(dv)
    n = own.count
    for i in range(n):
        m = at(lin, ROWS_OF_A_CELL * i)
        driven = _applied(_matrix(m, 4), lever.seen(lever.of(own, i), twist))
        out[i], out[n + i] = _applied(_matrix(m, 16), plus(driven, 1.0, (r[i], r[n + i])))


def change(lever, read, contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """Write the changes of `z'` and of the wrench; bristles grow with friction, and with them what they tend to."""
    own, rows, total = read(contact), arrays_at(ROWS, rows), (0.0, 0.0, 0.0)
    n, twist = own.count, (rows.d_twist[0], rows.d_twist[1], rows.d_twist[2] + size * rows.twist[2])
    for i in range(n):
        m, cell, b = at(lin, ROWS_OF_A_CELL * i), lever.of(own, i), (z[i], z[n + i])
        u, a = lever.seen(cell, twist), plus((dz[i], dz[n + i]), -friction, b)
        dzdot[i], dzdot[n + i] = plus(_applied(_matrix(m, 0), a), 1.0, _applied(_matrix(m, 4), u))
        t = plus(_applied(_matrix(m, 8), a), 1.0, _applied(_matrix(m, 12), u))
        total = plus(total, own.weights[i], lever.wrench(cell, plus(t, -friction * own.law.sigma_0, b)))
    put(rows.d_wrench, plus(total, size * rows.wrench[2], (0.0, 0.0, 1.0)))


def solve_transposed(read, contact, z, r, lin, out):
    """Solve `D' out = r`."""
    n = read(contact).count
    for i in range(n):
        out[i], out[n + i] = _applied_back(_matrix(at(lin, ROWS_OF_A_CELL * i), 16), (r[i], r[n + i]))


def pull_back(lever, read, contact, z, lin, dzdot, rows, out):
    """Write the transpose of `change`."""
    own, rows, total = read(contact), arrays_at(ROWS, rows), (0.0, 0.0, 0.0)
    n, wrench = own.count, three(rows.d_wrench)
    for i in range(n):
        m, cell, rate = at(lin, ROWS_OF_A_CELL * i), lever.of(own, i), (dzdot[i], dzdot[n + i])
        t = lever.seen(cell, wrench)
        w = own.weights[i]
        back = _applied_back(_matrix(m, 0), rate)
        out[i], out[n + i] = plus(back, w, _applied_back(_matrix(m, 8), t))
        u = plus(_applied_back(_matrix(m, 4), rate), w, _applied_back(_matrix(m, 12), t))
        total = plus(total, 1.0, lever.wrench(cell, u))
    put(rows.d_twist, total)


def step(lever, bristle, read, contact, z, v, dt, new, out):
    """Step the cells, and write the wrench at the end (see `steps.StepFunctions`)."""
    own, twist, total = read(contact), three(v), (0.0, 0.0, 0.0)
    n = own.count
    for i in range(n):
        cell = lever.of(own, i)
        moved, t = bristle.step(lever.law(own, i), (z[i], z[n + i]), lever.seen(cell, twist), dt)
        new[i], new[n + i] = moved
        total = plus(total, own.weights[i], lever.wrench(cell, t))
    put(out, total)


@kernel
def _put_cell(lever, one, weight, found, i, n, out):
    """Write the derivatives of cell i to its places in d new/dV [2, n, 3], dW/dz [3, 2, n] and d new/dz [2, 2, n]."""
    (xx, xy, yx, yy), (ux, uy, vx, vy) = times(weight, found.traction_z), found.new_u
    put(at(out, 3 * i), lever.wrench(one, (ux, uy)))
    put(at(out, 3 * (n + i)), lever.wrench(one, (vx, vy)))
    by_x, by_y = lever.wrench(one, (xx, yx)), lever.wrench(one, (xy, yy))
    for m in range(3):
        out[(6 + 2 * m) * n + i], out[(7 + 2 * m) * n + i] = by_x[m], by_y[m]
    for m in range(4):
        out[(12 + m) * n + i] = found.new_z[m]


def slopes(lever, bristle, read, whole, contact, z, v, dt, new, out):
    """Step with the slopes of the wrench, or with all derivatives."""
    own, twist, total = read(contact), three(v), (0.0, 0.0, 0.0)
    n, by_twist = own.count, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(n):
        cell = lever.of(own, i)
        found = bristle.linearise_step(lever.law(own, i), (z[i], z[n + i]), lever.seen(cell, twist), dt)
        new[i], new[n + i] = found.new
        total = plus(total, own.weights[i], lever.wrench(cell, found.traction))
        by_twist = plus(by_twist, own.weights[i], lever.around(cell, found.traction_u))
        if whole:
            _put_cell(lever, cell, own.weights[i], found, i, n, at(out, SLOPES))
    put(out, total)
    put_all(at(out, 3), by_twist)


RATES = evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back
STEPS = step, slopes
