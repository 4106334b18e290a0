"""The rigid body of a scene, and springs that tie it to anchors that rest or move, as plain immutable data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Kept, checked
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import rotate
from planarfriction.scenes.signal import Signal, as_signal


def floats(name: str, value: Any, size: int) -> tuple[float, ...]:
    """Return `value` as a tuple of `size` finite numbers, or raise."""
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
    position: Kept[ArrayLike, tuple[float, float]] = checked(
        floats, 2, default=(0.0, 0.0)
    )
    """Initial position of the centre of mass in the world [m]."""
    angle: float = checked(validation.number, default=0.0)
    """Initial angle of the body's axes in the world [rad]."""
    velocity: Kept[ArrayLike, tuple[float, float, float]] = checked(
        floats, 3, default=(0.0, 0.0, 0.0)
    )
    """Initial twist `(vx, vy, omega)` of the centre of mass, world axes [m/s, m/s, rad/s]."""
    gravity: Kept[ArrayLike, tuple[float, float]] = checked(
        floats, 2, default=(0.0, -9.81)
    )
    """Gravity in the plane of motion, world axes [m/s^2]."""
    outline: Kept[ArrayLike | None, np.ndarray | None] = checked(
        _polygon, default=None, repr=False
    )
    """Polygon in body axes with the centre of mass at the origin, shape `[M, 2]` [m], or None.

    It is for drawings, and for contacts with an `edge`.
    """


def _pose(name: str, value: Any) -> Signal:
    """Return `value` as a signal of poses; the angle of points `(x, y)` is zero."""
    if not isinstance(value, Signal):
        value = validation.finite_numbers(name, value, largest=np.inf)
        value = np.append(value, 0.0) if value.shape == (2,) else value
    elif value.columns == 2:
        value = Signal(value.times, np.pad(value.values, ((0, 0), (0, 1))), value.hold)
    return as_signal(name, value, 3)


@dataclass(frozen=True, eq=False)
class Spring(ByValue):
    """A linear spring and damper between a point p of the body and an anchor; its length at rest is zero.

    `F = stiffness (a - p) + damping (a' - p')` acts on the body at p, and about its centre of mass the torque
    `torsion (angle - theta) + torsion_damping (angle' - omega)` besides, with the anchor's pose `(a, angle)`. An anchor
    that moves in steps (`hold="previous"`) has no velocity.

    Raises InvalidValueError for a constant that is not >= 0, and for an anchor that is no point, pose or signal.
    """

    stiffness: float = checked(validation.non_negative)
    """Stiffness [N/m], >= 0."""
    damping: float = checked(validation.non_negative, default=0.0)
    """Damping [N s/m], >= 0."""
    anchor: Kept[Signal | ArrayLike, Signal] = checked(_pose, default=(0.0, 0.0, 0.0))
    """Pose `(x, y, angle)` of the anchor in the world, `[T, 3]` [m, m, rad]; `(x, y)` stands for an angle of 0."""
    at: Kept[ArrayLike, tuple[float, float]] = checked(floats, 2, default=(0.0, 0.0))
    """Point of the body, in its axes from its centre of mass [m]."""
    torsion: float = checked(validation.non_negative, default=0.0)
    """Stiffness about the vertical [N m/rad], >= 0."""
    torsion_damping: float = checked(validation.non_negative, default=0.0)
    """Damping about the vertical [N m s/rad], >= 0."""

    def pull(self, time: ArrayLike, pose: ArrayLike) -> np.ndarray:
        """Return the wrench `(fx, fy, tau)` `[..., 3]` of the stretch, without damping, on bodies at `pose` `[..., 3]`.

        It acts at the centre of mass, world axes [N, N, N m]; `time` `[...]` [s] tells the pose of the anchor.

        Raises InvalidValueError for times or poses that are not finite, or do not belong together.
        """
        pose = validation.finite_numbers("pose", pose)
        time = validation.finite_numbers("time", time)
        if pose.shape[-1:] != (3,) or time.shape not in ((), pose.shape[:-1]):
            rule = f"have the shape (..., 3) with one for each of {time.shape} times"
            raise InvalidValueError("pose", rule, pose.shape)
        arm = rotate(self.at, pose[..., 2])
        stretch = self.anchor(time) - pose
        stretch[..., :2] -= arm
        wrench = stretch * [self.stiffness, self.stiffness, self.torsion]
        wrench[..., 2] += arm[..., 0] * wrench[..., 1] - arm[..., 1] * wrench[..., 0]
        return wrench

    @property
    def numbers(self) -> tuple[float, ...]:
        """Constants in the order of `body.springs`."""
        turning = self.torsion, self.torsion_damping
        return self.stiffness, self.damping, *turning, *self.at


def pull_on(scene: Any, body: Any, time: float) -> np.ndarray:
    """Return the load `[3]` [N, N, N m] on a body of a scene at rest: applied force, weight, and springs."""
    pull = np.array([*body.gravity, 0.0]) * body.mass
    if scene.force is not None:
        pull = pull + scene.force(time)
    for spring in scene.springs:
        pull = pull + spring.pull(time, [*body.position, body.angle])
    return pull
