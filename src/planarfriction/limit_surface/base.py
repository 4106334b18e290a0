"""The protocol of all limit surfaces: wrench of a twist, dissipation, Jacobian, and twist of a wrench."""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._engine.published import surfaces as kernels
from planarfriction._support import validation
from planarfriction._support.equality import ByValue, by_parts, unusual
from planarfriction._support.pictures import picture
from planarfriction.errors import FrictionError, InvalidValueError, SolverError
from planarfriction.geometry import transformed
from planarfriction.limit_surface.loops.twists import StoredPotential, table_twists
from planarfriction.limit_surface.stored import across, descend, table_of
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import (
    refuse_anisotropy,
    refuse_cell_metrics,
    symmetric_root,
)

if TYPE_CHECKING:
    from planarfriction.limit_surface.comparison import SurfaceComparison

CERTIFIED = 1e-5
"""Largest angle [rad] by which the wrench of a twist that is returned may miss the given one, in scaled coordinates.

It is 1e-12 nearly everywhere. On lines it is more: 1e-8 beside wrenches that many twists share, where the dissipation
has a slope without curvature that its rounding hides, and 3e-6 in tables next to a pure spin, where they have none."""

_DIFFERENCE = 1e-5
"""Angle [rad] of central differences of `h`: 1e-10 of its third derivative, and 1e-11 of rounding."""

_LARGEST = 1e100
"""Largest component of a twist: its square is finite, with room for sums."""

MOST_SEGMENTS = 256
"""Segments of a quadrant of a stored surface that are taken: 8 MB, two seconds; errors fall as their fourth power."""

_ROUNDING = 16.0 * np.finfo(float).eps
"""Share of the positions by which the centre of pressure, a sum over the cells, may be off."""


@by_parts
class SurfaceNumbers(NamedTuple):
    """A limit surface as compiled loops see it: `published.surfaces` says what the numbers mean."""

    kind: int
    size: int
    data: np.ndarray


@dataclass(frozen=True, eq=False)
class LimitSurface(ByValue):
    """Set of friction wrenches of a sliding patch, per unit `mu f_N`: `W(V) = -d Phi/d V`, `Phi(V) = sum w_i |v_i|`.

    Twists `(vx, vy, omega)` [m/s, m/s, rad/s] and wrenches `(fx, fy, tau)` [1, 1, m] are about the contact frame's
    origin and act on the moving body; leading axes broadcast. If the shape of the patch depends on the load,
    `normal_force` [N] selects the shape; leave it out otherwise. A patch of one point has no limit surface (r = 0).

    With a friction metric and an asymmetry: `Phi(V) = sum w_i (|u_i| + a_i . u_i)` with `u_i = L_i v_i`. With a metric
    alone, `h(-V) = -h(V)` still holds. The asymmetric part of Phi is linear in V, and its wrench is the same for all
    twists, so a surface stored for half of all directions and three more numbers describe all of them exactly.

    A surface of your own implements one method, `direction`; models store it as a table of `segments`.

    Raises InvalidValueError for a patch with a single point, for direction-dependent friction that the surface does not
    support, and for a load that is not > 0.

    Source: Goyal, Ruina, Papadopoulos 1991.
    """

    patch: ContactPatch
    """The patch that slides."""
    normal_force: float | None = dataclasses.field(default=None, kw_only=True)
    """Load [N] for which the shape of the patch is taken; None if it does not depend on the load."""

    anisotropy: ClassVar[str] = "none"
    """Direction-dependent friction that it supports: "none", "uniform" (all cells alike), "any"."""
    segments: ClassVar[int] = 20
    """Segments per quadrant of the table in which models store it [-]."""

    def __post_init__(self) -> None:
        self._set(
            segments=validation.count("segments", self.segments, 2, MOST_SEGMENTS)
        )
        validation.instance("patch", self.patch, ContactPatch, "a ContactPatch")
        if self.anisotropy != "any":
            refuse = (
                refuse_anisotropy if self.anisotropy == "none" else refuse_cell_metrics
            )
            refuse(self.patch, f"{type(self).__name__} (LimitSurfaceTable takes any)")
        if self.normal_force is not None:
            self._set(
                normal_force=validation.positive_load("normal_force", self.normal_force)
            )
        if self.normal_force is not None or not self.patch.depends_on_load:
            # Refuses a patch of one point now rather than later.
            _ = self.contact_radius

    def __repr__(self) -> str:
        parts = [
            f"{self.patch.name!r} of {self.patch.cells} cells",
            *unusual(self, but=("patch",)),
        ]
        return f"{type(self).__name__}({', '.join(parts)})"

    def _repr_html_(self) -> str:
        return picture("limit surface in a notebook", self)

    def at(self, normal_force: float) -> LimitSurface:
        """Return the same kind of surface for the shape at another load; itself if the shape does not depend on it.

        Raises InvalidValueError for a load that is not > 0.
        """
        normal_force = validation.positive_load("normal_force", normal_force)
        if not self.patch.depends_on_load:
            return self
        return dataclasses.replace(self, normal_force=normal_force)

    @functools.cached_property
    def centre_of_pressure(self) -> np.ndarray:
        """Centre of pressure `[2]` [m]."""
        return self.patch.centre_of_pressure(self.normal_force)

    @functools.cached_property
    def contact_radius(self) -> float:
        """`r = |tau|` of a spin about the centre of pressure [m], by which the torque axis is scaled.

        Raises InvalidValueError for a patch of one point.
        """
        radius = self._radius()
        if not radius > 0.0:
            raise InvalidValueError(
                "patch",
                "have a contact radius > 0 (more than one point)",
                f"r={radius}",
            )
        return radius

    def _radius(self) -> float:
        return float(self.patch.contact_radius(self.normal_force))

    def _weights(self) -> np.ndarray:
        """Return the share of the load on each cell `[N]` in the sums of this surface."""
        return self.patch.weights(self.normal_force)

    def _loaded_cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return positions about the centre of pressure (see `lever_coordinates`) and weights of the loaded cells."""
        weights = self._weights()
        loaded = weights > 0.0
        offset = self.patch.positions - self.centre_of_pressure
        # the centre of pressure is a sum with rounding; a cell that stands on it stands on it exactly
        offset[
            np.abs(offset).max(axis=1)
            < _ROUNDING * np.abs(self.patch.positions[loaded]).max()
        ] = 0.0
        x, y = self.patch.lever_coordinates(*offset.T)
        return (
            np.ascontiguousarray(x[loaded]),
            np.ascontiguousarray(y[loaded]),
            weights[loaded],
        )

    @property
    def _one_metric(self) -> bool:
        """True if all cells have one metric, for which lever coordinates and frame account."""
        return self.patch.root is None or self.patch.root.ndim == 2

    @functools.cached_property
    def _cell_rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Maps from scaled twists to the velocities of the loaded cells `[2, 3, n]`, to what discs see of a spin `[n]`.

        `C_i = [L_i frame^-1 | (-y_i, x_i)]` of lever coordinates in contact radii; with the weights `[n]`.
        """
        x, y, weights = self._loaded_cells()
        loaded = self.patch.weights(self.normal_force) > 0.0
        radius = self.contact_radius
        levers = np.zeros((2, 3, len(x)))
        levers[0, 0] = 1.0
        levers[1, 1] = 1.0
        levers[0, 2] = -y / radius
        levers[1, 2] = x / radius
        if not self._one_metric:
            root = self.patch.root[loaded]  # pyright: ignore[reportOptionalSubscript]
            levers[:, :2] = np.moveaxis(
                root @ np.linalg.inv(self._frame()[:2, :2]), 0, -1
            )
        return levers, math.sqrt(0.5) * self.patch.lever_radii[loaded] / radius, weights

    @functools.cached_property
    def _lean(self) -> np.ndarray | None:
        """Contribution of the asymmetry to `h`, `[3]`, or None."""
        if not self.patch.asymmetric:
            return None
        weights = self._weights()
        wrench = np.einsum(
            "n,nij,ni->j", weights, self.patch.levers()[:, :2], self.patch.asymmetries()
        )
        return np.linalg.solve(self._frame().T, wrench)

    # ------------------------------------------------------------------ what a surface says of itself

    def direction(self, units: np.ndarray) -> np.ndarray:
        """Return the negative friction `h` `[M, 3]` for unit scaled twists `[M, 3]`; every surface must define this.

        Scaled twists are `V_S = (vx, vy, r omega)` about the centre of pressure, with `r` the `contact_radius`, and `h
        = -(fx, fy, tau/r)` is the gradient of the dissipation with respect to them. It depends only on the direction of
        V_S, and changes sign with it; a pure translation has `h = (vx, vy, .)`.
        """
        raise NotImplementedError(
            f"{type(self).__name__} has to implement direction(units)"
        )

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        """Return `dh/dV_S` `[M, 3, 3]` at unit scaled twists `[M, 3]`: by central differences unless overridden."""
        slope = np.zeros((len(units), 3, 3))
        for axis in np.moveaxis(across(units), -2, 0):
            ends = [
                self.direction(_unit(units + sign * _DIFFERENCE * axis))
                for sign in (1.0, -1.0)
            ]
            slope += np.einsum(
                "mi,mj->mij", (ends[0] - ends[1]) / (2.0 * _DIFFERENCE), axis
            )
        return slope

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """The surface for compiled code: a table of its potential, computed on first use."""
        from planarfriction.limit_surface.stored import stored_potential

        data = stored_potential(
            lambda units: (self.direction(units), None), self.segments
        )
        return SurfaceNumbers(kernels.POTENTIAL, self.segments, data)

    # ------------------------------------------------------------------ the protocol

    def wrench(self, twist: ArrayLike) -> np.ndarray:
        """Return the friction wrench `W(V)` on the moving body, shape `[..., 3]` [1, 1, m]; zero at rest.

        Raises `InvalidValueError` if `twist` is not finite or not of shape `[..., 3]`.
        """
        scaled, frame = self._scaled(twist)
        return -transformed(frame.T, self._direction(scaled))

    def dissipation(self, twist: ArrayLike) -> np.ndarray:
        """Return the dissipated power `Phi(V) = -W . V >= 0` per unit `mu f_N`, shape `[...]` [m/s].

        Raises InvalidValueError for a twist that is not `[..., 3]`, and without a load that is needed.
        """
        scaled, _ = self._scaled(twist)
        return np.einsum("...i,...i", self._direction(scaled), scaled)

    def jacobian(self, twist: ArrayLike) -> np.ndarray:
        """Return `dW/dV`, shape `[..., 3, 3]`; zero along `V` itself. At rest it is undefined and returned as zero.

        Raises InvalidValueError for a twist that is not `[..., 3]`, and without a load that is needed.
        """
        scaled, frame = self._scaled(twist)
        flat = scaled.reshape(-1, 3)
        return -(frame.T @ self._direction_slope(flat) @ frame).reshape(
            *scaled.shape[:-1], 3, 3
        )

    def twist(self, wrench: ArrayLike) -> np.ndarray:
        """Return the twist `[..., 3]` of unit dissipation normal to the surface where the ray of `wrench` meets it.

        `argmin Phi(V)` subject to `-W . V = 1`, scaled to `Phi(V) = 1`; the magnitude of `wrench` does not matter. The
        wrench of the returned twist is parallel to the given one within `CERTIFIED`. If the patch turns about a loaded
        point, the friction of that point, which is undetermined up to its limit, makes up the difference. If many
        twists have the same wrench, any of them is returned, on a surface that is not convex one of little dissipation.

        Raises `InvalidValueError` if `wrench` is zero, not finite or not `[..., 3]`, `SolverError` without a twist.
        """
        wrench = validation.vectors("wrench", wrench, 3)
        if wrench.ndim > 1:
            # Before it is copied, whatever its size.
            validation.finite_numbers("wrench", wrench, largest=math.inf)
        # Writable, for which loops are compiled.
        rows = np.array(wrench, order="C").reshape(-1, 3)
        found = np.empty_like(rows)
        angle = self._find_twists(rows, found)
        if not 0.0 <= angle <= CERTIFIED:
            raise _no_twist(wrench, angle)
        return found.reshape(wrench.shape)

    def compare(
        self, reference: LimitSurface, *, samples: int = 200
    ) -> SurfaceComparison:
        """Compare with another surface: wrenches of the same twists, and twists of the same wrenches.

        Both at `samples` directions, spread evenly over the sphere of the reference's scaled coordinates.

        Raises `InvalidValueError` if `reference` is no limit surface or `samples` not an integer >= 2.
        """
        from planarfriction.limit_surface import comparison

        if not isinstance(reference, LimitSurface):
            raise InvalidValueError("reference", "be a limit surface", reference)
        return comparison.compare(self, reference, samples)

    # ------------------------------------------------------------------ scaled coordinates

    def _frame(self) -> np.ndarray:
        """Return `V_S = frame @ V`: from the origin to the centre of pressure, spin times the contact radius.

        With a friction metric the velocity there is `L v`; metrics per cell share the root of their mean.
        """
        frame = scaling(self.centre_of_pressure, self.contact_radius)
        root = self.patch.root
        if root is not None:
            if root.ndim == 3:
                root = symmetric_root(
                    np.einsum(
                        "n,nij->ij",
                        self.patch.weights(self.normal_force),
                        self.patch.metric,
                    )
                )
            frame[:2] = root @ frame[:2]
        return frame

    @functools.cached_property
    def _scaling(self) -> np.ndarray:
        """Numbers `[21]` between scaled and plain coordinates: the `frame` of `limit_surface.loops.twists`."""
        back = np.linalg.inv(self._frame())
        # conjugate coordinates: force and torque / r about the centre of pressure; -h balances the wrench
        return np.concatenate(
            [
                -back.T.ravel(),
                back.ravel(),
                np.zeros(3) if self._lean is None else self._lean,
            ]
        )

    @functools.cached_property
    def _table(self) -> StoredPotential:
        """The stored surface, from which searches for twists start."""
        return table_of(self)

    def _scaled(self, twist) -> tuple[np.ndarray, np.ndarray]:
        frame = self._frame()
        return transformed(frame, _rows("twist", twist)), frame

    def _direction(self, scaled: np.ndarray) -> np.ndarray:
        """Return `h` of scaled twists `[..., 3]`, with what the asymmetry adds; zero at rest."""
        flat = scaled.reshape(-1, 3)
        speed = _norm(flat)
        h = np.zeros_like(flat)
        moving = speed > 0.0
        h[moving] = self.direction(flat[moving] / speed[moving, None])
        if self._lean is not None:
            h[moving] += self._lean
        return h.reshape(scaled.shape)

    def _direction_slope(self, scaled: np.ndarray) -> np.ndarray:
        """Return `dh/dV_S` for scaled twists `[M, 3]`, shape `[M, 3, 3]`; zero at rest."""
        speed = _norm(scaled)
        slope = np.zeros((len(scaled), 3, 3))
        moving = speed > 0.0
        per_speed = 1.0 / speed[moving, None]
        slope[moving] = (
            self.direction_slope(scaled[moving] * per_speed) * per_speed[:, None]
        )
        return slope

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        """Write the twists of wrenches `[M, 3]`; the largest angle [rad] that is left, negative for a bad wrench.

        From those of the stored table, by the surface's own `direction`.
        """
        angle = table_twists(self._table, self._scaling, wrenches, found)
        return angle if angle < 0.0 else descend(self, wrenches, found)


class CompiledLimitSurface(LimitSurface):
    """A limit surface of one of the kinds of `published.surfaces`: it gives its `numbers`, the loops do the rest."""

    def direction(self, units: np.ndarray) -> np.ndarray:
        h = np.empty_like(units)
        (kind, size, data) = self.numbers
        kernels.sliding_batch(kind, data, 0, size, units, h)
        return h

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        slopes = np.empty((len(units), 9))
        (kind, size, data) = self.numbers
        kernels.sliding_jacobian_batch(kind, data, 0, size, units, slopes)  # of h |V_S|
        return slopes.reshape(-1, 3, 3) - np.einsum(
            "mi,mj->mij", self.direction(units), units
        )


def scaling(centre_of_pressure: np.ndarray, contact_radius: float) -> np.ndarray:
    """Return `F` of `V_S = F V`: from the frame's origin to the centre of pressure, spin times the contact radius."""
    x, y = centre_of_pressure
    return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, contact_radius]])


def _norm(scaled: np.ndarray) -> np.ndarray:
    """Return the lengths `[M]` of scaled twists `[M, 3]`, however large or small."""
    return np.hypot(np.hypot(scaled[:, 0], scaled[:, 1]), scaled[:, 2])


def _unit(scaled: np.ndarray) -> np.ndarray:
    """Return the directions `[M, 3]` of scaled twists that are not at rest."""
    return scaled / _norm(scaled)[:, None]


def _rows(name: str, value) -> np.ndarray:
    return validation.finite_numbers(
        name, validation.vectors(name, value, 3), largest=_LARGEST
    )


def _no_twist(wrench: np.ndarray, angle: float) -> FrictionError:
    """Return the error that says why there is no twist of `wrench` `[..., 3]`; raise at once if it is not finite."""
    validation.finite_numbers("wrench", wrench, largest=math.inf)
    if not (np.abs(wrench).max(axis=-1) > 0.0).all():
        return InvalidValueError("wrench", "not be zero", wrench.tolist())
    return SolverError(
        f"no twist found: the wrench of the nearest one is {angle:.1e} rad off (see LimitSurfaceExact)"
    )
