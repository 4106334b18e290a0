"""The limit surface of a patch as the sum over its cells."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction._engine.published import surfaces as kernels
from planarfriction.limit_surface.base import CompiledLimitSurface, SurfaceNumbers
from planarfriction.limit_surface.loops.cell_twists import cell_twists
from planarfriction.limit_surface.stored import cell_sums, stored_potential


@dataclass(frozen=True, eq=False)
class LimitSurfaceCells(CompiledLimitSurface):
    """Limit surface summed over the cells: `W = -sum w_i [v_i/|v_i| ; rho_i x v_i/|v_i|]`.

    Exact for point contacts; for a grid it changes in small jumps as the centre of rotation crosses cells (a cell at
    the centre of rotation contributes nothing). Supports any friction metric and asymmetry of the cells. Cells that are
    discs have a smooth friction of their own; models store their surface as a table.
    """

    anisotropy = "any"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Scaled positions and weights of the loaded cells; of discs a table."""
        if self.patch.has_discs:
            data = stored_potential(
                lambda units: cell_sums(self._cell_rows, units), self.segments
            )
            return SurfaceNumbers(kernels.POTENTIAL, self.segments, data)
        x, y, weights = self._loaded_cells()
        radius = self.contact_radius
        return SurfaceNumbers(
            kernels.CELLS,
            len(weights),
            np.concatenate([x / radius, y / radius, weights]),
        )

    def direction(self, units: np.ndarray) -> np.ndarray:
        return (
            super().direction(units)
            if self._compiled
            else cell_sums(self._cell_rows, units)[0]
        )

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        return (
            super().direction_slope(units)
            if self._compiled
            else cell_sums(self._cell_rows, units)[1]
        )

    @property
    def _compiled(self) -> bool:
        """True if compiled loops know the cells: points that share a metric."""
        return self._one_metric and not self.patch.has_discs

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        """Find twists; the minimum often lies on a kink: inside a flat facet the body turns about a cell."""
        return cell_twists(*self._cell_rows, self._scaling, wrenches, found)
