"""The published reduced model as a pytree: three bristles and a limit surface."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from planarfriction import formulas, models
from planarfriction.jax import bristles
from planarfriction.jax import namespace as xp
from planarfriction.jax.base import FrictionModel
from planarfriction.jax.surfaces import sliding
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurface
from planarfriction.patch import ContactPatch


class PublishedParameters(NamedTuple):
    """Parameters of the published reduced model, scalars: names and units as in `LuGre` and `PublishedShape`."""

    sigma_0: jax.Array
    sigma_1: jax.Array
    sigma_2: jax.Array
    mu_c: jax.Array
    mu_s: jax.Array
    v_s: jax.Array
    gamma: jax.Array
    breakaway_ratio: jax.Array
    """Unused by plain bristles."""
    contact_radius: jax.Array
    """r [m]"""
    second_moment: jax.Array
    """<rho^2> [m^2]"""
    centre_x: jax.Array
    """Centre of pressure [m]."""
    centre_y: jax.Array


@functools.partial(jax.tree_util.register_dataclass, data_fields=["data"], meta_fields=["kind", "size"])
@dataclass(frozen=True)
class Surface:
    """The numbers of a limit surface over scaled twists (see `planarfriction.kernels.surfaces`)."""

    kind: int
    size: int
    data: jax.Array


class ReducedModelPublished(FrictionModel):
    """The published reduced model (`planarfriction.ReducedModelPublished`) as a pytree.

    `zdot = S h v_n - k z`, `W = -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`. State `(z_x, z_y, z_tau)` [m, m, m^2].
    Leaves: the parameters and the numbers of the surface, which stay as they are when `contact_radius` changes.

    `surface` None takes the published table. A patch whose shape depends on the load needs a surface with its
    `normal_force`, and keeps that shape.
    """

    leaves = ("parameters", "surface")
    parameters: PublishedParameters
    surface: Surface

    def __init__(self, patch: ContactPatch, law: LuGre, surface: LimitSurface | None = None) -> None:
        super().__init__(patch, law)
        when = "keep" if surface is not None else "rebuild"
        shape = models.ReducedModelPublished(patch, law, surface, on_load_change=when)._reference  # pyright: ignore
        kind, size, data = shape.surface.numbers
        centre_x, centre_y = shape.centre_of_pressure
        values = {
            **law.numbers._asdict(),
            "contact_radius": shape.contact_radius,
            "second_moment": shape.second_moment,
            "centre_x": centre_x,
            "centre_y": centre_y,
        }
        names = PublishedParameters._fields
        self.parameters = PublishedParameters(*(jnp.asarray(values[name], dtype=float) for name in names))
        self.surface = Surface(kind, size, jnp.asarray(data))

    def rest(self) -> jax.Array:
        """State of a contact at rest, `[3]`."""
        return jnp.zeros(3, self.parameters.sigma_0.dtype)

    def rate(self, z, twist, load) -> jax.Array:
        """Bristle rates `[..., 3]` [m/s, m/s, m^2/s]; they do not depend on the load."""
        drive, scale, _ = self._drive(twist)
        z = z / scale
        k = bristles.decay(self._law, z, drive, -1)
        return scale * (drive.u - k[..., None] * z)

    def wrench(self, z, twist, load) -> jax.Array:
        """Friction wrench on the moving body about the contact frame's origin, `[..., 3]` [N, N, N m]."""
        drive, scale, centred = self._drive(twist)
        k = bristles.decay(self._law, z / scale, drive, -1)
        return jnp.asarray(load)[..., None] * self._unit_wrench(z, scale * drive.u - k[..., None] * z, centred)

    def step(self, z, twist, load, dt) -> tuple[jax.Array, jax.Array]:
        """State and wrench after `dt` [s] at a held twist; a contact without load forgets its state."""
        drive, scale, centred = self._drive(twist)
        load, dt = jnp.asarray(load), jnp.asarray(dt)
        z, k = bristles.advance(self._law, z / scale, drive, dt, -1)
        wrench = self._unit_wrench(scale * z, scale * (drive.u - k[..., None] * z), centred)
        loaded = load[..., None] > 0.0
        return jnp.where(loaded, scale * z, 0.0), load[..., None] * wrench

    # ------------------------------------------------------------------ inside

    @property
    def _law(self):
        return bristles.law_of(self.parameters, self.elasto_plastic)

    def _drive(self, twist):
        """Drive, diagonal of S, and the twist at the centre of pressure."""
        p = self.parameters
        vx, vy, omega = twist[..., 0], twist[..., 1], twist[..., 2]
        centred = jnp.stack([vx - omega * p.centre_y, vy + omega * p.centre_x, omega], axis=-1)
        one = jnp.ones_like(p.contact_radius)
        scale = jnp.stack([one, one, p.contact_radius])
        scaled = scale * centred
        speed = xp.norm(scaled, -1)
        u = sliding(self.surface.kind, self.surface.size, self.surface.data, scaled)
        moving = speed > 0.0
        h_norm = jnp.where(moving, xp.norm(u, -1) / jnp.where(moving, speed, 1.0), 1.0)
        return bristles.Drive(u, speed, h_norm, bristles.grip(self._law, speed)), scale, centred

    def _unit_wrench(self, z, rate, centred):
        """Wrench per unit load about the origin."""
        p = self.parameters
        one = jnp.ones_like(p.second_moment)
        velocity = centred * jnp.stack([one, one, p.second_moment])
        fx, fy, tau = jnp.moveaxis(formulas.traction(z, rate, velocity, self._law), -1, 0)
        return jnp.stack([fx, fy, tau + p.centre_x * fy - p.centre_y * fx], axis=-1)
