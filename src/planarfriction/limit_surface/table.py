"""A stored limit surface that is smooth and exactly passive."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction._engine.published import surfaces as kernels
from planarfriction.limit_surface.base import CompiledLimitSurface, SurfaceNumbers
from planarfriction.limit_surface.exact import STORED_RULES, LimitSurfaceExact
from planarfriction.limit_surface.loops.twists import table_twists
from planarfriction.limit_surface.stored import cell_sums, stored_potential


@dataclass(frozen=True, eq=False)
class LimitSurfaceTable(CompiledLimitSurface):
    """Stored limit surface: dissipation and its gradient at `segments` x `4 segments` directions, bicubic in between.

    The potential is interpolated and the wrench is its gradient, so that `-W . V = Phi(V) > 0` and the Jacobian is
    symmetric at every twist. The nodes, including mixed derivatives, are those of `LimitSurfaceExact` (to 1e-7); if
    cells have friction metrics of their own, they are plain sums over the cells.

    Raises InvalidValueError for an unsupported number of segments, and as every limit surface does.
    """

    segments: int = 20
    """Segments per quadrant [-]."""

    anisotropy = "any"

    @functools.cached_property
    def _exact(self) -> LimitSurfaceExact:
        return LimitSurfaceExact(self.patch, normal_force=self.normal_force)

    @functools.cached_property
    def centre_of_pressure(self) -> np.ndarray:
        """Centre of pressure `[2]` of the exact surface [m]."""
        return (
            self._exact.centre_of_pressure
            if self._one_metric
            else super().centre_of_pressure
        )

    def _radius(self) -> float:
        return self._exact.contact_radius if self._one_metric else super()._radius()

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Numbers at the nodes: the potential and its derivatives along both angles and mixed; the force of a spin."""
        if self._one_metric:
            data = stored_potential(
                lambda units: self._exact.sums(units, STORED_RULES), self.segments
            )
        else:
            data = stored_potential(
                lambda units: (cell_sums(self._cell_rows, units)[0], None),
                self.segments,
            )
        return SurfaceNumbers(kernels.POTENTIAL, self.segments, data)

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        return table_twists(self._table, self._scaling, wrenches, found)
