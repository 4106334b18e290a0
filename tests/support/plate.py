"""A plate that slides on a table: the reference for boxes whose centre of mass lies beside the middle of their face.

Coulomb friction on 40 x 40 cells of a rectangle, pressed by the plane that weight and friction's own lever ask for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import planarfriction as pf

GRAVITY = 9.81
_SMOOTH = 1e-5
"""Speed [m/s] below which a cell's friction falls to zero."""


class Plate(NamedTuple):
    """The box of the tests of adapters."""

    size: tuple[float, float] = (0.1, 0.06)
    mass: float = 0.3
    inertia: tuple[float, float, float] = (1e-4, 2.8e-4, 3.4e-4)
    centre_of_mass: float = 0.012
    """Along x from the middle of the face [m]."""
    height: float = 0.01
    """Height of the centre of mass above the table [m]."""
    mu: float = 0.4

    def model(self) -> pf.DistributedModel:
        """Return the friction of the face, with stiff bristles."""
        law = pf.LuGre(
            mu_c=self.mu, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9
        )
        return pf.DistributedModel(pf.ContactPatch.rectangle(*self.size, 15), law)

    def stops(self, vx: float, vy: float, omega: float, dt: float = 2e-4) -> np.ndarray:
        """Return the way of the centre of mass (x, y) [m] and the angle [rad] until it stops."""
        patch = pf.ContactPatch.rectangle(*self.size, 40)
        (x, y) = patch.positions.T
        load = self.mass * GRAVITY
        x = x - self.centre_of_mass
        pose = np.zeros(3)
        twist = np.array([vx, vy, omega])
        force = np.zeros(2)
        while np.hypot(*twist[:2]) + 0.03 * abs(twist[2]) > 2e-3:
            c = np.cos(pose[2])
            s = np.sin(pose[2])
            u = c * twist[0] + s * twist[1] - twist[2] * y
            v = c * twist[1] - s * twist[0] + twist[2] * x
            speed = np.sqrt(u**2 + v**2 + _SMOOTH**2)
            # Friction h below the centre of mass moves the pressure by -h F/(m g).
            for _ in range(2):
                at = (self.centre_of_mass, 0.0) - force * self.height / load
                pressed = (
                    -self.mu
                    * load
                    * patch.weights(load, moments=(load * at[1], -load * at[0]))
                    / speed
                )
                force = np.array([pressed @ u, pressed @ v])
            twist[:2] += (
                dt
                * np.array([c * force[0] - s * force[1], s * force[0] + c * force[1]])
                / self.mass
            )
            twist[2] += dt * (pressed @ (x * v - y * u)) / self.inertia[2]
            pose += dt * twist
        return pose
