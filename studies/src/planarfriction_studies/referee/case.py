"""Cases: bodies, contacts, forces and truths, read from one TOML file each.

The contact planes of all cases are normal to z. For the settling time, gravity and forces act along z alone, with their
values of time 0; then bodies take their velocities, and displacements count from there.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planarfriction._support.reading import read_text
from planarfriction.errors import FileError

FOLDER = Path(__file__).parent / "cases"

QUANTITIES = {
    "x": "m", "y": "m", "turn": "rad", "moved": "m", "drift": "m/s", "slips": "s", "turns": "s",
}  # fmt: skip
"""Quantities and their units: displacement at the end; turn about z; largest displacement; mean speed in the second
half; first time of a displacement, and of a turn, above `threshold`, which is the duration if there is none."""

Vector = Sequence[float]


@dataclass(frozen=True)
class Shape:
    """Shape of a body that touches others, with its middle at `position` in the body."""

    name: str
    kind: str
    """plane, box, sphere, cylinder, or capsule."""
    size: Vector = ()
    """Sides of a box, radius of a sphere, or radius and length of a cylinder or a capsule between its ends [m]."""
    position: Vector = (0.0, 0.0, 0.0)
    """[m]"""
    axis: Vector = (0.0, 0.0, 1.0)
    """Axis of a cylinder or a capsule, x or z."""

    @property
    def half(self) -> np.ndarray:
        """Half of the sides of the box about the shape [m]."""
        if self.kind == "box":
            return 0.5 * np.array(self.size)
        radius, length = (*self.size, 0.0)[:2]
        along = np.array(self.axis)
        return (
            radius * (1.0 - along)
            + (0.5 * length + (radius if self.kind != "cylinder" else 0.0)) * along
        )


@dataclass(frozen=True)
class Body:
    """Body, at rest at first, with its axes along those of the world."""

    name: str
    shapes: Sequence[Shape]
    position: Vector = (0.0, 0.0, 0.0)
    """[m]"""
    joint: str = "free"
    """free, slide (along z), or fixed."""
    mass: float = 0.0
    """[kg]"""
    inertia: Vector = ()
    """Principal moments about the centre of mass [kg m^2]; none: of a homogeneous box about its one shape."""
    centre_of_mass: Vector = (0.0, 0.0, 0.0)
    """Place in the body [m]."""
    velocity: Vector = (0.0,) * 6
    """Velocity of the centre of mass and angular velocity after the settling time [m/s, rad/s]."""
    tilt: float = 0.0
    """Angle by which gravity on this body is turned towards x after the settling time [rad]: its own incline."""

    @property
    def moments(self) -> np.ndarray:
        """Principal moments of inertia [kg m^2]."""
        if len(self.inertia):
            return np.array(self.inertia)
        squares = np.square(2.0 * self.shapes[0].half)
        return self.mass / 12.0 * (squares.sum() - squares)


@dataclass(frozen=True)
class Contact:
    """Contact of two shapes; the second is on the body that has the patch."""

    pair: tuple[str, str]
    mu: Vector
    """Coulomb's coefficients along x and y of the second body [-]."""
    patch: Vector
    """Sides of a rectangle, or the radius of a disc [m]; its pressure is uniform, or linear with its load's moments."""
    at: Vector = (0.0, 0.0, 0.0)
    """Middle of the patch in the second body [m]."""
    mu_s: float | None = None
    """Coefficient at small speed, in `mu_c + (mu_s - mu_c) exp(-(v/v_s)^2)` [-]."""
    v_s: float = 1e-3
    """[m/s]"""


@dataclass(frozen=True)
class Force:
    """Force and torque on a body in the axes of the world, at a point of the body; linear between `times`."""

    body: str
    values: Sequence[Vector]
    """Rows [N, N, N, N m, N m, N m]; the last one holds on."""
    times: Vector = (0.0,)
    """[s]"""
    at: Vector | None = None
    """Point in the body [m]; none: its centre of mass."""
    amplitude: Vector = (0.0,) * 6
    """Amplitude of a sine wave that is added [N, N m]."""
    frequency: float = 0.0
    """[Hz]"""
    phase: float = 0.0
    """[rad]"""

    def value(self, t: float) -> np.ndarray:
        """Return force and torque at a time [s]."""
        linear = [
            np.interp(t, self.times, column) for column in np.array(self.values).T
        ]
        return np.array(linear) + math.sin(
            2.0 * math.pi * self.frequency * t + self.phase
        ) * np.array(self.amplitude)


@dataclass(frozen=True)
class Truth:
    """True value of one quantity of a body."""

    body: str
    quantity: str
    value: float
    allowed: float
    """Largest error that passes, in the unit of the quantity."""
    source: str = "held"
    """Function of `truths` that gives the value."""
    given: Mapping[str, Any] = field(default_factory=dict)
    """Its arguments."""
    error: float = 0.0
    """Largest error of the value itself."""
    threshold: float = 0.0
    """[m] or [rad]"""


class Path3(NamedTuple):
    """Path of the bodies that move: `times [n]`, `positions [n, bodies, 3]`, `turns [n, bodies]` about z [rad]."""

    times: np.ndarray
    positions: np.ndarray
    turns: np.ndarray


@dataclass(frozen=True)
class Case:
    """A case of the referee."""

    name: str
    title: str
    about: str
    why: str
    """Reason of what is allowed."""
    time: float
    """Duration [s]."""
    bodies: Sequence[Body]
    contacts: Sequence[Contact]
    truths: Sequence[Truth]
    forces: Sequence[Force] = ()
    gravity: Vector = (0.0, 0.0, -9.81)
    """[m/s^2]"""
    settle: float = 0.4
    """Settling time [s]."""
    steps: Vector = (2e-3,)
    """Time steps; the worst counts [s]."""

    @cached_property
    def moving(self) -> list[Body]:
        """Bodies that are not fixed."""
        return [body for body in self.bodies if body.joint != "fixed"]

    @cached_property
    def shapes(self) -> dict[str, tuple[Body, Shape]]:
        """Shapes by name, with their bodies."""
        return {
            shape.name: (body, shape) for body in self.bodies for shape in body.shapes
        }

    def wrenches(
        self, t: float | None, positions: np.ndarray, rotations: np.ndarray
    ) -> np.ndarray:
        """Return force and torque at the centres of mass `[bodies, 6]` beside gravity; None: for the settling time."""
        result = np.zeros((len(self.moving), 6))
        for row, body, rotation in zip(result, self.moving, rotations, strict=True):
            gravity = np.array(self.gravity)
            if t is None:
                row[:2] = -body.mass * gravity[:2]
            elif body.tilt:
                turned = gravity[2] * np.array(
                    [-math.sin(body.tilt), 0.0, math.cos(body.tilt)]
                )
                row[:3] = body.mass * (turned - gravity)
            for force in self.forces:
                if force.body == body.name:
                    value = force.value(t or 0.0) * (
                        1.0 if t is not None else np.array([0, 0, 1, 0, 0, 0])
                    )
                    row += value
                    if force.at is not None:
                        lever = rotation @ (np.array(force.at) - body.centre_of_mass)
                        row[3:] += np.cross(lever, value[:3])
        return result

    def measure(self, truth: Truth, path: Path3) -> float:
        """Return the quantity of a truth on a path."""
        body = [each.name for each in self.moving].index(truth.body)
        turned = path.turns[:, body] - path.turns[0, body]
        moved = path.positions[:, body, :2] - path.positions[0, body, :2]
        lengths = np.hypot(*moved.T)
        half = len(lengths) // 2
        if truth.quantity in ("slips", "turns"):
            return _first(
                path.times,
                lengths if truth.quantity == "slips" else np.abs(turned),
                truth.threshold,
            )
        ends = {
            "x": moved[-1, 0], "y": moved[-1, 1], "turn": turned[-1], "moved": lengths.max(),
            "drift": np.hypot(*(moved[-1] - moved[half])) / (path.times[-1] - path.times[half]),
        }  # fmt: skip
        return float(ends[truth.quantity])


def _first(times: np.ndarray, values: np.ndarray, threshold: float) -> float:
    """Return the time at which values first pass a threshold, between samples; the last time if they do not."""
    above = np.flatnonzero(values > threshold)
    if not len(above) or above[0] == 0:
        return float(times[above[0] if len(above) else -1])
    i = above[0]
    share = (threshold - values[i - 1]) / (values[i] - values[i - 1])
    return float(times[i - 1] + share * (times[i] - times[i - 1]))


def read_case(path: Path) -> Case:
    """Read a case from a TOML file; raises FileError in one line for unknown keys, missing ones and wrong names."""
    try:
        data = tomllib.loads(read_text(path, "a case of the referee"))
        shared = data.pop("allowed", None)
        bodies = [
            Body(
                **{
                    **each,
                    "shapes": [
                        Shape(**{"name": each["name"], **shape})
                        for shape in each["shapes"]
                    ],
                }
            )
            for each in data.pop("bodies")
        ]
        contacts = [
            Contact(**{**each, "pair": tuple(each["pair"]), "mu": _both(each["mu"])})
            for each in data.pop("contacts")
        ]
        forces = [Force(**each) for each in data.pop("forces", [])]
        truths = [
            Truth(**({} if shared is None else {"allowed": shared}) | each)
            for each in data.pop("truths")
        ]
        case = Case(
            name=path.stem,
            bodies=bodies,
            contacts=contacts,
            forces=forces,
            truths=truths,
            **data,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(
            f"{path}: is not a case of the referee: {' '.join(str(error).split())}"
        ) from None
    _check(path, case)
    return case


def _both(mu: float | Vector) -> Vector:
    return tuple(mu) if isinstance(mu, Sequence) else (mu, mu)


def _check(path: Path, case: Case) -> None:
    """Raise FileError for names of what is not there."""
    moving = [body.name for body in case.moving]
    for kind, names, known in (
        ("quantities", [truth.quantity for truth in case.truths], list(QUANTITIES)),
        ("moving bodies", [each.body for each in (*case.truths, *case.forces)], moving),
        (
            "shapes",
            [name for contact in case.contacts for name in contact.pair],
            list(case.shapes),
        ),
    ):
        for name in names:
            if name not in known:
                raise FileError(
                    f"{path}: {name!r} is not one of the {kind}: {', '.join(known)}"
                )


def all_cases() -> dict[str, Case]:
    """Return the cases of the package by name."""
    return {path.stem: read_case(path) for path in sorted(FOLDER.glob("*.toml"))}
