"""What an integration consists of: method, outputs, progress, workspace, and the record that compiled code reads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.compiler import entry
from planarfriction.kernels.body import System
from planarfriction.kernels.pointers import address_of, doubles, matrix, place_of, vector
from planarfriction.kernels.records import addresses_in, reader, row_of


class Method(NamedTuple):
    """A Rosenbrock method in transformed coefficients (Hairer and Wanner, Solving ODEs II, section IV.7)."""

    gamma: float
    a: np.ndarray
    """Stage arguments `y + sum a_ij k_j`, [s, s]."""
    c: np.ndarray
    """Stage couplings `sum c_ij k_j / h`, [s, s]."""
    m: np.ndarray
    """Solution `y + sum m_j k_j`, [s]."""
    e: np.ndarray
    """Error estimate `sum e_j k_j`, [s]."""
    alpha: np.ndarray
    """Stage times, [s]."""
    time_gamma: np.ndarray
    """Factors of `h df/dt`, [s]."""
    dense: np.ndarray
    """Continuous extension: rows of `sum d_j k_j`, [q, s]."""
    order: float
    """Order of the error estimate plus one, for the step size."""


class Output(NamedTuple):
    """What is recorded at the requested times."""

    time: np.ndarray
    """[M]"""
    body: np.ndarray
    """Velocity and pose, [M, 6]."""
    wrench: np.ndarray
    """Wrench of one of the identical contacts, [M, C, 3]."""
    load: np.ndarray
    """[M, C]"""
    bristles: np.ndarray
    """[M, number of bristle states], or [0, 0] when they are not wanted."""


class Progress(NamedTuple):
    """How far an integration is; `rosenbrock.advance` goes on from here and updates it."""

    y: np.ndarray
    """The state, [n]."""
    cursor: np.ndarray
    """Piece and next output, int [2]."""
    clock: np.ndarray
    """Seconds into the piece, next step size, first step size of a piece, [3]."""
    statistics: np.ndarray
    """Counts of `STEPS`, `REJECTIONS`, `EVALUATIONS`, `JACOBIANS`, int [4]."""


class Stages(NamedTuple):
    """Workspace of a method with s stages for n states."""

    k: np.ndarray
    """Stages, [s, n]."""
    rate: np.ndarray
    """Right-hand side at a stage, [n]."""
    start_rate: np.ndarray
    """Right-hand side at the start of the step, [n]."""
    right: np.ndarray
    """Right-hand side of the linear system, [n]."""
    argument: np.ndarray
    """Argument of a stage, or a state to record, [n]."""
    new: np.ndarray
    """Solution at the end of the step, [n]."""
    error: np.ndarray
    """Its error estimate, [n]."""
    zero: np.ndarray
    """Zeros, [n]."""
    drift: np.ndarray
    """`df/dt` where something that a contact touches moves, [n]."""
    time_slope: np.ndarray
    """`df/dt` of the accelerations, [3]."""
    coupling: np.ndarray
    """Coefficients of the current stage, [s]."""


@entry
def combine(coefficients, stages, count, n, base, out):
    """`out = base + sum coefficients_j stages_j` over the first `count` stages [count, n], two at a time."""
    coefficients, base, out = doubles(coefficients), vector(base, n), vector(out, n)
    k = matrix(stages, count, n)
    if count % 2 == 1:
        a, first = coefficients[0], k[0]
        for i in range(n):
            out[i] = base[i] + a * first[i]
    else:
        for i in range(n):
            out[i] = base[i]
    for j in range(count % 2, count, 2):
        a, b, first, second = coefficients[j], coefficients[j + 1], k[j], k[j + 1]
        for i in range(n):
            out[i] += a * first[i] + b * second[i]


_SIZES = ("system", "states", "contacts", "order_of_dense", "stage_count", "samples", "bristle_samples", "combine")

RunRecord = NamedTuple(
    "RunRecord",
    [
        *((name, int) for name in _SIZES),
        *((name, float) for name in ("gamma", "order", "rtol")),
        *((name, int) for name in addresses_in(Method, Output, Progress, Stages)),
        ("atol", int),
    ],
)
"""An integration as compiled code reads it: its system, sizes, numbers, and its arrays by their addresses."""

read_run = reader(RunRecord)


class Run(NamedTuple):
    """An integration: what `rosenbrock.advance` works on."""

    system: System
    method: Method
    output: Output
    progress: Progress
    stages: Stages
    atol: np.ndarray
    words: np.ndarray
    """Its `RunRecord`, as a row."""

    @property
    def address(self) -> int:
        """What compiled functions take."""
        return place_of(self.words)


def run_of(system: System, method: Method, output: Output, progress: Progress, *, rtol: float, atol: np.ndarray) -> Run:
    """An integration with its workspace (made outside compiled code, where an allocation costs compile time).

    Steps keep their error below `rtol |y| + atol`, `atol` [n].
    """
    n, s = len(progress.y), len(method.m)
    stages = Stages(np.zeros((s, n)), *np.zeros((8, n)), np.zeros(3), np.zeros(s))
    atol = np.ascontiguousarray(atol, dtype=float)
    arrays = {**method._asdict(), **output._asdict(), **progress._asdict(), **stages._asdict(), "atol": atol}
    record = RunRecord(
        system=system.address,
        states=n,
        contacts=len(system.contacts.count),
        order_of_dense=len(method.dense),
        stage_count=s,
        samples=len(output.time),
        bristle_samples=len(output.bristles),
        gamma=method.gamma,
        order=method.order,
        rtol=float(rtol),
        combine=address_of(combine, "pppppp"),
        **{name: place_of(array) for name, array in arrays.items() if isinstance(array, np.ndarray)},
    )
    return Run(system, method, output, progress, stages, atol, row_of(record))
