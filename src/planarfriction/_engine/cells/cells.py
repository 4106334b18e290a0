"""Record of a contact of n cells, and the levers of points and of small discs, isotropic or not.

The state is `z = [z_x (n), z_y (n)]`, of discs with a third row. A cell sees `u = B V` of the twist and adds `w B' t`
to the wrench, t being its traction; `B` is its lever. The lever of a disc at (x, y) gives `u = (v_x - omega y,
v_y + omega x, kappa a omega)` (see `discs`); with a friction metric the map L of the cell turns the first two, and a is
the radius in the space of the metric.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction._engine.bristles.elastic import Elastic, factors
from planarfriction._engine.codegen.vectors import Vector, norm, reader_of
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, at, reader
from planarfriction.formulas import LawNumbers


class CellsContact(NamedTuple):
    """A contact of n cells."""

    law: LawNumbers
    count: int
    """n"""
    rows: int
    """Number of rows of `cells`."""
    cells: Doubles
    """Numbers of the cells: x, y [2, n], or L_xx, L_xy, L_yy, (L J rho)_x, (L J rho)_y [5, n], of discs kappa a too;
    behind these the asymmetry a_x, a_y, or `elastic.Elastic.stiff` [N] of the pieces of a pad."""
    weights: Doubles
    """[n]"""


read = reader(CellsContact)


@kernel
def settle(contact: CellsContact, size: int, load: float, z: Doubles) -> None:
    """Bring bristles of so many components of a pad back onto their limits at a load."""
    n = contact.count
    stiff = at(contact.cells, (contact.rows - 1) * n)
    for i in range(n):
        longest = contact.law.mu_s / contact.law.sigma_0
        bent = norm((z[i], z[n + i], z[2 * n + i] if size == 3 else 0.0))
        pad = Elastic(contact.law, stiff[i], contact.weights[i] * load)
        stiffer, _ = factors(pad)
        over = bent * stiffer / longest
        if over > 1.0:
            for m in range(size):
                z[m * n + i] = z[m * n + i] / over


class Lever(NamedTuple):
    """Functions of the map B of a cell; `cell` are its numbers."""

    read: Any
    """`(row, first, stride)`: return the numbers of a cell."""
    seen: Any
    """`(cell, V)`: return `B V`."""
    wrench: Any
    """`(cell, t)`: return `B' t`."""
    around: Any
    """`(cell, P)`: return `B' P B` of a matrix [d, d], nine numbers."""


# ---------------------------------------------------------------------- the levers


@kernel
def _seen(cell: Vector, v: Vector) -> Vector:
    x, y = cell
    return v[0] - v[2] * y, v[1] + v[2] * x


@kernel
def _wrench(cell: Vector, t: Vector) -> Vector:
    x, y = cell
    return t[0], t[1], x * t[1] - y * t[0]


@kernel
def _seen_by_map(cell: Vector, v: Vector) -> Vector:
    xx, xy, yy, x, y = cell  # B = [(xx, xy, x), (xy, yy, y)]
    return xx * v[0] + xy * v[1] + x * v[2], xy * v[0] + yy * v[1] + y * v[2]


@kernel
def _wrench_by_map(cell: Vector, t: Vector) -> Vector:
    xx, xy, yy, x, y = cell
    return xx * t[0] + xy * t[1], xy * t[0] + yy * t[1], x * t[0] + y * t[1]


def _of_points(count: int, seen: Any, wrench: Any) -> Lever:
    """Return the lever of points with so many numbers."""

    @kernel
    def around(
        cell: Vector, p: Vector
    ) -> Vector:  # of the columns of P, then of the rows of `B' P`
        a = wrench(cell, (p[0], p[2]))
        b = wrench(cell, (p[1], p[3]))
        return (
            *wrench(cell, (a[0], b[0])),
            *wrench(cell, (a[1], b[1])),
            *wrench(cell, (a[2], b[2])),
        )

    return Lever(reader_of(count), seen, wrench, around)


def _of_discs(count: int, points: Lever) -> Lever:
    """Return the lever of discs with so many numbers, whose last is kappa times the radius, from that of points."""
    seen_by_point = points.seen
    pull_of_point = points.wrench

    @kernel
    def seen(cell: Vector, v: Vector) -> Vector:
        return (*seen_by_point(cell[:-1], v), cell[-1] * v[2])

    @kernel
    def wrench(cell: Vector, t: Vector) -> Vector:
        x, y, tau = pull_of_point(cell[:-1], t)
        return x, y, tau + cell[-1] * t[2]

    @kernel
    def around(cell: Vector, p: Vector) -> Vector:
        a = wrench(cell, (p[0], p[3], p[6]))
        b = wrench(cell, (p[1], p[4], p[7]))
        c = wrench(cell, (p[2], p[5], p[8]))
        rows = (a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2])
        return (*wrench(cell, rows[0]), *wrench(cell, rows[1]), *wrench(cell, rows[2]))

    return _of_points(count, seen, wrench)._replace(around=around)


POSITIONS = _of_points(2, _seen, _wrench)
LEVERS = _of_points(5, _seen_by_map, _wrench_by_map)
DISC_POSITIONS = _of_discs(3, POSITIONS)
DISC_LEVERS = _of_discs(6, LEVERS)
