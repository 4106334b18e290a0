"""Rosenbrock methods on the structured body system: adaptive steps, exact stops at breaks, dense output."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import entry, jit, kernel
from planarfriction.kernels.body import System, load_of, read
from planarfriction.kernels.pointers import address_of, call, doubles, integers, matrix, place_of, vector
from planarfriction.kernels.records import reader, row_of

DONE, PAUSED, STEP_TOO_SMALL, AT_REST = 0, 1, 2, 3
"""Outcomes of `advance`."""

STEPS, REJECTIONS, EVALUATIONS, JACOBIANS = 0, 1, 2, 3
"""Rows of the statistics."""

# Step control. A decaying transient is followed through all its scales only if the steps do not grow too fast: a
# factor of 2.5 needs 8 % fewer steps than 6 for the same error of the in-hand runs.
_SAFETY, _GROWTH, _SHRINKAGE = 0.8, 2.5, 0.1

# Smallest step relative to the time (at least 1 s): a few units in the last place of the clock.
_RESOLUTION = 1e-15


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
    """How far an integration is; `advance` goes on from here and updates it."""

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
    time_slope: np.ndarray
    """`df/dt` of the accelerations, [3]."""
    coupling: np.ndarray
    """Coefficients of the current stage, [s]."""


class RunRecord(NamedTuple):
    """An integration as compiled code reads it: the arrays of the records above by address, and their sizes."""

    system: int
    states: int
    contacts: int
    order_of_dense: int
    stage_count: int
    samples: int
    bristle_samples: int
    gamma: float
    order: float
    rtol: float
    atol: int
    a: int
    c: int
    m: int
    e: int
    alpha: int
    time_gamma: int
    dense: int
    time: int
    body: int
    wrench: int
    load: int
    bristles: int
    y: int
    cursor: int
    clock: int
    statistics: int
    k: int
    rate: int
    start_rate: int
    right: int
    argument: int
    new: int
    error: int
    zero: int
    time_slope: int
    coupling: int
    combine: int
    """The function of this module."""


read_run = reader(RunRecord)


class Run(NamedTuple):
    """An integration: what `advance` works on."""

    system: System
    method: Method
    output: Output
    progress: Progress
    stages: Stages
    atol: np.ndarray
    words: np.ndarray
    """Its `RunRecord`, as a row."""

    def advance(self, max_steps: int) -> int:
        """See `advance`."""
        return advance(place_of(self.words), max_steps)


def run_of(system: System, method: Method, output: Output, progress: Progress, *, rtol: float, atol: np.ndarray) -> Run:
    """An integration with its workspace (made outside compiled code, where an allocation costs compile time).

    Steps keep their error below `rtol |y| + atol`, `atol` [n].
    """
    n, s = len(progress.y), len(method.m)
    stages = Stages(np.zeros((s, n)), *np.zeros((7, n)), np.zeros(3), np.zeros(s))
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


@kernel
def _method(own):
    s = own.stage_count
    a, c, dense = matrix(own.a, s, s), matrix(own.c, s, s), matrix(own.dense, own.order_of_dense, s)
    m, e, alpha, time_gamma = vector(own.m, s), vector(own.e, s), vector(own.alpha, s), vector(own.time_gamma, s)
    return Method(own.gamma, a, c, m, e, alpha, time_gamma, dense, own.order)


@kernel
def _stages(own):
    n, s = own.states, own.stage_count
    return Stages(
        matrix(own.k, s, n), vector(own.rate, n), vector(own.start_rate, n), vector(own.right, n),
        vector(own.argument, n), vector(own.new, n), vector(own.error, n), vector(own.zero, n),
        vector(own.time_slope, 3), vector(own.coupling, s),
    )  # fmt: skip


@kernel
def error_norm(own, y, new, error, rtol, atol):
    """Largest of the body's components and of each contact's mean over its bristles, in units of the tolerance.

    Infinite where anything is not finite.
    """
    largest, state = 0.0, integers(own.state)
    for c in range(own.contacts):
        total, count = 0.0, state[c + 1] - state[c]
        for i in range(state[c], state[c + 1]):
            e = error[i] / (atol[i] + rtol * xp.maximum(abs(y[i]), abs(new[i])))
            total += e * e
        if not xp.is_finite(total):
            return math.inf
        if count > 0:
            largest = xp.maximum(largest, math.sqrt(total / count))
    for i in range(own.bristles, own.bristles + 6):
        e = abs(error[i]) / (atol[i] + rtol * xp.maximum(abs(y[i]), abs(new[i])))
        if not xp.is_finite(e):
            return math.inf
        largest = xp.maximum(largest, e)
    return largest


@kernel
def _record(run, own, piece, since, y, m):
    """Write sample m from the state y."""
    many = own.contacts
    call(own.rates, (run.system, piece, since, y, run.rate))
    for i in range(6):
        doubles(run.body)[6 * m + i] = y[own.bristles + i]
    for c in range(many):
        load = load_of(own, piece, since, c)
        doubles(run.load)[m * many + c] = load
        for i in range(3):
            doubles(run.wrench)[3 * (m * many + c) + i] = load * doubles(own.wrench)[3 * c + i]
    if run.bristle_samples > 0:
        for i in range(own.bristles):
            doubles(run.bristles)[m * own.bristles + i] = y[i]


@kernel
def _time_slope(own, piece, slope):
    """`df/dt` of the body's accelerations [3]: forces and loads are linear in time."""
    many, maps, wrench = own.contacts, doubles(own.maps), doubles(own.wrench)
    for i in range(3):
        total = doubles(own.force)[6 * piece + 3 + i]
        for c in range(many):
            load = doubles(own.count)[c] * doubles(own.load)[(2 * piece + 1) * many + c]
            for p in range(3):
                total += load * maps[27 * c + 3 * p + i] * wrench[3 * c + p]
        slope[i] = doubles(own.inverse_mass)[i] * total


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


@kernel
def forget_unloaded(own, piece, y):
    """A contact without load on the whole piece keeps no memory: it starts again from rest."""
    load, at = doubles(own.load), 2 * piece * own.contacts
    for c in range(own.contacts):
        if load[at + c] == 0.0 and load[at + own.contacts + c] == 0.0:
            for i in range(integers(own.state)[c], integers(own.state)[c + 1]):
                y[i] = 0.0


@kernel
def _interpolate(method, k, y, new, s, out):
    """Continuous extension at the fraction `s` of a step: `(1 - s) y + s (new + (1 - s) (d_1 + s (d_2 + ...)))`."""
    q = method.dense.shape[0]
    for i in range(y.shape[0]):
        inner = 0.0
        for p in range(q - 1, -1, -1):
            row = 0.0
            for j in range(k.shape[0]):
                row += method.dense[p, j] * k[j, i]
            inner = row + s * inner
        out[i] = (1.0 - s) * y[i] + s * (new[i] + (1.0 - s) * inner)


@kernel
def _step(run, own, method, piece, since, step, y, stages):
    """The stages of one step from `y`: solution into `stages.new`, its error estimate into `stages.error`."""
    n, s = run.states, run.stage_count
    k, argument, right, coupling = stages.k, stages.argument, stages.right, stages.coupling
    shift = 1.0 / (step * method.gamma)
    call(own.factor, (run.system, piece, since, y, shift))
    for i in range(s):
        for j in range(i):
            coupling[j] = method.c[i, j] / step
        if i > 0:
            call(run.combine, (method.a[i], k, i, n, y, argument))
            call(own.rates, (run.system, piece, since + method.alpha[i] * step, argument, stages.rate))
        call(run.combine, (coupling, k, i, n, run.rate if i > 0 else run.start_rate, right))
        for p in range(3):
            right[n - 6 + p] += method.time_gamma[i] * step * stages.time_slope[p]
        call(own.solve, (run.system, piece, since, y, shift, right, k[i]))
    call(run.combine, (method.m, k, s, n, y, stages.new))
    call(run.combine, (method.e, k, s, n, stages.zero, stages.error))


@kernel
def _at_rest(own, y, rate):
    """Body speed, and its change within the bristles' time, are below the speed that counts as rest."""
    speed, change = 0.0, 0.0
    for i in range(3):
        arm = own.stop_radius if i == 2 else 1.0
        speed += (arm * y[own.bristles + i]) ** 2
        change += (arm * rate[own.bristles + i]) ** 2
    return math.sqrt(speed) + own.stop_time * math.sqrt(change) < own.stop_speed


@jit
def advance(run, max_steps):
    """Integrate the run at an address from where it stands to the last break, or for `max_steps` trials; an outcome.

    The step that ends at a break is recorded (left limit) before the next piece begins.
    """
    run = read_run(run)
    system, own, method, stages = run.system, read(run.system), _method(run), _stages(run)
    n, samples = run.states, run.samples
    y, breaks, times, clock = vector(run.y, n), doubles(own.breaks), doubles(run.time), doubles(run.clock)
    cursor, statistics = integers(run.cursor), integers(run.statistics)
    piece, m = cursor[0], cursor[1]
    since, h, first_step = clock[0], clock[1], clock[2]
    taken = 0
    fresh = True  # the linearisation is yet to be made at y
    outcome = DONE
    while piece < own.pieces and outcome == DONE:
        begin, end = breaks[piece], breaks[piece + 1]
        starting = since == 0.0
        if starting:
            if own.velocity != 0:
                for i in range(3):
                    y[n - 6 + i] = doubles(own.velocity)[3 * piece + i]
            h = xp.minimum(h, first_step)
            if piece == 0 and m == 0 and times[0] == begin:
                _record(run, own, piece, 0.0, y, m)
                m += 1
        while since < end - begin:
            # stretch the last step to the break, or halve what is left, so that no sliver of a step remains
            remaining = end - begin - since
            step = h
            if 2.0 * h > remaining:
                step = remaining if h >= remaining else 0.5 * remaining
            last = step == remaining
            if taken >= max_steps or step <= _RESOLUTION * xp.maximum(1.0, abs(begin)):
                outcome = PAUSED if taken >= max_steps else STEP_TOO_SMALL
                break
            if fresh:
                call(own.rates, (system, piece, since, y, stages.start_rate))
                call(own.linearise, (system, piece, y))
                _time_slope(own, piece, stages.time_slope)
                statistics[JACOBIANS] += 1
            _step(run, own, method, piece, since, step, y, stages)
            taken += 1
            statistics[EVALUATIONS] += method.m.shape[0] if fresh else method.m.shape[0] - 1
            norm = error_norm(own, y, stages.new, stages.error, run.rtol, doubles(run.atol))
            # no growth right after a rejection, whose reason is still near
            growth = _GROWTH if fresh else 1.0
            scale = _SHRINKAGE
            if xp.is_finite(norm):
                ideal = _SAFETY * xp.maximum(norm, 1e-10) ** (-1.0 / method.order)
                scale = xp.minimum(growth, xp.maximum(_SHRINKAGE, ideal))
            fresh = norm <= 1.0
            if not fresh:
                statistics[REJECTIONS] += 1
                h = step * scale
                continue
            statistics[STEPS] += 1
            reached = end - begin if last else since + step
            time = end if last else begin + reached
            while m < samples and times[m] <= time:
                at = reached if times[m] == time else times[m] - begin
                _interpolate(method, stages.k, y, stages.new, (at - since) / step, stages.argument)
                _record(run, own, piece, at, stages.argument, m)
                m += 1
            if starting:
                first_step = step * scale
                starting = False
            for i in range(n):
                y[i] = stages.new[i]
            since = reached
            h = xp.maximum(step * scale, h) if last else step * scale
            if own.stop_speed > 0.0 and _at_rest(own, y, stages.start_rate):
                outcome = AT_REST
                if m < samples:
                    times[m] = time
                    _record(run, own, piece, since, y, m)
                    m += 1
                break
        if outcome == DONE:
            forget_unloaded(own, piece, y)
            piece += 1
            since = 0.0
    cursor[0], cursor[1] = piece, m
    clock[0], clock[1], clock[2] = since, h, first_step
    return outcome
