"""Inputs of roll-outs, and derivatives of those of a model of three states forward in time, contact by contact.

`bind` makes each loop an entry point of a model, whose functions (`moment_steps.StepModel`) are compiled into it.

A step without load forgets its state: it passes on no gradient but that of the load, the wrench per unit load that the
smallest load would have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.compiler import kernel
from planarfriction.kernels.law import LAW, law_of
from planarfriction.kernels.moment_steps import Contact
from planarfriction.kernels.vectors import accumulate, add, dot, put, three, times

SCRATCH = 9
"""Numbers that `hold_slopes` may write to."""


class Inputs(NamedTuple):
    """Roll-outs of B contacts through T steps, of cells at L different loads where their weights follow the load."""

    rows: np.ndarray
    """Numbers of law and shape, [B or 1, N]."""
    data: np.ndarray
    """As in `Contact`; of cells the numbers of their levers."""
    twist: np.ndarray
    """[B or 1, T, 3]"""
    load: np.ndarray
    """[B or 1, T]"""
    dt: np.ndarray
    """[T]"""
    which: np.ndarray
    """Index of the load of each step among the L loads, int [B or 1, T]; one for all where the shape is fixed."""
    surface: np.ndarray
    """As in `Contact`, int [3]; of cells without meaning."""
    shapes: np.ndarray
    """Weights of cells, [L, M]."""
    by_load: np.ndarray
    """Slopes of these by the load, [L, M] [1/N]."""


class Bars(NamedTuple):
    """Cotangents of the inputs of B roll-outs, or changes of them."""

    state: np.ndarray
    """Comes in as that of the state at the end, [B, S]."""
    twist: np.ndarray
    """[B, T, 3]"""
    load: np.ndarray
    """[B, T]"""
    rows: np.ndarray
    """[B, N], comes in as zeros; changes are [B or 1, N]."""


@kernel
def _contact(shape_of, inputs, row):
    """Return a contact from its row of numbers."""
    surface = inputs.surface
    return Contact(law_of(row), shape_of(row[LAW:]), (surface[0], surface[1], surface[2]), inputs.data)


@kernel
def row_of(values, b):
    """Return the row of `values` for contact b: its own, or the one that all share."""
    return b if values.shape[0] > 1 else 0


@kernel
def _jacobian(hold_slopes, taped_step, pull_back, contact, z, twist, load, dt, work, out):
    """Write derivatives of the new state and of the wrench (6 rows) to `out` [6, 7 + N]; return the step.

    Columns: state (3), twist (3), load, and the N numbers of the contact.
    """
    held, slopes = hold_slopes(contact, twist, work)
    step = taped_step(contact, held, z, dt)
    for i in range(6):
        unit = (1.0 if i % 3 == 0 else 0.0), (1.0 if i % 3 == 1 else 0.0), (1.0 if i % 3 == 2 else 0.0)
        loaded = 0.0 if i > 2 or load == 0.0 else 1.0
        bar = pull_back(contact, step, slopes, times(loaded, unit), times(load if i > 2 else 0.0, unit))
        row = out[i]
        for m in range(row.shape[0]):
            row[m] = 0.0
        accumulate(row, 0, 1, (bar.state, bar.twist, dot(unit, step.wrench) if i > 2 else 0.0, bar.law, bar.shape))
    return step


@kernel
def _by_number(here, i, d, columns, b, t):
    """Return row i of a step's derivatives by number `columns[d]` of the contact."""
    return here[i, 7 + columns[d]]


@kernel
def _along(here, i, d, changes, b, t):
    """Return the change of row i along `changes` of the inputs of contact b, but that of the state."""
    turns, pushes = changes.twist[row_of(changes.twist, b)], changes.load[row_of(changes.load, b)]
    by = changes.rows[row_of(changes.rows, b)]
    change = dot(three(here[i, 3:]), three(turns[t])) + here[i, 6] * pushes[t]
    for m in range(by.shape[0]):
        change += here[i, 7 + m] * by[m]
    return change


@kernel
def _forward(shape_of, hold_slopes, taped_step, pull_back, seed, inputs, span, z, given, moved, results, work):
    """Roll-outs with their changes along D directions, forward in time: `dz' = d new/dz dz + seed`.

    `seed(here, i, d, given, b, t)` is the part of the change of row i that does not come from the state; `moved`
    [B, 3, D] are the changes of the state, and `z`, in place. `results`, to which is added: wrenches [B, T, 3] and
    their changes [B, T, 3, D]; `work`: arrays [SCRATCH] and [6, 7 + N].
    """
    (wrenches, slopes), (scratch, here) = results, work
    for b in range(span[0], span[1]):
        twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
        contact, state, change = _contact(shape_of, inputs, inputs.rows[row_of(inputs.rows, b)]), three(z[b]), moved[b]
        for t in range(inputs.dt.shape[0]):
            load, twist, dt = loads[t], three(twists[t]), inputs.dt[t]
            step = _jacobian(hold_slopes, taped_step, pull_back, contact, state, twist, load, dt, scratch, here)
            state = step.new if load != 0.0 else (0.0, 0.0, 0.0)
            add(wrenches[b, t], times(load, step.wrench) if load != 0.0 else (0.0, 0.0, 0.0))
            for d in range(change.shape[1]):
                before = change[0, d], change[1, d], change[2, d]
                for i in range(6):
                    now = dot(three(here[i]), before) + seed(here, i, d, given, b, t)
                    if i < 3:
                        change[i, d] = now
                    else:
                        slopes[b, t, i - 3, d] += now
        put(z[b], state)


def sensitivities(shape_of, hold_slopes, taped_step, pull_back, inputs, span, z, columns, wrenches, slopes):
    """Roll-outs with the derivatives of the wrenches by the numbers `columns` [D]; see `_forward`."""
    work = np.empty(SCRATCH), np.empty((6, 7 + inputs.rows.shape[1]))
    moved, results = np.zeros((z.shape[0], 3, columns.shape[0])), (wrenches, slopes)
    _forward(shape_of, hold_slopes, taped_step, pull_back, _by_number, inputs, span, z, columns, moved, results, work)


def tangent(shape_of, hold_slopes, taped_step, pull_back, inputs, span, z, changes, wrenches, slopes):
    """Roll-outs with their change along given ones of the inputs; see `_forward`.

    `changes` of the inputs: as `Bars`, one row where all contacts share one; that of the state in place.
    """
    work = np.empty(SCRATCH), np.empty((6, 7 + inputs.rows.shape[1]))
    count, steps = z.shape[0], inputs.dt.shape[0]
    moved, results = changes.state.reshape(count, 3, 1), (wrenches, slopes.reshape(count, steps, 3, 1))
    _forward(shape_of, hold_slopes, taped_step, pull_back, _along, inputs, span, z, changes, moved, results, work)
