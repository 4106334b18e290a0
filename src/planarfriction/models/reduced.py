"""The reduced model: a few bristles that stand for the patch, or the moments of all in a few parts."""

from __future__ import annotations

import functools
from dataclasses import KW_ONLY, dataclass
from typing import Any, Self

import numpy as np

from planarfriction import validation
from planarfriction.compiled.base import CompiledModel
from planarfriction.laws import FrictionLaw
from planarfriction.models.base import FrictionModel, ModelJacobians
from planarfriction.models.distributed import DistributedModel
from planarfriction.models.few_cells import few_cells
from planarfriction.models.moments import MomentModel, check_maps

FEWEST = 9
"""Least number of cells: as many as there are sums that they keep."""


@dataclass(frozen=True, eq=False)
class ReducedModel(FrictionModel):
    """Reduced LuGre friction: bristles on a few cells of the patch, or the moments of all bristles in a few parts.

    By default the bristles of a few `cells` stand for those of all. Their weights keep the moments of the pressure up
    to the second degree, the wrench of a spin, and nearly the limit surface (see `ContactPatch.compressed`). Equations
    are those of `DistributedModel`, and the state is `[2, n]` [m], x then y: the patch lets go where that model does.

    With `parts`, the states are the first moments of the bristle field in each of so many compact parts, `[3]` or
    `[parts, 3]` [m]: fewer states, steady sliding and pre-sliding stiffness exact, but one threshold for all cells of a
    part (see `MomentModel`).

    Raises InvalidValueError for settings out of range, and in parts for a patch with all of its load on one cell, more
    parts than cells, and laws that creep.
    """

    _: KW_ONLY
    cells: int = 56
    """Number of cells that have bristles, twice as many if the shape of the patch depends on the load."""
    parts: Any = None
    """Number of compact parts with moments of their own, or "auto" (4 to 8); None: bristles on a few cells."""
    segments: int = MomentModel.segments
    """Squares of the map of a part along a quarter of a face of its cube; 24 give a median error of 1e-5 of z_ss."""
    speeds: int = MomentModel.speeds
    """Number of speeds in the map of a part, for the Stribeck effect."""
    load_error: float = MomentModel.load_error
    """Largest error of z_ss from interpolating maps over the load, of each part relative to the whole patch [-]; 0
    computes a map for each load, which is slow."""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "cells", validation.count("cells", self.cells, FEWEST))
        check_maps(self)
        if self.parts is not None:
            for name in ("parts", "segments", "speeds", "load_error"):
                object.__setattr__(self, name, getattr(self.reduction, name))
        _ = self.reduction

    @functools.cached_property
    def reduction(self) -> DistributedModel | MomentModel:
        """Model that stands for the patch: the distributed model on a few cells, or the moments of parts.

        Raises InvalidValueError as the class does.
        """
        if self.parts is None:
            return DistributedModel(few_cells(self.patch, self.cells), self.law)
        maps = {"segments": self.segments, "speeds": self.speeds, "load_error": self.load_error}
        return MomentModel(self.patch, self.law, parts=self.parts, **maps)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(2, n)` for n cells; `(3,)` or `(parts, 3)` with parts."""
        return self.reduction.state_shape

    @property
    def compiled(self) -> CompiledModel:
        """Machine form of the model (see `FrictionModel.compiled`)."""
        return self.reduction.compiled

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Return the analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); one-sided at kinks.

        Raises InvalidValueError as `step` does.
        """
        return self.reduction.jacobians(state, twist, normal_force)

    def with_law(self, law: FrictionLaw) -> Self:
        """Return the model with another law; see `FrictionModel.with_law`."""
        changed = object.__new__(type(self))
        changed.__dict__.update(self.__dict__, law=law, reduction=self.reduction.with_law(law))
        return changed

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        if isinstance(self.reduction, MomentModel):
            return self.reduction._state_of(deflections, load)
        return _of_few(self.reduction, self.patch, deflections, load)


def _of_few(few: DistributedModel, patch: Any, deflections: np.ndarray, load: float) -> np.ndarray:
    """Return the bristles of the cells of `few` alone, plus the least rigid motion that gives the wrench of all."""
    nearest = [np.hypot(*(patch.positions - place).T).argmin() for place in few.patch.positions]
    chosen = deflections[:, nearest]
    whole = np.einsum("n,nij,in->j", patch.weights(load), patch.levers(), deflections)
    weights, levers = few.patch.weights(load), few.patch.levers()
    missing = whole - np.einsum("n,nij,in->j", weights, levers, chosen)
    stiffness = np.einsum("n,nia,nib->ab", weights, levers, levers)
    return chosen + np.einsum("nij,j->in", levers, np.linalg.lstsq(stiffness, missing, rcond=1e-12)[0])
