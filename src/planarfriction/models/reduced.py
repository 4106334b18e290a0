"""The reduced model: a few small discs stand for the patch."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass
from typing import Any, Self

import numpy as np

from planarfriction._engine.records.base import CompiledModel
from planarfriction._support import validation
from planarfriction._support.equality import checked
from planarfriction.laws import FrictionLaw
from planarfriction.laws.base import is_rate_law, refuse_rate_law
from planarfriction.models.base import (
    FrictionModel,
    ModelJacobians,
    hung,
)
from planarfriction.models.cell_loads import Cells, in_time
from planarfriction.models.distributed import DistributedModel
from planarfriction.models.pad_discs import discs_of
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch
from planarfriction.patch.discs import clusters_of, members_of, own_discs
from planarfriction.patch.shared import mean_weights

POINTS = 2
"""Times as many points as discs stand for a patch whose law knows no discs."""

ALONE = 1e-6
"""Second moment of cells about the centre of their disc, over its square radius, below which they are one cell."""


@dataclass(frozen=True, eq=False)
class ReducedModel(FrictionModel):
    """Reduced LuGre friction: bristles on a few small discs that stand for the patch.

    Equations are those of `DistributedModel` on `patch.discs(cells)`: each disc sees the velocity of its centre and the
    spin, and has a bristle of three components. More `cells` are more accurate and slower: one resembles the paper's
    reduced model, all of them are the distributed one. The state is `[3, n]` [m], n at most `cells`. A `RateLaw`, whose
    bristles have two components, gets twice as many points at the centres of discs, and the state `[2, n]`.

    The discs of a `pad` are chosen by its stiffness, and their stiffnesses fitted once to that of all its pieces, in a
    second or a few (see `models.pad_discs`).

    Raises InvalidValueError unless `cells` is an integer >= 1, and for a pad as `DistributedModel` does.
    """

    _: KW_ONLY
    cells: int = checked(validation.count, default=24)
    """Number of discs that stand for the patch."""
    pad: Pad | None = checked(  # pyright: ignore[reportIncompatibleVariableOverride]
        validation.instance, Pad, "a Pad or None", default=None
    )
    """Pad under the patch; None: bristles whose stiffness grows with the load, as published."""

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.reduction

    @functools.cached_property
    def reduction(self) -> DistributedModel:
        """Distributed model of the discs that stand for the patch.

        Raises InvalidValueError as the class does.
        """
        if is_rate_law(self.law):
            few = self.patch.discs(POINTS * self.cells)
            return DistributedModel(dataclasses.replace(few, radii=None), self.law)
        if self.pad is None:
            return DistributedModel(self.patch.discs(self.cells), self.law)
        refuse_rate_law(self.law, "a pad")
        self.pad.check(self.patch, self.law)
        discs, pad = discs_of(self.patch, self.law, self.pad, self.cells)
        return DistributedModel(discs, self.law, pad=pad)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3, n)` for n discs."""
        return self.reduction.state_shape

    @property
    def compiled(self) -> CompiledModel:
        return self.reduction.compiled

    @functools.cached_property
    def _cells(self) -> Cells:
        patch = self.patch
        n = POINTS * self.cells if is_rate_law(self.law) else self.cells
        cells = own_discs(patch)
        shares = mean_weights(cells)
        if self.pad is None or self.pad.springs_of_law or patch.cells <= n:
            members = members_of(patch, n)
        else:
            shares = patch.weights()
            members = clusters_of(patch, self.pad.shares(patch), n)
        if members is None:
            return self.reduction._cells
        bristles = self.compiled.bristles
        stiffness = shares if self.pad is None else self.pad.pieces(patch, self.law)
        if is_rate_law(self.law):
            return Cells.of(members, bristles, stiffness)
        places = patch.lever_coordinates(*patch.positions.T)
        squares = 0.5 * cells.lever_radii**2
        levers = np.array([shares, *places, squares])
        return Cells.of(members, bristles, stiffness, levers)

    def _bearing(self, loads: Any) -> Cells:
        few = self.reduction
        shape = validation.numbers("loads", in_time(loads)[1]).shape
        if shape[-1:] == (few.patch.cells,) != (self.patch.cells,):
            return few._cells
        return self._cells

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Return the analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); one-sided at kinks.

        Raises InvalidValueError as `step` does.
        """
        return self.reduction.jacobians(state, twist, normal_force)

    def with_law(self, law: FrictionLaw) -> Self:
        if is_rate_law(law) != is_rate_law(self.law):
            return dataclasses.replace(self, law=law)
        changed = object.__new__(type(self))
        changed.__dict__.update(
            self.__dict__, law=law, reduction=self.reduction.with_law(law)
        )
        changed.__dict__.pop("_cells", None)
        return changed

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        few = self.reduction
        if self.pad is None:
            stiff = self.patch.weights(load), few.patch.weights(load)
        else:
            pieces = few.pad.pieces(few.patch, self.law)  # pyright: ignore
            stiff = self.pad.pieces(self.patch, self.law), pieces
        return hung(self, _of_discs(few.patch, self.patch, deflections, *stiff))


def _of_discs(
    few: ContactPatch,
    patch: ContactPatch,
    deflections: np.ndarray,
    weights: np.ndarray,
    borne: np.ndarray,
) -> np.ndarray:
    """Return the bristles of discs from the `deflections` `[2 or 3, N]` of the cells of a patch.

    `weights` and `borne` are shares of the stiffness of the cells and of the discs, or stiffnesses.

    A disc takes the rigid motion that is nearest to the cells next to it; the least rigid motion of all discs that
    gives them the wrench of all cells is added.
    """
    from scipy.spatial import KDTree

    nearest = np.asarray(KDTree(few.positions).query(patch.positions)[1])
    levers = patch.levers()
    discs = few.levers()
    shares = np.bincount(nearest, weights, few.cells)

    def sums(values: Iterable[np.ndarray]) -> np.ndarray:
        return np.array(
            [np.bincount(nearest, weights * each, few.cells) for each in values]
        )

    state = np.zeros((discs.shape[1], few.cells))
    state[:2] = sums(deflections[:2]) / np.where(shares > 0.0, shares, 1.0)
    turned = (levers[:, :2] - discs[nearest, :2])[:, :, 2].T
    spread, spin = sums(
        [
            np.sum(turned**2, axis=0),
            np.sum(turned * (deflections[:2] - state[:2, nearest]), axis=0),
        ]
    )
    spreads = spread > ALONE * shares * few.lever_radii**2
    state[2:] = discs[:, 2:, 2].T * np.where(
        spreads, spin / np.where(spreads, spread, 1.0), 0.0
    )
    whole = np.einsum("n,nij,in->j", weights, levers, deflections)
    missing = whole - np.einsum("n,nij,in->j", borne, discs, state)
    stiffness = np.einsum("n,nia,nib->ab", borne, discs, discs)
    return state + np.einsum(
        "nij,j->in", discs, np.linalg.lstsq(stiffness, missing, rcond=1e-12)[0]
    )
