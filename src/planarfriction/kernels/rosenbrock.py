"""The structured Rosenbrock step: linear cost in cells, because bristles meet only in the body's three accelerations.

State vector: bristles of every contact, body velocity `u = (vx, vy, omega)`, pose `(x, y, theta)`. One stage solves
`(shift I - J) k = rhs` with `shift = 1/(h gamma)`: the bristles are eliminated contact by contact, which leaves a 6 x 6
system for the body, and are recovered from its solution. Loads and forces are linear in time within a piece.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.kernels import contacts as ct
from planarfriction.kernels import jit
from planarfriction.kernels.law import law_of

DONE, PAUSED, STEP_TOO_SMALL, NOT_FINITE, AT_REST = 0, 1, 2, 3, 4
"""Outcomes of `advance`."""

STEPS, REJECTIONS, EVALUATIONS, JACOBIANS = 0, 1, 2, 3
"""Rows of the statistics."""


class Motion(NamedTuple):
    """A planar body and its inputs on the S pieces between breaks, each linear in the time since the piece began."""

    inverse_mass: np.ndarray
    """1/m, 1/m, 1/I; zeros where the velocity is prescribed, [3]."""
    body_axes: bool
    """The velocity is prescribed, in body axes."""
    breaks: np.ndarray
    """Times [S + 1]."""
    load: np.ndarray
    """Normal force per contact, at the start of the piece and its slope, [S, 2, C]."""
    force: np.ndarray
    """Applied force and torque at the centre of mass, start and slope, [S, 2, 3]."""
    velocity: np.ndarray
    """Prescribed velocity at the start of each piece, [S, 3]; empty [0, 3] for a free body."""
    acceleration: np.ndarray
    """Gravity, or the slope of the prescribed velocity, [S, 3]."""
    row: np.ndarray
    """Shape of each contact on each piece, int [S, C]."""
    stop_speed: float
    """End when the body's speed and its change within the bristles' time are below this [m/s]; 0: never."""
    stop_radius: float
    """Lever arm that turns spin into speed for that test [m]."""
    stop_time: float
    """The bristles' time, sigma_1/sigma_0 [s]."""


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


@jit
def _contact_twist(a, u, v):
    for i in range(3):
        v[i] = a[i, 0] * u[0] + a[i, 1] * u[1] + a[i, 2] * u[2]


@jit
def rates(contacts, motion, laws, piece, since, y, dy, w, a):
    """Right-hand side `dy` at `since` seconds into a piece; wrenches per unit load into `w` [C, 3]."""
    o = y.shape[0] - 6
    u, pose = y[o : o + 3], y[o + 3 :]
    v = np.empty(3)
    fx, fy, tau = 0.0, 0.0, 0.0
    for c in range(contacts.kind.shape[0]):
        first, last = contacts.state[c], contacts.state[c + 1]
        ct.contact_map(contacts.mount[c], contacts.place[c], u, pose, a)
        _contact_twist(a, u, v)
        ct.evaluate(contacts, c, motion.row[piece, c], laws[c], y[first:last], v, dy[first:last], w[c])
        load = contacts.count[c] * (motion.load[piece, 0, c] + since * motion.load[piece, 1, c])
        fx += load * (a[0, 0] * w[c, 0] + a[1, 0] * w[c, 1])
        fy += load * (a[0, 1] * w[c, 0] + a[1, 1] * w[c, 1])
        tau += load * (a[0, 2] * w[c, 0] + a[1, 2] * w[c, 1] + w[c, 2])
    force = motion.force[piece]
    gravity = motion.acceleration[piece]
    dy[o] = gravity[0] + motion.inverse_mass[0] * (force[0, 0] + since * force[1, 0] + fx)
    dy[o + 1] = gravity[1] + motion.inverse_mass[1] * (force[0, 1] + since * force[1, 1] + fy)
    dy[o + 2] = gravity[2] + motion.inverse_mass[2] * (force[0, 2] + since * force[1, 2] + tau)
    if motion.body_axes:
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        dy[o + 3] = cos * u[0] - sin * u[1]
        dy[o + 4] = sin * u[0] + cos * u[1]
    else:
        dy[o + 3] = u[0]
        dy[o + 4] = u[1]
    dy[o + 5] = u[2]


@jit
def _linearise(contacts, motion, laws, piece, since, y, w, lin, maps):
    """Linearise every contact; maps [C, 3, 3, 3] receives A, G, H."""
    o = y.shape[0] - 6
    u, pose = y[o : o + 3], y[o + 3 :]
    v = np.empty(3)
    for c in range(contacts.kind.shape[0]):
        ct.contact_map(contacts.mount[c], contacts.place[c], u, pose, maps[c, 0])
        ct.contact_map_slopes(contacts.mount[c], maps[c, 0], u, w[c], maps[c, 1], maps[c, 2])
        _contact_twist(maps[c, 0], u, v)
        ct.linearise(
            contacts,
            c,
            motion.row[piece, c],
            laws[c],
            y[contacts.state[c] : contacts.state[c + 1]],
            v,
            lin[contacts.linear[c] : contacts.linear[c + 1]],
        )


@jit
def _factor(contacts, motion, laws, piece, since, y, shift, lin, maps, matrix, pivot):
    """Eliminate the bristles and factor the 6 x 6 body matrix."""
    o = y.shape[0] - 6
    stiffness = np.empty((3, 3))
    matrix[:] = 0.0
    for c in range(contacts.kind.shape[0]):
        ct.factor(
            contacts,
            c,
            motion.row[piece, c],
            laws[c],
            y[contacts.state[c] : contacts.state[c + 1]],
            shift,
            lin[contacts.linear[c] : contacts.linear[c + 1]],
            stiffness,
        )
        load = contacts.count[c] * (motion.load[piece, 0, c] + since * motion.load[piece, 1, c])
        a, g, h = maps[c, 0], maps[c, 1], maps[c, 2]
        for i in range(3):
            for j in range(3):
                to_velocity, to_pose = 0.0, h[i, j]
                for p in range(3):
                    for q in range(3):
                        to_velocity += a[p, i] * stiffness[p, q] * a[q, j]
                        to_pose += a[p, i] * stiffness[p, q] * g[q, j]
                matrix[i, j] -= motion.inverse_mass[i] * load * to_velocity
                matrix[i, 3 + j] -= motion.inverse_mass[i] * load * to_pose
    if motion.body_axes:
        cos, sin = math.cos(y[o + 5]), math.sin(y[o + 5])
        matrix[3, 0], matrix[3, 1], matrix[4, 0], matrix[4, 1] = -cos, sin, -sin, -cos
        matrix[3, 5] = sin * y[o] + cos * y[o + 1]
        matrix[4, 5] = sin * y[o + 1] - cos * y[o]
    else:
        matrix[3, 0] = -1.0
        matrix[4, 1] = -1.0
    matrix[5, 2] = -1.0
    for i in range(6):
        matrix[i, i] += shift
    for k in range(6):
        best = k
        for i in range(k + 1, 6):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivot[k] = best
        if best != k:
            for j in range(6):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, 6):
            matrix[i, k] /= matrix[k, k]
            for j in range(k + 1, 6):
                matrix[i, j] -= matrix[i, k] * matrix[k, j]


@jit
def _solve(contacts, motion, laws, piece, since, y, shift, lin, maps, matrix, pivot, r, out):
    """Solve `(shift I - J) out = r`."""
    o = y.shape[0] - 6
    w, v, b = np.empty(3), np.empty(3), np.empty(6)
    for i in range(6):
        b[i] = r[o + i]
    for c in range(contacts.kind.shape[0]):
        first, last = contacts.state[c], contacts.state[c + 1]
        ct.eliminate(
            contacts,
            c,
            motion.row[piece, c],
            laws[c],
            y[first:last],
            shift,
            r[first:last],
            lin[contacts.linear[c] : contacts.linear[c + 1]],
            w,
        )
        load = contacts.count[c] * (motion.load[piece, 0, c] + since * motion.load[piece, 1, c])
        a = maps[c, 0]
        for i in range(3):
            b[i] += motion.inverse_mass[i] * load * (a[0, i] * w[0] + a[1, i] * w[1] + a[2, i] * w[2])
    for k in range(6):
        p = pivot[k]
        b[k], b[p] = b[p], b[k]
        for i in range(k + 1, 6):
            b[i] -= matrix[i, k] * b[k]
    for i in range(5, -1, -1):
        for j in range(i + 1, 6):
            b[i] -= matrix[i, j] * b[j]
        b[i] /= matrix[i, i]
        out[o + i] = b[i]
    for c in range(contacts.kind.shape[0]):
        first, last = contacts.state[c], contacts.state[c + 1]
        a, g = maps[c, 0], maps[c, 1]
        for i in range(3):
            v[i] = 0.0
            for j in range(3):
                v[i] += a[i, j] * b[j] + g[i, j] * b[3 + j]
        ct.back_substitute(
            contacts,
            c,
            motion.row[piece, c],
            y[first:last],
            shift,
            r[first:last],
            v,
            lin[contacts.linear[c] : contacts.linear[c + 1]],
            out[first:last],
        )


@jit
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


@jit
def _record(contacts, motion, laws, piece, since, y, output, m, dy, w, a):
    rates(contacts, motion, laws, piece, since, y, dy, w, a)
    o = y.shape[0] - 6
    output.body[m, :] = y[o:]
    for c in range(contacts.kind.shape[0]):
        load = motion.load[piece, 0, c] + since * motion.load[piece, 1, c]
        output.load[m, c] = load
        for i in range(3):
            output.wrench[m, c, i] = load * w[c, i]
    if output.bristles.shape[0] > 0:
        output.bristles[m, :] = y[:o]


@jit
def _combine(coefficients, stages, count, base, out):
    """`out = base + sum coefficients_j stages_j` over the first `count` stages."""
    n = base.shape[0]
    for i in range(n):
        out[i] = base[i]
    for j in range(count):
        c = coefficients[j]
        if c != 0.0:
            stage = stages[j]
            for i in range(n):
                out[i] += c * stage[i]


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
    n_contacts = contacts.kind.shape[0]
    w, w0 = np.empty((n_contacts, 3)), np.empty((n_contacts, 3))
    a = np.empty((3, 3))
    maps = np.zeros((n_contacts, 3, 3, 3))
    lin = np.empty(contacts.linear[n_contacts])
    matrix, pivot = np.empty((6, 6)), np.empty(6, np.int64)
    laws = [law_of(contacts.law[c]) for c in range(n_contacts)]
    zeros = np.zeros(n)
    piece, m = cursor[0], cursor[1]
    since, h, first_step = clock[0], clock[1], clock[2]
    taken = 0
    fresh = True  # f0 and the linearisation belong to y
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
            _record(contacts, motion, laws, piece, 0.0, y, output, m, f, w, a)
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
                rates(contacts, motion, laws, piece, since, y, f0, w0, a)
                _linearise(contacts, motion, laws, piece, since, y, w0, lin, maps)
                statistics[EVALUATIONS] += 1
                statistics[JACOBIANS] += 1
                for i in range(3):
                    total = motion.force[piece, 1, i]
                    for c in range(n_contacts):
                        slope = contacts.count[c] * motion.load[piece, 1, c]
                        for p in range(3):
                            total += slope * maps[c, 0, p, i] * w0[c, p]
                    ft[i] = motion.inverse_mass[i] * total
            shift = 1.0 / (step * method.gamma)
            _factor(contacts, motion, laws, piece, since, y, shift, lin, maps, matrix, pivot)
            for i in range(s):
                for j in range(i):
                    couplings[j] = method.c[i, j] / step
                if i == 0:
                    _combine(couplings, k, 0, f0, r)
                else:
                    _combine(method.a[i], k, i, y, arg)
                    rates(contacts, motion, laws, piece, since + method.alpha[i] * step, arg, f, w, a)
                    _combine(couplings, k, i, f, r)
                    statistics[EVALUATIONS] += 1
                for p in range(3):
                    r[n - 6 + p] += method.time_gamma[i] * step * ft[p]
                _solve(contacts, motion, laws, piece, since, y, shift, lin, maps, matrix, pivot, r, k[i])
            _combine(method.m, k, s, y, new)
            _combine(method.e, k, s, zeros, error)
            norm = _error_norm(contacts, y, new, error, rtol, atol)
            taken += 1
            factor = min(6.0, max(0.1, 0.9 * max(norm, 1e-10) ** (-1.0 / method.order)))
            if norm > 1.0:
                statistics[REJECTIONS] += 1
                h = step * (factor if math.isfinite(norm) else 0.1)
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
                _record(contacts, motion, laws, piece, at, arg, output, m, f, w, a)
                m += 1
            if starting:
                first_step = step * factor if step < remaining else first_step
                starting = False
            y[:] = new
            since = length if last else since + step
            h = max(step * factor, h) if last else step * factor
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
        piece += 1
        since = 0.0
        fresh = True
    cursor[0], cursor[1] = piece, m
    clock[0], clock[1], clock[2] = since, h, first_step
    return outcome


@jit
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
