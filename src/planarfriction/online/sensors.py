"""Sensors of a gripper: noise and rates that an observer counts on, and their samples at one instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, by_parts, checked

GRAVITY = 9.81
"""Gravity [m/s^2]."""


@by_parts
class Measurement(NamedTuple):
    """Sensors at one instant; leading axes are parts."""

    time: Any
    """Time of the samples [s], `[...]`."""
    wrench: Any
    """Friction wrench of one finger on the part, about the grip's centre, axes of the hand `[..., 3]` [N, N, N m]."""
    normal_force: Any
    """Grip force [N], `[...]`."""
    slip_velocity: Any = None
    """Mean velocity of the part over its finger since the last such sample, `[..., 3]` [m/s, m/s, rad/s]; NaN or None
    between samples."""


@dataclass(frozen=True, eq=False)
class Sensors(ByValue):
    """Noise and rates of the sensors of a gripper.

    Raises InvalidValueError for a value out of range.
    """

    force_noise: float = checked(validation.non_negative, default=0.02)
    """Standard deviation of the forces, also of the grip force [N]."""
    torque_noise: float = checked(validation.non_negative, default=2e-4)
    """Standard deviation of the torque [N m]."""
    slip_rate: float = checked(validation.non_negative, default=120.0)
    """Rate of the slip velocity [Hz]; 0 for no such sensor."""
    quantum: float = checked(validation.positive, default=0.95e-3)
    """Smallest slip velocity [m/s]: the sensor counts places, so that what a sample leaves out is in the next."""
    base: float = checked(validation.positive, default=0.01)
    """Distance of the two counters whose difference is the spin [m]."""
