"""Source of the pressure under a body that has an edge (see `given_pressure`): the place of the body, q.

Cells beyond the outline carry nothing, the others carry all of the load. Each cell stands for a small disc. The part of
it that the body covers acts as a disc of the same area at its centroid, with the share of the load that it had per
area; then all shares grow by one factor, so that the load stays what it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction._engine.cells.given_pressure import (
    RATES,
    GivenPressure,
    Pressed,
)
from planarfriction._engine.codegen.vectors import Vector, copy
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, arrays_at, reader
from planarfriction._engine.protocol import SEEN, functions_of

_NONE = 1e-9
"""Share of the area of a disc below which nothing of it is covered: rounding makes
1e-15 of it."""

_ALL = 1.0 - 1e-9
"""Share of the area of a disc above which all of it is covered."""


class EdgeContact(NamedTuple):
    """A contact of n cells under a body with an outline."""

    given: GivenPressure
    turned: bool
    """True if the first three are a map of the velocity (see `cells.cells`)."""
    discs: bool
    """True if the last number of a lever is a radius."""
    radii: Doubles
    """Radii of the discs that cells stand for [m], [n]."""
    middle: Doubles
    """Centre and radius of a circle around all of them [m], [3]."""
    outline: Doubles
    """Corners of the body, counter-clockwise in its axes from its centre of mass [m], [M, 2]."""
    corners: int
    """M"""
    cells: Doubles
    """Numbers of whole cells, [numbers, n]."""


@kernel
def _sector(ax: float, ay: float, bx: float, by: float, radius: float) -> Vector:
    """Return area and first moments of the sector of a disc from the direction of a to that of b."""
    a = math.sqrt(ax * ax + ay * ay)
    b = math.sqrt(bx * bx + by * by)
    angle = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    cube = radius * radius * radius / 3.0
    return (
        0.5 * radius * radius * angle,
        cube * (by / b - ay / a),
        cube * (ax / a - bx / b),
    )


@kernel
def covered_part(
    outline: Doubles, corners: int, x: float, y: float, radius: float
) -> Vector:
    """Return the share of the area of a disc that a polygon covers, and the centroid of that part from the centre.

    The disc and the triangle of its centre and a side have in common a sector, a triangle and a sector: before the
    side enters the disc, in the disc, and behind it. All of them, with their signs, are the part inside the polygon.
    """
    area = 0.0
    mx = 0.0
    my = 0.0
    ax = outline[2 * corners - 2] - x
    ay = outline[2 * corners - 1] - y
    for k in range(corners):
        bx = outline[2 * k] - x
        by = outline[2 * k + 1] - y
        length = math.hypot(bx - ax, by - ay)
        per = 1.0 / length if length > 0.0 else 0.0
        ux = (bx - ax) * per
        uy = (by - ay) * per
        start = ax * ux + ay * uy
        end = bx * ux + by * uy
        # Places along the side count from its foot, and its distance from the nearer corner: corners may be far away.
        distance = ax * uy - ay * ux if abs(start) < abs(end) else bx * uy - by * ux
        enters = end
        leaves = end
        inside = radius * radius - distance * distance
        if inside > 0.0:
            root = math.sqrt(inside)
            enters = xp.minimum(xp.maximum(-root, start), end)
            leaves = xp.minimum(xp.maximum(root, start), end)
        px = distance * uy + enters * ux
        py = enters * uy - distance * ux
        qx = distance * uy + leaves * ux
        qy = leaves * uy - distance * ux
        if enters > start:
            part, sx, sy = _sector(ax, ay, px, py, radius)
            area = area + part
            mx = mx + sx
            my = my + sy
        part = 0.5 * distance * (leaves - enters)
        area = area + part
        mx = mx + part * (px + qx) / 3.0
        my = my + part * (py + qy) / 3.0
        if leaves < end:
            part, sx, sy = _sector(qx, qy, bx, by, radius)
            area = area + part
            mx = mx + sx
            my = my + sy
        ax = bx
        ay = by
    share = area / (math.pi * radius * radius)
    if share < _NONE:
        return 0.0, 0.0, 0.0
    return (1.0, 0.0, 0.0) if share > _ALL else (share, mx / area, my / area)


@kernel
def _place(record: EdgeContact, z: Doubles, v: Doubles) -> Vector:
    """Return the place of the body in the contact frame: x, y, cosine and sine."""
    seen = arrays_at(SEEN, v)
    cos = math.cos(seen.place[2])
    sin = math.sin(seen.place[2])
    c = seen.axes[0]
    s = seen.axes[1]
    return seen.place[0], seen.place[1], c * cos + s * sin, c * sin - s * cos


@kernel
def _press(record: EdgeContact, place: Vector, v: Doubles, to: Pressed) -> bool:
    """Write the cells under a body at a place, unless it covers all, and the share of their load that it covers."""
    given = record.given
    n = given.count
    (bx, by, cos, sin) = place
    seen = arrays_at(SEEN, v)
    seen.covered[0] = 1.0
    dx = record.middle[0] - bx
    dy = record.middle[1] - by
    x = cos * dx + sin * dy
    y = cos * dy - sin * dx
    if covered_part(record.outline, record.corners, x, y, record.middle[2])[0] == 1.0:
        return False
    copy(record.cells, to.cells, given.numbers * n)
    total = 0.0
    borne = 0.0
    lever = 3 if record.turned else 0
    for i in range(n):
        dx = given.x[i] - bx
        dy = given.y[i] - by
        x = cos * dx + sin * dy
        y = cos * dy - sin * dx
        share, mx, my = covered_part(
            record.outline, record.corners, x, y, record.radii[i]
        )
        dx = cos * mx - sin * my
        dy = sin * mx + cos * my
        if record.turned:
            xx = record.cells[i]
            xy = record.cells[n + i]
            yy = record.cells[2 * n + i]
            dx, dy = xy * dx - xx * dy, yy * dx - xy * dy
        to.cells[lever * n + i] += dx
        to.cells[(lever + 1) * n + i] += dy
        if record.discs:
            to.cells[(lever + 2) * n + i] *= math.sqrt(share)
        to.weights[i] = share * given.weights[i]
        total = total + given.weights[i]
        borne = borne + to.weights[i]
    for i in range(n):
        to.weights[i] *= total / borne if borne > 0.0 else 0.0
    seen.covered[0] = borne / total if borne < total else 1.0
    return borne < total


FUNCTIONS = functions_of(
    "edge",
    RATES,
    read=reader(EdgeContact),
    place=_place,
    press=_press,
    follows=False,
)
