"""A stored limit surface that is smooth and exactly passive."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction import validation
from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface.base import MOST_SEGMENTS, SurfaceNumbers
from planarfriction.limit_surface.cell_metrics import potential_table
from planarfriction.limit_surface.compiled import CompiledLimitSurface
from planarfriction.limit_surface.exact import STORED_RULES, LimitSurfaceExact
from planarfriction.limit_surface.loops.twists import table_twists


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

    kind = kernels.POTENTIAL
    anisotropy = "any"

    def __post_init__(self) -> None:
        self._set(segments=validation.count("segments", self.segments, 2, MOST_SEGMENTS))
        super().__post_init__()

    @functools.cached_property
    def _exact(self) -> LimitSurfaceExact:
        return LimitSurfaceExact(self.patch, normal_force=self.normal_force)

    @functools.cached_property
    def centre_of_pressure(self) -> np.ndarray:
        """Centre of pressure `[2]` of the exact surface [m]."""
        return self._exact.centre_of_pressure if self._one_metric else super().centre_of_pressure

    def _radius(self) -> float:
        return self._exact.contact_radius if self._one_metric else super()._radius()

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Numbers at the nodes: the potential and its derivatives along both angles and mixed; the force of a spin."""
        if not self._one_metric:
            return SurfaceNumbers(self.kind, self.segments, potential_table(*self._scaled_levers, self.segments))
        return SurfaceNumbers(self.kind, self.segments, _nodes(self._exact, self.segments))

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        return table_twists(self._table, self._scaling, wrenches, found)


def _nodes(exact: LimitSurfaceExact, segments: int) -> np.ndarray:
    """Return the numbers of `kernels.surfaces.POTENTIAL`: `phi` less the tilt and its derivatives at the nodes, and the
    tilt.

    With the unit vectors `n` of a direction, `e` and `t` of growing polar angle p and azimuth:
    `dphi/dp = h . e`, `dphi/da = sin p (h . t)`, `d2phi/dp da = sin p (t . dh/dn e) + cos p (h . t)`.
    """
    polar = 0.5 * np.pi / segments * np.arange(segments + 1)[:, None]
    azimuth = 0.5 * np.pi / segments * np.arange(4 * segments)[None, :]
    sin_p, cos_p = np.sin(polar), np.cos(polar)
    cos_p[-1] = 0.0  # the equator is a translation, not nearly one
    sin_a, cos_a = np.sin(azimuth), np.cos(azimuth)
    flat = np.zeros_like(polar * azimuth)
    direction = np.stack([sin_p * cos_a, sin_p * sin_a, cos_p + flat], -1)
    along = np.stack([cos_p * cos_a, cos_p * sin_a, flat - sin_p], -1)
    across = np.stack([flat - sin_a, flat + cos_a, flat], -1)
    h, slope = exact.sums(direction.reshape(-1, 3), STORED_RULES)
    h, slope = h.reshape(direction.shape), slope.reshape(*direction.shape, 3)
    h_across = np.einsum("pai,pai->pa", h, across)
    ax, ay, _ = h[0, 0]
    lean, lean_slope = ax * cos_a + ay * sin_a, ay * cos_a - ax * sin_a
    tilt, tilt_slope = sin_p * cos_p**2, cos_p * (cos_p**2 - 2.0 * sin_p**2)
    nodes = np.empty((segments + 1, 4 * segments + 1, 4))
    nodes[:, :-1, 0] = np.einsum("pai,pai->pa", h, direction) - tilt * lean
    nodes[:, :-1, 1] = np.einsum("pai,pai->pa", h, along) - tilt_slope * lean
    nodes[:, :-1, 2] = sin_p * h_across - tilt * lean_slope
    mixed = sin_p * np.einsum("pai,paij,paj->pa", across, slope, along) + cos_p * h_across
    nodes[:, :-1, 3] = mixed - tilt_slope * lean_slope
    nodes[0, :, 3] = 0.0  # at the axis, where only the tilt has a slope
    nodes[:, -1] = nodes[:, 0]
    return np.append(nodes, (ax, ay))
