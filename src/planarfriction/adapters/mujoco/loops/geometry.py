"""Places of patches in contact in a MuJoCo model, and the Jacobian of their twists.

MuJoCo takes free bodies along the tangent and hinges along their arc. What is held on anything that turns keeps its
*place* if the twist of a step is its mean over the step: what V is where the step begins, at the velocities of its end,
and half of what it gains while all joints keep their speeds. That is, for surfaces at the origin of the patch,

    V = J v + dt/2 dJ/dt v + b

where b is what V gains as the contact goes along with the smaller geom and as its normal turns (see `placing.bend`):
wheels roll straight by it, and pads that close while they turn do not turn what they hold.
"""

from __future__ import annotations

import math

from planarfriction._engine.codegen.vectors import (
    clear,
    dot,
    norm,
    plus,
    square,
    three,
    times,
    zeros,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.calls import call_c
from planarfriction._engine.compiler.memory import at, doubles, integers, integers32
from planarfriction._engine.coupled import placing
from planarfriction.formulas import turning_mean

onto_plane = kernel(placing.onto_plane)
across = kernel(placing.across)
bend = kernel(placing.bend)
x_axis = kernel(placing.x_axis_with(xp.where))


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
    owners = owners_of(s, nefc)
    counts = s.counts
    frames = s.frames
    contacts = integers(d + own.data.contact)[0]
    ncon = integers32(d + own.data.ncon)[0]
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
        one = integers32(contact + own.contact.geom)[0]
        two = integers32(contact + own.contact.geom)[1]
        for p in range(own.count):
            first = integers(own.other)[p]
            second = integers(own.own)[p]
            forward = one == first and two == second
            back = one == second and two == first
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
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@kernel
def turned_by(matrix, vector):
    """Return a vector in the world, from a frame with a matrix of nine numbers."""
    return (
        dot(three(matrix), vector),
        dot(three(at(matrix, 3)), vector),
        dot(three(at(matrix, 6)), vector),
    )


@kernel
def column(matrix, i):
    """Return axis i of a frame in the world."""
    return matrix[i], matrix[3 + i], matrix[6 + i]


@kernel
def column_of(matrix, count, i):
    """Return column i of a matrix of three rows of `count` numbers."""
    return matrix[i], matrix[count + i], matrix[2 * count + i]


@kernel
def axes(s, p):
    """Return the axes of patch p: x, y, normal."""
    frame = three(at(s.frames, 6 * p))
    x = three(at(s.axes, 3 * p))
    n = times(1.0 / norm(frame), frame)
    return x, cross(n, x), n


@kernel
def _put_axis(own, d, s, p, before, axis):
    """Write the x axis of patch p: that of its site, across the normal, on the side of the last one."""
    turned = at(doubles(integers(d + own.data.site_xmat)[0]), 9 * integers(own.site)[p])
    frame = three(at(s.frames, 6 * p))
    n = times(1.0 / norm(frame), frame)
    x = column(turned, 0)
    y = column(turned, 1)
    last = turned_by(turned, three(before))
    x = plus(x, -dot(x, n), n)
    y = plus(y, -dot(y, n), n)
    last = plus(last, -dot(last, n), n)
    first, second, third, s.carried[2 * p], s.carried[2 * p + 1] = x_axis(x, y, last, n)
    x = first, second, third
    for i in range(3):
        s.axes[3 * p + i] = x[i]
        axis[i] = dot(x, column(turned, i))


@kernel
def _add_surface(own, m, d, s, p, geom, spin, sign):
    """Add to the drift of patch p the mean twist of the surface of a geom relative to its body, which turns by `spin`.

    Return velocity and spin of the surface where the step begins, and its mean velocity in the last step.
    """
    surface = at(doubles(integers(m + own.model.geom_surfacevel)[0]), 6 * geom)
    dt = doubles(m + own.model.timestep)[0]
    turned = at(doubles(integers(d + own.data.geom_xmat)[0]), 9 * geom)
    away = plus(
        three(at(s.frames, 6 * p + 3)),
        -1.0,
        three(at(doubles(integers(d + own.data.geom_xpos)[0]), 3 * geom)),
    )
    turn = turned_by(turned, three(at(surface, 3)))
    move = plus(turned_by(turned, three(surface)), 1.0, cross(turn, away))
    first, second = turning_mean(xp, dt * norm(turn))
    across = cross(turn, move)
    mean = plus(plus(move, dt * first, across), dt * dt * second, cross(turn, across))
    _add_drift(
        s,
        p,
        sign,
        plus(mean, dt, cross(spin, move)),
        plus(turn, 0.5 * dt, cross(spin, turn)),
    )
    return move, turn, plus(move, -0.5 * dt, cross(plus(turn, 2.0, spin), move))


@kernel
def _add_drift(s, p, factor, move, turn):
    """Add a factor times a velocity and a spin to the drift of patch p."""
    x, y, normal = axes(s, p)
    s.drift[3 * p] += factor * dot(x, move)
    s.drift[3 * p + 1] += factor * dot(y, move)
    s.drift[3 * p + 2] += factor * dot(normal, turn)


@kernel
def _add_side(own, m, d, s, p, body, geom, sign):
    """Add the surface of a geom on a body to patch p; return its velocity, spin, and mean velocity in the last step."""
    nv = own.nv
    rows = at(s.jacobian, 3 * own.nv * p)
    point = at(s.frames, 6 * p + 3)
    half = 0.5 * doubles(m + own.model.timestep)[0]
    velocity = doubles(integers(d + own.data.qvel)[0])
    x, y, normal = axes(s, p)
    move = zeros(x)
    turn = zeros(x)
    gain = zeros(x)
    gained = zeros(x)
    if body != 0:
        call_c(own.functions.mj_jac, (m, d, s.moves, s.turns, point, body))
        for i in range(nv):
            moves = column_of(s.moves, nv, i)
            turns = column_of(s.turns, nv, i)
            rows[i] += sign * dot(x, moves)
            rows[nv + i] += sign * dot(y, moves)
            rows[2 * nv + i] += sign * dot(normal, turns)
            move = plus(move, velocity[i], moves)
            turn = plus(turn, velocity[i], turns)
        call_c(own.functions.mj_jacDot, (m, d, s.moves, s.turns, point, body))
        for i in range(nv):
            gain = plus(gain, velocity[i], column_of(s.moves, nv, i))
            gained = plus(gained, velocity[i], column_of(s.turns, nv, i))
        _add_drift(s, p, sign * half, gain, gained)
    before = plus(move, -half, gain)
    if own.model.geom_surfacevel >= 0:
        slide, spin, slid = _add_surface(own, m, d, s, p, geom, turn, sign)
        move = plus(move, 1.0, slide)
        turn = plus(turn, 1.0, spin)
        before = plus(before, 1.0, slid)
    return move, turn, before


@kernel
def _put_places(own, d, s, nefc, p, centre, x, y):
    """Write the places of the contacts of patch p, from its centre along its axes."""
    contacts = integers(d + own.data.contact)[0]
    owners = owners_of(s, nefc)
    places = places_of(s, nefc)
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
    sides = integers(own.curved)[p]
    normal = axes(s, p)[2]
    return (
        sides & placing.ROUND != 0
        or (
            sides & placing.OWN != 0
            and _turns_over(own, d, integers(own.own)[p], normal)
        )
        or (
            sides & placing.OTHER != 0
            and _turns_over(own, d, integers(own.other)[p], normal)
        )
    )


@kernel
def is_at_contact(own, d, s, p):
    """Return True if the origin of patch p follows the contact forces."""
    centre = integers(own.centre)[p]
    return centre == placing.AT_CONTACT or (
        centre == placing.AUTO and is_curved(own, d, s, p)
    )


@kernel
def _put_origin(own, d, s, p, normal, held):
    """Write the origin of patch p, in the plane of its contacts, in place of the sum of these.

    It lies below the site, or at the last centre, if any, which moves with the body of the site.
    """
    frame = at(s.frames, 6 * p)
    local = three(held)
    middle = times(1.0 / s.counts[p], three(at(frame, 3)))
    site = integers(own.site)[p]
    new = square(local) == 0.0
    turned = at(doubles(integers(d + own.data.site_xmat)[0]), 9 * site)
    origin = three(at(doubles(integers(d + own.data.site_xpos)[0]), 3 * site))
    if is_at_contact(own, d, s, p):
        origin = middle if new else plus(origin, 1.0, turned_by(turned, local))
    frame[3], frame[4], frame[5] = onto_plane(origin, middle, normal)


@kernel
def _rows(own, m, d, s, nefc, p, kept):
    """Write the three rows of patch p into the Jacobian, the places of its contacts, and how fast its bodies roll."""
    frame = at(s.frames, 6 * p)
    _put_axis(own, d, s, p, at(kept.before, 3 * p), at(kept.axis, 3 * p))
    x, y, normal = axes(s, p)
    centre = at(frame, 3)
    rows = at(s.jacobian, 3 * own.nv * p)
    _put_origin(own, d, s, p, normal, at(kept.held, 3 * p))
    _put_places(own, d, s, nefc, p, centre, x, y)
    clear(rows, 3 * own.nv)
    move, turn, before = _add_side(
        own, m, d, s, p, integers(own.owner)[p], integers(own.own)[p], 1.0
    )
    below, spin, past = _add_side(
        own, m, d, s, p, integers(own.support)[p], integers(own.other)[p], -1.0
    )
    call_c(
        own.functions.mj_objectVelocity,
        (m, d, own.constants.GEOM, integers(own.carrier)[p], s.block, 0),
    )
    tilt = plus(turn, -1.0, spin)
    dt = doubles(m + own.model.timestep)[0]
    apart = dot(normal, plus(before, -1.0, past))
    goes = integers(own.carrier)[p] == integers(own.own)[p]
    over = plus(move if goes else below, -1.0, three(at(s.block, 3)))
    _add_drift(
        s,
        p,
        1.0,
        bend(over, tilt, plus(turn, 1.0, spin), normal, apart, -1.0, dt),
        zeros(tilt),
    )
    s.tilts[p] = math.sqrt(dot(x, tilt) ** 2 + dot(y, tilt) ** 2)


@kernel
def place(own, m, d, s, nefc, kept):
    """Write the Jacobian of the twists, zero without contact; return the number of patches in contact.

    What patches remember has their last origins and x axes, in the frames of their sites.
    """
    _collect(own, d, s, nefc)
    touching = 0
    for p in range(own.count):
        s.carried[2 * p] = 1.0
        s.carried[2 * p + 1] = 0.0
        for i in range(3):
            s.drift[3 * p + i] = 0.0
            kept.axis[3 * p + i] = kept.before[3 * p + i]
        if s.counts[p] > 0:
            _rows(own, m, d, s, nefc, p, kept)
            touching += 1
        else:
            clear(at(s.jacobian, 3 * own.nv * p), 3 * own.nv)
    return touching
