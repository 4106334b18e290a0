"""The friction models as pytrees."""

from __future__ import annotations

import functools
from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import jax
import jax.numpy as jnp

from planarfriction.derivatives.parameters import PARAMETERS, Packed, pack_cells, pack_maps, pack_surface
from planarfriction.equality import ByValue, by_parts
from planarfriction.formulas import LawNumbers
from planarfriction.jax.base import FrictionPytree, record_of
from planarfriction.jax.namespace import xp
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.models import ReducedModel as Reference
from planarfriction.models.reduced_map import MapSizes
from planarfriction.patch import ContactPatch
from planarfriction.tensors import distributed, published, reduced
from planarfriction.tensors.steps import LAW, Part


@by_parts
class LawParameters(namedtuple("LawParameters", LAW)):
    """Parameters of a friction law as scalars; names and units as in `LuGre`."""


class DistributedModel(FrictionPytree):
    """The distributed model (`planarfriction.DistributedModel`) as a pytree, for small patches.

    `W = sum w_i f_N [t_i ; rho_i x t_i]`. State: deflections `[2, N]` [m]. Leaves: the law's parameters, the cells'
    positions and weights. A patch whose shape depends on the load keeps that of `normal_force` [N].

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    equations = distributed
    leaves = ("parameters", "positions", "weights")
    parameters: LawParameters
    positions: jax.Array
    """Cells, x then y [m], `[2, N]`; with a friction metric their levers (see `tensors.distributed.Cells`)."""
    weights: jax.Array
    """Share of the load that each cell carries [-], `[N]`."""

    def __init__(self, patch: ContactPatch, law: FrictionLaw, normal_force: float | None = None) -> None:
        super().__init__(patch, law)
        cells = distributed.cells_of(patch, normal_force, "jax")
        self.parameters = record_of(LawParameters, law.numbers._asdict())
        self.positions, self.weights = map(jnp.asarray, cells)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact, `(2, N)`."""
        return 2, self.positions.shape[1]

    def compiled(self) -> Packed:
        """Return the model as compiled rollouts take it."""
        return pack_cells(self.elasto_plastic, self.positions, self.weights)  # pyright: ignore[reportArgumentType]

    def _parts(self, law: LawNumbers, values: Mapping[str, jax.Array]) -> tuple[Part]:
        return (Part(law, distributed.Cells(self.positions, self.weights)),)


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


class ReducedModel(FrictionPytree):
    """The reduced model (`planarfriction.ReducedModel`) as a pytree, with its settings.

    What is made is a `FewCells`, bristles on a few cells with the state `[2, n]` [m], or, with `parts`, a `MomentModel`
    with `[3]` or `[P, 3]` [m]. If the shape of the patch depends on the load, that at `normal_force` [N] is kept.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    if TYPE_CHECKING:

        def __init__(
            self,
            patch: ContactPatch,
            law: FrictionLaw,
            normal_force: float | None = None,
            *,
            cells: int = 56,
            parts: int | str | None = None,
            segments: int = 24,
            speeds: int = 16,
        ) -> None: ...

    def __new__(
        cls, patch: Any = None, law: Any = None, normal_force: Any = None, *, parts: Any = None, **settings: Any
    ) -> Self:
        """Return a model of the member that the settings ask for."""
        if cls is not ReducedModel:
            return super().__new__(cls)

        return super().__new__(FewCells if parts is None else MomentModel)  # pyright: ignore


class FewCells(DistributedModel, ReducedModel):
    """Distributed friction on the few cells of `planarfriction.ReducedModel`, which `ReducedModel` makes by default.

    Raises InvalidValueError as that does.
    """

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        cells: int = Reference.cells,
        segments: int = Reference.segments,
        speeds: int = Reference.speeds,
        parts: None = None,
    ) -> None:
        self.refuse(patch, law, "jax.ReducedModel")
        few = Reference(patch, law, cells=cells, segments=segments, speeds=speeds).reduction.patch
        super().__init__(few, law, normal_force)


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
