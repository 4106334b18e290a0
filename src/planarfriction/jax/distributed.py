"""The distributed model as a pytree: one two-dimensional bristle in every cell."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping

import jax
import jax.numpy as jnp

from planarfriction.derivatives.parameters import Packed, pack_cells
from planarfriction.equality import by_parts
from planarfriction.formulas import LawNumbers
from planarfriction.jax.base import FrictionPytree, record_of
from planarfriction.laws import FrictionLaw
from planarfriction.patch import ContactPatch
from planarfriction.tensors import distributed
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
