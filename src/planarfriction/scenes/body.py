"""The rigid body of a scene, as plain immutable data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.equality import ByValue, Kept, checked
from planarfriction.errors import InvalidValueError


def floats(name: str, value: Any, size: int) -> tuple[float, ...]:
    """Return `value` as a tuple of `size` finite numbers, or raise."""
    fits = type(value) is tuple and len(value) == size
    if fits and all(type(each) is float and abs(each) <= validation.LARGEST for each in value):
        return value
    return tuple(validation.vector(name, value, size).tolist())


def _polygon(name: str, value: Any) -> np.ndarray:
    """Return `value` as a read-only polygon `[M, 2]` with at least three corners, or raise."""
    corners = validation.array(name, value, (None, 2))
    if len(corners) < 3:
        raise InvalidValueError(name, "have at least 3 points", f"{len(corners)}")
    corners.setflags(write=False)
    return corners


@dataclass(frozen=True, eq=False)
class Body(ByValue):
    """A rigid body that moves in the contact plane: inertia, initial state, gravity. World frame: x right, y up.

    Raises InvalidValueError for a mass or an inertia that is not > 0, and for vectors of the wrong length.
    """

    mass: float = checked(validation.positive)
    """Mass [kg]."""
    inertia: float = checked(validation.positive)
    """Moment of inertia about the centre of mass [kg m^2]."""
    position: Kept[ArrayLike, tuple[float, float]] = checked(floats, 2, default=(0.0, 0.0))
    """Initial position of the centre of mass in the world [m]."""
    angle: float = checked(validation.number, default=0.0)
    """Initial angle of the body's axes in the world [rad]."""
    velocity: Kept[ArrayLike, tuple[float, float, float]] = checked(floats, 3, default=(0.0, 0.0, 0.0))
    """Initial twist `(vx, vy, omega)` of the centre of mass, world axes [m/s, m/s, rad/s]."""
    gravity: Kept[ArrayLike, tuple[float, float]] = checked(floats, 2, default=(0.0, -9.81))
    """Gravity in the plane of motion, world axes [m/s^2]."""
    outline: Kept[ArrayLike | None, np.ndarray | None] = checked(_polygon, default=None, repr=False)
    """Polygon in body axes with the centre of mass at the origin, shape `[M, 2]` [m], or None.

    It is for drawings, and for contacts with an `edge`.
    """
