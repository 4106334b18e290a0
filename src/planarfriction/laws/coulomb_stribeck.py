"""Regularised Coulomb friction with Stribeck effect: friction follows a curve over speed within a relaxation time."""

from __future__ import annotations

from dataclasses import dataclass

from planarfriction._support import validation
from planarfriction._support.equality import checked
from planarfriction.formulas import LawNumbers
from planarfriction.laws.base import FrictionLaw


@dataclass(frozen=True)
class CoulombStribeck(FrictionLaw):
    """Coulomb friction with Stribeck and viscous terms, regularised by a creep speed.

    In steady sliding, with `g(v) = mu_c + (mu_s - mu_c) exp(-|v/v_s|^gamma)`,

        f = -(g(v) v/(|v| + v_c) + sigma_2 v) f_N,

    and the first part p of f follows a change of the speed by `pdot = -((|v| + v_c) p / g(v) + v f_N) mu_s/(v_c tau)`:
    at rest it decays as `exp(-t/tau)`. A contact under a constant force `F < mu_s f_N` therefore does not stay at rest
    but creeps; without Stribeck and viscous terms its speed is `v = v_c F/(mu_c f_N - F)`. The smaller `creep_speed`,
    the closer to Coulomb; the shorter `relaxation_time`, the closer to a function of the speed alone. For a contact
    that must stick, use `LuGre` with `elasto_plastic`.

    Raises InvalidValueError for a parameter outside its range, and for `mu_s` below `mu_c`.

    Sources: Stribeck 1902; the curve as in Armstrong-Helouvry, Dupont, Canudas de Wit 1994, table 1; of the limit `tau
    -> 0`, the regularisation `v/(|v| + v_c)`.
    """

    mu_c: float = checked(validation.positive, default=1.0)
    """Coulomb coefficient [-]."""
    mu_s: float = checked(validation.positive, default=None)
    """Static coefficient [-], at least `mu_c`; equal to `mu_c` by default."""
    v_s: float = checked(validation.positive, default=1e-3)
    """Stribeck speed [m/s]."""
    gamma: float = checked(validation.positive, default=2.0)
    """Stribeck exponent [-]."""
    sigma_2: float = checked(validation.non_negative, default=0.0)
    """Viscous friction per unit normal load [s/m]."""
    creep_speed: float = checked(validation.positive, default=1e-5)
    """v_c [m/s]: speed at which friction is half of that in fast sliding."""
    relaxation_time: float = checked(validation.positive, default=1e-2)
    """tau [s]: time in which the force at rest decays to 1/e."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._settle_static()

    @property
    def numbers(self) -> LawNumbers:
        """The numbers for the formulas: those of plain bristles with `sigma_0 = mu_s/(v_c tau)` that relax."""
        sigma_0 = self.mu_s / (self.creep_speed * self.relaxation_time)
        creep_speed = self.creep_speed
        curve = self.mu_c, self.mu_s, self.v_s, self.gamma
        return LawNumbers(sigma_0, 0.0, self.sigma_2, *curve, creep_speed=creep_speed)
