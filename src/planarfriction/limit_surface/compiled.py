"""Limit surfaces that compiled loops know: given by numbers, evaluated there."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface.base import LimitSurface


class CompiledLimitSurface(LimitSurface):
    """A limit surface of one of the kinds of `kernels.surfaces`: it gives its `numbers`, the loops do the rest."""

    kind: ClassVar[int]
    """Kind of `kernels.surfaces`."""

    def direction(self, units: np.ndarray) -> np.ndarray:
        """Return `h` `[M, 3]` of unit scaled twists `[M, 3]` by compiled loops."""
        h, (_, size, data) = np.empty_like(units), self.numbers
        kernels.sliding_batch(self.kind, data, 0, size, units, h)
        return h

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        """Return `dh/dV_S` `[M, 3, 3]` at unit scaled twists `[M, 3]` by compiled loops."""
        slopes, (_, size, data) = np.empty((len(units), 9)), self.numbers
        kernels.sliding_jacobian_batch(self.kind, data, 0, size, units, slopes)  # of h |V_S|
        return slopes.reshape(-1, 3, 3) - np.einsum("mi,mj->mij", self.direction(units), units)
