"""Pressure that follows the moments of the load (the rule: `cells.moment_pressure`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError


def moments_of(value: Any) -> np.ndarray:
    """Return moments `[..., 2]` [N m], checked."""
    moments = validation.vectors("moments", value, 2)
    validation.within_range(
        "moments", moments.min(initial=0.0), moments.max(initial=0.0)
    )
    return moments


def centre_of(moments: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return the centre of pressure `(-m_y, m_x)/f_N` `[..., 2]` [m]; 0 without load."""
    # Compiled code, which a patch alone does not need.
    from planarfriction._engine.cells.moment_pressure import REACH

    loaded = (load > 0.0)[..., None]
    with np.errstate(over="ignore"):
        centre = (
            moments[..., ::-1] * [-1.0, 1.0] / np.where(loaded, load[..., None], 1.0)
        )
    return np.where(loaded, np.clip(centre, -REACH, REACH), 0.0)


def weights_under(patch: Any, normal_force: Any, moments: Any) -> np.ndarray:
    """Return the weights `[..., N]` of the cells of a patch under a load and its moments."""
    from planarfriction._engine.cells.moment_pressure import tilted

    if normal_force is None:
        raise InvalidValueError(
            "normal_force", "be given with moments: they are of its size", "None"
        )
    load = validation.non_negative_numbers("normal_force", normal_force)
    moments = moments_of(moments)
    shapes = load.shape, moments.shape[:-1]
    batch = validation.common_shape("moments", shapes, "broadcast with normal_force")
    if math.prod(batch) * patch.cells > validation.MOST_NUMBERS:
        rule = f"be at most {validation.MOST_NUMBERS // patch.cells} pairs for {patch.cells} cells"
        raise InvalidValueError("moments", rule, math.prod(batch))
    weights, centre, loaded = (
        np.broadcast_to(each, (*batch, each.shape[-1])).reshape(-1, each.shape[-1])
        for each in (
            patch.weights(load),
            centre_of(moments, load),
            load[..., None] > 0.0,
        )
    )
    found = np.where(loaded, tilted(patch.positions, weights, centre), weights)
    return found.reshape(*batch, patch.cells)
