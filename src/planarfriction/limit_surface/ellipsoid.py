"""The ellipsoid: the popular approximation of a limit surface."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction._engine.published import surfaces as kernels
from planarfriction.limit_surface.base import CompiledLimitSurface, SurfaceNumbers
from planarfriction.limit_surface.loops.twists import ellipsoid_twists


@dataclass(frozen=True, eq=False)
class LimitSurfaceEllipsoid(CompiledLimitSurface):
    """Limit surface `fx^2 + fy^2 + (tau/r)^2 = 1` about the centre of pressure: `h = V_S/|V_S|`.

    Exact in pure sliding and in pure spin of a symmetric patch. In between it assigns the wrong twist to a wrench. A
    friction metric of the whole patch stretches it, and an asymmetry `a` shifts its centre.

    Source: Howe and Cutkosky 1996.
    """

    anisotropy = "uniform"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Empty: nothing is needed besides the contact radius."""
        return SurfaceNumbers(kernels.ELLIPSOID, 0, np.zeros(0))

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        return ellipsoid_twists(self._scaling, wrenches, found)
