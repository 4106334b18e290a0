"""Roll-outs of the reduced model and their adjoint, in vector code (see `lanes`).

Steady sliding is found for all slots of a chunk in three passes: where each twist lies in its map, in vector code; what
the map holds there; and what follows from that, in vector code again. Maps are those of one load, not blended.
"""

from __future__ import annotations

import numpy as np

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.kernels import cube, lanes
from planarfriction.kernels.bind import bind
from planarfriction.kernels.cube import Square
from planarfriction.kernels.lanes import (
    FIELDS,
    LANES,
    OWN,
    ROW,
    SLOTS,
    TWIST,
    TWIST_BAR,
    LaneModel,
    carried,
    put_slot,
    slot,
)
from planarfriction.kernels.law import LAW, LawNumbers
from planarfriction.kernels.moment_steps import Contact
from planarfriction.kernels.reduced import Quartic, to_origin
from planarfriction.kernels.reduced_contact import ReducedPatch
from planarfriction.kernels.reduced_step import NAMES, SteadySlopes, SteadyTwist, advance, pull_back, step_of
from planarfriction.kernels.steady import (
    FAR,
    QUARTIC,
    STILL,
    Head,
    MapSquares,
    Readings,
    combined,
    evenness,
    floored,
    located,
    number,
    readings,
    scaled_twist,
)
from planarfriction.kernels.vectors import gathered, norm, times

_NUMBERS, _HEAD_NUMBERS = len(NAMES), len(Head._fields)

# Fields of `w`. The places in the map lie where the cotangents of twist and load come to lie, its readings where the
# steady state and its slopes do.
_FLAT_PLACE, _REST_PLACE, _T = (TWIST_BAR + SLOTS * n for n in (0, 3, 6))
_SPEED, _FLAT, _REST, _FLAT_A, _FLAT_B, _REST_A, _REST_B, _REST_T, _END = (
    FIELDS + SLOTS * n for n in (3, 4, 7, 10, 13, 16, 19, 22, 25)
)
_WEIGHTS, _WEIGHT_SLOPES = (FIELDS + SLOTS * n for n in (10, 14))
_STEADY, _BY_X, _BY_Y, _BY_S, _BY_MU_C, _BY_MU_S, _BY_V_S = _FLAT, _REST, _FLAT_A, _FLAT_B, _REST_A, _REST_B, _REST_T

# Fields of `own`: head and beginning of the map, coefficients of `<u^4>`, evenness and norm of the state.
_HEAD, _START, _FOURTH, _EVEN, _SIZE, _OWN = (
    OWN + LANES * n for n in (0, *(_HEAD_NUMBERS + m for m in (0, 1, 16, 17, 18)))
)


@kernel
def _contact(own, c):
    row = gathered(own, ROW + c, LANES, _NUMBERS)
    return Contact(LawNumbers(*row[:LAW]), ReducedPatch(*row[LAW:]), 0, 0)


@kernel
def _fourth(own, c):
    k = gathered(own, _FOURTH + c, LANES, 15)
    return k[:6], k[6:11], k[11:]


@kernel
def _begin(own, c, surface, data):
    start = surface[0]
    own[_START + c] = float(start)
    for m in range(_HEAD_NUMBERS):
        own[_HEAD + m * LANES + c] = number(data, start + m)
    for m in range(15):
        own[_FOURTH + m * LANES + c] = number(data, start + QUARTIC + m)
    z = carried(own, c)
    own[_EVEN + c], own[_SIZE + c] = evenness(_contact(own, c).law, _fourth(own, c), z)[0], norm(z)


@kernel
def _scaled(own, c, twist):
    return scaled_twist(_contact(own, c).shape, twist[0], twist[1], twist[2])


# ---------------------------------------------------------------------- steady sliding, for all slots


@kernel
def _moving(w, i):
    """Return a twist that moves, and its speed: any for a patch at rest."""
    (x, y, s), v = slot(w, TWIST, i), w[_SPEED + i]
    moves = v > 0.0
    return (xp.where(moves, x, 1.0), y, s), xp.where(moves, v, 1.0)


@kernel
def _head(own, c):
    return Head(*gathered(own, _HEAD + c, LANES, _HEAD_NUMBERS))


@kernel
def _put_four(w, field, i, a):
    w[field + i], w[field + SLOTS + i] = a[0], a[1]
    w[field + 2 * SLOTS + i], w[field + 3 * SLOTS + i] = a[2], a[3]


@kernel
def _place(w, i, own, c, slopes, squared):
    """Find the place of a slot's twist in the map; `squared`: its exponent is 2."""
    twist, head = slot(w, TWIST, i), _head(own, c)
    v = norm(twist)
    moves = v > STILL
    w[_SPEED + i] = xp.where(moves, v, 0.0)
    put_slot(w, TWIST, i, times(xp.where(moves, 1.0, 0.0), twist))
    u, v = _moving(w, i)
    if squared:
        head = Head(head.faces, head.n, head.coarse, head.levels, head.knee, head.least, head.stretch, 2.0)
    _, places = located(_contact(own, c).law, head, own[_START + c], u, v)
    put_slot(w, _FLAT_PLACE, i, (places.flat.at, places.flat.u, places.flat.v))
    put_slot(w, _REST_PLACE, i, (places.rest.at, places.rest.u, places.rest.v))
    w[_T + i] = places.t
    _put_four(w, _WEIGHTS, i, places.weights)
    if slopes:
        _put_four(w, _WEIGHT_SLOPES, i, places.slopes)


@kernel
def _look(w, i, own, c, data, slopes):
    """Read the map at the place of a slot."""
    weights = gathered(w, _WEIGHTS + i, SLOTS, 4)
    changes = gathered(w, _WEIGHT_SLOPES + i, SLOTS, 4) if slopes else (0.0, 0.0, 0.0, 0.0)
    flat, rest = Square(*slot(w, _FLAT_PLACE, i)), Square(*slot(w, _REST_PLACE, i))
    read = readings(data, _head(own, c), MapSquares(flat, rest, 0.0, weights, changes))
    put_slot(w, _FLAT, i, read.flat)
    put_slot(w, _REST, i, read.rest)
    if slopes:
        put_slot(w, _FLAT_A, i, read.flat_a)
        put_slot(w, _FLAT_B, i, read.flat_b)
        put_slot(w, _REST_A, i, read.rest_a)
        put_slot(w, _REST_B, i, read.rest_b)
        put_slot(w, _REST_T, i, read.rest_t)


@kernel
def _read(w, i, slopes):
    flat, rest, none = slot(w, _FLAT, i), slot(w, _REST, i), (0.0, 0.0, 0.0)
    if slopes:
        return Readings(
            flat, slot(w, _FLAT_A, i), slot(w, _FLAT_B, i),
            rest, slot(w, _REST_A, i), slot(w, _REST_B, i), slot(w, _REST_T, i),
        )  # fmt: skip
    return Readings(flat, none, none, rest, none, none, none)


@kernel
def _finish(w, i, own, c, slopes):
    """Write the steady state of a slot and its slopes."""
    contact, head = _contact(own, c), _head(own, c)
    (u, v), moves = _moving(w, i), w[_SPEED + i] > 0.0
    spot, t = cube.locate(u[0], u[1], head.stretch * u[2], head.faces), w[_T + i]
    found = floored(contact.law, u, v, combined(contact.law, head, u, v, spot, t, _read(w, i, slopes)))
    q_x, q_y, q_s = found.q
    put_slot(w, _STEADY, i, (xp.where(moves, q_x, FAR), xp.where(moves, q_y, 0.0), xp.where(moves, q_s, 0.0)))
    if slopes:
        by_u = times(xp.where(moves, 1.0, 0.0), found.by_u)
        put_slot(w, _BY_X, i, (by_u[0], by_u[1], by_u[2]))
        put_slot(w, _BY_Y, i, (by_u[3], by_u[4], by_u[5]))
        put_slot(w, _BY_S, i, (by_u[6], by_u[7], by_u[8]))
        put_slot(w, _BY_MU_C, i, times(xp.where(moves, 1.0, 0.0), found.by_mu_c))
        put_slot(w, _BY_MU_S, i, times(xp.where(moves, 1.0, 0.0), found.by_mu_s))
        put_slot(w, _BY_V_S, i, times(xp.where(moves, 1.0, 0.0), found.by_v_s))


@kernel
def _places(w, own, lanes, steps, slopes, squared):
    alone = np.int64(0)
    if lanes == 1:
        for i in range(steps):
            _place(w, i, own, alone, slopes, squared)
    else:
        for t in range(steps):
            _place_row(w[t * lanes :], own, lanes, slopes, squared)


@kernel
def _place_row(w, own, lanes, slopes, squared):
    for c in range(lanes):
        _place(w, c, own, c, slopes, squared)


@kernel
def _finish_row(w, own, lanes, slopes):
    for c in range(lanes):
        _finish(w, c, own, c, slopes)


@kernel
def _prepare(w, own, inputs, lanes, steps, slopes):
    """Compute steady states of all slots: in vector code over the lanes, or over the steps of a single one."""
    alone, squared = np.int64(0), True
    for c in range(lanes):
        squared = squared and _head(own, c).gamma == 2.0
    if squared:
        _places(w, own, lanes, steps, slopes, True)
    else:
        _places(w, own, lanes, steps, slopes, False)
    for t in range(steps):
        for c in range(lanes):
            _look(w, t * lanes + c, own, c, inputs.data, slopes)
    if lanes == 1:
        for i in range(steps):
            _finish(w, i, own, alone, slopes)
    else:
        for t in range(steps):
            _finish_row(w[t * lanes :], own, lanes, slopes)


# ---------------------------------------------------------------------- bound to this model


@kernel
def _held(w, c):
    return SteadyTwist(slot(w, TWIST, c), w[_SPEED + c], slot(w, _STEADY, c))


@kernel
def _advance(w, own, c, z, none, dt):
    contact, rows, held = _contact(own, c), _fourth(own, c), _held(w, c)
    quartic = Quartic(rows, rows, 0.0)
    new, traction, size, even = advance(contact.law, quartic, held.u, held.q, z, own[_SIZE + c], own[_EVEN + c], dt)
    own[_EVEN + c], own[_SIZE + c] = xp.where(none, 1.0, even), xp.where(none, 0.0, size)
    return new, to_origin(contact.shape, *traction)


@kernel
def _retreat(w, own, c, z, dt, new, pull):
    contact, m = _contact(own, c), gathered(w, _BY_X + c, SLOTS, 18)
    step = step_of(contact, _fourth(own, c), _held(w, c), z, dt)
    return step.wrench, pull_back(contact, step, SteadySlopes(m[:9], m[9:12], m[12:15], m[15:]), new, pull)


_MODEL = LaneModel(_begin, _scaled, _prepare, _advance, _retreat, _END, _OWN)
rollout = bind(lanes.rollout, _MODEL, "reduced_rollout", jit)
gradient = bind(lanes.gradient, _MODEL, "reduced_gradient", jit)
