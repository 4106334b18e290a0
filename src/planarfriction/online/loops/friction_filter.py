"""Square-root Kalman filter for friction from samples of wrench, load and slip velocity (docs/online.md).

The unknowns x are what the slip sensor's count left out (3), the slip twist `V_S = F V` (3), `log mu_c`,
`log mu_s/mu_c`, the log of a scale of the radius, and the bias of the scaled wrench (3); their covariance is `S S'`.
Sliding is steady: `w = N g(|u|) D h(u) + b` with `u = D V_S`, `D = diag(1, 1, scale)`; Jacobians are those of the limit
surface and of the Stribeck curve. The probability of slip follows a hidden Markov chain: sliding has the velocity of x,
sticking none and a wrench within the surface.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction._engine.codegen.vectors import clear
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.published.surfaces import sliding, sliding_jacobian
from planarfriction.online.loops.clock import time_step
from planarfriction.online.loops.filter_state import BIAS, MU, RATIO, SCALE, TWIST
from planarfriction.online.loops.square_root import (
    N,
    measure,
    reset,
    spread,
    variance_of,
)

PEAK_TIME = 0.1
"""Time in which the peak of the wrench fades [s]."""

SEEN_TIME = 0.004
"""Time of the filter of the wrench [s]."""

PLACE_TIME = 0.06
"""Time in which the recent displacement fades [s]."""

LEAVES = 2.0
"""Rate at which a slip ends [1/s]."""

CREEPS = 0.2
"""Rate at which a slip begins within the surface [1/s]."""

BREAKS = 100.0
"""Rate at which a slip begins at the surface [1/s]."""

FRESH = 0.03
"""Standard deviation of the slip velocity at its beginning [m/s]."""

SLOW = 1.5
"""Sliding speed, in quanta, from which on the direction of the twist is known well enough to learn friction."""

MEMORY = 0.01
"""Time [s] within which samples inside the surface are one, not many, in the probability of slip."""

LARGEST_LOG = 7.0
"""Bound of the logs of mu_c, its ratio and the scale of the radius, which samples that fit nothing may not pass."""

EMPTY = 5.0
"""Standard deviations by which the wrench of an empty hand may differ from the bias: else it holds something."""

ESTIMATE = np.dtype(
    [
        ("twist", float, 3),
        *((name, float) for name in ("mu_c", "mu_s", "radius")),
        ("covariance", float, (3, 3)),
        ("determined", np.uint8, 3),
        *((name, float) for name in ("slip", "about_to_slip", "margin", "gauge")),
        ("flags", np.int64),
        ("seen", np.int64),
        *((name, float) for name in ("dt", "normal_force")),
        *((name, float, 3) for name in ("wrench", "velocity")),
    ],
    align=True,
)
"""Estimate after a sample, and the sample as controllers read it: 1 if wrench and load are there, time step, grip
force, wrench without its bias, and slip velocity."""

NONE = -1e3
"""Log of the gauge of a hand that has not gripped yet."""

NO_BIAS = 8
"""Flag (see `update`): the bias of the wrench is not known."""

NO_SIGN = 16
"""Flag: friction seems to do work, so a sign is wrong."""

NO_RANGE = 32
"""Flag: friction or radius is far from what was assumed."""

NO_FIT = 64
"""Flag: wrench and velocity contradict what was learnt."""

POWERS = 8.0
"""Velocities over which the mean of the dissipated power is taken."""

WORST = 1e3
"""Largest square of an innovation over its variance that counts in their mean [-]."""

UNLIKELY = 10.0
"""Mean above which wrench and velocity contradict what was learnt [-]: it stays below 4 with sensors that are right."""

FAR = 4.0
"""Standard deviations of what was assumed by which friction and radius may differ from it."""

NEAR = 0.1
"""Share of more load at which a part that is about to slip does [-]."""

SEEN_ERROR = 0.02
"""Relative error of the filtered wrench over load [-]."""

PEAK_ERROR = 0.06
"""Relative error of the peak of the wrench over load, taken as `mu_s` [-]."""


class Filter(NamedTuple):
    """Settings that do not change."""

    kind: int
    """Kind of the surface (see `surfaces`)."""
    size: int
    data: np.ndarray
    duals: np.ndarray
    """Directions over their dissipation `[M, 3]`, of one half of all."""
    frame: np.ndarray
    """`F` of `V_S = F V` `[3, 3]`."""
    back: np.ndarray
    """Its inverse `[3, 3]`."""
    conjugate: np.ndarray
    """`-F^-T`, which makes scaled wrenches `[3, 3]`."""
    radius: float
    """Contact radius of the surface at the reference load [m]."""
    reference: float
    """The reference load [N]."""
    growth: float
    """Growth of the radius: it goes as this power of the load [-]."""
    v_s: float
    gamma: float
    sigma_2: float
    noise: np.ndarray
    """Variances of the scaled wrench `[3]`."""
    quantum: float
    """Smallest slip velocity [m/s]."""
    place: float
    """Place that one count is [m]."""
    remainder: np.ndarray
    """Standard deviations of what a count leaves out, scaled `[3]` [m]."""
    model_error: float
    """Relative error of a wrench of the model [-], anew between velocities; as much stays in every radius and mu_s, and
    half of it in every mu_c."""
    drift: float
    """Random walk of `log mu_c` [1 per square root of s]."""
    saturation: float
    """Force at which the sensor saturates [N]."""
    least_load: float
    """Load [N] below which a contact says nothing of friction."""
    variance: float
    """Largest variance of the log of a number that is determined."""
    prior: np.ndarray
    """Assumed logs of mu_c, its ratio and the scale of the radius `[3]`."""
    prior_spread: np.ndarray
    """Their standard deviations `[3]`."""


@kernel
def _normal(x):
    """Return the distribution function of the normal distribution."""
    return 0.5 * math.erfc(-x * math.sqrt(0.5))


@kernel
def _row(matrix, i, vector):
    """Return number i of the product of a matrix `[3, 3]` and a vector `[3]`."""
    return (
        matrix[i, 0] * vector[0] + matrix[i, 1] * vector[1] + matrix[i, 2] * vector[2]
    )


@kernel
def known(vector):
    """Return True if no number of a vector `[3]` is missing or out of range."""
    return xp.in_range(vector[0]) and xp.in_range(vector[1]) and xp.in_range(vector[2])


@kernel
def _scale(settings, s, load):
    """Return the radius at a load over that of the surface."""
    return math.exp(s.x[SCALE] + settings.growth * math.log(load / settings.reference))


@kernel
def _gauge(settings, s, scale, best):
    """Return the gauge of the filtered wrench, the largest `w . dual`; the dual, a twist, goes to `best`."""
    x = s.seen[0]
    y = s.seen[1]
    z = s.seen[2] / scale
    most = 0.0
    for m in range(settings.duals.shape[0]):
        each = (
            x * settings.duals[m, 0]
            + y * settings.duals[m, 1]
            + z * settings.duals[m, 2]
        )
        if abs(each) > most:
            most = abs(each)
            sign = 1.0 if each > 0.0 else -1.0
            for i in range(3):
                best[i] = sign * settings.duals[m, i]
    s.lever = z * best[2] / max(most, 1e-9)
    return most


@kernel
def _move(settings, s, column):
    """Set the twist to the counted velocity plus what the count left out before, less what it left out at its end."""
    span = max(s.span, 1e-9)
    for i in range(3):
        if s.chain <= 2.0:
            reset(s, i, 0.0, settings.remainder[i], column)
        reset(s, TWIST + i, s.velocity[i] + s.x[i] / span, 0.0, column)
        for j in range(i + 1):
            s.root[TWIST + i, j] = s.root[i, j] / span
        reset(s, i, 0.0, settings.remainder[i], column)
        s.root[TWIST + i, i] -= settings.remainder[i] / span


@kernel
def _measure(s, h, miss, variance, column):
    """Update the unknowns with a measurement, their logs within bounds; return the scaled innovation."""
    scaled = measure(s, h, miss, variance, column)
    for i in range(MU, BIAS):
        s.x[i] = min(max(s.x[i], -LARGEST_LOG), LARGEST_LOG)
    return scaled


@kernel
def _learn(settings, s, h, column, jacobian):
    """Update with the mean wrench and the velocity of the samples before the last velocity, which were sliding."""
    _move(settings, s, column)
    count = s.old_count
    if count == 0.0:
        return
    load = s.old_loads / count
    before = s.x[SCALE]
    power = 0.0
    force2 = 0.0
    speed2 = 0.0
    misfit = 0.0
    for i in range(3):
        w = load * s.old_sum[i] / count - s.x[BIAS + i]
        power += w * s.x[TWIST + i]
        force2 += w * w
        speed2 += s.x[TWIST + i] * s.x[TWIST + i]
    s.dissipated += (
        power / math.sqrt(max(force2 * speed2, 1e-300)) - s.dissipated
    ) / POWERS
    if s.dissipated < 0.0:
        return  # friction that drives teaches nothing
    for row in range(3):
        mu = math.exp(s.x[MU])
        ratio = math.exp(s.x[RATIO])
        scale = _scale(settings, s, load)
        x = s.x[TWIST]
        y = s.x[TWIST + 1]
        z = scale * s.x[TWIST + 2]
        speed = math.sqrt(x * x + y * y + z * z)
        u = sliding(settings.kind, settings.data, 0, settings.size, x, y, z, speed)
        sliding_jacobian(
            settings.kind, settings.data, 0, settings.size, x, y, z, speed, jacobian
        )
        power = math.pow(speed / settings.v_s, settings.gamma)
        fade = math.exp(-power)
        steady = mu * (1.0 + (ratio - 1.0) * fade)
        g = steady + settings.sigma_2 * speed  # viscous friction along h: it is small
        by_speed = (
            settings.sigma_2
            - mu * (ratio - 1.0) * fade * settings.gamma * power / speed
        )
        along = (u[0] if row == 0 else (u[1] if row == 1 else u[2])) / speed
        factor = load * (scale if row == 2 else 1.0)
        clear(h, N)
        for j in range(3):
            unit = (x if j == 0 else (y if j == 1 else z)) / speed
            slope = (
                g * (jacobian[3 * row + j] - along * unit) / speed
                + by_speed * along * unit
            )
            h[TWIST + j] = factor * slope * (scale if j == 2 else 1.0)
        h[MU] = factor * steady * along
        h[RATIO] = factor * along * mu * ratio * fade
        h[SCALE] = h[TWIST + 2] * s.x[TWIST + 2] + (
            factor * g * along if row == 2 else 0.0
        )
        h[BIAS + row] = 1.0
        error = settings.model_error * factor * g
        variance = settings.noise[row] / count + error * error
        miss = load * s.old_sum[row] / count - factor * g * along - s.x[BIAS + row]
        scaled = _measure(s, h, miss, variance, column)
        misfit += scaled * scaled / 3.0
    s.misfit += (min(misfit, WORST) - s.misfit) / POWERS
    s.bound -= s.lever * (s.x[SCALE] - before)


@kernel
def _see(settings, s, v, h, column, jacobian):
    """Take a slip velocity, the mean since the last; return the log of the odds that it is a slip."""
    span = min(s.rest, PLACE_TIME)
    odds = 0.0
    rest = 0.7 * settings.quantum
    sd2 = FRESH * FRESH
    speed2 = 0.0
    far2 = 0.0
    for i in range(3):
        s.place[i] = s.place[i] * math.exp(-span / PLACE_TIME) + v[i] * span
        far2 += s.place[i] * s.place[i]
        speed2 += v[i] * v[i]
        miss = v[i] - (s.x[TWIST + i] if s.slip > 0.5 else 0.0)
        odds += 0.5 * (
            v[i] * v[i] / (rest * rest) - miss * miss / sd2
        ) - 0.5 * math.log(sd2 / (rest * rest))
    moves = speed2 > SLOW * SLOW * settings.quantum * settings.quantum
    if moves and s.chain >= 2.0:
        _learn(settings, s, h, column, jacobian)
    s.chain = s.chain + 1.0 if moves else 0.0
    for i in range(3):
        s.old_sum[i] = s.sum[i]
        s.velocity[i] = v[i]
        s.sum[i] = 0.0
        reset(s, TWIST + i, v[i], settings.quantum, column)
    s.old_loads, s.old_count, s.span = s.loads, s.count, s.rest
    s.loads = 0.0
    s.count = 0.0
    s.rest = 0.0
    return min(max(odds, -8.0), 8.0) + (
        8.0 if far2 > 16.0 * settings.place * settings.place else 0.0
    )


@kernel
def _tare(settings, s, wrench, load, h, column):
    """Learn the bias from a wrench of an empty hand, if it may be one."""
    taken = 0.0
    for i in range(3):
        w = _row(settings.conjugate, i, wrench) - s.x[BIAS + i]
        friction = math.exp(s.x[MU]) * load
        variance = settings.noise[i] + friction * friction
        if w * w < EMPTY * EMPTY * (variance + variance_of(s, BIAS + i, BIAS + i)):
            for k in range(N):
                h[k] = 1.0 if k == BIAS + i else 0.0
            _measure(s, h, w, variance, column)
            taken += 1.0
    if taken == 3.0:
        s.tared = 1.0


@kernel
def _judge(settings, s, load, dt, best):
    """Update the probability of slip with the filtered wrench over load."""
    sd_s = math.sqrt(variance_of(s, MU, RATIO) + SEEN_ERROR * SEEN_ERROR)
    sd_c = math.sqrt(variance_of(s, MU, MU) + SEEN_ERROR * SEEN_ERROR)
    level = math.log(max(_gauge(settings, s, _scale(settings, s, load), best), 1e-9))
    inside = max(0.0, (s.x[MU] - level) / sd_c - 2.0)
    begins = CREEPS + BREAKS * _normal((level - s.x[MU] - s.x[RATIO]) / sd_s - 1.0)
    p = s.slip
    p = p + (1.0 - p) * min(begins * dt, 0.5) - p * min(LEAVES * dt, 0.5)
    against = math.exp(-0.5 * min(inside * inside, 50.0) * dt / MEMORY)
    s.slip = p * against / (p * against + 1.0 - p)
    s.gauge = level


@kernel
def _doubt(settings, s):
    """Return the sum of the flags of numbers that contradict what was assumed."""
    flags = (0 if s.tared > 0.0 else NO_BIAS) + (NO_SIGN if s.dissipated < 0.0 else 0)
    reach = FAR * math.hypot(settings.prior_spread[0], settings.prior_spread[1])
    far = s.gauge > settings.prior[0] + settings.prior[1] + reach
    for i in range(3):
        far = (
            far or abs(s.x[MU + i] - settings.prior[i]) > FAR * settings.prior_spread[i]
        )
    return flags + (NO_RANGE if far else (NO_FIT if s.misfit > UNLIKELY else 0))


@kernel
def _root_of_log(s, i, j):
    """Return number j of row i of the root of the covariance of the logs of mu_c, mu_s and the radius."""
    return s.root[MU if i < 2 else SCALE, j] + (s.root[RATIO, j] if i == 1 else 0.0)


@kernel
def _estimate(settings, s, e):
    """Write an estimate after a sample."""
    for i in range(3):
        e.twist[i] = _row(settings.back, i, s.x[TWIST:MU]) if s.slip > 0.5 else 0.0
        for j in range(3):
            e.wrench[i] += settings.frame[j, i] * s.x[BIAS + j]
    log_s = max(s.x[MU] + max(s.x[RATIO], 0.0), s.bound)
    e.mu_c = math.exp(s.x[MU])
    e.mu_s = math.exp(log_s)
    e.radius = settings.radius * math.exp(s.x[SCALE])
    for i in range(3):
        for k in range(3):
            total = 0.0
            for j in range(N):
                total += _root_of_log(s, i, j) * _root_of_log(s, k, j)
            floor = (
                settings.model_error
                * settings.model_error
                * (0.5 if i == 0 else 1.0)
                * (0.5 if k == 0 else 1.0)
            )
            e.covariance[i, k] = total + (floor if (i < 2) == (k < 2) else 0.0)
        e.determined[i] = (
            1 if e.covariance[i, i] <= settings.variance and e.flags < NO_BIAS else 0
        )
    sd = math.sqrt(e.covariance[1, 1] + SEEN_ERROR * SEEN_ERROR)
    e.slip = s.slip
    e.about_to_slip = (1.0 - s.slip) * _normal((s.gauge + NEAR - log_s) / sd)
    e.margin = 1.0 - math.exp(min(s.gauge - log_s, 50.0))
    e.gauge = math.exp(s.gauge)


@jit
def update(settings, states, samples, found):
    """Update states `[P]` of dtype `STATE` with a sample each; `found [P]` of dtype `ESTIMATE` gets what is known.

    Samples `[P, 8]` are time, wrench, load and slip velocity; NaN is none. `flags` is the sum of what was odd: 1 no or
    bad wrench or load, 2 time that does not go on or jumps, 4 saturated sensor, 8 unknown bias, 16 friction that
    drives the slip (a sign), 32 friction or radius far from what was assumed (a unit), 64 wrench
    and slip velocity contradict what was found.
    """
    h = np.empty(N)
    column = np.empty(N)
    jacobian = np.empty(9)
    best = np.empty(3)
    v = np.empty(3)
    for p in range(states.shape[0]):
        s = states[p]
        e = found[p]
        now = samples[p, 0]
        wrench = samples[p, 1:4]
        load = samples[p, 4]
        velocity = samples[p, 5:]
        dt = time_step(s, now)
        flags = 2 if s.back > 0.0 else 0
        force = math.hypot(wrench[0], wrench[1])
        good = xp.in_range(load) and xp.in_range(force) and xp.in_range(wrench[2])
        # After a grip no load is not an empty hand.
        lost = good and load <= settings.least_load and s.gauge > NONE
        flags += 0 if good and not lost else 1
        if good and force >= settings.saturation:
            flags += 4
            good = False
        if dt > 0.0:
            if settings.drift > 0.0:
                spread(s, MU, settings.drift * settings.drift * dt, column)
            s.peak -= dt / PEAK_TIME
            s.bound -= settings.drift * math.sqrt(dt)
            s.rest += dt
        before = s.slip
        if good and load <= settings.least_load and dt > 0.0:
            _tare(settings, s, wrench, load, h, column)
        elif good and dt > 0.0:
            share = 1.0 - math.exp(-dt / SEEN_TIME)
            for i in range(3):
                w = _row(settings.conjugate, i, wrench)
                s.seen[i] += share * ((w - s.x[BIAS + i]) / load - s.seen[i])
                s.sum[i] += w / load
            s.loads += load
            s.count += 1.0
            _judge(settings, s, load, dt, best)
            s.peak = max(s.peak, s.gauge)
            if s.slip < 0.1:
                s.bound = max(s.bound, s.gauge)
        if known(velocity) and dt > 0.0:
            for i in range(3):
                v[i] = _row(settings.frame, i, velocity)
            odds = math.exp(_see(settings, s, v, h, column, jacobian))
            s.slip = s.slip * odds / (s.slip * odds + 1.0 - s.slip)
        s.slip = min(max(s.slip, 1e-9), 1.0 - 1e-9)
        if before <= 0.5 < s.slip and s.peak > -9.0:
            for i in range(N):
                h[i] = 1.0 if i in (MU, RATIO) else 0.0
            h[SCALE] = s.lever
            _measure(
                s,
                h,
                s.peak - s.x[MU] - s.x[RATIO],
                PEAK_ERROR * PEAK_ERROR,
                column,
            )
        e.flags = flags + _doubt(settings, s)
        e.dt = dt
        e.normal_force = load
        e.seen = 1 if good and not lost else 0
        for i in range(3):
            e.wrench[i] = wrench[i]
            e.velocity[i] = velocity[i]
        _estimate(settings, s, e)
