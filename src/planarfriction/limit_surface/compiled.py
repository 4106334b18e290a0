"""Limit surfaces that compiled loops know: given by numbers, evaluated there."""

from __future__ import annotations

import functools
from typing import ClassVar

import numpy as np

from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers


class CompiledLimitSurface(LimitSurface):
    """A limit surface of one of the kinds of `kernels.surfaces`: it gives its `numbers`, the loops do the rest."""

    kind: ClassVar[int]
    """Kind of `kernels.surfaces`."""

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """The stored surface for compiled loops, built on first use."""
        raise NotImplementedError

    def direction(self, units: np.ndarray) -> np.ndarray:
        """Evaluate the compiled loops."""
        return self._sliding(np.ascontiguousarray(units))

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        """Evaluate the compiled loops."""
        return self._sliding_slope(units) - np.einsum("mi,mj->mij", self.direction(units), units)

    def _sliding(self, scaled: np.ndarray) -> np.ndarray:
        """Return `u = h |V_S|` for scaled twists `[M, 3]`, without what the asymmetry adds."""
        u, numbers = np.empty_like(scaled), self.numbers
        kernels.sliding_batch(self.kind, numbers.data, 0, numbers.size, scaled, u)
        return u

    def _sliding_slope(self, scaled: np.ndarray) -> np.ndarray:
        slopes, numbers = np.empty((len(scaled), 9)), self.numbers
        kernels.sliding_jacobian_batch(self.kind, numbers.data, 0, numbers.size, np.ascontiguousarray(scaled), slopes)
        return slopes.reshape(-1, 3, 3)

    def _direction(self, scaled: np.ndarray) -> np.ndarray:
        flat = np.ascontiguousarray(scaled.reshape(-1, 3))
        u, speed = self._sliding(flat), np.linalg.norm(flat, axis=1)
        if self._lean is not None:
            u += speed[:, None] * self._lean
        return (u / np.where(speed > 0.0, speed, 1.0)[:, None]).reshape(scaled.shape)

    def _direction_slope(self, scaled: np.ndarray) -> np.ndarray:
        speed = np.linalg.norm(scaled, axis=1)
        safe = np.where(speed > 0.0, speed, 1.0)
        h = self._direction(scaled) if self._lean is None else self._direction(scaled) - self._lean
        along = np.einsum("mi,mj->mij", h, scaled / safe[:, None])
        slope = (self._sliding_slope(scaled) - along) / safe[:, None, None]
        return np.where((speed > 0.0)[:, None, None], slope, 0.0)
