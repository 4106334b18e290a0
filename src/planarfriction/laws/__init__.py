"""Friction laws: frozen parameters with validation (the equations are in `planarfriction.formulas`)."""

from typing import TYPE_CHECKING

import lazy_loader

from planarfriction.families import LAWS
from planarfriction.laws.base import FrictionLaw
from planarfriction.laws.coulomb import Coulomb
from planarfriction.laws.coulomb_stribeck import CoulombStribeck
from planarfriction.laws.dahl import Dahl
from planarfriction.laws.lugre import ElastoPlastic, LuGre

if TYPE_CHECKING:
    from planarfriction.laws.rate_law import RateLaw

__all__ = [
    "LAWS",
    "Coulomb",
    "CoulombStribeck",
    "Dahl",
    "ElastoPlastic",
    "FrictionLaw",
    "LuGre",
    "RateLaw",
    "register",
]

register = LAWS.register

# it brings the compiler with it, which laws of numbers do not need
__getattr__, _, _ = lazy_loader.attach(__name__, submod_attrs={"rate_law": ["RateLaw"]})
__dir__ = __all__.copy
