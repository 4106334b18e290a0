"""The reduced model as published: three bristles and a limit surface."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planarfriction import validation
from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import transformed
from planarfriction.kernels import published_contact, published_step, step_slopes
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.published_contact import PublishedContact, Root, Shape
from planarfriction.kernels.records import rows_of
from planarfriction.kernels.surfaces import ELLIPSOID
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.limit_surface.base import SurfaceNumbers
from planarfriction.models.base import PackedModel
from planarfriction.models.reduced_map import is_point
from planarfriction.models.three_states import ThreeStateModel
from planarfriction.patch.metric import refuse_cell_metrics, same_metric

ON_LOAD_CHANGE = ("rebuild", "rescale", "keep")

# Natural scale of a creep, as a share of v_s. The published map has several directions into which a patch that has come
# to a halt may go on, and 1e-5 of v_s decides which: two pads end 9 um apart.
_VELOCITY_SCALE = 0.01


class _OfPoint(NamedTuple):
    """What stands for the limit surface of a point: `u = V_S`, and V_S has no third component."""

    numbers: SurfaceNumbers = SurfaceNumbers(ELLIPSOID, 0, np.zeros(0))


@by_parts
class PublishedShape(NamedTuple):
    """What the reduced model knows of its patch at one load."""

    centre_of_pressure: np.ndarray
    """[2] [m]; of a patch with a friction metric its `lever_coordinates`."""
    contact_radius: float
    """r [m]; of the published table as published; 0 of a point."""
    second_moment: float
    """<rho^2> [m^2]"""
    surface: LimitSurface
    """At a point, what stands for it."""
    root: np.ndarray = np.eye(2)
    """Symmetric root of the friction metric, [2, 2] [-]."""

    @property
    def numbers(self) -> np.ndarray:
        """The shape as compiled loops see it."""
        return np.array([*self.centre_of_pressure, self.contact_radius, self.second_moment])


_SLIDES = np.array([1.0, 1.0, 0.0])
_SLIDER = PublishedShape(np.zeros(2), 1.0, 0.0, _OfPoint())  # pyright: ignore[reportArgumentType]
"""What steps as a point does, at the point, as long as it does not spin."""


def axes_of(root: np.ndarray) -> np.ndarray:
    """`diag(L, 1)` `[3, 3]`: twists go in through it, wrenches come out."""
    axes = np.eye(3)
    axes[:2, :2] = root
    return axes


@dataclass(frozen=True, eq=False)
class ReducedModelPublished(ThreeStateModel):
    """Reduced LuGre friction: three bristles, conjugate to the wrench at the centre of pressure, and a limit surface.

    With `S = diag(1, 1, r)`, `V_S = S V`, `v_n = |V_S|` and `h(V)` the direction of the sliding wrench: `zdot = S h v_n
    - beta sigma_0 v_n / g(v_n) z`, `W = -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`, `U = diag(1, 1, <rho^2>)`.
    State: `(z_x, z_y, z_tau)` [m, m, m^2].

    For a patch that depends on the load, `on_load_change="rebuild"` recomputes everything for each load, `"rescale"`
    keeps the limit surface and `<rho^2>` of `surface.normal_force` and updates only `r` (and the centre of pressure),
    and `"keep"` keeps everything. The raw state is kept when `r` changes. If one cell carries all but a millionth of
    the load, the contact is a point without torque about it; `z_tau` then keeps its value, without effect.

    Raises InvalidValueError if `surface` is not a limit surface, and if it lacks the `normal_force` that
    `on_load_change` needs.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    _kernels = published_step
    step_function, jacobian_function = step_slopes.published, step_slopes.published_jacobian
    state_units = "m, m, m^2"

    surface: LimitSurface = None  # pyright: ignore[reportAssignmentType]
    """Limit surface; None uses the published table of the patch."""
    on_load_change: str = "rebuild"
    """What is updated when the load changes the shape of the patch: "rebuild", "rescale" or "keep"."""

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

    def shape_at(self, normal_force: float) -> PublishedShape:
        """Centre of pressure, `r`, `<rho^2>` and limit surface at a load [N]; recent loads are cached.

        Raises InvalidValueError for a load that is not > 0.
        """
        if not self.patch.depends_on_load or self.on_load_change == "keep":
            return self._reference
        load = validation.positive_load("normal_force", normal_force)
        return self._recent.get(load, lambda: self._shape_at(load))

    def _records(self, shapes: Sequence[PublishedShape], radius: float) -> PackedModel:
        data = [np.ascontiguousarray(shape.surface.numbers.data, dtype=float) for shape in shapes]
        root = shapes[0].root
        record = PublishedContact(
            self.law.numbers,
            Shape(*shapes[0].numbers),
            Root(root[0, 0], root[0, 1], root[1, 1]),
            0,
            0,
            0,
        )
        rows = rows_of(
            record,
            len(shapes),
            shape=np.array([shape.numbers for shape in shapes]),
            kind=np.array([shape.surface.numbers.kind for shape in shapes]),
            size=np.array([shape.surface.numbers.size for shape in shapes]),
            data=np.array([place_of(each) for each in data]),
        )
        natural = self.law.largest_deflection * np.array([1.0, 1.0, radius or 1.0])
        size, kept = published_contact.LINEAR, tuple(data)
        return PackedModel(
            published_contact.FUNCTIONS, rows, 3, size, natural, radius, kept, velocity_scale=_VELOCITY_SCALE
        )

    # ------------------------------------------------------------------ axes of the friction metric

    @functools.cached_property
    def _axes(self) -> np.ndarray | None:
        """`axes_of` the friction metric, or None."""
        return None if self.patch.root is None else axes_of(self.patch.root)

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

    # ------------------------------------------------------------------ one shape

    @functools.cached_property
    def _reference(self) -> PublishedShape:
        surface = self.surface
        second_moment = float(self.patch.second_moment(surface.normal_force))
        return PublishedShape(self._centre(surface), surface.contact_radius, second_moment, surface, self._root)

    def _shape_at(self, normal_force: float) -> PublishedShape:
        if is_point(self.patch, normal_force):
            centre = self.patch.lever_coordinates(*self.patch.centre_of_pressure(normal_force))
            return PublishedShape(np.array(centre), 0.0, 0.0, _OfPoint(), self._root)  # pyright: ignore
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

    def _record(self, shape: PublishedShape) -> PackedModel:
        if self._axes is None:
            return super()._record(shape)
        return self._records([shape._replace(root=np.eye(2))], shape.contact_radius)

    def _step(self, shape: PublishedShape, state, twist, load, dt) -> np.ndarray:
        if shape.contact_radius > 0.0:
            return super()._step(shape, state, twist, load, dt)
        lever = self._levers(shape)[0]
        out = super()._step(_SLIDER, state * _SLIDES, twist @ lever.T * _SLIDES, load, dt)
        out[:, 2] = state[:, 2]
        out[:, 3:] = out[:, 3:] @ lever
        return out

    def _step_jacobians(self, shape: PublishedShape, state, twist, load, dt) -> np.ndarray:
        if shape.contact_radius > 0.0:
            return super()._step_jacobians(shape, state, twist, load, dt)
        lever = self._levers(shape)[0]
        slopes = super()._step_jacobians(_SLIDER, state * _SLIDES, twist @ lever.T * _SLIDES, load, dt).copy()
        slopes[:, [2, 5]], slopes[:, :, [2, 5]], slopes[:, 2, 2] = 0.0, 0.0, 1.0
        slopes[:, :, 3:6] = slopes[:, :, 3:6] @ lever
        slopes[:, 3:] = lever.T @ slopes[:, 3:]
        return slopes

    @property
    def depends_on_load(self) -> bool:
        return self.patch.depends_on_load and self.on_load_change != "keep"

    def _maps(self, shape: PublishedShape) -> tuple[np.ndarray, np.ndarray]:
        kind, size, data = shape.surface.numbers
        return np.array([kind, 0, size]), data

    def _levers(self, shape: PublishedShape) -> tuple[np.ndarray, np.ndarray]:
        x, y = shape.centre_of_pressure
        to_centre = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
        return to_centre, np.diag([1.0, 1.0, shape.second_moment]) @ to_centre

    def _rate_slopes(self, shape: PublishedShape, lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        scale, lever = np.array([1.0, 1.0, shape.contact_radius]), self._levers(shape)[0]
        k, k_z, z, scaled = lin[:, 0], lin[:, 1:4], lin[:, 4:7], lin[:, 7:16].reshape(-1, 3, 3)
        rate_state = -k[:, None, None] * np.eye(3) - z[:, :, None] * k_z[:, None, :]
        per_scale = np.where(scale > 0.0, 1.0 / np.where(scale > 0.0, scale, 1.0), 0.0)
        return scale[:, None] * rate_state * per_scale, scale[:, None] * scaled * scale @ lever
