"""Smooth maps over all directions in space: cubic Hermite patches on the faces of a cube, without trigonometry or pole.

A direction `(x, y, s)` lies on the face of its largest component k; its place there is `a`, `b`, the next two
components (in cyclic order) over that one. A face has `2 n + 1` nodes each way over [-1, 1]; a node holds, for each of
three components, four numbers (value, its slopes by a and by b and its mixed slope, per spacing of the nodes), at one
level or at several: the coefficients of a cubic B-spline in a third coordinate in [0, 1]. Number c of component m at
level t of a node is at `node + (3 t + m) * 4 + c`. Odd maps, `f(-V) = -f(V)`, store three faces, others six (positive
ones first). `planarfriction.models.cube_map` makes maps whose slopes are continuous across the edges of the cube too.

Where a direction lies is found without branches, and counted in doubles: in vector code, for many at once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels.hermite import patch, patch_of_levels
from planarfriction.kernels.vectors import times

NODE = 12
"""Numbers of a node at one level."""


class Spot(NamedTuple):
    """A direction on the cube."""

    axis: float
    """The largest component."""
    face: float
    sign: float
    """Factor of what is read: -1 on the far side of an odd map."""
    a: float
    b: float
    by_side: float
    """da/d(component) along the face, times `sign`."""
    by_axis: float
    """Minus `a` and `b` times this are their slopes by the largest component."""


class Square(NamedTuple):
    """Place of a direction among the nodes of a face."""

    at: float
    """The square's first node, counted from the first node of the map."""
    u: float
    """Distance from the node along a, as a share [0, 1] of that to the next node."""
    v: float
    """The same along b."""


@kernel
def locate(x, y, s, faces):
    """Return `Spot` of a direction; not all of it may be zero."""
    ax, ay, a_s = abs(x), abs(y), abs(s)
    on_x, on_y = (ax >= ay) & (ax >= a_s), ay >= a_s
    largest = xp.where(on_x, x, xp.where(on_y, y, s))
    first, second = xp.where(on_x, y, xp.where(on_y, s, x)), xp.where(on_x, s, xp.where(on_y, x, y))
    axis = xp.where(on_x, 0.0, xp.where(on_y, 1.0, 2.0))
    per = 1.0 / largest
    size, odd, far = abs(per), faces == 3.0, largest < 0.0
    along = xp.where(odd, per, size)
    sign, face = xp.where(odd & far, -1.0, 1.0), axis + xp.where(odd | (largest > 0.0), 0.0, 3.0)
    return Spot(axis, face, sign, first * along, second * along, size, xp.where(odd, size, per))


@kernel
def _cell(a, n):
    """Return the number of the interval, of `2 n`, that holds `a`, and the share of it before `a`."""
    u = (a + 1.0) * n
    i = xp.minimum(xp.maximum(math.floor(u), 0.0), 2.0 * n - 1.0)
    return i, u - i


@kernel
def square(spot, n):
    """Return `Square` of a face of `2 n` intervals each way."""
    i, u = _cell(spot.a, n)
    j, v = _cell(spot.b, n)
    return Square((spot.face * (2.0 * n + 1.0) + i) * (2.0 * n + 1.0) + j, u, v)


@kernel
def levels(t, count):
    """Return the first of the four levels around `t` in [0, 1] of `count`, their weights, and their slopes by t.

    A uniform cubic B-spline.
    """
    u = t * (count - 3.0)
    i = xp.minimum(math.floor(u), count - 4.0)
    u -= i
    v, sixth, c = 1.0 - u, 1.0 / 6.0, 0.5 * (count - 3.0)
    near, far = (4.0 + u * u * (3.0 * u - 6.0)) * sixth, (4.0 + v * v * (3.0 * v - 6.0)) * sixth
    weights = v * v * v * sixth, near, far, u * u * u * sixth
    return i, weights, (-v * v * c, u * (3.0 * u - 4.0) * c, v * (4.0 - 3.0 * v) * c, u * u * c)


@kernel
def read(data, n, q):
    """Read a map of one level and its slopes by a and by b, three components each; `q.at` counts all of `data`."""
    value, by_u, by_v = patch(data, int(q.at), NODE, NODE * (2 * int(n) + 1), q.u, q.v)
    return value, times(n, by_u), times(n, by_v)


@kernel
def read_level(data, n, count, q, weights, slopes):
    """Read a map of `count` levels, its slopes by a and by b and that by t, three components each.

    `q.at` counts all of `data` and begins with the first of the four levels of `weights` and `slopes` (see `levels`).
    """
    node = NODE * int(count)
    value, by_u, by_v, by_t = patch_of_levels(data, int(q.at), node, node * (2 * int(n) + 1), weights, slopes, q.u, q.v)
    return value, times(n, by_u), times(n, by_v), by_t


@kernel
def gradient(spot, by_a, by_b):
    """Return the gradient by the direction's components, from the slopes on the face."""
    largest, first, second = -(spot.a * by_a + spot.b * by_b) * spot.by_axis, by_a * spot.by_side, by_b * spot.by_side
    on_x, on_y = spot.axis == 0.0, spot.axis == 1.0
    return (
        xp.where(on_x, largest, xp.where(on_y, second, first)),
        xp.where(on_x, first, xp.where(on_y, largest, second)),
        xp.where(on_x, second, xp.where(on_y, first, largest)),
    )
