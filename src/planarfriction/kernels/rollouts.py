"""Roll-outs of a reduced model, their discrete adjoint and their derivatives, one contact after another.

Each is written once for all models of three states; `bind` makes it an entry point of a model, whose functions
(`moment_steps.StepModel`) are compiled into it.

Where the shape follows the load, each step has that of its load, which moves the wrench through the numbers of the
shape and the share of the part, too.

A step without load forgets its state: it passes on no gradient but that of the load, the wrench per unit load that the
smallest load would have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.compiler import kernel
from planarfriction.kernels.law import LAW, law_of
from planarfriction.kernels.moment_steps import Contact
from planarfriction.kernels.vectors import accumulate, add, dot, plus, put, three, times

SCRATCH = 9
"""Numbers that `hold_slopes` may write to."""


class Inputs(NamedTuple):
    """Roll-outs of B contacts of P parts through T steps, at L different loads where the shape follows the load."""

    rows: np.ndarray
    """Numbers of law and shape, [P, B or 1, N]."""
    data: np.ndarray
    """As in `Contact`, for all parts and loads."""
    twist: np.ndarray
    """[B or 1, T, 3]"""
    load: np.ndarray
    """[B or 1, T]"""
    dt: np.ndarray
    """[T]"""
    which: np.ndarray
    """Index of the load of each step among the L loads, int [B or 1, T]; one for all where the shape is fixed."""
    shares: np.ndarray
    """Shares of the load, [P, L]."""
    surface: np.ndarray
    """As in `Contact`, int [P, L, 3]."""
    shapes: np.ndarray
    """Added to the numbers of the shape, [P, L, S]."""
    by_load: np.ndarray
    """Slopes of these numbers and of the share by the load, [P, L, S + 1] [1/N]."""


class Bars(NamedTuple):
    """Cotangents of the inputs of B roll-outs, or changes of them."""

    state: np.ndarray
    """Comes in as that of the state at the end, [P, B, 3]."""
    twist: np.ndarray
    """[B, T, 3]"""
    load: np.ndarray
    """[B, T]"""
    rows: np.ndarray
    """[P, B, N], comes in as zeros; changes are those of all parts, [B or 1, N]."""


@kernel
def _part(shape_of, inputs, row, p, at):
    """Return the part p as it is at one of the loads."""
    surface, shape = inputs.surface[p, at], plus(shape_of(row[LAW:]), 1.0, shape_of(inputs.shapes[p, at]))
    return Contact(law_of(row), shape, (surface[0], surface[1], surface[2]), inputs.data)


@kernel
def row_of(values, b):
    """Return the row of `values` for contact b: its own, or the one that all share."""
    return b if values.shape[0] > 1 else 0


@kernel
def _weighed(wrench, load):
    """Return the wrench of a load; zero without, whatever it is per unit load."""
    return times(load, wrench) if load != 0.0 else (0.0, 0.0, 0.0)


# ---------------------------------------------------------------------- roll-outs


@kernel
def _rollout(shape_of, hold, taped_step, inputs, span, z, wrench, states):
    """Roll out contacts as `lanes.rollout` does."""
    steps, kept = inputs.dt.shape[0], states.shape[2] > 0
    for b in range(span[0], span[1]):
        twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
        which = inputs.which[row_of(inputs.which, b)]
        for p in range(inputs.shares.shape[0]):
            rows, own = inputs.rows[p], three(z[p, b])
            row = rows[row_of(rows, b)]
            for t in range(steps):
                if kept:
                    put(states[p, b, t], own)
                load, contact = loads[t], _part(shape_of, inputs, row, p, which[t])
                step = taped_step(contact, hold(contact, three(twists[t])), own, inputs.dt[t])
                own = step.new if load != 0.0 else (0.0, 0.0, 0.0)
                add(wrench[b, t], _weighed(step.wrench, inputs.shares[p, which[t]] * load))
            put(z[p, b], own)


def rollout(shape_of, hold, taped_step, inputs, span, z, wrench, states):
    """Run `_rollout`."""
    _rollout(shape_of, hold, taped_step, inputs, span, z, wrench, states)


@kernel
def _gradient(shape_of, hold_slopes, taped_step, pull_back, inputs, states, wrench_bar, span, bars, work):
    """Compute what `lanes.gradient` does."""
    for b in range(span[0], span[1]):
        twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
        which, pulls = inputs.which[row_of(inputs.which, b)], wrench_bar[row_of(wrench_bar, b)]
        for p in range(inputs.shares.shape[0]):
            rows, before, own = inputs.rows[p], states[p], three(bars.state[p, b])
            row, before = rows[row_of(rows, b)], before[row_of(before, b)]
            for t in range(inputs.dt.shape[0] - 1, -1, -1):
                load, at, pull, slopes = loads[t], which[t], three(pulls[t]), inputs.by_load[p, which[t]]
                share, contact = inputs.shares[p, at], _part(shape_of, inputs, row, p, at)
                held, known = hold_slopes(contact, three(twists[t]), work)
                step = taped_step(contact, held, three(before[t]), inputs.dt[t])
                new = times(0.0 if load == 0.0 else 1.0, own)
                bar = pull_back(contact, step, known, new, times(share * load, pull))
                own = bar.state
                add(bars.twist[b, t], bar.twist)
                heavier = share + load * slopes[len(bar.shape)]
                bars.load[b, t] += heavier * dot(pull, step.wrench) + dot(bar.shape, shape_of(slopes))
                accumulate(bars.rows[p, b], 0, 1, (bar.law, bar.shape))
            put(bars.state[p, b], own)


def gradient(shape_of, hold_slopes, taped_step, pull_back, inputs, states, wrench_bar, span, bars):
    """Allocate the scratch of `_gradient` and run it."""
    work = np.empty(SCRATCH)
    _gradient(shape_of, hold_slopes, taped_step, pull_back, inputs, states, wrench_bar, span, bars, work)


# ---------------------------------------------------------------------- derivatives


@kernel
def _jacobian(hold_slopes, taped_step, pull_back, contact, z, twist, loads, dt, work, out):
    """Write derivatives of the new state and of the wrench (6 rows) to `out` [6, 7 + N]; return the step.

    Columns: state (3), twist (3), load with the shape held, and the N numbers of the contact. `loads`: 0 where there is
    none, else 1; that of the contact; its slope.
    """
    held, slopes = hold_slopes(contact, twist, work)
    step = taped_step(contact, held, z, dt)
    loaded, load, heavier = loads
    for i in range(6):
        unit = (1.0 if i % 3 == 0 else 0.0), (1.0 if i % 3 == 1 else 0.0), (1.0 if i % 3 == 2 else 0.0)
        bar = pull_back(
            contact, step, slopes, times(loaded if i < 3 else 0.0, unit), times(0.0 if i < 3 else load, unit)
        )
        row = out[i]
        for m in range(row.shape[0]):
            row[m] = 0.0
        by_load = 0.0 if i < 3 else heavier * dot(unit, step.wrench)
        accumulate(row, 0, 1, (bar.state, bar.twist, by_load, bar.law, bar.shape))
    return step


@kernel
def _loads(inputs, load, p, at):
    """Return `loads` of `_jacobian` for a part."""
    share, by_load = inputs.shares[p, at], inputs.by_load[p, at]
    return (0.0 if load == 0.0 else 1.0), share * load, share + load * by_load[by_load.shape[0] - 1]


@kernel
def _by_number(here, i, d, inputs, columns, b, t, follows):
    """Return row i of a step's derivatives by number `columns[d]` of the contact."""
    return here[i, 7 + columns[d]]


@kernel
def _along(here, i, d, inputs, changes, b, t, follows):
    """Return the change of row i along `changes` of the inputs of contact b, but that of the state."""
    turns, pushes = changes.twist[row_of(changes.twist, b)], changes.load[row_of(changes.load, b)]
    by = changes.rows[row_of(changes.rows, b)]
    change = dot(three(here[i, 3:]), three(turns[t])) + here[i, 6] * pushes[t]
    for m in range(by.shape[0]):
        change += here[i, 7 + m] * by[m]
    for m in range(follows.shape[0] - 1):
        change += here[i, 7 + LAW + m] * follows[m] * pushes[t]
    return change


@kernel
def _forward(shape_of, hold_slopes, taped_step, pull_back, seed, inputs, span, z, given, moved, results, work):
    """Roll-outs with their changes along D directions, forward in time: `dz' = d new/dz dz + seed`.

    `seed(here, i, d, inputs, given, b, t, follows)` is the part of the change of row i that does not come from the
    state; `moved` [P, B, 3, D] are the changes of the state, and `z`, in place. `results`, to which is added: wrenches
    [B, T, 3] and their changes [B, T, 3, D]; `work`: arrays [SCRATCH] and [6, 7 + N].
    """
    (wrenches, slopes), (scratch, here) = results, work
    for b in range(span[0], span[1]):
        twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
        which = inputs.which[row_of(inputs.which, b)]
        for p in range(inputs.shares.shape[0]):
            rows, own, change = inputs.rows[p], three(z[p, b]), moved[p, b]
            row = rows[row_of(rows, b)]
            for t in range(inputs.dt.shape[0]):
                load, at, contact = loads[t], which[t], _part(shape_of, inputs, row, p, which[t])
                weights, twist = _loads(inputs, load, p, at), three(twists[t])
                step = _jacobian(
                    hold_slopes, taped_step, pull_back, contact, own, twist, weights, inputs.dt[t], scratch, here
                )
                own = step.new if load != 0.0 else (0.0, 0.0, 0.0)
                add(wrenches[b, t], _weighed(step.wrench, weights[1]))
                for d in range(change.shape[1]):
                    before = change[0, d], change[1, d], change[2, d]
                    for i in range(6):
                        now = dot(three(here[i]), before) + seed(here, i, d, inputs, given, b, t, inputs.by_load[p, at])
                        if i < 3:
                            change[i, d] = now
                        else:
                            slopes[b, t, i - 3, d] += now
            put(z[p, b], own)


def sensitivities(shape_of, hold_slopes, taped_step, pull_back, inputs, span, z, columns, wrenches, slopes):
    """Roll-outs with the derivatives of the wrenches by the numbers `columns` [D]; see `_forward`."""
    work = np.empty(SCRATCH), np.empty((6, 7 + inputs.rows.shape[2]))
    moved = np.zeros((inputs.shares.shape[0], z.shape[1], 3, columns.shape[0]))
    results = wrenches, slopes
    _forward(shape_of, hold_slopes, taped_step, pull_back, _by_number, inputs, span, z, columns, moved, results, work)


def tangent(shape_of, hold_slopes, taped_step, pull_back, inputs, span, z, changes, wrenches, slopes):
    """Roll-outs with their change along given ones of the inputs; see `_forward`.

    `changes` of the inputs: as `Bars`, one row where all contacts share one; that of the state in place.
    """
    work = np.empty(SCRATCH), np.empty((6, 7 + inputs.rows.shape[2]))
    parts, count, steps = inputs.shares.shape[0], z.shape[1], inputs.dt.shape[0]
    moved, results = changes.state.reshape(parts, count, 3, 1), (wrenches, slopes.reshape(count, steps, 3, 1))
    _forward(shape_of, hold_slopes, taped_step, pull_back, _along, inputs, span, z, changes, moved, results, work)
