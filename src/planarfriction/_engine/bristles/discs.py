"""The bristle of a small disc: three components, two of its centre and one of its spin.

A disc of radius a whose centre moves at `(u_x, u_y)` and which spins at omega sees `u = (u_x, u_y, kappa a omega)` with
`kappa^2 = 1/2`, so that `|u|^2` is its mean square speed and `sigma_0 u` its elastic response. Steady sliding pulls
along `W(u)`, and with the mean speed S (see `formulas.disc_friction`)

    z_ss = g(S)/sigma_0 W/S,     z_t' = u_t - (k/c_t) z_t,     z_s' = u_s - (k/c_s) z_s,

where k is the decay of a single bristle with the deflection `|z|/|z_ss|` and the cosine of z and W (docs/physics.md,
"Discs"). A disc without a radius is the bristle of a point. Derivatives and loops are written from a trace of its
functions.
"""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction._engine.bristles.bristle_step import capped, seen
from planarfriction._engine.bristles.law import inverse_deflection, traction
from planarfriction._engine.codegen.ratios import ratio
from planarfriction._engine.codegen.vectors import Vector, norm
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers

KAPPA = math.sqrt(0.5)
"""Radius of gyration of a disc, over its radius."""

STILL = 1e-100
"""Speed [m/s] up to which the ratio of two speeds has its value at rest: the slopes leave the range of numbers."""


@kernel
def sliding(u: Vector) -> tuple[float, float, float, Vector]:
    """Return `c_t`, `c_s`, the mean speed S, and W."""
    slide = u[0] * u[0] + u[1] * u[1]
    spin = 2.0 * u[2] * u[2]
    c_t, c_s, m = formulas.disc_friction(xp, slide, spin)
    return c_t, c_s, math.sqrt(slide + m * spin), (c_t * u[0], c_t * u[1], c_s * u[2])


@kernel
def mean_speed(u: Vector) -> float:
    """Return S."""
    _, _, speed, _ = sliding(u)
    return speed


@kernel
def _per_h(speed: float, pull: Vector) -> float:
    """Return `S/|W|`; 1 at rest, which is about its value near it."""
    size = norm(pull)
    moves = size > STILL
    return xp.where(moves, speed, 1.0) / xp.where(moves, size, 1.0)


@kernel
def _seen(z: Vector, pull: Vector, per_h: float, q: float) -> Vector:
    """Return the deflection of a bristle, the speed at which it is being stretched, and the share of spin in it."""
    size = norm(z)
    deflection, along = seen(z, size, pull, per_h, q)
    spin = ratio(z[2], size)
    return deflection, along, spin * spin


@kernel
def _decay(
    law: LawNumbers,
    deflection: float,
    along: float,
    spin_share: float,
    speed: float,
    q: float,
) -> float:
    """Return k."""
    slipping = formulas.disc_deflection(xp, deflection, spin_share, law.breakaway_ratio)
    return formulas.bristle_decay(xp, slipping, along, speed, q, law)


@kernel
def _rate(u: Vector, z: Vector, k: float, c_t: float, c_s: float, per: float) -> Vector:
    """Return z'; `per` is `1/(c_t c_s)`."""
    k = k * per
    return u[0] - k * c_s * z[0], u[1] - k * c_s * z[1], u[2] - k * c_t * z[2]


@kernel
def evaluate(law: LawNumbers, z: Vector, u: Vector) -> tuple[Vector, Vector]:
    """Return z' and the traction of a disc that moves at u."""
    c_t, c_s, speed, pull = sliding(u)
    q = inverse_deflection(law, speed)
    deflection, along, share = _seen(z, pull, _per_h(speed, pull), q)
    rate = _rate(
        u,
        z,
        _decay(law, deflection, along, share, speed, q),
        c_t,
        c_s,
        1.0 / (c_t * c_s),
    )
    return rate, traction(law, z, rate, u)


@kernel
def _ahead(
    z: Vector, u: Vector, k_dt: float, c_t: float, c_s: float, dt: float
) -> Vector:
    """Return the bristle at the predicted end of a step, each component at its own rate."""
    t = c_t + k_dt
    s = c_s + k_dt
    per = 1.0 / (t * s)
    t, s = c_t * s * per, c_s * t * per
    return (z[0] + dt * u[0]) * t, (z[1] + dt * u[1]) * t, (z[2] + dt * u[2]) * s


@kernel
def _relaxed(
    z: Vector, u: Vector, k_dt: float, c_t: float, c_s: float, dt: float
) -> Vector:
    """Return the bristle at the end of a step, `k_dt` being the mean of k dt over `c_t c_s`."""
    left_t, mean_t = formulas.relaxation(xp, k_dt * c_s)
    left_s, mean_s = formulas.relaxation(xp, k_dt * c_t)
    mean_t = mean_t * dt
    mean_s = mean_s * dt
    return (
        left_t * z[0] + mean_t * u[0],
        left_t * z[1] + mean_t * u[1],
        left_s * z[2] + mean_s * u[2],
    )


@kernel
def moved(law: LawNumbers, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
    """Return the bristle after dt and its rate there, by the equations of `bristle_step`."""
    c_t, c_s, speed, pull = sliding(u)
    q = inverse_deflection(law, speed)
    per_h = _per_h(speed, pull)
    per = 1.0 / (c_t * c_s)
    deflection, along, share = _seen(z, pull, per_h, q)
    start = _decay(law, deflection, along, share, speed, q)
    far, along, share = _seen(_ahead(z, u, start * dt, c_t, c_s, dt), pull, per_h, q)
    end = _decay(law, far, along, share, speed, q)
    free = _relaxed(z, u, formulas.mean_decay(start, end, dt) * dt * per, c_t, c_s, dt)
    far, along, share = _seen(free, pull, per_h, q)
    new, far = capped(law, free, far, deflection)
    return new, _rate(u, new, _decay(law, far, along, share, speed, q), c_t, c_s, per)


@kernel
def step(law: LawNumbers, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
    """Return the bristle after dt and its traction."""
    new, rate = moved(law, z, u, dt)
    return new, traction(law, new, rate, u)
