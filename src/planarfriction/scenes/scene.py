"""Scenes: a planar rigid body, the contacts it slides on, and everything that drives it, as plain immutable data."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.equality import ByValue, checked
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.pictures import picture
from planarfriction.scenes.signal import Signal, as_signal, breaks_between, sample_count

STARTS = ("rest", "equilibrium", "sliding")
"""Ways in which bristles may start."""

RTOL, ATOL = 1e-5, 2e-4
"""Default tolerances: with 0.5 to 1.5 times these, the published in-hand runs of all models end within 2e-6 m and
2e-5 rad of the same model's run at a relative tolerance of 1e-9."""


MOST_CONTACTS = 1_000_000
"""Identical contacts that share one state."""


def _floats(name: str, value: Any, size: int) -> tuple[float, ...]:
    """Return `value` as a tuple of `size` finite numbers, or raise."""
    fits = type(value) is tuple and len(value) == size
    if fits and all(type(each) is float and abs(each) <= validation.LARGEST for each in value):
        return value
    return tuple(validation.vector(name, value, size).tolist())


def _polygon(name: str, value: Any) -> np.ndarray:
    """Return `value` as a read-only polygon `[M, 2]` with at least three corners, or raise."""
    corners = validation.array(name, value, (None, 2))
    if len(corners) < 3:
        raise InvalidValueError(name, "have at least 3 points", f"{len(corners)}")
    corners.setflags(write=False)
    return corners


@dataclass(frozen=True, eq=False)
class Body(ByValue):
    """A rigid body that moves in the contact plane: inertia, initial state, gravity. World frame: x right, y up.

    Raises InvalidValueError for a mass or an inertia that is not > 0, and for vectors of the wrong length.
    """

    mass: float = checked(validation.positive)
    """Mass [kg]."""
    inertia: float = checked(validation.positive)
    """Moment of inertia about the centre of mass [kg m^2]."""
    position: tuple[float, float] = checked(_floats, 2, default=(0.0, 0.0))
    """Initial position of the centre of mass in the world [m]."""
    angle: float = checked(validation.number, default=0.0)
    """Initial angle of the body's axes in the world [rad]."""
    velocity: tuple[float, float, float] = checked(_floats, 3, default=(0.0, 0.0, 0.0))
    """Initial twist `(vx, vy, omega)` of the centre of mass, world axes [m/s, m/s, rad/s]."""
    gravity: tuple[float, float] = checked(_floats, 2, default=(0.0, -9.81))
    """Gravity in the plane of motion, world axes [m/s^2]."""
    outline: np.ndarray | None = checked(_polygon, default=None, repr=False)
    """Polygon for drawings, in body axes with the centre of mass at the origin, shape `[M, 2]` [m], or None."""

    if TYPE_CHECKING:  # what is given may be more than what is kept

        def __init__(
            self,
            mass: float,
            inertia: float,
            position: ArrayLike = (0.0, 0.0),
            angle: float = 0.0,
            velocity: ArrayLike = (0.0, 0.0, 0.0),
            gravity: ArrayLike = (0.0, -9.81),
            outline: ArrayLike | None = None,
        ) -> None: ...


def between(signal: Signal) -> str:
    """Return the lowest and the highest value of a scalar signal in words; one number where it is constant."""
    low, high = float(signal.values.min()), float(signal.values.max())
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def checked_model(name: str, value: Any) -> Any:
    """Return `value` if it is a friction model, or one that looks like it."""
    if isinstance(value, type) or not (hasattr(value, "patch") and hasattr(value, "law")):
        raise InvalidValueError(name, f"be a friction model ({MODELS.classes()})", value)
    return value


@dataclass(frozen=True, eq=False)
class Contact(ByValue):
    """A contact between body and world: a friction model, its position, and its normal force.

    Contacts fixed to the world (fingers) keep their frame while the body moves past them; contacts fixed to the body (a
    box on a table) move with it. In both cases the world's side may move as well: a driven pad, a running belt.

    Raises InvalidValueError unless `model` is a friction model, for a load below zero, and for other parameters that
    break their rule.
    """

    model: Any = field(repr=False)
    """Friction model, for example one of `planarfriction.models`."""
    normal_force: Signal
    """Normal force [N], >= 0: a signal, or a number for a constant force."""
    mounted_on: Literal["world", "body"] = "world"
    """Part that the contact frame is fixed to: "world" or "body"."""
    position: tuple[float, float] = (0.0, 0.0)
    """Origin of the contact frame [m], in the world or, on the body, in its axes from its centre of mass."""
    angle: float = 0.0
    """Angle of the contact frame's axes in the world or in the body [rad]."""
    count: int = 1
    """Number of identical contacts (same position, same load) that share this one's state."""
    name: str = "contact"
    """Name in the results; unique within its scene."""
    support_velocity: Signal | None = None
    """Prescribed twist `(vx, vy, omega)` of the world's side, world axes, `[T, 3]` [m/s, m/s, rad/s]; None: at rest.

    For a pad fixed to the world it is the twist at the origin of the contact frame, which moves with the pad. Under a
    patch fixed to the body it is the twist of the ground (a belt, a turntable) at the origin of the world.
    """
    pressure: Literal["fixed", "follows"] = "fixed"
    """Pressure that is "fixed" to the patch, or "follows" the load (docs/physics.md, "Pressure that follows the load").

    It follows weight, applied forces and inertia, which act at the centre of mass, and friction, which acts below it,
    with a lag of 1 ms. The patch is fixed to the body, which has no other contact, and its model has bristles on cells.
    A body that would tip slides on the edge of its patch.
    """
    height: float = 0.0
    """Height of the body's centre of mass above the contact [m], >= 0, where the pressure follows the load."""

    if TYPE_CHECKING:  # what is given may be more than what is kept

        def __init__(
            self,
            model: Any,
            normal_force: Signal | ArrayLike,
            mounted_on: Literal["world", "body"] = "world",
            position: ArrayLike = (0.0, 0.0),
            angle: float = 0.0,
            count: int = 1,
            name: str = "contact",
            support_velocity: Signal | ArrayLike | None = None,
            pressure: Literal["fixed", "follows"] = "fixed",
            height: float = 0.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        validation.text("name of a contact", self.name)
        checked_model(f"model of contact {self.name!r}", self.model)
        of_contact = f"of contact {self.name!r}"
        load = as_signal(f"normal_force {of_contact}", self.normal_force, None)
        load.check_non_negative(f"normal_force {of_contact}")
        self._set(normal_force=load)
        validation.choice(f"mounted_on {of_contact}", self.mounted_on, ("world", "body"))
        position, angle = _floats(f"position {of_contact}", self.position, 2), f"angle {of_contact}"
        count = validation.count(f"count {of_contact}", self.count, at_most=MOST_CONTACTS)
        self._set(position=position, angle=validation.number(angle, self.angle), count=count)
        if self.support_velocity is not None:
            self._set(support_velocity=as_signal(f"support_velocity {of_contact}", self.support_velocity, 3))
        validation.choice(f"pressure {of_contact}", self.pressure, ("fixed", "follows"))
        self._set(height=validation.non_negative(f"height {of_contact}", self.height))
        self._check_pressure(of_contact)

    def _check_pressure(self, of_contact: str) -> None:
        if self.pressure == "fixed":
            if self.height > 0.0:
                raise InvalidValueError(f"height {of_contact}", "be 0 where the pressure is 'fixed'", self.height)
            return
        from planarfriction.models import DistributedModel

        if self.mounted_on != "body":
            rule = "be 'fixed' on the world: only a patch of the body follows its load"
            raise InvalidValueError(f"pressure {of_contact}", rule, self.pressure)
        if not isinstance(getattr(self.model, "reduction", None), DistributedModel):
            rule = "have bristles on cells where the pressure follows (DistributedModel, ReducedModel)"
            raise InvalidValueError(f"model {of_contact}", rule, self.model)

    @property
    def centre_of_mass(self) -> tuple[float, float]:
        """Place of the body's centre of mass in the frame of a contact fixed to the body [m]."""
        (x, y), cos, sin = self.position, math.cos(self.angle), math.sin(self.angle)
        return -cos * x - sin * y, sin * x - cos * y

    def __repr__(self) -> str:
        count = f"{self.count} x " if self.count > 1 else ""
        moved = "" if self.support_velocity is None else ", which moves"
        load = between(self.normal_force)
        return f"Contact({self.name!r}: {count}{self.model!r} on the {self.mounted_on}{moved}, {load} N)"


def with_friction(contact: Contact, factor: float) -> Contact:
    """Return the contact with `factor` times the friction coefficients mu_c and mu_s that its law has."""
    law, model = contact.model.law, contact.model
    scaled = {name: factor * getattr(law, name) for name in ("mu_c", "mu_s") if hasattr(law, name)}
    if factor == 1.0 or not scaled:
        return contact
    law = dataclasses.replace(law, **scaled)
    changed = model.with_law(law) if hasattr(model, "with_law") else dataclasses.replace(model, law=law)
    return dataclasses.replace(contact, model=changed)


def _body(name: str, value: Any) -> Body:
    """Return `value` if it is a body, or raise."""
    return validation.instance(name, value, Body, "a Body")


def _contacts(name: str, value: Any) -> tuple[Contact, ...]:
    """Return one contact or a list of contacts as a tuple; raise for none, and for two of the same name."""
    contacts = (value,) if isinstance(value, Contact) else value
    if not isinstance(contacts, (list, tuple)) or not all(isinstance(contact, Contact) for contact in contacts):
        raise InvalidValueError(name, "be a list of Contact", value)
    if not contacts:
        raise InvalidValueError(name, "hold at least one contact", "none")
    names = [contact.name for contact in contacts]
    for each in names:
        if names.count(each) > 1:
            raise InvalidValueError(name, "have different names", f"{each!r} {names.count(each)} times")
    return tuple(contacts)


@dataclass(frozen=True, eq=False)
class Scene(ByValue):
    """Everything that a simulation needs: body, contacts, forces or prescribed velocity, duration.

    Raises InvalidValueError, naming the parameter, if the parts do not make a valid scene.
    """

    body: Body = checked(_body)
    """The body that moves; None: one without weight, moved as `velocity` prescribes."""
    contacts: Sequence[Contact] = checked(_contacts)
    """The contacts it slides on, at least one."""
    t_end: float = checked(validation.positive)
    """Duration [s]."""
    force: Signal | None = checked(as_signal, 3, default=None)
    """Applied wrench `(fx, fy, tau)` at the centre of mass, world axes, `[T, 3]` [N, N, N m], or None."""
    velocity: Signal | None = checked(as_signal, 3, default=None)
    """Prescribed twist `(vx, vy, omega)` in **body axes**, `[T, 3]` [m/s, m/s, rad/s], or None for a free body.

    It is the velocity of the origin of the body's axes. Mass, inertia, gravity and initial velocity then have no
    effect.
    """
    stop_speed: float | None = checked(validation.positive, default=None)
    """Speed [m/s] below which the body counts as at rest, which ends the simulation; None to run until `t_end`."""
    save_every: float = checked(validation.positive, default=0.01)
    """Time between saved samples [s]."""
    rtol: float = checked(validation.positive, default=RTOL)
    """Relative tolerance of the solver [-]."""
    atol: float = checked(validation.positive, default=ATOL)
    """Tolerance as a share of the natural scales (see `simulate`) [-]."""
    name: str = "scene"
    """Name of the scene."""
    start: Literal["rest", "equilibrium", "sliding"] = "rest"
    """State of the bristles at the start: "rest", relaxed; "equilibrium", carrying the load of a body at rest (with the
    least elastic energy, which determines how contacts share it); "sliding", in the steady state of the initial
    velocity."""

    if TYPE_CHECKING:  # what is given may be more than what is kept

        def __init__(
            self,
            body: Body | None,
            contacts: Contact | Sequence[Contact],
            t_end: float,
            force: Signal | ArrayLike | None = None,
            velocity: Signal | ArrayLike | None = None,
            stop_speed: float | None = None,
            save_every: float = 0.01,
            rtol: float = RTOL,
            atol: float = ATOL,
            name: str = "scene",
            start: Literal["rest", "equilibrium", "sliding"] = "rest",
        ) -> None: ...

    def __post_init__(self) -> None:
        if self.body is None and self.velocity is not None:
            self._set(body=Body(1.0, 1.0, gravity=(0.0, 0.0)))
        super().__post_init__()
        if self.velocity is not None:
            for name in ("force", "stop_speed"):
                if getattr(self, name) is not None:
                    raise InvalidValueError(name, "be None if the velocity is prescribed", getattr(self, name))
            for contact in self.contacts:
                if contact.support_velocity is not None:
                    name = f"support_velocity of contact {contact.name!r}"
                    rule = "be None if the body's velocity is prescribed"
                    raise InvalidValueError(name, rule, contact.support_velocity)
        for contact in self.contacts:
            if contact.pressure == "follows" and len(self.contacts) > 1:
                rule = "be 'fixed' beside other contacts, which share the load in a way that statics leaves open"
                raise InvalidValueError(f"pressure of contact {contact.name!r}", rule, contact.pressure)
        sample_count(self.t_end, self.save_every, "save_every")
        validation.text("name", self.name)
        self._check_start()

    def _check_start(self) -> None:
        validation.choice("start", self.start, STARTS)
        driven = {"the body": self.body.velocity if self.velocity is None else self.velocity(0.0).tolist()}
        for contact in self.contacts:
            if contact.support_velocity is not None:
                driven[f"contact {contact.name!r}"] = contact.support_velocity(0.0).tolist()
        moves = [name for name, velocity in driven.items() if any(velocity)]
        if self.start == "equilibrium" and any(contact.pressure == "follows" for contact in self.contacts):
            raise InvalidValueError("start", "be 'rest' or 'sliding' if the pressure follows the load", self.start)
        if self.start == "equilibrium" and self.velocity is not None:
            raise InvalidValueError("start", "be 'rest' or 'sliding' if the velocity is prescribed", self.start)
        if self.start == "equilibrium" and moves:
            rule = "start at zero if start is 'equilibrium'"
            what = "velocity" if moves[0] == "the body" else "support_velocity"
            raise InvalidValueError(f"{what} of {moves[0]}", rule, driven[moves[0]])
        if self.start == "sliding" and not moves:
            raise InvalidValueError("initial velocity", "not be zero if start is 'sliding'", driven["the body"])

    def __repr__(self) -> str:
        contacts = "; ".join(repr(contact) for contact in self.contacts[:2])
        more = f"; {len(self.contacts) - 2} more" if len(self.contacts) > 2 else ""
        driven = ", force given" if self.force is not None else ", velocity given" if self.velocity is not None else ""
        body = f"{self.body.mass:g} kg, {self.body.inertia:.3g} kg m^2"
        return f"Scene({self.name!r}: {self.t_end:g} s, body of {body}{driven}; {contacts}{more})"

    def _repr_html_(self) -> str:
        return picture("scene in a notebook", self)

    def breaks(self, t_end: float | None = None) -> np.ndarray:
        """Return 0, the times [s] at which any signal jumps or bends, and `t_end` (default: the scene's).

        Breaks within rounding of each other (`SAME_TIME`) count as one.

        Raises InvalidValueError for an end that is not > 0.
        """
        t_end = self.t_end if t_end is None else validation.positive("t_end", t_end)
        signals = [contact.normal_force for contact in self.contacts]
        signals += [contact.support_velocity for contact in self.contacts if contact.support_velocity is not None]
        signals += [signal for signal in (self.force, self.velocity) if signal is not None]
        return breaks_between(np.concatenate([signal.breaks for signal in signals]), t_end)

    def to_dict(self) -> dict[str, Any]:
        """Return the scene as plain numbers, texts, lists and tables; `from_dict` restores it to the last bit."""
        from planarfriction.scenes.files import scene_to_dict

        return scene_to_dict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any], folder: str | Path | None = None) -> Scene:
        """Make a scene from a table as in scene files; relative paths in it start from `folder`.

        Raises FileError in one line that names the table and the key.
        """
        from planarfriction.scenes.files import scene_from_dict

        return scene_from_dict(data, folder=folder)

    @classmethod
    def from_file(cls, path: str | Path) -> Scene:
        """Read a TOML or JSON file. Raises FileError in one line that names the file, the table and the key."""
        from planarfriction.scenes.files import read_scene

        return read_scene(path)

    def to_file(self, path: str | Path) -> None:
        """Write the scene to `path` (`.toml` or `.json`). Raises FileError if that is not possible."""
        from planarfriction.scenes.files import write_scene

        write_scene(self, path)

    def to_json(self) -> str:
        """Return the scene as one line of JSON, the same for equal scenes."""
        return json.dumps(self.to_dict(), sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)

    def digest(self) -> str:
        """Return the SHA-256 of the content, in hexadecimal: equal scenes have equal digests."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()
