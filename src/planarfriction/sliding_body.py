"""A rigid body on friction patches, the simplest thing to step: one implicit step in each round of a loop."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import geometry
from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Kept, by_parts, checked
from planarfriction.coupling import CoupledPatches, HostStep
from planarfriction.errors import InvalidValueError, SolverError
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
        normal_force: ArrayLike,
        dt: ArrayLike,
        wrench: ArrayLike = (0.0, 0.0, 0.0),
        angle: ArrayLike = 0.0,
        support_velocity: ArrayLike | None = None,
    ) -> BodyStep:
        """Advance by `dt` [s] under an applied `wrench` `[..., 3]` [N, N, N m]; stable at any `dt`.

        `V' = V + dt M^-1 (applied + W)`, where W is the friction at the end of the step, at V'. `normal_force` [N] is
        `[...]` for one model, `[..., k]` for a list of them. Twists and wrenches are those of the centre of mass, in
        world axes; the body's axes are at `angle` [rad], best half-way through the step. Leading axes broadcast.

        `support_velocity` `[..., 3]` is the twist of what the patches lie on, at the place of the centre of mass at the
        start of the step; None if it stands still. A body that is held keeps its place on it, at any spin, if the
        caller moves it by `dt V'`: patches slide relative to `geometry.chord(support_velocity, dt)`.

        Raises InvalidValueError for shapes that do not fit, numbers that are not finite, and a load or time below zero;
        SolverError if a body did not converge (see `CoupledPatches.step`): its `step` has all bodies, those in
        `converged` with their result, the others with the best that was found.
        """
        given = {"twist": twist, "wrench": wrench, "dt": dt, "angle": angle}
        twist, wrench, dt, angle = (
            validation.finite_numbers(name, value) for name, value in given.items()
        )
        twist = validation.vectors("twist", twist, 3)
        wrench = validation.vectors("wrench", wrench, 3)
        load = self._loads(normal_force)
        batches = {
            "twist": twist[..., 0],
            "wrench": wrench[..., 0],
            "dt": dt,
            "angle": angle,
        }
        carried = 0.0
        if support_velocity is not None:
            support = validation.finite_numbers("support_velocity", support_velocity)
            support = validation.vectors("support_velocity", support, 3)
            batches["support_velocity"] = support[..., 0]
            carried = geometry.chord(support, dt)
        validation.broadcast(**batches, normal_force=load[..., 0])
        to_patches = (
            geometry.rotate(self._to_patches, angle[..., None])
            if angle.any()
            else self._to_patches
        )
        response = dt[..., None] * self._per_mass
        pushed = twist - carried + response * wrench
        free = np.einsum("...ij,...j->...i", to_patches, pushed)
        free = free.reshape(*free.shape[:-1], len(self.patches.models), 3)
        coupled = np.einsum("...im,...m,...jm->...ij", to_patches, response, to_patches)
        end = self.patches.step(
            state, HostStep(free, load, np.zeros(free.shape[-2:]), coupled), dt
        )
        friction = np.einsum(
            "...i,...im->...m",
            end.wrench.reshape(*end.wrench.shape[:-2], len(self._to_patches)),
            to_patches,
        )
        step = BodyStep(end.state, pushed + response * friction + carried, friction)
        if not end.converged.all():
            count = f"{np.count_nonzero(~end.converged)} of {end.converged.size} bodies"
            most = f"off by {end.residual.max():.1e} m/s at dt up to {dt.max():.3g} s"
            message = f"the step of a body did not converge ({count}, {most})"
            raise SolverError(message, step=step, converged=end.converged)
        return step

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

    def _loads(self, normal_force: ArrayLike) -> np.ndarray:
        """Return the loads of the patches `[..., k]`."""
        load = validation.non_negative_numbers("normal_force", normal_force)
        if isinstance(self.models, FrictionModel):
            return load[..., None]
        if load.shape[-1:] != (len(self.models),):
            rule = f"have shape [..., {len(self.models)}]"
            raise InvalidValueError("normal_force", rule, f"shape {list(load.shape)}")
        return load

    @functools.cached_property
    def _per_mass(self) -> np.ndarray:
        return 1.0 / np.array([self.mass, self.mass, self.inertia])

    @functools.cached_property
    def _to_patches(self) -> np.ndarray:
        """Return the rows that give the twists of the patches from that of the body, in its axes, `[3k, 3]`."""
        rows = geometry.twist_at(np.eye(3)[:, None], self.positions)
        return geometry.rotate(rows, -self.angles).transpose(1, 2, 0).reshape(-1, 3)
