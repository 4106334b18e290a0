"""The published reduced model as a pytree: three bristles and a limit surface."""

from __future__ import annotations

import functools
from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp

from planarfriction.derivatives.parameters import PARAMETERS, Packed, pack_surface
from planarfriction.equality import ByValue, by_parts
from planarfriction.formulas import LawNumbers
from planarfriction.jax.base import FrictionPytree, record_of
from planarfriction.jax.namespace import xp
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.patch import ContactPatch
from planarfriction.tensors import published
from planarfriction.tensors.steps import Part


@by_parts
class PublishedParameters(namedtuple("PublishedParameters", PARAMETERS)):
    """Parameters of the published reduced model as scalars; names and units as in `LuGre` and `PublishedShape`.

    `contact_radius` r [m], `second_moment` <rho^2> [m^2], the centre of pressure `centre_x`, `centre_y` [m].
    """


@functools.partial(jax.tree_util.register_dataclass, data_fields=["data", "root"], meta_fields=["kind", "size"])
@dataclass(frozen=True, eq=False)
class Surface(ByValue):
    """The numbers of a limit surface in scaled coordinates (see `planarfriction.kernels.surfaces`)."""

    kind: int
    size: int
    data: jax.Array
    root: jax.Array | None = None
    """Symmetric root of the friction metric `[2, 2]`, if the patch has one."""


class ReducedModelPublished(FrictionPytree):
    """The published reduced model (`planarfriction.ReducedModelPublished`) as a pytree.

    `zdot = S h v_n - k z`, `W = -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`. State `(z_x, z_y, z_tau)` [m, m, m^2].
    Leaves: the parameters and the numbers of the surface, which stay as they are when `contact_radius` changes.

    `surface` None takes the published table. If the shape of the patch depends on the load, the surface must have a
    `normal_force`, and the shape at that load is kept.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    equations = published
    leaves = ("parameters", "surface")
    parameters: PublishedParameters
    surface: Surface

    def __init__(self, patch: ContactPatch, law: FrictionLaw, surface: LimitSurface | None = None) -> None:
        super().__init__(patch, law)
        shape = published.shape_of(patch, law, surface)
        kind, size, data = shape.surface.numbers
        self.parameters = record_of(PublishedParameters, published.values_of(law, shape))
        self.surface = Surface(kind, size, jnp.asarray(data), None if patch.root is None else jnp.asarray(shape.root))

    def compiled(self) -> Packed:
        """Return the model as compiled rollouts take it."""
        s = self.surface
        return pack_surface(self.elasto_plastic, s.kind, s.size, s.data, s.root)  # pyright: ignore[reportArgumentType]

    def _parts(self, law: LawNumbers, values: Mapping[str, jax.Array]) -> tuple[Part]:
        return (Part(law, published.numbers_of(xp, values, self.surface, self.surface.root)),)
