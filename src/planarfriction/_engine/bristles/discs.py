"""The bristle of a small disc: three components, two of its centre and one of its spin.

A disc of radius a whose centre moves at `(u_x, u_y)` and which spins at omega sees `u = (u_x, u_y, kappa a omega)` with
`kappa^2 = 1/2`, so that `|u|^2` is its mean square speed and `sigma_0 u` its elastic response. Steady sliding pulls
along `W(u)`, and with the mean speed S (see `formulas.disc_friction`)

    z_ss = g(S)/sigma_0 W/S,     z_t' = (1 - l k z.W/|W|^2) u_t - (1 - l) (k/c_t) z_t,     z_s' = u_s - (k/c_s) z_s,

where what lies across W lacks the share l of its decay, and k is the decay of a single bristle with the deflection
`|z|/|z_ss|` and the cosine of z and W (docs/discs.md). A disc without a radius is the bristle of a point.
Derivatives and loops are written from a trace of its functions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction import formulas
from planarfriction._engine.bristles.bristle_step import capped
from planarfriction._engine.bristles.law import inverse_deflection, traction
from planarfriction._engine.codegen.ratios import ratio
from planarfriction._engine.codegen.vectors import Vector, dot, norm
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers

KAPPA = math.sqrt(0.5)
"""Radius of gyration of a disc, over its radius."""

STILL = 1e-100
"""Speed [m/s] up to which the ratio of two speeds has its value at rest: the slopes leave the range of numbers."""

LONG = 1e12
"""Decay over a step [-] from which the prediction has slid fully; its cube stays in range, in single precision too."""


@kernel
def sliding(u: Vector) -> tuple[float, float, float, float, Vector]:
    """Return `c_t`, `c_s`, the share l of `formulas.disc_friction`, the mean speed S, and W."""
    slide = u[0] * u[0] + u[1] * u[1]
    spin = 2.0 * u[2] * u[2]
    c_t, c_s, m, across = formulas.disc_friction(xp, slide, spin)
    pull = c_t * u[0], c_t * u[1], c_s * u[2]
    return c_t, c_s, across, math.sqrt(slide + m * spin), pull


@kernel
def mean_speed(u: Vector) -> float:
    """Return S."""
    return sliding(u)[3]


class _Drive(NamedTuple):
    """Motion of a disc, as its bristle sees it."""

    u: Vector
    decay_t: float
    """Decay of `z_t` over k: `(1 - l)/c_t` [-]."""
    decay_s: float
    """Decay of `z_s` over k: `1/c_s` [-]."""
    more: float
    """Further decay of what of `z_t` lies along `u_t`, over k: `(l/c_t) |W_t|^2/|W|^2` [-]."""
    across: float
    """l"""
    drag: float
    """`l/|W|` [s/m]: a bristle along W takes this much of u."""
    speed: float
    """S."""
    q: float
    """Inverse deflection."""
    per_h: float
    """`S/|W|`; 1 at rest, which is about its value near it."""
    spin: float
    """Share of spin in u."""
    pull: Vector
    """`W/|W|`."""


@kernel
def _moving(speed: float) -> float:
    """Return a speed; 0 up to `STILL`."""
    return xp.where(speed > STILL, speed, 0.0)


@kernel
def _drive(law: LawNumbers, u: Vector, slid: tuple) -> _Drive:
    """Return the motion of a disc from its velocity and its `sliding`."""
    c_t, c_s, across, speed, pull = slid
    across = across * xp.where(law.elasto_plastic > 0.0, 1.0, formulas.PLAIN_ACROSS)
    both = 1.0 / (c_t * c_s)
    size = _moving(norm(pull))
    n_s = ratio(pull[2], size)
    return _Drive(
        u,
        (1.0 - across) * c_s * both,
        c_t * both,
        across * (1.0 - n_s * n_s) * (c_s * both),
        across,
        ratio(across, size),
        speed,
        inverse_deflection(law, speed),
        xp.where(size > 0.0, ratio(speed, size), 1.0),
        ratio(u[2], _moving(norm(u))),
        (ratio(pull[0], size), ratio(pull[1], size), n_s),
    )


@kernel
def _seen(drive: _Drive, z: Vector) -> tuple[float, float, float]:
    """Return the deflection of a bristle, the cosine of it and W, and the share of spin in it."""
    size = norm(z)
    deflection = size * (drive.q * drive.per_h)
    return deflection, ratio(dot(z, drive.pull), size), ratio(z[2], size)


@kernel
def _decay(
    law: LawNumbers, drive: _Drive, deflection: float, cosine: float, spin: float
) -> float:
    """Return k."""
    share = formulas.disc_slip_share(
        xp, deflection, spin, drive.spin, law.breakaway_ratio
    )
    alpha = formulas.slip_fraction(xp, share, 0.0)
    speed = drive.speed
    return formulas.decay_at(xp, alpha, speed * cosine, speed, drive.q, law)


@kernel
def _rate(drive: _Drive, z: Vector, k: float) -> Vector:
    """Return z'."""
    u = drive.u
    t = k * drive.decay_t
    part = 1.0 - k * (drive.drag * dot(z, drive.pull))
    return (
        part * u[0] - t * z[0],
        part * u[1] - t * z[1],
        u[2] - k * drive.decay_s * z[2],
    )


@kernel
def evaluate(law: LawNumbers, z: Vector, u: Vector) -> tuple[Vector, Vector]:
    """Return z' and the traction of a disc that moves at u."""
    drive = _drive(law, u, sliding(u))
    rate = _rate(drive, z, _decay(law, drive, *_seen(drive, z)))
    return rate, traction(law, z, rate, u)


@kernel
def _lack(drive: _Drive, z: Vector, k_dt: float, dt: float) -> tuple[float, float]:
    """Return what a bristle lacks along W in a step, by its centre and by its spin, as times [s] for which l u acts.

    Both are 0 in steady sliding, and below 0 where friction has fallen.
    """
    n = drive.pull
    dt = drive.across * dt
    spin = dt * (n[2] * n[2])
    centre = drive.drag * (n[0] * z[0] + n[1] * z[1])
    return (dt - spin) - k_dt * centre, spin - k_dt * (drive.drag * (n[2] * z[2]))


@kernel
def _ahead(drive: _Drive, z: Vector, k_dt: float, dt: float) -> Vector:
    """Return the bristle at the predicted end of a step, each component at its own rate."""
    u = drive.u
    t = 1.0 + k_dt * drive.decay_t
    s = 1.0 + k_dt * drive.decay_s
    along = t + k_dt * drive.more
    per = 1.0 / (t * s * along)
    by_centre, by_spin = _lack(drive, z, k_dt, dt)
    part = (dt - drive.across * dt) + (by_centre * s + by_spin) * (t * per)
    t, s = s * along * per, t * along * per
    return (z[0] + part * u[0]) * t, (z[1] + part * u[1]) * t, (z[2] + dt * u[2]) * s


@kernel
def _relaxed(drive: _Drive, z: Vector, k_dt: float, dt: float) -> Vector:
    """Return the bristle at the end of a step, `k_dt` being the mean over it.

    Of an excess along `u_t`, `e^-x (1 - y/2 + y^2/12)/(1 + y/2 + y^2/12)` is left: about `e^-(x + y)`, never below 0.
    """
    u = drive.u
    left_t, mean_t = formulas.relaxation(xp, k_dt * drive.decay_t)
    left_s, mean_s = formulas.relaxation(xp, k_dt * drive.decay_s)
    y = k_dt * drive.more
    s = 1.0 + 0.5 * k_dt * (drive.decay_s - drive.decay_t)
    by_centre, by_spin = _lack(drive, z, k_dt, dt)
    lack = (by_centre * s + by_spin) / (s * (1.0 + y * (0.5 + y * (1.0 / 12.0))))
    part = mean_t * (dt - drive.across * dt) + left_t * lack
    mean_s = mean_s * dt
    return (
        left_t * z[0] + part * u[0],
        left_t * z[1] + part * u[1],
        left_s * z[2] + mean_s * u[2],
    )


@kernel
def moved(law: LawNumbers, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
    """Return the bristle after dt and its rate there: `bristle_step` with a rate for each component."""
    drive = _drive(law, u, sliding(u))
    deflection, cosine, spin = _seen(drive, z)
    start = _decay(law, drive, deflection, cosine, spin)
    ahead = _ahead(drive, z, xp.minimum(start * dt, LONG), dt)
    end = _decay(law, drive, *_seen(drive, ahead))
    free = _relaxed(drive, z, formulas.mean_decay(start, end, dt) * dt, dt)
    far, cosine, spin = _seen(drive, free)
    new, far = capped(law, free, far, deflection)
    return new, _rate(drive, new, _decay(law, drive, far, cosine, spin))


@kernel
def step(law: LawNumbers, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
    """Return the bristle after dt and its traction."""
    new, rate = moved(law, z, u, dt)
    return new, traction(law, new, rate, u)
