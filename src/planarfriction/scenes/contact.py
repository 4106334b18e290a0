"""A contact of a scene: a friction model, its place, its load and the motion of the world's side."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Kept, checked
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.geometry import rotate
from planarfriction.scenes.body import floats
from planarfriction.scenes.signal import Signal, as_signal, displacement

MOST_CONTACTS = 1_000_000
"""Identical contacts that share one state."""


def between(signal: Signal) -> str:
    """Return the lowest and the highest value of a scalar signal in words; one number where it is constant."""
    low = float(signal.values.min())
    high = float(signal.values.max())
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def checked_model(name: str, value: Any) -> Any:
    """Return `value` if it is a friction model, or one that looks like it."""
    if isinstance(value, type) or not (
        hasattr(value, "patch") and hasattr(value, "law")
    ):
        raise InvalidValueError(
            name, f"be a friction model ({MODELS.classes()})", value
        )
    return value


def _load(name: str, value: Any) -> Signal:
    """Return `value` as a scalar signal that is never below zero, or raise."""
    load = as_signal(name, value, None)
    load.check_non_negative(name)
    return load


@dataclass(frozen=True, eq=False)
class Contact(ByValue):
    """A contact between body and world: a friction model, its position, and its normal force.

    Contacts fixed to the world (fingers) keep their frame while the body moves past them; contacts fixed to the body (a
    box on a table) move with it. In both cases the world's side may move as well: a driven pad, a running belt.

    Raises InvalidValueError unless `model` is a friction model, for a load below zero, and for other parameters that
    break their rule.
    """

    model: Any = checked(checked_model, repr=False)
    """Friction model, for example one of `planarfriction.models`."""
    normal_force: Kept[Signal | ArrayLike, Signal] = checked(_load)
    """Normal force [N], >= 0: a signal, or a number for a constant force."""
    mounted_on: Literal["world", "body"] = checked(
        validation.choice, ("world", "body"), default="world"
    )
    """Part that the contact frame is fixed to: "world" or "body"."""
    position: Kept[ArrayLike, tuple[float, float]] = checked(
        floats, 2, default=(0.0, 0.0)
    )
    """Origin of the contact frame [m], in the world or, on the body, in its axes from its centre of mass."""
    angle: float = checked(validation.number, default=0.0)
    """Angle of the contact frame's axes in the world or in the body [rad]."""
    count: int = checked(validation.count, 1, MOST_CONTACTS, default=1)
    """Number of identical contacts (same position, same load) that share this one's state."""
    name: str = "contact"
    """Name in the results; unique within its scene."""
    support_velocity: Kept[Signal | ArrayLike | None, Signal | None] = checked(
        as_signal, 3, default=None
    )
    """Prescribed twist `(vx, vy, omega)` of the world's side, world axes, `[T, 3]` [m/s, m/s, rad/s]; None: at rest.

    For a pad fixed to the world it is the twist at the origin of the contact frame, which moves with the pad. Under a
    patch fixed to the body it is the twist of the ground (a belt, a turntable) at the origin of the world.
    """
    pressure: Literal["fixed", "follows"] = checked(
        validation.choice, ("fixed", "follows"), default="fixed"
    )
    """Pressure that is "fixed" to the patch, or "follows" the load (docs/physics.md, "Moment-dependent pressure").

    It follows weight, applied forces and inertia, which act at the centre of mass, and friction, which acts below it,
    with a lag of 1 ms. The patch is fixed to the body, which has no other contact, and its model has bristles on cells.
    A body that would tip slides on the edge of its patch.
    """
    height: float = checked(validation.non_negative, default=0.0)
    """Height of the body's centre of mass above the contact [m], >= 0, where the pressure follows the load."""
    edge: bool = checked(validation.instance, bool, "True or False", default=False)
    """True if only cells on the body, within its `outline`, carry load, the others carry it for them.

    A cell that lies on the edge carries by the part of its area that is on the body, at the centroid of this part. The
    contact ends when none is. It is fixed to the world, and its model has bristles on cells.
    """

    def __post_init__(self) -> None:
        validation.text("name of a contact", self.name)
        try:
            super().__post_init__()
            self._check_parts()
        except InvalidValueError as error:
            name = f"{error.name} of contact {self.name!r}"
            raise InvalidValueError(name, error.rule, error.value) from None

    def _check_parts(self) -> None:
        """Check that mount and model suit a pressure that follows the load, and an edge."""
        if self.pressure == "follows":
            rule = "be 'fixed' on the world: only a patch of the body follows its load"
            self._check_cells("pressure", "body", rule, "the pressure follows")
        elif self.height > 0.0:
            rule = "be 0 where the pressure is 'fixed'"
            raise InvalidValueError("height", rule, self.height)
        if self.edge:
            rule = "be False on the body: only a pad of the world leaves the body"
            self._check_cells("edge", "world", rule, "the body has an edge")

    def _check_cells(self, name: str, mount: str, rule: str, where: str) -> None:
        """Check that the contact is fixed to its mount, and that its model has bristles on cells."""
        from planarfriction.models import DistributedModel

        if self.mounted_on != mount:
            raise InvalidValueError(name, rule, getattr(self, name))
        if not isinstance(getattr(self.model, "reduction", None), DistributedModel):
            rule = (
                f"have bristles on cells where {where} (DistributedModel, ReducedModel)"
            )
            raise InvalidValueError("model", rule, self.model)

    @property
    def centre_of_mass(self) -> tuple[float, float]:
        """Place of the body's centre of mass in the frame of a contact fixed to the body [m]."""
        (x, y) = self.position
        cos = math.cos(self.angle)
        sin = math.sin(self.angle)
        return -cos * x - sin * y, sin * x - cos * y

    def __repr__(self) -> str:
        count = f"{self.count} x " if self.count > 1 else ""
        moved = "" if self.support_velocity is None else ", which moves"
        load = between(self.normal_force)
        return f"Contact({self.name!r}: {count}{self.model!r} on the {self.mounted_on}{moved}, {load} N)"


def support_displacement(contact: Contact, times: np.ndarray) -> np.ndarray:
    """Return the prescribed displacement of the world's side of a contact `[T, 3]` [m, m, rad]."""
    moves = contact.support_velocity
    return np.zeros((len(times), 3)) if moves is None else displacement(moves, times)


def contact_poses(contact: Contact, times: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Return the poses `[T, 3]` [m, m, rad] of a contact's frame at `times`, where the body has `poses` `[T, 3]`."""
    fixed = np.array([*contact.position, contact.angle])
    if contact.mounted_on == "body":
        return poses + rotate(fixed, poses[..., 2])
    return fixed + support_displacement(contact, times)


def with_friction(contact: Contact, factor: float) -> Contact:
    """Return the contact with `factor` times the friction coefficients mu_c and mu_s that its law has."""
    model = contact.model
    law = model.law
    scaled = {
        name: factor * getattr(law, name)
        for name in ("mu_c", "mu_s")
        if hasattr(law, name)
    }
    if factor == 1.0 or not scaled:
        return contact
    law = dataclasses.replace(law, **scaled)
    if hasattr(model, "with_law"):
        model = model.with_law(law)
    else:
        model = dataclasses.replace(model, law=law)
    return dataclasses.replace(contact, model=model)
