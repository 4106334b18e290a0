"""The limit surface of a patch as the sum over its cells."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers, _plane
from planarfriction.limit_surface.cell_metrics import cell_slopes, cell_sums


@dataclass(frozen=True, eq=False)
class LimitSurfaceCells(LimitSurface):
    """Limit surface summed over the cells: `W = -sum w_i [v_i/|v_i| ; rho_i x v_i/|v_i|]`.

    Exact for point contacts; for a grid it jumps in small steps as the centre of rotation crosses cells (a cell at the
    centre of rotation adds nothing). Takes any friction metric and asymmetry of the cells.
    """

    kind = kernels.CELLS
    anisotropy = "any"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Scaled positions and weights of the loaded cells."""
        x, y, weights = self._loaded_cells()
        radius = self.contact_radius
        return SurfaceNumbers(self.kind, len(weights), np.concatenate([x / radius, y / radius, weights]))

    def _sliding(self, scaled: np.ndarray) -> np.ndarray:
        return super()._sliding(scaled) if self._one_metric else cell_sums(*self._scaled_levers, scaled)

    def _sliding_slope(self, scaled: np.ndarray) -> np.ndarray:
        return super()._sliding_slope(scaled) if self._one_metric else cell_slopes(*self._scaled_levers, scaled)

    def _scaled_twist_of(self, target: np.ndarray) -> np.ndarray:
        """As the base class, with the kinks of `|v_i|` rounded off by a radius that shrinks to nothing.

        The minimum often lies on a kink (a wrench inside a flat facet of the surface: the body turns about one cell),
        where the plain Newton method stalls.
        """
        from scipy import optimize

        basis, lean = _plane(target), np.zeros(3) if self._lean is None else self._lean
        levers, weights = self._scaled_levers
        maps = np.einsum("ad,icd->aci", basis, levers)  # [2, 2, n]

        def potential(place: np.ndarray, rounding: float):
            point = target + place @ basis
            velocity = levers @ point
            speed = np.sqrt((velocity**2).sum(axis=1) + rounding**2)
            along = np.einsum("aci,ic->ai", maps, velocity / speed[:, None])
            hessian = np.einsum("i,aci,bci->ab", weights / speed, maps, maps)
            hessian -= np.einsum("i,ai,bi->ab", weights / speed, along, along)
            return float(weights @ speed + lean @ point), along @ weights + basis @ lean, hessian

        place = np.zeros(2)
        for rounding in 10.0 ** -np.arange(1.0, 11.0):
            solution = optimize.minimize(
                lambda p, e=rounding: potential(p, e)[:2],
                place,
                jac=True,
                hess=lambda p, e=rounding: potential(p, e)[2],
                method="trust-exact",
                options={"gtol": 1e-13, "initial_trust_radius": max(10.0 * rounding, 1e-9)},
            )
            place = solution.x
        return target + place @ basis
