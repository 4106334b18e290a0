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

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.kernels.surfaces import sliding, sliding_jacobian
from planarfriction.kernels.vectors import clear
from planarfriction.online.loops.filter_state import (
    BACK,
    BIAS,
    BOUND,
    CHAIN,
    COUNT,
    DISSIPATED,
    GAUGE,
    LEVER,
    LOADS,
    MU,
    OLD,
    PEAK,
    PLACE,
    RATIO,
    REST,
    SCALE,
    SEEN,
    SLIP,
    SUM,
    TARED,
    TIME,
    TWIST,
)
from planarfriction.online.loops.square_root import ROOT, N, measure, reset, spread, variance_of

RESTART = 10.0
"""Samples in a row whose time went back after which the clock counts as set anew."""

PEAK_TIME, SEEN_TIME, PLACE_TIME = 0.1, 0.004, 0.06
"""Times in which the peak of the wrench, its filter and the recent displacement fade [s]."""

LEAVES, CREEPS, BREAKS = 2.0, 0.2, 100.0
"""Rates at which a slip ends, and at which one begins within the surface and at it [1/s]."""

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
        *((name, float) for name in ("dt", "normal_force")),
        *((name, float, 3) for name in ("wrench", "velocity")),
    ],
    align=True,
)
"""Estimate after a sample, and the sample as controllers read it: time step, grip force, wrench without its bias, and
slip velocity."""

NO_BIAS, NO_SIGN, NO_RANGE = 8, 16, 32
"""Flags of numbers that nothing is determined by (see `update`)."""

POWERS = 8.0
"""Velocities over which the mean of the dissipated power is taken."""

FAR = 4.0
"""Standard deviations of what was assumed by which friction and radius may differ from it."""

NEAR = 0.1
"""Share of more load at which a part that is about to slip does [-]."""

SEEN_ERROR, PEAK_ERROR = 0.02, 0.06
"""Relative errors of the filtered wrench over load, and of its peak as `mu_s` [-]."""


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
def _scale(settings, s, load):
    """Return the radius at a load over that of the surface."""
    return math.exp(s[SCALE] + settings.growth * math.log(load / settings.reference))


@kernel
def _gauge(settings, s, scale, best):
    """Return the gauge of the filtered wrench, the largest `w . dual`; the dual, a twist, goes to `best`."""
    x, y, z, most = s[SEEN], s[SEEN + 1], s[SEEN + 2] / scale, 0.0
    for m in range(settings.duals.shape[0]):
        each = x * settings.duals[m, 0] + y * settings.duals[m, 1] + z * settings.duals[m, 2]
        if abs(each) > most:
            most = abs(each)
            sign = 1.0 if each > 0.0 else -1.0
            for i in range(3):
                best[i] = sign * settings.duals[m, i]
    s[LEVER] = z * best[2] / max(most, 1e-9)
    return most


@kernel
def _move(settings, s, column):
    """Set the twist to the counted velocity plus what the count left out before, less what it left out at its end."""
    span = max(s[OLD + 8], 1e-9)
    for i in range(3):
        if s[CHAIN] <= 2.0:
            reset(s, i, 0.0, settings.remainder[i], column)
        reset(s, TWIST + i, s[OLD + 5 + i] + s[i] / span, 0.0, column)
        for j in range(i + 1):
            s[ROOT + N * (TWIST + i) + j] = s[ROOT + N * i + j] / span
        reset(s, i, 0.0, settings.remainder[i], column)
        s[ROOT + N * (TWIST + i) + i] -= settings.remainder[i] / span


@kernel
def _measure(s, h, miss, variance, column):
    """Update the unknowns with a measurement, their logs within bounds."""
    measure(s, h, miss, variance, column)
    for i in range(MU, BIAS):
        s[i] = min(max(s[i], -LARGEST_LOG), LARGEST_LOG)


@kernel
def _learn(settings, s, h, column, jacobian):
    """Update with the mean wrench and the velocity of the samples before the last velocity, which were sliding."""
    _move(settings, s, column)
    count = s[OLD + 4]
    if count == 0.0:
        return
    load = s[OLD + 3] / count
    before, power, force2, speed2 = s[SCALE], 0.0, 0.0, 0.0
    for i in range(3):
        w = load * s[OLD + i] / count - s[BIAS + i]
        power, force2, speed2 = power + w * s[TWIST + i], force2 + w * w, speed2 + s[TWIST + i] * s[TWIST + i]
    s[DISSIPATED] += (power / math.sqrt(max(force2 * speed2, 1e-300)) - s[DISSIPATED]) / POWERS
    if s[DISSIPATED] < 0.0:
        return  # friction that drives teaches nothing
    for row in range(3):
        mu, ratio, scale = math.exp(s[MU]), math.exp(s[RATIO]), _scale(settings, s, load)
        x, y, z = s[TWIST], s[TWIST + 1], scale * s[TWIST + 2]
        speed = math.sqrt(x * x + y * y + z * z)
        u = sliding(settings.kind, settings.data, 0, settings.size, x, y, z, speed)
        sliding_jacobian(settings.kind, settings.data, 0, settings.size, x, y, z, speed, jacobian)
        power = math.pow(speed / settings.v_s, settings.gamma)
        fade = math.exp(-power)
        steady = mu * (1.0 + (ratio - 1.0) * fade)
        g = steady + settings.sigma_2 * speed  # viscous friction along h: it is small
        by_speed = settings.sigma_2 - mu * (ratio - 1.0) * fade * settings.gamma * power / speed
        along = (u[0] if row == 0 else (u[1] if row == 1 else u[2])) / speed
        factor = load * (scale if row == 2 else 1.0)
        clear(h, N)
        for j in range(3):
            unit = (x if j == 0 else (y if j == 1 else z)) / speed
            slope = g * (jacobian[3 * row + j] - along * unit) / speed + by_speed * along * unit
            h[TWIST + j] = factor * slope * (scale if j == 2 else 1.0)
        h[MU] = factor * steady * along
        h[RATIO] = factor * along * mu * ratio * fade
        h[SCALE] = h[TWIST + 2] * s[TWIST + 2] + (factor * g * along if row == 2 else 0.0)
        h[BIAS + row] = 1.0
        error = settings.model_error * factor * g
        variance = settings.noise[row] / count + error * error
        _measure(s, h, load * s[OLD + row] / count - factor * g * along - s[BIAS + row], variance, column)
    s[BOUND] -= s[LEVER] * (s[SCALE] - before)


@kernel
def _see(settings, s, v, h, column, jacobian):
    """Take a slip velocity, the mean since the last; return the log of the odds that it is a slip."""
    span = min(s[REST], PLACE_TIME)
    odds, rest, sd2, speed2, far2 = 0.0, 0.7 * settings.quantum, FRESH * FRESH, 0.0, 0.0
    for i in range(3):
        s[PLACE + i] = s[PLACE + i] * math.exp(-span / PLACE_TIME) + v[i] * span
        far2 += s[PLACE + i] * s[PLACE + i]
        speed2 += v[i] * v[i]
        miss = v[i] - (s[TWIST + i] if s[SLIP] > 0.5 else 0.0)
        odds += 0.5 * (v[i] * v[i] / (rest * rest) - miss * miss / sd2) - 0.5 * math.log(sd2 / (rest * rest))
    moves = speed2 > SLOW * SLOW * settings.quantum * settings.quantum
    if moves and s[CHAIN] >= 2.0:
        _learn(settings, s, h, column, jacobian)
    s[CHAIN] = s[CHAIN] + 1.0 if moves else 0.0
    for i in range(3):
        s[OLD + i], s[OLD + 5 + i] = s[SUM + i], v[i]
        s[SUM + i] = 0.0
        reset(s, TWIST + i, v[i], settings.quantum, column)
    s[OLD + 3], s[OLD + 4], s[OLD + 8], s[LOADS], s[COUNT], s[REST] = s[LOADS], s[COUNT], s[REST], 0.0, 0.0, 0.0
    return min(max(odds, -8.0), 8.0) + (8.0 if far2 > 16.0 * settings.place * settings.place else 0.0)


@kernel
def _tare(settings, s, wrench, load, h, column):
    """Learn the bias from a wrench of an empty hand, if it may be one."""
    taken = 0.0
    for i in range(3):
        w = -s[BIAS + i]
        for j in range(3):
            w += settings.conjugate[i, j] * wrench[j]
        friction = math.exp(s[MU]) * load
        variance = settings.noise[i] + friction * friction
        if w * w < EMPTY * EMPTY * (variance + variance_of(s, BIAS + i, BIAS + i)):
            for k in range(N):
                h[k] = 1.0 if k == BIAS + i else 0.0
            _measure(s, h, w, variance, column)
            taken += 1.0
    if taken == 3.0:
        s[TARED] = 1.0


@kernel
def _judge(settings, s, load, dt, best):
    """Update the probability of slip with the filtered wrench over load."""
    sd_s = math.sqrt(variance_of(s, MU, RATIO) + SEEN_ERROR * SEEN_ERROR)
    sd_c = math.sqrt(variance_of(s, MU, MU) + SEEN_ERROR * SEEN_ERROR)
    level = math.log(max(_gauge(settings, s, _scale(settings, s, load), best), 1e-9))
    inside = max(0.0, (s[MU] - level) / sd_c - 2.0)
    begins = CREEPS + BREAKS * _normal((level - s[MU] - s[RATIO]) / sd_s - 1.0)
    p = s[SLIP]
    p = p + (1.0 - p) * min(begins * dt, 0.5) - p * min(LEAVES * dt, 0.5)
    against = math.exp(-0.5 * min(inside * inside, 50.0) * dt / MEMORY)
    s[SLIP] = p * against / (p * against + 1.0 - p)
    s[GAUGE] = level


@kernel
def _doubt(settings, s):
    """Return the sum of the flags of numbers that contradict what was assumed."""
    flags = (0 if s[TARED] > 0.0 else NO_BIAS) + (NO_SIGN if s[DISSIPATED] < 0.0 else 0)
    reach = FAR * math.hypot(settings.prior_spread[0], settings.prior_spread[1])
    far = s[GAUGE] > settings.prior[0] + settings.prior[1] + reach
    for i in range(3):
        far = far or abs(s[MU + i] - settings.prior[i]) > FAR * settings.prior_spread[i]
    return flags + (NO_RANGE if far else 0)


@kernel
def _estimate(settings, s, e):
    """Write an estimate after a sample."""
    for i in range(3):
        e.twist[i] = 0.0
        for j in range(3):
            e.twist[i] += settings.back[i, j] * s[TWIST + j] if s[SLIP] > 0.5 else 0.0
            e.wrench[i] += settings.frame[j, i] * s[BIAS + j]
    log_s = max(s[MU] + max(s[RATIO], 0.0), s[BOUND])
    e.mu_c, e.mu_s, e.radius = math.exp(s[MU]), math.exp(log_s), settings.radius * math.exp(s[SCALE])
    for i in range(3):
        for k in range(3):
            total = 0.0
            for j in range(N):
                a = s[ROOT + N * (MU if i < 2 else SCALE) + j] + (s[ROOT + N * RATIO + j] if i == 1 else 0.0)
                b = s[ROOT + N * (MU if k < 2 else SCALE) + j] + (s[ROOT + N * RATIO + j] if k == 1 else 0.0)
                total += a * b
            floor = settings.model_error * settings.model_error * (0.5 if i == 0 else 1.0) * (0.5 if k == 0 else 1.0)
            e.covariance[i, k] = total + (floor if (i < 2) == (k < 2) else 0.0)
        e.determined[i] = 1 if e.covariance[i, i] <= settings.variance and e.flags < NO_BIAS else 0
    sd = math.sqrt(e.covariance[1, 1] + SEEN_ERROR * SEEN_ERROR)
    e.slip, e.about_to_slip = s[SLIP], (1.0 - s[SLIP]) * _normal((s[GAUGE] + NEAR - log_s) / sd)
    e.margin = 1.0 - math.exp(min(s[GAUGE] - log_s, 50.0))
    e.gauge = math.exp(s[GAUGE])


@jit
def update(settings, states, samples, found):
    """Update states `[P, STATE]` with a sample each; `found [P]` of dtype `ESTIMATE` gets what is known.

    Samples `[P, 8]` are time, wrench, load and slip velocity; NaN is none. `flags` is the sum of what was odd: 1 no or
    bad wrench or load, 2 time that does not go on, 4 saturated sensor, 8 unknown bias, 16 friction that drives the slip
    (a sign), 32 friction or radius far from what was assumed (a unit).
    """
    h, column, jacobian, best, v = np.empty(N), np.empty(N), np.empty(9), np.empty(3), np.empty(3)
    for p in range(states.shape[0]):
        s, e, flags = states[p], found[p], 0
        now, wrench, load, velocity = samples[p, 0], samples[p, 1:4], samples[p, 4], samples[p, 5:]
        dt = now - s[TIME]
        if not xp.in_range(now) or dt <= 0.0:
            s[BACK] += 1.0 if xp.in_range(now) else 0.0
            flags, dt = 2, 0.0
            s[TIME] = now if s[BACK] >= RESTART else s[TIME]
        else:
            s[TIME], s[BACK], dt = now, 0.0, dt if dt <= 1.0 else 1e-3  # the first sample, or a long pause
        force = math.hypot(wrench[0], wrench[1])
        good = xp.in_range(load) and xp.in_range(force) and xp.in_range(wrench[2])
        flags += 0 if good else 1
        if good and force >= settings.saturation:
            flags, good = flags + 4, False
        if dt > 0.0:
            if settings.drift > 0.0:
                spread(s, MU, settings.drift * settings.drift * dt, column)
            s[PEAK] -= dt / PEAK_TIME
            s[BOUND] -= settings.drift * math.sqrt(dt)
            s[REST] += dt
        before = s[SLIP]
        if good and load <= settings.least_load and dt > 0.0:
            _tare(settings, s, wrench, load, h, column)
        elif good and dt > 0.0:
            share = 1.0 - math.exp(-dt / SEEN_TIME)
            for i in range(3):
                w = 0.0
                for j in range(3):
                    w += settings.conjugate[i, j] * wrench[j]
                s[SEEN + i] += share * ((w - s[BIAS + i]) / load - s[SEEN + i])
                s[SUM + i] += w / load
            s[LOADS], s[COUNT] = s[LOADS] + load, s[COUNT] + 1.0
            _judge(settings, s, load, dt, best)
            s[PEAK] = max(s[PEAK], s[GAUGE])
            if s[SLIP] < 0.1:
                s[BOUND] = max(s[BOUND], s[GAUGE])
        if xp.in_range(velocity[0]) and xp.in_range(velocity[1]) and xp.in_range(velocity[2]) and dt > 0.0:
            for i in range(3):
                v[i] = 0.0
                for j in range(3):
                    v[i] += settings.frame[i, j] * velocity[j]
            odds = math.exp(_see(settings, s, v, h, column, jacobian))
            s[SLIP] = s[SLIP] * odds / (s[SLIP] * odds + 1.0 - s[SLIP])
        s[SLIP] = min(max(s[SLIP], 1e-9), 1.0 - 1e-9)
        if before <= 0.5 < s[SLIP] and s[PEAK] > -9.0:
            for i in range(N):
                h[i] = 1.0 if i in (MU, RATIO) else 0.0
            h[SCALE] = s[LEVER]
            _measure(s, h, s[PEAK] - s[MU] - s[RATIO], PEAK_ERROR * PEAK_ERROR, column)
        e.flags, e.dt, e.normal_force = flags + _doubt(settings, s), dt, load
        for i in range(3):
            e.wrench[i], e.velocity[i] = wrench[i], velocity[i]
        _estimate(settings, s, e)
