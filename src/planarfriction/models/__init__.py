"""Friction models of a contact patch: parameters, and pure functions of (state, twist, load)."""

from planarfriction._engine.records import PackedModel, StepJacobians
from planarfriction.families import MODELS
from planarfriction.models.base import FrictionModel, ModelJacobians
from planarfriction.models.distributed import DistributedModel
from planarfriction.models.reduced import ReducedModel
from planarfriction.models.reduced_published import ReducedModelPublished

__all__ = [
    "MODELS",
    "DistributedModel",
    "FrictionModel",
    "ModelJacobians",
    "PackedModel",
    "ReducedModel",
    "ReducedModelPublished",
    "StepJacobians",
    "register",
]

register = MODELS.register
__dir__ = __all__.copy
