"""Inputs of rollouts, and their cotangents or changes, as compiled loops read them.

A step without load forgets its state: it passes on the gradient of the load alone, the wrench per unit load that the
smallest load would have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction._engine.compiler import kernel


class ShapesByLoad(NamedTuple):
    """A contact at L different loads, where weights of cells follow the load."""

    surface: np.ndarray
    """Kind, offset and size of the limit surface, int `[3]`; zeros of cells."""
    weights: np.ndarray
    """Weights of the cells in their blocks, `[L, M]`; `[1, 0]` of a limit surface."""
    by_load: np.ndarray
    """Slopes of the weights by the load, `[L, M]` [1/N]."""
    data: np.ndarray
    """Numbers of the limit surface, flat, or of the levers of the cells, `[1 or L, K]`."""
    kept: np.ndarray
    """Share of the bristles of the cells that stays as a step begins, `[L, M]`; `[0, M]` if all does."""


class Inputs(NamedTuple):
    """Rollouts of B contacts through T steps."""

    rows: np.ndarray
    """Numbers of law and shape, [B or 1, N]."""
    shape: ShapesByLoad
    twist: np.ndarray
    """[B or 1, T, 3]"""
    load: np.ndarray
    """[B or 1, T]"""
    dt: np.ndarray
    """[T]"""
    which: np.ndarray
    """Index of the load of each step among the L loads, int [B or 1, T]; one for all where the shape is fixed."""
    springs: float = 1.0
    """Share of a change of `sigma_0` that is one of the springs: 0 of a pad with a stiffness of its own."""


class Derivatives(NamedTuple):
    """Wrenches and their derivatives by some numbers of a contact, to which rollouts add theirs."""

    columns: np.ndarray
    """Places of the numbers in a row, int [D]."""
    wrenches: np.ndarray
    """[B, T, 3]"""
    slopes: np.ndarray
    """[B, T, 3, D]"""


class Bars(NamedTuple):
    """Cotangents or changes of the inputs of B rollouts."""

    state: np.ndarray
    """Comes in as the cotangent of the state at the end, [B, S]."""
    twist: np.ndarray
    """[B, T, 3]"""
    load: np.ndarray
    """[B, T]"""
    rows: np.ndarray
    """[B, N], comes in as zeros; changes are [B or 1, N]."""
    cells: np.ndarray
    """Changes of the loads of cells [B or 1, T or 0, n], or slopes by them [B, T or 0, n]; 0 if none are wanted."""
    own: float = 1.0
    """Share of the cotangents of these that comes by the law of a pad: 0 at a held ratio of stiffness to load."""


@kernel
def row_of(values: np.ndarray, b: int) -> int:
    """Return the row of `values` for contact b: b, or 0 where all share one."""
    return b if values.shape[0] > 1 else 0
