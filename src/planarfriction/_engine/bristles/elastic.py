"""The bristle of a piece of a pad, whose stiffness K [N/m] is its own and does not grow with its load N [N].

With `s = K/sigma_0` [N], the load at which the law alone would be as stiff, and `l = s/N`, the piece bends by z where a
bristle of the law bends by `y = l z` (docs/physics.md, "Elastic pads"):

    z' = u - k(y) y,     t = -(sigma_0 y + (sigma_1 lambda + sigma_2) u) per unit load,     lambda = z'.u/|u|^2

so that the spring pulls with `K z`, and a step of dt from z is 1/l of a step of `l dt` from y. A load that falls leaves
bristles beyond their limit `mu_s/sigma_0`: steps bring them back as they begin, the solver within a short time
(`recovery`). Lambda lies within 0 and 1, and damps along u alone: springs and damping then only lose energy, however
load and velocity change.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction._engine.bristles import discs, points
from planarfriction._engine.bristles.bristle_step import cap
from planarfriction._engine.codegen.vectors import Vector, dot, norm, plus, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers

RECOVERY = 1.0
"""Speed [m/s]: a bristle far beyond its limit returns to it as fast as it would forget while sliding at this speed."""

SOFTEST = 1e-60
"""Least s [N]: no piece is without stiffness, not even those that fill up vectors."""

STILL = 1e-200
"""Square of a speed [m2/s2] up to which lambda is that of a stuck bristle, 1."""


class Elastic(NamedTuple):
    """A law, and the piece of a pad that a bristle belongs to."""

    law: LawNumbers
    stiff: float
    """s [N]"""
    load: float
    """N [N]"""


@kernel
def factors(pad: Elastic) -> tuple[float, float]:
    """Return l, at most one over `LIGHTEST` where there is no load, and 1/l."""
    stiff = xp.maximum(pad.stiff, SOFTEST)
    load = xp.maximum(pad.load, formulas.LIGHTEST * stiff)
    per = 1.0 / (stiff * load)
    return stiff * stiff * per, load * load * per


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
def traction(law: LawNumbers, y: Vector, rate: Vector, u: Vector) -> Vector:
    """Return the traction per unit load."""
    square = dot(u, u)
    moves = square > STILL
    along = xp.where(moves, dot(rate, u), 1.0) / xp.where(moves, square, 1.0)
    damping = law.sigma_1 * xp.minimum(xp.maximum(along, 0.0), 1.0) + law.sigma_2
    return plus(times(-law.sigma_0, y), -damping, u)


def _pieces_of(plain: Any) -> tuple[Any, Any]:
    """Return rate and step of a piece of a pad, from those of a bristle of the law."""
    rate_of = plain.evaluate
    moved = plain.moved

    @kernel
    def evaluate(pad: Elastic, z: Vector, u: Vector) -> tuple[Vector, Vector]:
        """Compute z' and the traction of a piece that moves at u."""
        stiffer, _ = factors(pad)
        y = times(stiffer, z)
        rate, _ = rate_of(pad.law, y, u)
        back = recovery(pad.law, y, norm(u))
        return plus(rate, -back, y), traction(pad.law, y, rate, u)

    @kernel
    def step(pad: Elastic, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
        """Compute the bristle after dt and its traction."""
        stiffer, softer = factors(pad)
        new, rate = moved(pad.law, within(pad.law, times(stiffer, z)), u, stiffer * dt)
        return times(softer, new), traction(pad.law, new, rate, u)

    return evaluate, step


evaluate, step = _pieces_of(points)
evaluate_disc, step_disc = _pieces_of(discs)
