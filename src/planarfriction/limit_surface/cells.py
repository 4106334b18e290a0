"""The limit surface of a patch as the sum over its cells."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers, _plane

_ROUNDINGS = 10.0 ** -np.arange(1.0, 11.0)
"""Speeds, relative to the scaled twist, at which the kinks of `|v_i|` are rounded off, one after the other [-]."""

_BALANCED = 1e-13
"""Slope of the dissipation at which a rounded minimum is found, per `mu f_N` [-]."""

_ROUGH = 1e-3
"""The same for the roundings before the last, which only lead there [-]."""

_PLACED = 1e-15
"""Rounding of a place in the plane [-]: over the rounding-off of a kink, the slope that it leaves there."""

_UPHILL = 0.3
"""Slope at the end of an accepted step, relative to that at its start [-]."""

_FLATTEST = 1e-12
"""Least curvature that a step of Newton's method trusts, relative to the largest [-]."""

_MOST_STEPS = 60
"""Newton steps for each rounding; a dozen are usual."""

_AT_ONCE = 100_000
"""Wrenches times cells that are solved together: what fits a processor's cache in three or four arrays."""


@dataclass(frozen=True, eq=False)
class LimitSurfaceCells(LimitSurface):
    """Limit surface summed over the cells: `W = -sum w_i [v_i/|v_i| ; rho_i x v_i/|v_i|]`.

    Exact for point contacts; for a grid it jumps in small steps as the centre of rotation crosses cells (a cell at the
    centre of rotation adds nothing).
    """

    kind = kernels.CELLS

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Scaled positions and weights of the loaded cells."""
        x, y, weights = self._loaded_cells()
        radius = self.contact_radius
        return SurfaceNumbers(self.kind, len(weights), np.concatenate([x / radius, y / radius, weights]))

    def _scaled_twists_of(self, targets: np.ndarray) -> np.ndarray:
        """As the base class, all at once, with the kinks of `|v_i|` rounded off by a radius that shrinks to nothing.

        The minimum often lies on a kink (a wrench inside a flat facet of the surface: the body turns about one cell),
        where the plain Newton method stalls.
        """
        found = np.empty_like(targets)
        share = max(1, _AT_ONCE // self.numbers.size)
        for start in range(0, len(targets), share):
            part = slice(start, start + share)
            found[part] = _least_dissipation(self.numbers.data.reshape(3, -1), targets[part])
        return found


def _least_dissipation(cells: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Scaled twists `[M, 3]` of least `sum w_i |v_i|` in the planes `target . V = 1`; `cells` are `x, y, w` `[3, N]`."""
    basis = np.array([_plane(target) for target in targets])
    places = np.zeros((len(targets), 2))
    for rounding in _ROUNDINGS:
        active, last = np.arange(len(targets)), np.full(len(targets), np.inf)
        slope, hessian = _rounded(cells, targets, basis, places, rounding)
        balanced = _ROUGH if rounding > _ROUNDINGS[-1] else _BALANCED
        for _ in range(_MOST_STEPS):
            size = np.linalg.norm(slope[active], axis=1)
            going = (size > balanced) & ((size > _PLACED / rounding) | (size < 0.5 * last[active]))
            last[active], active = size, active[going]
            if not active.size:
                break
            move = _newton_move(slope[active], hessian[active])
            downhill = np.einsum("mi,mi->m", move, slope[active])
            trying, length = np.arange(len(active)), 1.0
            while trying.size and length > 1e-12:
                who = active[trying]
                trial = places[who] + length * move[trying]
                trial_slope, trial_hessian = _rounded(cells, targets[who], basis[who], trial, rounding)
                # convex along the step: it is short enough while the slope at its end is not steeply uphill
                end = np.einsum("mi,mi->m", trial_slope, move[trying])
                good = end <= _UPHILL * np.abs(downhill[trying])
                places[who[good]], slope[who[good]] = trial[good], trial_slope[good]
                hessian[who[good]] = trial_hessian[good]
                trying, length = trying[~good], 0.5 * length
            active = np.delete(active, trying)
    return targets + np.einsum("mi,mij->mj", places, basis)


def _rounded(cells, targets, basis, places, rounding: float) -> tuple[np.ndarray, np.ndarray]:
    """Slope `[M, 2]` and Hessian `[M, 2, 2]` of `sum w_i sqrt(|v_i|^2 + rounding^2)` in the planes."""
    x, y, weights = cells
    point = targets + np.einsum("mi,mij->mj", places, basis)
    vx, vy = point[:, :1] - point[:, 2:] * y, point[:, 1:2] + point[:, 2:] * x
    speed = np.sqrt(vx * vx + vy * vy + rounding * rounding)
    pull = weights / speed
    rows = np.stack([vx, vy, x * vy - y * vx], axis=1) / speed[:, None]  # [M, 3, N]
    h = rows @ weights
    # d(v/|v|) = (1 - e e')/|v| dv: the mass matrix of the pulls less what lies along the motion
    hessian = -np.einsum("min,mn,mjn->mij", rows, pull, rows, optimize=True)
    total, along_x, along_y = pull.sum(axis=1), pull @ x, pull @ y
    hessian[:, 0, 0] += total
    hessian[:, 1, 1] += total
    hessian[:, 2, 2] += pull @ (x * x + y * y)
    hessian[:, 0, 2] -= along_y
    hessian[:, 2, 0] -= along_y
    hessian[:, 1, 2] += along_x
    hessian[:, 2, 1] += along_x
    return np.einsum("mai,mi->ma", basis, h), basis @ hessian @ basis.transpose(0, 2, 1)


def _newton_move(slope: np.ndarray, hessian: np.ndarray) -> np.ndarray:
    """Newton's step; where the Hessian is singular to rounding (cells in a line), a long one downhill."""
    curvature, across = np.linalg.eigh(hessian)
    curvature = np.maximum(curvature, _FLATTEST * np.maximum(curvature[:, -1:], 1e-300))
    return -np.einsum("mia,ma->mi", across, np.einsum("mia,mi->ma", across, slope) / curvature)
