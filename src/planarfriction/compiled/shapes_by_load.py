"""Shapes of a model at many loads with their slopes by the load, as compiled roll-outs read them.

Cells are one part, whose numbers of the shape are its weights (see `kernels.cells_rollout`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler.memory import place_of
from planarfriction.equality import by_parts
from planarfriction.kernels.cell_blocks import LANES, divided


@by_parts
class Part(NamedTuple):
    """A part of a contact at one load."""

    share: float
    """Share of the load that the part carries [-]."""
    shape: Any
    """Shape of its patch, in the form of its model (`ReducedShape` or `PublishedShape`)."""


class ShapesByLoad(NamedTuple):
    """P parts at L loads (see `kernels.rollouts.Inputs`)."""

    shares: np.ndarray
    """Shares of the load `[P, L]`."""
    surface: np.ndarray
    """Integers of the limit surface or the maps, int `[P, L, 3]`."""
    shapes: np.ndarray
    """Numbers of the shapes `[P, L, S]`."""
    by_load: np.ndarray
    """Slopes of these numbers and of the share by the load `[P, L, S + 1]` [1/N]."""
    data: np.ndarray
    """Numbers from the map that lies first in memory to the end of the last, of which only maps may be read."""


class _Span:
    """Addresses from the first of several arrays to the end of the last, which it keeps alive.

    What lies between them belongs to others: only the arrays may be read.
    """

    def __init__(self, arrays: Sequence[np.ndarray]) -> None:
        first = min(arrays, key=place_of)
        words = (max(place_of(each) + each.nbytes for each in arrays) - place_of(first)) // first.itemsize
        self.__array_interface__, self.arrays = {**first.__array_interface__, "shape": (words,)}, tuple(arrays)


def shapes_by_load(loaded: Sequence[Sequence[Part]], by_load: np.ndarray | None) -> ShapesByLoad:
    """Pack the parts of a `ReducedModel` at L loads, with their slopes `[P, L, S + 1]` or zeros."""
    parts = [[each[k] for each in loaded] for k in range(len(loaded[0]))]
    shares = np.array([[part.share for part in each] for each in parts])
    numbers = np.array([[part.shape.numbers for part in each] for each in parts])
    shapes = [part.shape for each in parts for part in each]
    begin, data = places_of([data for s in shapes for data in (s.data, s.data if s.other is None else s.other)])
    surface = np.zeros((*shares.shape, 3), dtype=int)
    surface[:, :, :2] = begin.reshape(*shares.shape, 2)
    if by_load is None:
        by_load = np.zeros((*shares.shape, numbers.shape[-1] + 1))
    return ShapesByLoad(shares, surface, numbers, by_load, data)


def cells_by_load(levers: np.ndarray, weights: np.ndarray, by_load: np.ndarray | None) -> ShapesByLoad:
    """Pack cells by the numbers of their levers `[K, N]` and weights `[L, N]` at L loads, with slopes or zeros."""
    numbers, cells = levers.shape
    blocks, lanes = divided.py_func(cells)
    padded = np.zeros((numbers, blocks * lanes))
    padded[:, :cells] = levers
    data = np.zeros((blocks, numbers, LANES))
    data[:, :, :lanes] = padded.reshape(numbers, blocks, lanes).swapaxes(0, 1)
    shapes, slopes = (np.zeros((1, len(weights), blocks * lanes + i)) for i in range(2))
    shapes[0, :, :cells] = weights
    if by_load is not None:
        slopes[0, :, :cells] = by_load
    surface = np.zeros((1, len(weights), 3), dtype=int)
    return ShapesByLoad(np.ones((1, len(weights))), surface, shapes, slopes, data.ravel())


def places_of(maps: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the offset of each map from the lowest address, and the array from there to the end of the last map."""
    own = {id(data): data for data in maps}
    data = np.asarray(_Span(tuple(own.values())))
    begin = {name: (place_of(each) - place_of(data)) // data.itemsize for name, each in own.items()}
    return np.array([begin[id(each)] for each in maps]), data
