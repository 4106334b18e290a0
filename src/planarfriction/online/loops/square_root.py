"""Steps of a square-root Kalman filter: unknowns `x` and the lower triangular `root` S of their covariance `S S'`.

Both are fields of a record s, as those of `planarfriction.online.loops.filter_state.STATE`.
"""

import math

from planarfriction._engine.codegen.vectors import clear
from planarfriction._engine.compiler import kernel

N = 12
"""Number of unknowns."""


@kernel
def measure(s, h, innovation, variance, column):
    """Update with a scalar `innovation` of slope `h [N]` and variance; return it in its standard deviations.

    A rotation of `[[sqrt(variance), h'S], [0, S]]`.
    """
    corner = math.sqrt(variance)
    clear(column, N)
    for j in range(N - 1, -1, -1):
        v = 0.0
        for i in range(j, N):
            v += s.root[i, j] * h[i]
        size = math.sqrt(corner * corner + v * v)
        cosine = corner / size
        sine = v / size
        corner = size
        for i in range(j, N):
            a = column[i]
            b = s.root[i, j]
            column[i] = cosine * a + sine * b
            s.root[i, j] = cosine * b - sine * a
    for i in range(N):
        s.x[i] += column[i] * innovation / corner
    return innovation / corner


@kernel
def _take_in(s, first, column):
    """Rotate a column, zero above its row `first`, into the root: the covariance grows by its outer product."""
    for j in range(first, N):
        a = s.root[j, j]
        b = column[j]
        size = math.sqrt(a * a + b * b)
        if size > 0.0:
            cosine = a / size
            sine = b / size
            for k in range(j, N):
                a = s.root[k, j]
                b = column[k]
                s.root[k, j] = cosine * a + sine * b
                column[k] = cosine * b - sine * a


@kernel
def spread(s, i, variance, column):
    """Add a variance to unknown i."""
    clear(column, N)
    column[i] = math.sqrt(variance)
    _take_in(s, i, column)


@kernel
def reset(s, i, value, deviation, column):
    """Forget unknown i: a value with a standard deviation, independent of all others."""
    for k in range(N):
        column[k] = s.root[k, i] if k > i else 0.0
    for j in range(i + 1):
        s.root[i, j] = 0.0
    for k in range(i + 1, N):
        s.root[k, i] = 0.0
    s.x[i] = value
    s.root[i, i] = deviation
    _take_in(s, i + 1, column)  # what the others had in that column goes on


@kernel
def variance_of(s, i, k):
    """Return the variance of the sum of unknowns i and k, or of i alone if they are one."""
    total = 0.0
    for j in range(N):
        each = s.root[i, j] + (s.root[k, j] if k != i else 0.0)
        total += each * each
    return total
