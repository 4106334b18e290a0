"""Sums over the cells of discs of what each cell bears, for pressures that are given anew at each step.

See `planarfriction.models.cell_loads` for the equations.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.compiler import jit


@jit
def gather(
    loads: np.ndarray, cover: np.ndarray, before: np.ndarray, cells: np.ndarray, parted: np.ndarray, begins: np.ndarray,
    stiffness: np.ndarray, numbers: np.ndarray, whole: np.ndarray, weights: np.ndarray, pads: np.ndarray,
    moved: np.ndarray,
) -> None:  # fmt: skip
    """Write shares of the load `[B, n]`, the stiffness and what is kept of it `[B, 2, n]`, and discs `[B, 3, n]`.

    Loads and pressed shares, now and before, are `[B, N]` of N cells; disc k has the memberships from `begins[k]` to
    `begins[k + 1]` `[n + 1]`, each a part of a cell `[M]`. `stiffness` `[N]` is that of the cells, none where empty.
    `numbers` `[4, N]` are shares of a load, places x and y, and `x^2 + y^2` with the cell's own second moment; discs
    stay where it is empty, and where nothing of them is pressed they are those of `whole` `[3, n]`.
    """
    count = loads.shape[0]
    discs = begins.shape[0] - 1
    elastic = stiffness.shape[0] > 0
    moves = numbers.shape[1] > 0
    for b in range(count):
        total = 0.0
        for i in range(loads.shape[1]):
            total = total + loads[b, i]
        per = 1.0 / total if total > 0.0 else 0.0
        for k in range(discs):
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
