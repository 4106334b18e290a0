"""The published reduced model as a pytree: three bristles and a limit surface."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from planarfriction import models
from planarfriction.derivatives.parameters import Packed, pack_surface
from planarfriction.equality import ByValue, by_parts
from planarfriction.jax import namespace as xp
from planarfriction.jax.base import FrictionModel
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface, surface_arrays
from planarfriction.models import published_arrays
from planarfriction.models.published_arrays import PublishedNumbers
from planarfriction.patch import ContactPatch


@by_parts
class PublishedParameters(NamedTuple):
    """Parameters of the published reduced model as scalars; names and units as in `LuGre` and `PublishedShape`."""

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
    """Contact radius r [m]."""
    second_moment: jax.Array
    """Second moment <rho^2> [m^2]."""
    centre_x: jax.Array
    """Centre of pressure [m]."""
    centre_y: jax.Array


@functools.partial(jax.tree_util.register_dataclass, data_fields=["data", "root"], meta_fields=["kind", "size"])
@dataclass(frozen=True, eq=False)
class Surface(ByValue):
    """The numbers of a limit surface in scaled coordinates (see `planarfriction.kernels.surfaces`)."""

    kind: int
    size: int
    data: jax.Array
    root: jax.Array | None = None
    """Symmetric root of the friction metric `[2, 2]`, if the patch has one."""


class ReducedModelPublished(FrictionModel):
    """The published reduced model (`planarfriction.ReducedModelPublished`) as a pytree.

    `zdot = S h v_n - k z`, `W = -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`. State `(z_x, z_y, z_tau)` [m, m, m^2].
    Leaves: the parameters and the numbers of the surface, which stay as they are when `contact_radius` changes.

    `surface` None takes the published table. If the shape of the patch depends on the load, the surface must have a
    `normal_force`, and the shape at that load is kept.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    arrays = published_arrays
    axes = 1
    leaves = ("parameters", "surface")
    parameters: PublishedParameters
    surface: Surface

    def __init__(self, patch: ContactPatch, law: FrictionLaw, surface: LimitSurface | None = None) -> None:
        super().__init__(patch, law)
        when = "keep" if surface is not None else "rebuild"
        shape = models.ReducedModelPublished(patch, law, surface, on_load_change=when).shapes.reference  # pyright: ignore
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
        self.surface = Surface(kind, size, jnp.asarray(data), None if patch.root is None else jnp.asarray(shape.root))

    def rest(self) -> jax.Array:
        """State of a contact at rest, `[3]`."""
        return jnp.zeros(3, self.parameters.sigma_0.dtype)

    def compiled(self) -> tuple[Packed]:
        """See `FrictionModel`."""
        s = self.surface
        return pack_surface(self.elasto_plastic, s.kind, s.size, s.data, s.root)  # pyright: ignore[reportArgumentType]

    def _parts(self) -> list[tuple[float, PublishedNumbers]]:
        p, s = self.parameters, self.surface
        radius, second_moment, x, y = (value[..., None] for value in p[-4:])
        surface = functools.partial(surface_arrays.sliding, xp, s.kind, s.size, s.data)
        return [(1.0, PublishedNumbers(radius, second_moment, x, y, surface, s.root))]
