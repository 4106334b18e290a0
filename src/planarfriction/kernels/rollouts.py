"""Steps and roll-outs of a reduced model, their discrete adjoint and their derivatives, one contact after another.

Each is written once for all models of three states; the files of the models bind it to the functions of a model, which
are compiled into it: with a contact `c`, a twist V, a state z and a step dt,

- `shape_of(row)`: the shape, from the numbers behind those of the law;
- `hold(c, V)`: what a step holds that does not depend on z;
- `hold_slopes(c, V, work)`: that, and its slopes;
- `linearise(c, held, z, dt)`: the step, with `new` state and `wrench` per unit load;
- `pull_back(c, step, slopes, new, wrench)`: `Cotangents` of z, V and the contact's numbers from those of the new state
  and of the wrench.

A step without load forgets its state: it passes on no gradient but that of the load, the wrench per unit load that the
smallest load would have.
"""

from __future__ import annotations

import functools
import threading
from typing import NamedTuple

import numpy as np
from numba import types
from numba.core.errors import NumbaError

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import jit, kernel
from planarfriction.kernels.law import LAW, law_of
from planarfriction.kernels.pointers import address, at, call, doubles
from planarfriction.kernels.records import reader, size_of
from planarfriction.kernels.vectors import accumulate, dot, put, three, times

SCRATCH = 9
"""Numbers that `hold_slopes` may write to."""


class Contact(NamedTuple):
    """A contact as the functions of a model see it."""

    law: tuple
    shape: tuple
    surface: tuple
    """What the model knows of its limit surface or maps, three integers."""
    data: np.ndarray
    """Their numbers, flat."""


class Inputs(NamedTuple):
    """Roll-outs of B contacts through T steps."""

    rows: np.ndarray
    """Numbers of law and shape, [B or 1, N]."""
    surface: np.ndarray
    """As in `Contact`, int [3]."""
    data: np.ndarray
    twist: np.ndarray
    """[B or 1, T, 3]"""
    load: np.ndarray
    """[B or 1, T]"""
    dt: np.ndarray
    """[T]"""


class Bars(NamedTuple):
    """Cotangents of the inputs of B roll-outs, or changes of them."""

    state: np.ndarray
    """Comes in as that of the state at the end, [B, 3]."""
    twist: np.ndarray
    """[B, T, 3]"""
    load: np.ndarray
    """[B, T]"""
    rows: np.ndarray
    """[B, N], comes in as zeros."""


class Cotangents(NamedTuple):
    """Cotangents of all inputs of a step."""

    state: tuple
    twist: tuple
    law: tuple
    shape: tuple


@kernel
def _contact(shape_of, row, surface, data):
    return Contact(law_of(row), shape_of(row[LAW:]), (surface[0], surface[1], surface[2]), data)


@kernel
def row_of(values, b):
    """Which row of `values` belongs to contact b: its own, or the one that all share."""
    return b if values.shape[0] > 1 else 0


@kernel
def _weighed(wrench, load):
    """The wrench of a load; zero without, whatever it is per unit load."""
    return times(load, wrench) if load != 0.0 else (0.0, 0.0, 0.0)


# ---------------------------------------------------------------------- steps


# A step is called by its address: compiled into the code of one contact and into that of a batch, it would round
# differently in each.


@kernel
def step(shape_of, numbers_at, hold, linearise, row, data, inputs, out):
    """A step of one contact: `inputs` are its z, twist, load and dt [8], `out` the new state and the wrench [6].

    All are addresses; `numbers_at(data)` are the numbers of the surface. Behind law and shape the row holds the three
    of `Contact.surface`.
    """
    shape = shape_of(at(row, LAW))
    last, given, out = doubles(at(row, LAW + len(shape))), doubles(inputs), doubles(out)
    contact = Contact(law_of(row), shape, (int(last[0]), int(last[1]), int(last[2])), numbers_at(data))
    z, twist, load = (given[0], given[1], given[2]), (given[3], given[4], given[5]), given[6]
    result = linearise(contact, hold(contact, twist), z, given[7])
    new, wrench = result.new if load != 0.0 else (0.0, 0.0, 0.0), _weighed(result.wrench, load)
    out[0], out[1], out[2] = new
    out[3], out[4], out[5] = wrench


class Place(NamedTuple):
    """Where compiled code finds a part of a contact: addresses of the model's `step`, and of its row and data."""

    step: int
    row: int
    data: int
    share: float
    """Of the load."""


_place = reader(Place)
_WORDS = size_of(Place)


@jit
def step_one(places, z, vx, vy, omega, load, dt, result):
    """A step of one contact whose P parts are at the `places`, a row of words for each, flat; false for invalid inputs.

    `z` [3 P]. New state and wrench go into the first of `result` [3 P + 11]: each part writes its wrench where the next
    one's state comes. Called from Python: every argument costs a quarter of a microsecond on the way in.
    """
    valid = xp.in_range(vx) and xp.in_range(vy) and xp.in_range(omega) and xp.in_range(load) and xp.in_range(dt)
    valid = valid and load > 0.0 and dt >= 0.0
    count = places.shape[0] // _WORDS
    z, out, inputs = doubles(address(z, 0)), address(result, 0), address(result, 3 * count + 3)
    given = doubles(inputs)
    given[3], given[4], given[5], given[6], given[7] = vx, vy, omega, load, dt
    fx, fy, tau = 0.0, 0.0, 0.0
    for k in range(count):
        part = _place(address(places, k * _WORDS))
        x, y, s = z[3 * k], z[3 * k + 1], z[3 * k + 2]
        if not (valid and xp.in_range(x) and xp.in_range(y) and xp.in_range(s)):
            return False
        given[0], given[1], given[2] = x, y, s
        call(part.step, (part.row, part.data, inputs, out))
        w = doubles(at(out, 3))
        fx, fy, tau = fx + part.share * w[0], fy + part.share * w[1], tau + part.share * w[2]
        out = at(out, 3)
    last = doubles(out)
    last[0], last[1], last[2] = fx, fy, tau
    return True


UNFIT = (TypeError, ValueError, NumbaError)
"""What `step_one` answers other types with."""

_COMPILING = threading.Lock()


@functools.cache
def compile_step_one() -> None:
    """Compile `step_one` for plain numbers and arrays, and for nothing else.

    Of other types it then says so at once, for free, where it would be compiled anew in the middle of a step.
    """
    number, vector = types.float64, types.float64[::1]
    with _COMPILING:
        if not step_one.signatures:
            step_one.compile((vector, vector, *(number,) * 5, vector))
            step_one.disable_compile()


# ---------------------------------------------------------------------- derivatives


@kernel
def _jacobian(hold_slopes, linearise, pull_back, contact, z, twist, load, dt, work, out):
    """Derivatives of the new state and of the wrench (6 rows) into `out` [6, 7 + N]; returns the step.

    Columns: state (3), twist (3), load, and the N numbers of the contact.
    """
    held, slopes = hold_slopes(contact, twist, work)
    step = linearise(contact, held, z, dt)
    loaded = 0.0 if load == 0.0 else 1.0
    for i in range(6):
        unit = (1.0 if i % 3 == 0 else 0.0), (1.0 if i % 3 == 1 else 0.0), (1.0 if i % 3 == 2 else 0.0)
        bar = pull_back(
            contact, step, slopes, times(loaded if i < 3 else 0.0, unit), times(0.0 if i < 3 else load, unit)
        )
        row = out[i]
        for m in range(row.shape[0]):
            row[m] = 0.0
        accumulate(row, 0, 1, (bar.state, bar.twist, 0.0 if i < 3 else dot(unit, step.wrench), bar.law, bar.shape))
    return step


@kernel
def sensitivities(shape_of, hold_slopes, linearise, pull_back, inputs, span, z, columns, results, work):
    """Roll-outs with the derivatives of the wrenches by the numbers `columns` [P], forward in time.

    `dz' = d new/dz dz + d new/d number`. `results`: wrenches [B, T, 3] and their derivatives [B, T, 3, P]; `work`:
    arrays [SCRATCH], [6, 7 + N] and [6, P].
    """
    (wrenches, slopes), (scratch, here, change) = results, work
    for b in range(span[0], span[1]):
        twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
        contact = _contact(shape_of, inputs.rows[row_of(inputs.rows, b)], inputs.surface, inputs.data)
        own = three(z[b])
        for i in range(6):
            for p in range(change.shape[1]):
                change[i, p] = 0.0
        for t in range(inputs.dt.shape[0]):
            load = loads[t]
            step = _jacobian(
                hold_slopes, linearise, pull_back, contact, own, three(twists[t]), load, inputs.dt[t], scratch, here
            )
            own = step.new if load != 0.0 else (0.0, 0.0, 0.0)
            put(wrenches[b, t], _weighed(step.wrench, load))
            for p in range(change.shape[1]):
                before, column = (change[0, p], change[1, p], change[2, p]), 7 + columns[p]
                for i in range(6):
                    change[i, p] = here[i, column] + dot(three(here[i]), before)
                for i in range(3):
                    slopes[b, t, i, p] = change[3 + i, p]
        put(z[b], own)


@kernel
def tangent(shape_of, hold_slopes, linearise, pull_back, inputs, span, z, changes, results, work):
    """Roll-outs with their change along given ones of the inputs, forward in time.

    `changes` of the inputs: as `Bars`, one row where all contacts share one; that of the state, and `z`, in place.
    `results`: wrenches [B, T, 3] and their changes; `work`: arrays [SCRATCH], [6, 7 + N].
    """
    (wrenches, slopes), (scratch, here) = results, work
    for b in range(span[0], span[1]):
        twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
        turns, pushes = changes.twist[row_of(changes.twist, b)], changes.load[row_of(changes.load, b)]
        row = changes.rows[row_of(changes.rows, b)]
        contact = _contact(shape_of, inputs.rows[row_of(inputs.rows, b)], inputs.surface, inputs.data)
        own, moved = three(z[b]), three(changes.state[b])
        for t in range(inputs.dt.shape[0]):
            load, turn = loads[t], three(turns[t])
            step = _jacobian(
                hold_slopes, linearise, pull_back, contact, own, three(twists[t]), load, inputs.dt[t], scratch, here
            )
            own = step.new if load != 0.0 else (0.0, 0.0, 0.0)
            put(wrenches[b, t], _weighed(step.wrench, load))
            new = (0.0, 0.0, 0.0)
            for i in range(6):
                change = dot(three(here[i]), moved) + dot(three(here[i, 3:]), turn) + here[i, 6] * pushes[t]
                for m in range(row.shape[0]):
                    change += here[i, 7 + m] * row[m]
                if i < 3:
                    new = new[1], new[2], change
                else:
                    slopes[b, t, i - 3] = change
            moved = new
        put(z[b], own)
        put(changes.state[b], moved)
