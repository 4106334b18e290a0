"""A contact of a scene: a friction model, its place, its load and the motion of the world's side."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any, Literal

from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Kept
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.scenes.body import floats
from planarfriction.scenes.signal import Signal, as_signal

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
    normal_force: Kept[Signal | ArrayLike, Signal]
    """Normal force [N], >= 0: a signal, or a number for a constant force."""
    mounted_on: Literal["world", "body"] = "world"
    """Part that the contact frame is fixed to: "world" or "body"."""
    position: Kept[ArrayLike, tuple[float, float]] = (0.0, 0.0)  # pyright: ignore[reportAssignmentType]
    """Origin of the contact frame [m], in the world or, on the body, in its axes from its centre of mass."""
    angle: float = 0.0
    """Angle of the contact frame's axes in the world or in the body [rad]."""
    count: int = 1
    """Number of identical contacts (same position, same load) that share this one's state."""
    name: str = "contact"
    """Name in the results; unique within its scene."""
    support_velocity: Kept[Signal | ArrayLike | None, Signal | None] = None  # pyright: ignore[reportAssignmentType]
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
    edge: bool = False
    """True if only cells on the body, within its `outline`, carry load, the others carry it for them.

    A cell that lies on the edge carries by the part of its area that is on the body, at the centroid of this part. The
    contact ends when none is. It is fixed to the world, and its model has bristles on cells.
    """

    def __post_init__(self) -> None:
        validation.text("name of a contact", self.name)
        checked_model(f"model of contact {self.name!r}", self.model)
        of_contact = f"of contact {self.name!r}"
        load = as_signal(f"normal_force {of_contact}", self.normal_force, None)
        load.check_non_negative(f"normal_force {of_contact}")
        self._set(normal_force=load)
        validation.choice(
            f"mounted_on {of_contact}", self.mounted_on, ("world", "body")
        )
        position = floats(f"position {of_contact}", self.position, 2)
        angle = f"angle {of_contact}"
        count = validation.count(
            f"count {of_contact}", self.count, at_most=MOST_CONTACTS
        )
        self._set(
            position=position, angle=validation.number(angle, self.angle), count=count
        )
        if self.support_velocity is not None:
            self._set(
                support_velocity=as_signal(
                    f"support_velocity {of_contact}", self.support_velocity, 3
                )
            )
        validation.choice(f"pressure {of_contact}", self.pressure, ("fixed", "follows"))
        self._set(height=validation.non_negative(f"height {of_contact}", self.height))
        if self.pressure == "follows":
            rule = "'fixed' on the world: only a patch of the body follows its load"
            self._check_cells(of_contact, "pressure", "body", rule)
        elif self.height > 0.0:
            raise InvalidValueError(
                f"height {of_contact}",
                "be 0 where the pressure is 'fixed'",
                self.height,
            )
        if validation.instance(f"edge {of_contact}", self.edge, bool, "True or False"):
            self._check_cells(
                of_contact,
                "edge",
                "world",
                "False on the body: only a pad of the world leaves the body",
            )

    def _check_cells(
        self, of_contact: str, name: str, mount: str, otherwise: str
    ) -> None:
        """Check that the contact is fixed to its mount, and that its model has bristles on cells."""
        from planarfriction.models import DistributedModel

        if self.mounted_on != mount:
            raise InvalidValueError(
                f"{name} {of_contact}", f"be {otherwise}", getattr(self, name)
            )
        if not isinstance(getattr(self.model, "reduction", None), DistributedModel):
            where = (
                "the pressure follows" if name == "pressure" else "the body has an edge"
            )
            rule = (
                f"have bristles on cells where {where} (DistributedModel, ReducedModel)"
            )
            raise InvalidValueError(f"model {of_contact}", rule, self.model)

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


def with_friction(contact: Contact, factor: float) -> Contact:
    """Return the contact with `factor` times the friction coefficients mu_c and mu_s that its law has."""
    law = contact.model.law
    model = contact.model
    scaled = {
        name: factor * getattr(law, name)
        for name in ("mu_c", "mu_s")
        if hasattr(law, name)
    }
    if factor == 1.0 or not scaled:
        return contact
    law = dataclasses.replace(law, **scaled)
    changed = (
        model.with_law(law)
        if hasattr(model, "with_law")
        else dataclasses.replace(model, law=law)
    )
    return dataclasses.replace(contact, model=changed)
