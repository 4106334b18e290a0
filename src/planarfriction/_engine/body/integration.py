"""Parts of an integration: method, outputs, progress, workspace, and the record that compiled code reads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction._engine.codegen.vectors import copy
from planarfriction._engine.compiler import entry, kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import Doubles, Integers, at, reader


class Method(NamedTuple):
    """A stiffly accurate Rosenbrock method in transformed coefficients (Hairer and Wanner, Solving ODEs II, IV.7).

    The solution is the argument of the last stage plus that stage, which is the error estimate.
    """

    gamma: float
    a: Doubles
    """Stage arguments `y + sum a_ij k_j`, [s, s]."""
    c: Doubles
    """Stage couplings `sum c_ij k_j / h`, [s, s]."""
    m: Doubles
    """Solution `y + sum m_j k_j`: the last row of `a`, and 1, [s]."""
    alpha: Doubles
    """Stage times, [s]."""
    time_gamma: Doubles
    """Factors of `h df/dt`, [s]."""
    dense: Doubles
    """Continuous extension: rows of `sum d_j k_j`, [q, s]."""
    order: float
    """Order of the error estimate plus one, for the step size."""


class Output(NamedTuple):
    """Values at the requested times."""

    time: Doubles
    """[M]"""
    body: Doubles
    """Velocity and pose, [M, 6]."""
    wrench: Doubles
    """Wrench of one of the identical contacts, [M, C, 3]."""
    load: Doubles
    """[M, C]"""
    bristles: Doubles
    """[M, number of bristle states], or [0, 0] when they are not wanted."""
    pressure: Doubles = np.empty((0, 2))
    """Last two bristle states, [M, 2], if they are the place of a pressure that follows its load; else [0, 2]."""
    ended: Doubles = np.empty(0)
    """Time since which each contact is beyond the edge of the body, NaN while it touches, [C]; [0] without edges."""


class IntegrationProgress(NamedTuple):
    """State of an integration; `rosenbrock.advance` goes on from here and updates it."""

    y: Doubles
    """State of the system, [n]."""
    cursor: Integers
    """Piece and next output, [2]."""
    clock: Doubles
    """Seconds into the piece, next step size, first step size of a piece, [3]."""
    statistics: Integers
    """Counts of `STEPS`, `REJECTIONS`, `EVALUATIONS`, `JACOBIANS`, [4]."""


class Stages(NamedTuple):
    """Workspace of a method with s stages for n states."""

    k: Doubles
    """Stages, [s, n]."""
    rate: Doubles
    """Right-hand side at a stage, [n]."""
    start_rate: Doubles
    """Right-hand side at the start of the step, [n]."""
    right: Doubles
    """Right-hand side of the linear system, [n]."""
    argument: Doubles
    """Argument of a stage, or a state to record, [n]."""
    new: Doubles
    """Solution at the end of the step, [n]."""
    error: Doubles
    """Error of the continuous extension, [n]."""
    drift: Doubles
    """`df/dt` where something that a contact touches moves, [n]."""
    time_slope: Doubles
    """`df/dt` of the accelerations, [3]."""
    coupling: Doubles
    """Coefficients of the current stage, [s]."""
    verdict: Doubles
    """Error of the last step per tolerance, [1]; 1 if the body rests, else 0, [1]."""


@entry
def combine(
    coefficients: Doubles,
    stages: Doubles,
    count: int,
    n: int,
    base: Doubles,
    out: Doubles,
) -> None:
    """Write `out = base + sum coefficients_j stages_j` over the first `count` stages [count, n], two at a time."""
    if count == 0:
        copy(base, out, n)
    elif count % 2 == 1:
        a = coefficients[0]
        for i in range(n):
            out[i] = base[i] + a * stages[i]
    else:
        a = coefficients[0]
        b = coefficients[1]
        second = at(stages, n)
        for i in range(n):
            out[i] = base[i] + a * stages[i] + b * second[i]
    for j in range(2 - count % 2, count, 2):
        a = coefficients[j]
        b = coefficients[j + 1]
        first = at(stages, j * n)
        second = at(stages, j * n + n)
        for i in range(n):
            out[i] += a * first[i] + b * second[i]


class RunRecord(NamedTuple):
    """An integration as compiled code reads it."""

    system: int
    """Address of its `SystemRecord`."""
    method: Method
    output: Output
    progress: IntegrationProgress
    stages: Stages
    atol: Doubles
    """Absolute tolerances, [n]."""
    rtol: float
    states: int
    """Number n of states."""
    stage_count: int
    order_of_dense: int
    samples: int
    """Number M of outputs."""
    combine: int
    """Address of `combine`."""
    attempt: int
    """Address of `rosenbrock.attempt`."""
    at_rest: int
    """Address of `ends.at_rest`."""


read_run = reader(RunRecord)


@kernel
def extend(
    run: RunRecord,
    share: float,
    value: float,
    slope: float,
    base: Doubles,
    out: Doubles,
) -> None:
    """Write `base` plus multiples of the continuous extension, less y, and of its slope in s, at a share s of a step.

    It is `(1 - s) y + s (new + (1 - s) (d_1 + s (d_2 + ...)))` with `new = y + sum m_j k_j`: a sum of stages.
    """
    s = run.stage_count
    m = run.method.m
    dense = run.method.dense
    coupling = run.stages.coupling
    for j in range(s):
        inner = 0.0
        change = 0.0
        for p in range(run.order_of_dense - 1, -1, -1):
            change = inner + share * change
            inner = dense[p * s + j] + share * inner
        coupling[j] = value * share * (m[j] + (1.0 - share) * inner)
        coupling[j] += slope * (
            m[j] + (1.0 - 2.0 * share) * inner + share * (1.0 - share) * change
        )
    call(run.combine, (coupling, run.stages.k, s, run.states, base, out))
