"""States of bristles whose stiffness does not grow with the load, and their steps (see `fixed_stiffness`).

With the stiffness `K = sigma_0 f_ref` [N/m] a patch under the load f is the published one with `sigma_0 l`, `l =
f_ref/f`, in place of `sigma_0`. Rates and tractions per unit load then follow the published law at l times the
deflection, and a step of dt from z is 1/l of a step of `l dt` from `l z`.

At rest a published bristle is never bent further than `mu_s/sigma_0`. One that a falling load has left beyond is
brought back onto that limit, by steps as they begin (`stepped`), by the solver within a short time (`recovery`).
"""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.calls import call
from planarfriction.compiler.memory import Doubles, Place, at
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.bristle_step import ROUNDING, cap
from planarfriction.kernels.law import law_of
from planarfriction.kernels.vectors import Vector, norm, scatter, times

RECOVERY = 1.0
"""Speed [m/s]: a bristle far beyond its limit returns to it as fast as it would forget while sliding at this speed."""


@kernel
def factor_at(reference: float, load: float) -> float:
    """Return l; 1 of a published law, whose `reference` is 0."""
    fixed = reference > 0.0
    return xp.where(fixed, reference, 1.0) / xp.where(fixed, xp.maximum(load, formulas.LIGHTEST * reference), 1.0)


@kernel
def stiffened(law: LawNumbers, reference: float, load: float) -> LawNumbers:
    """Return a law with the stiffness that it has at a load, per unit load."""
    return LawNumbers(
        law.sigma_0 * factor_at(reference, load), law.sigma_1, law.sigma_2, law.mu_c, law.mu_s, law.v_s, law.gamma,
        law.elasto_plastic, law.breakaway_ratio, law.creep_speed,
    )  # fmt: skip


@kernel
def softening(law: LawNumbers, reference: float, load: float) -> float:
    """Return the derivative by the load of the `sigma_0` of a `stiffened` law; 0 of a published one, and at no load."""
    moves = load > formulas.LIGHTEST * reference and reference > 0.0
    return xp.where(moves, -law.sigma_0, 0.0) / xp.where(moves, load, 1.0)


@kernel
def within(law: LawNumbers, z: Vector) -> Vector:
    """Return a bristle brought back onto its limit, if it is beyond."""
    return times(cap(norm(z) * law.sigma_0 / law.mu_s, 1.0), z)


@kernel
def recovery(law: LawNumbers, z: Vector, speed: float) -> float:
    """Return the decay [1/s] of a bristle beyond its limit; 0 of others, and of a bristle that slides back as fast."""
    per_limit = law.sigma_0 / law.mu_s
    beyond = 1.0 - 1.0 / xp.maximum(norm(z) * per_limit, 1.0)
    return per_limit * xp.maximum(RECOVERY * beyond - speed, 0.0)


@kernel
def settle(law: LawNumbers, size: int, z: Doubles, factor: float, n: int, out: Doubles) -> None:
    """Write `factor z` of n bristles of so many components to `out`, brought back onto their limits."""
    if size == 3:
        for i in range(n):
            scatter(out, i, n, within(law, times(factor, (z[i], z[n + i], z[2 * n + i]))))
    else:
        for i in range(n):
            scatter(out, i, n, within(law, times(factor, (z[i], z[n + i]))))


@kernel
def bring_back(law: LawNumbers, size: int, z: Doubles, factor: float, n: int) -> None:
    """Bring bristles back onto their limits at a load, and leave others as they are."""
    for i in range(n):
        beyond = _beyond(law, size, z, factor, n, i)
        if beyond > ROUNDING:
            for m in range(size):
                z[m * n + i] /= beyond


@kernel
def _beyond(law: LawNumbers, size: int, z: Doubles, factor: float, n: int, i: int) -> float:
    """Return the deflection of bristle i over its limit."""
    square = 0.0
    for m in range(size):
        square += z[m * n + i] * z[m * n + i]
    return factor * math.sqrt(square) * law.sigma_0 / law.mu_s


@kernel
def stepped(
    function: Place, record: Place, size: int, states: int, factor: float, z: Doubles, twist: Doubles, dt: float,
    new: Doubles, out: Doubles,
) -> None:  # fmt: skip
    """Call one of the `steps.StepFunctions` for bristles with a fixed stiffness; `out` follows the published law.

    Slopes by the state and of the new state are to be multiplied: see `unscale`.
    """
    settle(law_of(record), size, z, factor, states // size, new)
    call(function, (record, new, twist, factor * dt, new, out))
    for i in range(states):
        new[i] = new[i] / factor


@kernel
def unscale(
    record: Place, size: int, z: Doubles, factor: float, n: int, by_twist: Doubles, of_wrench: Doubles,
    by_state: Doubles,
) -> None:  # fmt: skip
    """Turn derivatives of a published step into derivatives of `stepped`, in place.

    New state by twist [size n, 3], wrench by state [3, size, n], new state by state [size, size, n].
    """
    law, states = law_of(record), size * n
    for m in range(3 * states):
        by_twist[m] = by_twist[m] / factor
        of_wrench[m] = of_wrench[m] * factor
    for i in range(n):
        beyond = _beyond(law, size, z, factor, n, i)
        if beyond > ROUNDING:
            _turn_rows(z, size, n, i, beyond, 3, of_wrench)
            _turn_rows(z, size, n, i, beyond, size, by_state)


@kernel
def _turn_rows(z: Doubles, size: int, n: int, i: int, beyond: float, rows: int, by_state: Doubles) -> None:
    """Multiply rows of derivatives by a bristle with its derivatives by the bristle before it was brought back."""
    square = 0.0
    for m in range(size):
        square += z[m * n + i] * z[m * n + i]
    for k in range(rows):
        row, along = at(by_state, k * size * n), 0.0
        for m in range(size):
            along += row[m * n + i] * z[m * n + i]
        for m in range(size):
            row[m * n + i] = (row[m * n + i] - along * z[m * n + i] / square) / beyond
