"""The protocol of all limit surfaces: wrench of a twist, dissipation, Jacobian, and twist of a wrench."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from planarfriction import validation
from planarfriction.equality import ByValue, by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import transformed
from planarfriction.kernels import surfaces as kernels
from planarfriction.limit_surface.cell_metrics import scaled_levers
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_anisotropy, refuse_cell_metrics, symmetric_root

if TYPE_CHECKING:
    from planarfriction.limit_surface.comparison import SurfaceComparison

_FULL_BALANCE = 1e-12
"""The twist of a wrench is found when its wrench is parallel to the given one to this angle [rad]."""

_DIFFERENCE = 1e-5
"""Angle [rad] of central differences of `h`: 1e-10 of its third derivative, and 1e-11 of rounding."""

_LARGEST = 1e100
"""Largest component of a twist or wrench: its square is finite, with room for sums."""

MOST_SEGMENTS = 256
"""Segments of a quadrant of a stored surface that are taken: 8 MB, two seconds; errors fall as their fourth power."""

_ROUNDING = 16.0 * np.finfo(float).eps
"""Share of the positions by which the centre of pressure, a sum over the cells, may be off."""


@by_parts
class SurfaceNumbers(NamedTuple):
    """A limit surface as compiled loops see it: `kernels.surfaces` says what the numbers mean."""

    kind: int
    size: int
    data: np.ndarray


@dataclass(frozen=True, eq=False)
class LimitSurface(ByValue):
    """Set of friction wrenches of a sliding patch, per unit `mu f_N`: `W(V) = -d Phi/d V`, `Phi(V) = sum w_i |v_i|`.

    Twists `(vx, vy, omega)` [m/s, m/s, rad/s] and wrenches `(fx, fy, tau)` [1, 1, m] are about the contact frame's
    origin and act on the moving body; leading axes broadcast. `normal_force` [N] fixes the shape of a patch that
    depends on the load; leave it out otherwise. A patch of one point has no limit surface (its contact radius is
    zero).

    A patch with a friction metric and an asymmetry: `Phi(V) = sum w_i (|u_i| + a_i . u_i)` with `u_i = L_i v_i`. The
    metric leaves `h(-V) = -h(V)`. The asymmetric part is linear in V, its wrench the same for all twists: a surface
    stored for half of all directions and three numbers more are exact for all of them.

    A surface of your own implements one method, `direction`; models store it as a table of `segments`.

    Source: Goyal, Ruina, Papadopoulos 1991.
    """

    patch: ContactPatch
    normal_force: float | None = dataclasses.field(default=None, kw_only=True)

    anisotropy: ClassVar[str] = "none"
    """Patches with direction-dependent friction that it takes: "none", "uniform" (all cells alike), "any"."""
    segments: ClassVar[int] = 20
    """Segments of a quadrant of the table that models store it as [-]."""

    def __post_init__(self) -> None:
        if not isinstance(self.patch, ContactPatch):
            raise InvalidValueError("patch", "be a ContactPatch", self.patch)
        if self.anisotropy != "any":
            refuse = refuse_anisotropy if self.anisotropy == "none" else refuse_cell_metrics
            refuse(self.patch, f"{type(self).__name__} (LimitSurfaceTable takes any)")
        if self.normal_force is not None:
            object.__setattr__(self, "normal_force", validation.positive_load("normal_force", self.normal_force))
        if self.normal_force is not None or not self.patch.depends_on_load:
            _ = self.contact_radius  # refuses a patch of one point now rather than later

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or another process gets, at one instant: another thread may be about to build something."""
        return dict(self.__dict__)

    def at(self, normal_force: float) -> LimitSurface:
        """The same kind of surface for the shape at another load; itself where the shape does not depend on it."""
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
        """`r = |tau|` of a spin about the centre of pressure [m]: scales the torque axis."""
        radius = self._radius()
        if not radius > 0.0:
            raise InvalidValueError("patch", "have a contact radius > 0 (more than one point)", f"r={radius}")
        return radius

    def _radius(self) -> float:
        return float(self.patch.contact_radius(self.normal_force))

    def _loaded_cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions about the centre of pressure (see `lever_coordinates`) and weights of the cells that carry load."""
        weights = self.patch.weights(self.normal_force)
        loaded = weights > 0.0
        offset = self.patch.positions - self.centre_of_pressure
        # the centre of pressure is a sum with rounding; a cell that stands on it stands on it exactly
        offset[np.abs(offset).max(axis=1) < _ROUNDING * np.abs(self.patch.positions[loaded]).max()] = 0.0
        x, y = self.patch.lever_coordinates(*offset.T)
        return np.ascontiguousarray(x[loaded]), np.ascontiguousarray(y[loaded]), weights[loaded]

    @property
    def _one_metric(self) -> bool:
        """Whether the cells have one metric, which lever coordinates and frame then take care of."""
        return self.patch.root is None or self.patch.root.ndim == 2

    @functools.cached_property
    def _scaled_levers(self) -> tuple[np.ndarray, np.ndarray]:
        """Maps from scaled twists to what the loaded cells see, `[n, 2, 3]`, and their weights."""
        x, y, weights = self._loaded_cells()
        if self._one_metric:
            root = None
        else:
            root = self.patch.root[self.patch.weights(self.normal_force) > 0.0]  # pyright: ignore
        return scaled_levers(x / self.contact_radius, y / self.contact_radius, root, self._frame()[:2, :2]), weights

    @functools.cached_property
    def _lean(self) -> np.ndarray | None:
        """What the asymmetry adds to `h`, `[3]`, or None."""
        if not self.patch.asymmetric:
            return None
        weights = self.patch.weights(self.normal_force)
        wrench = np.einsum("n,nij,ni->j", weights, self.patch.levers(), self.patch.asymmetries())
        return np.linalg.solve(self._frame().T, wrench)

    # ------------------------------------------------------------------ what a surface says of itself

    def direction(self, units: np.ndarray) -> np.ndarray:
        """`h` `[M, 3]`, the friction of unit scaled twists `[M, 3]` with its sign turned: what a surface has to say.

        Scaled twists are `V_S = (vx, vy, r omega)` about the centre of pressure, with `r` the `contact_radius`, and
        `h = -(fx, fy, tau/r)` is the gradient of the dissipation by them. It depends on the direction of V_S alone and
        turns its sign with it; a pure translation has `h = (vx, vy, .)`.
        """
        raise NotImplementedError(f"{type(self).__name__} has to implement direction(units)")

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        """`dh/dV_S` `[M, 3, 3]` at unit scaled twists `[M, 3]`: by central differences unless overridden."""
        slope = np.zeros((len(units), 3, 3))
        for across in np.moveaxis(_plane(units), -2, 0):
            ends = [self.direction(_unit(units + sign * _DIFFERENCE * across)) for sign in (1.0, -1.0)]
            slope += np.einsum("mi,mj->mij", (ends[0] - ends[1]) / (2.0 * _DIFFERENCE), across)
        return slope

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """The surface for compiled loops: a table of its potential, made on first use."""
        from planarfriction.limit_surface.stored import stored_potential

        data = stored_potential(lambda nodes: self.direction(nodes.reshape(-1, 3)).reshape(nodes.shape), self.segments)
        return SurfaceNumbers(kernels.POTENTIAL, self.segments, data)

    # ------------------------------------------------------------------ the protocol

    def wrench(self, twist) -> np.ndarray:
        """Friction wrench `W(V)` on the moving body, shape `[..., 3]` [1, 1, m]; zero at rest.

        Raises `InvalidValueError` if `twist` is not finite or not of shape `[..., 3]`.
        """
        scaled, frame = self._scaled(twist)
        return -transformed(frame.T, self._direction(scaled))

    def dissipation(self, twist) -> np.ndarray:
        """Dissipated power `Phi(V) = -W . V >= 0` per unit `mu f_N`, shape `[...]` [m/s]."""
        scaled, _ = self._scaled(twist)
        return np.einsum("...i,...i", self._direction(scaled), scaled)

    def jacobian(self, twist) -> np.ndarray:
        """`dW/dV`, shape `[..., 3, 3]`; zero along `V` itself and undefined at rest, where it is returned as zero."""
        scaled, frame = self._scaled(twist)
        flat = scaled.reshape(-1, 3)
        return -(frame.T @ self._direction_slope(flat) @ frame).reshape(*scaled.shape[:-1], 3, 3)

    def twist(self, wrench) -> np.ndarray:
        """Twist normal to the surface where the ray of `wrench` meets it, of unit dissipation, shape `[..., 3]`.

        `argmin Phi(V)` subject to `-W . V = 1`, scaled to `Phi(V) = 1`; the magnitude of `wrench` does not matter.

        Raises `InvalidValueError` if `wrench` is zero, not finite or not of shape `[..., 3]`.
        """
        wrench = _rows("wrench", wrench)
        if not (np.abs(wrench).max(axis=-1) > 0.0).all():
            raise InvalidValueError("wrench", "not be zero", wrench.tolist())
        frame = self._frame()
        # conjugate coordinates: force and torque / r about the centre of pressure; -h balances the wrench
        balanced = -_solved(frame.T, wrench.reshape(-1, 3))
        balanced /= np.linalg.norm(balanced, axis=1)[:, None]
        found = self._scaled_twists_of(balanced)
        found /= np.einsum("ni,ni->n", self._direction(found), found)[:, None]
        return _solved(frame, found).reshape(wrench.shape)

    def compare(self, reference: LimitSurface, *, samples: int = 200) -> SurfaceComparison:
        """Differences from another surface: wrenches of the same twists, and twists of the same wrenches.

        Both at `samples` directions, spread evenly over the sphere of the reference's scaled coordinates.

        Raises `InvalidValueError` if `reference` is no limit surface or `samples` not an integer >= 2.
        """
        from planarfriction.limit_surface import comparison

        return comparison.compare(self, reference, samples)

    # ------------------------------------------------------------------ scaled coordinates

    def _frame(self) -> np.ndarray:
        """`V_S = frame @ V`: from the origin to the centre of pressure, spin times the contact radius.

        With a friction metric the velocity there is `L v`; metrics per cell share the root of their mean.
        """
        frame, root = scaling(self.centre_of_pressure, self.contact_radius), self.patch.root
        if root is not None:
            if root.ndim == 3:
                root = symmetric_root(np.einsum("n,nij->ij", self.patch.weights(self.normal_force), self.patch.metric))
            frame[:2] = root @ frame[:2]
        return frame

    def _scaled(self, twist) -> tuple[np.ndarray, np.ndarray]:
        frame = self._frame()
        return transformed(frame, _rows("twist", twist)), frame

    def _direction(self, scaled: np.ndarray) -> np.ndarray:
        """`h` of scaled twists `[..., 3]`, with what the asymmetry adds; zero at rest."""
        flat = scaled.reshape(-1, 3)
        moving, h = _norm(flat) > 0.0, np.zeros_like(flat)
        h[moving] = self.direction(_unit(flat[moving]))
        if self._lean is not None:
            h[moving] += self._lean
        return h.reshape(scaled.shape)

    def _direction_slope(self, scaled: np.ndarray) -> np.ndarray:
        """`dh/dV_S` for scaled twists `[M, 3]`, shape `[M, 3, 3]`; zero at rest."""
        speed, slope = _norm(scaled), np.zeros((len(scaled), 3, 3))
        moving = speed > 0.0
        slope[moving] = self.direction_slope(_unit(scaled[moving])) / speed[moving, None, None]
        return slope

    def _sliding_slope(self, scaled: np.ndarray) -> np.ndarray:
        """`du/dV_S` of `u = h |V_S|` without asymmetry, for `[M, 3]`, shape `[M, 3, 3]`; at rest the ellipsoid's."""
        slope, moving = np.tile(np.eye(3), (len(scaled), 1, 1)), _norm(scaled) > 0.0
        units = _unit(scaled[moving])
        slope[moving] = self.direction_slope(units) + np.einsum("mi,mj->mij", self.direction(units), units)
        return slope

    def _scaled_twists_of(self, targets: np.ndarray) -> np.ndarray:
        """`_scaled_twist_of` for unit vectors `[M, 3]`."""
        return np.array([self._scaled_twist_of(target) for target in targets]).reshape(-1, 3)

    def _scaled_twist_of(self, target: np.ndarray) -> np.ndarray:
        """Direction of the scaled twist whose `h` is parallel to the unit vector `target`.

        Minimises the convex `Phi` over the plane `target . V = 1` by damped Newton steps from `_first_guess`.
        """
        basis = _plane(target)
        guess = self._first_guess(target)
        place = basis @ guess / (target @ guess)
        value, slope = self._dissipation_over(target, basis, place)
        for _ in range(60):
            balance = np.linalg.norm(slope)
            if balance < _FULL_BALANCE:
                break
            point = target + place @ basis
            hessian = basis @ self._direction_slope(point[None])[0] @ basis.T
            # where a table curves downwards, the same step along that direction, but downhill
            curvature, across = np.linalg.eigh(hessian)
            curvature = np.maximum(np.abs(curvature), 1e-12 * np.abs(curvature).max())
            if not curvature.max() > 0.0:
                break
            move = -across @ ((across.T @ slope) / curvature)
            length = 1.0
            while length > 1e-14:
                trial, trial_slope = self._dissipation_over(target, basis, place + length * move)
                gain = value - trial
                # near the minimum the gain drowns in rounding; there a better balance shows progress
                flat = abs(gain) < 1e-14 * value and np.linalg.norm(trial_slope) < 0.5 * balance
                if flat or gain > 1e-4 * length * abs(move @ slope):
                    break
                length *= 0.5
            else:
                break
            place, value, slope = place + length * move, trial, trial_slope
        return target + place @ basis

    def _first_guess(self, target: np.ndarray) -> np.ndarray:
        """A scaled twist near the one whose `h` is parallel to `target`: the ellipsoid's."""
        return target

    def _dissipation_over(self, target: np.ndarray, basis: np.ndarray, place: np.ndarray) -> tuple[float, np.ndarray]:
        """`Phi` and its slope `[2]` at a place in the plane `target . V = 1`."""
        point = target + place @ basis
        h = self._direction(point[None])[0]
        return float(h @ point), basis @ h


def scaling(centre_of_pressure: np.ndarray, contact_radius: float) -> np.ndarray:
    """`F` of `V_S = F V`: from the contact frame's origin to the centre of pressure, spin times the contact radius."""
    x, y = centre_of_pressure
    return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, contact_radius]])


def _solved(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """`matrix^-1 v` for each v of `vectors` `[M, 3]`, one by one: LAPACK rounds many at once differently."""
    return np.linalg.solve(matrix, vectors[..., None])[..., 0]


def _norm(scaled: np.ndarray) -> np.ndarray:
    """Lengths `[M]` of scaled twists `[M, 3]`, however large or small."""
    return np.hypot(np.hypot(scaled[:, 0], scaled[:, 1]), scaled[:, 2])


def _unit(scaled: np.ndarray) -> np.ndarray:
    """Directions `[M, 3]` of scaled twists that are not at rest."""
    return scaled / _norm(scaled)[:, None]


def _plane(normal: np.ndarray) -> np.ndarray:
    """Two unit vectors `[..., 2, 3]` that span the plane across the unit vector `normal` `[..., 3]`."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=-1)])
    first /= np.linalg.norm(first, axis=-1)[..., None]
    return np.stack([first, np.cross(normal, first)], axis=-2)


def _rows(name: str, value) -> np.ndarray:
    result = validation.finite_numbers(name, value, largest=_LARGEST)
    if result.ndim == 0 or result.shape[-1] != 3:
        raise InvalidValueError(name, "have shape [..., 3]", f"shape {list(result.shape)}")
    return result
