"""Friction models of the patches of a case, for the engines with this library's friction."""

from __future__ import annotations

from functools import partial

from planarfriction.laws import LuGre
from planarfriction.models import DistributedModel, FrictionModel, ReducedModel
from planarfriction.patch import ContactPatch, friction_metric
from planarfriction_studies.referee.case import Contact

SIGMA_0 = 1e6
"""Stiffness of bristles [1/m]: contacts slip from `mu/sigma_0` on, less than a micrometre."""

SIGMA_1 = 800.0
"""Damping of bristles [s/m], which sliding at a constant velocity does not see."""

MODELS = {"reduced": ReducedModel, "one part": partial(ReducedModel, parts=1), "distributed": DistributedModel}


def model(contact: Contact, kind: str) -> FrictionModel:
    """Return the friction of a contact by a model: nearly dry friction, elasto-plastic, on 21 cells across."""
    patch = (
        ContactPatch.disc(contact.patch[0], cells=21)
        if len(contact.patch) == 1
        else ContactPatch.rectangle(*contact.patch, cells=21)
    )
    along, across = contact.mu
    if along != across:
        patch = patch.with_friction_metric(friction_metric(0.0, 1.0, across / along))
    mu_s = along if contact.mu_s is None else contact.mu_s
    law = LuGre(
        mu_c=along, mu_s=mu_s, v_s=contact.v_s, sigma_0=SIGMA_0, sigma_1=SIGMA_1, sigma_2=0.0, elasto_plastic=0.9
    )
    return MODELS[kind](patch, law)
