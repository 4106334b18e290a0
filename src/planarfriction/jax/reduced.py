"""The reduced model of bristle moments as a pytree."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from planarfriction import models
from planarfriction.derivatives.parameters import Packed, pack_maps
from planarfriction.equality import ByValue, by_parts
from planarfriction.jax.base import FrictionModel
from planarfriction.laws import FrictionLaw
from planarfriction.models import reduced_arrays
from planarfriction.models.reduced_arrays import MapSizes, ReducedNumbers
from planarfriction.patch import ContactPatch


@by_parts
class ReducedParameters(NamedTuple):
    """Parameters of the law as scalars; names and units as in `LuGre`, without gamma, on which the stored map
    depends."""

    sigma_0: jax.Array
    sigma_1: jax.Array
    sigma_2: jax.Array
    mu_c: jax.Array
    mu_s: jax.Array
    v_s: jax.Array
    breakaway_ratio: jax.Array
    """Unused by plain bristles."""


@functools.partial(jax.tree_util.register_dataclass, data_fields=["share", "factor", "map"], meta_fields=["sizes"])
@dataclass(frozen=True, eq=False)
class Shape(ByValue):
    """What the model knows of its patch."""

    sizes: tuple[MapSizes, ...]
    share: jax.Array
    """Of the load that each part carries, `[P]`."""
    factor: jax.Array
    """F of each part, `[P, 3, 3]`."""
    map: jax.Array
    """Steady sliding of the parts, one behind the other (see `planarfriction.kernels.steady`)."""


class ReducedModel(FrictionModel):
    """The reduced model of bristle moments (`planarfriction.ReducedModel`) as a pytree.

    State `(z_x, z_y, z_theta)` [m], or `[P, 3]` for several parts. Leaves: the law's parameters, and the shape: F of
    the parts and their maps of steady sliding. If the shape of the patch depends on the load, the shape at
    `normal_force` [N] is kept; `parts`, `segments` and `speeds` as in `planarfriction.ReducedModel`.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    arrays = reduced_arrays
    axes = 1
    leaves = ("parameters", "shape")
    parameters: ReducedParameters
    shape: Shape

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        parts: int | str = 1,
        segments: int = 24,
        speeds: int = 16,
    ) -> None:
        super().__init__(patch, law)
        numbers, names = law.numbers, ReducedParameters._fields
        self.parameters = ReducedParameters(*(jnp.asarray(getattr(numbers, name), dtype=float) for name in names))
        model = models.ReducedModel(patch, law, parts=parts, segments=segments, speeds=speeds, load_error=0.0)
        shares, shapes = zip(*model.parts_at(normal_force), strict=True)
        self.shape = Shape(
            tuple(reduced_arrays.sizes_of(shape.data) for shape in shapes),
            jnp.asarray(shares, dtype=float),
            jnp.asarray(np.stack([shape.factor for shape in shapes])),
            jnp.asarray(np.concatenate([shape.data for shape in shapes])),
        )

    def rest(self) -> jax.Array:
        """State of a contact at rest, `[3]` or `[P, 3]`."""
        count = len(self.shape.sizes)
        return jnp.zeros(3 if count == 1 else (count, 3), self.parameters.sigma_0.dtype)

    def compiled(self) -> tuple[Packed, ...]:
        """See `FrictionModel`."""
        s = self.shape
        return pack_maps(self.elasto_plastic, s.sizes, s.share, s.factor, s.map)  # pyright: ignore[reportArgumentType]

    def _parts(self) -> list[tuple[jax.Array, ReducedNumbers]]:
        s = self.shape
        shapes = reduced_arrays.parts_of(s.factor, s.map, s.sizes)
        return [(s.share[k], shape) for k, shape in enumerate(shapes)]
