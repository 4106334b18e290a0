"""Patches, laws and limit surfaces that many tests share."""

from __future__ import annotations

import numpy as np

import planarfriction as pf

PLAIN = pf.LuGre(mu_s=1.2)
ELASTIC = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
WIDE = pf.LuGre(mu_s=1.2, gamma=1.5, elasto_plastic=0.3)
"""Law with a wide elasto-plastic range, smooth at the steps of an order test."""
LAWS = {"plain": PLAIN, "elasto-plastic": ELASTIC, "wide": WIDE}

SURFACES = {
    "cells": pf.LimitSurfaceCells,
    "table": pf.LimitSurfaceTable,
    "published": pf.LimitSurfaceTablePublished,
    "ellipsoid": pf.LimitSurfaceEllipsoid,
}
"""Limit surfaces that models read."""

FOUR = pf.ContactPatch.from_pressure([[0.0, 3.0, 1.0], [2.0, 5.0, 0.0]], 0.005)
"""Four cells without a symmetry."""
FEET = pf.ContactPatch.points(
    [(0.01, 0.03), (0.11, -0.02), (0.05, 0.09)], [1.0, 2.0, 3.0]
)
FINGER = pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
"""Pressure of a fingertip of 6 mm at 1 N."""
SOFT = pf.ContactPatch.disc(0.01, 9, pressure=FINGER)
CELL = 0.02 / 21
"""Width of a cell of published patches [m]."""


def published_finger(**changes):
    """Return the soft finger of the published runs, with changes."""
    return pf.SoftFinger(
        **{"c": 6 * CELL, "n": 1 / 3, "k": 2.0, "radius_max": 0.01, **changes}
    )


X, Y = np.meshgrid(np.arange(-3, 4) * 1e-3, np.arange(3, -4, -1) * 1e-3)
LIGHT = np.maximum(1.0 - ((X - 1e-3) ** 2 + Y**2) / 0.003**2, 0.0)
HEAVY = np.sqrt(np.maximum(1.0 - (X**2 + (Y - 1e-3) ** 2) / 0.0045**2, 0.0))
TIP = pf.ContactPatch.from_pressure({0.5: LIGHT, 4.0: HEAVY}, cell_size=1e-3)
"""Patch that grows, flattens and moves with the load; no cell gets its first load between the two maps."""


def friction_model(kind, law="elasto-plastic", patch=FOUR):
    """Return a model by name: "distributed", or the published one with a kind of limit surface."""
    if kind == "distributed":
        return pf.DistributedModel(patch, LAWS[law])
    return pf.ReducedModelPublished(patch, LAWS[law], surface=SURFACES[kind](patch))


def lengths(model):
    """Return the factors of states over deflections [m]: the third of a published state is a moment."""
    if model.state_shape == (3,):
        return np.array([1.0, 1.0, model.surface.contact_radius])
    return np.ones(1)
