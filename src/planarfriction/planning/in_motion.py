"""The grip force with which a gripper holds a part that it accelerates in any direction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction._support.pictures import picture
from planarfriction.patch import ContactPatch
from planarfriction.planning.holding import (
    GRAVITY,
    forces_needed,
    smallest_force,
    surface_at,
)

STEP = 5
"""Angle between directions of acceleration [°]: the worst one is missed by at most half of it both ways, 0.2 % of the
acceleration."""


@dataclass(frozen=True, eq=False)
class HoldPlan(ByValue):
    """The grip force that a part needs while a gripper accelerates it, by direction; `plan_hold` makes it."""

    patch: ContactPatch
    """Contact patch of each finger."""
    mu: float
    """Friction coefficient [-]."""
    acceleration: float
    """Magnitude of the acceleration [m/s^2]."""
    angles: np.ndarray
    """Direction of the acceleration in the plane of the pads `[n]` [rad]: 0 along x, pi/2 along y."""
    elevations: np.ndarray
    """Angle of the acceleration out of the plane of the pads `[n]` [rad], pi/2 along the grip axis."""
    loads: np.ndarray
    """Load `(fx, fy, tau)` on one pad about the origin of the patch `[n, 3]` [N, N, N m]."""
    forces: np.ndarray
    """Normal force of each finger that holds the part `[n]` [N], without margin."""
    at_rest: float
    """Normal force of each finger that holds the part without acceleration [N], without margin."""
    margin: float
    """Share that is added to the force [-]."""
    grip: float | None
    """Normal force of each finger of the gripper [N], if it is given."""

    @property
    def worst(self) -> int:
        """Index of the direction that needs the largest force."""
        return int(self.forces.argmax())

    @property
    def needed(self) -> float:
        """Normal force of each finger that holds the part in all directions, with margin [N]."""
        return (1.0 + self.margin) * float(self.forces.max())

    @property
    def safety_factor(self) -> float | None:
        """Given grip over the needed force without margin [-]; None without a grip, infinite without a load."""
        if self.grip is None:
            return None
        most = float(self.forces.max())
        return self.grip / most if most > 0.0 else math.inf

    @property
    def worst_direction(self) -> str:
        """Worst direction of the acceleration in words, in the frame of the patch."""
        if self.acceleration == 0.0:
            return "at rest"
        angle = round(math.degrees(self.angles[self.worst]))
        elevation = round(math.degrees(self.elevations[self.worst]))
        name = {0: "along +x", 90: "along +y", 180: "along -x", 270: "along -y"}
        words = name.get(angle, f"at {angle}° from +x towards +y")
        if elevation == 90:
            return "along the grip axis"
        if elevation:
            words += f", {elevation}° towards a finger"
        return words

    def plot(self, *, size: Any = None) -> Any:
        """Draw the loads inside the limit surface, and the force by direction; returns a matplotlib Figure.

        `size` is the width and the height of the figure [inch]. Raises InvalidValueError for a wrong size.
        """
        return picture("hold", self, size=size)


def plan_hold(
    patch: ContactPatch,
    mu: float,
    *,
    mass: float,
    centre_of_mass: Sequence[float] = (0.0, 0.0),
    acceleration: float = 0.0,
    gravity: Sequence[float] = (0.0, -GRAVITY),
    fingers: int = 2,
    grip: float | None = None,
    margin: float = 0.0,
) -> HoldPlan:
    """Return the grip force that holds a part while a gripper accelerates it in any direction.

    The part presses on each of `fingers` equal pads with the load `(f, r x f)`, `f = m (g - a)/fingers`, where the
    acceleration `a` has the magnitude `acceleration` [m/s^2] and any direction in space, 5 degrees apart. Its component
    along the grip axis unloads one finger, so that each finger has `m |a_n|/fingers` less to press with. The rest is
    the `holding_load` of the load. A part that rotates, and the moment that tilts the part between the pads, are not
    included.

    Parameters
    ----------
    patch
        Contact patch of each finger, in a frame with x and y in the plane of the pads.
    mu
        Friction coefficient [-]: mu_c if the grip must stop a slip or is shaken.
    mass
        Mass of the part [kg].
    centre_of_mass
        Centre of mass `(x, y)` in the frame of the patch [m].
    acceleration
        Largest acceleration of the gripper [m/s^2].
    gravity
        Gravity `(x, y)` in the frame of the patch [m/s^2].
    fingers
        Number of pads that share the load.
    grip
        Normal force of each finger [N], for the `safety_factor`.
    margin
        Share that is added to the force that is needed [-].

    Raises InvalidValueError for a parameter that breaks its rule, and for a patch that cannot hold the part.
    """
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    mu = validation.positive("mu", mu)
    mass = validation.positive("mass", mass)
    centre = validation.array("centre_of_mass", centre_of_mass, (2,))
    most = validation.non_negative("acceleration", acceleration)
    down = validation.array("gravity", gravity, (2,))
    fingers = validation.count("fingers", fingers)
    margin = validation.non_negative("margin", margin)
    if grip is not None:
        grip = validation.positive("grip", grip)
    turns = np.radians(np.arange(0, 360, STEP))
    rises = np.radians(np.arange(0, 91, STEP))
    angles, elevations = (each.ravel() for each in np.meshgrid(turns, rises))
    unit = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    in_plane = most * np.cos(elevations)[:, None] * unit
    loads = _loads(mass / fingers * (down - in_plane), centre)
    lost = mass / fingers * most * np.sin(elevations)
    force = smallest_force(loads, patch, mu, lost)
    surface = surface_at(patch, force if patch.depends_on_load else None)
    resting = _loads(mass / fingers * down[None], centre)
    return HoldPlan(
        patch=patch,
        mu=mu,
        acceleration=most,
        angles=angles,
        elevations=elevations,
        loads=loads,
        forces=forces_needed(loads, surface, mu) + lost,
        at_rest=smallest_force(resting, patch, mu),
        margin=margin,
        grip=grip,
    )


def _loads(forces: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return the loads `[n, 3]` of forces `[n, 2]` that act at the centre of mass."""
    torque = centre[0] * forces[:, 1] - centre[1] * forces[:, 0]
    return np.column_stack([forces, torque])
