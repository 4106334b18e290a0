"""Laws of bristles that bend and slip: LuGre, and Dahl and regularised Coulomb friction as cases of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from planarfriction import validation
from planarfriction.described import described
from planarfriction.equality import Checked, checked
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws.base import FrictionLaw


def _below_one(name: str, value: Any) -> float:
    """Return `value` as a number in [0, 1), or raise."""
    value = validation.number(name, value)
    if not 0.0 <= value < 1.0:
        raise InvalidValueError(name, "be in [0, 1)", value)
    return value


@described
@dataclass(frozen=True)
class ElastoPlastic(Checked):
    """Elasto-plastic bristles: purely elastic below breakaway, so that a sticking contact does not creep.

    Raises InvalidValueError for a `breakaway_ratio` outside [0, 1).

    Source: Dupont, Hayward, Armstrong, Altpeter 2002.
    """

    breakaway_ratio: float = checked(_below_one, default=0.9)
    """s_ba = z_ba / z_max [-]: bristles deflected less than this share of their maximum do not slip."""


def _elasto_plastic(name: str, value: Any) -> ElastoPlastic:
    """Return the extension that was given as itself, as its breakaway ratio or as the table that holds it; or raise."""
    if isinstance(value, ElastoPlastic):
        return value
    if isinstance(value, Mapping):
        validation.keys(name, value, ["breakaway_ratio"])
        return ElastoPlastic(value["breakaway_ratio"])
    if validation.why_not_numeric(value) is not None:
        raise InvalidValueError(name, "be a breakaway ratio, an ElastoPlastic, or None", value)
    return ElastoPlastic(_below_one(name, value))


@described
@dataclass(frozen=True)
class LuGre(FrictionLaw):
    """LuGre friction per unit normal load, with Stribeck and viscous terms.

    `g(v) = mu_c + (mu_s - mu_c) exp(-|v/v_s|^gamma)`, `zdot = v - beta sigma_0 |v| / g z`,
    `f = -(sigma_0 z + sigma_1 zdot + sigma_2 v) f_N`; `beta = 1` unless `elasto_plastic` is given.

    Raises InvalidValueError for a parameter outside its range, and for `mu_s` below `mu_c`.

    Sources: Canudas de Wit et al. 1995; parameters as in Waltersson and Karayiannidis 2024.
    """

    mu_c: float = checked(validation.positive, default=1.0)
    """Coulomb coefficient [-]."""
    mu_s: float = checked(validation.positive, default=None)
    """Static (breakaway) coefficient [-], at least `mu_c`; equal to `mu_c` by default."""
    v_s: float = checked(validation.positive, default=1e-3)
    """Stribeck speed [m/s]."""
    sigma_0: float = checked(validation.positive, default=1e6)
    """Bristle stiffness per unit normal load [1/m]."""
    sigma_1: float = checked(validation.non_negative, default=8e2)
    """Bristle damping per unit normal load [s/m]."""
    sigma_2: float = checked(validation.non_negative, default=0.2)
    """Viscous friction per unit normal load [s/m]."""
    gamma: float = checked(validation.positive, default=2.0)
    """Stribeck exponent [-]."""
    elasto_plastic: ElastoPlastic | float | None = checked(_elasto_plastic, default=None)
    """Elasto-plastic extension, None for plain LuGre; a number is the breakaway ratio [-] of `ElastoPlastic`: bristles
    deflected less than this share of their maximum do not slip."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mu_s is None:
            self._set(mu_s=self.mu_c)
        if self.mu_s < self.mu_c:
            raise InvalidValueError("mu_s", "be >= mu_c", f"mu_s={self.mu_s}, mu_c={self.mu_c}")

    @property
    def numbers(self) -> LawNumbers:
        """The numbers that the law puts into the formulas."""
        plain = LawNumbers(self.sigma_0, self.sigma_1, self.sigma_2, self.mu_c, self.mu_s, self.v_s, self.gamma)
        if not isinstance(self.elasto_plastic, ElastoPlastic):
            return plain
        return plain._replace(elasto_plastic=1.0, breakaway_ratio=self.elasto_plastic.breakaway_ratio)


_SPEED = 1e-3
"""Speed [m/s] that solvers measure errors against; Dahl friction does not depend on the speed."""


@described
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
        """The numbers that the law puts into the formulas."""
        return LawNumbers(
            sigma_0=self.sigma_0, sigma_1=0.0, sigma_2=0.0, mu_c=self.mu_c, mu_s=self.mu_c, v_s=_SPEED, gamma=2.0
        )


@described
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
        if self.mu_s is None:
            self._set(mu_s=self.mu_c)
        if self.mu_s < self.mu_c:
            raise InvalidValueError("mu_s", "be >= mu_c", f"mu_s={self.mu_s}, mu_c={self.mu_c}")

    @property
    def numbers(self) -> LawNumbers:
        """The numbers for the formulas: those of plain bristles with `sigma_0 = mu_s/(v_c tau)` that relax."""
        return LawNumbers(
            sigma_0=self.mu_s / (self.creep_speed * self.relaxation_time),
            sigma_1=0.0,
            sigma_2=self.sigma_2,
            mu_c=self.mu_c,
            mu_s=self.mu_s,
            v_s=self.v_s,
            gamma=self.gamma,
            creep_speed=self.creep_speed,
        )
