"""The bristle equation for JAX: `zdot = u - k z` and its exponential step, for bristles of any dimension.

The vectors `z` and `u` lie along `axis`: -1 with three components in the reduced model (scaled), -2 with two components
for the cells of the distributed model. `speed` and `h_norm` (1 for cells) have their shape without that axis.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.jax import namespace as xp

ROUNDING = 256.0
"""Excess over the largest deflection, in units of the rounding error, that counts as rounding.

Steady sliding sits on the largest deflection to the last bit; rounding must not decide which derivative it has.
"""


class Drive(NamedTuple):
    """What drives a bristle at a held twist."""

    u: jnp.ndarray
    """Driving velocity [m/s]."""
    speed: jnp.ndarray
    """Speed that friction depends on [m/s]."""
    h_norm: jnp.ndarray | float
    """`|u|/speed` [-]: the largest deflection is `h_norm g/sigma_0`."""
    grip: jnp.ndarray
    """`sigma_0/g(speed)` [1/m]."""


def law_of(parameters, elasto_plastic: bool) -> LawNumbers:
    """The law of a record that has its parameters by name."""
    named = {name: getattr(parameters, name) for name in LawNumbers._fields[:7]}
    return LawNumbers(**named, elasto_plastic=float(elasto_plastic), breakaway_ratio=parameters.breakaway_ratio)


def grip(law: LawNumbers, speed):
    """`sigma_0/g(v)` [1/m]."""
    return law.sigma_0 / formulas.stribeck(xp, speed, law)


def decay(law: LawNumbers, z, drive: Drive, axis: int):
    """Rate `k` [1/s] of `zdot = u - k z`."""
    length = xp.norm(z, axis)
    return _decay(law, length * drive.grip / drive.h_norm, _along(z, length, drive, axis), drive)


def _along(z, length, drive: Drive, axis: int):
    """`z/|z| . u/|u| speed` [m/s]; 0, with derivative 0, at z = 0."""
    return jnp.sum(xp.unit(z, length, axis) * drive.u, axis=axis) / drive.h_norm


def _decay(law: LawNumbers, deflection, along, drive: Drive):
    return formulas.bristle_decay(xp, deflection, along, drive.speed, drive.grip, law)


def advance(law: LawNumbers, z, drive: Drive, dt, axis: int):
    """The bristle after `dt` [s] at a held drive (see `formulas.relaxation`), and `k` there."""
    to_deflection = drive.grip / drive.h_norm

    def wide(value):
        return jnp.expand_dims(value, axis)

    start_deflection = xp.norm(z, axis) * to_deflection
    start = decay(law, z, drive, axis)
    predicted = z + drive.u * wide(dt)  # times 1/(1 + k dt), which leaves the direction
    length = xp.norm(predicted, axis)
    deflection = xp.minimum(length * to_deflection / (1.0 + start * dt), xp.maximum(start_deflection, 1.0))
    end = _decay(law, deflection, _along(predicted, length, drive, axis), drive)
    left, mean = formulas.relaxation(xp, formulas.mean_decay(start, end, dt) * dt)
    z = z * wide(left) + drive.u * wide(dt * mean)
    largest = formulas.reachable_deflection(xp, start_deflection, law)
    z = z * wide(_back(xp.norm(z, axis) * to_deflection, largest))
    return z, decay(law, z, drive, axis)


def _back(deflection, largest):
    """Factor that brings a bristle back onto the ball that it may not leave; rounding is no excess."""
    margin = 1.0 + ROUNDING * jnp.finfo(deflection.dtype).eps
    return formulas.cap(xp, jnp.where(deflection > margin * largest, deflection, 0.0), largest)
