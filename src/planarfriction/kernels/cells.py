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

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.vectors import dot


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
