"""Friction laws as compiled loops see them."""

from __future__ import annotations

from typing import Any

from planarfriction import formulas
from planarfriction._engine.codegen.vectors import Vector, plus, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import reader
from planarfriction.formulas import LawNumbers

LAW = len(LawNumbers._fields)
"""Numbers of a law, with which the row of a contact begins."""

PARAMETERS = (
    "sigma_0",
    "sigma_1",
    "sigma_2",
    "mu_c",
    "mu_s",
    "v_s",
    "gamma",
    "breakaway_ratio",
)
"""Numbers of a law that derivatives are taken by."""

law_of = reader(LawNumbers)
"""Read a law from the beginning of a row."""


@kernel
def squared(law: LawNumbers) -> LawNumbers:
    """Return a law with the exponent 2 as a constant: the compiler then drops the general power from a loop."""
    return LawNumbers(*law[:6], 2.0, *law[7:])


@kernel
def inverse_deflection(law: LawNumbers, speed: float) -> float:
    """Return `sigma_0/g(v)` [1/m]: one over the steady deflection of a bristle."""
    return law.sigma_0 / formulas.stribeck(xp, speed, law)


@kernel
def traction(law: Any, z: Vector, rate: Vector, u: Vector) -> Vector:
    """Return `-(sigma_0 z + sigma_1 z' + sigma_2 u)` of a bristle of any dimension."""
    return plus(plus(times(-law.sigma_0, z), -law.sigma_1, rate), -law.sigma_2, u)
