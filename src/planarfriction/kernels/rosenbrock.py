"""Rosenbrock methods on the structured body system: adaptive steps, exact stops at breaks, dense output."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.kernels import jit, kernel
from planarfriction.kernels.body import factor, linearise, rates, solve, workspace

DONE, PAUSED, STEP_TOO_SMALL, AT_REST = 0, 1, 2, 3
"""Outcomes of `advance`."""

STEPS, REJECTIONS, EVALUATIONS, JACOBIANS = 0, 1, 2, 3
"""Rows of the statistics."""

# Step control. A decaying transient is followed through all its scales only if the steps do not grow too fast: a factor of
# 2.5 needs 8 % fewer steps than 6 for the same error of the in-hand runs.
_SAFETY, _GROWTH, _SHRINKAGE = 0.8, 2.5, 0.1


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


@kernel
def _error_norm(contacts, y, new, error, rtol, atol):
    """Largest of the body's components and of each contact's mean over its bristles, in units of the tolerance."""
    largest = 0.0
    for c in range(contacts.kind.shape[0]):
        first, last = contacts.state[c], contacts.state[c + 1]
        total = 0.0
        for i in range(first, last):
            e = error[i] / (atol[i] + rtol * max(abs(y[i]), abs(new[i])))
            total += e * e
        if last > first:
            largest = max(largest, math.sqrt(total / (last - first)))
    n = y.shape[0]
    for i in range(n - 6, n):
        largest = max(largest, abs(error[i]) / (atol[i] + rtol * max(abs(y[i]), abs(new[i]))))
        if not math.isfinite(error[i]):
            return math.inf
    return largest if math.isfinite(largest) else math.inf


@kernel
def _record(contacts, motion, piece, since, y, output, m, dy, work):
    rates(contacts, motion, piece, since, y, dy, work)
    o = y.shape[0] - 6
    for i in range(6):
        output.body[m, i] = y[o + i]
    for c in range(contacts.kind.shape[0]):
        load = motion.load[piece, 0, c] + since * motion.load[piece, 1, c]
        output.load[m, c] = load
        for i in range(3):
            output.wrench[m, c, i] = load * work.wrench[c, i]
    if output.bristles.shape[0] > 0:
        for i in range(o):
            output.bristles[m, i] = y[i]


@kernel
def _time_slope(contacts, motion, piece, work, slope):
    """`df/dt` of the body's accelerations [3]: forces and loads are linear in time."""
    for i in range(3):
        total = motion.force[piece, 1, i]
        for c in range(contacts.kind.shape[0]):
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
def _forget_unloaded(contacts, motion, piece, y):
    """A contact without load on the whole piece keeps no memory: it starts again from rest."""
    for c in range(contacts.kind.shape[0]):
        if motion.load[piece, 0, c] == 0.0 and motion.load[piece, 1, c] == 0.0:
            for i in range(contacts.state[c], contacts.state[c + 1]):
                y[i] = 0.0


@jit
def advance(contacts, motion, method, output, y, cursor, clock, rtol, atol, max_steps, statistics):
    """Integrate from where `cursor` and `clock` stand until the last break, or for `max_steps` steps; return an outcome.

    `cursor` is (piece, next output), `clock` is (seconds into the piece, next step size, first step size of a piece):
    both are updated, so that the next call goes on. `y` is the state; at a break it is first updated with the step that
    ends there and recorded (left limit), then the next piece begins.
    """
    n = y.shape[0]
    s = method.m.shape[0]
    k = np.empty((s, n))
    f, f0, r, arg, new, error, ft = (
        np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.zeros(3)
    )  # fmt: skip
    couplings = np.empty(s)
    work = workspace(contacts)
    zeros = np.zeros(n)
    piece, m = cursor[0], cursor[1]
    since, h, first_step = clock[0], clock[1], clock[2]
    taken = 0
    fresh = True  # the linearisation is yet to be made at y
    pieces = motion.breaks.shape[0] - 1
    outcome = DONE
    while piece < pieces:
        begin = motion.breaks[piece]
        length = motion.breaks[piece + 1] - begin
        if since == 0.0:
            if motion.velocity.shape[0] > 0:
                y[n - 6 : n - 3] = motion.velocity[piece]
            h = min(h, first_step)
        while m < output.time.shape[0] and output.time[m] <= begin and since == 0.0 and piece == 0:
            _record(contacts, motion, piece, 0.0, y, output, m, f, work)
            m += 1
        starting = since == 0.0
        while since < length:
            if taken >= max_steps:
                outcome = PAUSED
                break
            # stretch the last step to the break, or halve what is left, so that no sliver of a step remains
            remaining = length - since
            step = remaining if h >= remaining else min(h, 0.5 * remaining) if 2.0 * h > remaining else h
            last = step == remaining
            if step <= 1e-15 * max(1.0, abs(begin)):
                outcome = STEP_TOO_SMALL
                break
            if fresh:
                rates(contacts, motion, piece, since, y, f0, work)
                linearise(contacts, motion, piece, y, work)
                statistics[EVALUATIONS] += 1
                statistics[JACOBIANS] += 1
                _time_slope(contacts, motion, piece, work, ft)
            shift = 1.0 / (step * method.gamma)
            factor(contacts, motion, piece, since, y, shift, work)
            for i in range(s):
                for j in range(i):
                    couplings[j] = method.c[i, j] / step
                if i == 0:
                    _combine(couplings, k, 0, f0, r)
                else:
                    _combine(method.a[i], k, i, y, arg)
                    rates(contacts, motion, piece, since + method.alpha[i] * step, arg, f, work)
                    _combine(couplings, k, i, f, r)
                    statistics[EVALUATIONS] += 1
                for p in range(3):
                    r[n - 6 + p] += method.time_gamma[i] * step * ft[p]
                solve(contacts, motion, piece, since, y, shift, r, k[i], work)
            _combine(method.m, k, s, y, new)
            _combine(method.e, k, s, zeros, error)
            norm = _error_norm(contacts, y, new, error, rtol, atol)
            taken += 1
            # no growth right after a rejection, whose reason is still near
            growth = _GROWTH if fresh else 1.0
            scale = min(growth, max(_SHRINKAGE, _SAFETY * max(norm, 1e-10) ** (-1.0 / method.order)))
            if norm > 1.0:
                statistics[REJECTIONS] += 1
                h = step * (scale if math.isfinite(norm) else _SHRINKAGE)
                fresh = False
                continue
            statistics[STEPS] += 1
            end = motion.breaks[piece + 1] if last else begin + since + step
            while m < output.time.shape[0] and output.time[m] <= end:
                if output.time[m] == end:
                    arg[:] = new
                    at = length if last else since + step
                else:
                    at = output.time[m] - begin
                    _interpolate(method, k, y, new, (at - since) / step, arg)
                _record(contacts, motion, piece, at, arg, output, m, f, work)
                m += 1
            if starting:
                first_step = step * scale
                starting = False
            y[:] = new
            since = length if last else since + step
            h = max(step * scale, h) if last else step * scale
            fresh = True
            if motion.stop_speed > 0.0:
                speed, change = 0.0, 0.0
                for i in range(3):
                    arm = motion.stop_radius if i == 2 else 1.0
                    speed += (arm * y[n - 6 + i]) ** 2
                    change += (arm * f0[n - 6 + i]) ** 2
                if math.sqrt(speed) + motion.stop_time * math.sqrt(change) < motion.stop_speed:
                    outcome = AT_REST
                    break
        if outcome != DONE:
            break
        _forget_unloaded(contacts, motion, piece, y)
        piece += 1
        since = 0.0
        fresh = True
    cursor[0], cursor[1] = piece, m
    clock[0], clock[1], clock[2] = since, h, first_step
    return outcome


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
