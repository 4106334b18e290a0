"""The stored limit surface of the paper, to the letter."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction import validation
from planarfriction.kernels import surfaces as kernels
from planarfriction.kernels import tables
from planarfriction.limit_surface.base import MOST_SEGMENTS, SurfaceNumbers, _plane
from planarfriction.limit_surface.compiled import CompiledLimitSurface

_SAME_ANSWER = 1e-12
"""Angle [rad] between a stored wrench and the wanted one below which a direction answers: rounding of the quadratic."""


@dataclass(frozen=True, eq=False)
class LimitSurfaceTablePublished(CompiledLimitSurface):
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
        object.__setattr__(self, "segments", validation.count("segments", self.segments, 2, MOST_SEGMENTS))
        super().__post_init__()

    def _grid(self) -> tuple[tuple[float, float, float, float], np.ndarray]:
        """The patch's grid about the centre of pressure, and a place for the sums at its corners, of the caller alone.

        Compiled loops fill it as they go: two threads with one place would see each other's corners half done.
        """
        grid = self.patch.grid
        if grid is None:
            return (0.0, 0.0, 1.0, 1.0), np.full((0, 0, 3), np.nan)
        x, y = self.centre_of_pressure
        place = (float(grid.x_min - x), float(grid.y_min - y), float(grid.cell_width), float(grid.cell_height))
        return place, np.full((grid.columns + 1, grid.rows + 1, 3), np.nan)

    def _radius(self) -> float:
        place, corners = self._grid()
        return float(tables.smoothed_spin_sum(corners, place, *self._loaded_cells(), 0.0, 0.0)[2])

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """`h` at the nodes."""
        place, corners = self._grid()
        nodes = np.zeros((self.segments + 1, 4 * self.segments + 1, 4))
        tables.smoothed_nodes(corners, place, *self._loaded_cells(), self.contact_radius, self.segments, nodes)
        return SurfaceNumbers(self.kind, self.segments, nodes.reshape(-1))

    def _scaled_twist_of(self, target: np.ndarray) -> np.ndarray:
        """The direction whose stored `h` is parallel to `target`, exactly: two bilinear equations in each table cell.

        Where the stored map folds and several directions answer, the one of least dissipation.
        """
        nodes = self.numbers.data.reshape(self.segments + 1, -1, 4)[..., :3]
        across = nodes @ _plane(target).T  # [i, j, 2]: zero where h is parallel to the target
        corner = across[:-1, :-1]
        along_a, along_b = across[1:, :-1] - corner, across[:-1, 1:] - corner
        twisted = across[1:, 1:] - across[1:, :-1] - along_b
        # (corner + along_b b) x (along_a + twisted b) = 0 for the position b along the azimuth: q2 b^2 + q1 b + q0 = 0
        q2, q0 = _cross(along_b, twisted), _cross(corner, along_a)
        q1 = _cross(corner, twisted) + _cross(along_b, along_a)
        root = np.sqrt(np.maximum(q1 * q1 - 4.0 * q2 * q0, 0.0))
        half = -0.5 * (q1 + np.where(q1 < 0.0, -root, root))
        b = np.clip(np.stack([_quotient(half, q2), _quotient(q0, half), np.zeros_like(q0)]), 0.0, 1.0)[..., None]
        step, start = along_a + twisted * b, corner + along_b * b
        a = np.clip(_quotient(-(start * step).sum(-1), (step * step).sum(-1)), 0.0, 1.0)[..., None]
        place = np.stack(np.broadcast_arrays(np.arange(self.segments)[:, None], np.arange(4 * self.segments)), -1)
        polar, azimuth = np.moveaxis(0.5 * np.pi / self.segments * (place + np.concatenate([a, b], -1)), -1, 0)
        upper = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
        upper = upper.reshape(-1, 3)
        best = np.argsort(np.linalg.norm(start + step * a, axis=-1), axis=None)[:8]
        h = self._direction(upper[best])
        side, size = np.sign(h @ target), np.abs(h @ target)
        miss = np.linalg.norm(np.cross(h, target), axis=-1)
        answers = miss <= max(_SAME_ANSWER, miss.min())
        chosen = np.flatnonzero(answers)[np.argmin(size[answers])]
        return side[chosen] * upper[best[chosen]]


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]


def _quotient(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """The quotient; zero where there is none."""
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator != 0.0)
