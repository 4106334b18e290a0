"""Friction in the torque balance of a joint along a measured motion, and lags of first order over a path."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction._engine.compiler import jit

ROUNDS = 3
"""Rounds in which a level that grows with the model's own torque converges."""


class Balance(NamedTuple):
    """Numbers of the balance by the names of the estimates; the defaults are those of terms that are not there."""

    inertia: float = 0.0
    mu_c: float = 0.0
    sigma_2: float = 0.0
    torque_offset: float = 0.0
    delay: float = 0.0
    low_pass: float = 0.0
    gravity_sin: float = 0.0
    gravity_cos: float = 0.0
    rise: float = 0.0
    v_s: float = 1.0
    load: float = 0.0
    sigma_0: float = 0.0
    sigma_1: float = 0.0
    viscous_asymmetry: float = 0.0
    asymmetry: float = 0.0


@jit
def follow_path(columns, travelled):
    """Return a lag of first order of each column `[R, C]` over a path, `dz/du = x - z`, which begins at 0.

    `travelled` `[R]` is the path from the row before, in lengths of the lag.
    """
    lagged = np.zeros_like(columns)
    for i in range(len(columns)):
        keep = math.exp(-travelled[i])
        for j in range(columns.shape[1]):
            before = lagged[i - 1, j] if i > 0 else 0.0
            lagged[i, j] = keep * before + (1.0 - keep) * columns[i, j]
    return lagged


@jit
def slide(numbers, weights, path, direction, level, driving):
    """Return the torque of friction but for its viscous part along the rows of a log, smoothed, `[R]` [N m].

    `level` is that without a load, `driving` the torque of the motor less that of all else, but for this friction.
    Bristles are a lag of sliding friction over the path.
    """
    half = len(weights) // 2
    torque = np.zeros_like(path)
    bent = np.empty(len(path) + 2 * half)
    for turn in range(ROUNDS if numbers.load else 1):
        z = 0.0
        for i in range(len(path)):
            through = driving[i] + (torque[i] if turn else direction[i] * level[i])
            # at first the torque is not known of which a share raises the level, and with it the torque
            fed_back = (
                0.0
                if turn
                else numbers.load * math.copysign(1.0, through) * direction[i]
            )
            even = level[i] + numbers.load * abs(through) / (1.0 - fed_back)
            keep = 0.0
            if numbers.sigma_0:
                keep = math.exp(
                    -path[i]
                    * numbers.sigma_0
                    / max(even + direction[i] * numbers.asymmetry, 1e-9)
                )
            z = keep * z + (1.0 - keep) * (direction[i] * even + numbers.asymmetry)
            bent[half + i] = z
        bent[:half] = bent[half]
        bent[half + len(path) :] = z
        for i in range(len(path)):
            total = 0.0
            for k in range(len(weights)):
                total += weights[k] * bent[i + k]
            torque[i] = total
    return torque
