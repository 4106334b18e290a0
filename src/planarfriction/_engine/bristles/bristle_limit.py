"""Bristles whose stiffness does not grow with the load; `cells.fixed_stiffness` has the steps of cells of them.

With the stiffness `K = sigma_0 f_ref` [N/m] a patch under the load f is the published one with `sigma_0 l`, `l =
f_ref/f`, in place of `sigma_0`. Rates and tractions per unit load then follow the published law at l times the
deflection, and a step of dt from z is 1/l of a step of `l dt` from `l z`.

At rest a published bristle is never bent further than `mu_s/sigma_0`, seen from `a mu_s/sigma_0` where friction differs
forwards and backwards (see `asymmetric_cells`). One that a falling load has left beyond is brought back onto that
limit, by steps as they begin (`cells.fixed_stiffness.stepped`), by the solver within a short time (`recovery`).
"""

from __future__ import annotations

from planarfriction import formulas
from planarfriction._engine.bristles.bristle_step import cap
from planarfriction._engine.codegen.vectors import Vector, norm, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers

RECOVERY = 1.0
"""Speed [m/s]: a bristle far beyond its limit returns to it as fast as it would forget while sliding at this speed."""


@kernel
def factor_at(reference: float, load: float) -> float:
    """Return l; 1 of a published law, whose `reference` is 0."""
    fixed = reference > 0.0
    return xp.where(fixed, reference, 1.0) / xp.where(
        fixed, xp.maximum(load, formulas.LIGHTEST * reference), 1.0
    )


@kernel
def stiffened(law: LawNumbers, reference: float, load: float) -> LawNumbers:
    """Return a law with the stiffness that it has at a load, per unit load."""
    return LawNumbers(law.sigma_0 * factor_at(reference, load), *law[1:])


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
