"""The distributed model as a pytree: one two-dimensional bristle in every cell."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from planarfriction.equality import by_parts
from planarfriction.jax.base import FrictionModel
from planarfriction.laws import FrictionLaw
from planarfriction.models import distributed_arrays
from planarfriction.models.distributed_arrays import Cells
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_anisotropy


@by_parts
class LawParameters(NamedTuple):
    """Parameters of a friction law as scalars; names and units as in `LuGre`."""

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

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    arrays = distributed_arrays
    axes = 2
    leaves = ("parameters", "positions", "weights")
    parameters: LawParameters
    positions: jax.Array
    """Cells, x then y [m], `[2, N]`."""
    weights: jax.Array
    """Share of the load that each cell carries [-], `[N]`."""

    def __init__(self, patch: ContactPatch, law: FrictionLaw, normal_force: float | None = None) -> None:
        super().__init__(patch, law)
        refuse_anisotropy(patch, f"jax.{type(self).__name__} (ReducedModel takes any)")
        numbers, names = law.numbers, LawParameters._fields
        self.parameters = LawParameters(*(jnp.asarray(getattr(numbers, name), dtype=float) for name in names))
        self.positions = jnp.asarray(patch.positions.T)
        self.weights = jnp.asarray(patch.weights(normal_force))

    def rest(self) -> jax.Array:
        """State of a contact at rest, `[2, N]`."""
        return jnp.zeros_like(self.positions)

    def _parts(self) -> list[tuple[float, Cells]]:
        return [(1.0, Cells(self.positions, self.weights))]
