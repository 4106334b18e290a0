"""Patches of a case: their friction models, and small spheres below their corners for engines with one point a pair."""

from __future__ import annotations

import math

import numpy as np

from planarfriction.laws import LuGre
from planarfriction.models import DistributedModel, FrictionModel, ReducedModel
from planarfriction.patch import ContactPatch, friction_metric
from planarfriction_studies.referee.case import Case, Contact, Shape

SIGMA_0 = 1e6
"""Stiffness of bristles [1/m]: contacts slip from `mu/sigma_0` on, less than a micrometre."""

SIGMA_1 = 800.0
"""Damping of bristles [s/m], which sliding at a constant velocity does not see."""

MODELS = {"reduced": ReducedModel, "distributed": DistributedModel}


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
        mu_c=along,
        mu_s=mu_s,
        v_s=contact.v_s,
        sigma_0=SIGMA_0,
        sigma_1=SIGMA_1,
        sigma_2=0.0,
        elasto_plastic=0.9,
    )
    return MODELS[kind](patch, law)


ROUND = ("capsule", "sphere")
"""Shapes that touch in a line or in a point: they need no spheres."""

RADIUS = 1e-3
"""Radius of the spheres [m]."""

SHRUNK = 5e-4
"""Distance from the faces of a shape with spheres to those of its solid along z: the spheres touch first [m]."""

_RIM = 8
"""Number of spheres of a disc."""


def feet(case: Case, shape: Shape) -> np.ndarray:
    """Return the middles `[n, 3]` in the body of spheres of the patches that a shape has; none for what is round."""
    points = []
    for contact in case.contacts if shape.kind not in ROUND else ():
        if contact.pair[1] != shape.name:
            continue
        if len(contact.patch) == 1:
            angles = 2.0 * math.pi * np.arange(_RIM) / _RIM
            around = (contact.patch[0] - RADIUS) * np.stack(
                [np.cos(angles), np.sin(angles)], axis=1
            )
        else:
            around = np.maximum(0.5 * np.array(contact.patch) - RADIUS, 0.0) * [
                (-1, -1),
                (1, -1),
                (1, 1),
                (-1, 1),
            ]
        inside = math.copysign(RADIUS, shape.position[2] - contact.at[2])
        lifted = np.column_stack([around, np.full(len(around), inside)])
        points.append(np.array(contact.at) + lifted)
    return np.concatenate(points) if points else np.zeros((0, 3))
