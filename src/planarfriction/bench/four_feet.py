"""A box on four feet that slides and turns: what a coupled step costs (`planarfriction bench`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction.coupling import CoupledPatches, CoupledStep, HostStep

FEET = ((0.05, 0.03), (0.05, -0.03), (-0.05, 0.03), (-0.05, -0.03))


def four_feet(model: Any, environments: int, dt: float = 1e-3) -> Callable[[], CoupledStep]:
    """An implicit step of boxes of 0.2 kg with random velocities, one for each environment, from bristles at rest."""
    rows = np.concatenate([[[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]] for x, y in FEET])
    response, patches = dt * rows @ np.diag([5.0, 5.0, 5e3]) @ rows.T, CoupledPatches([model] * 4)
    velocity = np.random.default_rng(7).normal(size=(environments, 3)) * [0.05, 0.05, 0.5]
    host = HostStep((velocity @ rows.T).reshape(-1, 4, 3), np.full(4, 0.5), np.zeros((4, 3)), response)
    return lambda: patches.step(patches.rest(), host, dt)
