"""Shares of the load of cells whose pressure follows the load, at rungs between which source code interpolates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.models.few_cells import loads_of_change
from planarfriction.patch import ContactPatch

ERROR = 2e-3
"""Largest share of the load that stands on other cells than it should, halfway between two rungs [-]."""

MOST_RUNGS = 512


class Ladder(NamedTuple):
    """Shares of the load at some loads, linear in the load between them and constant beyond."""

    rungs: np.ndarray
    """Loads [L] [N]."""
    shares: np.ndarray
    """Shares of the cells [L, N]."""


def ladder_of(patch: ContactPatch) -> Ladder:
    """Return rungs so close that shares between them err by `ERROR` at most.

    Raises InvalidValueError if more than `MOST_RUNGS` are needed.
    """
    rungs = np.union1d(loads_of_change(patch), getattr(patch.pressure, "loads", ()))
    while True:
        shares, between = patch.weights(rungs), 0.5 * (rungs[1:] + rungs[:-1])
        off = 0.5 * np.abs(patch.weights(between) - 0.5 * (shares[1:] + shares[:-1])).sum(axis=1)
        if not (off > ERROR).any():
            return Ladder(rungs, shares)
        rungs = np.union1d(rungs, between[off > ERROR])
        if len(rungs) > MOST_RUNGS:
            rule = f"have a patch whose shape {MOST_RUNGS} loads describe within {ERROR:g}"
            raise InvalidValueError("model", rule, patch.name or "a patch")
