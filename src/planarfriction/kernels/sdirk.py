"""The method of derivatives of scenes, forwards (`tangent`) and backwards (`adjoint`): five stages, order 4, L-stable.

Stage i solves with the shift `1/(h gamma)`; the last stage is the solution. Source of the coefficients: Hairer and
Wanner, Solving ODEs II, table IV.6.5.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels.pointers import at, doubles, integers

GAMMA = 0.25
PLACES = np.array([0.25, 0.75, 0.55, 0.5, 1.0])
"""Stage times, as shares of the step."""
STAGES = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [1.0 / 2.0, 0.0, 0.0, 0.0],
        [17.0 / 50.0, -1.0 / 25.0, 0.0, 0.0],
        [371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0, 0.0],
        [25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0],
    ]
)
"""Stage arguments below the diagonal, `a_ij`."""
ERROR = np.array([-3.0 / 16.0, -27.0 / 32.0, 25.0 / 32.0, 0.0, 0.25])
"""Solution minus that of the embedded method, in `h G_i`."""
START, AGAIN = 0.125, np.array([-11.0 / 32.0, -11.0 / 64.0, 25.0 / 64.0, 0.0, 0.0])
"""Another difference of order 3, `START h s'` at the start of the step and `AGAIN` in `h G_i`: a Jacobian that jumps
before the first stage would go unseen without it."""

OTHERS = 0.05
"""A derivative need not be known better than to this share of the largest so far of its kind: that of a knot whose say
has just begun is small, and follows a contact's swings that matter to nobody."""

# Step control, as that of the motion: cautious, and no faster growth than a transient that is followed needs.
_SAFETY, _GROWTH, _SHRINKAGE = 0.85, 2.0, 0.2


@kernel
def pace_after(excess):
    """How much longer the next step is than one whose error exceeds what is allowed by this factor."""
    return xp.minimum(_GROWTH, xp.maximum(_SHRINKAGE, _SAFETY * xp.maximum(excess, 1e-10) ** -0.25))


@kernel
def stage_base(i, h, n, start, stages, base):
    """Write `b_i = start + h sum_{j<i} a_ij G_j` of n numbers, in one pass; addresses, stages [5, n]."""
    y, b = doubles(start), doubles(base)
    k_0, k_1, k_2, k_3 = doubles(stages), doubles(at(stages, n)), doubles(at(stages, 2 * n)), doubles(at(stages, 3 * n))
    a_0, a_1, a_2, a_3 = h * STAGES[i, 0], h * STAGES[i, 1], h * STAGES[i, 2], h * STAGES[i, 3]
    if i == 0:
        for m in range(n):
            b[m] = y[m]
    elif i == 1:
        for m in range(n):
            b[m] = y[m] + a_0 * k_0[m]
    elif i == 2:
        for m in range(n):
            b[m] = y[m] + a_0 * k_0[m] + a_1 * k_1[m]
    elif i == 3:
        for m in range(n):
            b[m] = y[m] + a_0 * k_0[m] + a_1 * k_1[m] + a_2 * k_2[m]
    else:
        for m in range(n):
            b[m] = y[m] + a_0 * k_0[m] + a_1 * k_1[m] + a_2 * k_2[m] + a_3 * k_3[m]


@kernel
def excess_of(own, n, places, h, known, rtol):
    """The larger error estimate of a step of n numbers in units of what is allowed, as `rosenbrock.error_norm`.

    `places` are addresses: the numbers before and after the step, the largest so far, the rates before the step and the
    stages [5, n] of the step, absolute tolerances.
    """
    old, new, level, before = doubles(places[0]), doubles(places[1]), doubles(places[2]), doubles(places[3])
    k, atol, largest, state = doubles(places[4]), doubles(places[5]), 0.0, integers(own.state)
    for c in range(own.contacts + 6):
        first, last, mean = own.bristles + c - own.contacts, own.bristles + c - own.contacts + 1, 1.0
        if c < own.contacts:
            first, last = state[c], state[c + 1]
            mean = 1.0 / xp.where(last > first, last - first, 1)
        one, other = 0.0, 0.0
        for m in range(first, last):
            size = xp.maximum(xp.maximum(abs(old[m]), abs(new[m])), OTHERS * level[m])
            per = h / (atol[m] + rtol * size)
            e = ERROR[0] * k[m] + ERROR[1] * k[n + m] + ERROR[2] * k[2 * n + m] + ERROR[4] * k[4 * n + m]
            a = START * before[m] + AGAIN[0] * k[m] + AGAIN[1] * k[n + m] + AGAIN[2] * k[2 * n + m]
            one += (e * per) * (e * per)
            other += (a * per) * (a * per)
        if not xp.is_finite(one + other):
            return math.inf
        largest = xp.maximum(largest, mean * xp.maximum(one, known * other))
    return math.sqrt(largest)
