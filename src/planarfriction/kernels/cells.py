"""Record of a contact of n cells, and the levers of points, isotropic or not (discs: `disc_cells`).

The state is `z = [z_x (n), z_y (n)]`, of discs with a third row. A cell sees `u = B V` of the twist and adds `w B' t`
to the wrench, t being its traction; `B` is its lever.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.vectors import Vector, dot, reader_of


class CellsContact(NamedTuple):
    """A contact of n cells."""

    law: LawNumbers
    count: int
    """n"""
    cells: Doubles
    """Numbers of the cells: x, y [2, n], or L_xx, L_xy, L_yy, (L J rho)_x, (L J rho)_y, a_x, a_y [7, n]."""
    lean: Doubles
    """Rows a_x, a_y of these, [2, n]; none where friction is the same forwards and backwards."""
    weights: Doubles
    """[n]"""


read = reader(CellsContact)


class Lever(NamedTuple):
    """Functions of the map B of a cell; `cell` are the numbers of the cell that `of(contact, i)` reads."""

    of: Any
    seen: Any
    """`(cell, V)`: return `B V`."""
    wrench: Any
    """`(cell, t)`: return `B' t`."""
    around: Any
    """`(cell, P)`: return `B' P B` of a matrix [d, d], nine numbers."""
    law: Any
    """`(contact, i)`: return the law of the cell."""


# ---------------------------------------------------------------------- the levers


def numbers_of(count: int) -> Any:
    """Return `Lever.of` of a lever of so many numbers."""
    read = reader_of(count)

    @kernel
    def numbers(contact: CellsContact, i: int) -> Vector:
        return read(contact.cells, i, contact.count)

    return numbers


@kernel
def _seen(cell: Vector, v: Vector) -> Vector:
    x, y = cell
    return v[0] - v[2] * y, v[1] + v[2] * x


@kernel
def _wrench(cell: Vector, t: Vector) -> Vector:
    x, y = cell
    return t[0], t[1], x * t[1] - y * t[0]


@kernel
def _around(cell: Vector, p: Vector) -> Vector:
    (x, y), (xx, xy, yx, yy) = cell, p
    xt, yt = xy * x - xx * y, yy * x - yx * y
    return xx, xy, xt, yx, yy, yt, x * yx - y * xx, x * yy - y * xy, x * yt - y * xt


@kernel
def _seen_by_map(cell: Vector, v: Vector) -> Vector:
    xx, xy, yy, x, y = cell  # B = [(xx, xy, x), (xy, yy, y)]
    return xx * v[0] + xy * v[1] + x * v[2], xy * v[0] + yy * v[1] + y * v[2]


@kernel
def _wrench_by_map(cell: Vector, t: Vector) -> Vector:
    xx, xy, yy, x, y = cell
    return xx * t[0] + xy * t[1], xy * t[0] + yy * t[1], x * t[0] + y * t[1]


@kernel
def _around_by_map(cell: Vector, p: Vector) -> Vector:
    (xx, xy, yy, x, y), (pxx, pxy, pyx, pyy) = cell, p
    a, b, c = (xx, xy), (xy, yy), (x, y)
    pa, pb = (pxx * xx + pxy * xy, pyx * xx + pyy * xy), (pxx * xy + pxy * yy, pyx * xy + pyy * yy)
    pc = pxx * x + pxy * y, pyx * x + pyy * y
    return dot(a, pa), dot(a, pb), dot(a, pc), dot(b, pa), dot(b, pb), dot(b, pc), dot(c, pa), dot(c, pb), dot(c, pc)


@kernel
def law_of_all(contact: CellsContact, i: int) -> LawNumbers:
    """Return the law that all cells share."""
    return contact.law


POSITIONS = Lever(numbers_of(2), _seen, _wrench, _around, law_of_all)
LEVERS = Lever(numbers_of(5), _seen_by_map, _wrench_by_map, _around_by_map, law_of_all)
