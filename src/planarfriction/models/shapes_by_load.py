"""Shapes of a model at many loads with their slopes by the load, as compiled roll-outs read them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planarfriction.kernels.pointers import place_of

STEP = 1e-5
"""Of a central difference by the load, relative: it errs by 1e-10 of the number through its third derivative, and by a
few 1e-11 through rounding. Closer than that to a load at which a cell gets its first load it mixes the two sides."""

_TOGETHER = 32
"""Loads whose weights are asked for at once: those of all would not fit into the memory."""


class ShapesByLoad(NamedTuple):
    """P parts at L loads (see `kernels.rollouts.Inputs`)."""

    shares: np.ndarray
    """[P, L]"""
    surface: np.ndarray
    """int [P, L, 3]"""
    shapes: np.ndarray
    """[P, L, S]"""
    by_load: np.ndarray
    """[P, L, S + 1]"""
    data: np.ndarray
    """Numbers of the map that lies first in memory, from which those of all others are reached."""


class _Holding:
    """An array that holds others, too."""

    def __init__(self, first: np.ndarray, others: Sequence[np.ndarray]) -> None:
        self.__array_interface__, self.others = first.__array_interface__, others


def slopes_by_load(numbers: Callable[[np.ndarray], np.ndarray], loads: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Central differences of numbers, `middle` `[L, M]` at loads > 0 `[L]`, one-sided beside those of another kind.

    The kind shows in the zeros of the last two numbers: contacts that shrink to a point, parts without load.
    """
    sides = []
    for place in (loads * (1.0 - STEP), loads * (1.0 + STEP)):
        end = _in_turn(numbers, place)
        same = ((end[:, -2:] == 0.0) == (middle[:, -2:] == 0.0)).all(axis=1)
        sides.append((np.where(same[:, None], end, middle), np.where(same, place, loads)))
    (low, begin), (high, end) = sides
    wide = np.where(end > begin, end - begin, np.inf)
    return (high - low) / wide[:, None]


def _in_turn(numbers: Callable[[np.ndarray], np.ndarray], loads: np.ndarray) -> np.ndarray:
    return np.concatenate([numbers(loads[i : i + _TOGETHER]) for i in range(0, len(loads), _TOGETHER)])


def places_of(maps: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Where maps begin, counted from the one that lies first in memory, and that one, which holds all."""
    own = {id(data): data for data in maps}
    at = {name: place_of(data) for name, data in own.items()}
    first = min(own, key=at.__getitem__)
    begin = {name: (place - at[first]) // own[first].itemsize for name, place in at.items()}
    return np.array([begin[id(data)] for data in maps]), np.asarray(_Holding(own[first], tuple(own.values())))
