"""Small batches of steps of models with three states, and their derivatives, passed directly to compiled code.

What is not plain numbers or arrays of them, or not in order, gets None: then the checks of all models decide.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from planarfriction.kernels.pointers import address_of, place_of
from planarfriction.kernels.quick_steps import (
    JACOBIAN,
    NUMBERS,
    jacobians_address,
    jacobians_many,
    jacobians_one,
    step_many,
)
from planarfriction.kernels.records import row_of
from planarfriction.kernels.rollouts import UNFIT, Place
from planarfriction.models.base import StepJacobians

_ARRAY, _FLOAT, _EMPTY, _MAKE = np.ndarray, np.dtype(float), np.empty, np.array
_PLAIN = frozenset((float, int, np.float64))
_REFUSED = (*UNFIT, OverflowError)


class Quick(NamedTuple):
    """A model of fixed shape as these steps see it."""

    places: np.ndarray
    """Where its parts are (`kernels.rollouts.Place`), for steps."""
    jacobian_places: np.ndarray
    """For their derivatives."""
    size: int
    """Numbers of a state."""
    shape: tuple[int, ...]
    """Of a state."""
    kept: Any
    """What is at the places."""


def jacobian_places(function: Any, records: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Places of parts, from their records `[P, words]`, which are to be kept, and shares `[P]`."""
    calls = np.array([jacobians_address()], np.int64).view(float)
    address, parts = address_of(function, JACOBIAN), zip(records, shares.tolist(), strict=True)
    return np.concatenate([calls, *(row_of(Place(address, place_of(record), 0, share)) for record, share in parts)])


def step_of_many(quick: Quick, state, twist, normal_force, dt) -> tuple[np.ndarray, np.ndarray] | None:
    """`step` of contacts with a state and a twist each, along one axis; loads and steps are theirs or the same."""
    if type(state) is not _ARRAY or type(twist) is not _ARRAY:
        return None
    places, _, n, shape, _ = quick
    if twist.ndim != 2 or state.shape != (count := len(twist), *shape):
        return None
    try:
        if type(normal_force) is not _ARRAY:
            if type(normal_force) not in _PLAIN:
                return None
            normal_force = _MAKE((normal_force,), float)
        if type(dt) is not _ARRAY:
            if type(dt) not in _PLAIN:
                return None
            dt = _MAKE((dt,), float)
        rows = state.reshape(count, n) if n > 3 else state
        new, wrench = _EMPTY((count, n)), _EMPTY((count, 3))
        if not step_many(places, rows, twist, normal_force, dt, new, wrench, _EMPTY(14)):
            return None
    except _REFUSED:
        return None
    return new.reshape(state.shape) if n > 3 else new, wrench


def jacobians_of_one(quick: Quick, state, twist, normal_force, dt) -> StepJacobians | None:
    """`step_jacobians` of one contact."""
    _, places, n, shape, _ = quick
    if type(twist) is _ARRAY and twist.ndim == 1:
        twist = twist.tolist()
    if type(state) is not _ARRAY or state.shape != shape or type(twist) not in (tuple, list) or len(twist) != 3:
        return None
    vx, vy, omega = twist
    if not _PLAIN.issuperset((type(vx), type(vy), type(omega), type(normal_force), type(dt))):
        return None
    result = _EMPTY(9 * n + NUMBERS + 5)
    try:
        flat = state.ravel() if n > 3 else state
        if not jacobians_one(places, flat, vx, vy, omega, normal_force, dt, result):
            return None
    except _REFUSED:
        return None
    return _jacobians(result, n, (), shape)


def jacobians_of_many(places: np.ndarray, shape: tuple[int, ...], state, twist, load, dt) -> StepJacobians:
    """`step_jacobians` of checked inputs."""
    n = math.prod(shape)
    given = np.concatenate([twist, load[..., None], dt[..., None]], axis=-1).reshape(load.size, 5)
    result = _EMPTY((load.size, 9 * n + NUMBERS))
    jacobians_many(places, state.reshape(load.size, n), given, result)
    return StepJacobians(*(np.ascontiguousarray(each) for each in _jacobians(result, n, load.shape, shape)))


def _jacobians(result: np.ndarray, n: int, batch: tuple[int, ...], shape: tuple[int, ...]) -> StepJacobians:
    last, square = 9 * n, (*batch, *shape, 3)
    return StepJacobians(
        result[..., : 3 * n].reshape(square),
        result[..., 3 * n : 6 * n].reshape(square),
        result[..., 6 * n : last].reshape(*batch, 3, *shape),
        result[..., last : last + 9].reshape(*batch, 3, 3),
        result[..., last + 9 : last + 12].reshape(*batch, 3),
    )
