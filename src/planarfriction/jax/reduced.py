"""The reduced model of bristle moments as a pytree."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import jax
import jax.numpy as jnp

from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.jax import namespace as xp
from planarfriction.models import ReducedModel, reduced_arrays
from planarfriction.models.reduced_arrays import ReducedNumbers
from planarfriction.patch.metric import refuse_anisotropy


class MomentParameters(NamedTuple):
    """Parameters of the law, scalars: names and units as in `LuGre`; not gamma, for which the map is made."""

    sigma_0: jax.Array
    sigma_1: jax.Array
    sigma_2: jax.Array
    mu_c: jax.Array
    mu_s: jax.Array
    v_s: jax.Array
    breakaway_ratio: jax.Array
    """Unused by plain bristles."""


@functools.partial(
    jax.tree_util.register_dataclass, data_fields=["parameters", "shape"], meta_fields=["elasto_plastic"]
)
@dataclass(frozen=True)
class MomentPlanarLuGre:
    """Reduced LuGre friction of bristle moments (`planarfriction.ReducedModel`) as a pytree.

    State `(z_x, z_y, z_theta)` [m]. Leaves: the law's parameters, and the numbers of the patch with its map of steady
    sliding. Leading axes of state `[..., 3]`, twist `[..., 3]`, load `[...]` and dt broadcast.
    """

    parameters: MomentParameters
    shape: ReducedNumbers
    elasto_plastic: bool = field(default=False)

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


def moments(model: ReducedModel, normal_force: float | None = None) -> MomentPlanarLuGre:
    """A `ReducedModel` as a pytree, in the default precision of JAX.

    One whose shape depends on the load keeps that of `normal_force` [N].
    """
    if not isinstance(model, ReducedModel):
        raise InvalidValueError("model", "be a ReducedModel", type(model).__name__)
    refuse_anisotropy(model.patch, "jax.reduced")
    law = model.law.numbers
    parameters = MomentParameters(*(jnp.asarray(getattr(law, n), dtype=float) for n in MomentParameters._fields))
    shape = reduced_arrays.numbers_of(model.shape_at(normal_force))
    return MomentPlanarLuGre(parameters, ReducedNumbers(*map(jnp.asarray, shape)), law.elasto_plastic > 0.0)
