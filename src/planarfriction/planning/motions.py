"""The motion that a grip makes of a scene, in a few frictions at once, and how far it misses a goal."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from planarfriction.derivatives import scene_sensitivities
from planarfriction.errors import InvalidValueError
from planarfriction.scenes import Contact, Scene, Signal, SolverOptions, simulate
from planarfriction.scenes.start import contact_map

MOTION = ("vx", "vy", "omega", "x", "y", "theta")
"""Velocity and pose at the end, in this order."""

TIGHT = 1e-6
"""Relative tolerance of the motions that are planned with [-]."""

ANGLE, SHIFT, SPEED, TURN = 3e-4, 3e-3, 1e-3, 1e-3
"""Units of the residuals in the sum of squares: of the goal 0.03 % of an angle and 0.1 % of a slide; of the contact
radius 0.3 % of slide where the goal is an angle; 1 mm/s at the end; a turn of 1 mrad where the goal is a slide."""

ROUGH = 0.08
"""Weight of a bend of the profile by the holding load [-]: it chooses among profiles that do the same."""


class Outcome(NamedTuple):
    """End of a motion."""

    speed: np.ndarray
    """Velocity `(vx, vy, omega)` [m/s, m/s, rad/s]."""
    slide: np.ndarray
    """Displacement of the place under the grip from it `[2]`, world axes [m]."""
    angle: float
    """Angle by which the body has turned [rad]."""


class Aim(NamedTuple):
    """A goal as a vector of misses."""

    angle: float | None
    """Angle to turn by [rad], without slide; None where the goal is a slide."""
    slide: np.ndarray
    """Slide to make `[2]` [m], without turning; zeros where the goal is an angle."""
    radius: float
    """Contact radius [m]."""

    def progress(self, outcome: Outcome) -> float:
        """Return the share of the goal that is reached [-]."""
        if self.angle is not None:
            return outcome.angle / self.angle
        return float(outcome.slide @ self.slide / (self.slide @ self.slide))

    def scales(self) -> np.ndarray:
        """Units of the speeds (3), the slide (2) and the angle, as `[6]`."""
        if self.angle is not None:
            slide, angle = SHIFT * self.radius, ANGLE * abs(self.angle)
        else:
            slide, angle = 1e-3 * float(np.hypot(*self.slide)), TURN
        return np.array([SPEED, SPEED, SPEED / self.radius, slide, slide, angle])

    def misses(self, outcome: Outcome) -> np.ndarray:
        """Return the misses `[6]`, each over what counts as one."""
        off = np.concatenate([outcome.speed, outcome.slide - self.slide, [outcome.angle - (self.angle or 0.0)]])
        return off / self.scales()


class Grips:
    """The scene under different profiles of one contact's normal force, with the frictions of an ensemble.

    Members differ by a factor on mu_c and mu_s of all contacts. What they share is built once, and they run in threads.
    """

    def __init__(self, scene: Scene, contact: int, factors: Sequence[float]) -> None:
        self.scene, self.index = scene, contact
        self.name = f"{scene.contacts[contact].name}.normal_force"
        self._members = {factor: [with_friction(each, factor) for each in scene.contacts] for factor in factors}
        held = scene.start == "equilibrium"
        self.first = float(scene.contacts[contact].normal_force(0.0)) if held else None
        """Normal force that holds the body at first [N]; None where it may be any."""
        self.simulations = self.jacobians = 0

    def scene_of(self, profile: Signal, factor: float = 1.0) -> Scene:
        """Return the scene with the profile in place."""
        contacts = list(self._members[factor])
        contacts[self.index] = dataclasses.replace(contacts[self.index], normal_force=profile)
        return dataclasses.replace(self.scene, contacts=contacts)

    def outcomes(self, profile: Signal, factors: Sequence[float], rtol: float | None = TIGHT) -> list[Outcome]:
        """Return the end of the motion under each friction."""
        self.simulations += len(factors)

        def one(factor: float) -> Outcome:
            scene = self.scene_of(profile, factor)
            histories = simulate(scene, rtol=rtol, save_every=scene.t_end).histories
            return self.outcome(np.array([float(np.asarray(histories[name].values)[-1]) for name in MOTION]))

        return _each(one, factors)

    def slopes(self, profile: Signal, factors: Sequence[float]) -> list[np.ndarray]:
        """Return the derivatives of speeds, slide and angle by the knots `[6, K]` under each friction."""
        self.jacobians += len(factors)

        def one(factor: float) -> np.ndarray:
            scene, knots = self.scene_of(profile, factor), {self.name: profile.times}
            options = SolverOptions(rtol=TIGHT, save_every=scene.t_end)
            found = scene_sensitivities(scene, (), signals=knots, options=options)
            slopes = found.d_motion[-1].copy()
            x, y = self._arm(found.motion[-1, 3:])
            slopes[3:5] += np.outer([-y, x], slopes[5])
            return slopes

        return _each(one, factors)

    def _arm(self, pose: np.ndarray) -> np.ndarray:
        """Return the vector from the centre of mass to the place that was under the grip `[2]` [m]."""
        return slide_of(self.scene, self.index, pose) + grip_position(self.scene, self.index) - pose[:2]

    def outcome(self, motion: np.ndarray) -> Outcome:
        """Return the outcome of a motion from its end `[6]`."""
        slide = slide_of(self.scene, self.index, motion[3:])
        return Outcome(motion[:3], slide, float(motion[5] - self.scene.body.angle))


def _each(one: Any, factors: Sequence[float]) -> list[Any]:
    """Call `one` for every factor, in threads: compiled runs let others run beside them."""
    if len(factors) == 1:
        return [one(factors[0])]
    with ThreadPoolExecutor(min(len(factors), os.cpu_count() or 1)) as pool:
        return list(pool.map(one, factors))


def with_friction(contact: Contact, factor: float) -> Contact:
    """Return the contact with `factor` times the friction: mu_c and mu_s of its law."""
    if factor == 1.0:
        return contact
    law = contact.model.law
    scaled = {name: factor * getattr(law, name) for name in ("mu_c", "mu_s") if hasattr(law, name)}
    if not scaled:
        rule = "have mu_c and mu_s to plan with uncertain friction"
        raise InvalidValueError("law", rule, type(law).__name__)
    law, model = dataclasses.replace(law, **scaled), contact.model
    changed = model.with_law(law) if hasattr(model, "with_law") else dataclasses.replace(model, law=law)
    return dataclasses.replace(contact, model=changed)


def grip_position(scene: Scene, contact: int) -> np.ndarray:
    """Return the initial position of the contact frame's origin in the world `[2]` [m]."""
    body, chosen = scene.body, scene.contacts[contact]
    if chosen.mounted_on == "world":
        return np.array(chosen.position)
    cos, sin = np.cos(body.angle), np.sin(body.angle)
    x, y = chosen.position
    return body.position + np.array([cos * x - sin * y, sin * x + cos * y])


def slide_of(scene: Scene, contact: int, pose: np.ndarray) -> np.ndarray:
    """Return the displacement in the world of the place that was under a contact `[..., 2]` [m], at poses
    `[..., 3]`."""
    grip = grip_position(scene, contact)
    (dx, dy), turn = grip - scene.body.position, pose[..., 2] - scene.body.angle
    cos, sin = np.cos(turn), np.sin(turn)
    return pose[..., :2] + np.stack([cos * dx - sin * dy, sin * dx + cos * dy], axis=-1) - grip


def load_on(scene: Scene, contact: int, angle: float, slide: Any, time: float) -> np.ndarray:
    """Return the load of gravity and applied force on one contact `[3]` [N, N, N m] once the body has moved.

    By `angle` [rad] about the grip and by `slide` `[2]` [m]; about the origin of the contact frame, in its axes, of one
    of the identical contacts.
    """
    body, chosen = scene.body, scene.contacts[contact]
    grip = grip_position(scene, contact)
    arm = np.array(body.position) - grip
    cos, sin = np.cos(angle), np.sin(angle)
    at = grip + slide + np.array([cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1]])
    moved = dataclasses.replace(body, position=at, angle=body.angle + angle, velocity=(0.0, 0.0, 0.0))
    applied = np.zeros(3) if scene.force is None else scene.force(time)
    pull = applied + body.mass * np.array([*body.gravity, 0.0])
    there = dataclasses.replace(scene, body=moved, start="rest")
    return np.linalg.solve(contact_map(there, chosen).T, pull) / chosen.count
