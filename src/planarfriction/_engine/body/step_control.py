"""Lengths of the steps of adaptive methods, for the motion and for its derivatives."""

from __future__ import annotations

from typing import NamedTuple

from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel


class Pace(NamedTuple):
    """Limits of the next step's length in terms of the last."""

    safety: float
    growth: float
    shrinkage: float


MOTION = Pace(0.8, 2.5, 0.1)
"""Pace of the motion. A decaying transient is followed through all its scales only if the steps do not grow too fast: a
factor of 2.5 needs 8 % fewer steps than 6 for the same error of the in-hand runs."""

DERIVATIVES = Pace(0.85, 2.0, 0.2)
"""Pace of derivatives: cautious, and no faster growth than a transient that is followed needs."""

SHORTEST = 2.0**-12
"""Shortest step of derivatives, as a share of one of the motion."""

_EXACT = 1e-10
"""Error of a step, in units of the tolerance, below which its size does not matter."""


@kernel
def fitted(step: float, remaining: float) -> float:
    """Return a length that is stretched to the end, or halves the rest, so that no sliver of a step remains."""
    return (
        step
        if 2.0 * step <= remaining
        else (remaining if step >= remaining else 0.5 * remaining)
    )


@kernel
def growth(pace: Pace, error: float, order: float, most: float) -> float:
    """Return the factor, at most `most`, between the next step and one with an error in units of the tolerance."""
    ideal = pace.safety * xp.maximum(error, _EXACT) ** (-1.0 / order)
    return xp.minimum(most, xp.maximum(pace.shrinkage, ideal))


@kernel
def judged(pace: float, error: float, h: float, local: float) -> tuple[bool, float]:
    """Return True if a step of derivatives is accepted, and the pace of the next.

    A step shorter than `SHORTEST` is accepted with any error: the Jacobian may jump within it.
    """
    ideal = growth(DERIVATIVES, error, 4.0, DERIVATIVES.growth) * h / local
    if error > 1.0 and h > SHORTEST * local:
        return False, ideal
    return True, xp.maximum(ideal, pace if h < pace * local else SHORTEST)
