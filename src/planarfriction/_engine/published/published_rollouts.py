"""Rollouts of the published reduced model: with their adjoint, `ABREAST` contacts abreast in vector code.

The limit surface is read contact by contact; the rest of a step is one loop over the lanes. Their numbers lie in one
flat array, in fields of `ABREAST` numbers: offsets are constants, so that the compiler sees that no two fields meet.

Derivatives forward in time go contact by contact. A step without load forgets its state, as `rollouts` says.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from planarfriction._engine.bristles.law import LAW, law_of
from planarfriction._engine.cells.rollouts import Bars, Derivatives, Inputs, row_of
from planarfriction._engine.codegen.vectors import (
    Vector,
    accumulate,
    add,
    clear,
    dot,
    gathered,
    norm,
    put,
    scatter,
    three,
    times,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.published.published_contact import PublishedPatch
from planarfriction._engine.published.published_step import (
    NAMES,
    HeldTwist,
    PublishedContactData,
    PublishedStep,
    hold_slopes,
    pull_back,
    scaled_twist,
    shape_of,
    taped_step,
)
from planarfriction._engine.published.surfaces import sliding, sliding_jacobian
from planarfriction.formulas import LawNumbers

ABREAST = 8
"""Contacts of one loop: the numbers of the longest vectors of processors."""

SCRATCH = 9
"""Numbers that `hold_slopes` may write to."""

_NUMBERS = len(NAMES)
_SIZES = (_NUMBERS, _NUMBERS, 3, 3, 1, 3, 1, 3, 3, 3, 1, 9)
_OFFSETS = [ABREAST * n for n in itertools.accumulate(_SIZES, initial=0)]
_ROW = _OFFSETS[0]
"""Field: numbers of the contact."""

_ROW_BAR = _OFFSETS[1]
"""Field: gradient by the numbers of the contact."""

_STATE = _OFFSETS[2]
"""Field: state before a step."""

_TWIST = _OFFSETS[3]
"""Field: scaled twist."""

_OMEGA = _OFFSETS[4]
"""Field: spin."""

_SLIDING = _OFFSETS[5]
"""Field: sliding."""

_LOAD = _OFFSETS[6]
"""Field: load."""

_WRENCH = _OFFSETS[7]
"""Field: wrench or its cotangent."""

_CARRY = _OFFSETS[8]
"""Field: cotangent of the state."""

_TWIST_BAR = _OFFSETS[9]
"""Field: cotangent of the twist."""

_LOAD_BAR = _OFFSETS[10]
"""Field: cotangent of the load."""

_SLOPES = _OFFSETS[11]
"""Field: slopes of the sliding."""

_END = _OFFSETS[12]
"""Number of all fields."""


@kernel
def _vector(w: np.ndarray, field: int, c: int) -> Vector:
    return gathered(w, field + c, ABREAST, 3)


@kernel
def _begin(
    w: np.ndarray,
    inputs: Inputs,
    first: int,
    lanes: int,
    carried: np.ndarray,
    field: int,
) -> None:
    """Write the rows of the lanes from contact `first` on, with `carried` in a field and gradients of zero."""
    for c in range(lanes):
        row = inputs.rows[row_of(inputs.rows, first + c)]
        for m in range(row.shape[0]):
            w[_ROW + m * ABREAST + c] = row[m]
            w[_ROW_BAR + m * ABREAST + c] = 0.0
        scatter(w, field + c, ABREAST, three(carried[first + c]))


@kernel
def _see(w: np.ndarray, inputs: Inputs, first: int, lanes: int, t: int) -> None:
    """Write scaled twists, spins, sliding and loads of step t."""
    for c in range(lanes):
        twists = inputs.twist[row_of(inputs.twist, first + c)]
        loads = inputs.load[row_of(inputs.load, first + c)]
        twist = three(twists[t])
        surface = inputs.shape.surface
        x, y, s = scaled = scaled_twist(
            PublishedPatch(*gathered(w, _ROW + LAW * ABREAST + c, ABREAST, 4)), twist
        )
        u = sliding(
            surface[0], inputs.shape.data, surface[1], surface[2], x, y, s, norm(scaled)
        )
        scatter(w, _TWIST + c, ABREAST, (scaled, twist[2], u, loads[t]))


@kernel
def _see_slopes(w: np.ndarray, inputs: Inputs, lanes: int, work: np.ndarray) -> None:
    """Write the slopes of the sliding; `work` [9] is scratch."""
    surface = inputs.shape.surface
    for c in range(lanes):
        x, y, s = twist = _vector(w, _TWIST, c)
        sliding_jacobian(
            surface[0],
            inputs.shape.data,
            surface[1],
            surface[2],
            x,
            y,
            s,
            norm(twist),
            work,
        )
        for m in range(9):
            w[_SLOPES + m * ABREAST + c] = work[m]


@kernel
def _step(
    w: np.ndarray, c: int, dt: float
) -> tuple[PublishedContactData, PublishedStep]:
    row = gathered(w, _ROW + c, ABREAST, _NUMBERS)
    twist = _vector(w, _TWIST, c)
    contact = PublishedContactData(
        LawNumbers(*row[:LAW]), PublishedPatch(*row[LAW:]), 0, 0
    )
    drive = HeldTwist(twist, w[_OMEGA + c], norm(twist), _vector(w, _SLIDING, c))
    return contact, taped_step(contact, drive, _vector(w, _STATE, c), dt)


@kernel
def _unless(none: bool, a: Vector) -> Vector:
    return (
        xp.where(none, 0.0, a[0]),
        xp.where(none, 0.0, a[1]),
        xp.where(none, 0.0, a[2]),
    )


@kernel
def _advance_one(w: np.ndarray, c: int, dt: float) -> None:
    load = w[_LOAD + c]
    (_, step) = _step(w, c, dt)
    scatter(w, _STATE + c, ABREAST, _unless(load == 0.0, step.new))
    scatter(w, _WRENCH + c, ABREAST, _unless(load == 0.0, times(load, step.wrench)))


@kernel
def _advance(w: np.ndarray, lanes: int, dt: float) -> None:
    # The body apart: kernel later, it leaves the compiler a loop that it can count.
    for c in range(lanes):
        _advance_one(w, c, dt)


@kernel
def _retreat_one(w: np.ndarray, c: int, dt: float) -> None:
    load = w[_LOAD + c]
    pull = _vector(w, _WRENCH, c)
    (contact, step) = _step(w, c, dt)
    new = _unless(load == 0.0, _vector(w, _CARRY, c))
    slopes = gathered(w, _SLOPES + c, ABREAST, 9)
    bar = pull_back(contact, step, slopes, new, times(load, pull))
    scatter(w, _CARRY + c, ABREAST, (bar.state, bar.twist, dot(pull, step.wrench)))
    accumulate(w, _ROW_BAR + c, ABREAST, (bar.law, bar.shape))


@kernel
def _retreat(w: np.ndarray, lanes: int, dt: float) -> None:
    for c in range(lanes):
        _retreat_one(w, c, dt)


@kernel
def _rollout(
    inputs: Inputs,
    span: tuple[int, ...],
    z: np.ndarray,
    wrench: np.ndarray,
    states: np.ndarray,
    w: np.ndarray,
) -> None:
    kept = states.shape[1] > 0
    for first in range(span[0], span[1], ABREAST):
        lanes = min(ABREAST, span[1] - first)
        _begin(w, inputs, first, lanes, z, _STATE)
        for t in range(inputs.dt.shape[0]):
            for c in range(lanes if kept else 0):
                put(states[first + c, t], _vector(w, _STATE, c))
            _see(w, inputs, first, lanes, t)
            _advance(w, lanes, inputs.dt[t])
            for c in range(lanes):
                add(wrench[first + c, t], _vector(w, _WRENCH, c))
        for c in range(lanes):
            put(z[first + c], _vector(w, _STATE, c))


@jit
def rollout(
    inputs: Inputs,
    span: tuple[int, ...],
    z: np.ndarray,
    wrench: np.ndarray,
    states: np.ndarray,
) -> None:
    """Step the contacts `span[0]` to `span[1]`: `z` [B, 3] in place, wrenches added to `wrench` [B, T, 3].

    The state before each step goes into `states` [B, T, 3], unless that is empty.
    """
    w = np.empty(_END)
    _rollout(inputs, span, z, wrench, states, w)


@kernel
def _gradient(
    inputs: Inputs, states: np.ndarray, wrench_bar: np.ndarray, span: tuple[int, ...], bars: Bars, w: np.ndarray,
    work: np.ndarray,
) -> None:  # fmt: skip
    for first in range(span[0], span[1], ABREAST):
        lanes = min(ABREAST, span[1] - first)
        _begin(w, inputs, first, lanes, bars.state, _CARRY)
        for t in range(inputs.dt.shape[0] - 1, -1, -1):
            for c in range(lanes):
                before = states[row_of(states, first + c)]
                pulls = wrench_bar[row_of(wrench_bar, first + c)]
                scatter(w, _STATE + c, ABREAST, three(before[t]))
                scatter(w, _WRENCH + c, ABREAST, three(pulls[t]))
            _see(w, inputs, first, lanes, t)
            _see_slopes(w, inputs, lanes, work)
            _retreat(w, lanes, inputs.dt[t])
            for c in range(lanes):
                add(bars.twist[first + c, t], _vector(w, _TWIST_BAR, c))
                bars.load[first + c, t] += w[_LOAD_BAR + c]
        for c in range(lanes):
            put(bars.state[first + c], _vector(w, _CARRY, c))
            for m in range(_NUMBERS):
                bars.rows[first + c, m] += w[_ROW_BAR + m * ABREAST + c]


@jit
def gradient(
    inputs: Inputs,
    states: np.ndarray,
    wrench_bar: np.ndarray,
    span: tuple[int, ...],
    bars: Bars,
) -> None:
    """Add the adjoint of `rollout` with its `states`, from cotangents of the wrenches [B or 1, T, 3], to `bars`."""
    w = np.empty(_END)
    work = np.empty(SCRATCH)
    _gradient(inputs, states, wrench_bar, span, bars, w, work)


# ---------------------------------------------------------------------- forwards, contact by contact


@kernel
def _contact(inputs: Inputs, row: np.ndarray) -> PublishedContactData:
    """Return a contact from its row of numbers."""
    surface = inputs.shape.surface
    return PublishedContactData(
        law_of(row),
        shape_of(row[LAW:]),
        (surface[0], surface[1], surface[2]),
        inputs.shape.data,
    )


@kernel
def _jacobian(
    contact: PublishedContactData,
    z: Vector,
    twist: Vector,
    load: float,
    dt: float,
    work: np.ndarray,
    out: np.ndarray,
) -> PublishedStep:
    """Write derivatives of the new state and of the wrench (6 rows) to `out` [6, 7 + N]; return the step.

    Columns: state (3), twist (3), load, and the N numbers of the contact.
    """
    drive, slopes = hold_slopes(contact, twist, work)
    step = taped_step(contact, drive, z, dt)
    for i in range(6):
        unit = (
            (1.0 if i % 3 == 0 else 0.0),
            (1.0 if i % 3 == 1 else 0.0),
            (1.0 if i % 3 == 2 else 0.0),
        )
        loaded = 0.0 if i > 2 or load == 0.0 else 1.0
        bar = pull_back(
            contact,
            step,
            slopes,
            times(loaded, unit),
            times(load if i > 2 else 0.0, unit),
        )
        clear(out[i], out.shape[1])
        accumulate(
            out[i],
            0,
            1,
            (
                bar.state,
                bar.twist,
                dot(unit, step.wrench) if i > 2 else 0.0,
                bar.law,
                bar.shape,
            ),
        )
    return step


@kernel
def _by_number(
    rows: np.ndarray, i: int, d: int, columns: np.ndarray, b: int, t: int
) -> float:
    """Return row i of a step's derivatives by number `columns[d]` of the contact."""
    return rows[i, 7 + columns[d]]


@kernel
def _along(rows: np.ndarray, i: int, d: int, changes: Bars, b: int, t: int) -> float:
    """Return the change of row i along `changes` of the inputs of contact b without its state."""
    turns = changes.twist[row_of(changes.twist, b)]
    pushes = changes.load[row_of(changes.load, b)]
    by = changes.rows[row_of(changes.rows, b)]
    change = dot(three(rows[i, 3:]), three(turns[t])) + rows[i, 6] * pushes[t]
    for m in range(by.shape[0]):
        change += rows[i, 7 + m] * by[m]
    return change


@kernel
def _forward(
    seed: Any, inputs: Inputs, span: tuple[int, ...], z: np.ndarray, directions: Any, d_state: np.ndarray,
    results: tuple[np.ndarray, np.ndarray], work: tuple[np.ndarray, np.ndarray],
) -> None:  # fmt: skip
    """Run rollouts with their changes along D directions, forward in time: `dz' = d new/dz dz + seed`.

    `seed(rows, i, d, directions, b, t)` is the part of the change of row i that does not come from the state; `d_state`
    [B, 3, D] are the changes of the state, and `z`, in place. `results`, to which is added: wrenches [B, T, 3] and
    their changes [B, T, 3, D]; `work`: arrays [SCRATCH] and [6, 7 + N].
    """
    (wrenches, slopes) = results
    (scratch, rows) = work
    for b in range(span[0], span[1]):
        twists = inputs.twist[row_of(inputs.twist, b)]
        loads = inputs.load[row_of(inputs.load, b)]
        contact = _contact(inputs, inputs.rows[row_of(inputs.rows, b)])
        state = three(z[b])
        change = d_state[b]
        for t in range(inputs.dt.shape[0]):
            load = loads[t]
            twist = three(twists[t])
            dt = inputs.dt[t]
            step = _jacobian(contact, state, twist, load, dt, scratch, rows)
            state = step.new if load != 0.0 else (0.0, 0.0, 0.0)
            add(
                wrenches[b, t],
                times(load, step.wrench) if load != 0.0 else (0.0, 0.0, 0.0),
            )
            for d in range(change.shape[1]):
                before = change[0, d], change[1, d], change[2, d]
                for i in range(6):
                    now = dot(three(rows[i]), before) + seed(
                        rows, i, d, directions, b, t
                    )
                    if i < 3:
                        change[i, d] = now
                    else:
                        slopes[b, t, i - 3, d] += now
        put(z[b], state)


@jit
def sensitivities(
    inputs: Inputs, span: tuple[int, ...], z: np.ndarray, out: Derivatives
) -> None:
    """Run rollouts with the derivatives of the wrenches by numbers of the contact; see `_forward`."""
    work = np.empty(SCRATCH), np.empty((6, 7 + inputs.rows.shape[1]))
    changes = np.zeros((z.shape[0], 3, out.columns.shape[0]))
    results = (out.wrenches, out.slopes)
    _forward(_by_number, inputs, span, z, out.columns, changes, results, work)


@jit
def tangent(
    inputs: Inputs,
    span: tuple[int, ...],
    z: np.ndarray,
    changes: Bars,
    wrenches: np.ndarray,
    slopes: np.ndarray,
) -> None:
    """Run rollouts with their change along changes of the inputs; see `_forward`.

    `changes` of the inputs: as `Bars`, one row where all contacts share one; the change of the state is in place.
    """
    work = np.empty(SCRATCH), np.empty((6, 7 + inputs.rows.shape[1]))
    count = z.shape[0]
    steps = inputs.dt.shape[0]
    d_state = changes.state.reshape(count, 3, 1)
    results = (wrenches, slopes.reshape(count, steps, 3, 1))
    _forward(_along, inputs, span, z, changes, d_state, results, work)
