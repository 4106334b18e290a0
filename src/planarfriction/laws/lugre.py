"""LuGre: bristles that bend, slip and are damped, with Stribeck and viscous terms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws.base import FrictionLaw


def _below_one(name: str, value: Any) -> float:
    """Return `value` as a number in [0, 1), or raise."""
    value = validation.number(name, value)
    if not 0.0 <= value < 1.0:
        raise InvalidValueError(name, "be in [0, 1)", value)
    return value


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
        raise InvalidValueError(
            name, "be a breakaway ratio, an ElastoPlastic, or None", value
        )
    return ElastoPlastic(_below_one(name, value))


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
    elasto_plastic: ElastoPlastic | float | None = checked(
        _elasto_plastic, default=None
    )
    """Elasto-plastic extension, None for plain LuGre; a number is the breakaway ratio [-] of `ElastoPlastic`: bristles
    deflected less than this share of their maximum do not slip."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._settle_static()

    @property
    def numbers(self) -> LawNumbers:
        plain = LawNumbers(
            self.sigma_0,
            self.sigma_1,
            self.sigma_2,
            self.mu_c,
            self.mu_s,
            self.v_s,
            self.gamma,
        )
        if not isinstance(self.elasto_plastic, ElastoPlastic):
            return plain
        return plain._replace(
            elasto_plastic=1.0, breakaway_ratio=self.elasto_plastic.breakaway_ratio
        )
