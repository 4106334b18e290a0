"""The step of the reduced model with its derivatives, and what is bound to it (see `rollouts`).

With `beta` held the equation of the moments z (docs/physics.md, "Reduced model") is linear, its matrix
`lambda I + m (x) z_ss/|z_ss|^2`, and the step is its exponential: of s with the rate `mu = lambda cos^2(V_G, z_ss)` and
of the rest with lambda. Plain LuGre is exact; elasto-plastic moments take the mean of beta at the start and at an end
predicted by an implicit Euler step, which is second order.

The step is a function of z, the scaled twist u and its steady state q; derivatives are those that `derive` writes. At
the kinks: a state that the cap just touches counts as not capped (steady sliding sits on it to the last bit); at rest
the step is that of a vanishing twist, `z + u dt`. The steady state depends on the friction coefficients and v_s, the
traction on stiffness and dampings too, the closure on the breakaway ratio; gamma, built into the map, is held. So is
the shape (see `reduced_loads` where it moves).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import moment_steps, reduced_contact, steady
from planarfriction.kernels.bristle_step import cap
from planarfriction.kernels.derive import derive
from planarfriction.kernels.moment_steps import Contact, Cotangents, Framed, StepModel
from planarfriction.kernels.reduced import Quartic, closure, evenness, to_origin
from planarfriction.kernels.reduced_contact import ReducedPatch
from planarfriction.kernels.rules import rule
from planarfriction.kernels.steady import FAR, STILL, fourth_moments, scaled_twist, sliding
from planarfriction.kernels.steps import step_functions
from planarfriction.kernels.vectors import applied_back, dot, norm, plus, square, times

NAMES = (*LawNumbers._fields, *ReducedPatch._fields)
"""Numbers of a contact, in the order of its row."""

shape_of = reader(ReducedPatch)


class SteadyTwist(NamedTuple):
    """Scaled twist of a step and its steady state."""

    u: tuple
    v: float
    """Norm of u."""
    q: tuple


class SteadySlopes(NamedTuple):
    """Derivatives of the steady state."""

    q_u: tuple
    """By u, row by row."""
    q_mu_c: tuple
    q_mu_s: tuple
    q_v_s: tuple


class ReducedStep(NamedTuple):
    """A step and the tape of its derivatives."""

    held: SteadyTwist
    tape: tuple
    new: tuple
    """State after the step."""
    traction: tuple
    """Wrench in scaled coordinates, per unit load."""
    wrench: tuple
    """Wrench about the origin, per unit load."""


@kernel
def hold(contact, twist):
    """Return `SteadyTwist` at a twist."""
    vx, vy, omega = twist
    x, y, s, v, qx, qy, qs = sliding(contact.law, vx, vy, omega, contact.shape, contact.surface, contact.data)
    return SteadyTwist((x, y, s), v, (qx, qy, qs))


@kernel
def hold_slopes(contact, twist, work):
    """Return `SteadyTwist` and `SteadySlopes` at a twist; none at rest, where they have no effect."""
    law, shape, surface, data = contact.law, contact.shape, contact.surface, contact.data
    vx, vy, omega = twist
    u = scaled_twist(shape, vx, vy, omega)
    v, none = norm(u), (0.0, 0.0, 0.0)
    if v > STILL:
        found = steady.steady(law, shape, surface, data, u, v)
        return SteadyTwist(u, v, found.q), SteadySlopes(found.by_u, found.by_mu_c, found.by_mu_s, found.by_v_s)
    still = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return SteadyTwist(none, 0.0, (FAR, 0.0, 0.0)), SteadySlopes(still, none, none, none)


# ---------------------------------------------------------------------- the step


@kernel
def _not_below_zero(x):
    """Return x, which rounding alone may lift below zero: its slope stays that of x."""
    return xp.maximum(x, 0.0)


@kernel
def _mean_of(rate, left, total):
    """Return `(1 - exp(-rate))/rate`, from `exp(-rate)` and the `total` of a sum that loses no digits."""
    moves = rate > 0.0
    return xp.where(moves, total, 1.0) / xp.where(moves, rate, 1.0)


rule(_not_below_zero, "s", {0: "1.0"})
rule(_mean_of, "s", {0: "formulas.relaxation_slope(xp, {0}, {1}, {t})"})


@kernel
def advance(law, quartic, u, q, z, norm_z, even, dt):
    """Return the new state, its scaled traction, its norm and its evenness, from those of the state z.

    Each step of a roll-out waits for the last one's state. So the norm and the evenness of that come in, and those of
    the new one are found beside the cap, not behind it: it changes neither the direction nor, by itself, the norm's
    digits.
    """
    per_q2, power = 1.0 / square(q), dot(u, q)
    per_q = math.sqrt(per_q2)
    decay, slow = square(u) / xp.where(power > 0.0, power, 1.0), power * per_q2
    m, deflection, share = plus(u, -decay, q), norm_z * per_q, dot(z, q) * per_q2
    # an implicit Euler step
    start = closure(law, deflection, share, even)
    ahead_share = (share + slow * dt) / (1.0 + start * slow * dt)
    ahead = plus(plus(z, dt, u), -dt * start * ahead_share, m)
    ahead_even, _ = evenness(law, quartic.rows, quartic.change, quartic.blend, ahead)
    end = closure(law, norm(ahead) * per_q / (1.0 + start * decay * dt), ahead_share, ahead_even)
    # the exponential, of the mean of beta
    beta = formulas.mean_decay(start, end, decay * dt)
    slow_rate, rate = beta * slow * dt, beta * decay * dt
    gap = _not_below_zero(rate - slow_rate)  # less where z_ss lies along V_G, which long steps blow up
    left_slow, mean_slow = formulas.relaxation(xp, slow_rate)
    left_gap, mean_gap = formulas.relaxation(xp, gap)
    left = left_slow * left_gap
    mean = _mean_of(rate, left, slow_rate * mean_slow + gap * mean_gap * left_slow)
    free = plus(plus(times(left, z), mean * decay * dt, q), (1.0 - beta * share) * dt * left_slow * mean_gap, m)
    # back onto the ball, and the rate there
    size = norm(free)
    reached = size * per_q
    back = cap(reached, formulas.reachable_deflection(xp, deflection, law))
    even_new, _ = evenness(law, quartic.rows, quartic.change, quartic.blend, free)
    new, last = times(back, free), dot(free, q) * per_q2 * back
    beta_new = closure(law, reached * back, last, even_new)
    rate_new = plus(plus(u, -beta_new * decay, new), -beta_new * last, m)
    traction = plus(plus(times(-law.sigma_0, new), -law.sigma_1, rate_new), -law.sigma_2, u)
    return new, traction, size * back, even_new


@kernel
def advance_alone(law, quartic, u, q, z, dt):
    """Return the new state and its scaled traction, from the state z alone."""
    even, _ = evenness(law, quartic.rows, quartic.change, quartic.blend, z)
    new, traction, _, _ = advance(law, quartic, u, q, z, norm(z), even, dt)
    return new, traction


BY = "z", "u", "q", "law.sigma_0", "law.sigma_1", "law.sigma_2", "law.breakaway_ratio"
"""Arguments by which a step of a fixed shape has derivatives."""

DERIVATIVE = derive(advance_alone, BY, ("z", "u", "q"))
_forth, _back = DERIVATIVE.forth, DERIVATIVE.back


@kernel
def taped_step(contact, held, z, dt):
    """Return `ReducedStep` from the state z."""
    rows = fourth_moments(contact.shape, contact.surface, contact.data)
    return step_of(contact, rows, held, z, dt)


@kernel
def step_of(contact, rows, held, z, dt):
    """Return `ReducedStep` from the state z, with the coefficients `rows` of `<u^4>`."""
    (new, traction), tape = _forth(contact.law, Quartic(rows, rows, 0.0), held.u, held.q, z, dt)
    return ReducedStep(held, tape, new, traction, to_origin(contact.shape, *traction))


@kernel
def through_steady(contact, step, slopes, bars):
    """Return the cotangents `bars` of `BY`, those of u and sigma_0 with what q passes on to them."""
    z, u, q, sigma_0, sigma_1, sigma_2, ratio = bars
    sigma_0 -= dot(step.held.q, q) / contact.law.sigma_0
    return z, plus(u, 1.0, applied_back(slopes.q_u, q)), q, sigma_0, sigma_1, sigma_2, ratio


@kernel
def cotangents(contact, slopes, bars, shape):
    """Return `Cotangents` from those that `through_steady` returns and that of the shape."""
    z, u, q, sigma_0, sigma_1, sigma_2, ratio = bars
    by_mu_c, by_mu_s, by_v_s = dot(slopes.q_mu_c, q), dot(slopes.q_mu_s, q), dot(slopes.q_v_s, q)
    law = LawNumbers(sigma_0, sigma_1, sigma_2, by_mu_c, by_mu_s, by_v_s, 0.0, 0.0, ratio, 0.0)
    return Cotangents(z, to_origin(contact.shape, *u), law, shape)


@kernel
def pull_back(contact, step, slopes, new, wrench):
    """Return `Cotangents` from those of the new state and of the wrench, where the shape is held."""
    bars = _back(step.tape, (new, scaled_twist(contact.shape, *wrench)))
    bars = through_steady(contact, step, slopes, bars)
    return cotangents(contact, slopes, bars, ReducedPatch(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))


# ---------------------------------------------------------------------- bound to this model


@kernel
def _read(contact):
    own = reduced_contact.read(contact)
    return own, Contact(own.law, own.shape, (0, own.other, 0), own.data)


@kernel
def _as_it_is(own, vector):
    return vector


@kernel
def _spins(own):
    return 1.0


MODEL = StepModel(shape_of, hold, hold_slopes, taped_step, pull_back)
_FRAME = Framed(_read, _as_it_is, _as_it_is, _spins)
STEPS = step_functions("reduced", moment_steps.TEMPLATES, frame=_FRAME, **MODEL._asdict())
