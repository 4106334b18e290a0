"""Steps at a held twist of contacts whose face hangs on its back (see `face`): each looks for the twist of its face.

From the twist V_f of the face follow the wrench `W(V_f)` of the bristles and the residual

    r = V - V_f + (b + C W)/h,     h = dt + T.

Broyden's method finds its root with one step of the bristles each time, from the slope `-K dt` that W has where all
bristles stick, less by as much as friction does not hold. Where it does not end, the search of `coupling` does.

Source: Broyden, A class of methods for solving nonlinear simultaneous equations, 1965.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction._engine.codegen.small_matrices import solved
from planarfriction._engine.codegen.vectors import clear, copy
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import entry, kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import (
    Doubles,
    Place,
    arrays_at,
    at,
    reader,
)
from planarfriction._engine.coupled.coupling import ROUNDING
from planarfriction._engine.coupled.coupling_rows import ContactSolve, Patches, read
from planarfriction._engine.coupled.coupling_steps import step_patch
from planarfriction._engine.coupled.face import bent, move_faces

TRIES = 20
"""Steps of the bristles at most, before the search of `coupling`."""

MOST = 100
"""Iterations of that at most."""


class Hanging(NamedTuple):
    """A contact whose face hangs on its back."""

    pieces: int
    """Address of the record of its bristles."""
    patches: int
    """Address of `Patches`, of this one alone."""
    words: int
    """Words of the row of a problem of these."""
    limit: float
    """Largest friction per unit load [-]."""
    stuck: Doubles
    """Stiffness of the bristles while all of them stick, `[3, 3]`."""
    viscous: Doubles
    """Viscous friction of all bristles per unit load, `[3, 3]`."""


_read = reader(Hanging)


@kernel
def _held(own: Hanging, p: ContactSolve, i: int, x: Doubles) -> float:
    """Return element i of the wrench by which bristles that stick hold against a twist."""
    held = 0.0
    for j in range(3):
        held += p.dt[0] * own.stuck[3 * i + j] * x[j]
        held += p.load[0] * own.viscous[3 * i + j] * x[j]
    return held


@kernel
def _start(own: Hanging, patches: Patches, p: ContactSolve, h: float) -> None:
    """Write a first twist of the face, and the slopes of `-r` by it into `matrix`.

    Friction holds a share of the wrench of bristles that stick.
    """
    for j in range(3):
        clear(p.change, 3)
        p.change[j] = 1.0
        for i in range(3):
            p.move[i] = _held(own, p, i, p.change)
        for i in range(3):
            slope = p.change[i]
            for m in range(3):
                slope += patches.compliance[3 * i + m] * p.move[m] / h
            p.matrix[3 * i + j] = slope
    copy(p.matrix, p.slopes, 9)
    copy(p.free_twist, p.change, 3)
    solved(p.slopes, p.change, 3)
    x = _held(own, p, 0, p.change)
    y = _held(own, p, 1, p.change)
    turn = _held(own, p, 2, p.change) / patches.radius[0]
    size = math.sqrt(x * x + y * y + turn * turn)
    largest = own.limit * p.load[0]
    part = largest / size if size > largest else 1.0
    for i in range(3):
        p.twist[i] = p.free_twist[i] + part * (p.change[i] - p.free_twist[i])
        for j in range(3):
            one = 1.0 if i == j else 0.0
            p.matrix[3 * i + j] = one + part * (p.matrix[3 * i + j] - one)


@kernel
def _try(patches: Patches, p: ContactSolve, h: float) -> bool:
    """Step at the twist of the face and write the residual into `gap`; return True where it is rounding."""
    copy(p.twist, p.seen, 3)
    step_patch(patches, p, patches.steps, 0, p.load[0])
    off = 0.0
    speed = 0.0
    for i in range(3):
        p.unit[i] = p.step[i]
        p.wrench[i] = p.load[0] * p.step[i]
    for i in range(3):
        lever = patches.radius[0] if i == 2 else 1.0
        b = p.state[patches.firsts[1] - 3 + i]
        moved = bent(patches, p, 0, i, p.wrench)
        p.gap[i] = p.free_twist[i] - p.twist[i] + moved / h
        off = xp.maximum(off, lever * abs(p.gap[i]))
        fast = abs(p.free_twist[i]) + (abs(b) + abs(moved - b)) / h
        speed = xp.maximum(speed, lever * fast)
    return off <= p.tolerance[0] * speed


@kernel
def _learn(patches: Patches, p: ContactSolve) -> None:
    """Mend the slopes by the residual that is left of the last change of the face's twist."""
    lever = patches.radius[0]
    p.move[0] = p.change[0]
    p.move[1] = p.change[1]
    p.move[2] = lever * lever * p.change[2]
    size = 0.0
    for i in range(3):
        size += p.move[i] * p.change[i]
    per = 1.0 / size if size != 0.0 else 0.0
    for i in range(3):
        for j in range(3):
            p.matrix[3 * i + j] -= per * p.gap[i] * p.move[j]


@kernel
def found(own: Hanging, patches: Patches, p: ContactSolve) -> bool:
    """Step with the face that Broyden's method finds; return False if it does not.

    The tolerance of the problem is that in the largest speed.
    """
    h = p.dt[0] + patches.lag[0]
    _start(own, patches, p, h)
    for i in range(TRIES):
        if _try(patches, p, h):
            move_faces(patches, p)
            return True
        if i > 0:
            _learn(patches, p)
        copy(p.matrix, p.slopes, 9)
        copy(p.gap, p.change, 3)
        solved(p.slopes, p.change, 3)
        for j in range(3):
            p.twist[j] += p.change[j]
    return False


@kernel
def _search(own: Hanging, patches: Patches, z: Doubles, v: Doubles, dt: float, row: Doubles) -> None:  # fmt: skip
    """Step as `coupling` does, whose host does not yield here; its problem is `row`."""
    clear(row, own.words)
    p = arrays_at(patches.row, row)
    p.dt[0] = dt
    p.most[0] = MOST
    p.again[0] = 1.0
    copy(v, p.free_twist, 3)
    p.free_load[0] = v[3]
    copy(z, p.state, patches.states)
    p.records[0] = own.pieces
    call(patches.solve, (own.patches, row))
    if p.converged[0] == 0.0:
        p.unit[0] = math.nan


@entry
def step(
    contact: Place, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles
) -> None:
    """Implement `protocol.StepFunctions.step`; behind the wrench is scratch, and no number is in it if all fails."""
    own = _read(contact)
    patches = read(own.patches)
    row = at(out, 3)
    p = arrays_at(patches.row, row)
    p.dt[0] = dt
    p.tolerance[0] = ROUNDING
    copy(v, p.free_twist, 3)
    p.load[0] = v[3]
    copy(z, p.state, patches.states)
    p.acting[0] = own.pieces
    if not found(own, patches, p):
        _search(own, patches, z, v, dt, row)
    copy(p.new, new, patches.states)
    copy(p.unit, out, 3)
