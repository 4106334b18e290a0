"""Wrenches of a roll-out and their derivatives with respect to the model's parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

PARAMETERS = (
    "sigma_0",
    "sigma_1",
    "sigma_2",
    "mu_c",
    "mu_s",
    "v_s",
    "gamma",
    "breakaway_ratio",
    "contact_radius",
    "second_moment",
    "centre_x",
    "centre_y",
)


def wrenches(model: Any, twists, loads, dt: float, vector) -> np.ndarray:
    """Wrenches `[T, 3]` at the ends of steps of `dt` with held twists `[T, 3]` and loads `[T]`, from rest bristles."""
    from planarfriction.kernels import reduced as kernels

    numbers = model._reference.surface.numbers
    elastic = model.law.elasto_plastic is not None
    law = np.array([*vector[:7], 1.0 if elastic else 0.0, vector[7]])
    shape = np.array([vector[10], vector[11], vector[8], vector[9]])
    out = np.empty((len(twists), 3))
    kernels.step_sequence(
        law, shape, np.array([numbers.kind, 0, numbers.size]), numbers.data, np.zeros(3), twists, 1.0, dt, out
    )
    return loads[:, None] * out


def sensitivities(model: Any, twists, loads, dt: float, vector, names: Sequence[str]):
    """Those wrenches and their derivatives `[T, 3, len(names)]` with respect to the parameters `names`."""
    slopes = np.empty((len(twists), 3, len(names)))
    for i, name in enumerate(names):
        row, change = PARAMETERS.index(name), np.zeros(len(PARAMETERS))
        change[row] = 1e-6 * (abs(vector[row]) if vector[row] != 0.0 else 1e-3)
        high, low = (wrenches(model, twists, loads, dt, vector + s * change) for s in (1.0, -1.0))
        slopes[:, :, i] = (high - low) / (2.0 * change[row])
    return wrenches(model, twists, loads, dt, vector), slopes
