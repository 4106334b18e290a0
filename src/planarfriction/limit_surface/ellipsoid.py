"""The ellipsoid: the popular approximation of a limit surface."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface.base import SurfaceNumbers
from planarfriction.limit_surface.compiled import CompiledLimitSurface


@dataclass(frozen=True, eq=False)
class LimitSurfaceEllipsoid(CompiledLimitSurface):
    """Limit surface `fx^2 + fy^2 + (tau/r)^2 = 1` about the centre of pressure: `h = V_S/|V_S|`.

    Exact in pure sliding and in pure spin of a symmetric patch, wrong in between: which twist maps to which wrench.
    A friction metric of the whole patch stretches it, an asymmetry `a` shifts its centre.

    Source: Howe and Cutkosky 1996.
    """

    kind = kernels.ELLIPSOID
    anisotropy = "uniform"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """No numbers beyond the contact radius."""
        return SurfaceNumbers(self.kind, 0, np.zeros(0))

    def _scaled_twist_of(self, target: np.ndarray) -> np.ndarray:
        if self._lean is None:
            return target
        # h = V_S/|V_S| + lean is parallel to the target: the target's line meets the shifted unit sphere
        along = float(target @ self._lean)
        return (along + np.sqrt(along**2 + 1.0 - self._lean @ self._lean)) * target - self._lean
