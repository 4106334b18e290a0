"""Steps of rigid bodies on patches: `V' = V + dt M^-1 (applied + W(V'))`, each a problem of `coupled.coupling`.

Patches are fixed to their body, whose mass is the same along all directions: in the body's axes the response of their
twists to wrenches is `dt` times a matrix that is known before the first step.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numba import types

from planarfriction._engine.codegen.vectors import copy, put
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.compiler.calls import call, pointer
from planarfriction._engine.compiler.memory import (
    Doubles,
    Integers,
    arrays_at,
    at,
    reader,
)
from planarfriction._engine.coupled.coupling_rows import Patches
from planarfriction._engine.coupled.steps import SIGNATURES

WRENCH = 3
"""Place of the applied wrench in the inputs of a body, behind its twist."""

CARRIED = 6
"""Place of the mean twist of the support."""

DT = 9
"""Place of the length of the step."""

ANGLE = 10
"""Place of the angle of the body's axes."""

LOADS = 11
"""Place of the loads of the patches, which are the last inputs."""

MORE = 8
"""Numbers of the result behind the new state: twist, wrench, residual, and 1 if the step converged."""


class RigidPatches(NamedTuple):
    """Patches of a rigid body."""

    patches: Patches
    blank: Doubles
    """Problem without inputs."""
    per_mass: Doubles
    """Inverses of mass, mass and inertia, [3]."""


_read = reader(RigidPatches)


# Neither fused nor reordered: twists are rounded as NumPy would.
@functools.partial(kernel, fastmath=False)
def _step(
    body: RigidPatches,
    patches_at: Doubles,
    z: Doubles,
    given: Doubles,
    records: Integers,
    problem: Doubles,
    out: Doubles,
) -> int:
    """Step one body; return 1 if it converged, 0 if not, and -1 for numbers that are out of range."""
    patches = body.patches
    n = 3 * patches.count
    for i in range(LOADS):
        if not xp.in_range(given[i]):
            return -1
    c = math.cos(given[ANGLE])
    s = math.sin(given[ANGLE])
    rx = given[DT] * body.per_mass[0]
    ry = given[DT] * body.per_mass[1]
    rw = given[DT] * body.per_mass[2]
    vx = given[0] - given[CARRIED] + rx * given[WRENCH]
    vy = given[1] - given[CARRIED + 1] + ry * given[WRENCH + 1]
    omega = given[2] - given[CARRIED + 2] + rw * given[WRENCH + 2]

    copy(body.blank, problem, patches.row.unit)  # all that is no scratch
    p = arrays_at(patches.row, problem)
    p.dt[0] = given[DT]
    put(p.mobility, (rx, ry, rw))
    x = c * vx + s * vy
    y = c * vy - s * vx
    for i in range(n):
        row = at(patches.rows, 3 * i)
        p.free_twist[i] = row[0] * x + row[1] * y + row[2] * omega
        for j in range(n):
            other = at(patches.rows, 3 * j)
            p.response[n * i + j] = (
                row[0] * rx * other[0] + row[1] * ry * other[1] + row[2] * rw * other[2]
            )
    copy(at(given, LOADS), p.free_load, patches.count)
    for k in range(patches.count):
        p.records[k] = records[k]
    copy(z, p.state, patches.states)
    call(patches.solve, (patches_at, problem))

    fx = 0.0
    fy = 0.0
    tau = 0.0
    for i in range(n):
        row = at(patches.rows, 3 * i)
        fx += p.wrench[i] * row[0]
        fy += p.wrench[i] * row[1]
        tau += p.wrench[i] * row[2]
    wrench = c * fx - s * fy, s * fx + c * fy, tau
    copy(p.new, out, patches.states)
    end = at(out, patches.states)
    end[0] = vx + rx * wrench[0] + given[CARRIED]
    end[1] = vy + ry * wrench[1] + given[CARRIED + 1]
    end[2] = omega + rw * wrench[2] + given[CARRIED + 2]
    put(at(end, 3), wrench)
    end[6] = p.residual[0]
    end[7] = p.converged[0]
    return -1 if p.iterations[0] < 0.0 else np.int64(p.converged[0])


@jit
def step_bodies(
    body: np.ndarray,
    states: np.ndarray,
    given: np.ndarray,
    records: np.ndarray,
    problem: np.ndarray,
    ends: np.ndarray,
) -> int:
    """Step B bodies; `body` are the words of `RigidPatches`, all arrays are flat and `problem` is scratch.

    `states` [B, S]; `given` [B, LOADS + k]: twist, applied wrench, mean twist of the support, dt, angle and loads;
    `records` [k] or [B, k]; into `ends` [B, S + MORE] go new state, twist, wrench, residual, and 1 if it converged.
    Return the number of bodies that converged, -1 if a number is out of range.
    """
    of = _read(body)
    k = of.patches.count
    n = of.patches.states
    width = LOADS + k
    count = given.shape[0] // width
    if given.shape[0] != count * width or states.shape[0] != count * n:
        return -1
    converged = 0
    for b in range(count):
        inputs = at(pointer(given), width * b)
        which = at(pointer(records), k * b if records.shape[0] > k else 0)
        end = at(pointer(ends), (n + MORE) * b)
        z = at(pointer(states), n * b)
        done = _step(of, pointer(body), z, inputs, which, pointer(problem), end)
        if done < 0:
            return -1
        converged += done
    return converged


_NUMBERS = types.float64[::1]
SIGNATURES[step_bodies] = (_NUMBERS,) * 3 + (types.int64[::1], _NUMBERS, _NUMBERS)
