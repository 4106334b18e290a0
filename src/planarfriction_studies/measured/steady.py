"""Friction models moved along a measured motion, or steadily to find the motion that belongs to a wrench."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.limit_surface.comparison import directions

DIRECTIONS = 2000
"""Directions of twists that are tried at first: neighbours are 3 deg apart."""

ROUNDS, NEAR = 4, 40
"""Times that twists around the best are tried, four times nearer each time, and how many: 0.01 deg at last."""

WAY, SEGMENTS = 1e-3, 4
"""Way of a steady motion [m], far above the deflection of stiff bristles, in so many steps."""


def follow(model: Any, time: np.ndarray, twists: np.ndarray, load: float) -> np.ndarray:
    """Return the friction wrenches `[T, 3]` of a model that is moved from rest with the measured twists `[T, 3]`."""
    state, wrenches = model.rest(), np.zeros_like(twists)
    for i in range(1, len(time)):
        state, wrenches[i] = model.step(state, 0.5 * (twists[i - 1] + twists[i]), load, float(time[i] - time[i - 1]))
    return wrenches


def steady(model: Any, twists: np.ndarray, length: float) -> np.ndarray:
    """Return directions `(fx, fy, tau/length)` of the friction of steady motions along unit twists `[K, 3]`."""
    state, wrenches = np.zeros((len(twists), *model.rest().shape)), np.zeros_like(twists)
    for _ in range(SEGMENTS):
        state, wrenches = model.step(state, twists, 1.0, WAY / SEGMENTS)
    return unit(wrenches / [1.0, 1.0, length])


def twists_of(model: Any, friction: np.ndarray) -> np.ndarray:
    """Return twists `[M, 3]` whose steady friction has the directions of `friction` `[M, 3]`, by search."""
    length = float(model.patch.contact_radius())
    wanted, back = unit(friction / [1.0, 1.0, length]), np.array([1.0, 1.0, 1.0 / length])
    tried = directions(DIRECTIONS)
    found = tried[np.argmax(wanted @ steady(model, tried * back, length).T, axis=1)]
    random, size = np.random.default_rng(0), 0.06
    for _ in range(ROUNDS):
        around = found[:, None] + size * random.normal(size=(len(found), NEAR, 3))
        around[:, 0] = found
        around = unit(around)
        wrenches = steady(model, (around * back).reshape(-1, 3), length).reshape(around.shape)
        found = around[np.arange(len(found)), np.einsum("mki,mi->mk", wrenches, wanted).argmax(axis=1)]
        size /= 4.0
    return found * back


def unit(vectors: np.ndarray) -> np.ndarray:
    """Scale vectors `[..., 3]` to length 1; zeros stay."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0.0)
