"""Cells whose friction forwards and backwards is not the same: bristles that decay towards `c = a g(|u|)/sigma_0`.

At a constant twist c is constant, so `z - c` moves as the bristle of a cell without asymmetry, whose traction less
`sigma_0 c` is the traction (docs/anisotropy.md, "Asymmetric friction"). The speed of a disc is its mean; spin does not
lean.
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import discs, points, settle
from planarfriction.kernels.vectors import Vector, norm, plus, times


class Leaning(NamedTuple):
    """A law, and the asymmetry a of a cell."""

    law: LawNumbers
    a: Vector


@kernel
def _centre(lean: Leaning, u: Vector) -> Vector:
    """Compute c of a point."""
    return times(formulas.stribeck(xp, norm(u), lean.law) / lean.law.sigma_0, lean.a)


@kernel
def _disc_centre(lean: Leaning, u: Vector) -> Vector:
    """Compute c of a disc."""
    size = formulas.stribeck(xp, discs.mean_speed(u), lean.law) / lean.law.sigma_0
    return size * lean.a[0], size * lean.a[1], 0.0


@kernel
def middle(lean: Leaning) -> Vector:
    """Compute c of a point at rest, the middle of the limit of its bristle (see `settle`)."""
    return times(lean.law.mu_s / lean.law.sigma_0, lean.a)


@kernel
def middle_of_disc(lean: Leaning) -> Vector:
    """Compute c of a disc at rest."""
    size = lean.law.mu_s / lean.law.sigma_0
    return size * lean.a[0], size * lean.a[1], 0.0


@kernel
def within(lean: Leaning, z: Vector) -> Vector:
    """Compute `settle.within` of a point."""
    c = middle(lean)
    return plus(settle.within(lean.law, plus(z, -1.0, c)), 1.0, c)


@kernel
def within_disc(lean: Leaning, z: Vector) -> Vector:
    """Compute `settle.within` of a disc."""
    c = middle_of_disc(lean)
    return plus(settle.within(lean.law, plus(z, -1.0, c)), 1.0, c)


@kernel
def evaluate(lean: Leaning, z: Vector, u: Vector) -> tuple[Vector, Vector]:
    """Compute z' and the traction of a point that moves at u."""
    c = _centre(lean, u)
    rate, pull = points.evaluate(lean.law, plus(z, -1.0, c), u)
    return rate, plus(pull, -lean.law.sigma_0, c)


@kernel
def step(lean: Leaning, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
    """Compute the bristle after dt and the traction of a point that moves at u."""
    c = _centre(lean, u)
    new, pull = points.step(lean.law, plus(z, -1.0, c), u, dt)
    return plus(new, 1.0, c), plus(pull, -lean.law.sigma_0, c)


@kernel
def evaluate_disc(lean: Leaning, z: Vector, u: Vector) -> tuple[Vector, Vector]:
    """Compute z' and the traction of a disc that moves at u."""
    c = _disc_centre(lean, u)
    rate, pull = discs.evaluate(lean.law, plus(z, -1.0, c), u)
    return rate, plus(pull, -lean.law.sigma_0, c)


@kernel
def step_disc(lean: Leaning, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
    """Compute the bristle after dt and the traction of a disc that moves at u."""
    c = _disc_centre(lean, u)
    new, pull = discs.step(lean.law, plus(z, -1.0, c), u, dt)
    return plus(new, 1.0, c), plus(pull, -lean.law.sigma_0, c)
