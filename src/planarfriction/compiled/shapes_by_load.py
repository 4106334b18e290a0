"""Cells at many loads with the slopes of their weights by the load, as compiled rollouts read them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.kernels.cell_blocks import LANES, divided


class ShapesByLoad(NamedTuple):
    """A contact at L loads (see `kernels.rollouts.Inputs`)."""

    surface: np.ndarray
    """Integers of the limit surface, int `[3]`; zeros of cells."""
    shapes: np.ndarray
    """Weights of the cells in their blocks, `[L, M]`; `[1, 0]` of a limit surface."""
    by_load: np.ndarray
    """Slopes of the weights by the load, `[L, M]` [1/N]."""
    data: np.ndarray
    """Numbers of the limit surface, or of the levers of the cells, flat."""


def cells_by_load(levers: np.ndarray, weights: np.ndarray, by_load: np.ndarray | None) -> ShapesByLoad:
    """Pack cells by the numbers of their levers `[K, N]` and weights `[L, N]` at L loads, with slopes or zeros."""
    numbers, cells = levers.shape
    blocks, lanes = divided.py_func(cells)
    padded = np.zeros((numbers, blocks * lanes))
    padded[:, :cells] = levers
    data = np.zeros((blocks, numbers, LANES))
    data[:, :, :lanes] = padded.reshape(numbers, blocks, lanes).swapaxes(0, 1)
    shapes, slopes = np.zeros((2, len(weights), blocks * lanes))
    shapes[:, :cells] = weights
    if by_load is not None:
        slopes[:, :cells] = by_load
    return ShapesByLoad(np.zeros(3, dtype=int), shapes, slopes, data.ravel())
