"""The stored limit surface exactly as in the paper."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction._engine.published import spin_sums
from planarfriction._engine.published import surfaces as kernels
from planarfriction.limit_surface.base import CompiledLimitSurface, SurfaceNumbers
from planarfriction.limit_surface.loops.published_twists import published_twists
from planarfriction.limit_surface.stored import cell_sums


@dataclass(frozen=True, eq=False)
class LimitSurfaceTablePublished(CompiledLimitSurface):
    """Stored limit surface as published: smoothed sums at `segments` x `4 segments` nodes, bilinear in the two angles.

    The sums, and the contact radius, are blended over the corners of the grid cell that contains the centre of
    rotation; interpolated values are not renormalised. The map has kinks and is not the gradient of a potential;
    `LimitSurfaceTable` is. Patches without a grid (points, a few discs) use the plain sums.

    Raises InvalidValueError for an unsupported number of segments, and as every limit surface does.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    segments: int = 20
    """Segments per quadrant [-]."""

    def _grid(self) -> tuple[tuple[float, float, float, float], np.ndarray]:
        """Return the patch's grid about the centre of pressure, and new memory for the sums at its corners.

        Compiled loops fill it as they go: two threads with one place would see each other's corners half done.
        """
        grid = self.patch.grid
        if grid is None:
            return (0.0, 0.0, 1.0, 1.0), np.full((0, 0, 3), np.nan)
        x, y = self.centre_of_pressure
        place = (
            float(grid.x_min - x),
            float(grid.y_min - y),
            float(grid.cell_width),
            float(grid.cell_height),
        )
        return place, np.full((grid.columns + 1, grid.rows + 1, 3), np.nan)

    @property
    def _few_discs(self) -> bool:
        """True for discs off any grid, whose friction is smooth already."""
        return self.patch.has_discs and self.patch.grid is None

    def _radius(self) -> float:
        if self._few_discs:
            return super()._radius()
        place, corners = self._grid()
        return float(
            spin_sums.smoothed_spin_sum(
                corners, place, *self._loaded_cells(), 0.0, 0.0
            )[2]
        )

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """`h` at the nodes."""
        nodes = np.zeros((self.segments + 1, 4 * self.segments + 1, 4))
        if self._few_discs:
            angles = 0.5 * np.pi / self.segments * np.arange(4 * self.segments + 1)
            polar = angles[: self.segments + 1, None]
            azimuth = angles
            sides = (
                np.sin(polar) * np.cos(azimuth),
                np.sin(polar) * np.sin(azimuth),
                np.cos(polar) + 0.0 * azimuth,
            )
            units = np.stack(sides, -1).reshape(-1, 3)
            nodes[..., :3] = cell_sums(self._cell_rows, units)[0].reshape(
                *nodes.shape[:2], 3
            )
        else:
            place, corners = self._grid()
            spin_sums.smoothed_nodes(
                corners,
                place,
                *self._loaded_cells(),
                self.contact_radius,
                self.segments,
                nodes,
            )
        return SurfaceNumbers(kernels.BILINEAR, self.segments, nodes.reshape(-1))

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        """Find twists; of several directions that answer because the map folds, take that of least dissipation."""
        return published_twists(
            self.numbers.data, self.segments, self._scaling, wrenches, found
        )
