"""A few cells that represent many: same moments of the pressure, same wrench of a spin, nearly the same limit surface.

Start from all cells and drop those with the least weight, a tenth at a time. After each round the weights x that are
left are computed again, as near as possible to the limit surface of the weights w of all cells:

    minimise sum_k (Phi_k(x)/Phi_k(w) - 1)^2   subject to   sum x p(rho) = sum w p(rho) for all p up to the degree

and to the same wrench of a spin about the centre of pressure, `sum x |rho|` (the contact radius) and `sum x rho/|rho|`,
with `Phi_k(x) = sum x |v|` the dissipation of K twists spread evenly over the sphere of directions. Cells whose weight
comes out negative are dropped too. As many cells as sums suffice (Tchakaloff's theorem).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.patch import compressed_rows as rows
from planarfriction.patch.metric import Anisotropy, refuse_cell_metrics
from planarfriction.patch.pressure import PerCell
from planarfriction.patch.pressure_maps import PressureMaps

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch

SURPLUS = 3
"""Cells by default: as many as there are moments of that many degrees more."""

DIRECTIONS = 600
"""Twists at which the limit surface is fitted."""

CHECKED = 3001
"""Twists at which its error is measured."""

SHARE_DROPPED = 0.1
"""Share of the cells that are dropped in a round."""

REGULARISATION = 1e-6
"""Pull of the weights towards zero beside the fit of the limit surface: decides where that leaves them open."""

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Multiples of it, less their whole parts, are spread evenly: the order in which ties are dropped."""

MOST_CORRECTIONS = 10
"""Times that cells with negative weights are dropped in a round."""

POSITIVE_FIT = 150
"""Cells up to which a fit with no negative weights is quick."""

MOMENTS_FIRST = 1e4
"""Weight of the moments in that fit beside the limit surface."""

NEARLY_KEPT = 1e-4
"""Miss of the moments after it that can be put right."""

KEPT = 1e-7
"""Miss of the moments above which a round has dropped too much; the last step takes what is left off."""

NODES_PER_OCTAVE = 32
"""Loads at which the weights of a patch that depends on the load are fitted, for each factor of 2."""

CHOSEN_EVERY = 16
"""Cells are chosen at every so many of them; the others make do with these cells where they can."""

HIGHEST_DEGREE = 16
"""Degree at which the search for a given error gives up."""


def number_of_moments(degree: int) -> int:
    """Return the number of monomials in x and y up to `degree`: `(degree + 1)(degree + 2)/2`."""
    return (degree + 1) * (degree + 2) // 2


def compressed(
    patch: ContactPatch, degree: int = 5, *, cells: int | None = None, error: float | None = None, loads: Any = None
) -> ContactPatch:
    """Implement `ContactPatch.compressed`."""
    refuse_cell_metrics(patch, "compressed")
    degree = validation.count("degree", degree, at_most=2 * HIGHEST_DEGREE)
    if error is not None:
        return _to_error(patch, degree, cells, validation.positive("error", error), loads)
    most = number_of_moments(degree + SURPLUS) if cells is None else validation.count("cells", cells)
    nodes = _nodes(patch, loads)
    if patch.cells <= most:
        return patch
    weights = patch.weights(nodes) if nodes is not None else patch.weights()[None]
    found = np.zeros_like(weights)
    chosen = np.arange(0, len(weights), CHOSEN_EVERY)
    for index in [*chosen, *np.setdiff1d(np.arange(len(weights)), chosen)]:
        favoured = np.any(found > 0.0, axis=0)
        problem = WeightProblem.of(patch.positions, weights[index], degree)
        refit = None if index in chosen else problem.refit(favoured)
        if refit is None:
            refit = problem.solution(most, favoured)
        found[index] = refit
    return chosen_cells(patch, found, nodes)


def surface_error(patch: ContactPatch, few: ContactPatch, normal_force: ArrayLike | None = None) -> float:
    """Return the largest relative error of the dissipation of `few` compared with that of `patch` [-].

    Twists are spread evenly over the sphere of `(vx, vy, omega r)` about the centre of pressure.

    Raises InvalidValueError unless both are ContactPatches.
    """
    for name, each in (("patch", patch), ("few", few)):
        if not isinstance(each, Anisotropy):
            raise InvalidValueError(name, "be a ContactPatch", each)
    if normal_force is not None:
        normal_force = validation.positive_load("normal_force", normal_force)
    weights = patch.weights(normal_force)
    scaled = rows.scaled_positions(patch.positions, weights)
    whole = rows.dissipation(scaled, weights, rows.directions(CHECKED))
    centre, radius = weights @ patch.positions, patch.contact_radius(normal_force)
    part = rows.dissipation((few.positions - centre) / radius, few.weights(normal_force), rows.directions(CHECKED))
    return float(np.abs(part / whole - 1.0).max())


def _to_error(patch: ContactPatch, degree: int, cells: int | None, error: float, loads: Any) -> ContactPatch:
    """Return the compressed patch of the lowest degree from `degree` on that meets the error at every node."""
    if cells is not None:
        raise InvalidValueError("compressed", "have only one of cells and error", f"cells={cells}, error={error}")
    nodes = _nodes(patch, loads)
    for trial in range(degree, HIGHEST_DEGREE + 1):
        few = compressed(patch, trial, loads=loads)
        checked = (None,) if nodes is None else nodes[:: max(1, len(nodes) // 4)]
        if few is patch or max(surface_error(patch, few, load) for load in checked) <= error:
            return few
    return patch


def _nodes(patch: ContactPatch, loads: Any) -> np.ndarray | None:
    """Return the loads at which weights are fitted [N]; None for a patch of fixed shape."""
    if not patch.depends_on_load:
        if loads is not None:
            raise InvalidValueError("loads", "be left out: the shape of this patch does not depend on the load", loads)
        return None
    if loads is None:
        raise InvalidValueError("loads", "be (lowest, highest) [N]: the shape of this patch depends on the load", None)
    low, high = validation.vector("loads", loads, 2).tolist()
    if not 0.0 < low < high:
        raise InvalidValueError("loads", "be (lowest, highest) with 0 < lowest < highest", (low, high))
    return np.geomspace(low, high, 1 + math.ceil(NODES_PER_OCTAVE * math.log2(high / low)))


def chosen_cells(patch: ContactPatch, weights: np.ndarray, nodes: np.ndarray | None) -> ContactPatch:
    """Return the patch of those cells that have weight at a node; each stands for the same area."""
    from planarfriction.patch.contact_patch import ContactPatch

    kept = (weights > 0.0).any(axis=0)
    count = int(kept.sum())
    values = weights[:, kept]
    law = PerCell(values[0]) if nodes is None else PressureMaps(nodes, values)
    few = ContactPatch(patch.positions[kept], np.full(count, patch.areas.sum() / count), law, None, patch.name)
    asymmetry = None if patch.asymmetry is None else patch.asymmetries()[0]
    metric = None if patch.root is None else np.reshape(patch.metric, (-1, 2, 2))[0]
    return few if metric is None and asymmetry is None else few.with_friction_metric(metric, asymmetry)


# ---------------------------------------------------------------------- one set of weights


class WeightProblem(NamedTuple):
    """Constraints on the weights of a compressed patch, over the C cells that may be chosen (`cells`) out of N."""

    every: int
    """Number of all cells, N."""
    cells: np.ndarray
    """Indices of the cells that may be chosen `[C]`."""
    moments: np.ndarray
    """Independent moments and spin wrench of one unit of weight on each cell, `[M, C]`."""
    moments_wanted: np.ndarray
    surface: np.ndarray
    """Relative dissipations of the same, `[K, C]`, times `1/sqrt(K)`."""
    surface_wanted: np.ndarray

    @classmethod
    def of(
        cls, positions: np.ndarray, weights: np.ndarray, degree: int, images: np.ndarray | None = None
    ) -> WeightProblem:
        """Return the problem of compressing `weights` `[N]` at `positions` `[N, 2]`.

        With `images` `[I, N]`, the cells onto which reflections map each, a cell stands for all of its images in equal
        shares.
        """
        loaded = np.flatnonzero(weights > 0.0)
        scaled, twists = rows.scaled_positions(positions[loaded], weights[loaded]), rows.directions(DIRECTIONS)
        chosen, places = rows.thinned(scaled), np.arange(len(loaded))[None]
        if images is not None:
            places = np.searchsorted(loaded, images[:, loaded])
            chosen = np.unique(places[:, chosen].min(axis=0))
        whole = rows.dissipation(scaled, weights[loaded], twists)
        each = [rows.speeds(scaled[image[chosen]], twists) for image in places]
        speeds = np.mean(each, axis=0) / (whole[:, None] * math.sqrt(DIRECTIONS))
        polynomials = np.vstack([rows.polynomials(scaled, degree), rows.spin(scaled)])
        moments, turn = rows.independent(np.mean([polynomials[:, image[chosen]] for image in places], axis=0))
        wanted = turn @ (polynomials @ weights[loaded])
        surface_wanted = np.full(DIRECTIONS, 1.0 / math.sqrt(DIRECTIONS))
        return cls(len(positions), loaded[chosen], moments, wanted, speeds, surface_wanted)

    def solution(self, most: int, favoured: np.ndarray) -> np.ndarray:
        """Return the weights `[N]` with at most `most` cells, where it can be those `favoured` `[N]`."""
        if most < len(self.moments):
            raise InvalidValueError("cells", f"be at least {len(self.moments)}, the number of sums that are kept", most)
        kept = np.ones(len(self.cells), dtype=bool)
        liked = favoured[self.cells]
        weights, share = self._weights(kept), SHARE_DROPPED
        while weights is not None and (over := int(kept.sum()) - most) > 0:
            order = self._by_weight(kept, weights, liked)
            drop = max(1, min(int(share * len(order)), over))
            fewer = self._without(kept, order[:drop])
            if fewer is not None:
                kept, weights = fewer
            elif drop == 1 or len(order) <= POSITIVE_FIT:
                fewer = self._positive(kept, order[:drop]) if kept.sum() > len(self.moments) else None
                kept, weights = fewer or self._vertex(kept)
                if fewer is None:
                    break
            else:
                share = 0.5 * drop / len(order)
        if weights is None:
            kept, weights = self._vertex(kept)
        return self._everywhere(kept, self._polished(kept, weights))

    def refit(self, chosen: np.ndarray) -> np.ndarray | None:
        """Return the weights `[N]` of the cells `chosen` alone, or None where they cannot have the moments."""
        kept = chosen[self.cells]
        found = self._positive(kept, np.empty(0, dtype=int))
        return None if found is None else self._everywhere(*found)

    def _everywhere(self, kept: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return the weights of the cells `kept` among zeros, `[N]`."""
        result = np.zeros(self.every)
        result[self.cells[kept]] = np.maximum(weights, 0.0)  # rounding of the last step
        return result

    def _weights(self, kept: np.ndarray) -> np.ndarray | None:
        """Return the weights of `kept` cells that have the moments and fit the surface best; None if none have them."""
        moments, surface = self.moments[:, kept], self.surface[:, kept]
        count, conditions = moments.shape[1], len(moments)
        if count < conditions:
            return None
        matrix = np.zeros((count + conditions,) * 2)
        matrix[:count, :count] = surface.T @ surface + REGULARISATION * np.eye(count)
        matrix[:count, count:], matrix[count:, :count] = moments.T, moments
        try:
            found = np.linalg.solve(matrix, np.concatenate([surface.T @ self.surface_wanted, self.moments_wanted]))
        except np.linalg.LinAlgError:
            return None
        weights = found[:count]
        return weights if np.abs(moments @ weights - self.moments_wanted).max() < KEPT else None

    def _by_weight(self, kept: np.ndarray, weights: np.ndarray, liked: np.ndarray) -> np.ndarray:
        """Return the cells `kept`, those with the least weight first."""
        score = np.round(weights / weights.max(), rows.SCORE_DIGITS) + liked[kept]
        cells = np.flatnonzero(kept)
        return cells[np.lexsort([(cells * GOLDEN) % 1.0, score])]

    def _without(self, kept: np.ndarray, dropped: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Drop the cells `dropped`, and the few more whose weights then are negative; return None if they are many."""
        fewer = kept.copy()
        fewer[dropped] = False
        for _ in range(MOST_CORRECTIONS):
            weights = self._weights(fewer)
            if weights is None:
                return None
            negative = np.flatnonzero(fewer)[weights <= 0.0]
            if len(negative) == 0:
                return fewer, weights
            if len(negative) > len(dropped):
                return None
            fewer[negative] = False
        return None

    def _positive(self, kept: np.ndarray, dropped: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Drop `dropped` and the cells whose weights vanish under a fit without negative weights."""
        from scipy import optimize

        for count in dict.fromkeys((len(dropped), min(1, len(dropped)))):
            fewer = kept.copy()
            fewer[dropped[:count]] = False
            moments, surface = self.moments[:, fewer], self.surface[:, fewer]
            pull = np.full(moments.shape[1], math.sqrt(REGULARISATION))
            stacked = np.vstack([MOMENTS_FIRST * moments, surface, np.diag(pull)])
            wanted = np.concatenate([MOMENTS_FIRST * self.moments_wanted, self.surface_wanted, np.zeros(len(pull))])
            turned, triangle = np.linalg.qr(stacked)
            found, _ = optimize.nnls(triangle, turned.T @ wanted, maxiter=100 * len(self.cells))
            if np.abs(moments @ found - self.moments_wanted).max() < NEARLY_KEPT:
                fewer[np.flatnonzero(fewer)[found <= 0.0]] = False
                found = found[found > 0.0]
                polished = self._polished(fewer, found)
                if (polished > 0.0).all() and np.abs(
                    self.moments[:, fewer] @ polished - self.moments_wanted
                ).max() < KEPT:
                    return fewer, polished
        return None

    def _vertex(self, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the weights of as few of the cells `kept` as there are moments."""
        from scipy import optimize

        found, _ = optimize.nnls(self.moments[:, kept], self.moments_wanted, maxiter=100 * len(self.cells))
        kept = kept.copy()
        kept[np.flatnonzero(kept)[found <= 0.0]] = False
        return kept, found[found > 0.0]

    def _polished(self, kept: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return the weights with the last digits of the moments put right."""
        moments = self.moments[:, kept]
        for _ in range(2):
            weights = weights - np.linalg.lstsq(moments, moments @ weights - self.moments_wanted, rcond=None)[0]
        return weights
