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

from planarfriction._engine.bristles.bristle_step import cap
from planarfriction._engine.cells.cell_blocks import scratch
from planarfriction._engine.codegen.small_matrices import inverse
from planarfriction._engine.codegen.vectors import (
    Vector,
    clear,
    copy,
    dot,
    matrix_applied,
    matrix_applied_back,
    matrix_product,
    plus,
    put,
    reader_of,
    three,
    times,
)
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
from planarfriction._engine.coupled.coupling_rows import Patches, read

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
_nine = reader_of(9)


@kernel
def _product(a: Vector, b: Vector) -> Vector:
    """Return the matrix `a b'` [3, 3]."""
    return (
        *times(a[0], b),
        *times(a[1], b),
        *times(a[2], b),
    )


@kernel
def _largest(twist: Vector, lever: float) -> float:
    """Return the largest speed of a twist."""
    return xp.maximum(xp.maximum(abs(twist[0]), abs(twist[1])), lever * abs(twist[2]))


@kernel
def _start(
    own: Hanging, patches: Patches, twist: Vector, load: float, dt: float, h: float
) -> tuple[Vector, Vector]:
    """Return a first twist of the face, and the matrix that turns residuals into changes of it, [3, 3]."""
    soft = _nine(patches.compliance, 0, 1)
    held = plus(times(dt, _nine(own.stuck, 0, 1)), load, _nine(own.viscous, 0, 1))
    yields = times(-1.0 / h, matrix_product(soft, held))
    pull = matrix_applied(held, matrix_applied(inverse(1.0, yields), twist))
    turn = pull[2] / patches.radius[0]
    size = math.sqrt(pull[0] * pull[0] + pull[1] * pull[1] + turn * turn)
    share = cap(size, own.limit * load)
    face = plus(twist, -share / h, matrix_applied(soft, pull))
    return face, inverse(1.0, times(share, yields))


@kernel
def _found(
    own: Hanging, patches: Patches, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles
) -> bool:  # fmt: skip
    """Step with the face that Broyden's method finds; return False if it does not."""
    soft = _nine(patches.compliance, 0, 1)
    lever = patches.radius[0]
    last = patches.states - 3
    b = three(at(z, last))
    twist = three(v)
    load = v[3]
    h = dt + patches.lag[0]
    face, inverse_slope = _start(own, patches, twist, load, dt, h)
    seen = scratch(4)
    seen[3] = load
    change = times(0.0, face)
    residual = change
    for i in range(TRIES):
        put(seen, face)
        call(patches.steps[0], (own.pieces, z, seen, dt, new, out))
        wrench = times(load, three(out))
        pulled = matrix_applied(soft, wrench)
        bent = plus(b, 1.0, pulled)
        now = plus(plus(twist, -1.0, face), 1.0 / h, bent)
        if i > 0:
            caused = matrix_applied(inverse_slope, plus(residual, -1.0, now))
            weighed = (change[0], change[1], lever * lever * change[2])
            row = matrix_applied_back(inverse_slope, weighed)
            along = dot(weighed, caused)
            per = 1.0 / along if along != 0.0 else 0.0
            missing = times(per, plus(change, -1.0, caused))
            inverse_slope = plus(inverse_slope, 1.0, _product(missing, row))
        residual = now
        speed = _largest(twist, lever)
        speed += (_largest(b, lever) + _largest(pulled, lever)) / h
        if _largest(residual, lever) <= ROUNDING * speed:
            put(at(new, last), plus(b, -dt / h, bent))
            return True
        change = matrix_applied(inverse_slope, residual)
        face = plus(face, 1.0, change)
    return False


@kernel
def _search(
    own: Hanging, patches: Patches, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles, row: Doubles,
) -> None:  # fmt: skip
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
    copy(p.new, new, patches.states)
    copy(p.unit, out, 3)
    if p.converged[0] == 0.0:
        out[0] = math.nan


@entry
def step(
    contact: Place, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles
) -> None:
    """Implement `protocol.StepFunctions.step`; behind the wrench is scratch, and no number is in it if all fails."""
    own = _read(contact)
    patches = read(own.patches)
    if not _found(own, patches, z, v, dt, new, out):
        _search(own, patches, z, v, dt, new, out, at(out, 3))
