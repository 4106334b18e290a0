"""One step of one bristle, with its derivatives: a cell's (two components) or the published reduced model's (three).

A bristle `z` driven by `u` steps by

    start = k(z),   p = z + u dt,   end = k(p / (1 + start dt)),   x = mean_decay(start, end, dt) dt,
    n = back (exp(-x) z + (1 - exp(-x))/x dt u),   k(n)

(docs/physics.md, "A step at a held twist"). `k` sees the deflection `|z| q/h` and `along = z/|z| . u/h`, with the
grip `q`, the speed `v` and `h = |u|/v`. `linearise` walks forward and keeps the partial derivatives, which the compiler
drops where nobody asks for them; `pull_back` turns cotangents of the new bristle `n` and of its `k` into those of what
they come from.

At the kinks: the slope of a norm at zero is zero, and `along` of no bristle is constant. A minimum or maximum of equal
numbers has the slope of its first argument. A bristle that the cap just touches counts as not capped: steady sliding
sits on the cap to the last bit, and whether rounding lifts it over must not decide about its slope.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels.vectors import dot, norm, plus, times

ROUNDING = 1.0 + 256.0 * 2.220446049250313e-16
"""How far above its cap [-] a deflection counts as capped."""


class Place(NamedTuple):
    """Where a bristle stands."""

    unit: tuple
    """Its direction, zero where it has none."""
    norm: float
    per_norm: float
    """One over the norm; 0 at 0."""
    along: float


class Stage(NamedTuple):
    """The decay of a bristle, and what its slopes need."""

    place: Place
    k: float
    k_deflection: float
    k_along: float
    k_speed: float
    k_grip: float
    k_breakaway: float


class Bristle(NamedTuple):
    """A bristle at the beginning of a step, and what drives it."""

    z: tuple
    u: tuple
    v: float
    per_h: float
    q: float


class Prediction(NamedTuple):
    """The mean decay of a step."""

    start: Stage
    end: Stage
    shrink: float
    """`1/(1 + start dt)`"""
    reached: float
    """Predicted deflection."""
    decay_dt: float
    by_start: float
    """d mean_decay/d start"""
    by_end: float


class End(NamedTuple):
    """The end of a step."""

    new: tuple
    stage: Stage
    left: float
    mean: float
    mean_slope: float
    back: float
    capped: bool
    grown: bool
    """The bristle began beyond full deflection, which is then its cap. (Rounding apart, no step grows it further.)"""


class BristleStep(NamedTuple):
    """A step with its partial derivatives."""

    bristle: Bristle
    dt: float
    prediction: Prediction
    end: End


class BristleBars(NamedTuple):
    """Cotangents of what a step depends on."""

    z: tuple
    u: tuple
    v: float
    h: float
    q: float
    breakaway: float


@kernel
def _place(z, u, per_h):
    size = norm(z)
    per_norm = 1.0 / xp.where(size > 0.0, size, math.inf)
    unit = times(per_norm, z)
    return Place(unit, size, per_norm, per_h * dot(unit, u))


@kernel
def _stage(law, place, deflection, v, q):
    k, k_deflection, k_along, k_speed = formulas.bristle_decay_partials(xp, deflection, place.along, v, q, law)
    # exactly zero at full deflection: the prediction multiplies it by how far it would have gone, 1e9 in a long step
    k_deflection = xp.where(deflection < 1.0, k_deflection, 0.0)
    k_breakaway = formulas.bristle_decay_by_breakaway(xp, k_deflection, deflection, law.breakaway_ratio)
    return Stage(place, k, k_deflection, k_along, k_speed, k / q, k_breakaway)


@kernel
def predict(law, bristle, dt):
    """The mean decay over a step, from its values at the start and at a predicted end."""
    z, u, v, per_h, q = bristle
    to_deflection = q * per_h
    place = _place(z, u, per_h)
    deflection = place.norm * to_deflection
    start = _stage(law, place, deflection, v, q)
    place = _place(plus(z, dt, u), u, per_h)
    shrink = 1.0 / (1.0 + start.k * dt)
    reached = place.norm * to_deflection * shrink
    # the bound of the prediction is full deflection or more, where k no longer depends on the deflection
    end = _stage(law, place, xp.minimum(reached, xp.maximum(deflection, 1.0)), v, q)
    by_start, by_end = formulas.mean_decay_partials(start.k, end.k, dt)
    return Prediction(start, end, shrink, reached, formulas.mean_decay(start.k, end.k, dt) * dt, by_start, by_end)


@kernel
def finish(law, bristle, dt, decay_dt):
    """The step itself, from the mean decay."""
    z, u, v, per_h, q = bristle
    to_deflection = q * per_h
    left, mean = formulas.relaxation(xp, decay_dt)
    free = plus(times(left, z), dt * mean, u)
    place, deflection = _place(free, u, per_h), norm(z) * to_deflection
    largest = formulas.reachable_deflection(xp, deflection, law)
    capped = place.norm * to_deflection > ROUNDING * largest
    back = formulas.cap(xp, place.norm * to_deflection, largest)
    stage = _stage(law, place, place.norm * back * to_deflection, v, q)
    mean_slope = formulas.relaxation_slope(xp, decay_dt, left, mean)
    return End(times(back, free), stage, left, mean, mean_slope, back, capped, deflection >= 1.0)


@kernel
def linearise(law, bristle, dt):
    """Step the bristle and keep the partial derivatives."""
    prediction = predict(law, bristle, dt)
    return BristleStep(bristle, dt, prediction, finish(law, bristle, dt, prediction.decay_dt))


@kernel
def _turn(place, norm_bar, along_bar, u, per_h):
    """Cotangent of a bristle from those of its norm and of its `along`."""
    c = along_bar * place.per_norm
    return plus(times(norm_bar - c * place.along, place.unit), c * per_h, u)


@kernel
def pull_back(s, new_bar, k_bar):
    """`BristleBars` from the cotangents of the new bristle and of its `k`."""
    (z, u, _, per_h, q), dt, prediction, last = s
    start, predicted, end = prediction.start, prediction.end, last.stage
    to_deflection = q * per_h
    # the new bristle: n = back n0, capped or not
    along_bar = k_bar * end.k_along
    v_bar, q_bar, breakaway_bar = k_bar * end.k_speed, k_bar * end.k_grip, 0.0
    to_bar, norm_bar, start_norm_bar = 0.0, 0.0, 0.0
    toward = times(along_bar, end.place.unit)  # cotangent of u/h
    if last.capped:  # at full deflection or more, where k no longer depends on it
        radial = dot(new_bar, end.place.unit) * last.back
        norm_bar = -radial
        if last.grown:
            start_norm_bar = radial * end.place.norm * start.place.per_norm
        else:
            to_bar = -radial * end.place.norm / to_deflection
        new_bar = times(last.back, new_bar)
    else:
        deflection_bar = k_bar * end.k_deflection
        norm_bar, to_bar = deflection_bar * to_deflection, deflection_bar * end.place.norm
        breakaway_bar = k_bar * end.k_breakaway
    free_bar = plus(new_bar, 1.0, _turn(end.place, norm_bar, along_bar, u, per_h))
    # n0 = left z + dt mean u
    x_bar = dt * last.mean_slope * dot(free_bar, u) - last.left * dot(free_bar, z)
    u_bar, z_bar = times(dt * last.mean, free_bar), times(last.left, free_bar)
    start_bar, end_bar = x_bar * dt * prediction.by_start, x_bar * dt * prediction.by_end
    # the predicted end
    along_bar, deflection_bar = end_bar * predicted.k_along, end_bar * predicted.k_deflection
    v_bar += end_bar * predicted.k_speed
    q_bar += end_bar * predicted.k_grip
    breakaway_bar += end_bar * predicted.k_breakaway
    to_bar += deflection_bar * predicted.place.norm * prediction.shrink
    start_bar -= deflection_bar * prediction.reached * prediction.shrink * dt
    p_bar = _turn(predicted.place, deflection_bar * to_deflection * prediction.shrink, along_bar, u, per_h)
    z_bar, u_bar = plus(z_bar, 1.0, p_bar), plus(u_bar, dt, p_bar)
    toward = plus(toward, along_bar, predicted.place.unit)
    # the start
    along_bar, deflection_bar = start_bar * start.k_along, start_bar * start.k_deflection
    v_bar += start_bar * start.k_speed
    q_bar += start_bar * start.k_grip
    breakaway_bar += start_bar * start.k_breakaway
    to_bar += deflection_bar * start.place.norm
    norm_bar = start_norm_bar + deflection_bar * to_deflection
    z_bar = plus(z_bar, 1.0, _turn(start.place, norm_bar, along_bar, u, per_h))
    toward = plus(toward, along_bar, start.place.unit)
    h_bar = -(per_h * per_h * dot(toward, u) + to_bar * to_deflection * per_h)
    return BristleBars(z_bar, plus(u_bar, per_h, toward), v_bar, h_bar, q_bar + to_bar * per_h, breakaway_bar)
