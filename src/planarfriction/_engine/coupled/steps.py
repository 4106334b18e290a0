"""Steps and rates of contacts as Python calls them: one contact, a batch, a sequence, and their derivatives.

All contacts step by the same function, one of the `StepFunctions` of a model. It is called by its address: compiled
into the code of one contact and into the code of a batch, a step would round differently in each.

The entry points check their arguments and return False where these are not in order; for other types than they were
compiled for they raise `UNFIT` at no cost. Without load a contact forgets its state.
"""

from __future__ import annotations

import functools
import threading
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.core.errors import NumbaError

from planarfriction._engine.cells.gathering import Bearing, bear
from planarfriction._engine.codegen.vectors import clear, copy, put, three, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel, sequential_jit
from planarfriction._engine.compiler.calls import call, pointer
from planarfriction._engine.compiler.memory import Doubles, Place, at, exists, reader
from planarfriction._engine.protocol import SLOPES

SCRATCH = 7
"""Numbers of the scratch of `step_many`: a twist, its load, and a wrench."""


class Stepped(NamedTuple):
    """A contact at R loads, and the function that steps it."""

    function: int
    """Address of one of the `StepFunctions`."""
    states: int
    """Number S of states."""
    square: int
    """Numbers of d new/dz."""
    loads: int
    """Number R of loads: one for each contact of a batch, or 1."""
    record: int
    """Address of the first of the R records, which lie one behind the other."""
    words: int
    """Number of words of a record."""
    pad: int = 0
    """1 of a pad, whose bristles see the load; 0 of others."""


_read = reader(Stepped)


@kernel
def _record(table: Stepped, b: int) -> Place:
    """Return the address of the record of contact b."""
    return at(table.record, table.words * b if table.loads > 1 else 0)


@kernel
def _in_order(row: np.ndarray, n: int) -> bool:
    valid = True
    for i in range(n):
        valid = valid and xp.in_range(row[i])
    return valid


@kernel
def _positive(load: float, dt: float) -> bool:
    return xp.in_range(load) and xp.in_range(dt) and load >= 0.0 and dt >= 0.0


@kernel
def _step(
    table: Stepped, b: int, z: Doubles, twist: Doubles, dt: float, new: Doubles, wrench: Doubles, unit: Doubles,
) -> None:  # fmt: skip
    """Step contact b, whose load stands behind its `twist`; `unit` [3] is scratch."""
    load = twist[3]
    call(table.function, (_record(table, b), z, twist, dt, new, unit))
    if load > 0.0:
        put(wrench, times(load, three(unit)))
    else:
        put(wrench, (0.0, 0.0, 0.0))
        clear(new, table.states)


@sequential_jit
def step_one(
    stepped: np.ndarray,
    z: np.ndarray,
    vx: float,
    vy: float,
    omega: float,
    load: float,
    dt: float,
    result: np.ndarray,
) -> bool:
    """Step one contact; `stepped` are the words of `Stepped`, `z` [S].

    New state and wrench go into the first of `result` [S + 10], whose last seven are scratch. Called from Python: every
    argument costs a quarter of a microsecond on the way in.
    """
    table = _read(stepped)
    out = pointer(result)
    n = table.states
    valid = (
        z.shape[0] == n
        and xp.in_range(vx)
        and xp.in_range(vy)
        and xp.in_range(omega)
        and _positive(load, dt)
    )
    if not (valid and _in_order(z, n)):
        return False
    wrench = at(out, n)
    twist = at(out, n + 3)
    put(twist, (vx, vy, omega))
    twist[3] = load
    _step(table, 0, pointer(z), twist, dt, out, wrench, at(out, n + 7))
    return xp.in_range(wrench[0])


@jit
def step_many(
    stepped: np.ndarray, z: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray, new: np.ndarray,
    wrench: np.ndarray, scratch: np.ndarray,
) -> bool:  # fmt: skip
    """Step B contacts: `z`, `new` [B, S], `twist`, `wrench` [B, 3], `load`, `dt` [B or 1]; `scratch` [`SCRATCH`]."""
    table = _read(stepped)
    (count, n) = z.shape
    loads = load.shape[0]
    steps = dt.shape[0]
    valid = n == table.states and twist.shape[0] == count and twist.shape[1] == 3
    valid = valid and (loads == 1 or loads == count) and (steps == 1 or steps == count)
    valid = valid and scratch.shape[0] >= SCRATCH
    for b in range(count if valid else 0):
        valid = valid and _positive(
            load[b if loads > 1 else 0], dt[b if steps > 1 else 0]
        )
        valid = valid and _in_order(z[b], n) and _in_order(twist[b], 3)
    if not valid:
        return False
    states = pointer(z)
    twists = pointer(twist)
    ends = pointer(new)
    wrenches = pointer(wrench)
    seen = pointer(scratch)
    for b in range(count):
        copy(at(twists, 3 * b), seen, 3)
        seen[3] = load[b if loads > 1 else 0]
        dt_b = dt[b if steps > 1 else 0]
        into = at(ends, n * b), at(wrenches, 3 * b)
        _step(table, b, at(states, n * b), seen, dt_b, *into, at(seen, 4))
        valid = valid and xp.in_range(wrenches[3 * b])
    return valid


class Borne(NamedTuple):
    """A contact whose pressure is given anew at each step, and memory for it."""

    stepped: Stepped
    bearing: Bearing
    weights: Doubles
    """[n]"""
    numbers: Doubles
    """Numbers of the bristles `[rows, n]`."""
    kept: Doubles
    """Shares of the deflections that are kept [n]; empty without a pad."""
    state: Doubles
    """State that the pressure leaves, [S]."""


_read_borne = reader(Borne)


@kernel
def _first(row: np.ndarray, count: int, b: int) -> Doubles:
    """Return the `count` numbers of contact b in a flat array, which may hold those of one for all."""
    return at(pointer(row), b * count if row.shape[0] > count else 0)


@kernel
def _left(borne: Borne, z: Doubles) -> Doubles:
    """Return the state that the pressure leaves of one before."""
    if not exists(borne.kept):
        return z
    states = borne.stepped.states
    n = borne.bearing.bristles
    copy(z, borne.state, states)
    for i in range(states // n):
        for k in range(n):
            borne.state[i * n + k] *= borne.kept[k]
    return borne.state


@jit
def step_borne(
    borne: np.ndarray, z: np.ndarray, twist: np.ndarray, dt: float, given: tuple[np.ndarray, ...], known: int,
    result: np.ndarray,
) -> bool:  # fmt: skip
    """Step B contacts under loads of their N cells (see `gathering.bear`); all arrays are flat, and fit each other.

    `borne` are the words of `Borne`; `z` [B S], `twist` [B 3], the `given` loads and covers [B N or N]. New states and
    wrenches go into the first of `result`, the last `SCRATCH` of which are scratch.
    """
    own = _read_borne(borne)
    s = own.stepped.states
    n = own.bearing.count
    (loads, earlier, cover, before) = given
    count = z.shape[0] // s
    if not (_in_order(z, z.shape[0]) and _in_order(twist, twist.shape[0])):
        return False
    wrenches = at(pointer(result), count * s)
    v = at(wrenches, count * 3)
    valid = True
    for b in range(count):
        copy(at(pointer(twist), 3 * b), v, 3)
        v[3] = bear(
            own.bearing, _first(loads, n, b), _first(earlier, n, b), _first(cover, n, b), _first(before, n, b), known,
            own.weights, own.numbers, own.kept,
        )  # fmt: skip
        if not _positive(v[3], dt):
            return False
        left = _left(own, at(pointer(z), b * s))
        into = at(pointer(result), b * s), at(wrenches, 3 * b)
        _step(own.stepped, 0, left, v, dt, *into, at(v, 4))
        valid = valid and xp.in_range(wrenches[3 * b])
    return valid


@kernel
def _jacobians(
    table: Stepped, b: int, z: Doubles, inputs: Doubles, out: Doubles, new: Doubles
) -> None:
    """Write the derivatives of a step of contact b to `out`; `new` [S] and all behind it are scratch."""
    s = table.states
    load = inputs[3]
    dt = inputs[4]
    unit = at(new, s)
    loaded = 1.0 if load > 0.0 else 0.0
    record = _record(table, b)
    by_twist = at(out, table.square)
    by_load = at(by_twist, 3 * s)
    of_wrench = at(by_twist, 4 * s)
    wrench_twist = at(by_twist, 7 * s)
    call(table.function, (record, z, inputs, dt, new, unit))
    clear(by_load, s)
    copy(unit, at(wrench_twist, 9), 3)
    if table.pad > 0 and load > 0.0:
        heavier = at(unit, SLOPES + 6 * s + table.square)
        copy(heavier, by_load, s)
        for i in range(3):
            wrench_twist[9 + i] += load * heavier[s + i]
    for m in range(9):
        wrench_twist[m] = load * unit[3 + m]
    for m in range(3 * s):
        by_twist[m] = loaded * unit[SLOPES + m]
        of_wrench[m] = load * unit[SLOPES + 3 * s + m]
    for m in range(table.square):
        out[m] = loaded * unit[SLOPES + 6 * s + m]


@jit
def jacobians(
    stepped: np.ndarray, z: np.ndarray, inputs: np.ndarray, result: np.ndarray
) -> bool:
    """Write derivatives of steps of B contacts: `z` [B S]; `inputs` [B 5]: twist, load and dt; all arrays are flat.

    Into `result` go, for one contact after the other: new state by state [square], by twist [S, 3] and by load [S],
    wrench by state [3, S], by twist [3, 3] and by load [3]. Scratch for one contact follows at the end.
    """
    table = _read(stepped)
    states = pointer(z)
    rows = pointer(inputs)
    out = pointer(result)
    n = table.states
    count = inputs.shape[0] // 5
    if z.shape[0] != count * n or not (
        _in_order(z, z.shape[0]) and _in_order(inputs, inputs.shape[0])
    ):
        return False
    for b in range(count):
        if not (inputs[5 * b + 3] >= 0.0 and inputs[5 * b + 4] >= 0.0):
            return False
    size = table.square + 7 * n + 12
    for b in range(count):
        _jacobians(
            table,
            b,
            at(states, n * b),
            at(rows, 5 * b),
            at(out, size * b),
            at(out, size * count),
        )
    return True


@jit
def in_order(
    state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray
) -> bool:
    """Return True if all numbers are in range, and no load or step is negative; all arrays are flat."""
    valid = _in_order(state, state.shape[0]) and _in_order(twist, twist.shape[0])
    for row in (load, dt):
        for i in range(row.shape[0]):
            valid = valid and row[i] >= 0.0 and xp.in_range(row[i])
    return valid


@jit
def rates_many(
    function: Place,
    records: np.ndarray,
    state: np.ndarray,
    twist: np.ndarray,
    rate: np.ndarray,
    wrench: np.ndarray,
) -> None:
    """Call `ModelFunctions.evaluate` of B contacts: `state`, `rate` [B, S], `twist`, `wrench` [B, 3] (per unit load).

    `function` is its address; `records` [B or 1, words] has a row for each contact, or one for all.
    """
    for b in range(state.shape[0]):
        record = at(
            pointer(records), b * records.shape[1] if records.shape[0] > 1 else 0
        )
        call(function, (record, state[b], twist[b], rate[b], wrench[b]))


@jit
def linearise_many(
    function: Place,
    records: np.ndarray,
    state: np.ndarray,
    twist: np.ndarray,
    rate: np.ndarray,
    wrench: np.ndarray,
    lin: np.ndarray,
) -> None:
    """Call `ModelFunctions.linearise` of B contacts into `lin` [B, workspace]; the rest as in `rates_many`."""
    for b in range(state.shape[0]):
        record = at(
            pointer(records), b * records.shape[1] if records.shape[0] > 1 else 0
        )
        call(function, (record, state[b], twist[b], rate[b], wrench[b], lin[b]))


UNFIT = (TypeError, ValueError, NumbaError)
"""Exceptions that the entry points raise for arguments of other types."""

REFUSED = (*UNFIT, OverflowError)
"""Exceptions that these and NumPy raise for numbers that are none, or too large."""

PLAIN = frozenset((float, int, np.float64))
"""Types of numbers that need no check before compiled code checks their values."""

_NUMBER = types.float64
_VECTOR = types.float64[::1]
_ROWS = types.float64[:, ::1]
SIGNATURES: dict[Any, tuple] = {
    step_one: (_VECTOR, _VECTOR, *(_NUMBER,) * 5, _VECTOR),
    step_many: (_VECTOR, _ROWS, _ROWS, _VECTOR, _VECTOR, _ROWS, _ROWS, _VECTOR),
    jacobians: (_VECTOR, _VECTOR, _VECTOR, _VECTOR),
    in_order: (_VECTOR, _VECTOR, _VECTOR, _VECTOR),
    step_borne: (
        *(_VECTOR,) * 3,
        _NUMBER,
        types.UniTuple(_VECTOR, 4),
        types.int64,
        _VECTOR,
    ),
}
"""Types of the arguments of each entry point."""
_COMPILING = threading.Lock()


@functools.cache
def ready(function: Any) -> Any:
    """Compile an entry point for plain numbers and arrays, and for nothing else; return it.

    For other types it then raises at once, where it would be compiled anew in the middle of a step.
    """
    with _COMPILING:
        if not function.signatures:
            function.compile(SIGNATURES[function])
            function.disable_compile()
    return function
