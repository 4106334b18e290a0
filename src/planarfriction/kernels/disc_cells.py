"""Levers of cells that are small discs.

The lever B of a disc at (x, y) gives `u = (v_x - omega y, v_y + omega x, kappa a omega)` (see `discs`); with a friction
metric the map L of the cell turns the first two, and a is the radius in the space of the metric.
"""

from __future__ import annotations

from planarfriction.compiler import kernel
from planarfriction.kernels.cells import Lever, law_of_all, numbers_of
from planarfriction.kernels.vectors import Vector, dot


@kernel
def _seen(cell: Vector, v: Vector) -> Vector:
    x, y, a = cell  # a is kappa times the radius
    return v[0] - v[2] * y, v[1] + v[2] * x, a * v[2]


@kernel
def _wrench(cell: Vector, t: Vector) -> Vector:
    x, y, a = cell
    return t[0], t[1], x * t[1] - y * t[0] + a * t[2]


@kernel
def _around(cell: Vector, p: Vector) -> Vector:
    (x, y, a), (xx, xy, xs, yx, yy, ys, sx, sy, ss) = cell, p
    xt, yt, st = x * xy - y * xx + a * xs, x * yy - y * yx + a * ys, x * sy - y * sx + a * ss
    return xx, xy, xt, yx, yy, yt, x * yx - y * xx + a * sx, x * yy - y * xy + a * sy, x * yt - y * xt + a * st


@kernel
def _seen_by_map(cell: Vector, v: Vector) -> Vector:
    xx, xy, yy, x, y, a = cell  # B = [(xx, xy, x), (xy, yy, y), (0, 0, kappa a)]
    return xx * v[0] + xy * v[1] + x * v[2], xy * v[0] + yy * v[1] + y * v[2], a * v[2]


@kernel
def _wrench_by_map(cell: Vector, t: Vector) -> Vector:
    xx, xy, yy, x, y, a = cell
    return xx * t[0] + xy * t[1], xy * t[0] + yy * t[1], x * t[0] + y * t[1] + a * t[2]


@kernel
def _around_by_map(cell: Vector, p: Vector) -> Vector:
    xx, xy, yy, x, y, a = cell
    by_x = xx * p[0] + xy * p[1], xx * p[3] + xy * p[4], xx * p[6] + xy * p[7]
    by_y = xy * p[0] + yy * p[1], xy * p[3] + yy * p[4], xy * p[6] + yy * p[7]
    spin = x * p[0] + y * p[1] + a * p[2], x * p[3] + y * p[4] + a * p[5], x * p[6] + y * p[7] + a * p[8]
    one, other, last = (xx, xy, 0.0), (xy, yy, 0.0), (x, y, a)
    return (
        dot(one, by_x), dot(one, by_y), dot(one, spin), dot(other, by_x), dot(other, by_y), dot(other, spin),
        dot(last, by_x), dot(last, by_y), dot(last, spin),
    )  # fmt: skip


POSITIONS = Lever(numbers_of(3), _seen, _wrench, _around, law_of_all)
LEVERS = Lever(numbers_of(6), _seen_by_map, _wrench_by_map, _around_by_map, law_of_all)
