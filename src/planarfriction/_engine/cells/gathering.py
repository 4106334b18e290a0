"""Sums over the cells of discs of what each cell bears, for pressures that are given anew at each step.

See `planarfriction.models.cell_loads` for the equations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction._engine.compiler import jit


class Discs(NamedTuple):
    """Cells and the discs that stand for them."""

    cells: np.ndarray
    """Cell of each membership `[M]`."""
    parted: np.ndarray
    """Part of the cell that belongs to the disc `[M]`."""
    begins: np.ndarray
    """First membership of each disc, and M, `[n + 1]`."""
    stiffness: np.ndarray
    """Stiffness of the cells `[N]`; empty without a pad."""
    numbers: np.ndarray
    """Shares of the load, places x and y, and second moments about the origin, of the cells `[4, N]`; `[4, 0]` if discs
    stay."""
    whole: np.ndarray
    """Places and radii of discs of which nothing is pressed `[3, n]`."""


@jit
def gather(
    loads: np.ndarray, cover: np.ndarray, before: np.ndarray, discs: Discs, weights: np.ndarray, pads: np.ndarray,
    moved: np.ndarray,
) -> None:  # fmt: skip
    """Write shares of the load `[B, n]`, the stiffness and what is kept of it `[B, 2, n]`, and discs `[B, 3, n]`.

    Loads and pressed shares of the cells, now and before, are `[B, N]`.
    """
    (cells, parted, begins, stiffness, numbers, whole) = discs
    count = loads.shape[0]
    elastic = stiffness.shape[0] > 0
    moves = numbers.shape[1] > 0
    for b in range(count):
        total = 0.0
        for i in range(loads.shape[1]):
            total = total + loads[b, i]
        per = 1.0 / total if total > 0.0 else 0.0
        for k in range(begins.shape[0] - 1):
            load = 0.0
            full = 0.0
            pressed = 0.0
            kept = 0.0
            share = 0.0
            x = 0.0
            y = 0.0
            square = 0.0
            for m in range(begins[k], begins[k + 1]):
                i = cells[m]
                part = parted[m]
                now = part * cover[b, i]
                load = load + part * loads[b, i]
                if elastic:
                    full = full + part * stiffness[i]
                    pressed = pressed + now * stiffness[i]
                    kept = kept + part * min(cover[b, i], before[b, i]) * stiffness[i]
                if moves:
                    own = now * numbers[0, i]
                    share = share + own
                    x = x + own * numbers[1, i]
                    y = y + own * numbers[2, i]
                    square = square + own * numbers[3, i]
            weights[b, k] = load * per
            if elastic:
                pads[b, 0, k] = pressed / full
                pads[b, 1, k] = kept / pressed if pressed > 0.0 else 0.0
            if moves and share > 0.0:
                x = x / share
                y = y / share
                second = max(square / share - x * x - y * y, 0.0)
                moved[b, 0, k] = x
                moved[b, 1, k] = y
                moved[b, 2, k] = math.sqrt(2.0 * second)
            elif moves:
                for j in range(3):
                    moved[b, j, k] = whole[j, k]
