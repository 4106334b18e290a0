"""Rosenbrock methods on the structured body system: adaptive steps, exact stops at breaks, dense output."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, jit, kernel
from planarfriction.kernels.body import factor, linearise, rates, solve

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


class Tolerance(NamedTuple):
    """What the error of a step is measured by."""

    rtol: float
    atol: np.ndarray
    """[n]"""


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


def stages_for(method: Method, n: int) -> Stages:
    """Workspace of a method for n states (made outside compiled code, where an allocation costs compile time)."""
    s = len(method.m)
    return Stages(np.zeros((s, n)), *np.zeros((7, n)), np.zeros(3), np.zeros(s))


@kernel
def error_norm(contacts, y, new, error, tolerance):
    """Largest of the body's components and of each contact's mean over its bristles, in units of the tolerance.

    Infinite where anything is not finite.
    """
    largest, rtol, atol = 0.0, tolerance.rtol, tolerance.atol
    for c in range(contacts.count.shape[0]):
        first, last = contacts.state[c], contacts.state[c + 1]
        total = 0.0
        for i in range(first, last):
            e = error[i] / (atol[i] + rtol * xp.maximum(abs(y[i]), abs(new[i])))
            total += e * e
        if not xp.is_finite(total):
            return math.inf
        if last > first:
            largest = xp.maximum(largest, math.sqrt(total / (last - first)))
    n = y.shape[0]
    for i in range(n - 6, n):
        e = abs(error[i]) / (atol[i] + rtol * xp.maximum(abs(y[i]), abs(new[i])))
        if not xp.is_finite(e):
            return math.inf
        largest = xp.maximum(largest, e)
    return largest


@kernel
def _record(system, piece, since, y, output, m, dy):
    contacts, motion, work = system
    rates(system, piece, since, y, dy)
    o = y.shape[0] - 6
    for i in range(6):
        output.body[m, i] = y[o + i]
    for c in range(contacts.count.shape[0]):
        load = motion.load[piece, 0, c] + since * motion.load[piece, 1, c]
        output.load[m, c] = load
        for i in range(3):
            output.wrench[m, c, i] = load * work.wrench[c, i]
    if output.bristles.shape[0] > 0:
        for i in range(o):
            output.bristles[m, i] = y[i]


@inlined
def _time_slope(system, piece, slope):
    """`df/dt` of the body's accelerations [3]: forces and loads are linear in time."""
    contacts, motion, work = system
    for i in range(3):
        total = motion.force[piece, 1, i]
        for c in range(contacts.count.shape[0]):
            load = contacts.count[c] * motion.load[piece, 1, c]
            for p in range(3):
                total += load * work.maps[c, 0, p, i] * work.wrench[c, p]
        slope[i] = motion.inverse_mass[i] * total


@kernel
def _combine(coefficients, stages, count, base, out):
    """`out = base + sum coefficients_j stages_j` over the first `count` stages, two at a time."""
    n = base.shape[0]
    if count % 2 == 1:
        a, first = coefficients[0], stages[0]
        for i in range(n):
            out[i] = base[i] + a * first[i]
    else:
        for i in range(n):
            out[i] = base[i]
    for j in range(count % 2, count, 2):
        a, b, first, second = coefficients[j], coefficients[j + 1], stages[j], stages[j + 1]
        for i in range(n):
            out[i] += a * first[i] + b * second[i]


@kernel
def forget_unloaded(contacts, motion, piece, y):
    """A contact without load on the whole piece keeps no memory: it starts again from rest."""
    for c in range(contacts.count.shape[0]):
        if motion.load[piece, 0, c] == 0.0 and motion.load[piece, 1, c] == 0.0:
            for i in range(contacts.state[c], contacts.state[c + 1]):
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
def _prepare(system, piece, since, y, stages):
    """Evaluate and linearise at the start of a step."""
    rates(system, piece, since, y, stages.start_rate)
    linearise(system, piece, y)
    _time_slope(system, piece, stages.time_slope)


@kernel
def _step(system, method, piece, since, step, y, stages):
    """The stages of one step from `y`: solution into `stages.new`, its error estimate into `stages.error`."""
    n, s = y.shape[0], method.m.shape[0]
    k, argument, right, coupling = stages.k, stages.argument, stages.right, stages.coupling
    shift = 1.0 / (step * method.gamma)
    factor(system, piece, since, y, shift)
    for i in range(s):
        for j in range(i):
            coupling[j] = method.c[i, j] / step
        if i > 0:
            _combine(method.a[i], k, i, y, argument)
            rates(system, piece, since + method.alpha[i] * step, argument, stages.rate)
        _combine(coupling, k, i, stages.rate if i > 0 else stages.start_rate, right)
        for p in range(3):
            right[n - 6 + p] += method.time_gamma[i] * step * stages.time_slope[p]
        solve(system, piece, since, y, shift, right, k[i])
    _combine(method.m, k, s, y, stages.new)
    _combine(method.e, k, s, stages.zero, stages.error)


@inlined
def _at_rest(motion, y, rate):
    """Body speed, and its change within the bristles' time, are below the speed that counts as rest."""
    n = y.shape[0]
    speed, change = 0.0, 0.0
    for i in range(3):
        arm = motion.stop_radius if i == 2 else 1.0
        speed += (arm * y[n - 6 + i]) ** 2
        change += (arm * rate[n - 6 + i]) ** 2
    return math.sqrt(speed) + motion.stop_time * math.sqrt(change) < motion.stop_speed


@jit
def advance(system, method, output, progress, tolerance, max_steps, stages):
    """Integrate from where `progress` stands to the last break, or for `max_steps` trials; return an outcome.

    The step that ends at a break is recorded (left limit) before the next piece begins.
    """
    motion, (y, cursor, clock, statistics) = system.motion, progress
    n = y.shape[0]
    piece, m = cursor[0], cursor[1]
    since, h, first_step = clock[0], clock[1], clock[2]
    taken = 0
    fresh = True  # the linearisation is yet to be made at y
    outcome = DONE
    while piece < motion.breaks.shape[0] - 1 and outcome == DONE:
        begin, end = motion.breaks[piece], motion.breaks[piece + 1]
        starting = since == 0.0
        if starting:
            if motion.velocity.shape[0] > 0:
                for i in range(3):
                    y[n - 6 + i] = motion.velocity[piece, i]
            h = xp.minimum(h, first_step)
            if piece == 0 and m == 0 and output.time[0] == begin:
                _record(system, piece, 0.0, y, output, m, stages.rate)
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
                _prepare(system, piece, since, y, stages)
                statistics[JACOBIANS] += 1
            _step(system, method, piece, since, step, y, stages)
            taken += 1
            statistics[EVALUATIONS] += method.m.shape[0] if fresh else method.m.shape[0] - 1
            norm = error_norm(system.contacts, y, stages.new, stages.error, tolerance)
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
            while m < output.time.shape[0] and output.time[m] <= time:
                at = reached if output.time[m] == time else output.time[m] - begin
                _interpolate(method, stages.k, y, stages.new, (at - since) / step, stages.argument)
                _record(system, piece, at, stages.argument, output, m, stages.rate)
                m += 1
            if starting:
                first_step = step * scale
                starting = False
            for i in range(n):
                y[i] = stages.new[i]
            since = reached
            h = xp.maximum(step * scale, h) if last else step * scale
            if motion.stop_speed > 0.0 and _at_rest(motion, y, stages.start_rate):
                outcome = AT_REST
                if m < output.time.shape[0]:
                    output.time[m] = time
                    _record(system, piece, since, y, output, m, stages.rate)
                    m += 1
                break
        if outcome == DONE:
            forget_unloaded(system.contacts, motion, piece, y)
            piece += 1
            since = 0.0
    cursor[0], cursor[1] = piece, m
    clock[0], clock[1], clock[2] = since, h, first_step
    return outcome
