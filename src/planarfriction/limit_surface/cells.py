"""The limit surface of a patch as the sum over its cells."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction.kernels import surfaces as kernels
from planarfriction.kernels.twists import least_dissipation
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers, _plane


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
        least_dissipation(*self.numbers.data.reshape(3, -1), targets, _plane(targets), found)
        return found
