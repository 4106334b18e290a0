"""`ReducedModel` on a soft finger whose pressure flattens with the load, beside one that is rebuilt at every load."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction import scenes
from planarfriction.models import ReducedModel
from planarfriction_studies.experiments.load_dependent.models import soft_patch
from planarfriction_studies.experiments.runs import LAW

TIME, QUICK_TIME = 2.0, 0.05
"""End of the in-hand run with the soft finger [s]: the load changes every 0.01 s."""

LOADS = (0.83, 1.37)
"""Loads at which steady wrenches from blended maps are compared with those of maps built at the load [N]."""


def load_family(quick: bool) -> dict[str, float]:
    """Compute the number of maps that the model builds in the in-hand run (k = 2 f_N), and the error of blending them.

    That is the largest distance of steady wrenches at 1 N [N, N m] from a model that builds a map at every load (at
    few loads, for it is slow).
    """
    patch, t_end = soft_patch(2), QUICK_TIME if quick else TIME
    model, rebuilt = ReducedModel(patch, LAW), ReducedModel(patch, LAW, load_error=0.0)
    scenes.simulate(scenes.in_hand(model), t_end=t_end)
    maps = len(model.load_rungs)
    apart = np.array([_steady_apart(model, rebuilt, load) for load in LOADS]).max(axis=0)
    return {
        "maps": maps,
        "end [s]": t_end,
        "force from rebuilding [N]": float(apart[:2].max()),
        "torque from rebuilding [N m]": float(apart[2]),
    }


def _steady_apart(model: Any, rebuilt: Any, load: float) -> np.ndarray:
    """Return the largest difference `[3]` of steady wrenches at 1 N between two models at a load [N]."""
    generator = np.random.default_rng(3)
    twists = generator.normal(size=(200, 3)) * [1.0, 1.0, 150.0] * 10.0 ** generator.uniform(-4.0, -1.5, (200, 1))
    wrenches = [each.step(np.zeros((200, 3)), twists, load, 10.0)[1] for each in (model, rebuilt)]
    return np.abs(wrenches[0] - wrenches[1]).max(axis=0) / load
