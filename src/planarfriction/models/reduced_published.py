"""The reduced model as published: three bristles and a limit surface."""

from __future__ import annotations

import functools
import threading
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from planarfriction._engine.published.published_contact import slopes_in
from planarfriction._engine.published.surfaces import ELLIPSOID
from planarfriction._engine.records.published import CompiledPublished
from planarfriction._support import validation
from planarfriction._support.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.laws import FrictionLaw
from planarfriction.laws.base import refuse_rate_law
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.limit_surface.base import SurfaceNumbers
from planarfriction.models.base import FrictionModel, ModelJacobians
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_cell_metrics, same_metric

REMEMBERED = 64
"""Number of loads whose shapes are remembered."""

POINT = 1e-6
"""Share of the load beside its heaviest cell up to which a contact is a point, without torque about it."""


def is_point(patch: ContactPatch, normal_force: float) -> bool:
    """Return True if one cell carries the load but for a share `POINT` of it."""
    return bool(1.0 - patch.weights(normal_force).max() <= POINT)


class _OfPoint(NamedTuple):
    """Stand-in for the limit surface of a point: `u = V_S`, and V_S has no third component."""

    numbers: SurfaceNumbers = SurfaceNumbers(ELLIPSOID, 0, np.zeros(0))


@by_parts
class PublishedShape(NamedTuple):
    """A patch at one load, as `ReducedModelPublished` knows it."""

    centre_of_pressure: np.ndarray
    """Centre of pressure `[2]` [m]; of a patch with a friction metric its `lever_coordinates`."""
    contact_radius: float
    """Contact radius r [m]; of the published table as published; 0 of a point."""
    second_moment: float
    """Second moment <rho^2> [m^2]."""
    surface: LimitSurface
    """Limit surface; at a point, a stand-in."""
    root: np.ndarray = np.eye(2)
    """Symmetric root of the friction metric, [2, 2] [-]."""

    @property
    def numbers(self) -> np.ndarray:
        """Numbers of the shape in the order of compiled loops."""
        return np.array(
            [*self.centre_of_pressure, self.contact_radius, self.second_moment]
        )

    @property
    def axes(self) -> np.ndarray:
        """`axes_of` the friction metric."""
        return axes_of(self.root)

    @property
    def lever(self) -> np.ndarray:
        """Map `[3, 3]` of twists about the origin to those at the centre of pressure, in the axes of the metric."""
        x, y = self.centre_of_pressure
        return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]]) @ self.axes

    @property
    def place(self) -> np.ndarray:
        """Centre of pressure in the contact frame, whatever the friction metric, `[2]` [m]."""
        y, x = np.linalg.solve(self.root, self.lever[:2, 2])
        return np.array([x, -y])

    def rate_slopes(self, lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return d rate / d state and d rate / d twist `[B, 3, 3]` from linearisations `[B, L]`."""
        scale = np.array([1.0, 1.0, self.contact_radius])
        rate_state, scaled = slopes_in(lin)
        per_scale = np.where(scale > 0.0, 1.0 / np.where(scale > 0.0, scale, 1.0), 0.0)
        return scale[:, None] * rate_state * per_scale, scale[
            :, None
        ] * scaled * scale @ self.lever


def axes_of(root: np.ndarray) -> np.ndarray:
    """Return `diag(L, 1)` `[3, 3]` of the root L of a friction metric: twists go in through it, wrenches come out."""
    axes = np.eye(3)
    axes[:2, :2] = root
    return axes


class PublishedShapes:
    """Shapes of a patch at any load, updated as `on_load_change` says (see `ReducedModelPublished`)."""

    def __init__(
        self, surface: LimitSurface, patch: ContactPatch, on_load_change: str
    ) -> None:
        self._arguments = self._surface, self._patch, _ = surface, patch, on_load_change
        self.depends_on_load = patch.depends_on_load and on_load_change != "keep"
        self._rescales = on_load_change == "rescale"
        self._recent = functools.lru_cache(REMEMBERED)(self._built)
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[Any, ...]:
        # Threads share recent shapes, copies of a model do not.
        return (
            PublishedShapes,
            self._arguments,
        )

    def shape_at(self, load: float | None) -> PublishedShape:
        """Return the shape at a load > 0 [N]; recent loads are cached. None: any load, if it does not change it."""
        if load is None or not self.depends_on_load:
            return self.reference
        # Threads that ask for one load at once wait for the same shape.
        with self._lock:
            return self._recent(load)

    @functools.cached_property
    def reference(self) -> PublishedShape:
        """Shape at the load of the limit surface."""
        surface = self._surface
        second_moment = float(self._patch.second_moment(surface.normal_force))
        return PublishedShape(
            self._centre(surface),
            surface.contact_radius,
            second_moment,
            surface,
            self._root,
        )

    def _built(self, load: float) -> PublishedShape:
        if is_point(self._patch, load):
            centre = self._patch.lever_coordinates(
                *self._patch.centre_of_pressure(load)
            )
            return PublishedShape(np.array(centre), 0.0, 0.0, _OfPoint(), self._root)  # pyright: ignore
        surface = self._surface.at(load)
        centre = self._centre(surface)
        radius = surface.contact_radius
        if self._rescales:
            return self.reference._replace(
                centre_of_pressure=centre, contact_radius=radius
            )
        return PublishedShape(
            centre, radius, float(self._patch.second_moment(load)), surface, self._root
        )

    def _centre(self, surface: LimitSurface) -> np.ndarray:
        return np.array(self._patch.lever_coordinates(*surface.centre_of_pressure))

    @property
    def _root(self) -> np.ndarray:
        return np.eye(2) if self._patch.root is None else self._patch.root


ON_LOAD_CHANGE = ("rebuild", "rescale", "keep")
"""Choices of `ReducedModelPublished.on_load_change`."""


@dataclass(frozen=True, eq=False)
class ReducedModelPublished(FrictionModel):
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

    state_units = "m, m, m^2"

    surface: LimitSurface = None  # pyright: ignore[reportAssignmentType]
    """Limit surface; None uses the published table of the patch."""
    on_load_change: str = "rebuild"
    """Update of the shape when the load changes: "rebuild", "rescale" or "keep"."""

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_rate_law(self.law, "ReducedModelPublished")
        validation.choice("on_load_change", self.on_load_change, ON_LOAD_CHANGE)
        if self.surface is None:
            self._set(surface=LimitSurfaceTablePublished(self.patch))
        if not isinstance(self.surface, LimitSurface):
            raise InvalidValueError("surface", "be a limit surface", self.surface)
        by = type(self).__name__
        refuse_cell_metrics(self.patch, by)
        for patch in (self.patch, self.surface.patch):
            if patch.asymmetric:
                raise InvalidValueError(
                    "patch",
                    f"have the same friction forwards and backwards for {by}",
                    "asymmetry",
                )
        if not same_metric(self.patch, self.surface.patch):
            raise InvalidValueError(
                "surface",
                "have the friction metric of the patch",
                self.surface.patch.name,
            )
        if (
            self.patch.depends_on_load
            and self.on_load_change != "rebuild"
            and self.surface.normal_force is None
        ):
            rule = f"have a normal_force when on_load_change={self.on_load_change!r}"
            raise InvalidValueError("surface", rule, "none")

    def shape_at(self, normal_force: float) -> PublishedShape:
        """Return centre of pressure, `r`, `<rho^2>` and limit surface at a load [N]; recent loads are cached.

        Raises InvalidValueError for a load that is not > 0.
        """
        load = (
            validation.positive_load("normal_force", normal_force)
            if self.depends_on_load
            else normal_force
        )
        return self.shapes.shape_at(load)

    @property
    def depends_on_load(self) -> bool:
        return self.patch.depends_on_load and self.on_load_change != "keep"

    @functools.cached_property
    def shapes(self) -> PublishedShapes:
        """Shapes of the patch at any load."""
        return PublishedShapes(self.surface, self.patch, self.on_load_change)

    @functools.cached_property
    def compiled(self) -> CompiledPublished:
        """Machine form of the model (see `FrictionModel.compiled`)."""
        return CompiledPublished(self.law, self.shapes)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3,)`"""
        return (3,)

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Return the analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); one-sided at kinks.

        With the rate f, G the map to the centre of pressure and `W = -G' (sigma_0 z + sigma_1 f + sigma_2 H V)`:
        `dW/dz = -G' (sigma_0 + sigma_1 df/dz)`, `dW/dV = -G' (sigma_1 df/dV + sigma_2 H)`.

        Raises InvalidValueError as `step` does.
        """
        state, twist, load, _ = self._inputs(state, twist, normal_force)
        law = self.law.numbers
        count = load.size
        z = state.reshape(count, 3)
        v = twist.reshape(count, 3)
        f = load.reshape(count)
        rate_state, rate_twist, wrench_state, wrench_twist = np.zeros((4, count, 3, 3))
        for rows, shape in self.compiled.shape_at_each_load(load):
            by_z, by_v = shape.rate_slopes(
                self.compiled.linearisation(shape, z[rows], v[rows])
            )
            rate_state[rows] = by_z
            rate_twist[rows] = by_v
            pull = law.sigma_0 * np.eye(3) + law.sigma_1 * by_z
            viscous = np.diag([1.0, 1.0, shape.second_moment]) @ shape.lever
            push = law.sigma_1 * by_v + law.sigma_2 * viscous
            lever = shape.lever.T
            weight = -f[rows][:, None, None]
            wrench_state[rows] = weight * (lever @ pull)
            wrench_twist[rows] = weight * (lever @ push)
        blocks = (
            each.reshape(*load.shape, 3, 3)
            for each in (rate_state, rate_twist, wrench_state, wrench_twist)
        )
        by_state, by_twist, pull, push = blocks
        by_load = self.compiled.evaluate(state, twist, load)[1]
        return ModelJacobians(
            by_state, by_twist, np.zeros_like(state), pull, push, by_load
        )

    def with_law(self, law: FrictionLaw) -> Self:
        changed = super().with_law(law)
        changed.__dict__["shapes"] = self.shapes
        return changed

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        pulls = (
            -self.law.numbers.sigma_0 * load * self.patch.weights(load) * deflections
        )
        wrench = np.einsum("nij,in->j", self.patch.levers(), pulls)
        per_state = self.jacobians(self.rest(), np.zeros(3), load).wrench_state
        return np.linalg.lstsq(per_state, wrench, rcond=1e-12)[0]
