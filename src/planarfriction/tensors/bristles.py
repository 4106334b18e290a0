"""Bristles of any dimension: `kernels.bristle_step` as `f(xp, ...)`, with derivatives that are finite everywhere.

A bristle lies along `axis`: two components in every cell of the distributed model, three in the published one. All
else, the law's parameters too, broadcasts with the length of a bristle, whose axis has length 1.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.formulas import LawNumbers

ROUNDING = 256.0
"""Excess over the largest deflection, in units of the rounding error, that counts as rounding.

Steady sliding sits on the largest deflection to the last bit: rounding must not decide which derivative it has.
"""


class Drive(NamedTuple):
    """Velocities that drive bristles at a constant twist."""

    velocity: Any
    """`u`: velocity of a cell, `h(V) v_n` in the published model [m/s]."""
    speed: Any
    """`|v|` of a cell, `v_n` in the published model [m/s]."""
    size: Any
    """`|u|/speed`: 1 for a cell, `|h|` in the published model [-]."""
    grip: Any
    """`sigma_0/g(speed)` [1/m]."""
    viscous: Any
    """Velocity that viscous friction opposes: that of a cell, `U V` in the published model."""


def drive(xp, law: LawNumbers, velocity, speed, size, viscous) -> Drive:
    """Return the drive of bristles, with the grip at its speed."""
    return Drive(velocity, speed, size, law.sigma_0 / formulas.stribeck(xp, speed, law), viscous)


def rate(xp, law: LawNumbers, z, by: Drive, axis: int):
    """Return `zdot = u - k z`."""
    z_norm = xp.norm(z, axis)
    return by.velocity - _decay(xp, law, z_norm * (by.grip / by.size), _along(xp, z, z_norm, by, axis), by) * z


def step(xp, law: LawNumbers, z, by: Drive, dt, axis: int):
    """Return the bristles after `dt` of a constant drive, and their rates (see `formulas.relaxation`)."""
    u, to_deflection = by.velocity, by.grip / by.size
    z_norm = xp.norm(z, axis)
    deflection = z_norm * to_deflection
    start = end = _decay(xp, law, deflection, _along(xp, z, z_norm, by, axis), by)
    if law.elasto_plastic:
        predicted = z + u * dt  # times 1/(1 + k dt), which leaves the direction
        p_norm = xp.norm(predicted, axis)
        bound = xp.minimum(p_norm * to_deflection / (1.0 + start * dt), xp.maximum(deflection, 1.0))
        end = _decay(xp, law, bound, _along(xp, predicted, p_norm, by, axis), by)
    left, mean = formulas.relaxation(xp, formulas.mean_decay(start, end, dt) * dt)
    new = z * left + u * dt * mean
    norm = xp.norm(new, axis)
    along = _along(xp, new, norm, by, axis)
    if law.elasto_plastic:
        beyond = xp.where(deflection > _full(xp, deflection), deflection, 0.0)
        back = back_onto(xp, norm * to_deflection, formulas.reachable_deflection(xp, beyond, law))
        new, norm = new * back, norm * back
    return new, u - _decay(xp, law, norm * to_deflection, along, by) * new


def back_onto(xp, deflection, largest):
    """Return the factor that brings a bristle back onto the ball that it may not leave; rounding is no excess."""
    return formulas.cap(xp, xp.where(deflection > _full(xp, deflection) * largest, deflection, 0.0), largest)


def _full(xp, deflection):
    """Return the deflection up to which a bristle is full, and no further, to rounding [-]."""
    return 1.0 + ROUNDING * xp.epsilon(deflection)


def _decay(xp, law: LawNumbers, deflection, along, by: Drive):
    return formulas.bristle_decay(xp, deflection, along, by.speed, by.grip, law)


def _along(xp, z, z_norm, by: Drive, axis: int):
    """Return the speed at which a bristle is stretched, `z/|z| . u/size`; 0 with derivative 0 for a bristle at rest."""
    deflected = z_norm > 0.0
    stretch = xp.dot(z, by.velocity, axis) / (by.size * xp.where(deflected, z_norm, 1.0))
    return xp.where(deflected, stretch, 0.0)
