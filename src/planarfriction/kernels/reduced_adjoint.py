"""The step of the moment model, differentiated.

`reduced_step.advance` is a function of the state z, the scaled twist u, its steady state q and the breakaway b, the
law's ratio times the evenness. `linearise` walks through it and keeps the partial derivatives; `tangent` takes a
direction `(z', u', q', b')` through them and `pull_back`, its transpose, cotangents back. At the kinks: a state that
the cap just touches counts as not capped (steady sliding sits on it to the last bit); at rest the step is that of a
vanishing twist, `z + u dt`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, jit, kernel, reduced
from planarfriction.kernels.law import law_of
from planarfriction.kernels.steady import evenness, scaled_twist, steady_slopes

_ROUNDING = 1.0 + 256.0 * 2.220446049250313e-16


class Stage(NamedTuple):
    """A state z relative to `q = z_ss`, and the closure there."""

    z: tuple
    deflection: float
    share: float
    beta: float
    by_deflection: float
    by_share: float
    by_breakaway: float


class Step(NamedTuple):
    """A step with its partial derivatives; names as in `reduced_step.advance`."""

    u: tuple
    q: tuple
    m: tuple
    per_q2: float
    per_power: float
    decay: float
    slow: float
    start: Stage
    per_slow: float
    """1/(1 + beta mu dt) of the predicted share."""
    per: float
    """1/(1 + beta lambda dt) of the predicted state."""
    predicted: Stage
    """Its z before the factor `per`."""
    beta: float
    by_start: float
    by_end: float
    by_decay: float
    """d beta/d (lambda dt)"""
    left_slow: float
    left: float
    mean_gap: float
    gap_slope: float
    mean: float
    mean_slope: float
    end: Stage
    free: tuple
    """New state before the cap."""
    size: float
    """Its deflection."""
    back: float
    capped: bool
    grown: bool


@inlined
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _sum(a, x, b, y, c, z):
    return a * x[0] + b * y[0] + c * z[0], a * x[1] + b * y[1] + c * z[1], a * x[2] + b * y[2] + c * z[2]


@inlined
def _stage(law, z, q, per_q2, factor, share, even):
    deflection = factor * math.sqrt(_dot(z, z) * per_q2)
    return Stage(z, deflection, share, *reduced.closure_partials(law, deflection, share, even))


@kernel
def linearise(law, z, u, v, q, even, dt):
    """`Step` from z at the scaled twist u, which moves at `v > 0` and has the steady state q and that evenness."""
    per_q2, power = 1.0 / _dot(q, q), _dot(u, q)
    decay, slow = v * v / power, power * per_q2
    m = _sum(1.0, u, -decay, q, 0.0, q)
    start = _stage(law, z, q, per_q2, 1.0, _dot(z, q) * per_q2, even)
    per_slow, per = 1.0 / (1.0 + start.beta * slow * dt), 1.0 / (1.0 + start.beta * decay * dt)
    share = (start.share + slow * dt) * per_slow
    predicted = _stage(law, _sum(1.0, z, dt, u, -dt * start.beta * share, m), q, per_q2, per, share, even)
    beta = formulas.mean_decay(start.beta, predicted.beta, decay * dt)
    by_start, by_end = formulas.mean_decay_partials(start.beta, predicted.beta, decay * dt)
    half = 0.5 * (start.beta + predicted.beta)
    x = half * decay * dt
    part = 1.0 / (2.0 + x + x * x)
    by_decay = -(start.beta - predicted.beta) * part * part * (1.0 + 2.0 * x) * half
    slow_rate, gap, rate = beta * slow * dt, beta * (decay - slow) * dt, beta * decay * dt
    left_slow, _ = formulas.relaxation(xp, slow_rate)
    left_gap, mean_gap = formulas.relaxation(xp, gap)
    left, mean = formulas.relaxation(xp, rate)
    across = (1.0 - beta * start.share) * dt * left_slow * mean_gap
    free = _sum(left, z, mean * decay * dt, q, across, m)
    size = math.sqrt(_dot(free, free) * per_q2)
    largest = formulas.reachable_deflection(xp, start.deflection, law)
    capped = size > largest * _ROUNDING
    back = formulas.cap(xp, size, largest)
    new = _sum(back, free, 0.0, q, 0.0, q)
    return Step(
        u, q, m, per_q2, 1.0 / power, decay, slow, start, per_slow, per, predicted, beta, by_start, by_end, by_decay,
        left_slow, left, mean_gap, formulas.relaxation_slope(xp, gap, left_gap, mean_gap),
        mean, formulas.relaxation_slope(xp, rate, left, mean),
        _stage(law, new, q, per_q2, 1.0, _dot(new, q) * per_q2, even), free, size, back, capped, start.deflection > 1.0,
    )  # fmt: skip


@inlined
def _relative(stage, factor, per_q2, q, dz, q_dq):
    """Changes of the deflection and of `z . q/|q|^2` but for its part `z . dq`."""
    per = factor * factor * per_q2 / stage.deflection if stage.deflection > 0.0 else 0.0
    return per * _dot(stage.z, dz) - stage.deflection * q_dq, _dot(q, dz) * per_q2 - 2.0 * stage.share * q_dq


@kernel
def tangent(law, s, dt, dz, du, dq, d_breakaway):
    """Changes of the new state and of the scaled traction (per unit load) with those of z, u, q and the breakaway."""
    q_dq = _dot(s.q, dq) * s.per_q2
    power = _dot(du, s.q) + _dot(s.u, dq)
    d_decay = (2.0 * _dot(s.u, du) - s.decay * power) * s.per_power
    d_slow = power * s.per_q2 - 2.0 * s.slow * q_dq
    dm = _sum(1.0, du, -d_decay, s.q, -s.decay, dq)
    start, predicted = s.start, s.predicted
    d_size, d_share = _relative(start, 1.0, s.per_q2, s.q, dz, q_dq)
    d_share += _dot(start.z, dq) * s.per_q2
    d_start = start.by_deflection * d_size + start.by_share * d_share + start.by_breakaway * d_breakaway
    # predicted end
    ahead = (d_share + d_slow * dt - predicted.share * dt * (d_start * s.slow + start.beta * d_slow)) * s.per_slow
    dp = _sum(1.0, dz, dt, du, -dt * start.beta * predicted.share, dm)
    dp = _sum(1.0, dp, -dt * (d_start * predicted.share + start.beta * ahead), s.m, 0.0, dq)
    d_predicted, _ = _relative(predicted, s.per, s.per_q2, s.q, dp, q_dq)
    d_predicted -= predicted.deflection * s.per * dt * (d_start * s.decay + start.beta * d_decay)
    d_end = predicted.by_deflection * d_predicted + predicted.by_share * ahead + predicted.by_breakaway * d_breakaway
    d_beta = s.by_start * d_start + s.by_end * d_end + s.by_decay * d_decay * dt
    # the exponential
    d_slow_rate = dt * (d_beta * s.slow + s.beta * d_slow)
    d_rate = dt * (d_beta * s.decay + s.beta * d_decay)
    unused = 1.0 - s.beta * start.share
    across = (
        dt
        * s.left_slow
        * (
            -(d_beta * start.share + s.beta * d_share) * s.mean_gap
            + unused * (s.gap_slope * (d_rate - d_slow_rate) - s.mean_gap * d_slow_rate)
        )
    )
    dn = _sum(s.left, dz, s.mean * s.decay * dt, dq, unused * dt * s.left_slow * s.mean_gap, dm)
    d_along = dt * (s.mean_slope * d_rate * s.decay + s.mean * d_decay)
    dn = _sum(1.0, dn, d_along, s.q, across, s.m)
    dn = _sum(1.0, dn, -s.left * d_rate, start.z, 0.0, dq)
    if s.capped:
        per = s.per_q2 / s.size
        grow = per * _dot(s.free, dn) - s.size * q_dq
        d_back = ((d_size if s.grown else 0.0) - s.back * grow) / s.size
        dn = _sum(s.back, dn, d_back, s.free, 0.0, dq)
    end = s.end
    d_final, d_share = _relative(end, 1.0, s.per_q2, s.q, dn, q_dq)
    d_share += _dot(end.z, dq) * s.per_q2
    d_beta = end.by_deflection * d_final + end.by_share * d_share + end.by_breakaway * d_breakaway
    held = _sum(s.decay, end.z, end.share, s.m, 0.0, dq)
    d_held = _sum(s.decay, dn, d_decay, end.z, end.share, dm)
    d_held = _sum(1.0, d_held, d_share, s.m, 0.0, dq)
    rate = _sum(1.0, du, -d_beta, held, -end.beta, d_held)
    return dn, _sum(-law.sigma_0, dn, -law.sigma_1, rate, -law.sigma_2, du)


@inlined
def rate(s):
    """`z'` at the end of the step."""
    return _sum(1.0, s.u, -s.end.beta * s.decay, s.end.z, -s.end.beta * s.end.share, s.m)


@inlined
def _stretch(stage, factor, per_q2):
    """The change of the deflection with z is this times z."""
    return factor * factor * per_q2 / stage.deflection if stage.deflection > 0.0 else 0.0


class Cotangents(NamedTuple):
    """Cotangents of the inputs of a step."""

    z: tuple
    u: tuple
    q: tuple
    breakaway: float


@kernel
def pull_back(law, s, dt, new, pull):
    """`Cotangents` from those of the new state and of the scaled traction: the transpose of `tangent`, read upwards."""
    start, predicted, end, per_q2 = s.start, s.predicted, s.end, s.per_q2
    zero = (0.0, 0.0, 0.0)
    rate = _sum(-law.sigma_1, pull, 0.0, pull, 0.0, pull)
    dn = _sum(1.0, new, -law.sigma_0, pull, -end.beta * s.decay, rate)
    du = _sum(-law.sigma_2, pull, 1.0, rate, 0.0, rate)
    d_beta = -_dot(_sum(s.decay, end.z, end.share, s.m, 0.0, zero), rate)
    d_decay, dm = -end.beta * _dot(end.z, rate), _sum(-end.beta * end.share, rate, 0.0, rate, 0.0, rate)
    d_share = end.by_share * d_beta - end.beta * _dot(s.m, rate)
    d_size, breakaway = end.by_deflection * d_beta, end.by_breakaway * d_beta
    dn = _sum(1.0, dn, _stretch(end, 1.0, per_q2) * d_size, end.z, per_q2 * d_share, s.q)
    q_dq = -end.deflection * d_size - 2.0 * end.share * d_share
    dq = _sum(per_q2 * d_share, end.z, 0.0, dn, 0.0, dn)
    d_size = 0.0
    if s.capped:
        d_back = _dot(s.free, dn) / s.size
        d_size = d_back if s.grown else 0.0
        grow = -s.back * d_back
        dn = _sum(s.back, dn, grow * per_q2 / s.size, s.free, 0.0, dn)
        q_dq -= s.size * grow
    # the exponential
    unused, spread = 1.0 - s.beta * start.share, dt * s.left_slow
    dz, dq = _sum(s.left, dn, 0.0, dn, 0.0, dn), _sum(1.0, dq, s.mean * s.decay * dt, dn, 0.0, dn)
    dm = _sum(1.0, dm, unused * spread * s.mean_gap, dn, 0.0, dn)
    along, across = dt * _dot(s.q, dn), spread * _dot(s.m, dn)
    d_rate = along * s.mean_slope * s.decay - s.left * _dot(start.z, dn) + across * unused * s.gap_slope
    d_slow_rate = -across * unused * (s.gap_slope + s.mean_gap)
    d_share = -across * s.beta * s.mean_gap
    d_beta = dt * (d_rate * s.decay + d_slow_rate * s.slow) - across * start.share * s.mean_gap
    d_decay += along * s.mean + dt * (d_rate * s.beta + s.by_decay * d_beta)
    d_slow = dt * s.beta * d_slow_rate
    # predicted end
    d_start, d_end = s.by_start * d_beta, s.by_end * d_beta
    d_predicted, ahead = predicted.by_deflection * d_end, predicted.by_share * d_end
    breakaway += predicted.by_breakaway * d_end
    q_dq -= predicted.deflection * d_predicted
    dp = _sum(_stretch(predicted, s.per, per_q2) * d_predicted, predicted.z, 0.0, dn, 0.0, dn)
    shrink, push = predicted.deflection * s.per * dt * d_predicted, dt * _dot(s.m, dp)
    d_start -= shrink * s.decay + push * predicted.share
    d_decay -= shrink * start.beta
    ahead = (ahead - push * start.beta) * s.per_slow
    dz, du = _sum(1.0, dz, 1.0, dp, 0.0, dp), _sum(1.0, du, dt, dp, 0.0, dp)
    dm = _sum(1.0, dm, -dt * start.beta * predicted.share, dp, 0.0, dp)
    d_start -= predicted.share * dt * s.slow * ahead
    d_slow += dt * (1.0 - predicted.share * start.beta) * ahead
    # start
    d_size += start.by_deflection * d_start
    d_share += ahead + start.by_share * d_start
    breakaway += start.by_breakaway * d_start
    dz = _sum(1.0, dz, _stretch(start, 1.0, per_q2) * d_size, start.z, per_q2 * d_share, s.q)
    q_dq -= start.deflection * d_size + 2.0 * (start.share * d_share + s.slow * d_slow)
    d_decay -= _dot(s.q, dm)
    power = d_slow * per_q2 - s.decay * s.per_power * d_decay
    dq = _sum(1.0, dq, per_q2 * d_share, start.z, -s.decay, dm)
    dq = _sum(1.0, dq, power, s.u, per_q2 * q_dq, s.q)
    du = _sum(1.0, du, 1.0, dm, 2.0 * s.per_power * d_decay, s.u)
    return Cotangents(dz, _sum(1.0, du, power, s.q, 0.0, dm), dq, breakaway)


@inlined
def _unit(i):
    return (1.0 if i == 0 else 0.0), (1.0 if i == 1 else 0.0), (1.0 if i == 2 else 0.0)


@kernel
def _jacobian(law, z, x, y, s, v, q, j, even, dt, out):
    """Changes of the new state (rows 0..2) and the scaled traction (3..5) with z (columns 0..2) and V_G (3..5)."""
    zero, ratio = (0.0, 0.0, 0.0), law.breakaway_ratio
    held = linearise(law, (z[0], z[1], z[2]), (x, y, s), v, q, even[0], dt)
    for i in range(3):
        new, pull = tangent(law, held, dt, _unit(i), zero, zero, 0.0)
        for k in range(3):
            out[k, i], out[3 + k, i] = new[k], pull[k]
        new, pull = tangent(law, held, dt, zero, _unit(i), (j[i], j[3 + i], j[6 + i]), ratio * even[1 + i])
        for k in range(3):
            out[k, 3 + i], out[3 + k, 3 + i] = new[k], pull[k]


@kernel
def _jacobian_at_rest(law, dt, out):
    for i in range(6):
        for k in range(6):
            out[i, k] = 0.0
    for i in range(3):
        out[i, i], out[i, 3 + i] = 1.0, dt
        out[3 + i, i], out[3 + i, 3 + i] = -law.sigma_0, -(law.sigma_0 * dt + law.sigma_1 + law.sigma_2)


@jit
def jacobians(law_row, shape, surface, data, z, twist, dt, out):
    """Changes of new state and scaled traction with z and V_G, for B steps, into `out` [B, 6, 6]."""
    law, j = law_of(law_row), np.empty(15)
    for b in range(z.shape[0]):
        x, y, s = scaled_twist(shape, twist[b, 0], twist[b, 1], twist[b, 2])
        v = math.sqrt(x * x + y * y + s * s)
        if v > 0.0:
            q = steady_slopes(law, shape, surface, data, x, y, s, v, j)
            even = evenness(shape, surface, data, x, y, s, v)
            _jacobian(law, z[b], x, y, s, v, q, j, even, dt[b], out[b])
        else:
            _jacobian_at_rest(law, dt[b], out[b])
