"""Patches of a step in contact space whose pressure follows the moments of their loads (the rule: `cells.tilt`).

The pressure follows from the load and the moments at the guess of the wrenches, and stays while the step is solved: a
host that steps on gives the next step the moments that came out.
"""

from __future__ import annotations

import math

from planarfriction._engine.cells.moment_pressure import centre, tilt
from planarfriction._engine.codegen.vectors import copy
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, Place, at, doubles, integers
from planarfriction._engine.coupled.coupling_rows import ContactSolve, Patches

CELLS = -2
"""Word of the numbers of cells, from the end of a `cells.CellsContact`."""


@kernel
def _borne(
    x: Doubles, y: Doubles, width: Doubles, w: Doubles, n: int, support: Doubles, out: Doubles, discs: Doubles,
    moves: int,
) -> None:  # fmt: skip
    """Write the weights that lie on the rectangle of the support, with their total unchanged; all if none does.

    An edge takes away from a cell what lies beyond it of a square of its width. What is left of `discs`, which have so
    many numbers, moves to its centre and keeps the share of its second moment.
    """
    total = 0.0
    borne = 0.0
    for i in range(n):
        dx = x[i] - support[0]
        dy = y[i] - support[1]
        share = 1.0
        squares = 0.0
        placed_x = x[i]
        placed_y = y[i]
        for half, c, s in (
            (support[4], support[2], support[3]),
            (support[5], -support[3], support[2]),
        ):
            off = c * dx + s * dy
            covered = 0.5 + (half - abs(off)) / width[i]
            covered = xp.minimum(xp.maximum(covered, 0.0), 1.0)
            back = math.copysign(0.5 * (1.0 - covered) * width[i], off)
            share *= covered
            squares = squares + covered * covered
            placed_x -= back * c
            placed_y -= back * s
        if moves > 0:
            discs[i] = placed_x
            discs[n + i] = placed_y
            discs[2 * n + i] *= math.sqrt(0.5 * squares)
        total = total + w[i]
        borne = borne + w[i] * share
        out[i] = w[i] * share
    for i in range(n):
        out[i] = out[i] * (total / borne) if borne > 0.0 else w[i]


@kernel
def _press(
    patches: Patches, p: ContactSolve, problem_at: Place, k: int, n: int, first: int
) -> None:
    """Write the weights of the n points of patch k, which begin at `first`, or how far it moves as a whole."""
    x = at(patches.followers.x, first)
    y = at(patches.followers.y, first)
    cx, cy = centre(p.moments[2 * k], p.moments[2 * k + 1], p.free_load[k])
    words = patches.followers.words[k]
    out = at(p.weights, first)
    if words == 0:
        p.shift[2 * k] = cx - x[0]
        p.shift[2 * k + 1] = cy - y[0]
    elif p.records[k] != 0:
        record = integers(p.records[k])
        copied = 0
        width = at(patches.followers.width, first)
        weights = doubles(record[words - 1])
        support = at(p.support, 6 * k)
        moved = 0
        for j in range(k):
            copied += patches.followers.words[j]
            points = patches.followers.firsts[j + 1] - patches.followers.firsts[j]
            moved += patches.followers.moves[j] * points
        target = at(p.copies, copied)
        copy(record, target, words - 1)
        copy(weights, out, n)
        if support[4] > 0.0:
            moves = patches.followers.moves[k]
            discs = at(p.moved, moved)
            if moves > 0:
                copy(doubles(record[words + CELLS]), discs, moves * n)
                target[words + CELLS] = at(problem_at, patches.row.moved + moved)
            _borne(x, y, width, weights, n, support, out, discs, moves)
            if moves > 0:
                x = discs
                y = at(discs, n)
        tilt(x, y, out, n, cx, cy, out)
        target[words - 1] = at(problem_at, patches.row.weights + first)
        p.acting[k] = at(problem_at, patches.row.copies + copied)


@kernel
def hold(patches: Patches, p: ContactSolve) -> None:
    """Keep the pressures of the last solution in further ones of the same step."""
    for k in range(patches.count):
        p.follows[k] = -abs(p.follows[k])


@kernel
def follow(patches: Patches, p: ContactSolve, problem_at: Place) -> None:
    """Write the records that act in the problem, whose row is at `problem_at`, and how far patches move."""
    for k in range(patches.count):
        if p.follows[k] < 0.0:
            continue
        p.acting[k] = p.records[k]
        p.shift[2 * k] = 0.0
        p.shift[2 * k + 1] = 0.0
        first = patches.followers.firsts[k]
        n = patches.followers.firsts[k + 1] - first
        if p.follows[k] > 0.0 and p.free_load[k] > 0.0 and n > 0:
            _press(patches, p, problem_at, k, n, first)
