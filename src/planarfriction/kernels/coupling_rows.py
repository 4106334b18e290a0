"""Problems of the step in contact space as rows of words (see `kernels.coupling`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.compiler.memory import reader
from planarfriction.kernels.step_slopes import NUMBERS


class Row(NamedTuple):
    """Where the parts of a problem begin in its row."""

    dt: int
    tolerance: int
    """Of the twists [m/s]."""
    most: int
    """Iterations."""
    response: int
    """A, [3k, 3k]."""
    load_response: int
    """B, [k, 3k]."""
    free_twist: int
    """V_0, [3k]."""
    free_load: int
    """N_0, [k]."""
    guess: int
    """W_0, [3k]."""
    state: int
    records: int
    """Addresses of the pieces' records, int [pieces]; 0 of one that carries nothing at its load."""
    shares: int
    """Of the pieces in the loads of their patches, [pieces]."""
    wrench: int
    """W, [3k]; comes in as where to start."""
    twist: int
    """V, [3k]."""
    load: int
    """N, [k]."""
    new: int
    """State."""
    iterations: int
    """`INVALID` where a number is out of range, or negative where it must not be."""
    residual: int
    """[m/s]"""
    converged: int
    """1 or 0."""
    unit: int
    """Wrenches of the models per unit load, [3k]; this and all that follows is scratch."""
    unit_slopes: int
    """[k, 9]"""
    slopes: int
    """P, [k, 9]."""
    twist_0: int
    """V at W = 0, [3k]."""
    load_0: int
    """[k]"""
    scale: int
    """Twists of unit energy, [3k]."""
    gap: int
    """[3k]"""
    change: int
    """dW, [3k]."""
    move: int
    """A dW, [3k]."""
    start: int
    """W before a step, [3k]."""
    best_twist: int
    best_load: int
    matrix: int
    """[3k, 3k]"""
    step: int
    """What a piece's step writes."""
    turned: int
    """[2, 9]"""


INVALID = -1.0
"""In place of a number of iterations."""


def layout(patches: int, pieces: int, states: int) -> tuple[Row, dict[str, slice], int]:
    """Rows for k patches: where their parts begin, the same as slices, and how long they are."""
    k, n = patches, 3 * patches
    sizes = dict.fromkeys(Row._fields, n)
    sizes |= dict.fromkeys(("dt", "tolerance", "most", "iterations", "residual", "converged"), 1)
    sizes |= dict.fromkeys(("free_load", "load", "load_0", "best_load"), k)
    sizes |= dict.fromkeys(("state", "new"), states) | dict.fromkeys(("records", "shares"), pieces)
    sizes |= dict.fromkeys(("unit_slopes", "slopes"), 9 * k) | dict.fromkeys(("response", "matrix"), n * n)
    sizes |= {"load_response": k * n, "step": NUMBERS, "turned": 18}
    ends = np.cumsum(list(sizes.values())).tolist()
    begins = [0, *ends[:-1]]
    return Row(*begins), {name: slice(*each) for name, *each in zip(sizes, begins, ends, strict=True)}, ends[-1]


class Patches(NamedTuple):
    """What all problems of the same patches share."""

    count: int
    """k"""
    pieces: int
    """A patch is one piece, or several that share its twist and its load."""
    states: int
    solve: int
    """Address of `solve`."""
    functions: int
    """Where the addresses of the pieces' functions are (see `step_slopes`), int [pieces]."""
    owners: int
    """Where the patches that they belong to are, int [pieces]."""
    firsts: int
    """Where their states begin in the state, int [pieces]."""
    radius: int
    """Where the lever arms of the patches are that turn spins into speeds [m], [k]."""
    row: Row


read = reader(Patches)
