"""The reduced model of bristle moments as a pytree."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from planarfriction import models
from planarfriction.equality import ByValue, by_parts
from planarfriction.jax.base import FrictionModel
from planarfriction.laws import FrictionLaw
from planarfriction.models import reduced_arrays
from planarfriction.models.reduced_arrays import MapSizes, ReducedNumbers
from planarfriction.patch import ContactPatch


@by_parts
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


@functools.partial(jax.tree_util.register_dataclass, data_fields=["factor", "map"], meta_fields=["sizes"])
@dataclass(frozen=True, eq=False)
class Shape(ByValue):
    """What the model knows of its patch."""

    sizes: MapSizes
    factor: jax.Array
    """F `[3, 3]`."""
    map: jax.Array
    """Steady sliding, flat (see `planarfriction.kernels.steady`)."""


class ReducedModel(FrictionModel):
    """The reduced model of bristle moments (`planarfriction.ReducedModel`) as a pytree.

    State `(z_x, z_y, z_theta)` [m]. Leaves: the law's parameters, and the shape: F of the patch and its map of steady
    sliding. A patch whose shape depends on the load keeps that of `normal_force` [N]; `segments` and `speeds` as in
    `planarfriction.ReducedModel`.
    """

    arrays = reduced_arrays
    leaves = ("parameters", "shape")
    parameters: ReducedParameters
    shape: Shape

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        segments: int = 24,
        speeds: int = 14,
    ) -> None:
        super().__init__(patch, law)
        numbers, names = law.numbers, ReducedParameters._fields
        self.parameters = ReducedParameters(*(jnp.asarray(getattr(numbers, name), dtype=float) for name in names))
        shape = models.ReducedModel(patch, law, segments=segments, speeds=speeds, load_error=0.0).shape_at(normal_force)
        sizes = reduced_arrays.sizes_of(shape.data)
        self.shape = Shape(sizes, jnp.asarray(shape.factor), jnp.asarray(shape.data))

    def rest(self) -> jax.Array:
        """State of a contact at rest, `[3]`."""
        return jnp.zeros(3, self.parameters.sigma_0.dtype)

    def _shape(self) -> ReducedNumbers:
        return reduced_arrays.numbers_of(self.shape.factor, self.shape.map, self.shape.sizes)
