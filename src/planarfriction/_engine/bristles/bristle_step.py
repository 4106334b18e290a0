"""One step of one bristle: a cell's (two components) or the published reduced model's (three).

A bristle `z` driven by `u` steps by

    start = k(z),   p = z + u dt,   end = k(p / (1 + start dt)),   x = mean_decay(start, end, dt) dt,
    n = back (exp(-x) z + (1 - exp(-x))/x dt u),   k(n)

(docs/physics.md, "Step at constant twist"). `k` sees the deflection `|z| q/h` and `along = z/|z| . u/h`, with the
inverse deflection `q`, the speed `v` and `h = |u|/v`. `codegen.derivatives` writes the derivatives.

At the kinks: the slope of a norm at zero is zero, and `along` of no bristle is constant. A minimum or maximum of equal
numbers has the slope of its first argument. A bristle that the cap just touches counts as not capped: steady sliding
sits on the cap to the last bit, and rounding that lifts it over must not decide about its slope, nor about the slope
of the next cap.
"""

from __future__ import annotations

from planarfriction import formulas
from planarfriction._engine.codegen.ratios import ratio
from planarfriction._engine.codegen.rules import primitive
from planarfriction._engine.codegen.vectors import Vector, dot, norm, plus, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers

ROUNDING = 1.0 + 256.0 * 2.220446049250313e-16
"""Ratio of a deflection to its cap [-] above which it counts as capped."""


@kernel
def cap(deflection: float, largest: float) -> float:
    """Compute `formulas.cap`, with the slope of a free bristle where rounding alone lifts it over the cap."""
    return formulas.cap(xp, deflection, largest)


def _cap_partials(factor: float, deflection: float, largest: float) -> tuple:
    beyond = deflection > ROUNDING * largest
    per = xp.where(beyond, 1.0, 0.0) / xp.where(beyond, deflection, 1.0)
    return -factor * per, per


primitive(cap, _cap_partials)


@kernel
def reachable(deflection: float, law: LawNumbers) -> float:
    """Compute `formulas.reachable_deflection`, with no slope for a deflection that is full to rounding."""
    return formulas.reachable_deflection(xp, deflection, law)


primitive(
    reachable,
    lambda largest, deflection, law: (xp.where(deflection > ROUNDING, 1.0, 0.0), 0.0),
)


@kernel
def seen(z: Vector, size: float, u: Vector, per_h: float, q: float) -> Vector:
    """Return the deflection of a bristle, and the speed at which it is being stretched; 0 and 0 for none."""
    return size * (q * per_h), per_h * ratio(dot(z, u), size)


@kernel
def bounded(far: float, start: float, dt: float, deflection: float) -> float:
    """Return the deflection at the predicted end of a step, from the end without friction `far` and the decay `start`.

    The bound is full deflection or more, where k no longer depends on the deflection.
    """
    return xp.minimum(far / (1.0 + start * dt), xp.maximum(deflection, 1.0))


@kernel
def capped(
    law: LawNumbers, free: Vector, far: float, deflection: float
) -> tuple[Vector, float]:
    """Return a bristle within its cap, and its deflection; `deflection` is the one at the start of the step."""
    back = cap(far, reachable(deflection, law))
    return times(back, free), far * back


@kernel
def step(
    law: LawNumbers, z: Vector, u: Vector, v: float, per_h: float, q: float, dt: float
) -> tuple[Vector, float]:
    """Return the bristle after dt, and its k."""
    deflection, along = seen(z, norm(z), u, per_h, q)
    start = formulas.bristle_decay(xp, deflection, along, v, q, law)
    ahead = plus(z, dt, u)
    far, along_ahead = seen(ahead, norm(ahead), u, per_h, q)
    end = formulas.bristle_decay(
        xp, bounded(far, start, dt, deflection), along_ahead, v, q, law
    )
    left, mean = formulas.relaxation(xp, formulas.mean_decay(start, end, dt) * dt)
    free = plus(times(left, z), dt * mean, u)
    beyond, along_free = seen(free, norm(free), u, per_h, q)
    new, reached = capped(law, free, beyond, deflection)
    return new, formulas.bristle_decay(xp, reached, along_free, v, q, law)
