"""The motion that a grip makes of a scene, in a few frictions at once, how far it misses a goal, and the report."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.compiler import threads
from planarfriction._support.equality import ByValue
from planarfriction.derivatives import scene_sensitivities
from planarfriction.derivatives.scene_inputs import STATES
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import rotate
from planarfriction.scenes import Scene, Signal, SolverOptions, simulate
from planarfriction.scenes.body import pull_on
from planarfriction.scenes.contact import with_friction
from planarfriction.scenes.start import contact_map

TIGHT = 1e-5
"""Relative tolerance of the motions that are planned with [-]."""

LOOSE = 1e-4
"""Relative tolerance of derivatives and of motions to start from [-]."""

ANGLE = 3e-4
"""Unit of the residual of a goal that is an angle: 0.03 % of it, and 0.1 % of a
slide."""

SHIFT = 3e-3
"""Unit of the residual of a slide where the goal is an angle, in contact radii."""

SPEED = 1e-3
"""Unit of the residual of the speed at the end [m/s]."""

TURN = 1e-3
"""Unit of the residual of a turn where the goal is a slide [rad]."""

ROUGH = 0.08
"""Weight of a bend of the profile by the holding load [-]: it chooses among profiles that do the same."""


class Aim(NamedTuple):
    """A goal, and how far ends of motions miss it.

    An end is `[6]`: velocity `(vx, vy, omega)`, slide of the place under the grip (2), angle of the turn, [SI].
    """

    angle: float | None
    """Angle to turn by [rad], without slide; None where the goal is a slide."""
    slide: np.ndarray
    """Slide to make `[2]` [m], without turning; zeros where the goal is an angle."""
    radius: float
    """Contact radius [m]."""

    @property
    def end(self) -> np.ndarray:
        """Wanted end `[6]`."""
        return np.array([0.0, 0.0, 0.0, *self.slide, self.angle or 0.0])

    def progress(self, end: np.ndarray) -> float:
        """Return the share of the goal that is reached [-]."""
        return float(end @ self.end / (self.end @ self.end))

    def scales(self) -> np.ndarray:
        """Units of the speeds (3), the slide (2) and the angle, as `[6]`."""
        if self.angle is not None:
            slide = SHIFT * self.radius
            angle = ANGLE * abs(self.angle)
        else:
            slide = 1e-3 * np.hypot(*self.slide)
            angle = TURN
        return np.array([SPEED, SPEED, SPEED / self.radius, slide, slide, angle])

    def misses(self, end: np.ndarray) -> np.ndarray:
        """Return the misses `[6]`, each over what counts as one."""
        return (end - self.end) / self.scales()


class Grips:
    """The scene under different profiles of one contact's normal force, with the frictions of an ensemble.

    Members differ by a factor on mu_c and mu_s of all contacts. What they share is built once, and they run in threads.
    """

    def __init__(self, scene: Scene, contact: int, factors: Sequence[float]) -> None:
        self.scene = scene
        self.index = contact
        self.name = f"{scene.contacts[contact].name}.normal_force"
        for each in scene.contacts:
            law = each.model.law
            if not (hasattr(law, "mu_c") or hasattr(law, "mu_s")):
                raise InvalidValueError(
                    "law",
                    "have mu_c and mu_s to plan with uncertain friction",
                    type(law).__name__,
                )
        self._members = {
            factor: [with_friction(each, factor) for each in scene.contacts]
            for factor in factors
        }
        held = scene.start == "equilibrium"
        self.first = scene.contacts[contact].normal_force(0.0) if held else None
        """Normal force that holds the body at first [N]; None where it may be any."""
        self._simulated: list[int] = []  # of several threads
        self.jacobians = 0

    @property
    def simulations(self) -> int:
        """Number of simulations so far."""
        return sum(self._simulated)

    def scene_of(self, profile: Signal, factor: float = 1.0) -> Scene:
        """Return the scene with the profile in place."""
        contacts = list(self._members[factor])
        own = contacts[self.index]
        contacts[self.index] = dataclasses.replace(own, normal_force=profile)
        return dataclasses.replace(self.scene, contacts=contacts)

    def ends(
        self, profile: Signal, factors: Sequence[float], rtol: float | None = TIGHT
    ) -> list[np.ndarray]:
        """Return the end `[6]` of the motion under each friction."""
        self._simulated.append(len(factors))

        def one(factor: float) -> np.ndarray:
            scene = self.scene_of(profile, factor)
            histories = simulate(scene, rtol=rtol, save_every=scene.t_end).histories
            last = np.array([histories[name].values[-1] for name in STATES])
            slide = slide_of(scene, self.index, last[3:])
            return np.array([*last[:3], *slide, last[5] - scene.body.angle])

        return threads.each(one, factors)

    def slopes(self, profile: Signal, factors: Sequence[float]) -> list[np.ndarray]:
        """Return the derivatives of the end by the knots `[6, K]` under each friction."""
        self.jacobians += len(factors)

        def one(factor: float) -> np.ndarray:
            scene = self.scene_of(profile, factor)
            knots = {self.name: profile.times}
            options = SolverOptions(rtol=LOOSE, save_every=scene.t_end)
            found = scene_sensitivities(scene, (), signals=knots, options=options)
            slopes = found.d_motion[-1].copy()
            pose = found.motion[-1, 3:]
            place = grip_position(scene, self.index) - pose[:2]
            x, y = slide_of(scene, self.index, pose) + place
            slopes[3:5] += np.outer([-y, x], slopes[5])
            return slopes

        return threads.each(one, factors)


def grip_position(scene: Scene, contact: int) -> np.ndarray:
    """Return the initial position of the contact frame's origin in the world `[2]` [m]."""
    body = scene.body
    chosen = scene.contacts[contact]
    if chosen.mounted_on == "world":
        return np.array(chosen.position)
    return body.position + rotate(chosen.position, body.angle)


def slide_of(scene: Scene, contact: int, pose: np.ndarray) -> np.ndarray:
    """Return the displacement `[..., 2]` [m] of the place that was under a contact, at poses `[..., 3]`."""
    grip = grip_position(scene, contact)
    arm = rotate(grip - scene.body.position, pose[..., 2] - scene.body.angle)
    return pose[..., :2] + arm - grip


def load_on(
    scene: Scene, contact: int, angle: float, slide: Any, time: float
) -> np.ndarray:
    """Return the load of gravity, applied force and springs on one contact `[3]` [N, N, N m] once the body has moved.

    By `angle` [rad] about the grip and by `slide` `[2]` [m]; about the origin of the contact frame, in its axes, of one
    of the identical contacts.
    """
    body = scene.body
    chosen = scene.contacts[contact]
    grip = grip_position(scene, contact)
    at = grip + slide + rotate(body.position - grip, angle)
    moved = dataclasses.replace(
        body, position=at, angle=body.angle + angle, velocity=(0.0, 0.0, 0.0)
    )
    there = dataclasses.replace(scene, body=moved, start="rest")
    pull = pull_on(scene, moved, time)
    return np.linalg.solve(contact_map(there, chosen).T, pull) / chosen.count


@dataclass(frozen=True, eq=False, repr=False)
class GripReport(ByValue):
    """Result of a plan with the scene's friction and with F other values, and the time that planning took."""

    goal: dict[str, Any]
    """The goal as given."""
    angle: float
    """Angle by which the body turns [rad]."""
    slide: np.ndarray
    """Displacement `[2]` of the point of the body under the grip, world axes [m]."""
    speed: float
    """Speed of that point at the end [m/s]."""
    grip: float
    """Normal force at the end [N]."""
    holding: float
    """Smallest normal force that would hold the body there [N]."""
    frictions: np.ndarray
    """Factors on mu_c and mu_s, ascending `[F]`."""
    angles: np.ndarray
    """Angle by which the body turns with each friction `[F]` [rad]."""
    slides: np.ndarray
    """Slide with each friction `[F, 2]` [m]."""
    per_percent: float
    """Change of the goal's quantity per percent of friction: angle [rad] or slide [m]."""
    simulations: int
    """Number of simulations."""
    jacobians: int
    """Number of Jacobians with respect to all knots."""
    wall_time: float
    """Computing time [s]."""

    @property
    def spread(self) -> float:
        """Largest error of the goal over all frictions: angle [rad] or slide [m]."""
        if "angle" in self.goal:
            return float(np.abs(self.angles - self.goal["angle"]).max())
        return float(np.hypot(*(self.slides - self.goal["slide"]).T).max())

    def __str__(self) -> str:
        if "angle" in self.goal:
            wanted = f"turn by {np.rad2deg(self.goal['angle']):.4g} degrees"
            per = f"{np.rad2deg(self.per_percent):.2g} degrees"
        else:
            x, y = 1e3 * np.array(self.goal["slide"])
            wanted = f"slide by ({x:.4g}, {y:.4g}) mm"
            per = f"{1e3 * self.per_percent:.2g} mm"
        lines = [
            f"Grip plan: {wanted}.",
            "",
            f"{'friction':>9}{'turn [deg]':>13}{'slide x [mm]':>15}{'slide y [mm]':>15}",
        ]
        both = zip(self.frictions, self.angles, self.slides, strict=True)
        for factor, angle, (x, y) in both:
            change = f"{100.0 * (factor - 1.0):+.3g} %" if factor != 1.0 else "nominal"
            lines.append(
                f"{change:>9}{np.rad2deg(angle):>13.3f}{1e3 * x:>15.3f}{1e3 * y:>15.3f}"
            )
        lines += [
            "",
            f"An error of one percent in friction changes the result by {per}.",
            f"The final grip is {self.grip:.3g} N, {self.grip / self.holding:.2f} times the holding force.",
            f"{self.simulations} simulations, {self.jacobians} Jacobians, {self.wall_time:.2g} s.",
        ]
        return "\n".join(lines)

    __repr__ = __str__


def report_of(
    aim: Any,
    frictions: Sequence[float],
    ends: Sequence[np.ndarray],
    grip: float,
    holding: float,
    cost: Any,
) -> GripReport:
    """Return the report on the ends `[6]` of a plan, one for each friction (see `motions.Aim`)."""
    less, end, more = (ends[frictions.index(each)] for each in (0.99, 1.0, 1.01))
    goal = {"angle": aim.angle}
    if aim.angle is None:
        goal = {"slide": tuple(aim.slide.tolist())}
    change = 0.5 * abs(aim.progress(more) - aim.progress(less))
    speed = float(np.linalg.norm(end[:3] * [1.0, 1.0, aim.radius]))
    per_percent = change * float(np.linalg.norm(aim.end))
    every = np.array(ends)
    of_nominal = goal, float(end[5]), end[3:5], speed, grip, holding
    return GripReport(
        *of_nominal, np.array(frictions), every[:, 5], every[:, 3:5], per_percent, *cost
    )
