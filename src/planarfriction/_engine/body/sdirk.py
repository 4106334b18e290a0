"""The method of derivatives of scenes, forwards (`tangent`) and backwards (`adjoint`): five stages, order 4, L-stable.

Stage i solves with the shift `1/(h gamma)`; the last stage is the solution. Source of the coefficients: Hairer and
Wanner, Solving ODEs II, table IV.6.5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction._engine.body.body import SystemRecord
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import (
    Doubles,
    Layout,
    StructBuffer,
    at,
    reader,
)

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
"""Solution minus the solution of the embedded method, in `h G_i`."""
START = 0.125
"""Weight of `h s'` at the start of the step in another difference of order 3: a
Jacobian that jumps before the first stage would go unseen without it."""

AGAIN = np.array([-11.0 / 32.0, -11.0 / 64.0, 25.0 / 64.0, 0.0, 0.0])
"""Weights of `h G_i` in the difference of `START`."""

PLAIN = 0.3
"""Error of a step, in units of the tolerance, above which its estimates are damped by `(I - h gamma J)^-1`: this damps
what the method itself damps, so that a stiff bristle that follows the body costs no small steps (Hairer and Wanner,
section IV.8). Below it the next step is longer anyway."""

OTHERS = 0.05
"""Share of the largest derivative of its kind so far: none need be known better than to that. The derivative of a knot
whose say has just begun is small, and follows swings of a contact that matter to nobody."""


class Workspace(NamedTuple):
    """Memory for P derivatives of n states by way of U inputs; the adjoint is one vector that all inputs share."""

    stages: Doubles
    """`G` of each stage, [P, 5, n]."""
    new: Doubles
    """Derivatives after a step, [P, n]."""
    before: Doubles
    """Rates of the derivatives at the end of the step before, [P, n]."""
    level: Doubles
    """Largest derivatives so far by the numbers of each input, [U, n]."""
    forcing: Doubles
    """`df/dp` of the inputs, [U, n]."""
    gain: Doubles
    """`l' df/dp` of the adjoint l at each stage, [5, U]."""
    gain_before: Doubles
    """`l' df/dp` at the end of the step before, [U]."""
    most: Doubles
    """Largest gain on a piece so far, [U]."""
    state: Doubles
    """State about which the motion is linearised, [n]."""
    rate: Doubles
    """Rate of this state, [n]."""
    base: Doubles
    """Base of a stage, [n]."""
    right: Doubles
    """Right-hand side of a stage, [n]."""
    zero: Doubles
    """Zeros, [n]."""
    pace: Doubles
    """Length of the next step, in steps of the motion, [1]."""
    left: Doubles
    """Number of steps that may still be taken, [1]."""


read_workspace = reader(Workspace)


def workspace_for(count: int, inputs: int, n: int) -> StructBuffer:
    """Return a workspace for `count` derivatives of n states (made outside compiled code, which it would slow down)."""
    shapes = dict.fromkeys(Workspace._fields, n) | dict.fromkeys(
        ("level", "forcing"), (max(inputs, 1), n)
    )
    shapes |= {
        "stages": (count, len(PLACES), n),
        "new": (count, n),
        "before": (count, n),
    }
    shapes |= {
        "gain": (len(PLACES), inputs),
        "gain_before": inputs,
        "most": inputs,
        "pace": 1,
        "left": 1,
    }
    return StructBuffer(Layout(Workspace, **shapes).made(pace=np.ones(1)))


class Variation(NamedTuple):
    """One of the derivatives of a motion, its arrays [n] each."""

    value: Doubles
    new: Doubles
    before: Doubles
    level: Doubles
    stages: Doubles
    """[5, n]"""


@kernel
def variation_of(w: Workspace, values: Doubles, p: int, u: int, n: int) -> Variation:
    """Return derivative p of `values` [P, n], which goes by input u."""
    return Variation(
        at(values, p * n),
        at(w.new, p * n),
        at(w.before, p * n),
        at(w.level, u * n),
        at(w.stages, 5 * p * n),
    )


@kernel
def stage_base(i: int, h: float, n: int, d: Variation, base: Doubles) -> None:
    """Write `b_i = s + h sum_{j<i} a_ij G_j` of a derivative s, in one pass."""
    y = d.value
    b = base
    k_0 = d.stages
    k_1 = at(d.stages, n)
    k_2 = at(d.stages, 2 * n)
    k_3 = at(d.stages, 3 * n)
    a_0 = h * STAGES[i, 0]
    a_1 = h * STAGES[i, 1]
    a_2 = h * STAGES[i, 2]
    a_3 = h * STAGES[i, 3]
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
def keep_stage(i: int, shift: float, n: int, d: Variation, base: Doubles) -> None:
    """Keep `G_i = (S_i - b_i)/(h gamma)` of the solution S_i in `d.new`."""
    for m in range(n):
        d.stages[i * n + m] = shift * (d.new[m] - base[m])


@kernel
def accept(n: int, d: Variation) -> None:
    """Take the derivative after a step."""
    for m in range(n):
        d.value[m], d.before[m] = d.new[m], d.stages[4 * n + m]
        d.level[m] = xp.maximum(d.level[m], abs(d.new[m]))


@kernel
def write_errors(n: int, d: Variation, known: float) -> None:
    """Write two error estimates of a step, per second, into the first two rows of `d.stages`.

    The second counts only if it is `known` (1 or 0) how fast the derivative changes at the start, `d.before`.
    """
    k = d.stages
    for m in range(n):
        one = (
            ERROR[0] * k[m]
            + ERROR[1] * k[n + m]
            + ERROR[2] * k[2 * n + m]
            + ERROR[4] * k[4 * n + m]
        )
        other = (
            START * d.before[m]
            + AGAIN[0] * k[m]
            + AGAIN[1] * k[n + m]
            + AGAIN[2] * k[2 * n + m]
        )
        k[m] = one
        k[n + m] = known * other


@kernel
def error_of(
    system: SystemRecord, n: int, d: Variation, h: float, rtol: float, atol: Doubles
) -> float:
    """Return the larger of the error estimates in the first two rows of `d.stages`, per tolerance."""
    k = d.stages
    state = system.contacts.state
    largest = 0.0
    for c in range(system.size + 6):
        first = system.bristles + c - system.size
        last = system.bristles + c - system.size + 1
        mean = 1.0
        if c < system.size:
            first = state[c]
            last = state[c + 1]
            mean = 1.0 / xp.where(last > first, last - first, 1)
        one = 0.0
        other = 0.0
        for m in range(first, last):
            size = xp.maximum(
                xp.maximum(abs(d.value[m]), abs(d.new[m])), OTHERS * d.level[m]
            )
            per = h / (atol[m] + rtol * size)
            one += (k[m] * per) * (k[m] * per)
            other += (k[n + m] * per) * (k[n + m] * per)
        if not xp.is_finite(one + other):
            return math.inf
        largest = xp.maximum(largest, mean * xp.maximum(one, other))
    return math.sqrt(largest)
