"""The distributed model as a pytree: one two-dimensional bristle in every cell."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from planarfriction import formulas
from planarfriction.jax import bristles
from planarfriction.jax import namespace as xp
from planarfriction.jax.base import FrictionModel
from planarfriction.laws import LuGre
from planarfriction.patch import ContactPatch


class LawParameters(NamedTuple):
    """Parameters of a friction law, scalars: names and units as in `LuGre`."""

    sigma_0: jax.Array
    sigma_1: jax.Array
    sigma_2: jax.Array
    mu_c: jax.Array
    mu_s: jax.Array
    v_s: jax.Array
    gamma: jax.Array
    breakaway_ratio: jax.Array


class DistributedModel(FrictionModel):
    """The distributed model (`planarfriction.DistributedModel`) as a pytree, for small patches.

    `W = sum w_i f_N [t_i ; rho_i x t_i]`. State: deflections `[2, N]` [m]. Leaves: the law's parameters, the cells'
    positions and weights. A patch whose shape depends on the load keeps that of `normal_force` [N].
    """

    leaves = ("parameters", "positions", "weights")
    parameters: LawParameters
    positions: jax.Array
    """Cells, x then y [m], `[2, N]`."""
    weights: jax.Array
    """Share of the load that each cell carries [-], `[N]`."""

    def __init__(self, patch: ContactPatch, law: LuGre, normal_force: float | None = None) -> None:
        super().__init__(patch, law)
        numbers, names = law.numbers, LawParameters._fields
        self.parameters = LawParameters(*(jnp.asarray(getattr(numbers, name), dtype=float) for name in names))
        self.positions = jnp.asarray(patch.positions.T)
        self.weights = jnp.asarray(patch.weights(normal_force))

    def rest(self) -> jax.Array:
        """State of a contact at rest, `[2, N]`."""
        return jnp.zeros_like(self.positions)

    def rate(self, z, twist, load) -> jax.Array:
        """Bristle rates `[..., 2, N]` [m/s]; they do not depend on the load."""
        drive = self._drive(twist)
        return drive.u - bristles.decay(self._law, z, drive, -2)[..., None, :] * z

    def wrench(self, z, twist, load) -> jax.Array:
        """Friction wrench on the moving body about the contact frame's origin, `[..., 3]` [N, N, N m]."""
        velocity = self._velocity(twist)
        return jnp.asarray(load)[..., None] * self._unit_wrench(z, self.rate(z, twist, load), velocity)

    def step(self, z, twist, load, dt) -> tuple[jax.Array, jax.Array]:
        """State and wrench after `dt` [s] at a held twist; a contact without load forgets its state."""
        drive = self._drive(twist)
        load, dt = jnp.asarray(load), jnp.asarray(dt)
        z, k = bristles.advance(self._law, z, drive, dt[..., None], -2)
        wrench = self._unit_wrench(z, drive.u - k[..., None, :] * z, drive.u)
        return jnp.where(load[..., None, None] > 0.0, z, 0.0), load[..., None] * wrench

    # ------------------------------------------------------------------ inside

    def _velocity(self, twist):
        """Velocities of the cells `[..., 2, N]`."""
        vx, vy, omega = (twist[..., i, None] for i in range(3))
        return jnp.stack([vx - omega * self.positions[1], vy + omega * self.positions[0]], axis=-2)

    @property
    def _law(self):
        return bristles.law_of(self.parameters, self.elasto_plastic)

    def _drive(self, twist) -> bristles.Drive:
        u = self._velocity(twist)
        speed = xp.norm(u, -2)
        return bristles.Drive(u, speed, 1.0, bristles.grip(self._law, speed))

    def _unit_wrench(self, z, rate, velocity):
        """Wrench per unit load."""
        x, y = self.positions
        force = self.weights * formulas.traction(z, rate, velocity, self._law)
        fx, fy = force[..., 0, :], force[..., 1, :]
        return jnp.stack([fx.sum(-1), fy.sum(-1), (x * fy - y * fx).sum(-1)], axis=-1)
