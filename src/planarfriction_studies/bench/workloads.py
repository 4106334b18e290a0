"""Workloads of several benchmarks: the published law and disc, and twists of all speeds."""

from __future__ import annotations

import numpy as np

from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch

AGAINST_PUBLISHED = "the same of ReducedModelPublished"
"""The baseline of what `ReducedModel` is measured with, in words."""


def law() -> LuGre:
    """Return the published friction parameters."""
    return LuGre(mu_s=1.2, elasto_plastic=ElastoPlastic(0.9))


def disc(cells: int = 21) -> ContactPatch:
    """Return the published disc."""
    return PUBLISHED_PATCHES["Circle"](cells=cells)


def mixed_twists(count: int) -> np.ndarray:
    """Return twists that slide and spin at all speeds around the Stribeck speed, in random directions."""
    generator = np.random.default_rng(7)
    directions = generator.normal(size=(count, 3)) * [1.0, 1.0, 150.0]
    return directions * 10.0 ** generator.uniform(-4.0, -1.5, size=(count, 1))
