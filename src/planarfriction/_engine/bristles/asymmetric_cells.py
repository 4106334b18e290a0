"""Cells whose friction forwards and backwards is not the same: bristles that decay towards `c = a g(|u|)/sigma_0`.

At a constant twist c is constant, so `z - c` moves as the bristle of a cell without asymmetry, whose traction less
`sigma_0 c` is the traction (docs/physics.md, "Direction-dependent friction"). The speed of a disc is its mean; spin
does not lean.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction._engine.bristles import discs, points
from planarfriction._engine.codegen.vectors import Vector, norm, plus, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers


class Leaning(NamedTuple):
    """A law, and the asymmetry a of a cell."""

    law: LawNumbers
    a: Vector


@kernel
def _in_plane(size: float, a: Vector) -> Vector:
    return size * a[0], size * a[1], 0.0


def _leaning(plain: Any, speed: Any, scaled: Any) -> tuple:
    """Return functions of a bristle from those of a `plain` one, from its `speed(u)`, and from `scaled(size, a)`."""
    rate_of = plain.evaluate
    step_of = plain.step

    @kernel
    def centre(lean: Leaning, u: Vector) -> Vector:
        return scaled(
            formulas.stribeck(xp, speed(u), lean.law) / lean.law.sigma_0, lean.a
        )

    @kernel
    def evaluate(lean: Leaning, z: Vector, u: Vector) -> tuple[Vector, Vector]:
        """Compute z' and the traction of a bristle that moves at u."""
        c = centre(lean, u)
        rate, pull = rate_of(lean.law, plus(z, -1.0, c), u)
        return rate, plus(pull, -lean.law.sigma_0, c)

    @kernel
    def step(lean: Leaning, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
        """Compute the bristle after dt and its traction."""
        c = centre(lean, u)
        new, pull = step_of(lean.law, plus(z, -1.0, c), u, dt)
        return plus(new, 1.0, c), plus(pull, -lean.law.sigma_0, c)

    return evaluate, step


evaluate, step = _leaning(points, norm, times)
evaluate_disc, step_disc = _leaning(discs, discs.mean_speed, _in_plane)
