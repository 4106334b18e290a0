"""The friction models as pytrees."""

from __future__ import annotations

import functools
from collections import namedtuple
from dataclasses import dataclass

import jax
import jax.numpy as jnp

from planarfriction._support.equality import ByValue, by_parts
from planarfriction.derivatives.parameters import (
    PARAMETERS,
    PackedRollout,
    pack_cells,
    pack_surface,
)
from planarfriction.jax.base import FrictionPytree, record_of
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.models import ReducedModel as Reference
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch
from planarfriction.tensors import distributed, published
from planarfriction.tensors.models import CellsModel, PublishedModel, reference_of
from planarfriction.tensors.steps import LAW


@by_parts
class LawParameters(namedtuple("LawParameters", LAW)):
    """Parameters of a friction law as scalars; names and units as in `LuGre`."""


class DistributedModel(FrictionPytree, CellsModel):
    """The distributed model (`planarfriction.DistributedModel`) as a pytree, for small patches.

    `W = sum w_i f_N [t_i ; rho_i x t_i]`. State: deflections `[2, N]` [m]. Leaves: the law's parameters, the cells'
    positions, the digits of these that single precision leaves out, the stiffness of a `pad` and its common compliance,
    behind which `sigma_1` counts as 0, and weights. A patch whose shape depends on the load keeps that of
    `normal_force` [N]; the stiffness of `Pad.at_load` follows the weights.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    leaves = ("parameters", "positions", "remainder", "stiffness", "compliance", "weights")  # fmt: skip
    fixed = ("elasto_plastic", "kind", "of_law", "lag")
    parameters: LawParameters

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        pad: Pad | None = None,
    ) -> None:
        super().__init__(patch, law)
        model = reference_of(f"jax.{type(self).__name__}", patch, law, pad)
        cells = distributed.cells_of(model, normal_force, jnp.result_type(float))
        self.parameters = record_of(LawParameters, law.numbers._asdict())
        self.positions, self.weights, self.remainder = map(jnp.asarray, cells[:3])
        self.stiffness, self.compliance = (
            None if each is None else jnp.asarray(each)
            for each in (cells.stiff, cells.compliance)
        )
        self.lag = 0.0 if pad is None else pad.lag
        self.kind = cells.kind
        self.of_law = pad is None or pad.springs_of_law

    def compiled(self) -> PackedRollout:
        """Return the model as compiled rollouts take it.

        Raises InvalidValueError as `pack_cells` does.
        """
        kind = self.kind, self.elasto_plastic, self.of_law
        return pack_cells(*kind, self.weights, self.positions, self.stiffness)  # pyright: ignore


@by_parts
class PublishedParameters(namedtuple("PublishedParameters", PARAMETERS)):
    """Parameters of the published reduced model as scalars; names and units as in `LuGre` and `PublishedShape`.

    `contact_radius` r [m], `second_moment` <rho^2> [m^2], the centre of pressure `centre_x`, `centre_y` [m].
    """


@functools.partial(
    jax.tree_util.register_dataclass,
    data_fields=["data", "root"],
    meta_fields=["kind", "size"],
)
@dataclass(frozen=True, eq=False)
class Surface(ByValue):
    """The numbers of a limit surface in scaled coordinates (see `planarfriction._engine.published.surfaces`)."""

    kind: int
    size: int
    data: jax.Array
    root: jax.Array | None = None
    """Symmetric root of the friction metric `[2, 2]`, if the patch has one."""


class ReducedModelPublished(FrictionPytree, PublishedModel):
    """The published reduced model (`planarfriction.ReducedModelPublished`) as a pytree.

    `zdot = S h v_n - k z`, `W = -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`. State `(z_x, z_y, z_tau)` [m, m, m^2].
    Leaves: the parameters and the numbers of the surface, which stay as they are when `contact_radius` changes.

    `surface` None takes the published table. If the shape of the patch depends on the load, the surface must have a
    `normal_force`, and the shape at that load is kept.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    leaves = ("parameters", "surface")
    parameters: PublishedParameters
    surface: Surface
    root = property(
        lambda self: self.surface.root,
        doc="Symmetric root of the friction metric `[2, 2]`, or None.",
    )

    def __init__(
        self, patch: ContactPatch, law: FrictionLaw, surface: LimitSurface | None = None
    ) -> None:
        super().__init__(patch, law)
        shape = published.shape_of(patch, law, surface)
        kind, size, data = shape.surface.numbers
        self.parameters = record_of(
            PublishedParameters, published.values_of(law, shape)
        )
        self.surface = Surface(
            kind,
            size,
            jnp.asarray(data),
            None if patch.root is None else jnp.asarray(shape.root),
        )

    def compiled(self) -> PackedRollout:
        """Return the model as compiled rollouts take it."""
        s = self.surface
        return pack_surface(self.elasto_plastic, s.kind, s.size, s.data, s.root)  # pyright: ignore[reportArgumentType]


class ReducedModel(DistributedModel):
    """The reduced model (`planarfriction.ReducedModel`) as a pytree: distributed friction on few discs.

    All but `cells`, their number, is as in `DistributedModel`.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        cells: int = Reference.cells,
        pad: Pad | None = None,
    ) -> None:
        few = reference_of("jax.ReducedModel", patch, law, pad, cells)
        super().__init__(few.patch, law, normal_force, pad=few.pad)
