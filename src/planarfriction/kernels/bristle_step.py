"""One step of one bristle, differentiated: what both bristle models do with one, backwards.

A bristle `z` driven by `u` (three components; a cell of the distributed model leaves the third zero) steps by

    start = k(z),   p = z + u dt,   end = k(p / (1 + start dt)),   x = mean_decay(start, end, dt) dt,
    n = back (exp(-x) z + (1 - exp(-x))/x dt u),   k(n)

`k` sees the deflection `|z| q/h` and `along = z/|z| . u/h`, with the grip `q`, the speed `v` and `h = |u|/v`.
`linearise` walks forward and keeps the partial derivatives; `pull_back` turns cotangents of the new bristle `n` and of
its `k` into those of `z`, `u`, `v`, `h`, `q` and the breakaway ratio.

At the kinks: the slope of a norm at zero is zero, and `along` of no bristle is constant. A minimum or maximum of equal
numbers has the slope of its first argument. A bristle that the cap just touches counts as not capped: steady sliding
sits on the cap to the last bit, and whether rounding lifts it over must not decide about its slope.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined

_ROUNDING = 1.0 + 256.0 * 2.220446049250313e-16


class Stage(NamedTuple):
    """The decay of a bristle, and what its slopes need."""

    ex: float
    """Unit vector of the bristle, zero where it has none."""
    ey: float
    es: float
    norm: float
    per_norm: float
    """One over the norm; 0 at 0."""
    along: float
    k: float
    k_deflection: float
    k_along: float
    k_speed: float
    k_grip: float
    k_breakaway: float


class BristleStep(NamedTuple):
    """A step with its partial derivatives."""

    nx: float
    """New bristle."""
    ny: float
    ns: float
    k: float
    """Its decay."""
    start: Stage
    predicted: Stage
    end: Stage
    shrink: float
    """`1/(1 + start dt)`"""
    reached: float
    """Predicted deflection."""
    left: float
    mean: float
    mean_slope: float
    by_start: float
    """d mean_decay/d start"""
    by_end: float
    back: float
    capped: bool
    grown: bool
    """The bristle began beyond full deflection, which is then its cap. (Rounding apart, no step grows it further.)"""


@inlined
def _place(zx, zy, zs, ux, uy, us, per_h):
    norm = math.sqrt(zx * zx + zy * zy + zs * zs)
    per_norm = 1.0 / norm if norm > 0.0 else 0.0
    ex, ey, es = zx * per_norm, zy * per_norm, zs * per_norm
    return ex, ey, es, norm, per_norm, per_h * (ex * ux + ey * uy + es * us)


@inlined
def _stage(law, place, deflection, v, q):
    k, k_deflection, k_along, k_speed = formulas.bristle_decay_partials(xp, deflection, place[5], v, q, law)
    # exactly zero at full deflection: the prediction multiplies it by how far it would have gone, 1e9 in a long step
    k_deflection = xp.where(deflection < 1.0, k_deflection, 0.0)
    k_breakaway = formulas.bristle_decay_by_breakaway(xp, k_deflection, deflection, law.breakaway_ratio)
    return Stage(
        place[0], place[1], place[2], place[3], place[4], place[5],
        k, k_deflection, k_along, k_speed, k / q, k_breakaway,
    )  # fmt: skip


@inlined
def linearise(law, zx, zy, zs, ux, uy, us, v, per_h, q, dt):
    """Step the bristle `z`, driven by `u`, and keep the partial derivatives."""
    to_deflection = q * per_h
    place = _place(zx, zy, zs, ux, uy, us, per_h)
    deflection = place[3] * to_deflection
    start = _stage(law, place, deflection, v, q)
    place = _place(zx + ux * dt, zy + uy * dt, zs + us * dt, ux, uy, us, per_h)
    shrink = 1.0 / (1.0 + start.k * dt)
    reached = place[3] * to_deflection * shrink
    # the bound of the prediction is full deflection or more, where k no longer depends on the deflection
    predicted = _stage(law, place, xp.minimum(reached, xp.maximum(deflection, 1.0)), v, q)
    decay_dt = formulas.mean_decay(start.k, predicted.k, dt) * dt
    by_start, by_end = formulas.mean_decay_partials(start.k, predicted.k, dt)
    left, mean = formulas.relaxation(xp, decay_dt)
    mean_slope = formulas.relaxation_slope(xp, decay_dt, left, mean)
    push = dt * mean
    nx, ny, ns = left * zx + push * ux, left * zy + push * uy, left * zs + push * us
    place = _place(nx, ny, ns, ux, uy, us, per_h)
    largest = formulas.reachable_deflection(xp, deflection, law)
    capped = place[3] * to_deflection > _ROUNDING * largest
    back = formulas.cap(xp, place[3] * to_deflection, largest)
    end = _stage(law, place, place[3] * back * to_deflection, v, q)
    return BristleStep(
        nx * back, ny * back, ns * back, end.k, start, predicted, end, shrink, reached,
        left, mean, mean_slope, by_start, by_end, back, capped, deflection >= 1.0,
    )  # fmt: skip


@inlined
def _turn(stage, norm_bar, along_bar, ux, uy, us, per_h):
    """Cotangent of a bristle from those of its norm and of its `along`."""
    c = along_bar * stage.per_norm
    d = norm_bar - c * stage.along
    c = c * per_h
    return c * ux + d * stage.ex, c * uy + d * stage.ey, c * us + d * stage.es


@inlined
def pull_back(s, zx, zy, zs, ux, uy, us, per_h, q, dt, bx, by, bs, k_bar):
    """Cotangents of `z` (3), `u` (3), `v`, `h`, `q` and the breakaway ratio from those of `n` (3) and of its `k`."""
    start, predicted, end = s.start, s.predicted, s.end
    to_deflection = q * per_h
    # the new bristle: n = back n0, capped or not
    along_bar = k_bar * end.k_along
    v_bar, q_bar, breakaway_bar = k_bar * end.k_speed, k_bar * end.k_grip, 0.0
    h_bar, to_bar, norm_bar, start_norm_bar = 0.0, 0.0, 0.0, 0.0
    ax, ay, a_s = along_bar * end.ex, along_bar * end.ey, along_bar * end.es  # of u/h
    if s.capped:  # at full deflection or more, where k no longer depends on it
        radial = (bx * end.ex + by * end.ey + bs * end.es) * s.back
        norm_bar = -radial
        if s.grown:
            start_norm_bar = radial * end.norm * start.per_norm
        else:
            to_bar = -radial * end.norm / to_deflection
        bx, by, bs = bx * s.back, by * s.back, bs * s.back
    else:
        deflection_bar = k_bar * end.k_deflection
        norm_bar, to_bar = deflection_bar * to_deflection, deflection_bar * end.norm
        breakaway_bar = k_bar * end.k_breakaway
    tx, ty, ts = _turn(end, norm_bar, along_bar, ux, uy, us, per_h)
    bx, by, bs = bx + tx, by + ty, bs + ts
    # n0 = left z + dt mean u
    x_bar = dt * s.mean_slope * (bx * ux + by * uy + bs * us) - s.left * (bx * zx + by * zy + bs * zs)
    push = dt * s.mean
    u_x, u_y, u_s = push * bx, push * by, push * bs
    z_x, z_y, z_s = s.left * bx, s.left * by, s.left * bs
    start_bar, end_bar = x_bar * dt * s.by_start, x_bar * dt * s.by_end
    # the predicted end
    along_bar, deflection_bar = end_bar * predicted.k_along, end_bar * predicted.k_deflection
    v_bar += end_bar * predicted.k_speed
    q_bar += end_bar * predicted.k_grip
    breakaway_bar += end_bar * predicted.k_breakaway
    norm_bar = deflection_bar * to_deflection * s.shrink
    to_bar += deflection_bar * predicted.norm * s.shrink
    start_bar -= deflection_bar * s.reached * s.shrink * dt
    tx, ty, ts = _turn(predicted, norm_bar, along_bar, ux, uy, us, per_h)
    z_x, z_y, z_s = z_x + tx, z_y + ty, z_s + ts
    u_x, u_y, u_s = u_x + dt * tx, u_y + dt * ty, u_s + dt * ts
    ax, ay, a_s = ax + along_bar * predicted.ex, ay + along_bar * predicted.ey, a_s + along_bar * predicted.es
    # the start
    along_bar, deflection_bar = start_bar * start.k_along, start_bar * start.k_deflection
    v_bar += start_bar * start.k_speed
    q_bar += start_bar * start.k_grip
    breakaway_bar += start_bar * start.k_breakaway
    to_bar += deflection_bar * start.norm
    tx, ty, ts = _turn(start, start_norm_bar + deflection_bar * to_deflection, along_bar, ux, uy, us, per_h)
    z_x, z_y, z_s = z_x + tx, z_y + ty, z_s + ts
    ax, ay, a_s = ax + along_bar * start.ex, ay + along_bar * start.ey, a_s + along_bar * start.es
    h_bar -= per_h * per_h * (ax * ux + ay * uy + a_s * us) + to_bar * to_deflection * per_h
    q_bar += to_bar * per_h
    u_x, u_y, u_s = u_x + per_h * ax, u_y + per_h * ay, u_s + per_h * a_s
    return z_x, z_y, z_s, u_x, u_y, u_s, v_bar, h_bar, q_bar, breakaway_bar
