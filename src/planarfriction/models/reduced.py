"""The reduced model: a few bristles that stand for the patch."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, Self

import numpy as np

from planarfriction import validation
from planarfriction.compiled.base import CompiledModel
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.laws import FrictionLaw
from planarfriction.models.base import FrictionModel, ModelJacobians
from planarfriction.models.distributed import DistributedModel
from planarfriction.patch import ContactPatch
from planarfriction.patch import compressed_rows as rows
from planarfriction.patch.compressed import WeightProblem, chosen_cells
from planarfriction.patch.pressure import Pressure

OF_ALL_LOADS = 2
"""Times as many cells as of another stand for a patch whose shape depends on the load."""

SAME = 1e-9
"""Relative difference of positions and weights below which they are the same."""

SLANTED = np.array([1.0, 0.5 * (1.0 + math.sqrt(5.0))])
"""Direction along which no two cells of a grid are level: sorted along it, equal patches are equal cell by cell."""

DEGREE = 2
"""Degree up to which they keep the moments of the pressure; what is left open of their weights fits limit surfaces."""

PROBED = np.geomspace(1e-6, 1e6, 1001)
"""Loads [N] at which a patch is looked at to find where its shape changes."""

MOVED = 0.1
"""Share of the load that moves between cells from one load to the next over whose shapes cells are chosen."""

ROUNDS = 10
"""Largest number of times that shares are corrected, again after one has come out negative."""

INDEPENDENT = 1e-10
"""Relative singular value below which sums over the few cells count as dependent."""

REMEMBERED = 8
"""Patches whose few cells are kept for models with other laws: choosing cells takes longer than a short run."""

LEAST = 0.05
"""Share of itself down to which a share may fall in a round that others leave negative."""


def few_cells(patch: ContactPatch, cells: int) -> ContactPatch:
    """Return a patch of about `cells` cells that stand for all of `patch` (see `ContactPatch.compressed`).

    Cells with a friction metric or asymmetry of their own are compressed together with those that share it. The cells
    of a patch whose shape depends on the load are more than that, chosen at several loads; if they do not share
    one friction, all are kept.
    """
    return patch if patch.cells <= cells else _fewer(patch, cells)


@functools.lru_cache(REMEMBERED)
def _fewer(patch: ContactPatch, cells: int) -> ContactPatch:
    """Return the few cells of a patch that has more."""
    kinds = _kinds(patch)
    if patch.depends_on_load:
        return _by_load(patch, OF_ALL_LOADS * cells) if kinds.max() == 0 else patch
    return _symmetric(patch, cells) if kinds.max() == 0 else _by_kind(patch, kinds, cells)


def _symmetric(patch: ContactPatch, cells: int) -> ContactPatch:
    """Return the few cells of a patch of fixed shape: those of a symmetric patch are symmetric.

    The two pads of a grip then pull in the same line, and a patch that slides along its axis of symmetry is not pulled
    aside.
    """
    images = _images(patch)
    problem = WeightProblem.of(patch.positions, patch.weights(), DEGREE, images)
    most = max(cells // len(images), len(problem.moments))
    found = problem.solution(most, np.zeros(patch.cells, bool))
    return chosen_cells(patch, np.mean(found[images], axis=0)[None], None)


def _images(patch: ContactPatch) -> np.ndarray:
    """Return the cell onto which each reflection of the patch maps each cell, `[I, N]`, the identity first.

    Reflections are those along x, y and both about the centre of pressure that leave positions and weights alike.
    """
    weights, about = patch.weights(), patch.positions - patch.centre_of_pressure()
    near, order = SAME * float(np.abs(about).max()), np.argsort(about @ SLANTED)
    image, found = np.empty_like(order), [np.arange(patch.cells)]
    for flip in ((-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
        image[np.argsort(about * flip @ SLANTED)] = order
        alike = np.abs(weights[image] - weights).max() <= SAME * weights.max()
        if alike and np.abs(about[image] - about * flip).max() <= near:
            found.append(image.copy())
    return np.unique(found, axis=0)


def _kinds(patch: ContactPatch) -> np.ndarray:
    """Return the number of the kind of friction of each cell, `[N]`."""
    if patch.metric is None and patch.asymmetry is None:
        return np.zeros(patch.cells, int)
    metric = np.broadcast_to(np.eye(2) if patch.metric is None else patch.metric, (patch.cells, 2, 2))
    numbers = np.hstack([metric.reshape(-1, 4), patch.asymmetries()])
    return np.unique(numbers, axis=0, return_inverse=True)[1].reshape(-1)


def _by_kind(patch: ContactPatch, kinds: np.ndarray, count: int) -> ContactPatch:
    """Return the patch with the cells of each kind of friction compressed by themselves."""
    groups = [np.flatnonzero(kinds == kind) for kind in range(kinds.max() + 1)]
    weights = patch.weights()
    pressure = weights / patch.areas
    few = [few_cells(ContactPatch(patch.positions[g], patch.areas[g], pressure[g]), count) for g in groups]
    shares = np.concatenate([weights[g].sum() * each.weights() for g, each in zip(groups, few, strict=True)])
    first = np.repeat([g[0] for g in groups], [each.cells for each in few])
    metric = None if patch.metric is None else np.broadcast_to(patch.metric, (patch.cells, 2, 2))[first]
    asymmetry = None if patch.asymmetry is None else patch.asymmetries()[first]
    areas = np.full(len(first), patch.areas.sum() / len(first))
    positions = np.vstack([each.positions for each in few])
    return ContactPatch(positions, areas, shares, None, patch.name, metric=metric, asymmetry=asymmetry)


def _by_load(patch: ContactPatch, count: int) -> ContactPatch:
    """Return the few cells of a patch whose shape depends on the load."""
    if patch.cells <= count:
        return patch
    mean = patch.weights(loads_of_change(patch)).mean(axis=0)
    problem = WeightProblem.of(patch.positions, mean, DEGREE)
    chosen = problem.solution(count, np.zeros(patch.cells, bool)) > 0.0
    metric = None if patch.metric is None else patch.metric.reshape(-1, 2, 2)[0]
    asymmetry = None if patch.asymmetry is None else patch.asymmetries()[0]
    areas = np.full(int(chosen.sum()), patch.areas.sum() / chosen.sum())
    law = Gathered(patch, chosen)
    return ContactPatch(patch.positions[chosen], areas, law, None, patch.name, metric=metric, asymmetry=asymmetry)


def loads_of_change(patch: ContactPatch) -> np.ndarray:
    """Return loads [N] from the lowest to the highest at which the shape changes, by equal changes of the shape."""
    moved = 0.5 * np.abs(np.diff(patch.weights(PROBED), axis=0)).sum(axis=1)
    changes = np.flatnonzero(moved > 0.0)
    if len(changes) == 0:  # the shape stays, or changes at loads beyond all that exist
        return PROBED[[0, -1]]
    span = slice(changes[0], changes[-1] + 2)
    total = np.r_[0.0, np.cumsum(moved[changes[0] : changes[-1] + 1])]
    wanted = np.linspace(0.0, total[-1], max(2, math.ceil(total[-1] / MOVED)) + 1)
    return np.exp(np.interp(wanted, total, np.log(PROBED[span])))


@dataclass(frozen=True, eq=False)
class Gathered(ByValue, Pressure):
    """Shares of the load of the few cells of a patch whose shape depends on the load.

    Each cell of the whole patch gives its share to the nearest of the few; then the shares w of these change by the
    least `sum (dw)^2/w` that gives them the moments of the whole up to `DEGREE` and its wrench of a spin.
    """

    patch: ContactPatch
    """Whole patch."""
    chosen: np.ndarray
    """True for the few cells, `[N]`."""

    @functools.cached_property
    def nearest(self) -> np.ndarray:
        """Index of the few cell that is nearest to each cell of the patch, `[N]`."""
        from scipy.spatial import KDTree

        return np.asarray(KDTree(self.patch.positions[self.chosen]).query(self.patch.positions)[1])

    @property
    def depends_on_load(self) -> bool:
        return True

    def relative(self, positions: np.ndarray, normal_force: np.ndarray | None = None) -> np.ndarray:
        loads = np.asarray(normal_force, dtype=float)
        different, place = np.unique(loads, return_inverse=True)
        shares = np.array([self._at(weights) for weights in self.patch.weights(different)])
        return shares[place.reshape(loads.shape)]

    def ever_loaded(self, positions: np.ndarray, between: tuple[float, float] | None = None) -> np.ndarray:
        loaded = self.patch.pressure.ever_loaded(self.patch.positions, between)
        return np.bincount(self.nearest[loaded], minlength=len(positions)) > 0

    def _at(self, weights: np.ndarray) -> np.ndarray:
        """Return the shares of the few cells for `weights` `[N]` of all."""
        shares = np.bincount(self.nearest, weights, int(self.chosen.sum()))
        scaled = rows.scaled_positions(self.patch.positions, weights)
        sums = np.vstack([rows.polynomials(scaled, DEGREE), rows.spin(scaled)])
        wanted, sums = sums @ weights, sums[:, self.chosen]
        for _ in range(ROUNDS):
            missing = wanted - sums @ shares
            turned = sums * shares
            changed = shares * (1.0 + sums.T @ np.linalg.lstsq(turned @ sums.T, missing, rcond=INDEPENDENT)[0])
            if (changed >= 0.0).all():
                return changed
            shares = np.maximum(changed, LEAST * shares)
        return shares


FEWEST = 9
"""Least number of cells: as many as there are sums that they keep."""


@dataclass(frozen=True, eq=False)
class ReducedModel(FrictionModel):
    """Reduced LuGre friction: bristles on a few cells of the patch that stand for those of all.

    The weights of the few `cells` keep the moments of the pressure up to the second degree, the wrench of a spin, and
    nearly the limit surface (see `ContactPatch.compressed`). Equations are those of `DistributedModel`, and the state
    is `[2, n]` [m], x then y: the patch lets go where that model does.

    Raises InvalidValueError for a number of cells out of range.
    """

    REPLACED: ClassVar[tuple[str, ...]] = ("parts", "segments", "speeds", "load_error")
    """Options of the moments of bristles in parts, which stood here before; few cells took their place."""

    _: KW_ONLY
    cells: int = 56
    """Number of cells that have bristles, twice as many if the shape of the patch depends on the load."""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "cells", validation.count("cells", self.cells, FEWEST))
        _ = self.reduction

    @functools.cached_property
    def reduction(self) -> DistributedModel:
        """Distributed model on a few cells that stand for the patch."""
        return DistributedModel(few_cells(self.patch, self.cells), self.law)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(2, n)` for n cells."""
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
        return _of_few(self.reduction, self.patch, deflections, load)


def _refusing_replaced(init: Callable[..., None]) -> Callable[..., None]:
    """Return the constructor of `ReducedModel` with one clear line for options that were replaced."""

    @functools.wraps(init)
    def checked(self: ReducedModel, *given: Any, **options: Any) -> None:
        for name in self.REPLACED:
            if name in options:
                rule = "be left out: write cells=, the number of cells that have bristles"
                raise InvalidValueError(name, rule, options[name])
        init(self, *given, **options)

    return checked


ReducedModel.__init__ = _refusing_replaced(ReducedModel.__init__)


def _of_few(few: DistributedModel, patch: Any, deflections: np.ndarray, load: float) -> np.ndarray:
    """Return the bristles of the cells of `few` alone, plus the least rigid motion that gives the wrench of all."""
    nearest = [np.hypot(*(patch.positions - place).T).argmin() for place in few.patch.positions]
    chosen = deflections[:, nearest]
    whole = np.einsum("n,nij,in->j", patch.weights(load), patch.levers(), deflections)
    weights, levers = few.patch.weights(load), few.patch.levers()
    missing = whole - np.einsum("n,nij,in->j", weights, levers, chosen)
    stiffness = np.einsum("n,nia,nib->ab", weights, levers, levers)
    return chosen + np.einsum("nij,j->in", levers, np.linalg.lstsq(stiffness, missing, rcond=1e-12)[0])
