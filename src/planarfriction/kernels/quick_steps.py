"""Steps of models of three states as Python calls them, where every check in Python would take longer than they do.

Each checks what it is given, and answers false where that is not in order; of types that it was not compiled for it
says so for free (`rollouts.UNFIT`). Places are the
`rollouts.PartAddresses` of the parts, a row of words for each, flat.
"""

from __future__ import annotations

import functools
import threading
from typing import Any

from numba import types

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, jit, kernel
from planarfriction.compiler.calls import address, address_of, call
from planarfriction.compiler.memory import at, doubles, integers, reader, size_of
from planarfriction.kernels.rollouts import PartAddresses

_place = reader(PartAddresses)
_WORDS = size_of(PartAddresses)

JACOBIAN = "pppfp"
"""Arguments of the functions `..._jacobian` of `step_slopes`, which `jacobians` calls."""


@kernel
def _in_order(row, n):
    valid = True
    for i in range(n):
        valid = valid and xp.in_range(row[i])
    return valid


@jit
def step_many(places, z, twist, load, dt, new, wrench, scratch):
    """Step B contacts of P parts: `z`, `new` [B, 3 P], `twist`, `wrench` [B, 3], `load`, `dt` [B or 1].

    `scratch` [14].
    """
    count, n = z.shape
    loads, steps = load.shape[0], dt.shape[0]
    valid = n == 3 * (places.shape[0] // _WORDS) and twist.shape[0] == count and twist.shape[1] == 3
    valid = valid and (loads == 1 or loads == count) and (steps == 1 or steps == count)
    for b in range(count if valid else 0):
        here, held = load[b if loads > 1 else 0], dt[b if steps > 1 else 0]
        valid = valid and xp.in_range(here) and xp.in_range(held) and here >= 0.0 and held >= 0.0
        valid = valid and _in_order(z[b], n) and _in_order(twist[b], 3)
    if not valid:
        return False
    for b in range(count):
        here, held = load[b if loads > 1 else 0], dt[b if steps > 1 else 0]
        scratch[9], scratch[10], scratch[11] = twist[b, 0], twist[b, 1], twist[b, 2]
        scratch[12], scratch[13] = here, held
        fx, fy, tau = 0.0, 0.0, 0.0
        for first in range(0, n, 3):
            part = _place(address(places, first // 3 * _WORDS))
            scratch[6], scratch[7], scratch[8] = z[b, first], z[b, first + 1], z[b, first + 2]
            call(part.step, (part.row, part.data, address(scratch, 6), address(scratch, 0)))
            new[b, first], new[b, first + 1], new[b, first + 2] = scratch[0], scratch[1], scratch[2]
            fx += part.share * scratch[3]
            fy += part.share * scratch[4]
            tau += part.share * scratch[5]
        wrench[b, 0], wrench[b, 1], wrench[b, 2] = fx, fy, tau
    return True


@entry
def jacobians(places, parts, z, given, result):
    """Write derivatives of a step of one contact with the state z [3 P] and `given` twist, load and dt [5].

    Into `result` go, one behind the other: new state by state [P, 3, 3] and by twist [P, 3, 3], wrench by state
    [3, P, 3], by twist [3, 3] and by load [3]; the last 42 of its `NUMBERS` are scratch.
    """
    out, load, dt, n = doubles(result), doubles(given)[3], doubles(given)[4], 3 * parts
    by_state, by_twist, by_load = 18 * parts, 27 * parts, 27 * parts + 9
    rows, loaded = doubles(at(result, by_load + 3)), 1.0 if load > 0.0 else 0.0
    for i in range(12):
        out[by_twist + i] = 0.0
    for k in range(parts):
        part = _place(at(places, k * _WORDS))
        call(part.step, (part.row, at(z, 3 * k), given, dt, at(result, by_load + 3)))
        pull = part.share * load
        for i in range(3):
            for j in range(3):
                out[9 * k + 3 * i + j] = loaded * rows[7 * i + j]
                out[9 * (parts + k) + 3 * i + j] = loaded * rows[7 * i + 3 + j]
                out[by_state + n * i + 3 * k + j] = pull * rows[21 + 7 * i + j]
                out[by_twist + 3 * i + j] += pull * rows[21 + 7 * i + 3 + j]
            out[by_load + i] += part.share * rows[21 + 7 * i + 6]


NUMBERS = 54
"""Numbers of the result of `jacobians` beside the 27 of each part."""


@functools.cache
def jacobians_address() -> int:
    """Return the address of `jacobians` in this process."""
    return address_of(jacobians, "ppppp")


# It is called by its address, so that one contact and a batch round alike: the word in front of the places.


@jit
def jacobians_one(places, z, vx, vy, omega, load, dt, result):
    """Write `jacobians` of one contact to `result` [27 P + NUMBERS + 5]."""
    parts = (places.shape[0] - 1) // _WORDS
    valid = xp.in_range(vx) and xp.in_range(vy) and xp.in_range(omega) and xp.in_range(load) and xp.in_range(dt)
    if not (valid and load >= 0.0 and dt >= 0.0 and z.shape[0] == 3 * parts and _in_order(z, 3 * parts)):
        return False
    given = 27 * parts + NUMBERS
    result[given], result[given + 1], result[given + 2], result[given + 3], result[given + 4] = vx, vy, omega, load, dt
    function = integers(address(places, 0))[0]
    call(function, (address(places, 1), parts, address(z, 0), address(result, given), address(result, 0)))
    return True


@jit
def jacobians_many(places, z, given, result):
    """Write `jacobians` of B contacts: z [B, 3 P], given [B, 5], result [B, 27 P + NUMBERS]."""
    parts, function = (places.shape[0] - 1) // _WORDS, integers(address(places, 0))[0]
    for b in range(z.shape[0]):
        own = address(z, 3 * parts * b), address(given, 5 * b), address(result, result.shape[1] * b)
        call(function, (address(places, 1), parts, *own))


_COMPILING = threading.Lock()


@functools.cache
def compile_quick_steps() -> None:
    """Compile them for arrays and plain numbers, and for nothing else."""
    number, vector, rows = types.float64, types.float64[::1], types.float64[:, ::1]
    functions: list[tuple[Any, tuple]] = [
        (step_many, (vector, rows, rows, vector, vector, rows, rows, vector)),
        (jacobians_one, (vector, vector, *(number,) * 5, vector)),
        (jacobians_many, (vector, rows, rows, rows)),
    ]
    with _COMPILING:
        for function, signature in functions:
            if not function.signatures:
                function.compile(signature)
                function.disable_compile()
