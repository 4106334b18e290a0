"""The moments of bristles in the parts of a patch as a pytree."""

from __future__ import annotations

import functools
from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp

from planarfriction.derivatives.parameters import Packed, pack_maps
from planarfriction.equality import ByValue, by_parts
from planarfriction.formulas import LawNumbers
from planarfriction.jax.base import record_of
from planarfriction.jax.reduced import ReducedModel
from planarfriction.laws import FrictionLaw
from planarfriction.models.map_sizes import MapSizes
from planarfriction.patch import ContactPatch
from planarfriction.tensors import reduced
from planarfriction.tensors.steps import Part


@by_parts
class ReducedParameters(namedtuple("ReducedParameters", reduced.PARAMETERS)):
    """Parameters of the law as scalars, as in `LuGre`, without gamma, on which the stored map depends."""


@functools.partial(jax.tree_util.register_dataclass, data_fields=["share", "factor", "map"], meta_fields=["sizes"])
@dataclass(frozen=True, eq=False)
class Maps(ByValue):
    """The parts of a patch and their maps of steady sliding."""

    sizes: tuple[MapSizes, ...]
    share: jax.Array
    """Share of the load that each part carries, `[P]`."""
    factor: jax.Array
    """F of each part, `[P, 3, 3]`."""
    map: jax.Array
    """Steady sliding of the parts, one behind the other (see `planarfriction.kernels.steady`)."""


class MomentModel(ReducedModel):
    """The reduced model of bristle moments (`planarfriction.ReducedModel` in parts) as a pytree.

    State `(z_x, z_y, z_theta)` [m], or `[P, 3]` for several parts. Leaves: the law's parameters, and the shape: F of
    the parts and their maps of steady sliding. If the shape of the patch depends on the load, the shape at
    `normal_force` [N] is kept; `parts`, `segments` and `speeds` as in `planarfriction.ReducedModel` in parts.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    equations = reduced
    leaves = ("parameters", "shape")
    parameters: ReducedParameters
    shape: Maps

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        cells: int = 56,
        parts: int | str = 1,
        segments: int = 24,
        speeds: int = 16,
    ) -> None:
        super().__init__(patch, law)
        self.parameters = record_of(ReducedParameters, law.numbers._asdict())
        found = reduced.parts_of(patch, law, normal_force, parts=parts, segments=segments, speeds=speeds)
        share, factor = (jnp.asarray(each, dtype=float) for each in found[1:3])
        self.shape = Maps(found.sizes, share, factor, jnp.asarray(found.map))

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact, `(3,)`, of P parts `(P, 3)`."""
        return (3,) if len(self.shape.sizes) == 1 else (len(self.shape.sizes), 3)

    def compiled(self) -> Packed:
        """Return the model as compiled rollouts take it."""
        s = self.shape
        return pack_maps(self.elasto_plastic, s.sizes, s.share, s.factor, s.map)  # pyright: ignore[reportArgumentType]

    def _parts(self, law: LawNumbers, values: Mapping[str, jax.Array]) -> tuple[Part, ...]:
        return tuple(Part(law, shape, self.shape.share[k]) for k, shape in enumerate(reduced.numbers_of(self.shape)))
