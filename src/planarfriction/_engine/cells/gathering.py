"""Sums over the cells of bristles of what each cell bears, for pressures that are given anew at each step.

See `planarfriction.models.cell_loads` for the equations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction._engine.bristles.discs import KAPPA
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.compiler.calls import pointer
from planarfriction._engine.compiler.memory import Doubles, Integers, at, exists, reader
from planarfriction.formulas import LARGEST

COVERED = 1
"""Given are the pressed shares of the cells; else all of a cell is pressed if it bears a load."""

COVERED_BEFORE = 2
"""The same for what was pressed before."""


class Bearing(NamedTuple):
    """Bristles of a contact, and the cells that each stands for; memberships of the cells lie in their order."""

    count: int
    """Number N of cells."""
    bristles: int
    """n"""
    rows: int
    """Numbers of each bristle (see `cells.CellsContact`)."""
    first: int
    """Row of the place x of a bristle, which those of y and of kappa times its radius follow."""
    cells: Integers
    """Cell of each membership `[M]`."""
    begins: Integers
    """First membership of each bristle, and M, `[n + 1]`."""
    parted: Doubles
    """Part of the cell that belongs to the bristle `[M]`."""
    stiffness: Doubles
    """Share of the stiffness of the bristle `[M]`; empty without a pad."""
    moments: Doubles
    """Share of the load, and its moments about the bristle: first and second, `[M, 4]`; empty if bristles stay."""
    whole: Doubles
    """Numbers of bristles all of whose cells are pressed `[rows, n]`."""


read_bearing = reader(Bearing)


@kernel
def _share(cover: float, load: float, known: bool) -> float:
    """Return the pressed share of a cell."""
    return cover if known else (1.0 if load > 0.0 else 0.0)


@kernel
def _wrong(
    own: Bearing, loads: Doubles, earlier: Doubles, cover: Doubles, before: Doubles, known: int
) -> bool:  # fmt: skip
    """Return True if a load or a share is out of range, or a share is 0 where there is load."""
    covered = 1.0 if known & COVERED else LARGEST
    covered_before = 1.0 if known & COVERED_BEFORE else LARGEST
    count = 0
    for i in range(own.count):
        fits = loads[i] >= 0.0 and loads[i] <= LARGEST
        fits &= earlier[i] >= 0.0 and earlier[i] <= LARGEST
        fits &= cover[i] >= 0.0 and cover[i] <= covered
        fits &= before[i] >= 0.0 and before[i] <= covered_before
        fits &= cover[i] > 0.0 or loads[i] == 0.0
        count += 0 if fits else 1
    return count > 0


@kernel
def bear(
    own: Bearing, loads: Doubles, earlier: Doubles, cover: Doubles, before: Doubles, known: int, weights: Doubles,
    numbers: Doubles, kept: Doubles,
) -> float:  # fmt: skip
    """Write the shares of the load [n], the numbers that change, and what is kept of deflections [n]; return the load.

    Loads and pressed shares of the cells, now and before, are [N]. If one of them is wrong, return -1.
    """
    if _wrong(own, loads, earlier, cover, before, known):
        return -1.0
    n = own.bristles
    elastic = exists(own.stiffness)
    moves = exists(own.moments)
    covered = known & COVERED > 0
    covered_before = known & COVERED_BEFORE > 0
    total = 0.0
    for k in range(n):
        load = 0.0
        pressed = 0.0
        both = 0.0
        share = 0.0
        x = 0.0
        y = 0.0
        square = 0.0
        for m in range(own.begins[k], own.begins[k + 1]):
            i = own.cells[m]
            now = _share(cover[i], loads[i], covered)
            load += own.parted[m] * loads[i]
            if elastic:
                last = _share(before[i], earlier[i], covered_before)
                pressed += own.stiffness[m] * now
                both += own.stiffness[m] * min(now, last)
            if moves:
                share += own.moments[4 * m] * now
                x += own.moments[4 * m + 1] * now
                y += own.moments[4 * m + 2] * now
                square += own.moments[4 * m + 3] * now
        weights[k] = load
        total += load
        if elastic:
            stiff = (own.rows - 1) * n + k
            numbers[stiff] = own.whole[stiff] * pressed
            kept[k] = both / pressed if pressed > 0.0 else 0.0
        if moves:
            place = own.first * n + k
            per = 1.0 / share if share > 0.0 else 0.0
            x *= per
            y *= per
            second = max(square * per - x * x - y * y, 0.0)
            radius = KAPPA * math.sqrt(2.0 * second)
            numbers[place] = own.whole[place] + x
            numbers[place + n] = own.whole[place + n] + y
            place += 2 * n
            numbers[place] = radius if share > 0.0 else own.whole[place]
    for k in range(n):
        weights[k] = weights[k] / total if total > 0.0 else 0.0
    return total


@jit
def gather(
    bearing: np.ndarray, given: tuple[np.ndarray, ...], known: int, load: np.ndarray, weights: np.ndarray,
    numbers: np.ndarray, kept: np.ndarray,
) -> None:  # fmt: skip
    """Call `bear` for B contacts; all arrays are flat, those of numbers that do not change empty."""
    own = read_bearing(bearing)
    n = own.bristles
    for b in range(load.shape[0]):
        i = b * own.count
        load[b] = bear(
            own, at(pointer(given[0]), i), at(pointer(given[1]), i), at(pointer(given[2]), i), at(pointer(given[3]), i),
            known, at(pointer(weights), b * n), at(pointer(numbers), b * own.rows * n), at(pointer(kept), b * n),
        )  # fmt: skip
