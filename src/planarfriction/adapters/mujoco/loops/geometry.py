"""Places of patches in contact in a MuJoCo model, and the Jacobian of their twists."""

from __future__ import annotations

import math

from planarfriction.compiler import kernel
from planarfriction.compiler.calls import call_c
from planarfriction.compiler.memory import at, doubles, integers, integers32
from planarfriction.kernels import placing
from planarfriction.kernels.coupling_rows import ALONG, FLAT
from planarfriction.kernels.vectors import clear, dot, norm, plus, square, three, times

onto_plane = kernel(placing.onto_plane)
across = kernel(placing.across)


@kernel
def owners_of(s, nefc):
    """Return the patches of the constraints, behind the numbers of these in the scratch."""
    return integers(at(s.misses, nefc))


@kernel
def places_of(s, nefc):
    """Return x and y of the points of the constraints in the frames of their patches, `[2, nefc]`, behind these."""
    return at(s.misses, 2 * nefc)


@kernel
def _collect(own, d, s, nefc):
    """Collect the owners of constraints, and sums over the contacts of each patch."""
    owners, counts, frames = owners_of(s, nefc), s.counts, s.frames
    contacts, ncon = integers(d + own.data.contact)[0], integers32(d + own.data.ncon)[0]
    for r in range(nefc):
        owners[r] = -1
    for p in range(own.count):
        counts[p] = 0
    clear(frames, 6 * own.count)
    for c in range(ncon):
        contact = contacts + own.contact.size * c
        row = integers32(contact + own.contact.efc_address)[0]
        if row < 0:
            continue
        one, two = integers32(contact + own.contact.geom)[0], integers32(contact + own.contact.geom)[1]
        for p in range(own.count):
            first, second = integers(own.other)[p], integers(own.own)[p]
            forward, back = one == first and two == second, one == second and two == first
            if forward or back:
                sign = 1.0 if forward else -1.0
                for i in range(3):
                    frames[6 * p + i] += sign * doubles(contact + own.contact.frame)[i]
                    frames[6 * p + 3 + i] += doubles(contact + own.contact.pos)[i]
                counts[p] += 1
                owners[row] = p


@kernel
def cross(a, b):
    """Return `a x b`."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def turned_by(matrix, vector):
    """Return a vector in the world, from a frame with a matrix of nine numbers."""
    return dot(three(matrix), vector), dot(three(at(matrix, 3)), vector), dot(three(at(matrix, 6)), vector)


@kernel
def column(matrix, i):
    """Return axis i of a frame in the world."""
    return matrix[i], matrix[3 + i], matrix[6 + i]


@kernel
def axes(s, p):
    """Return the axes of patch p: x, y, normal."""
    frame, x = three(at(s.frames, 6 * p)), three(at(s.axes, 3 * p))
    n = times(1.0 / norm(frame), frame)
    return x, cross(n, x), n


@kernel
def _put_axis(own, d, s, p, before, axis):
    """Write the x axis of patch p: that of its site, across the normal, on the side of the last one; see `FLAT`."""
    turned = at(doubles(integers(d + own.data.site_xmat)[0]), 9 * integers(own.site)[p])
    frame, x, y, last = (
        three(at(s.frames, 6 * p)),
        column(turned, 0),
        column(turned, 1),
        turned_by(turned, three(before)),
    )
    n = times(1.0 / norm(frame), frame)
    x, last = plus(x, -dot(x, n), n), plus(last, -dot(last, n), n)
    flat, carried = square(x), square(last) >= ALONG
    if carried:
        last = times(1.0 / norm(last), last)
        x = last if flat < FLAT else (times(-1.0, x) if dot(x, last) < 0.0 else x)
    elif flat < ALONG:
        x = plus(y, -dot(y, n), n)
    x = times(1.0 / norm(x), x)
    s.carried[2 * p], s.carried[2 * p + 1] = 1.0, 0.0
    if carried:
        s.carried[2 * p], s.carried[2 * p + 1] = dot(last, x), dot(n, cross(last, x))
    for i in range(3):
        s.axes[3 * p + i] = x[i]
        axis[i] = dot(x, column(turned, i))


@kernel
def _add_drift(own, m, d, s, p, geom, sign):
    """Add to the drift of patch p the twist of the surface of a geom relative to it."""
    surface = at(doubles(integers(m + own.model.geom_surfacevel)[0]), 6 * geom)
    turned = at(doubles(integers(d + own.data.geom_xmat)[0]), 9 * geom)
    away = plus(three(at(s.frames, 6 * p + 3)), -1.0, three(at(doubles(integers(d + own.data.geom_xpos)[0]), 3 * geom)))
    turn = turned_by(turned, three(at(surface, 3)))
    move = plus(turned_by(turned, three(surface)), 1.0, cross(turn, away))
    x, y, normal = axes(s, p)
    s.drift[3 * p] += sign * dot(x, move)
    s.drift[3 * p + 1] += sign * dot(y, move)
    s.drift[3 * p + 2] += sign * dot(normal, turn)


@kernel
def _put_places(own, d, s, nefc, p, centre, x, y):
    """Write the places of the contacts of patch p, from its centre along its axes."""
    contacts, owners, places = integers(d + own.data.contact)[0], owners_of(s, nefc), places_of(s, nefc)
    for c in range(integers32(d + own.data.ncon)[0]):
        contact = contacts + own.contact.size * c
        row = integers32(contact + own.contact.efc_address)[0]
        if row >= 0 and owners[row] == p:
            away = plus(three(doubles(contact + own.contact.pos)), -1.0, three(centre))
            places[row], places[nefc + row] = dot(x, away), dot(y, away)


@kernel
def _turns_over(own, d, geom, normal):
    """Return True if a cylinder touches with its curved side."""
    turned = at(doubles(integers(d + own.data.geom_xmat)[0]), 9 * geom)
    return across(column(turned, 2), normal) > placing.CURVED


@kernel
def is_curved(own, d, s, p):
    """Return True if patch p lies on a curved side, of either geom."""
    sides, normal = integers(own.curved)[p], axes(s, p)[2]
    return (
        sides & placing.ROUND != 0
        or (sides & placing.OWN != 0 and _turns_over(own, d, integers(own.own)[p], normal))
        or (sides & placing.OTHER != 0 and _turns_over(own, d, integers(own.other)[p], normal))
    )


@kernel
def is_at_contact(own, d, s, p):
    """Return True if the origin of patch p follows the contact forces."""
    centre = integers(own.centre)[p]
    return centre == placing.AT_CONTACT or (centre == placing.AUTO and is_curved(own, d, s, p))


@kernel
def _put_origin(own, d, s, p, normal, held):
    """Write the origin of patch p, in the plane of its contacts, in place of the sum of these.

    It lies below the site, or at the last centre, if any, which moves with the body of the site.
    """
    frame, local = at(s.frames, 6 * p), three(held)
    middle = times(1.0 / s.counts[p], three(at(frame, 3)))
    site, new = integers(own.site)[p], square(local) == 0.0
    turned = at(doubles(integers(d + own.data.site_xmat)[0]), 9 * site)
    origin = three(at(doubles(integers(d + own.data.site_xpos)[0]), 3 * site))
    if is_at_contact(own, d, s, p):
        origin = middle if new else plus(origin, 1.0, turned_by(turned, local))
    frame[3], frame[4], frame[5] = onto_plane(origin, middle, normal)


@kernel
def _rows(own, m, d, s, nefc, p, kept):
    """Write the three rows of patch p into the Jacobian, the places of its contacts, and how fast its bodies roll."""
    nv, frame = own.nv, at(s.frames, 6 * p)
    _put_axis(own, d, s, p, at(kept.before, 3 * p), at(kept.axis, 3 * p))
    x, y, normal = axes(s, p)
    centre, rows = at(frame, 3), at(s.jacobian, 3 * nv * p)
    _put_origin(own, d, s, p, normal, at(kept.held, 3 * p))
    _put_places(own, d, s, nefc, p, centre, x, y)
    if own.model.geom_surfacevel >= 0:
        _add_drift(own, m, d, s, p, integers(own.own)[p], 1.0)
        _add_drift(own, m, d, s, p, integers(own.other)[p], -1.0)
    clear(rows, 3 * nv)
    moves, turns, velocity, roll, rock = s.moves, s.turns, doubles(integers(d + own.data.qvel)[0]), 0.0, 0.0
    for side in range(2):
        body = integers(own.owner)[p] if side == 0 else integers(own.support)[p]
        if body == 0:
            continue
        sign = 1.0 if side == 0 else -1.0
        call_c(own.functions.mj_jac, (m, d, s.moves, s.turns, centre, body))
        for i in range(nv):
            move = moves[i], moves[nv + i], moves[2 * nv + i]
            rows[i] += sign * dot(x, move)
            rows[nv + i] += sign * dot(y, move)
            turn = turns[i], turns[nv + i], turns[2 * nv + i]
            rows[2 * nv + i] += sign * dot(normal, turn)
            roll, rock = roll + sign * dot(x, turn) * velocity[i], rock + sign * dot(y, turn) * velocity[i]
    s.tilts[p] = math.sqrt(roll * roll + rock * rock)


@kernel
def place(own, m, d, s, nefc, kept):
    """Write the Jacobian of the twists, zero without contact; return the number of patches in contact.

    What patches remember has their last origins and x axes, in the frames of their sites.
    """
    _collect(own, d, s, nefc)
    touching = 0
    for p in range(own.count):
        s.carried[2 * p], s.carried[2 * p + 1] = 1.0, 0.0
        for i in range(3):
            s.drift[3 * p + i], kept.axis[3 * p + i] = 0.0, kept.before[3 * p + i]
        if s.counts[p] > 0:
            _rows(own, m, d, s, nefc, p, kept)
            touching += 1
        else:
            clear(at(s.jacobian, 3 * own.nv * p), 3 * own.nv)
    return touching
