"""Roll-outs of the published reduced model and their adjoint, `LANES` contacts abreast in vector code.

As `rollouts.roll` and `rollouts.gradient` with `published_step`, and 2.2 times as fast for many contacts. These advance
together, a chunk of steps at a time. All numbers of a chunk lie in one flat array `w`: field after field of `SLOTS`
numbers, a slot for each step and contact. What belongs to a contact alone lies likewise in `own`, in fields of `LANES`
numbers. That lets the compiler vectorise: offsets between fields are constants, so that it sees that no two fields
meet, and indices are sums of constants and a counter, so that it sees that none is negative. What does not depend on
the bristles (the limit surface) is done for all slots of a chunk first.
"""

from __future__ import annotations

import numpy as np

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import jit, kernel
from planarfriction.kernels.law import LAW, LawNumbers
from planarfriction.kernels.published_contact import Shape
from planarfriction.kernels.published_step import NAMES, Held, linearise, pull_back, scaled_twist
from planarfriction.kernels.rollouts import Contact, row_of
from planarfriction.kernels.surfaces import (
    BILINEAR,
    bilinear_blend,
    bilinear_frame,
    bilinear_inset,
    place,
    sliding,
    sliding_jacobian,
)
from planarfriction.kernels.vectors import accumulate, dot, gathered, norm, three, times

LANES = 8
SLOTS = 128
_NUMBERS = len(NAMES)

# Fields of `w`. The table's corners lie where the sliding and its slopes come to lie.
_TWIST, _SLIDING, _SLOPES, _OMEGA, _LOAD, _WRENCH, _STATE, _TWIST_BAR, _LOAD_BAR, _PLACE, _FIELDS = (
    SLOTS * n for n in (0, 3, 6, 15, 16, 17, 20, 23, 26, 27, 31)
)

# Fields of `own`: numbers of the contact and their gradient, and what one step hands to the next.
_ROW, _ROW_BAR, _CARRY, _OWN = (LANES * n for n in (0, _NUMBERS, 2 * _NUMBERS, 2 * _NUMBERS + 3))


@kernel
def _slot(w, field, i):
    return w[field + i], w[field + SLOTS + i], w[field + 2 * SLOTS + i]


@kernel
def _put(w, field, i, a):
    w[field + i], w[field + SLOTS + i], w[field + 2 * SLOTS + i] = a


# ---------------------------------------------------------------------- limit surface, for all slots


@kernel
def _places(w, count, size):
    """Corner and position in the bilinear table of each twist, and its polar angle."""
    row = 4 * (4 * size + 1)
    for i in range(count):
        x, y, s = _slot(w, _TWIST, i)
        mirror = xp.where(s < 0.0, -1.0, 1.0)
        p, q, a, b, polar, _ = place(size, mirror * x, mirror * y, mirror * s)
        w[_PLACE + i], w[_PLACE + 3 * SLOTS + i] = float(p * row + 4 * q), polar
        w[_PLACE + SLOTS + i], w[_PLACE + 2 * SLOTS + i] = a, b


@kernel
def _corners(w, count, data, start, size):
    """The four corners of `h`, where `u` and its slopes will lie."""
    row = 4 * (4 * size + 1)
    for i in range(count):
        p = start + int(w[_PLACE + i])
        for c in range(3):
            at = _SLIDING + 4 * c * SLOTS + i
            w[at], w[at + SLOTS] = data[p + c], data[p + c + 4]
            w[at + 2 * SLOTS], w[at + 3 * SLOTS] = data[p + c + row], data[p + c + row + 4]


@kernel
def _corner(w, c, i, a, b):
    at = _SLIDING + 4 * c * SLOTS + i
    return bilinear_blend(w[at], w[at + SLOTS], w[at + 2 * SLOTS], w[at + 3 * SLOTS], a, b)


@kernel
def _slope_row(corner, frame, moving, c):
    """A row of `du/dV_S`; that of the ellipsoid at rest."""
    radial, polar, azimuth = frame
    x = corner[0] * radial[0] + corner[1] * polar[0] + corner[2] * azimuth[0]
    y = corner[0] * radial[1] + corner[1] * polar[1] + corner[2] * azimuth[1]
    s = corner[0] * radial[2] + corner[1] * polar[2] + corner[2] * azimuth[2]
    return (
        xp.where(moving, x, 1.0 if c == 0 else 0.0),
        xp.where(moving, y, 1.0 if c == 1 else 0.0),
        xp.where(moving, s, 1.0 if c == 2 else 0.0),
    )


@kernel
def _bilinear_one(w, i, a, b):
    """`u` in a slot; its speed and on which side of the equator it lies."""
    twist = _slot(w, _TWIST, i)
    v, mirror = norm(twist), xp.where(twist[2] < 0.0, -1.0, 1.0)
    h = _corner(w, 0, i, a, b)[0], _corner(w, 1, i, a, b)[0], _corner(w, 2, i, a, b)[0]
    return times(mirror * v, h), v, times(mirror, twist)


@kernel
def _bilinear(w, count):
    """`u` from the corners."""
    for i in range(count):
        _put(w, _SLIDING, i, _bilinear_one(w, i, w[_PLACE + SLOTS + i], w[_PLACE + 2 * SLOTS + i])[0])


@kernel
def _bilinear_slopes(w, count, size):
    """`u` and its Jacobian from the corners."""
    for i in range(count):
        a, b, polar = _slot(w, _PLACE + SLOTS, i)
        u, v, (x, y, s) = _bilinear_one(w, i, a, b)
        frame, inset = bilinear_frame(size, x, y, s, polar), bilinear_inset(size, a, polar)
        jx = _slope_row(_corner(w, 0, i, inset, b), frame, v > 0.0, 0)
        jy = _slope_row(_corner(w, 1, i, inset, b), frame, v > 0.0, 1)
        js = _slope_row(_corner(w, 2, i, inset, b), frame, v > 0.0, 2)
        _put(w, _SLIDING, i, u)
        _put(w, _SLOPES, i, jx)
        _put(w, _SLOPES + 3 * SLOTS, i, jy)
        _put(w, _SLOPES + 6 * SLOTS, i, js)


@kernel
def _surface(w, count, surface, data, slopes, j):
    """`u` and, with `slopes`, its Jacobian for all slots; `j` [9]: scratch."""
    kind, start, size = surface[0], surface[1], surface[2]
    if kind == BILINEAR:
        _places(w, count, size)
        _corners(w, count, data, start, size)
        if slopes:
            _bilinear_slopes(w, count, size)
        else:
            _bilinear(w, count)
        return
    for i in range(count):
        x, y, s = twist = _slot(w, _TWIST, i)
        v = norm(twist)
        _put(w, _SLIDING, i, sliding(kind, data, start, size, x, y, s, v))
        if slopes:
            sliding_jacobian(kind, data, start, size, x, y, s, v, j)
            for m in range(9):
                w[_SLOPES + m * SLOTS + i] = j[m]


# ---------------------------------------------------------------------- steps, for the contacts abreast


@kernel
def _contact(own, c):
    row = gathered(own, _ROW + c, LANES, _NUMBERS)
    return Contact(LawNumbers(*row[:LAW]), Shape(*row[LAW:]), 0, 0)


@kernel
def _step(w, contact, c, z, dt):
    twist = _slot(w, _TWIST, c)
    return linearise(contact, Held(twist, w[_OMEGA + c], norm(twist), _slot(w, _SLIDING, c)), z, dt)


@kernel
def _carried(own, c):
    return own[_CARRY + c], own[_CARRY + LANES + c], own[_CARRY + 2 * LANES + c]


@kernel
def _carry(own, c, a):
    own[_CARRY + c], own[_CARRY + LANES + c], own[_CARRY + 2 * LANES + c] = a


@kernel
def _forward_one(w, own, c, dt):
    z, load = _carried(own, c), w[_LOAD + c]
    step = _step(w, _contact(own, c), c, z, dt)
    _put(w, _STATE, c, z)
    (wx, wy, wt), (nx, ny, nt), none = times(load, step.wrench), step.new, load == 0.0
    _put(w, _WRENCH, c, (xp.where(none, 0.0, wx), xp.where(none, 0.0, wy), xp.where(none, 0.0, wt)))
    _carry(own, c, (xp.where(none, 0.0, nx), xp.where(none, 0.0, ny), xp.where(none, 0.0, nt)))


@kernel
def _forward(w, own, lanes, dt):
    """One step of the contacts, whose slots begin at the start of `w`."""
    for c in range(lanes):  # the body apart: kernel later, it leaves the compiler a loop that it can count
        _forward_one(w, own, c, dt)


@kernel
def _backward_one(w, own, c, dt):
    contact, load, pull = _contact(own, c), w[_LOAD + c], _slot(w, _WRENCH, c)
    step = _step(w, contact, c, _slot(w, _STATE, c), dt)
    new = times(xp.where(load == 0.0, 0.0, 1.0), _carried(own, c))
    bar = pull_back(contact, step, gathered(w, _SLOPES + c, SLOTS, 9), new, times(load, pull))
    _carry(own, c, bar.state)
    _put(w, _TWIST_BAR, c, bar.twist)
    w[_LOAD_BAR + c] = dot(pull, step.wrench)
    accumulate(own, _ROW_BAR + c, LANES, (bar.law, bar.shape))


@kernel
def _backward(w, own, lanes, dt):
    """One step of the contacts backwards: carries the cotangent of the state."""
    for c in range(lanes):
        _backward_one(w, own, c, dt)


# ---------------------------------------------------------------------- roll-outs


@kernel
def _begin(own, rows, carried, first, lanes):
    """Rows of the contacts from `first` on, and what they carry; no gradient yet."""
    for c in range(lanes):
        row = rows[row_of(rows, first + c)]
        for m in range(_NUMBERS):
            own[_ROW + m * LANES + c] = row[m]
            own[_ROW_BAR + m * LANES + c] = 0.0
        for m in range(3):
            own[_CARRY + m * LANES + c] = carried[first + c, m]


@kernel
def _read(w, own, inputs, first, lanes, begin, end):
    """Scaled twists, spins and loads of the steps from `begin` to `end`."""
    for c in range(lanes):
        shape = _contact(own, c).shape
        twists, loads = inputs.twist[row_of(inputs.twist, first + c)], inputs.load[row_of(inputs.load, first + c)]
        for t in range(begin, end):
            i, twist = (t - begin) * lanes + c, three(twists[t])
            _put(w, _TWIST, i, scaled_twist(shape, twist))
            w[_OMEGA + i], w[_LOAD + i] = twist[2], loads[t]


@kernel
def _copy_in(w, field, values, first, lanes, begin, end):
    """Three components of each step into a field."""
    for c in range(lanes):
        own = values[row_of(values, first + c)]
        for t in range(begin, end):
            _put(w, field, (t - begin) * lanes + c, (own[t, 0], own[t, 1], own[t, 2]))


@kernel
def _copy_out(w, field, values, first, lanes, begin, end):
    """A field into three components of each step."""
    for c in range(lanes):
        own = values[first + c]
        for t in range(begin, end):
            own[t, 0], own[t, 1], own[t, 2] = _slot(w, field, (t - begin) * lanes + c)


@jit
def rollout(inputs, span, z, wrench, states):
    """As `rollouts.roll`."""
    w, own, scratch, steps = np.empty(_FIELDS), np.empty(_OWN), np.empty(9), inputs.dt.shape[0]
    for b in range(span[0], span[1], LANES):
        lanes = min(LANES, span[1] - b)
        chunk = SLOTS // lanes
        _begin(own, inputs.rows, z, b, lanes)
        for begin in range(0, steps, chunk):
            end = min(begin + chunk, steps)
            _read(w, own, inputs, b, lanes, begin, end)
            _surface(w, (end - begin) * lanes, inputs.surface, inputs.data, False, scratch)
            for t in range(begin, end):
                _forward(w[(t - begin) * lanes :], own, lanes, inputs.dt[t])
            _copy_out(w, _WRENCH, wrench, b, lanes, begin, end)
            if states.shape[1] > 0:
                _copy_out(w, _STATE, states, b, lanes, begin, end)
        for c in range(lanes):
            z[b + c, 0], z[b + c, 1], z[b + c, 2] = _carried(own, c)


@jit
def gradient(inputs, states, wrench_bar, span, bars):
    """As `rollouts.gradient`."""
    w, own, scratch, steps = np.empty(_FIELDS), np.empty(_OWN), np.empty(9), inputs.dt.shape[0]
    for b in range(span[0], span[1], LANES):
        lanes = min(LANES, span[1] - b)
        chunk = SLOTS // lanes
        _begin(own, inputs.rows, bars.state, b, lanes)
        for end in range(steps, 0, -chunk):
            begin = max(end - chunk, 0)
            _read(w, own, inputs, b, lanes, begin, end)
            _copy_in(w, _STATE, states, b, lanes, begin, end)
            _copy_in(w, _WRENCH, wrench_bar, b, lanes, begin, end)
            _surface(w, (end - begin) * lanes, inputs.surface, inputs.data, True, scratch)
            for t in range(end - 1, begin - 1, -1):
                _backward(w[(t - begin) * lanes :], own, lanes, inputs.dt[t])
            _copy_out(w, _TWIST_BAR, bars.twist, b, lanes, begin, end)
            for c in range(lanes):
                for t in range(begin, end):
                    bars.load[b + c, t] = w[_LOAD_BAR + (t - begin) * lanes + c]
        for c in range(lanes):
            bars.state[b + c, 0], bars.state[b + c, 1], bars.state[b + c, 2] = _carried(own, c)
            for m in range(_NUMBERS):
                bars.rows[b + c, m] = own[_ROW_BAR + m * LANES + c]
