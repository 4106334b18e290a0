"""A stored limit surface, smooth and exactly passive."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction import validation
from planarfriction.kernels import surfaces as kernels
from planarfriction.kernels import tables
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers
from planarfriction.limit_surface.cell_metrics import potential_table


@dataclass(frozen=True, eq=False)
class LimitSurfaceTable(LimitSurface):
    """Stored limit surface: dissipation and its gradient at `segments` x `4 segments` directions, bicubic in between.

    The potential is interpolated and the wrench is its gradient, so that `-W . V = Phi(V) > 0` and the Jacobian is
    symmetric at every twist; nodes are plain sums over the cells.
    """

    segments: int = 20
    """Segments of a quadrant [-]."""

    kind = kernels.POTENTIAL
    anisotropy = "any"

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", validation.count("segments", self.segments, at_least=2))
        super().__post_init__()

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Potential, its derivatives along both angles and the mixed one at the nodes; the force in a pure spin."""
        if not self._one_metric:
            return SurfaceNumbers(self.kind, self.segments, potential_table(*self._scaled_levers, self.segments))
        nodes = np.empty((self.segments + 1, 4 * self.segments + 1, 4))
        tilt = tables.potential_nodes(*self._loaded_cells(), self.contact_radius, self.segments, nodes)
        return SurfaceNumbers(self.kind, self.segments, np.append(nodes, tilt))

    def _first_guess(self, target: np.ndarray) -> np.ndarray:
        """The node of least dissipation per unit of power that `target` would have."""
        segment = 0.5 * np.pi / self.segments
        polar, azimuth = np.meshgrid(
            np.arange(self.segments + 1) * segment, np.arange(4 * self.segments) * segment, indexing="ij"
        )
        upper = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
        upper = upper.reshape(-1, 3)
        power = upper @ target
        upper *= np.where(power < 0.0, -1.0, 1.0)[:, None]
        cost = np.einsum("ni,ni->n", self._direction(upper), upper) / np.maximum(np.abs(power), 1e-300)
        return upper[int(np.argmin(cost))]
