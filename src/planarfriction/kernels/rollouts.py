"""Inputs of rollouts, and their cotangents or changes, as compiled loops read them.

A step without load forgets its state: it passes on no gradient but that of the load, the wrench per unit load that the
smallest load would have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.compiler import kernel


class Inputs(NamedTuple):
    """Rollouts of B contacts through T steps, of cells at L different loads where their weights follow the load."""

    rows: np.ndarray
    """Numbers of law and shape, [B or 1, N]."""
    data: np.ndarray
    """Numbers of the limit surface, or of the levers of cells, flat."""
    twist: np.ndarray
    """[B or 1, T, 3]"""
    load: np.ndarray
    """[B or 1, T]"""
    dt: np.ndarray
    """[T]"""
    which: np.ndarray
    """Index of the load of each step among the L loads, int [B or 1, T]; one for all where the shape is fixed."""
    surface: np.ndarray
    """Kind, offset and size of the limit surface, int [3]; of cells without meaning."""
    shapes: np.ndarray
    """Weights of cells, [L, M]."""
    by_load: np.ndarray
    """Slopes of these by the load, [L, M] [1/N]."""
    reference: float = 0.0
    """Reference load [N] of a law whose stiffness does not grow with the load; 0 of others."""


class Bars(NamedTuple):
    """Cotangents of the inputs of B rollouts, or changes of them."""

    state: np.ndarray
    """Comes in as that of the state at the end, [B, S]."""
    twist: np.ndarray
    """[B, T, 3]"""
    load: np.ndarray
    """[B, T]"""
    rows: np.ndarray
    """[B, N], comes in as zeros; changes are [B or 1, N]."""


@kernel
def row_of(values, b):
    """Return the row of `values` for contact b: its own, or the one that all share."""
    return b if values.shape[0] > 1 else 0
