"""A rigid body on friction patches, the simplest thing to step: one implicit step in each round of a loop."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Container, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import geometry
from planarfriction._engine.compiler.memory import places_of
from planarfriction._engine.compiler.threads import share
from planarfriction._engine.coupled.bodies import (
    ANGLE,
    CARRIED,
    DT,
    LOADS,
    MORE,
    WRENCH,
    step_bodies,
)
from planarfriction._engine.coupled.steps import PLAIN, REFUSED
from planarfriction._engine.records.packed import PackedModel
from planarfriction._engine.records.patches import PackedBody, packed_body
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Kept, by_parts, checked
from planarfriction.coupling import WORTH_A_THREAD, CoupledPatches
from planarfriction.errors import InvalidValueError, SolverError
from planarfriction.formulas import LARGEST
from planarfriction.models import FrictionModel


@by_parts
class BodyStep(NamedTuple):
    """End of a step of a body."""

    state: np.ndarray
    """State of the bristles of all patches `[..., states]`."""
    twist: np.ndarray
    """Twist of the centre of mass `[..., 3]` [m/s, m/s, rad/s]."""
    wrench: np.ndarray
    """Friction on the body about its centre of mass, of all patches, `[..., 3]` [N, N, N m]."""


@dataclass(frozen=True, eq=False)
class SlidingBody(ByValue):
    """A rigid body on k friction patches that is pushed and slides in their plane; the caller keeps state and twist.

    Body and friction meet in one implicit step, `M (V' - V)/dt = applied + W(V')`, which is stable at any `dt`, mass
    and stiffness. Loads, pushes and the pose are the caller's.

    Raises InvalidValueError for a mass or an inertia that is not > 0, models without compiled steps, and positions or
    angles that are not finite or not one for each patch.
    """

    mass: float = checked(validation.positive)
    """Mass [kg]."""
    inertia: float = checked(validation.positive)
    """Moment of inertia about the centre of mass [kg m^2]."""
    models: FrictionModel | Sequence[FrictionModel]  # pyright: ignore[reportGeneralTypeIssues]
    """Friction model, or a list with one for each patch."""
    positions: Kept[ArrayLike, np.ndarray] = (0.0, 0.0)  # pyright: ignore[reportAssignmentType]
    """Origins of the patches about the centre of mass, in body axes, `[k, 2]` [m]."""
    angles: Kept[ArrayLike, np.ndarray] = 0.0  # pyright: ignore[reportAssignmentType]
    """Angles of the patches' axes in body axes `[k]` [rad]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.models, FrictionModel):
            self._set(models=self.patches.models)
        k = len(self.patches.models)
        self._set(positions=validation.filled("positions", self.positions, (k, 2)))
        self._set(angles=validation.filled("angles", self.angles, (k,)))

    @functools.cached_property
    def patches(self) -> CoupledPatches:
        """Patches of the body; `patches.states(state)` has the bristles of each."""
        return CoupledPatches(
            [self.models] if isinstance(self.models, FrictionModel) else self.models
        )

    def rest(self, batch: int | Sequence[int] = ()) -> np.ndarray:
        """Return the state at rest, with relaxed bristles, or of a `batch` of bodies: `[*batch, states]`.

        Raises InvalidValueError unless `batch` is a count or counts.
        """
        return self.patches.rest(batch)

    def step(
        self,
        state: ArrayLike,
        twist: ArrayLike,
        normal_force: ArrayLike | None,
        dt: ArrayLike,
        wrench: ArrayLike = (0.0, 0.0, 0.0),
        angle: ArrayLike = 0.0,
        support_velocity: ArrayLike | None = None,
        *,
        loads: Any = None,
        cover: Any = None,
    ) -> BodyStep:
        """Advance by `dt` [s] under an applied `wrench` `[..., 3]` [N, N, N m]; stable at any `dt`.

        `V' = V + dt M^-1 (applied + W)`, where W is the friction at the end of the step, at V'. `normal_force` [N] is
        `[...]` for one model, `[..., k]` for a list of them. Twists and wrenches are those of the centre of mass, in
        world axes; the body's axes are at `angle` [rad], best half-way through the step. Leading axes broadcast.

        `support_velocity` `[..., 3]` is the twist of what the patches lie on, at the place of the centre of mass at the
        start of the step; None if it stands still. A body that is held keeps its place on it, at any spin, if the
        caller moves it by `dt V'`: patches slide relative to `geometry.chord(support_velocity, dt)`.

        `loads` and `cover` of the cells are those of `FrictionModel.step`, for a list of models a list of them, with
        None for patches whose pressure is their own. The `normal_force` of patches with loads is not read, and None if
        all have them.

        Raises InvalidValueError for shapes that do not fit, numbers that are not finite, and a load or time below zero;
        SolverError if a body did not converge (see `CoupledPatches.step`): its `step` has all bodies, those in
        `converged` with their result, the others with the best that was found.
        """
        if support_velocity is None and loads is None and cover is None:
            done = self._quick(state, twist, normal_force, dt, wrench, angle)
            if done is not None:
                return done
        if isinstance(self.models, FrictionModel):
            loads, cover = (None if each is None else [each] for each in (loads, cover))
        pressings = self.patches._pressings(loads, cover)
        load = self._loads(normal_force, pressings)
        batch, states, given = self._checked(
            state, twist, load, dt, wrench, angle, support_velocity, pressings
        )
        held = self.patches._press(states, given[:, LOADS:], batch, pressings)
        n = states.shape[-1]
        ends = self._ends(states, given, held).reshape(*batch, n + MORE)
        step = BodyStep(
            *(
                np.ascontiguousarray(ends[..., first:last])
                for first, last in ((0, n), (n, n + 3), (n + 3, n + 6))
            )
        )
        converged = ends[..., -1] > 0.0
        if not converged.all():
            count = f"{np.count_nonzero(~converged)} of {converged.size} bodies"
            most = f"off by {ends[..., -2].max():.1e} m/s at dt up to {given[:, DT].max():.3g} s"
            message = f"the step of a body did not converge ({count}, {most})"
            raise SolverError(message, step=step, converged=converged)
        return step

    def _quick(
        self, state: Any, twist: Any, load: Any, dt: Any, wrench: Any, angle: Any
    ) -> BodyStep | None:
        """Step one body by compiled code, which checks its numbers, or return None: for other inputs than plain ones,
        for those out of order, and where the step does not converge."""
        packed = self._packed
        twist = _items(twist)
        wrench = _items(wrench)
        load = (load,) if packed.alone else _items(load)
        given = *twist, *wrench, 0.0, 0.0, 0.0, dt, angle, *load
        if (
            not packed.fixed
            or type(state) is not np.ndarray
            or not len(twist) == len(wrench) == 3
            or not PLAIN.issuperset(map(type, given))
        ):
            return None
        n = packed.states
        end = np.empty(n + MORE)
        scratch = np.empty(packed.scratch)
        try:
            numbers = np.array(given, float)
            if (
                step_bodies(packed.words, state, numbers, packed.records, scratch, end)
                < 1
            ):
                return None
        except REFUSED:
            return None
        return BodyStep(end[:n], end[n : n + 3], end[n + 3 : n + 6])

    def _checked(
        self,
        state: ArrayLike,
        twist: ArrayLike,
        load: np.ndarray,
        dt: ArrayLike,
        wrench: ArrayLike,
        angle: ArrayLike,
        support_velocity: ArrayLike | None,
        pressings: dict[int, Pressing],
    ) -> tuple[tuple[int, ...], np.ndarray, np.ndarray]:
        """Check the inputs of a step; return their batch axes, and rows of states and of the rest for each body."""
        sizes = {"state": self._packed.states, "twist": 3, "wrench": 3}
        numbers = {
            "twist": twist,
            "wrench": wrench,
            "dt": dt,
            "angle": angle,
            "state": state,
        }
        if support_velocity is not None:
            sizes["support_velocity"] = 3
            numbers["support_velocity"] = support_velocity
        arrays = {
            name: validation.finite_numbers(name, value)
            for name, value in numbers.items()
        }
        axes = {
            name: validation.vectors(name, each, sizes[name])[..., 0]
            if name in sizes
            else each
            for name, each in arrays.items()
        }
        for p, pressing in pressings.items():
            axes[f"loads of patch {p}"] = pressing.load
        batch = validation.broadcast(**axes, normal_force=load[..., 0])
        if (axes["dt"] < 0.0).any():
            raise InvalidValueError("dt", "be >= 0", float(axes["dt"].min()))
        n = self._packed.states
        width = LOADS + load.shape[-1]
        count = math.prod(batch)
        most = validation.MOST_NUMBERS // (n + MORE + width)
        if count > most:
            rule = f"hold at most {most} of these bodies"
            raise InvalidValueError("batch axes", rule, list(batch))
        given = np.zeros((*batch, width))
        given[..., :WRENCH] = arrays["twist"]
        given[..., WRENCH:CARRIED] = arrays["wrench"]
        if support_velocity is not None:
            given[..., CARRIED:DT] = geometry.chord(
                arrays["support_velocity"], arrays["dt"]
            )
        given[..., DT] = arrays["dt"]
        given[..., ANGLE] = arrays["angle"]
        given[..., LOADS:] = load
        states = np.empty((*batch, n))
        states[:] = arrays["state"]
        return batch, states.reshape(count, n), given.reshape(count, width)

    def _ends(
        self, states: np.ndarray, given: np.ndarray, held: dict[int, PackedModel]
    ) -> np.ndarray:
        """Step bodies of checked inputs, on threads: the rows that `step_bodies` writes."""
        packed = self._packed
        count = len(given)
        records = np.tile(packed.records, (count, 1))
        for p, each in held.items():
            records[:, p] = places_of(each.records)
        kept = self.patches._write_following(records, given[:, LOADS:], held)
        ends = np.empty((count, packed.states + MORE))

        def work(first: int, last: int) -> None:
            rows = (each[first:last].ravel() for each in (states, given, records))
            scratch = np.empty(packed.scratch)
            done = step_bodies(packed.words, *rows, scratch, ends[first:last].ravel())
            if done < 0:
                rule = f"give twists of patches up to {LARGEST:g}"
                largest = f"dt up to {given[:, DT].max():g}"
                raise InvalidValueError("twist, wrench and dt", rule, largest)

        share(count, records.size // WORTH_A_THREAD, work)
        del kept
        return ends

    def largest_step(self, normal_force: ArrayLike) -> Any:
        """Return the time step [s] below which a loop around `step` of the models alone is stable, `[...]`.

        A loop that takes the wrench at the old twist, `V' = V + dt M^-1 (applied + W(V))`, lets a stuck body oscillate
        from `dt (c + sqrt(c^2 + 4 k))/4 = 1` on, k and c being the largest eigenvalues of `M^-1 K` and `M^-1 C`, of the
        bristles' stiffness and damping: for one patch that does not turn, `k = sigma_0 f_N/m` and `c = (sigma_1 +
        sigma_2) f_N/m`. Half of it leaves no oscillation to be seen. `normal_force` [N] as in `step`.

        Raises InvalidValueError for loads that are not finite or below zero, or not one for each patch.
        """
        load = self._loads(normal_force)
        damping = 0.0
        stiffness = 0.0
        for k, model in enumerate(self.patches.models):
            rows = self._to_patches[3 * k : 3 * k + 3] * np.sqrt(self._per_mass)
            still, one = (
                -model.step_jacobians(
                    model.rest(), np.zeros(3), load[..., k], dt
                ).wrench_twist
                for dt in (0.0, 1.0)
            )
            damping = damping + rows.T @ still @ rows
            stiffness = stiffness + rows.T @ (one - still) @ rows
        c, k = (np.linalg.eigvalsh(each)[..., -1] for each in (damping, stiffness))
        with np.errstate(divide="ignore"):
            return 4.0 / (c + np.sqrt(c * c + 4.0 * k))

    def _loads(
        self, normal_force: ArrayLike | None, given: Container[int] = ()
    ) -> np.ndarray:
        """Return the loads of the patches `[..., k]`; None for those whose loads are `given` otherwise."""
        count = len(self.patches.models)
        if normal_force is None and all(p in given for p in range(count)):
            return np.zeros(count)
        if 0 in given and isinstance(self.models, FrictionModel):
            rule = "be None if loads of cells are given"
            raise InvalidValueError("normal_force", rule, normal_force)
        load = validation.non_negative_numbers("normal_force", normal_force)
        if isinstance(self.models, FrictionModel):
            return load[..., None]
        if load.shape[-1:] != (len(self.models),):
            rule = f"have shape [..., {len(self.models)}]"
            raise InvalidValueError("normal_force", rule, f"shape {list(load.shape)}")
        return load

    @functools.cached_property
    def _packed(self) -> PackedBody:
        packed = self.patches._packed
        blank = self.patches._blank_problem([False] * len(packed.records))
        return packed_body(
            packed,
            blank,
            self._per_mass,
            self._to_patches,
            isinstance(self.models, FrictionModel),
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields for a copy or another process, without addresses, which hold in this process alone."""
        return {
            each.name: getattr(self, each.name) for each in dataclasses.fields(self)
        }

    @functools.cached_property
    def _per_mass(self) -> np.ndarray:
        return 1.0 / np.array([self.mass, self.mass, self.inertia])

    @functools.cached_property
    def _to_patches(self) -> np.ndarray:
        """Return the rows that give the twists of the patches from that of the body, in its axes, `[3k, 3]`."""
        rows = geometry.twist_at(np.eye(3)[:, None], self.positions)
        return geometry.rotate(rows, -self.angles).transpose(1, 2, 0).reshape(-1, 3)


def _items(value: Any) -> Sequence[Any]:
    """Return the items of a list, a tuple or a vector, none of anything else."""
    if type(value) is np.ndarray:
        return value.tolist() if value.ndim == 1 else ()
    return value if type(value) in (tuple, list) else ()
