"""Lloyd's iteration: points with weights in clusters, each around the centre of its points.

A cluster may be held on the coordinate axes (mirrors), and may stand for its image under `p -> -p` too.
"""

from __future__ import annotations

import numpy as np

from planarfriction._engine.compiler import jit

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Golden ratio: its multiples, less their whole parts, are spread evenly over (0, 1)."""

_TIE = 1e-12
"""Relative difference of squared distances below which the first centre wins: far above rounding."""

_STOPS = 1e-9
"""Relative gain of the cost below which the iteration ends."""


@jit
def seeds(
    points: np.ndarray, weights: np.ndarray, first: int, centres: np.ndarray
) -> None:
    """Write `centres [k, 2]` far from each other: points drawn by weight times squared distance from earlier centres.

    Draws are multiples of the golden ratio from number `first` on.
    """
    distance = np.ones(points.shape[0])
    for j in range(centres.shape[0]):
        total = 0.0
        for i in range(points.shape[0]):
            total += weights[i] * distance[i]
        draw = (first + j + 1) * GOLDEN % 1.0 * total
        chosen = 0
        for i in range(points.shape[0]):
            draw -= weights[i] * distance[i]
            if weights[i] * distance[i] > 0.0:
                chosen = i
            if draw <= 0.0:
                break
        x = points[chosen, 0]
        y = points[chosen, 1]
        centres[j, 0] = x
        centres[j, 1] = y
        for i in range(points.shape[0]):
            square = (points[i, 0] - x) ** 2 + (points[i, 1] - y) ** 2
            distance[i] = square if j == 0 else min(square, distance[i])


@jit
def lloyd(
    points: np.ndarray, weights: np.ndarray, both: bool, on_axes: np.ndarray, steps: int, centres: np.ndarray,
    labels: np.ndarray, turned: np.ndarray,
) -> float:  # fmt: skip
    """Move `centres [k, 2]` to the means of the points nearest to them, up to so many `steps`; return the cost.

    The cost is the sum of weights times squared distances; infinite if a cluster has no weight. `labels [n]` are the
    clusters of the points; with `both`, `turned [n]` says which points belong to the image `-c` of their centre.
    Coordinates of centres are 0 where `on_axes [k, 2]`.
    """
    count = centres.shape[0]
    share = np.empty(count)
    sums = np.empty((count, 2))
    cost = np.inf
    last = np.inf
    for _ in range(steps):
        share[:] = 0.0
        sums[:] = 0.0
        cost = 0.0
        for i in range(points.shape[0]):
            x = points[i, 0]
            y = points[i, 1]
            nearest = np.inf
            label = 0
            back = False
            for j in range(count):
                cx = centres[j, 0]
                cy = centres[j, 1]
                square = (x - cx) ** 2 + (y - cy) ** 2
                if square < nearest * (1.0 - _TIE):
                    nearest = square
                    label = j
                    back = False
                if both:
                    square = (x + cx) ** 2 + (y + cy) ** 2
                    if square < nearest * (1.0 - _TIE):
                        nearest = square
                        label = j
                        back = True
            labels[i] = label
            turned[i] = back
            weight = -weights[i] if back else weights[i]
            share[label] += weights[i]
            sums[label, 0] += weight * x
            sums[label, 1] += weight * y
            cost += weights[i] * nearest
        for j in range(count):
            if not share[j] > 0.0:
                return np.inf
            for k in range(2):
                centres[j, k] = 0.0 if on_axes[j, k] else sums[j, k] / share[j]
        if cost > last * (1.0 - _STOPS):
            break
        last = cost
    return cost
