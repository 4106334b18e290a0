"""LuGre: bristles that bend, slip and are damped, with Stribeck and viscous terms."""

from __future__ import annotations

from dataclasses import dataclass

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws.base import FrictionLaw


@dataclass(frozen=True)
class ElastoPlastic:
    """Elasto-plastic bristles: purely elastic below breakaway, so that nothing creeps that should stand still.

    Source: Dupont, Hayward, Armstrong, Altpeter 2002.
    """

    breakaway_ratio: float = 0.9
    """s_ba = z_ba / z_max [-]: bristles deflected less than this share of their maximum do not slip."""

    def __post_init__(self) -> None:
        value = validation.number("breakaway_ratio", self.breakaway_ratio)
        if not 0.0 <= value < 1.0:
            raise InvalidValueError("breakaway_ratio", "be in [0, 1)", value)
        object.__setattr__(self, "breakaway_ratio", value)


@dataclass(frozen=True)
class LuGre(FrictionLaw):
    """LuGre friction per unit normal load, with Stribeck and viscous terms.

    `g(v) = mu_c + (mu_s - mu_c) exp(-|v/v_s|^gamma)`, `zdot = v - beta sigma_0 |v| / g z`,
    `f = -(sigma_0 z + sigma_1 zdot + sigma_2 v) f_N`; `beta = 1` unless `elasto_plastic` is given.

    Sources: Canudas de Wit et al. 1995; parameters as in Waltersson and Karayiannidis 2024.
    """

    mu_c: float = 1.0
    """Coulomb coefficient [-]."""
    mu_s: float = 1.2
    """Static (breakaway) coefficient [-], at least `mu_c`."""
    v_s: float = 1e-3
    """Stribeck speed [m/s]."""
    sigma_0: float = 1e6
    """Bristle stiffness per unit normal load [1/m]."""
    sigma_1: float = 8e2
    """Bristle damping per unit normal load [s/m]."""
    sigma_2: float = 0.2
    """Viscous friction per unit normal load [s/m]."""
    gamma: float = 2.0
    """Stribeck exponent [-]."""
    elasto_plastic: ElastoPlastic | None = None
    """Elasto-plastic extension, or None for plain LuGre."""

    def __post_init__(self) -> None:
        for name in ("mu_c", "mu_s", "v_s", "sigma_0", "gamma"):
            object.__setattr__(self, name, validation.positive(name, getattr(self, name)))
        for name in ("sigma_1", "sigma_2"):
            object.__setattr__(self, name, validation.non_negative(name, getattr(self, name)))
        if self.mu_s < self.mu_c:
            raise InvalidValueError("mu_s", "be >= mu_c", f"mu_s={self.mu_s}, mu_c={self.mu_c}")
        if self.elasto_plastic is not None and not isinstance(self.elasto_plastic, ElastoPlastic):
            raise InvalidValueError("elasto_plastic", "be an ElastoPlastic or None", self.elasto_plastic)

    @property
    def numbers(self) -> LawNumbers:
        """The law as the formulas see it."""
        elastic = self.elasto_plastic
        return LawNumbers(
            self.sigma_0,
            self.sigma_1,
            self.sigma_2,
            self.mu_c,
            self.mu_s,
            self.v_s,
            self.gamma,
            0.0 if elastic is None else 1.0,
            0.5 if elastic is None else elastic.breakaway_ratio,  # unused by plain bristles, but 1 - it is divided by
        )
