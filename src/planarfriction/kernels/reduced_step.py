"""The step of the reduced model with its derivatives, and what is bound to it (see `rollouts`).

With `beta` held the equation of the moments z (docs/physics.md, "Reduced model") is linear, its matrix
`lambda I + m (x) z_ss/|z_ss|^2`, and the step is its exponential: of s with the rate `mu = lambda cos^2(V_G, z_ss)` and
of the rest with lambda. Plain LuGre is exact; elasto-plastic moments take the mean of beta at the start and at an end
predicted by an implicit Euler step, which is second order.

The step is a function of z, the scaled twist u and its steady state q. `linearise` walks through it and keeps the
partial derivatives, which the compiler drops where nobody asks for them; `pull_back` takes cotangents back. At the
kinks: a state that the cap just touches counts as not capped (steady sliding sits on it to the last bit); at rest the
step is that of a vanishing twist, `z + u dt`. The steady state depends on the friction coefficients and v_s, the
traction on stiffness and dampings too, the closure on the breakaway ratio; gamma, built into the map, is held. So is
the shape (see `reduced_loads` where it moves).
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, kernel
from planarfriction.compiler.calls import address_of
from planarfriction.compiler.memory import floats, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import reduced, rollouts
from planarfriction.kernels.bristle_step import ROUNDING
from planarfriction.kernels.reduced import to_origin
from planarfriction.kernels.reduced_contact import Shape
from planarfriction.kernels.rollouts import Cotangents
from planarfriction.kernels.steady import FAR, STILL, evenness, fourth_moments, scaled_twist, sliding, steady
from planarfriction.kernels.vectors import applied_back, dot, norm, plus, times

NAMES = (*LawNumbers._fields, *Shape._fields)
"""Numbers of a contact, in the order of its row."""

shape_of = reader(Shape)


class Held(NamedTuple):
    """What a step holds."""

    u: tuple
    v: float
    q: tuple


class Slopes(NamedTuple):
    """Slopes of the steady state."""

    q_u: tuple
    """By u, row by row."""
    q_mu_c: tuple
    q_mu_s: tuple
    q_v_s: tuple


class Stage(NamedTuple):
    """A state z relative to `q = z_ss`, and the closure there."""

    z: tuple
    deflection: float
    stretch: float
    """The change of the deflection with z is this times z."""
    share: float
    beta: float
    by_deflection: float
    by_share: float
    by_ratio: float
    """By the law's breakaway ratio."""
    by_z: tuple
    """Through the evenness alone."""


class Step(NamedTuple):
    """A step with its partial derivatives; rates lambda and mu as in the equation of the moments."""

    held: Held
    dt: float
    m: tuple
    per_q2: float
    per_power: float
    decay: float
    """lambda"""
    slow: float
    """mu"""
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
    rate: tuple
    new: tuple
    """State."""
    even: tuple
    """Evenness of the new state, and its slopes."""
    norm: float
    """Of the new state."""
    wrench: tuple
    """About the origin, per unit load."""


@kernel
def hold(contact, twist):
    """`Held` at a twist."""
    vx, vy, omega = twist
    x, y, s, v, qx, qy, qs = sliding(contact.law, vx, vy, omega, contact.shape, contact.surface, contact.data)
    return Held((x, y, s), v, (qx, qy, qs))


@kernel
def hold_slopes(contact, twist, work):
    """`Held` and `Slopes` at a twist; none at rest, where they have no effect."""
    law, shape, surface, data = contact.law, contact.shape, contact.surface, contact.data
    vx, vy, omega = twist
    u = scaled_twist(shape, vx, vy, omega)
    v, none = norm(u), (0.0, 0.0, 0.0)
    if v > STILL:
        found = steady(law, shape, surface, data, u, v)
        return Held(u, v, found.q), Slopes(found.by_u, found.by_mu_c, found.by_mu_s, found.by_v_s)
    still = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return Held(none, 0.0, (FAR, 0.0, 0.0)), Slopes(still, none, none, none)


@kernel
def _stage(law, z, even, stretch, deflection, share):
    """The closure at a state, of which `even` is the `evenness`.

    `stretch`: the change of the deflection is `stretch/deflection` times that along z.
    """
    even, even_z = even
    beta, by_deflection, by_share, by_breakaway = reduced.closure_partials(law, deflection, share, even)
    # exactly zero before breakaway: of hardly any deflection it is multiplied by the stretch, one over that
    by_deflection = xp.where(deflection > law.breakaway_ratio * even, by_deflection, 0.0)
    stretch = stretch / xp.where(deflection > 0.0, deflection, math.inf)
    by_z = times(law.breakaway_ratio * by_breakaway, even_z)
    return Stage(z, deflection, stretch, share, beta, by_deflection, by_share, even * by_breakaway, by_z)


@kernel
def linearise(contact, held, z, dt):
    """`Step` from the state z."""
    fourth = fourth_moments(contact.shape, contact.surface, contact.data)
    return advance(contact, fourth, held, z, norm(z), evenness(contact.law, fourth, z), dt)


@kernel
def advance(contact, fourth, held, z, norm_z, even, dt):
    """`Step` from the state z, of which `even` is the `evenness`; `fourth`: see `steady.fourth_moments`.

    Each step waits for the last one's state. So the norm and the evenness of that come in, and those of the new one are
    found beside the cap, not behind it: it changes neither the direction nor, by itself, the norm's digits.
    """
    law, u, q = contact.law, held.u, held.q
    per_q2, power = 1.0 / dot(q, q), dot(u, q)
    per_q = math.sqrt(per_q2)
    per_power = 1.0 / xp.where(power > 0.0, power, 1.0)
    decay, slow = held.v * held.v * per_power, power * per_q2
    m = plus(u, -decay, q)
    start = _stage(law, z, even, per_q2, norm_z * per_q, dot(z, q) * per_q2)
    per_slow, per = 1.0 / (1.0 + start.beta * slow * dt), 1.0 / (1.0 + start.beta * decay * dt)
    share = (start.share + slow * dt) * per_slow
    ahead = plus(plus(z, dt, u), -dt * start.beta * share, m)
    predicted = _stage(law, ahead, evenness(law, fourth, ahead), per * per * per_q2, per * norm(ahead) * per_q, share)
    # the mean of beta
    beta = formulas.mean_decay(start.beta, predicted.beta, decay * dt)
    by_start, by_end = formulas.mean_decay_partials(start.beta, predicted.beta, decay * dt)
    half = 0.5 * (start.beta + predicted.beta)
    x = half * decay * dt
    part = 1.0 / (2.0 + x + x * x)
    by_decay = -(start.beta - predicted.beta) * part * part * (1.0 + 2.0 * x) * half
    # the exponential
    slow_rate, rate = beta * slow * dt, beta * decay * dt
    gap = xp.maximum(rate - slow_rate, 0.0)  # by rounding less where z_ss lies along V_G, which long steps blow up
    left_slow, mean_slow = formulas.relaxation(xp, slow_rate)
    left_gap, mean_gap = formulas.relaxation(xp, gap)
    left = left_slow * left_gap
    per_rate = 1.0 / xp.where(rate > 0.0, rate, 1.0)
    mean = xp.where(rate > 0.0, slow_rate * mean_slow + gap * mean_gap * left_slow, 1.0) * per_rate
    across = (1.0 - beta * start.share) * dt * left_slow * mean_gap
    free = plus(plus(times(left, z), mean * decay * dt, q), across, m)
    norm_free = norm(free)
    size = norm_free * per_q
    largest = formulas.reachable_deflection(xp, start.deflection, law)
    back = formulas.cap(xp, size, largest)
    new = times(back, free)
    even_free, by_free = evenness(law, fourth, free)
    after = even_free, times(1.0 / back, by_free)
    end = _stage(law, new, after, per_q2, size * back, dot(free, q) * per_q2 * back)
    slip = plus(plus(u, -end.beta * decay, new), -end.beta * end.share, m)
    return Step(
        held, dt, m, per_q2, per_power, decay, slow, start, per_slow, per, predicted, beta, by_start, by_end, by_decay,
        left_slow, left, mean_gap, formulas.relaxation_slope(xp, gap, left_gap, mean_gap),
        mean, formulas.relaxation_slope(xp, rate, left, mean),
        end, free, size, back, size > largest * ROUNDING, start.deflection > 1.0, slip, new, after, back * norm_free,
        reduced.wrench(
            law, contact.shape, new[0], new[1], new[2], slip[0], slip[1], slip[2], u[0], u[1], u[2]
        ),
    )  # fmt: skip


class StepBars(NamedTuple):
    """Cotangents of what a step depends on."""

    z: tuple
    u: tuple
    q: tuple
    ratio: tuple
    """The law's breakaway ratio, through the closure at the start, at the predicted end and at the end."""


@kernel
def _pull_back(law, s, new, pull):
    """`StepBars` from the cotangents of the new state and of the scaled traction."""
    start, predicted, end, per_q2, dt, q = s.start, s.predicted, s.end, s.per_q2, s.dt, s.held.q
    rate = times(-law.sigma_1, pull)
    dn = plus(plus(new, -law.sigma_0, pull), -end.beta * s.decay, rate)
    du = plus(rate, -law.sigma_2, pull)
    d_beta = -dot(plus(times(s.decay, end.z), end.share, s.m), rate)
    d_decay, dm = -end.beta * dot(end.z, rate), times(-end.beta * end.share, rate)
    d_share = end.by_share * d_beta - end.beta * dot(s.m, rate)
    d_size, ratio_end = end.by_deflection * d_beta, end.by_ratio * d_beta
    dn = plus(plus(plus(dn, end.stretch * d_size, end.z), per_q2 * d_share, q), d_beta, end.by_z)
    q_dq = -end.deflection * d_size - 2.0 * end.share * d_share
    dq = times(per_q2 * d_share, end.z)
    d_size = 0.0
    if s.capped:
        d_back = dot(s.free, dn) / s.size
        d_size = d_back if s.grown else 0.0
        grow = -s.back * d_back
        dn = plus(times(s.back, dn), grow * per_q2 / s.size, s.free)
        q_dq -= s.size * grow
    # the exponential
    unused, spread = 1.0 - s.beta * start.share, dt * s.left_slow
    dz, dq = times(s.left, dn), plus(dq, s.mean * s.decay * dt, dn)
    dm = plus(dm, unused * spread * s.mean_gap, dn)
    along, across = dt * dot(q, dn), spread * dot(s.m, dn)
    d_rate = along * s.mean_slope * s.decay - s.left * dot(start.z, dn) + across * unused * s.gap_slope
    d_slow_rate = -across * unused * (s.gap_slope + s.mean_gap)
    d_share = -across * s.beta * s.mean_gap
    d_beta = dt * (d_rate * s.decay + d_slow_rate * s.slow) - across * start.share * s.mean_gap
    d_decay += along * s.mean + dt * (d_rate * s.beta + s.by_decay * d_beta)
    d_slow = dt * s.beta * d_slow_rate
    # predicted end
    d_start, d_end = s.by_start * d_beta, s.by_end * d_beta
    d_predicted, ahead = predicted.by_deflection * d_end, predicted.by_share * d_end
    ratio_ahead = predicted.by_ratio * d_end
    q_dq -= predicted.deflection * d_predicted
    dp = plus(times(predicted.stretch * d_predicted, predicted.z), d_end, predicted.by_z)
    shrink, push = predicted.deflection * s.per * dt * d_predicted, dt * dot(s.m, dp)
    d_start -= shrink * s.decay + push * predicted.share
    d_decay -= shrink * start.beta
    ahead = (ahead - push * start.beta) * s.per_slow
    dz, du = plus(dz, 1.0, dp), plus(du, dt, dp)
    dm = plus(dm, -dt * start.beta * predicted.share, dp)
    d_start -= predicted.share * dt * s.slow * ahead
    d_slow += dt * (1.0 - predicted.share * start.beta) * ahead
    # start
    d_size += start.by_deflection * d_start
    d_share += ahead + start.by_share * d_start
    ratio = start.by_ratio * d_start, ratio_ahead, ratio_end
    dz = plus(plus(plus(dz, start.stretch * d_size, start.z), per_q2 * d_share, q), d_start, start.by_z)
    q_dq -= start.deflection * d_size + 2.0 * (start.share * d_share + s.slow * d_slow)
    d_decay -= dot(q, dm)
    power = d_slow * per_q2 - s.decay * s.per_power * d_decay
    dq = plus(plus(dq, per_q2 * d_share, start.z), -s.decay, dm)
    dq = plus(plus(dq, power, s.held.u), per_q2 * q_dq, q)
    du = plus(plus(plus(du, 1.0, dm), 2.0 * s.per_power * d_decay, s.held.u), power, q)
    return StepBars(dz, du, dq, ratio)


@kernel
def pulled(contact, step, slopes, new, wrench):
    """`StepBars`, of u with what q passes on to it, from the cotangents of the new state and of the wrench.

    That of the scaled traction is `F W'`, which is returned first.
    """
    wx, wy, wt = wrench
    pull = scaled_twist(contact.shape, wx, wy, wt)
    bar = _pull_back(contact.law, step, new, pull)
    return pull, StepBars(bar.z, plus(bar.u, 1.0, applied_back(slopes.q_u, bar.q)), bar.q, bar.ratio)


@kernel
def cotangents(contact, step, slopes, pull, bar, shape):
    """`Cotangents` from what `pulled` finds, and that of the shape."""
    law, held = contact.law, step.held
    return Cotangents(
        bar.z,
        to_origin(contact.shape, *bar.u),
        LawNumbers(
            -dot(step.new, pull) - dot(held.q, bar.q) / law.sigma_0, -dot(step.rate, pull), -dot(held.u, pull),
            dot(slopes.q_mu_c, bar.q), dot(slopes.q_mu_s, bar.q), dot(slopes.q_v_s, bar.q),
            0.0, 0.0, bar.ratio[0] + bar.ratio[1] + bar.ratio[2], 0.0,
        ),
        shape,
    )  # fmt: skip


@kernel
def pull_back(contact, step, slopes, new, wrench):
    """`Cotangents` from those of the new state and of the wrench, where the shape is held."""
    pull, bar = pulled(contact, step, slopes, new, wrench)
    return cotangents(contact, step, slopes, pull, bar, Shape(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))


# ---------------------------------------------------------------------- bound to this model


@entry
def step(row, data, inputs, out):
    """See `rollouts.step`."""
    rollouts.step(shape_of, floats, hold, linearise, row, data, inputs, out)


@functools.cache
def step_address() -> int:
    """Where `step` is in this process."""
    return address_of(step, "pppp")
