"""A spring of a scene: what ties a point of the body to an anchor that rests or moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.equality import ByValue, Kept, checked
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import rotate
from planarfriction.scenes.body import floats
from planarfriction.scenes.signal import Signal, as_signal


def _pose(name: str, value: Any) -> Signal:
    """Return `value` as a signal of poses; the angle of points `(x, y)` is zero."""
    signal = value if isinstance(value, Signal) else Signal.constant(value)
    if signal.columns == 2:
        signal = Signal(signal.times, np.pad(signal.values, ((0, 0), (0, 1))), signal.hold)
    return as_signal(name, signal, 3)


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
        pose, time = validation.finite_numbers("pose", pose), validation.finite_numbers("time", time)
        if pose.shape[-1:] != (3,) or time.shape not in ((), pose.shape[:-1]):
            rule = f"have the shape (..., 3) with one for each of {time.shape} times"
            raise InvalidValueError("pose", rule, pose.shape)
        arm = rotate(self.at, pose[..., 2])
        stretch = self.anchor(time) - pose - np.concatenate([arm, np.zeros_like(arm[..., :1])], -1)
        wrench = stretch * [self.stiffness, self.stiffness, self.torsion]
        wrench[..., 2] += arm[..., 0] * wrench[..., 1] - arm[..., 1] * wrench[..., 0]
        return wrench

    @property
    def numbers(self) -> tuple[float, ...]:
        """Constants in the order of `kernels.springs`."""
        return self.stiffness, self.damping, self.torsion, self.torsion_damping, *self.at


def pull_on(scene: Any, body: Any, time: float) -> np.ndarray:
    """Return the load `[3]` [N, N, N m] on a body of a scene at rest: applied force, weight, and pull of springs."""
    pull = np.array([*body.gravity, 0.0]) * body.mass + (0.0 if scene.force is None else scene.force(time))
    for spring in scene.springs:
        pull = pull + spring.pull(time, [*body.position, body.angle])
    return pull
