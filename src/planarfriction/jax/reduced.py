"""The reduced model of bristle moments as a pytree."""

from __future__ import annotations

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp

from planarfriction import models
from planarfriction.formulas import LawNumbers
from planarfriction.jax import namespace as xp
from planarfriction.jax.base import FrictionModel
from planarfriction.laws import LuGre
from planarfriction.models import reduced_arrays
from planarfriction.models.reduced_arrays import ReducedNumbers
from planarfriction.patch import ContactPatch


class ReducedParameters(NamedTuple):
    """Parameters of the law, scalars: names and units as in `LuGre`; not gamma, for which the map is made."""

    sigma_0: jax.Array
    sigma_1: jax.Array
    sigma_2: jax.Array
    mu_c: jax.Array
    mu_s: jax.Array
    v_s: jax.Array
    breakaway_ratio: jax.Array
    """Unused by plain bristles."""


class ReducedModel(FrictionModel):
    """The reduced model of bristle moments (`planarfriction.ReducedModel`) as a pytree.

    State `(z_x, z_y, z_theta)` [m]. Leaves: the law's parameters, and the numbers of the patch with its map of steady
    sliding. A patch whose shape depends on the load keeps that of `normal_force` [N]; `segments` and `speeds` as in
    `planarfriction.ReducedModel`.
    """

    leaves = ("parameters", "shape")
    parameters: ReducedParameters
    shape: ReducedNumbers

    def __init__(
        self,
        patch: ContactPatch,
        law: LuGre,
        normal_force: float | None = None,
        *,
        segments: int = 24,
        speeds: int = 14,
    ) -> None:
        super().__init__(patch, law)
        numbers, names = law.numbers, ReducedParameters._fields
        self.parameters = ReducedParameters(*(jnp.asarray(getattr(numbers, name), dtype=float) for name in names))
        shape = models.ReducedModel(patch, law, segments=segments, speeds=speeds).shape_at(normal_force)
        self.shape = ReducedNumbers(*map(jnp.asarray, reduced_arrays.numbers_of(shape)))

    def rest(self) -> jax.Array:
        """State of a contact at rest, `[3]`."""
        return jnp.zeros(3, self.parameters.sigma_0.dtype)

    def rate(self, z, twist, load) -> jax.Array:
        """Rates of the moments `[..., 3]` [m/s]; they do not depend on the load."""
        return reduced_arrays.rate(xp, self._law, z, self._held(twist))

    def wrench(self, z, twist, load) -> jax.Array:
        """Friction wrench on the moving body about the contact frame's origin, `[..., 3]` [N, N, N m]."""
        by = self._held(twist)
        rate = reduced_arrays.rate(xp, self._law, z, by)
        return jnp.asarray(load)[..., None] * reduced_arrays.wrench(xp, self._law, self.shape, z, rate, by.u)

    def step(self, z, twist, load, dt) -> tuple[jax.Array, jax.Array]:
        """State and wrench after `dt` [s] at a held twist; a contact without load forgets its state."""
        by = self._held(twist)
        load, dt = jnp.asarray(load)[..., None], jnp.asarray(dt)[..., None]
        new, rate = reduced_arrays.advance(xp, self._law, z, by, dt, float(jnp.finfo(by.u.dtype).eps))
        wrench = reduced_arrays.wrench(xp, self._law, self.shape, new, rate, by.u)
        return jnp.where(load > 0.0, new, 0.0), load * wrench

    @property
    def _law(self) -> LawNumbers:
        elastic = float(self.elasto_plastic)
        return LawNumbers(**self.parameters._asdict(), gamma=math.nan, elasto_plastic=elastic)

    def _held(self, twist) -> reduced_arrays.Held:
        return reduced_arrays.held(xp, self._law, self.shape, twist)
