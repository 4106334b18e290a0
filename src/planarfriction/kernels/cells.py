"""A contact of n cells as the solver sees it, isotropic or not (see `contacts.ModelFunctions`).

The state is `z = [z_x (n), z_y (n)]`. A cell sees `u = B V` of the twist and adds `w B' t` to the wrench, with the
traction `t = -(sigma_0 z + sigma_1 z' + sigma_2 u)`; `B` is its lever (see `Lever`). With `k = bristle_decay`
(docs/physics.md, docs/solver.md),

    z' = u - k z,      dz'/dz = -k I - z (x) k_z,      dz'/du = I - z (x) k_u.

So `D = shift I - dz'/dz` is a multiple of the identity plus a rank-one term and has a closed inverse, and every
function is linear in the number of cells. Cells whose bristles do something else: `general_cells`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles, arrays_at, at, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.contacts import ROWS, functions_of, traction
from planarfriction.kernels.derive import derive
from planarfriction.kernels.law import grip, squared
from planarfriction.kernels.rules import ratio
from planarfriction.kernels.vectors import dot, norm, plus, put, put_all, three, times


class CellsContact(NamedTuple):
    """A contact of n cells."""

    law: LawNumbers
    count: int
    """n"""
    cells: Doubles
    """Numbers of the cells: x, y [2, n], or L_xx, L_xy, L_yy, (L J rho)_x, (L J rho)_y, a_x, a_y [7, n]."""
    weights: Doubles
    """[n]"""


read = reader(CellsContact)


class Lever(NamedTuple):
    """Functions of the map B of a cell; `cell` are the numbers of the cell that `of(own, i)` reads."""

    of: Any
    seen: Any
    """`(cell, V)`: return `B V`."""
    wrench: Any
    """`(cell, t)`: return `B' t`."""
    around: Any
    """`(cell, P)`: return `B' P B` of a matrix [2, 2], nine numbers."""
    law: Any
    """`(own, i)`: return the law of the cell."""


class LinearCells(NamedTuple):
    """Rows [n] of a linearisation."""

    k: Doubles
    by_x: Doubles
    """k_z"""
    by_y: Doubles
    by_ux: Doubles
    """k_u"""
    by_uy: Doubles
    diagonal: Doubles
    """One over the diagonal of D, and over its rank-one part."""
    rank: Doubles


LINEAR_ROWS = len(LinearCells._fields)


@kernel
def _linear(lin, n):
    return LinearCells(
        lin, at(lin, n), at(lin, 2 * n), at(lin, 3 * n), at(lin, 4 * n), at(lin, 5 * n), at(lin, 6 * n)
    )  # fmt: skip


@kernel
def _solved(m, i, h, a):
    """Return `D^-1 a`."""
    return times(m.diagonal[i], plus(a, -(m.by_x[i] * a[0] + m.by_y[i] * a[1]) * m.rank[i], h))


@kernel
def _driven(m, i, h, u):
    """Return `dz'/du u`."""
    return plus(u, -(m.by_ux[i] * u[0] + m.by_uy[i] * u[1]), h)


@kernel
def _decay(law, h, u):
    """Return the decay of a bristle."""
    speed, size = norm(u), norm(h)
    q = law.sigma_0 / formulas.stribeck(xp, speed, law)
    return formulas.bristle_decay(xp, size * q, ratio(dot(h, u), size), speed, q, law)


_SLOPES = derive(_decay, ("h", "u"), ("h", "u"))
_forth, _back = _SLOPES.forth, _SLOPES.back


@kernel
def _evaluate(lever, law, own, z, v, zdot, w):
    n, twist, total = own.count, three(v), (0.0, 0.0, 0.0)
    for i in range(n):  # the exponential apart: two short loops overlap more cells than a long one
        speed = norm(lever.seen(lever.of(own, i), twist))
        zdot[i], zdot[n + i] = speed, grip(law, speed)
    for i in range(n):
        cell = lever.of(own, i)
        u, h = lever.seen(cell, twist), (z[i], z[n + i])
        speed, q, size = zdot[i], zdot[n + i], norm(h)
        along = dot(h, u) / xp.where(size > 0.0, size, 1.0)
        zdot[i] = formulas.bristle_decay(xp, size * q, along, speed, q, law)
    for i in range(n):
        cell = lever.of(own, i)
        u, h = lever.seen(cell, twist), (z[i], z[n + i])
        rate = plus(u, -zdot[i], h)
        zdot[i], zdot[n + i] = rate
        total = plus(total, own.weights[i], lever.wrench(cell, traction(law, h, rate, u)))
    put(w, total)


def evaluate(lever, contact, z, v, zdot, w):
    """Write `z'`, and `W = sum w B' t`."""
    own = read(contact)
    if own.law.gamma == 2.0:
        _evaluate(lever, squared(own.law), own, z, v, zdot, w)
    else:
        _evaluate(lever, own.law, own, z, v, zdot, w)


@kernel
def _linearise(lever, law, own, z, v, m):
    n, twist = own.count, three(v)
    for i in range(n):
        (k,), tape = _forth(law, (z[i], z[n + i]), lever.seen(lever.of(own, i), twist))
        (m.by_x[i], m.by_y[i]), (m.by_ux[i], m.by_uy[i]) = _back(tape, (1.0,))
        m.k[i] = k


def linearise(lever, contact, z, v, lin):
    """Write k, k_z and k_u of each cell."""
    own = read(contact)
    m = _linear(lin, own.count)
    if own.law.gamma == 2.0:
        _linearise(lever, squared(own.law), own, z, v, m)
    else:
        _linearise(lever, own.law, own, z, v, m)


def factor(lever, contact, z, shift, lin, stiffness):
    """Prepare D, write `sum w B' [-(sigma_0 + sigma_1 shift) D^-1 dz'/du - sigma_2 I] B`.

    `D^-1 (I - h (x) k_u) = (I - h (x) m)/(shift + k)` with `m = ((shift + k) k_u + k_h)/(shift + k + k_h . h)`.
    """
    own = read(contact)
    n, law, m = own.count, own.law, _linear(lin, own.count)
    pull, total = law.sigma_0 + law.sigma_1 * shift, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(n):
        h, by_h = (z[i], z[n + i]), (m.by_x[i], m.by_y[i])
        diagonal = shift + m.k[i]
        m.diagonal[i], rank = 1.0 / diagonal, 1.0 / (diagonal + dot(by_h, h))
        m.rank[i] = rank
        c, d = -pull * m.diagonal[i], -law.sigma_2
        x, y = times(rank, plus(times(diagonal, (m.by_ux[i], m.by_uy[i])), 1.0, by_h))
        p = c * (1.0 - h[0] * x) + d, -c * h[0] * y, -c * h[1] * x, c * (1.0 - h[1] * y) + d
        total = plus(total, own.weights[i], lever.around(lever.of(own, i), p))
    put_all(stiffness, total)


def eliminate(lever, contact, z, shift, r, lin, w):
    """Write `sum w B' [-(sigma_0 + sigma_1 shift) D^-1 r + sigma_1 r]`."""
    own = read(contact)
    n, law, m = own.count, own.law, _linear(lin, own.count)
    pull, total = law.sigma_0 + law.sigma_1 * shift, (0.0, 0.0, 0.0)
    for i in range(n):
        a = r[i], r[n + i]
        t = plus(times(law.sigma_1, a), -pull, _solved(m, i, (z[i], z[n + i]), a))
        total = plus(total, own.weights[i], lever.wrench(lever.of(own, i), t))
    put(w, total)


def back_substitute(lever, contact, z, r, dv, lin, out):
    """Solve `D out = r + dz'/du B dV`."""
    own = read(contact)
    n, m, twist = own.count, _linear(lin, own.count), three(dv)
    for i in range(n):
        h = (z[i], z[n + i])
        driven = _driven(m, i, h, lever.seen(lever.of(own, i), twist))
        out[i], out[n + i] = _solved(m, i, h, plus(driven, 1.0, (r[i], r[n + i])))


def change(lever, contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """Write the changes of `z'` and of the wrench."""
    own, rows = read(contact), arrays_at(ROWS, rows)
    n, law, m = own.count, own.law, _linear(lin, own.count)
    twist, total = (rows.d_twist[0], rows.d_twist[1], rows.d_twist[2] + size * rows.twist[2]), (0.0, 0.0, 0.0)
    for i in range(n):
        cell, h = lever.of(own, i), (z[i], z[n + i])
        u, b = lever.seen(cell, twist), (dz[i], dz[n + i])
        a = plus(b, -friction, (z[i], z[n + i]))
        rate = plus(_driven(m, i, h, u), -m.k[i], a)
        rate = plus(rate, -(m.by_x[i] * a[0] + m.by_y[i] * a[1]), h)
        dzdot[i], dzdot[n + i] = rate
        total = plus(total, own.weights[i], lever.wrench(cell, traction(law, b, rate, u)))
    put(rows.d_wrench, plus(total, size * rows.wrench[2], (0.0, 0.0, 1.0)))


def solve_transposed(lever, contact, z, r, lin, out):
    """Solve `D' out = r`."""
    own = read(contact)
    n, m = own.count, _linear(lin, own.count)
    for i in range(n):
        a = r[i], r[n + i]
        c = dot((z[i], z[n + i]), a) * m.rank[i]
        out[i], out[n + i] = times(m.diagonal[i], plus(a, -c, (m.by_x[i], m.by_y[i])))


def pull_back(lever, contact, z, lin, dzdot, rows, out):
    """Write the transpose of `change`; with the share t of a cell in the wrench its `z'` gets `l - sigma_1 t`."""
    own, rows = read(contact), arrays_at(ROWS, rows)
    n, law, m = own.count, own.law, _linear(lin, own.count)
    wrench, total = three(rows.d_wrench), (0.0, 0.0, 0.0)
    for i in range(n):
        cell, h = lever.of(own, i), (z[i], z[n + i])
        t = times(own.weights[i], lever.seen(cell, wrench))
        rate = plus((dzdot[i], dzdot[n + i]), -law.sigma_1, t)
        c = dot(h, rate)
        out[i], out[n + i] = plus(plus(times(-m.k[i], rate), -c, (m.by_x[i], m.by_y[i])), -law.sigma_0, t)
        u = plus(rate, -c, (m.by_ux[i], m.by_uy[i]))
        total = plus(total, 1.0, lever.wrench(cell, plus(u, -law.sigma_2, t)))
    put(rows.d_twist, total)


TEMPLATES = evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back

# ---------------------------------------------------------------------- the levers


@kernel
def _place(own, i):
    return own.cells[i], own.cells[own.count + i]


@kernel
def _seen(cell, v):
    x, y = cell
    return v[0] - v[2] * y, v[1] + v[2] * x


@kernel
def _wrench(cell, t):
    x, y = cell
    return t[0], t[1], x * t[1] - y * t[0]


@kernel
def _around(cell, p):
    (x, y), (xx, xy, yx, yy) = cell, p
    xt, yt = xy * x - xx * y, yy * x - yx * y
    return xx, xy, xt, yx, yy, yt, x * yx - y * xx, x * yy - y * xy, x * yt - y * xt


@kernel
def _map(own, i):
    """Return xx, xy, yy, x, y of `B = [(xx, xy, x), (xy, yy, y)]`."""
    c, n = own.cells, own.count
    return c[i], c[n + i], c[2 * n + i], c[3 * n + i], c[4 * n + i]


@kernel
def _seen_by_map(cell, v):
    xx, xy, yy, x, y = cell
    return xx * v[0] + xy * v[1] + x * v[2], xy * v[0] + yy * v[1] + y * v[2]


@kernel
def _wrench_by_map(cell, t):
    xx, xy, yy, x, y = cell
    return xx * t[0] + xy * t[1], xy * t[0] + yy * t[1], x * t[0] + y * t[1]


@kernel
def _around_by_map(cell, p):
    (xx, xy, yy, x, y), (pxx, pxy, pyx, pyy) = cell, p
    a, b, c = (xx, xy), (xy, yy), (x, y)
    pa, pb = (pxx * xx + pxy * xy, pyx * xx + pyy * xy), (pxx * xy + pxy * yy, pyx * xy + pyy * yy)
    pc = pxx * x + pxy * y, pyx * x + pyy * y
    return dot(a, pa), dot(a, pb), dot(a, pc), dot(b, pa), dot(b, pb), dot(b, pc), dot(c, pa), dot(c, pb), dot(c, pc)


@kernel
def _same(own, i):
    return own.law


POSITIONS = Lever(_place, _seen, _wrench, _around, _same)
LEVERS = Lever(_map, _seen_by_map, _wrench_by_map, _around_by_map, _same)

ISOTROPIC = functions_of("isotropic", TEMPLATES, lever=POSITIONS)
TURNED = functions_of("turned", TEMPLATES, lever=LEVERS)
