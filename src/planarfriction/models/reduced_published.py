"""The reduced model as published: three bristles and a limit surface."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planarfriction import formulas, validation
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import transformed
from planarfriction.kernels import published_adjoint, published_contact
from planarfriction.kernels import published_step as kernels
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.published_contact import PublishedContact, Root, Shape
from planarfriction.kernels.records import rows_of
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.limit_surface.base import scaling
from planarfriction.models.base import FrictionModel, ModelJacobians, PackedModel, StepJacobians
from planarfriction.patch.metric import refuse_cell_metrics, same_metric

_REMEMBERED = 64
"""Loads whose shapes a model remembers."""

ON_LOAD_CHANGE = ("rebuild", "rescale", "keep")


class PublishedShape(NamedTuple):
    """What the reduced model knows of its patch at one load."""

    centre_of_pressure: np.ndarray
    """[2] [m]; of a patch with a friction metric its `lever_coordinates`."""
    contact_radius: float
    """r [m]; of the published table as published."""
    second_moment: float
    """<rho^2> [m^2]"""
    surface: LimitSurface
    root: np.ndarray = np.eye(2)
    """Symmetric root of the friction metric, [2, 2] [-]."""

    @property
    def numbers(self) -> np.ndarray:
        """The shape as compiled loops see it."""
        return np.array([*self.centre_of_pressure, self.contact_radius, self.second_moment])


@dataclass(frozen=True, eq=False)
class ReducedModelPublished(FrictionModel):
    """Reduced LuGre friction: three bristles, conjugate to the wrench at the centre of pressure, and a limit surface.

    With `S = diag(1, 1, r)`, `V_S = S V`, `v_n = |V_S|` and `h(V)` the direction of the sliding wrench:
    `zdot = S h v_n - beta sigma_0 v_n / g(v_n) z`, `W = -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`,
    `U = diag(1, 1, <rho^2>)`. State: `(z_x, z_y, z_tau)` [m, m, m^2].

    A patch that depends on the load: `on_load_change="rebuild"` follows the load with everything, `"rescale"` keeps the
    limit surface and `<rho^2>` of `surface.normal_force` and lets only `r` (and the centre of pressure) follow,
    `"keep"` keeps all. The raw state is kept when `r` changes.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    surface: LimitSurface = None  # pyright: ignore[reportAssignmentType]
    """Limit surface; None takes the published table of the patch."""
    on_load_change: str = "rebuild"
    """What follows the load where the patch depends on it: "rebuild", "rescale" or "keep"."""

    def __post_init__(self) -> None:
        super().__post_init__()
        validation.choice("on_load_change", self.on_load_change, ON_LOAD_CHANGE)
        if self.surface is None:
            object.__setattr__(self, "surface", LimitSurfaceTablePublished(self.patch))
        if not isinstance(self.surface, LimitSurface):
            raise InvalidValueError("surface", "be a limit surface", self.surface)
        self._check_directions()
        if self.patch.depends_on_load and self.on_load_change != "rebuild" and self.surface.normal_force is None:
            raise InvalidValueError(
                "surface", f"have a normal_force when on_load_change={self.on_load_change!r}", "none"
            )

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3,)`"""
        return (3,)

    def shape_at(self, normal_force: float) -> PublishedShape:
        """Centre of pressure, `r`, `<rho^2>` and limit surface at a load [N]; recent loads are remembered."""
        if not self.patch.depends_on_load or self.on_load_change == "keep":
            return self._reference
        load = validation.positive("normal_force", normal_force)
        if load not in self._recent:
            while len(self._recent) >= _REMEMBERED:
                self._recent.pop(next(iter(self._recent)))
            self._recent[load] = self._shape_at(load)
        return self._recent[load]

    def rate(self, state, twist, normal_force) -> np.ndarray:
        """Bristle rates `zdot`, shape `[..., 3]` [m/s, m/s, m^2/s]."""
        return self._by_load(self._rate, (3,), *self._inputs(state, twist, normal_force))

    def wrench(self, state, twist, normal_force) -> np.ndarray:
        """Friction wrench on the moving body, shape `[..., 3]` [N, N, N m]."""
        return self._out(self._by_load(self._wrench, (3,), *self._inputs(state, twist, normal_force)))

    def jacobians(self, state, twist, normal_force) -> ModelJacobians:
        """Analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); at kinks a one-sided derivative."""
        packed = self._by_load(self._jacobians, (14, 3), *self._inputs(state, twist, normal_force))
        square = [packed[..., i : i + 3, :] for i in (0, 3, 6, 9)]
        slopes = ModelJacobians(square[0], square[1], packed[..., 12, :], square[2], square[3], packed[..., 13, :])
        if self._axes is None:
            return slopes
        axes = self._axes
        return slopes._replace(
            rate_twist=slopes.rate_twist @ axes,
            wrench_state=axes @ slopes.wrench_state,
            wrench_twist=axes @ slopes.wrench_twist @ axes,
            wrench_load=transformed(axes, slopes.wrench_load),
        )

    def step(self, state, twist, normal_force, dt) -> tuple[np.ndarray, np.ndarray]:
        """Advance by `dt` [s] at a held twist: the new state and the wrench at the end, stable at any `dt`.

        Plain LuGre is linear in z and its step exact. Elasto-plastic: the exponential step with the mean decay of start
        and predicted end, second order, kept within the largest deflection so that nothing overshoots.
        """
        array = np.ndarray
        if (
            type(state) is array
            and state.shape == (3,)
            and type(normal_force) is not array
            and type(dt) is not array
            and (type(twist) is not array or twist.ndim == 1)
            and self._fixed is not None
        ):  # one contact: no batch to broadcast, and the compiled step checks the numbers
            numbers, data = self._fixed
            result = np.empty(6)
            try:
                vx, vy, omega = twist
                valid = kernels.step_one(
                    numbers, data, state, float(vx), float(vy), float(omega), float(normal_force), float(dt), result
                )
            except (TypeError, ValueError):  # not numbers, or a batch: the checks below decide
                valid = False
            if valid:
                return result[:3], result[3:]
        state, twist, load, dt = self._inputs(state, twist, normal_force, dt=dt)
        packed = self._by_load(self._step, (6,), state, twist, load, dt)
        return packed[..., :3], self._out(packed[..., 3:])

    def step_jacobians(self, state, twist, normal_force, dt) -> StepJacobians:
        """Analytic derivatives of `step` (see `StepJacobians`); at kinks a one-sided derivative."""
        packed = self._one_step_jacobians(state, twist, normal_force, dt)
        if packed is None:
            state, twist, load, dt = self._inputs(state, twist, normal_force, dt=dt)
            packed = self._by_load(self._step_jacobians, (6, 7), state, twist, load, dt)
        wrench, new = packed[..., :3, :], packed[..., 3:, :]
        slopes = StepJacobians(new[..., :3], new[..., 3:6], wrench[..., :3], wrench[..., 3:6], wrench[..., 6])
        if self._axes is None:
            return slopes
        axes = self._axes
        return slopes._replace(
            state_twist=slopes.state_twist @ axes,
            wrench_state=axes @ slopes.wrench_state,
            wrench_twist=axes @ slopes.wrench_twist @ axes,
            wrench_load=transformed(axes, slopes.wrench_load),
        )

    def packed(self, loads: Sequence[float | None]) -> PackedModel:
        """See `FrictionModel.packed`."""
        shapes = [self._reference if load is None else self.shape_at(load) for load in loads]
        data = [np.ascontiguousarray(shape.surface.numbers.data, dtype=float) for shape in shapes]
        numbers, root = shapes[0].surface.numbers, shapes[0].root
        record = PublishedContact(
            self.law.numbers,
            Shape(*shapes[0].numbers),
            Root(root[0, 0], root[0, 1], root[1, 1]),
            numbers.kind,
            numbers.size,
            0,
        )
        rows = rows_of(
            record,
            len(shapes),
            shape=np.array([shape.numbers for shape in shapes]),
            size=np.array([shape.surface.numbers.size for shape in shapes]),
            data=np.array([place_of(each) for each in data]),
        )
        radius = max(shape.contact_radius for shape in shapes)
        natural = self.law.largest_deflection * np.array([1.0, 1.0, radius])
        return PackedModel(published_contact.FUNCTIONS, rows, 3, published_contact.LINEAR, natural, radius, tuple(data))

    # ------------------------------------------------------------------ axes of the friction metric

    @functools.cached_property
    def _axes(self) -> np.ndarray | None:
        """`diag(L, 1)` `[3, 3]`, or None: twists go in through it, wrenches come out."""
        if self.patch.root is None:
            return None
        axes = np.eye(3)
        axes[:2, :2] = self.patch.root
        return axes

    def _check_directions(self) -> None:
        by = type(self).__name__
        refuse_cell_metrics(self.patch, by)
        for patch in (self.patch, self.surface.patch):
            if patch.asymmetric:
                raise InvalidValueError("patch", f"have the same friction forwards and backwards for {by}", "asymmetry")
        if not same_metric(self.patch, self.surface.patch):
            raise InvalidValueError("surface", "have the friction metric of the patch", self.surface.patch.name)

    def _inputs(self, state, twist, normal_force, **more) -> list[np.ndarray]:
        state, twist, *rest = super()._inputs(state, twist, normal_force, **more)
        return [state, twist if self._axes is None else transformed(self._axes, twist), *rest]

    def _out(self, wrench: np.ndarray) -> np.ndarray:
        return wrench if self._axes is None else transformed(self._axes, wrench)

    # ------------------------------------------------------------------ one shape

    @functools.cached_property
    def _reference(self) -> PublishedShape:
        surface = self.surface
        second_moment = float(self.patch.second_moment(surface.normal_force))
        return PublishedShape(self._centre(surface), surface.contact_radius, second_moment, surface, self._root)

    @functools.cached_property
    def _recent(self) -> dict[float, PublishedShape]:
        return {}

    def _shape_at(self, normal_force: float) -> PublishedShape:
        surface = self.surface.at(normal_force)
        kept = self._reference if self.on_load_change == "rescale" else None
        return PublishedShape(
            self._centre(surface),
            surface.contact_radius,
            float(self.patch.second_moment(normal_force)) if kept is None else kept.second_moment,
            surface if kept is None else kept.surface,
            self._root,
        )

    def _centre(self, surface: LimitSurface) -> np.ndarray:
        return np.array(self.patch.lever_coordinates(*surface.centre_of_pressure))

    @property
    def _root(self) -> np.ndarray:
        return np.eye(2) if self.patch.root is None else self.patch.root

    @functools.cached_property
    def _fixed(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Numbers of law, shape and surface for `step_one`, where the patch does not depend on the load."""
        if self.patch.depends_on_load or self.patch.anisotropic:
            return None
        shape = self._reference
        numbers = shape.surface.numbers
        return np.array([*self.law.numbers, *shape.numbers, numbers.kind, 0, numbers.size]), numbers.data

    def _by_load(self, function, inner: tuple[int, ...], state, twist, load, *more) -> np.ndarray:
        """Apply `function(shape, state, twist, load, ...)` to flat batches, one for each shape that the loads take."""
        result = np.zeros((*load.shape, *inner))
        flat = [np.ascontiguousarray(a.reshape(load.size, *a.shape[load.ndim :])) for a in (state, twist, load, *more)]
        out = result.reshape(load.size, *inner)
        if not self.patch.depends_on_load or self.on_load_change == "keep":
            out[:] = function(self._reference, *flat)
        else:
            for value in np.unique(flat[2][flat[2] > 0.0]):
                chosen = flat[2] == value
                out[chosen] = function(self.shape_at(value), *(a[chosen] for a in flat))
        return out.reshape(result.shape)

    def _scaled(self, shape: PublishedShape, state, twist):
        """Scaled state and twist `[B, 3]`, `u = h v_n`, and the arguments of the bristle equation."""
        law, scale = self.law.numbers, np.array([1.0, 1.0, shape.contact_radius])
        v_s = transformed(scaling(shape.centre_of_pressure, shape.contact_radius), twist)
        v_n = np.linalg.norm(v_s, axis=-1)
        h = shape.surface._direction(v_s)
        h_norm = np.where(v_n > 0.0, np.linalg.norm(h, axis=-1), 1.0)
        z = state / scale
        z_norm = np.linalg.norm(z, axis=-1)
        unit = z / np.where(z_norm > 0.0, z_norm, 1.0)[:, None]
        along = (unit * h).sum(axis=-1) * v_n / h_norm
        grip = law.sigma_0 / formulas.stribeck(np, v_n, law)
        return z, v_s, h, v_n, h_norm, unit, z_norm, (z_norm * grip / h_norm, along, v_n, grip)

    def _rate(self, shape: PublishedShape, state, twist, load) -> np.ndarray:
        z, _, h, v_n, _, _, _, arguments = self._scaled(shape, state, twist)
        k = formulas.bristle_decay(np, *arguments, self.law.numbers)
        return (h * v_n[:, None] - k[:, None] * z) * np.array([1.0, 1.0, shape.contact_radius])

    def _wrench(self, shape: PublishedShape, state, twist, load) -> np.ndarray:
        law = self.law.numbers
        rate = self._rate(shape, state, twist, load)
        to_centre, viscous = self._to_centre(shape)
        velocity = transformed(to_centre, twist) * viscous
        centred = formulas.traction(state, rate, velocity, law)
        return transformed(to_centre.T, load[:, None] * centred)

    @staticmethod
    def _to_centre(shape: PublishedShape) -> tuple[np.ndarray, np.ndarray]:
        """The twist at the centre of pressure is `T V`, the wrench about the origin `T' W`; and the diagonal of U."""
        x, y = shape.centre_of_pressure
        return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]]), np.array([1.0, 1.0, shape.second_moment])

    def _jacobians(self, shape: PublishedShape, state, twist, load) -> np.ndarray:
        law = self.law.numbers
        scale = np.array([1.0, 1.0, shape.contact_radius])
        z, v_s, h, v_n, h_norm, unit, z_norm, arguments = self._scaled(shape, state, twist)
        along, grip = arguments[1], arguments[3][:, None]
        k, k_deflection, k_along, k_speed = (
            value[:, None] for value in formulas.bristle_decay_partials(np, *arguments, law)
        )
        u_slope = shape.surface._sliding_slope(v_s)
        heading = v_s / np.where(v_n > 0.0, v_n, 1.0)[:, None]
        h_unit = h / h_norm[:, None]
        h_norm_slope = np.einsum("bi,bij->bj", h_unit, u_slope) - h_norm[:, None] * heading
        h_norm_slope /= np.where(v_n > 0.0, v_n, 1.0)[:, None]
        along_slope = (np.einsum("bi,bij->bj", unit, u_slope) - along[:, None] * h_norm_slope) / h_norm[:, None]
        turn = (h_unit * v_n[:, None] - along[:, None] * unit) / np.where(z_norm > 0.0, z_norm, 1.0)[:, None]
        per_h = 1.0 / h_norm[:, None]
        k_z = k_deflection * grip * per_h * unit + k_along * turn
        stribeck_slope = formulas.stribeck_slope(np, v_n, law)[:, None]
        k_grip = k_deflection * z_norm[:, None] * per_h + k / grip
        k_v = (k_speed - k_grip * grip**2 * stribeck_slope / law.sigma_0) * heading
        k_v += k_along * along_slope - k_deflection * arguments[0][:, None] * per_h * h_norm_slope
        rate_state = -k[:, :, None] * np.eye(3) - z[:, :, None] * k_z[:, None, :]
        rate_state = scale[:, None] * rate_state / scale
        to_centre, viscous = self._to_centre(shape)
        rate_twist = scale[:, None] * (u_slope - z[:, :, None] * k_v[:, None, :]) * scale @ to_centre
        pull = law.sigma_0 * np.eye(3) + law.sigma_1 * rate_state
        push = law.sigma_1 * rate_twist + law.sigma_2 * np.diag(viscous) @ to_centre
        weight = -load[:, None, None]
        unit_wrench = self._wrench(shape, state, twist, np.ones_like(load))
        zero = np.zeros((len(load), 1, 3))
        return np.concatenate(
            [rate_state, rate_twist, weight * (to_centre.T @ pull), weight * (to_centre.T @ push), zero,
             unit_wrench[:, None, :]],
            axis=1,
        )  # fmt: skip

    def _step(self, shape: PublishedShape, state, twist, load, dt) -> np.ndarray:
        numbers = shape.surface.numbers
        out, wrench = np.empty_like(state), np.empty_like(state)
        kernels.step_batch(
            np.array(self.law.numbers),
            shape.numbers,
            np.array([numbers.kind, 0, numbers.size]),
            numbers.data,
            state,
            twist,
            load,
            dt,
            out,
            wrench,
        )
        return np.concatenate([out, wrench], axis=1)

    def _one_step_jacobians(self, state, twist, normal_force, dt) -> np.ndarray | None:
        """`_step_jacobians` `[6, 7]` of one contact of fixed shape, checked quickly; None where that is not it."""
        if (
            self.patch.depends_on_load
            or self.patch.anisotropic
            or [np.ndim(a) for a in (state, twist, normal_force, dt)] != [1, 1, 0, 0]
        ):
            return None
        if len(state) != 3 or len(twist) != 3:
            return None
        try:
            given = np.array([*state, *twist, normal_force, dt], dtype=float)
        except (TypeError, ValueError):  # not numbers: the checks of `_inputs` say which
            return None
        if not (np.isfinite(given).all() and given[6] >= 0.0 and given[7] >= 0.0):
            return None
        return self._step_jacobians(self._reference, given[None, :3], given[None, 3:6], given[6:7], given[7:])[0]

    def _step_jacobians(self, shape: PublishedShape, state, twist, load, dt) -> np.ndarray:
        slopes = np.empty((len(load), 6, 7 + published_adjoint.NUMBERS))
        if self._fixed is not None:
            numbers, data = self._fixed
            row, surface = numbers[None, :-3], numbers[-3:].astype(int)
        else:
            kind, size, data = shape.surface.numbers
            row, surface = np.array([[*self.law.numbers, *shape.numbers]]), np.array([kind, 0, size])
        published_adjoint.jacobians(row, surface, data, state, twist, load, dt, slopes)
        return slopes[:, :, :7]
