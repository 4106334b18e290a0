"""Roll-outs and their adjoint, `LANES` contacts, or parts of contacts, abreast in vector code.

These advance together, a chunk of steps at a time. All numbers of a chunk lie in one flat array `w`: field after field
of `SLOTS` numbers, a slot for each step and lane. What belongs to a lane alone lies likewise in `own`, in fields of
`LANES` numbers. That lets the compiler vectorise: offsets between fields are constants, so that it sees that no two
fields meet, and indices are sums of constants and a counter, so that it sees that none is negative. What does not
depend on the bristles (limit surface, steady sliding) is done for all slots of a chunk first.

The loops are written once; `bind` makes them entry points of a model, whose functions are compiled into them. These
take `w`, whose slots begin at its start, and `own`, with the number c of a lane:

- `begin(own, c, surface, data)`: what the lane needs beside the row of its contact, which is in place;
- `scaled(own, c, twist)`: the twist as the model sees it;
- `prepare(w, own, inputs, lanes, steps, slopes)`: what a step holds, for all slots; with its `slopes` on the way back;
- `advance(w, own, c, z, none, dt)`: new state and wrench per unit load; with `none` the state will be forgotten;
- `retreat(w, own, c, z, dt, new, pull)`: the wrench per unit load, and `Cotangents` from those of the new state and of
  the wrench.

A step without load forgets its state, as in `rollouts`, whose `Inputs` come in; the shape is the same for all loads.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels.rollouts import row_of
from planarfriction.kernels.vectors import accumulate, dot, three, times

LANES = 8
SLOTS = 136

NUMBERS = 20
"""Room for the numbers of a contact; a test checks that those of each model fit."""

TWIST, OMEGA, LOAD, WRENCH, STATE, TWIST_BAR, LOAD_BAR, FIELDS = (SLOTS * n for n in (0, 3, 4, 5, 8, 11, 14, 15))
"""Offsets of the fields of `w`: `scaled` twist, spin, load, wrench or its cotangent, state before a step; those of the
model begin at `FIELDS`."""

ROW, ROW_BAR, CARRY, SHARE, OWN = (LANES * n for n in (0, NUMBERS, 2 * NUMBERS, 2 * NUMBERS + 3, 2 * NUMBERS + 4))
"""Offsets of the fields of `own`: numbers of the contact and their gradient, what one step hands to the next, share
of the load; those of the model begin at `OWN`."""


@kernel
def slot(w, field, i):
    """Return the three fields of a slot."""
    return w[field + i], w[field + SLOTS + i], w[field + 2 * SLOTS + i]


@kernel
def put_slot(w, field, i, a):
    """Write three fields of a slot."""
    w[field + i], w[field + SLOTS + i], w[field + 2 * SLOTS + i] = a


@kernel
def carried(own, c):
    return own[CARRY + c], own[CARRY + LANES + c], own[CARRY + 2 * LANES + c]


@kernel
def carry(own, c, a):
    own[CARRY + c], own[CARRY + LANES + c], own[CARRY + 2 * LANES + c] = a


@kernel
def _lane(span, lane):
    """Return the part and contact of a lane, counted over all contacts of a part after the other."""
    count = span[1] - span[0]
    return lane // count, span[0] + lane % count


# ---------------------------------------------------------------------- steps, for the contacts abreast


@kernel
def _forward_one(advance, w, own, c, dt):
    z, load = carried(own, c), w[LOAD + c]
    none = load == 0.0
    put_slot(w, STATE, c, z)
    (nx, ny, nt), wrench = advance(w, own, c, z, none, dt)
    wx, wy, wt = times(load, wrench)
    put_slot(w, WRENCH, c, (xp.where(none, 0.0, wx), xp.where(none, 0.0, wy), xp.where(none, 0.0, wt)))
    carry(own, c, (xp.where(none, 0.0, nx), xp.where(none, 0.0, ny), xp.where(none, 0.0, nt)))


@kernel
def _forward(advance, w, own, lanes, dt):
    """Step the contacts, whose slots begin at the start of `w`."""
    for c in range(lanes):  # the body apart: kernel later, it leaves the compiler a loop that it can count
        _forward_one(advance, w, own, c, dt)


@kernel
def _backward_one(retreat, w, own, c, dt):
    load, pull = w[LOAD + c], slot(w, WRENCH, c)
    new = times(xp.where(load == 0.0, 0.0, 1.0), carried(own, c))
    wrench, bar = retreat(w, own, c, slot(w, STATE, c), dt, new, times(load, pull))
    carry(own, c, bar.state)
    put_slot(w, TWIST_BAR, c, bar.twist)
    w[LOAD_BAR + c] = own[SHARE + c] * dot(pull, wrench)
    accumulate(own, ROW_BAR + c, LANES, (bar.law, bar.shape))


@kernel
def _backward(retreat, w, own, lanes, dt):
    """Step the contacts backwards, carrying the cotangent of the state."""
    for c in range(lanes):
        _backward_one(retreat, w, own, c, dt)


# ---------------------------------------------------------------------- roll-outs


@kernel
def _begin(begin, own, inputs, span, carried, first, lanes):
    """Write the rows of the lanes from `first` on and the states that they carry, with zero gradients."""
    for c in range(lanes):
        p, b = _lane(span, first + c)
        rows = inputs.rows[p]
        row = rows[row_of(rows, b)]
        for m in range(row.shape[0]):
            own[ROW + m * LANES + c] = row[m]
            own[ROW_BAR + m * LANES + c] = 0.0
        own[SHARE + c] = inputs.shares[p, 0]
        carry(own, c, three(carried[p, b]))
        begin(own, c, inputs.surface[p, 0], inputs.data)


@kernel
def _read(scaled, w, own, inputs, span, first, lanes, begin, end):
    """Read scaled twists, spins and loads of the steps from `begin` to `end`."""
    for c in range(lanes):
        _, b = _lane(span, first + c)
        twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
        for t in range(begin, end):
            i, twist = (t - begin) * lanes + c, three(twists[t])
            put_slot(w, TWIST, i, scaled(own, c, twist))
            w[OMEGA + i], w[LOAD + i] = twist[2], own[SHARE + c] * loads[t]


@kernel
def _copy_in(w, field, values, lanes, c, begin, end):
    """Copy three components of each step to the slots of a lane."""
    for t in range(begin, end):
        put_slot(w, field, (t - begin) * lanes + c, (values[t, 0], values[t, 1], values[t, 2]))


@kernel
def _copy_out(w, field, values, lanes, c, begin, end):
    """Copy the slots of a lane to three components of each step."""
    for t in range(begin, end):
        values[t, 0], values[t, 1], values[t, 2] = slot(w, field, (t - begin) * lanes + c)


@kernel
def _add(w, field, values, lanes, c, begin, end):
    """Add the slots of a lane to three components of each step."""
    for t in range(begin, end):
        x, y, z = slot(w, field, (t - begin) * lanes + c)
        values[t, 0], values[t, 1], values[t, 2] = values[t, 0] + x, values[t, 1] + y, values[t, 2] + z


@kernel
def _rollout(begin, scaled, prepare, advance, inputs, span, z, wrench, states, w, own):
    """Step the contacts `span[0]` to `span[1]`: `z` [P, B, 3] in place, wrenches added to `wrench` [B, T, 3].

    The state before each step goes into `states` [P, B, T, 3], unless that is empty.
    """
    steps, count, kept = inputs.dt.shape[0], (span[1] - span[0]) * inputs.shares.shape[0], states.shape[2] > 0
    for first in range(0, count, LANES):
        lanes = min(LANES, count - first)
        chunk = SLOTS // lanes
        _begin(begin, own, inputs, span, z, first, lanes)
        for at in range(0, steps, chunk):
            end = min(at + chunk, steps)
            _read(scaled, w, own, inputs, span, first, lanes, at, end)
            prepare(w, own, inputs, lanes, end - at, False)
            for t in range(at, end):
                _forward(advance, w[(t - at) * lanes :], own, lanes, inputs.dt[t])
            for c in range(lanes):
                p, b = _lane(span, first + c)
                _add(w, WRENCH, wrench[b], lanes, c, at, end)
                if kept:
                    _copy_out(w, STATE, states[p, b], lanes, c, at, end)
        for c in range(lanes):
            p, b = _lane(span, first + c)
            z[p, b, 0], z[p, b, 1], z[p, b, 2] = carried(own, c)


@kernel
def _gradient(begin, scaled, prepare, retreat, inputs, states, wrench_bar, span, bars, w, own):
    """Add the adjoint of `_rollout` with its `states`, from cotangents of the wrenches [B or 1, T, 3], to `bars`.

    `bars` are those of `rollouts`, of each part those of state [P, B, 3] and rows [P, B, N].
    """
    steps, count = inputs.dt.shape[0], (span[1] - span[0]) * inputs.shares.shape[0]
    for first in range(0, count, LANES):
        lanes = min(LANES, count - first)
        chunk = SLOTS // lanes
        _begin(begin, own, inputs, span, bars.state, first, lanes)
        for end in range(steps, 0, -chunk):
            at = max(end - chunk, 0)
            _read(scaled, w, own, inputs, span, first, lanes, at, end)
            for c in range(lanes):
                p, b = _lane(span, first + c)
                _copy_in(w, STATE, states[p, row_of(states[p], b)], lanes, c, at, end)
                _copy_in(w, WRENCH, wrench_bar[row_of(wrench_bar, b)], lanes, c, at, end)
            prepare(w, own, inputs, lanes, end - at, True)
            for t in range(end - 1, at - 1, -1):
                _backward(retreat, w[(t - at) * lanes :], own, lanes, inputs.dt[t])
            for c in range(lanes):
                p, b = _lane(span, first + c)
                _add(w, TWIST_BAR, bars.twist[b], lanes, c, at, end)
                for t in range(at, end):
                    bars.load[b, t] += w[LOAD_BAR + (t - at) * lanes + c]
        for c in range(lanes):
            p, b = _lane(span, first + c)
            bars.state[p, b, 0], bars.state[p, b, 1], bars.state[p, b, 2] = carried(own, c)
            for m in range(bars.rows.shape[2]):
                bars.rows[p, b, m] += own[ROW_BAR + m * LANES + c]


# ---------------------------------------------------------------------- entry points of a model


class LaneModel(NamedTuple):
    """Functions of a model to which `bind` binds the loops, and the lengths of its `w` and `own`."""

    begin: Any
    scaled: Any
    prepare: Any
    advance: Any
    retreat: Any
    numbers: int
    own_numbers: int


def rollout(begin, scaled, prepare, advance, numbers, own_numbers, inputs, span, z, wrench, states):
    """Allocate the scratch of `_rollout` and run it."""
    w, own = np.empty(numbers), np.empty(own_numbers)
    _rollout(begin, scaled, prepare, advance, inputs, span, z, wrench, states, w, own)


def gradient(begin, scaled, prepare, retreat, numbers, own_numbers, inputs, states, wrench_bar, span, bars):
    """Allocate the scratch of `_gradient` and run it."""
    w, own = np.empty(numbers), np.empty(own_numbers)
    _gradient(begin, scaled, prepare, retreat, inputs, states, wrench_bar, span, bars, w, own)
