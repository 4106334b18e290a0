"""The limit surface of a patch as the sum over its cells."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction.kernels import surfaces as kernels
from planarfriction.kernels.twists import least_dissipation
from planarfriction.limit_surface.base import SurfaceNumbers, _plane
from planarfriction.limit_surface.cell_metrics import cell_slopes, cell_sums, cell_twist
from planarfriction.limit_surface.compiled import CompiledLimitSurface


@dataclass(frozen=True, eq=False)
class LimitSurfaceCells(CompiledLimitSurface):
    """Limit surface summed over the cells: `W = -sum w_i [v_i/|v_i| ; rho_i x v_i/|v_i|]`.

    Exact for point contacts; for a grid it jumps in small steps as the centre of rotation crosses cells (a cell at the
    centre of rotation adds nothing). Takes any friction metric and asymmetry of the cells.
    """

    kind = kernels.CELLS
    anisotropy = "any"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Scaled positions and weights of the loaded cells."""
        x, y, weights = self._loaded_cells()
        radius = self.contact_radius
        return SurfaceNumbers(self.kind, len(weights), np.concatenate([x / radius, y / radius, weights]))

    def _sliding(self, scaled: np.ndarray) -> np.ndarray:
        return super()._sliding(scaled) if self._one_metric else cell_sums(*self._scaled_levers, scaled)

    def _sliding_slope(self, scaled: np.ndarray) -> np.ndarray:
        return super()._sliding_slope(scaled) if self._one_metric else cell_slopes(*self._scaled_levers, scaled)

    def _scaled_twists_of(self, targets: np.ndarray) -> np.ndarray:
        """As the base class, all at once, with the kinks of `|v_i|` rounded off by a radius that shrinks to nothing.

        The minimum often lies on a kink (a wrench inside a flat facet of the surface: the body turns about one cell),
        where the plain Newton method stalls.
        """
        if self._lean is not None or not self._one_metric:
            lean = np.zeros(3) if self._lean is None else self._lean
            found = [cell_twist(*self._scaled_levers, lean, target, _plane(target)) for target in targets]
            return np.array(found).reshape(-1, 3)
        found = np.empty_like(targets)
        least_dissipation(*self.numbers.data.reshape(3, -1), targets, _plane(targets), found)
        return found
