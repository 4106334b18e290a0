"""Patches with direction-dependent friction for the tests of it."""

from __future__ import annotations

import numpy as np

import planarfriction as pf

STRIBECK = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
PLAIN = pf.ContactPatch.rectangle(
    0.02, 0.01, (4, 3), pressure=lambda x, y: 1.0 + 20.0 * x + 30.0 * y
)
GRAIN, LEAN = pf.friction_metric(0.4, 1.3, 0.6), np.array([0.3, -0.2])
_RANDOM = np.random.default_rng(5)
GRAINS = np.array(
    [
        pf.friction_metric(a, b, c)
        for a, b, c in _RANDOM.uniform(0.5, 1.5, (PLAIN.cells, 3)) * [2.0, 1.0, 1.0]
    ]
)
LEANS = _RANDOM.uniform(-0.5, 0.5, (PLAIN.cells, 2))
PATCHES = {
    "metric": PLAIN.with_friction_metric(GRAIN),
    "asymmetry": PLAIN.with_friction_metric(None, LEAN),
    "both": PLAIN.with_friction_metric(GRAIN, LEAN),
    "cell metrics": PLAIN.with_friction_metric(GRAINS),
    "cells": PLAIN.with_friction_metric(GRAINS, LEANS),
}
TWIST = np.array([1e-3, -5e-4, 0.1])


def reduced(patch: pf.ContactPatch, law=STRIBECK):
    """The reduced model with a limit surface that takes metrics."""
    return pf.ReducedModelPublished(patch, law, surface=pf.LimitSurfaceTable(patch))
