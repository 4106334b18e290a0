"""The bristle of a point: two components, driven by the velocity `u` of the point.

    z' = u - k z,     t = -(sigma_0 z + sigma_1 z' + sigma_2 u),     k = bristle_decay (docs/physics.md, "Bristles")

Loops over cells and derivatives are written from a trace of its functions (see `cell_loops`).
"""

from __future__ import annotations

from planarfriction import formulas
from planarfriction._engine.bristles import bristle_step
from planarfriction._engine.bristles.law import inverse_deflection, traction
from planarfriction._engine.codegen.ratios import ratio
from planarfriction._engine.codegen.vectors import Vector, dot, norm, plus
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers


@kernel
def evaluate(law: LawNumbers, z: Vector, u: Vector) -> tuple[Vector, Vector]:
    """Compute z' and the traction of a point that moves at u."""
    speed = norm(u)
    size = norm(z)
    q = inverse_deflection(law, speed)
    rate = plus(
        u,
        -formulas.bristle_decay(xp, size * q, ratio(dot(z, u), size), speed, q, law),
        z,
    )
    return rate, traction(law, z, rate, u)


@kernel
def moved(law: LawNumbers, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
    """Compute the bristle after dt and its rate there (see `bristle_step`)."""
    speed = norm(u)
    new, k = bristle_step.step(
        law, z, u, speed, 1.0, inverse_deflection(law, speed), dt
    )
    return new, plus(u, -k, new)


@kernel
def step(law: LawNumbers, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
    """Compute the bristle after dt and its traction."""
    new, rate = moved(law, z, u, dt)
    return new, traction(law, new, rate, u)
