"""Steps of contacts as Python calls them: one contact, a batch, a sequence, and their derivatives.

All contacts step by the same function, one of the `StepFunctions` of a model. It is called by its address: compiled
into the code of one contact and into that of a batch, a step would round differently in each.

The entry points check what they are given and return False where that is not in order; of types that they were not
compiled for they say so for free (`UNFIT`). Without load a contact forgets its state.
"""

from __future__ import annotations

import functools
import threading
from typing import Any, NamedTuple

from numba import types
from numba.core.errors import NumbaError

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, jit, kernel
from planarfriction.compiler.calls import call, pointer
from planarfriction.compiler.memory import at, reader
from planarfriction.formulas import LIGHTEST
from planarfriction.kernels.bind import bind
from planarfriction.kernels.settle import factor_at, stepped, unscale
from planarfriction.kernels.vectors import plus, put, three, times

WORDS = "pddfdd"
"""Arguments of `StepFunctions` (see `calls.address_of`)."""

SLOPES = 12
"""Numbers that `StepFunctions.slopes` writes."""


NUDGE = 1e-5
"""Share of the load over which steps of a fixed stiffness are compared for their slopes."""


class StepFunctions(NamedTuple):
    """Compiled steps of a contact with S states.

    Their arguments are `(contact, z, V, dt, new, out)`: the address of the contact's record (with which the solver
    calls its `contacts.ModelFunctions`), a number `dt`, and pointers to doubles. They write the new state to `new` and
    to `out`, per unit load, the wrench W at the end of the step [3] and what follows.
    """

    step: Any
    slopes: Any
    """dW/dV [3, 3] as well."""
    jacobian: Any
    """dW/dV, d new/dV [S, 3], dW/dz [3, S] and d new/dz as well."""


def step_functions(name: str, templates: tuple, **model: Any) -> StepFunctions:
    """Return the steps of a model, entry points `<name>_step`, ...: templates that are bound to its arguments.

    Those of slopes and of the Jacobian are one template, whose argument `whole` tells them apart.
    """
    step, slopes = templates
    return StepFunctions(
        bind(step, f"{name}_step", entry, **model),
        bind(slopes, f"{name}_slopes", entry, **model, whole=False),
        bind(slopes, f"{name}_jacobian", entry, **model, whole=True),
    )


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
    reference: float = 0.0
    """Reference load [N] of a law whose stiffness does not grow with the load; 0 of others."""
    size: int = 2
    """Components of a bristle, for such a law."""


_read = reader(Stepped)


@kernel
def _record(own, b):
    """Return the address of the record of contact b."""
    return at(own.record, own.words * b if own.loads > 1 else 0)


@kernel
def _in_order(row, n):
    valid = True
    for i in range(n):
        valid = valid and xp.in_range(row[i])
    return valid


@kernel
def _positive(load, dt):
    return xp.in_range(load) and xp.in_range(dt) and load >= 0.0 and dt >= 0.0


@kernel
def _step(own, b, z, twist, load, dt, new, wrench, unit):
    """Step contact b; `unit` [3] is scratch."""
    if own.reference > 0.0:
        factor = factor_at(own.reference, load)
        stepped(own.function, _record(own, b), own.size, own.states, factor, z, twist, dt, new, unit)
    else:
        call(own.function, (_record(own, b), z, twist, dt, new, unit))
    if load > 0.0:
        put(wrench, times(load, three(unit)))
    else:
        put(wrench, (0.0, 0.0, 0.0))
        for i in range(own.states):
            new[i] = 0.0


@jit
def step_one(stepped, z, vx, vy, omega, load, dt, result):
    """Step one contact; `stepped` are the words of `Stepped`, `z` [S].

    New state and wrench go into the first of `result` [S + 9], whose last six are scratch. Called from Python: every
    argument costs a quarter of a microsecond on the way in.
    """
    own, out = _read(stepped), pointer(result)
    n = own.states
    valid = z.shape[0] == n and xp.in_range(vx) and xp.in_range(vy) and xp.in_range(omega) and _positive(load, dt)
    if not (valid and _in_order(z, n)):
        return False
    wrench, twist = at(out, n), at(out, n + 3)
    put(twist, (vx, vy, omega))
    _step(own, 0, pointer(z), twist, load, dt, out, wrench, at(out, n + 6))
    return True


@jit
def step_many(stepped, z, twist, load, dt, new, wrench, scratch):
    """Step B contacts: `z`, `new` [B, S], `twist`, `wrench` [B, 3], `load`, `dt` [B or 1]; `scratch` [3]."""
    own, (count, n) = _read(stepped), z.shape
    loads, steps = load.shape[0], dt.shape[0]
    valid = n == own.states and twist.shape[0] == count and twist.shape[1] == 3
    valid = valid and (loads == 1 or loads == count) and (steps == 1 or steps == count)
    for b in range(count if valid else 0):
        valid = valid and _positive(load[b if loads > 1 else 0], dt[b if steps > 1 else 0])
        valid = valid and _in_order(z[b], n) and _in_order(twist[b], 3)
    if not valid:
        return False
    states, twists, ends, wrenches = pointer(z), pointer(twist), pointer(new), pointer(wrench)
    for b in range(count):
        here, held = load[b if loads > 1 else 0], dt[b if steps > 1 else 0]
        into = at(ends, n * b), at(wrenches, 3 * b)
        _step(own, b, at(states, n * b), at(twists, 3 * b), here, held, *into, pointer(scratch))
    return True


@kernel
def _step_fixed(own, b, z, given, new, by_load, wrench_load):
    """Step contact b with a fixed stiffness: slopes behind `new` as others have them, and those by the load.

    These are central differences.
    """
    s, load, dt, record = own.states, given[3], given[4], _record(own, b)
    found, more, less = at(new, s), factor_at(own.reference, load * (1.0 + NUDGE)), load * (1.0 - NUDGE)
    stepped(own.function, record, own.size, s, more, z, given, dt, new, found)
    above = three(found)
    for i in range(s):
        by_load[i] = new[i]
    stepped(own.function, record, own.size, s, factor_at(own.reference, less), z, given, dt, new, found)
    change = times(0.5 / NUDGE, plus(above, -1.0, three(found)))
    for i in range(s):
        by_load[i] = (by_load[i] - new[i]) * (0.5 / NUDGE) / xp.maximum(load, own.reference * LIGHTEST)
    factor = factor_at(own.reference, load)
    stepped(own.function, record, own.size, s, factor, z, given, dt, new, found)
    put(wrench_load, plus(three(found), 1.0, change))
    by_twist = at(found, SLOPES)
    unscale(record, own.size, z, factor, s // own.size, by_twist, at(by_twist, 3 * s), at(by_twist, 6 * s))


@kernel
def _jacobians(own, b, z, given, out, new):
    """Write the derivatives of a step of contact b to `out`; `new` [S] and all behind it are scratch."""
    s, load, dt = own.states, given[3], given[4]
    found, loaded, by_twist = at(new, s), 1.0 if load > 0.0 else 0.0, at(out, own.square)
    by_load, of_wrench, wrench_twist = at(by_twist, 3 * s), at(by_twist, 4 * s), at(by_twist, 7 * s)
    if own.reference > 0.0:
        _step_fixed(own, b, z, given, new, by_load, at(wrench_twist, 9))
    else:
        call(own.function, (_record(own, b), z, given, dt, new, found))
        for i in range(s):
            by_load[i] = 0.0
        for m in range(3):
            wrench_twist[9 + m] = found[m]
    for m in range(9):
        wrench_twist[m] = load * found[3 + m]
    for m in range(3 * s):
        by_twist[m] = loaded * found[SLOPES + m]
        of_wrench[m] = load * found[SLOPES + 3 * s + m]
    for m in range(own.square):
        out[m] = loaded * found[SLOPES + 6 * s + m]


@jit
def jacobians(stepped, z, given, result):
    """Write derivatives of steps of B contacts: `z` [B S]; `given` [B 5]: twist, load and dt; all arrays are flat.

    Into `result` go, for one contact after the other: new state by state [square], by twist [S, 3] and by load [S],
    wrench by state [3, S], by twist [3, 3] and by load [3]. Behind all of them lies scratch for one contact.
    """
    own, states, inputs, out = _read(stepped), pointer(z), pointer(given), pointer(result)
    n, count = own.states, given.shape[0] // 5
    if z.shape[0] != count * n or not (_in_order(z, z.shape[0]) and _in_order(given, given.shape[0])):
        return False
    for b in range(count):
        if not (given[5 * b + 3] >= 0.0 and given[5 * b + 4] >= 0.0):
            return False
    size = own.square + 7 * n + 12
    for b in range(count):
        _jacobians(own, b, at(states, n * b), at(inputs, 5 * b), at(out, size * b), at(out, size * count))
    return True


UNFIT = (TypeError, ValueError, NumbaError)
"""Exceptions that the entry points raise for arguments of other types."""

_NUMBER, _VECTOR, _ROWS = types.float64, types.float64[::1], types.float64[:, ::1]
_SIGNATURES: dict[Any, tuple] = {
    step_one: (_VECTOR, _VECTOR, *(_NUMBER,) * 5, _VECTOR),
    step_many: (_VECTOR, _ROWS, _ROWS, _VECTOR, _VECTOR, _ROWS, _ROWS, _VECTOR),
    jacobians: (_VECTOR, _VECTOR, _VECTOR, _VECTOR),
}
_COMPILING = threading.Lock()


@functools.cache
def ready(function: Any) -> Any:
    """Compile an entry point for plain numbers and arrays, and for nothing else; return it.

    Of other types it then says so at once, for free, where it would be compiled anew in the middle of a step.
    """
    with _COMPILING:
        if not function.signatures:
            function.compile(_SIGNATURES[function])
            function.disable_compile()
    return function
