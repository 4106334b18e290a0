"""Limit surfaces that compiled loops know by their numbers: sums over cells, and the ellipsoid."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers
from planarfriction.limit_surface.loops.cell_twists import cell_twists
from planarfriction.limit_surface.loops.twists import ellipsoid_twists
from planarfriction.limit_surface.stored import cell_slopes, cell_sums


class CompiledLimitSurface(LimitSurface):
    """A limit surface of one of the kinds of `kernels.surfaces`: it gives its `numbers`, the loops do the rest."""

    kind: ClassVar[int]
    """Kind of `kernels.surfaces`."""

    def direction(self, units: np.ndarray) -> np.ndarray:
        """Return `h` `[M, 3]` of unit scaled twists `[M, 3]` by compiled loops."""
        h, (_, size, data) = np.empty_like(units), self.numbers
        kernels.sliding_batch(self.kind, data, 0, size, units, h)
        return h

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        """Return `dh/dV_S` `[M, 3, 3]` at unit scaled twists `[M, 3]` by compiled loops."""
        slopes, (_, size, data) = np.empty((len(units), 9)), self.numbers
        kernels.sliding_jacobian_batch(self.kind, data, 0, size, units, slopes)  # of h |V_S|
        return slopes.reshape(-1, 3, 3) - np.einsum("mi,mj->mij", self.direction(units), units)


@dataclass(frozen=True, eq=False)
class LimitSurfaceCells(CompiledLimitSurface):
    """Limit surface summed over the cells: `W = -sum w_i [v_i/|v_i| ; rho_i x v_i/|v_i|]`.

    Exact for point contacts; for a grid it changes in small jumps as the centre of rotation crosses cells (a cell at
    the centre of rotation contributes nothing). Supports any friction metric and asymmetry of the cells.
    """

    kind = kernels.CELLS
    anisotropy = "any"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Scaled positions and weights of the loaded cells."""
        x, y, weights = self._loaded_cells()
        radius = self.contact_radius
        return SurfaceNumbers(self.kind, len(weights), np.concatenate([x / radius, y / radius, weights]))

    def direction(self, units: np.ndarray) -> np.ndarray:
        """Return `h` `[M, 3]` of unit scaled twists `[M, 3]`."""
        return super().direction(units) if self._one_metric else cell_sums(*self._scaled_levers, units)

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        """Return `dh/dV_S` `[M, 3, 3]` at unit scaled twists `[M, 3]`."""
        return super().direction_slope(units) if self._one_metric else cell_slopes(*self._scaled_levers, units)

    @functools.cached_property
    def _cell_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Levers `[2, 3, n]` and weights `[n]` for compiled loops."""
        levers, weights = self._scaled_levers
        return np.ascontiguousarray(np.moveaxis(levers, 0, -1)), weights

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        """Find twists; the minimum often lies on a kink: inside a flat facet the body turns about a cell."""
        return cell_twists(*self._cell_rows, self._scaling, wrenches, found)


@dataclass(frozen=True, eq=False)
class LimitSurfaceEllipsoid(CompiledLimitSurface):
    """Limit surface `fx^2 + fy^2 + (tau/r)^2 = 1` about the centre of pressure: `h = V_S/|V_S|`.

    Exact in pure sliding and in pure spin of a symmetric patch. In between it assigns the wrong twist to a wrench. A
    friction metric of the whole patch stretches it, and an asymmetry `a` shifts its centre.

    Source: Howe and Cutkosky 1996.
    """

    kind = kernels.ELLIPSOID
    anisotropy = "uniform"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Empty: nothing is needed besides the contact radius."""
        return SurfaceNumbers(self.kind, 0, np.zeros(0))

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        return ellipsoid_twists(self._scaling, wrenches, found)
