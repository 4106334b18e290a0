"""Motion of what is under or with a contact: displacements by prescribed velocities."""

from __future__ import annotations

import numpy as np

from planarfriction.scenes.signal import Signal


def displacement(velocity: Signal, times) -> np.ndarray:
    """Return the exact integral `[T, k]` of a velocity `[k]` from 0 to `times` `[T]` [s], which are >= 0."""
    times = np.asarray(times, dtype=float)
    breaks = np.unique(np.concatenate([[0.0], velocity.breaks, times]))
    breaks = breaks[breaks >= 0.0]
    if len(breaks) == 1:
        return np.zeros((len(times), velocity.columns or 1))
    middle, lengths = 0.5 * (breaks[1:] + breaks[:-1]), np.diff(breaks)  # linear in between: the middle is the mean
    way = np.cumsum(velocity(middle).reshape(len(middle), -1) * lengths[:, None], axis=0)
    return np.concatenate([np.zeros((1, way.shape[1])), way])[np.searchsorted(breaks, times)]
