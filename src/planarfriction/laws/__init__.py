"""Friction laws: frozen parameters with validation (the equations are in `planarfriction.formulas`)."""

from planarfriction.families import LAWS
from planarfriction.laws.base import FrictionLaw
from planarfriction.laws.coulomb import Coulomb
from planarfriction.laws.coulomb_stribeck import CoulombStribeck
from planarfriction.laws.dahl import Dahl
from planarfriction.laws.lugre import ElastoPlastic, LuGre

__all__ = [
    "LAWS",
    "Coulomb",
    "CoulombStribeck",
    "Dahl",
    "ElastoPlastic",
    "FrictionLaw",
    "LuGre",
    "register",
]

register = LAWS.register


def __dir__() -> list[str]:
    return sorted(__all__)
