"""The stored limit surface of the paper, to the letter."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction import validation
from planarfriction.kernels import surfaces as kernels
from planarfriction.kernels import tables
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers


@dataclass(frozen=True, eq=False)
class LimitSurfaceTablePublished(LimitSurface):
    """Stored limit surface as published: smoothed sums at `segments` x `4 segments` nodes, bilinear in the two angles.

    The sums are blended over the corners of the grid cell that holds the centre of rotation, the contact radius with
    them; the nodes are not renormalised in between. The map has kinks and is not the gradient of a potential: see
    `LimitSurfaceTable` for one that is. Patches without a grid (points) use the plain sums.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    segments: int = 20
    """Segments of a quadrant [-]."""

    kind = kernels.BILINEAR

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", validation.count("segments", self.segments, at_least=2))
        super().__post_init__()

    @functools.cached_property
    def _grid(self) -> tuple[tuple[float, float, float, float], np.ndarray]:
        """The patch's grid about the centre of pressure, and a cache for the sums at its corners."""
        grid = self.patch.grid
        if grid is None:
            return (0.0, 0.0, 1.0, 1.0), np.full((0, 0, 3), np.nan)
        x, y = self.centre_of_pressure
        place = (float(grid.x_min - x), float(grid.y_min - y), float(grid.cell_width), float(grid.cell_height))
        return place, np.full((grid.columns + 1, grid.rows + 1, 3), np.nan)

    def _radius(self) -> float:
        place, corners = self._grid
        return float(tables.smoothed_spin_sum(corners, place, *self._loaded_cells(), 0.0, 0.0)[2])

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """`h` at the nodes."""
        place, corners = self._grid
        nodes = np.zeros((self.segments + 1, 4 * self.segments + 1, 4))
        tables.smoothed_nodes(corners, place, *self._loaded_cells(), self.contact_radius, self.segments, nodes)
        return SurfaceNumbers(self.kind, self.segments, nodes.reshape(-1))

    def _scaled_twist_of(self, target: np.ndarray) -> np.ndarray:
        """The direction whose stored `h` is parallel to `target`: from the best node, by least squares."""
        from scipy import optimize

        nodes = self.numbers.data.reshape(self.segments + 1, -1, 4)[..., :3]
        side = -1.0 if target[2] < 0.0 else 1.0
        match = side * nodes @ target / np.linalg.norm(nodes, axis=-1)
        i, j = np.unravel_index(int(np.argmax(match)), match.shape)
        segment = 0.5 * np.pi / self.segments

        def direction(angles: np.ndarray) -> np.ndarray:
            polar, azimuth = angles
            return side * np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])

        def mismatch(angles: np.ndarray) -> np.ndarray:
            h = self._direction(direction(angles)[None])[0]
            return h / np.linalg.norm(h) - target

        start = np.array([i * segment, j * segment])
        return direction(optimize.least_squares(mismatch, start, xtol=1e-15, ftol=1e-15, gtol=1e-15).x)
