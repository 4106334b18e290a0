"""Dahl: bristles that bend and slip, the oldest law with pre-sliding."""

from __future__ import annotations

from dataclasses import dataclass

from planarfriction._support import validation
from planarfriction._support.equality import checked
from planarfriction.formulas import LawNumbers
from planarfriction.laws.base import FrictionLaw

_SPEED = 1e-3
"""Speed [m/s] that solvers measure errors against; Dahl friction does not depend on the speed."""


@dataclass(frozen=True)
class Dahl(FrictionLaw):
    """Dahl friction per unit normal load: LuGre without Stribeck effect, damping and viscous friction.

    `zdot = v - sigma_0 |v| / mu_c z`, `f = -sigma_0 z f_N`: the force depends on the distance and not on the speed.
    From rest, sliding by x in one direction gives `f = -mu_c f_N (1 - exp(-sigma_0 x / mu_c))`.

    Raises InvalidValueError for a parameter that is not > 0.

    Sources: Dahl 1968, "A solid friction model"; Dahl 1976, "Solid friction damping of mechanical vibrations".
    """

    mu_c: float = checked(validation.positive, default=1.0)
    """Coulomb coefficient [-]."""
    sigma_0: float = checked(validation.positive, default=1e6)
    """Bristle stiffness per unit normal load [1/m]."""

    @property
    def numbers(self) -> LawNumbers:
        return LawNumbers(
            self.sigma_0,
            0.0,
            0.0,
            mu_c=self.mu_c,
            mu_s=self.mu_c,
            v_s=_SPEED,
            gamma=2.0,
        )
