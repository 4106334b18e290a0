"""The load-dependent contacts of the paper and the models of them."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from planarfriction import scenes
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurfaceTablePublished
from planarfriction.models import DistributedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch, SoftFinger
from planarfriction.scenes import Scene
from planarfriction.scenes.ready import IN_HAND_LOADS
from planarfriction_studies.experiments.runs import LAW

WIDTH = 0.02
"""Width of the grid [m]."""

CELLS = 21
"""Rows and columns of the published grid."""

RADIUS_AT_1_N = 6.0 * WIDTH / CELLS
"""Contact radius at 1 N [m]: six cells; it grows with the cube root of the load up to half the width."""

LARGEST_CONTACT = 6.0
"""A load at which the contact has its largest radius [N]: the published table is made there."""

MEAN_LOAD = IN_HAND_LOADS[1, 1][0]
"""Mean load of the run [N]."""

PRESSURES = {1: "k = 2", 2: "k = 2 f_N"}
"""Pressure law of the paper -> its exponent (per newton where the load stands in it)."""

DISTRIBUTED, REBUILT, RESCALED = "distributed", "reduced, rebuilt", "reduced, rescaled"
KEPT, KEPT_LARGEST = "reduced, kept (mean load)", "reduced, kept (largest contact)"

VARIANTS: dict[str, tuple[Literal["rebuild", "rescale", "keep"] | None, float | None]] = {
    DISTRIBUTED: (None, None),
    REBUILT: ("rebuild", None),
    RESCALED: ("rescale", LARGEST_CONTACT),
    KEPT: ("keep", MEAN_LOAD),
    KEPT_LARGEST: ("keep", LARGEST_CONTACT),
}
"""Variant -> what its reduced model does as the load changes, and the load at which its table is made [N]."""


def finger(pressure: int) -> SoftFinger:
    """Return the soft finger of a pressure law of the paper."""
    exponent: dict[str, float] = {"k": 2.0} if pressure == 1 else {"k_per_newton": 2.0}
    return SoftFinger(c=RADIUS_AT_1_N, n=1.0 / 3.0, radius_max=0.5 * WIDTH, **exponent)


def soft_patch(pressure: int, *, cells: int = CELLS) -> ContactPatch:
    """Return the square grid under a soft finger."""
    return ContactPatch.rectangle(WIDTH, cells=cells, pressure=finger(pressure))


def profile_moment(k: float, power: int) -> float:
    """Return `int_0^1 s^power (1 - s^k)^(1/k) ds = B((power + 1)/k, 1 + 1/k)/k`."""
    a, b = (power + 1.0) / k, 1.0 + 1.0 / k
    return math.exp(math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)) / k


def round_moments(pressure: int, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the contact radius r [m] and <rho^2> [m^2] of the round contact without a grid, in closed form."""
    law = finger(pressure)
    radius = law.radius(loads)
    first, second = (
        np.array([profile_moment(k, power) / profile_moment(k, 1) for k in law.exponent(loads).tolist()])
        for power in (2, 3)
    )
    return first * radius, second * radius**2


def soft_scene(pressure: int, variant: str, law: LuGre = LAW) -> Scene:
    """Return the in-hand scene under load 1, with a model that has computed nothing yet."""
    on_load_change, load = VARIANTS[variant]
    patch = soft_patch(pressure)
    if on_load_change is None:
        return scenes.in_hand(DistributedModel(patch, law))
    surface = LimitSurfaceTablePublished(patch, normal_force=load)
    return scenes.in_hand(ReducedModelPublished(patch, law, surface=surface, on_load_change=on_load_change))
