"""Cells under a body that has an edge: those beyond its outline carry nothing, the others carry all of the load.

Each cell stands for a small disc. The part of it that the body covers acts as a disc of the same area at its centroid,
with the share of the load that it had per area; then all shares grow by one factor, so that the load stays what it is.
Rates and wrench, `z' = f(z, V, q)` and `W = sum w_i(q) B_i(q)' t_i`, see the place q of the body. Their derivatives by
q are differences, taken only while a part of the patch is beyond the edge:

    dW/dq = dW/dq at held bristles + dW/dz D^-1 df/dq,     D dz = r + df/dV dV + df/dq dq.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction._engine.codegen.vectors import Vector, copy
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import entry, kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import (
    Doubles,
    Layout,
    Place,
    arrays_at,
    at,
    reader,
)
from planarfriction._engine.protocol import SEEN, Addresses, ModelFunctions, Seen

# Share of its area below which nothing of a disc is covered, and above which all is: rounding makes 1e-15 of it.
_NONE = 1e-9
"""Share of the area of a disc below which nothing of it is covered: rounding makes
1e-15 of it."""

_ALL = 1.0 - 1e-9
"""Share of the area of a disc above which all of it is covered."""

# Change of the place of the body for differences [rad], and, times the radius of the patch, [m].
_NUDGE = 1e-6


class EdgeContact(NamedTuple):
    """A contact of n cells under a body with an outline."""

    count: int
    """n"""
    numbers: int
    """Numbers of each cell."""
    turned: bool
    """True if the first three are a map of the velocity (see `cells.cells`)."""
    discs: bool
    """True if the last number of a lever is a radius."""
    x: Doubles
    y: Doubles
    radii: Doubles
    """Radii of the discs that cells stand for [m], [n]."""
    middle: Doubles
    """Centre and radius of a circle around all of them [m], [3]."""
    outline: Doubles
    """Corners of the body, counter-clockwise in its axes from its centre of mass [m], [M, 2]."""
    corners: int
    """M"""
    weights: Doubles
    """Weights of whole cells, [n]."""
    cells: Doubles
    """Numbers of whole cells, [numbers, n]."""
    whole: int
    """Address of the record of whole cells."""
    held: int
    """Address of the record of the cells as they were linearised last, whose arrays follow."""
    held_weights: Doubles
    held_cells: Doubles
    trial: int
    """Address of the record of the cells anywhere else, whose arrays follow."""
    trial_weights: Doubles
    trial_cells: Doubles
    calls: Addresses
    """Addresses of the functions of the cells."""
    states: int
    """Number of states of the bristles."""
    rate: Doubles
    """Room for rates of the bristles, [states]."""
    by_place: Doubles
    """df/dq where the contact was linearised last, [3, states]."""
    wrench: Doubles
    """Room for a wrench, [3]."""


read = reader(EdgeContact)


class EdgeLinearisation(NamedTuple):
    """Numbers at the beginning of a linearisation, before the numbers of the cells."""

    share: Doubles
    """Covered share of the load of whole cells, [1]."""
    slopes: Doubles
    """dW/dq at held bristles, [3, 3]."""


_LINEAR = Layout(EdgeLinearisation, share=1, slopes=9)
_PLACES = _LINEAR.offsets
OWN = _LINEAR.size


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
        ux = (bx - ax) / length
        uy = (by - ay) / length
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
def _cover(
    record: EdgeContact, place: Vector, weights: Doubles, cells: Doubles
) -> float:
    """Write weights and numbers of the cells under a body at a place (x, y, cosine, sine); return their share.

    Nothing is written where all of the patch is covered, whose share is 1.
    """
    n = record.count
    (bx, by, cos, sin) = place
    middle = record.middle
    dx = middle[0] - bx
    dy = middle[1] - by
    x = cos * dx + sin * dy
    y = cos * dy - sin * dx
    if covered_part(record.outline, record.corners, x, y, middle[2])[0] == 1.0:
        return 1.0
    copy(record.cells, cells, record.numbers * n)
    total = 0.0
    borne = 0.0
    lever = 3 if record.turned else 0
    for i in range(n):
        dx = record.x[i] - bx
        dy = record.y[i] - by
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
        cells[lever * n + i] += dx
        cells[(lever + 1) * n + i] += dy
        if record.discs:
            cells[(lever + 2) * n + i] *= math.sqrt(share)
        weights[i] = share * record.weights[i]
        total = total + record.weights[i]
        borne = borne + weights[i]
    for i in range(n):
        weights[i] *= total / borne if borne > 0.0 else 0.0
    return borne / total if borne < total else 1.0


@kernel
def _place(seen: Seen, dx: float, dy: float, turned: float) -> Vector:
    """Return the place of the body in the contact frame, (x, y, cosine, sine), after a change in this frame."""
    angle = seen.place[2] + turned
    cos = math.cos(angle)
    sin = math.sin(angle)
    c = seen.axes[0]
    s = seen.axes[1]
    return seen.place[0] + dx, seen.place[1] + dy, c * cos + s * sin, c * sin - s * cos


@entry
def evaluate(contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles) -> None:
    """Write z', the wrench, and the covered share."""
    record = read(contact)
    seen = arrays_at(SEEN, v)
    share = _cover(
        record, _place(seen, 0.0, 0.0, 0.0), record.trial_weights, record.trial_cells
    )
    seen.covered[0] = share
    call(
        record.calls.evaluate,
        (record.whole if share == 1.0 else record.trial, z, v, zdot, w),
    )


@entry
def linearise(contact: Place, z: Doubles, v: Doubles, lin: Doubles) -> None:
    """Hold the weights, linearise the cells, and write the derivatives by the place."""
    record = read(contact)
    seen = arrays_at(SEEN, v)
    m = arrays_at(_PLACES, lin)
    share = _cover(
        record, _place(seen, 0.0, 0.0, 0.0), record.held_weights, record.held_cells
    )
    m.share[0] = share
    cells = record.whole if share == 1.0 else record.held
    call(record.calls.linearise, (cells, z, v, at(lin, OWN)))
    if share == 1.0:
        return
    for j in range(3):
        step = _NUDGE * record.middle[2] if j < 2 else _NUDGE
        by_place = at(record.by_place, j * record.states)
        for side in range(2):
            by = step if side == 0 else -step
            moved = _place(
                seen,
                by if j == 0 else 0.0,
                by if j == 1 else 0.0,
                by if j == 2 else 0.0,
            )
            share = _cover(record, moved, record.trial_weights, record.trial_cells)
            cells = record.whole if share == 1.0 else record.trial
            per = 0.5 / by
            call(record.calls.evaluate, (cells, z, v, record.rate, record.wrench))
            for i in range(3):
                m.slopes[3 * i + j] = per * record.wrench[i] + (
                    m.slopes[3 * i + j] if side == 1 else 0.0
                )
            for i in range(record.states):
                by_place[i] = per * record.rate[i] + (by_place[i] if side == 1 else 0.0)


@kernel
def _cells(record: EdgeContact, lin: Doubles) -> Place:
    """Return the record of the cells as they were linearised."""
    return record.whole if arrays_at(_PLACES, lin).share[0] == 1.0 else record.held


@entry
def factor(
    contact: Place, z: Doubles, shift: float, lin: Doubles, stiffness: Doubles
) -> None:
    """Prepare D, and write the stiffness, and the slopes by the place behind it."""
    record = read(contact)
    m = arrays_at(_PLACES, lin)
    w = read(contact).wrench
    call(record.calls.factor, (_cells(record, lin), z, shift, at(lin, OWN), stiffness))
    for j in range(0 if m.share[0] == 1.0 else 3):
        call(
            record.calls.eliminate,
            (
                record.held,
                z,
                shift,
                at(record.by_place, j * record.states),
                at(lin, OWN),
                w,
            ),
        )
        for i in range(3):
            stiffness[9 + 3 * i + j] = m.slopes[3 * i + j] + w[i]


@entry
def eliminate(
    contact: Place, z: Doubles, shift: float, r: Doubles, lin: Doubles, w: Doubles
) -> None:
    """Write the wrench that a residual causes."""
    record = read(contact)
    call(record.calls.eliminate, (_cells(record, lin), z, shift, r, at(lin, OWN), w))


@entry
def back_substitute(
    contact: Place, z: Doubles, r: Doubles, dv: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve for the bristles."""
    record = read(contact)
    partly = arrays_at(_PLACES, lin).share[0] < 1.0
    by_place = read(contact).by_place
    for i in range(record.states if partly else 0):
        record.rate[i] = r[i]
        for j in range(3):
            record.rate[i] += dv[3 + j] * by_place[j * record.states + i]
    right = record.rate if partly else r
    call(
        record.calls.back_substitute,
        (_cells(record, lin), z, right, dv, at(lin, OWN), out),
    )


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute)
