"""Twists of wrenches for the published table: two bilinear equations in each of its cells, solved exactly."""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.codegen.vectors import dot, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.published.surfaces import BILINEAR, sliding
from planarfriction.limit_surface.loops.twists import of_each, plane

_SAME_ANSWER = 1e-12
"""Angle [rad] between a stored wrench and the wanted one below which a direction answers: rounding of the quadratic."""

_AT_EDGE = 1e-13
"""Excess by which an answer on the edge between two cells may lie outside of both, by rounding, as a share of h."""


@kernel
def _signs(data, row, start, first, second, across, sides):
    """Return `h . first` and `h . second` of a row of nodes `[columns, 2]`, and on which sides of zero they can be."""
    for j in range(across.shape[1]):
        p = start + 4 * j
        h = (data[p], data[p + 1], data[p + 2])
        a = dot(h, first)
        b = dot(h, second)
        across[row, j, 0] = a
        across[row, j, 1] = b
        side = (1 if a > _AT_EDGE else 0) | (2 if a < -_AT_EDGE else 0)
        sides[row, j] = side | (4 if b > _AT_EDGE else 0) | (8 if b < -_AT_EDGE else 0)


@kernel
def _share(numerator, denominator):
    """Return the quotient within [0, 1]; zero where there is none."""
    quotient = numerator / denominator if denominator != 0.0 else 0.0
    return xp.minimum(xp.maximum(quotient, 0.0), 1.0)


@kernel
def _answer(data, size, i, j, position, corners, target):
    """Return the direction in table cell (i, j) that answers best, its dissipation, angle and `|h . target|`.

    `corners` are `h . first` and `h . second` at the corners, the lower polar angle first.
    """
    ax, ay, bx, by, cx, cy, dx, dy = corners
    start_x = ax + position * (bx - ax)
    start_y = ay + position * (by - ay)
    step_x = cx - ax + position * (dx - cx - bx + ax)
    step_y = cy - ay + position * (dy - cy - by + ay)
    along = _share(
        -(start_x * step_x + start_y * step_y), step_x * step_x + step_y * step_y
    )
    polar = 0.5 * math.pi / size * (i + along)
    azimuth = 0.5 * math.pi / size * (j + position)
    v = (
        math.sin(polar) * math.cos(azimuth),
        math.sin(polar) * math.sin(azimuth),
        math.cos(polar),
    )
    h = sliding(BILINEAR, data, 0, size, v[0], v[1], v[2], 1.0)
    with_target = dot(h, target)
    cross = (
        h[1] * target[2] - h[2] * target[1],
        h[2] * target[0] - h[0] * target[2],
        h[0] * target[1] - h[1] * target[0],
    )
    v = times(-1.0 if with_target < 0.0 else 1.0, v)
    return (
        v,
        abs(dot(h, v)),
        math.atan2(math.sqrt(dot(cross, cross)), abs(with_target)),
        abs(with_target),
    )


@kernel
def _positions(corners):
    """Return the azimuths of common roots of both equations, `q2 b^2 + q1 b + q0 = 0`, or the edge."""
    ax, ay, bx, by, cx, cy, dx, dy = corners
    b_x = bx - ax
    b_y = by - ay
    a_x = cx - ax
    a_y = cy - ay
    t_x = dx - cx - b_x
    t_y = dy - cy - b_y
    # (corner + along_b b) x (along_a + twisted b) = 0
    q2 = b_x * t_y - b_y * t_x
    q0 = ax * a_y - ay * a_x
    q1 = ax * t_y - ay * t_x + b_x * a_y - b_y * a_x
    root = math.sqrt(xp.maximum(q1 * q1 - 4.0 * q2 * q0, 0.0))
    half = -0.5 * (q1 + (-root if q1 < 0.0 else root))
    return _share(half, q2), _share(q0, half), 0.0


@kernel
def _in_table(surface, target):
    """Return the answer of `of_each`; of several the one of least dissipation."""
    data, size, across, sides = surface
    columns = 4 * size + 1
    first, second = plane(target)
    best = (0.0, 0.0, 1.0)
    angle = math.inf
    least = math.inf
    power = 1.0
    _signs(data, 0, 0, first, second, across, sides)
    for i in range(size):
        low = i % 2
        high = (i + 1) % 2
        _signs(data, high, 4 * (i + 1) * columns, first, second, across, sides)
        for j in range(columns - 1):
            if sides[low, j] & sides[low, j + 1] & sides[high, j] & sides[high, j + 1]:
                continue  # between the corners one of the two has no zero
            corners = (
                across[low, j, 0], across[low, j, 1], across[low, j + 1, 0], across[low, j + 1, 1],
                across[high, j, 0], across[high, j, 1], across[high, j + 1, 0], across[high, j + 1, 1],
            )  # fmt: skip
            for position in _positions(corners):
                v, phi, miss, size_here = _answer(
                    data, size, i, j, position, corners, target
                )
                better = (
                    size_here < least
                    if miss <= _SAME_ANSWER and angle <= _SAME_ANSWER
                    else miss < angle
                )
                if better:
                    best = v
                    angle = miss
                    least = size_here
                    power = phi
    return best, power, angle


@jit
def published_twists(data, size, frame, wrenches, twists):
    """Find twists with `of_each` for a `BILINEAR` surface."""
    columns = 4 * size + 1
    surface = data, size, np.empty((2, columns, 2)), np.empty((2, columns), np.int8)
    return of_each(_in_table, surface, frame, wrenches, twists)
