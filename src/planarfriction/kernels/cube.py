"""Smooth maps over all directions in space: cubic Hermite patches on the faces of a cube, without trigonometry or pole.

A direction `(x, y, s)` lies on the face of its largest component k; its place there is `a`, `b`, the next two
components (in cyclic order) over that one. A face has `2 n + 1` nodes each way over [-1, 1]; a node holds, for each
component, four numbers (value, its slopes by a and by b and its mixed slope, per spacing of the nodes), at one level
or at several: the coefficients of a cubic B-spline in a third coordinate in [0, 1]. Number c of component m at level t
of a node is at `node + (t * components + m) * 4 + c`. Odd maps, `f(-V) = -f(V)`, store three faces, others six
(positive ones first). `planarfriction.models.cube_map` makes maps whose slopes are continuous across the edges of the
cube too.
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction.kernels import kernel
from planarfriction.kernels.four import four_nodes, four_nodes_levels


class Spot(NamedTuple):
    """A direction on the cube."""

    axis: int
    """The largest component."""
    face: int
    sign: float
    """Factor of what is read: -1 on the far side of an odd map."""
    a: float
    b: float
    by_side: float
    """da/d(component) along the face, times `sign`."""
    by_axis: float
    """Minus `a` and `b` times this are their slopes by the largest component."""


class Square(NamedTuple):
    """Where a direction lies among the nodes of a face, and the weights of the numbers of its four nodes."""

    at: int
    """The square's first node, counted from the first node of the map."""
    w00: tuple
    w01: tuple
    w10: tuple
    w11: tuple


@kernel
def locate(x, y, s, faces):
    """`Spot` of a direction; not all of it may be zero."""
    ax, ay, a_s = abs(x), abs(y), abs(s)
    if ax >= ay and ax >= a_s:
        axis, largest, first, second = 0, x, y, s
    elif ay >= a_s:
        axis, largest, first, second = 1, y, s, x
    else:
        axis, largest, first, second = 2, s, x, y
    per = 1.0 / largest
    size = abs(per)
    far = largest < 0.0
    if faces == 3:
        return Spot(axis, axis, -1.0 if far else 1.0, first * per, second * per, size, size)
    return Spot(axis, axis + 3 if far else axis, 1.0, first * size, second * size, size, per)


@kernel
def _cell(a, n):
    """Which of the `2 n` intervals holds `a`, and how far along."""
    u = (a + 1.0) * n
    i = min(max(int(u), 0), 2 * n - 1)
    return i, u - i


@kernel
def _values(u):
    """Cubic Hermite: weights of the values and slopes at both ends."""
    v = 1.0 - u
    return v * v * (1.0 + 2.0 * u), u * u * (3.0 - 2.0 * u), u * v * v, -u * u * v


@kernel
def _slopes(u, n):
    """Their derivatives by the coordinate of the face."""
    return 6.0 * u * (u - 1.0) * n, 6.0 * u * (1.0 - u) * n, (1.0 - u) * (1.0 - 3.0 * u) * n, u * (3.0 * u - 2.0) * n


@kernel
def _square(face, i, j, n, a, b):
    at = (face * (2 * n + 1) + i) * (2 * n + 1) + j
    return Square(
        at,
        (a[0] * b[0], a[2] * b[0], a[0] * b[2], a[2] * b[2]),
        (a[0] * b[1], a[2] * b[1], a[0] * b[3], a[2] * b[3]),
        (a[1] * b[0], a[3] * b[0], a[1] * b[2], a[3] * b[2]),
        (a[1] * b[1], a[3] * b[1], a[1] * b[3], a[3] * b[3]),
    )


@kernel
def square(spot, n):
    """Weights that read the value."""
    i, u = _cell(spot.a, n)
    j, v = _cell(spot.b, n)
    return _square(spot.face, i, j, n, _values(u), _values(v))


@kernel
def squares(spot, n):
    """Weights that read the value, its slope by `a` and that by `b`."""
    i, u = _cell(spot.a, n)
    j, v = _cell(spot.b, n)
    a, b = _values(u), _values(v)
    return (
        _square(spot.face, i, j, n, a, b),
        _square(spot.face, i, j, n, _slopes(u, n), b),
        _square(spot.face, i, j, n, a, _slopes(v, n)),
    )


@kernel
def levels(t, count):
    """First of the four levels around `t` in [0, 1] of `count`, and their weights: a uniform cubic B-spline."""
    u = t * (count - 3)
    i = min(int(u), count - 4)
    u -= i
    v = 1.0 - u
    sixth = 1.0 / 6.0
    return i, (
        v * v * v * sixth,
        (4.0 + u * u * (3.0 * u - 6.0)) * sixth,
        (4.0 + v * v * (3.0 * v - 6.0)) * sixth,
        u * u * u * sixth,
    )


@kernel
def level_slopes(t, count):
    """Derivatives of the weights of `levels` by t."""
    u = t * (count - 3)
    u -= min(int(u), count - 4)
    v, c = 1.0 - u, 0.5 * (count - 3)
    return -v * v * c, u * (3.0 * u - 4.0) * c, v * (4.0 - 3.0 * v) * c, u * u * c


@kernel
def read(data, start, n, components, m, q):
    """Component m of a map of one level."""
    node = 4 * components
    at, row = start + q.at * node + 4 * m, (2 * n + 1) * node
    return four_nodes(data, at, node, row, q.w00, q.w01, q.w10, q.w11)


@kernel
def read_level(data, start, n, components, count, m, q, level, t):
    """Component m of a map of `count` levels, at the four levels from `level` with weights `t`."""
    step = 4 * components
    node = count * step
    at, row = start + q.at * node + level * step + 4 * m, (2 * n + 1) * node
    return four_nodes_levels(data, at, node, row, step, t, q.w00, q.w01, q.w10, q.w11)


@kernel
def gradient(spot, by_a, by_b):
    """The gradient by the direction's components, from the slopes on the face."""
    largest, first, second = -(spot.a * by_a + spot.b * by_b) * spot.by_axis, by_a * spot.by_side, by_b * spot.by_side
    if spot.axis == 0:
        return largest, first, second
    if spot.axis == 1:
        return second, largest, first
    return first, second, largest
