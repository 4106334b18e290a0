"""Shares of areas and sums over the pressure of a patch: centre, contact radius, area, moments of any degree."""

# pyright: reportAttributeAccessIssue=false
# `positions`, `areas`, `radii`, `point_shares` and `weights` are those of the patch that is made from this.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import formulas
from planarfriction._support import validation
from planarfriction.patch.metric import Anisotropy

MOST_DEGREE = 40
"""Degree of polynomial moments that are given: beyond it powers are rounding."""


def disc_friction(slide: Any, spin: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return `c_t`, `c_s` [-] and the mean speed S of small discs from `|u|^2` and `(a omega)^2`, of any size.

    Friction is `W/S`, `W = (c_t u, c_s kappa a omega)` (see `formulas.disc_friction`).
    """
    total = np.asarray(slide + spin)
    # Shares of the sum keep in range.
    per = np.divide(1.0, total, out=np.zeros_like(total), where=total > 0.0)
    c_t, c_s, m = formulas.disc_friction(np, slide * per, spin * per)
    return c_t, c_s, np.sqrt(slide + m * spin)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Moments(Anisotropy):
    """Moments of a patch: sums over the positions of its cells, weighted with their shares of the load."""

    def tile_weights(self, normal_force: ArrayLike | None = None) -> np.ndarray:
        """Return the share of the normal force on the area of each cell, `p_i a_i / sum(p a)`, shape `[..., N]` [-].

        For sums that spread the load of a cell over its `cell_extents`. Raises InvalidValueError as `weights` does.
        """
        weights = self.weights(normal_force)
        if self.point_shares is None or self.has_discs:
            return weights
        tiles = weights / self.point_shares
        return tiles / tiles.sum(-1, keepdims=True)

    def pressure_values(self, normal_force: ArrayLike) -> np.ndarray:
        """Return the pressure on each cell, `p_i f_N / sum(p a)`, shape `[..., N]` [Pa].

        Raises InvalidValueError for a load below zero.
        """
        load = validation.non_negative_numbers("normal_force", normal_force)
        return self.tile_weights(load) * load[..., None] / self.areas

    def centre_of_pressure(self, normal_force: ArrayLike | None = None) -> np.ndarray:
        """Return the centre of pressure `sum(w rho)`, shape `[..., 2]` [m].

        Raises InvalidValueError without a load that is needed, as all sums here.
        """
        weights = self.weights(normal_force)
        return np.stack(
            [(weights * coordinate).sum(-1) for coordinate in self.positions.T], -1
        )

    @overload
    def contact_radius(self, normal_force: float | None = None) -> float: ...
    @overload
    def contact_radius(
        self, normal_force: np.ndarray | Sequence[Any]
    ) -> np.ndarray: ...
    def contact_radius(self, normal_force: Any = None) -> Any:
        """Return the contact radius `r = sum(w |rho - CoP|)` [m]: a spin about the CoP has the torque `mu f_N r`.

        With a friction metric `sum(w |L J (rho - CoP)|)`, J a quarter turn; the second moment likewise. A disc counts
        with the mean distance of its points.
        """
        weights, *offset = self._about_centre_of_pressure(normal_force)
        x, y = self.lever_coordinates(*offset)
        if not self.has_discs:
            return (weights * np.hypot(x, y)).sum(-1)
        return (weights * disc_friction(x**2 + y**2, self.lever_radii**2)[2]).sum(-1)

    @overload
    def second_moment(self, normal_force: float | None = None) -> float: ...
    @overload
    def second_moment(self, normal_force: np.ndarray | Sequence[Any]) -> np.ndarray: ...
    def second_moment(self, normal_force: Any = None) -> Any:
        """Return the second moment `<rho^2> = sum(w (|rho - CoP|^2 + a^2/2))` of cells with radii a [m^2]."""
        weights, *offset = self._about_centre_of_pressure(normal_force)
        dx, dy = self.lever_coordinates(*offset)
        return (weights * (dx**2 + dy**2 + 0.5 * self.lever_radii**2)).sum(-1)

    @overload
    def area(self, normal_force: float | None = None) -> float: ...
    @overload
    def area(self, normal_force: np.ndarray | Sequence[Any]) -> np.ndarray: ...
    def area(self, normal_force: Any = None) -> Any:
        """Return the area of the cells under load [m^2]."""
        return np.where(self.weights(normal_force) > 0.0, self.areas, 0.0).sum(-1)

    def moments(
        self, degree: int, normal_force: ArrayLike | None = None, *, about: Any = None
    ) -> np.ndarray:
        """Return the moments of the pressure `M[i, j] = sum(w (x - x0)^i (y - y0)^j)` for `i + j <= degree`.

        Shape `[..., degree + 1, degree + 1]` [m^(i + j)], zero where `i + j > degree`. `about` is the point (x0, y0)
        [m]: None for the centre of pressure (central moments), `(0, 0)` for the raw ones. Raises InvalidValueError for
        a parameter that breaks its rule.
        """
        degree = validation.count("degree", degree, at_least=0, at_most=MOST_DEGREE)
        weights, dx, dy = self._about_centre_of_pressure(normal_force)
        if about is not None:
            dx, dy = (self.positions - validation.vector("about", about, 2)).T
        result = np.zeros((*weights.shape[:-1], degree + 1, degree + 1))
        for i in range(degree + 1):
            for j in range(degree + 1 - i):
                result[..., i, j] = (weights * dx**i * dy**j).sum(-1)
        return result

    def _about_centre_of_pressure(
        self, normal_force: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the weights and both coordinates of the cells relative to the CoP, each of shape `[..., N]`."""
        weights = self.weights(normal_force)
        dx, dy = ((x - (weights * x).sum(-1, keepdims=True)) for x in self.positions.T)
        return weights, dx, dy
