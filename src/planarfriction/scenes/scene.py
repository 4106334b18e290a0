"""Scenes: a body, its contacts, and everything that drives it, as plain immutable data; and options of simulations."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Checked, Kept, checked
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.body import Body, Spring
from planarfriction.scenes.contact import Contact
from planarfriction.scenes.signal import (
    MOST_SAMPLES,
    SAME_TIME,
    Signal,
    as_signal,
    breaks_between,
    sample_count,
)

STARTS = ("rest", "equilibrium", "sliding")
"""Ways in which bristles may start."""

RTOL = 1e-5
"""Default relative tolerance: with 0.5 to 1.5 times this and `ATOL`, the published in-
hand runs of all models end within 2e-6 m and 2e-5 rad of the same model's run at a
relative tolerance of 1e-9."""

ATOL = 2e-4
"""Default tolerance in nominal values."""


def _listed(name: str, value: Any, kind: type) -> tuple[Any, ...]:
    """Return one part of a kind or a list of them as a tuple, or raise."""
    parts = (value,) if isinstance(value, kind) else value
    if not isinstance(parts, (list, tuple)) or not all(
        isinstance(part, kind) for part in parts
    ):
        raise InvalidValueError(name, f"be a list of {kind.__name__}", value)
    return tuple(parts)


def _contacts(name: str, value: Any) -> tuple[Contact, ...]:
    """Return one contact or a list of contacts as a tuple; raise for none, and for two of the same name."""
    contacts = _listed(name, value, Contact)
    if not contacts:
        raise InvalidValueError(name, "hold at least one contact", "none")
    names = [contact.name for contact in contacts]
    for each in names:
        if names.count(each) > 1:
            raise InvalidValueError(
                name, "have different names", f"{each!r} {names.count(each)} times"
            )
    return contacts


@dataclass(frozen=True, eq=False)
class Scene(ByValue):
    """Everything that a simulation needs: body, contacts, forces or prescribed velocity, duration.

    Raises InvalidValueError, naming the parameter, if the parts do not make a valid scene.
    """

    body: Kept[Body | None, Body] = checked(validation.instance, Body, "a Body")
    """The body that moves; None: one without weight, moved as `velocity` prescribes."""
    contacts: Kept[Contact | Sequence[Contact], Sequence[Contact]] = checked(_contacts)
    """The contacts it slides on, at least one."""
    t_end: float = checked(validation.positive)
    """Duration [s]."""
    force: Kept[Signal | ArrayLike | None, Signal | None] = checked(
        as_signal, 3, default=None
    )
    """Applied wrench `(fx, fy, tau)` at the centre of mass, world axes, `[T, 3]` [N, N, N m], or None."""
    velocity: Kept[Signal | ArrayLike | None, Signal | None] = checked(
        as_signal, 3, default=None
    )
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
    """Tolerance as a share of the nominal values (see `simulate`) [-]."""
    name: str = "scene"
    """Name of the scene."""
    start: Literal["rest", "equilibrium", "sliding"] = "rest"
    """State of the bristles at the start: "rest", relaxed; "equilibrium", carrying the load of a body at rest (with the
    least elastic energy, which determines how contacts share it); "sliding", in the steady state of the initial
    velocity."""
    springs: Kept[Spring | Sequence[Spring], Sequence[Spring]] = checked(
        _listed, Spring, default=()
    )
    """Springs that tie the body to anchors; one, several or none."""

    def __post_init__(self) -> None:
        if self.body is None and self.velocity is not None:
            self._set(body=Body(1.0, 1.0, gravity=(0.0, 0.0)))
        super().__post_init__()
        if self.velocity is not None:
            if self.springs:
                rule = "be none if the velocity is prescribed"
                raise InvalidValueError("springs", rule, f"{len(self.springs)}")
            others = {"force": self.force, "stop_speed": self.stop_speed}
            for contact in self.contacts:
                name = f"support_velocity of contact {contact.name!r}"
                others[name] = contact.support_velocity
            for name, given in others.items():
                if given is not None:
                    rule = "be None if the velocity is prescribed"
                    raise InvalidValueError(name, rule, given)
        for contact in self.contacts:
            if contact.pressure == "follows" and len(self.contacts) > 1:
                rule = "be 'fixed' if the body has several contacts, whose loads statics leaves open"
                raise InvalidValueError(
                    f"pressure of contact {contact.name!r}", rule, contact.pressure
                )
            if contact.edge and (
                self.body.outline is None or self.velocity is not None
            ):
                rule = "be False unless the body moves freely and has an outline"
                raise InvalidValueError(f"edge of contact {contact.name!r}", rule, True)
        sample_count(self.t_end, self.save_every, "save_every")
        validation.text("name", self.name)
        self._check_start()

    def _check_start(self) -> None:
        validation.choice("start", self.start, STARTS)
        velocity = self.body.velocity
        if self.velocity is not None:
            velocity = self.velocity(0.0).tolist()
        driven = {"velocity of the body": velocity}
        for contact in self.contacts:
            if contact.support_velocity is not None:
                name = f"support_velocity of contact {contact.name!r}"
                driven[name] = contact.support_velocity(0.0).tolist()
        moves = [name for name, each in driven.items() if any(each)]
        if self.start == "sliding" and not moves:
            rule = "not be zero if start is 'sliding'"
            raise InvalidValueError("initial velocity", rule, velocity)
        if self.start != "equilibrium":
            return
        for words, holds in (
            (
                "the pressure follows the load",
                any(each.pressure == "follows" for each in self.contacts),
            ),
            ("a contact has an edge", any(each.edge for each in self.contacts)),
            ("the velocity is prescribed", self.velocity is not None),
        ):
            if holds:
                rule = f"be 'rest' or 'sliding' if {words}"
                raise InvalidValueError("start", rule, self.start)
        if moves:
            rule = "start at zero if start is 'equilibrium'"
            raise InvalidValueError(moves[0], rule, driven[moves[0]])

    def __repr__(self) -> str:
        contacts = "; ".join(repr(contact) for contact in self.contacts[:2])
        more = f"; {len(self.contacts) - 2} more" if len(self.contacts) > 2 else ""
        driven = "" if self.velocity is None else ", velocity given"
        driven = driven if self.force is None else ", force given"
        several = f", on {len(self.springs)} springs"
        tied = {0: "", 1: ", on a spring"}.get(len(self.springs), several)
        body = f"{self.body.mass:g} kg, {self.body.inertia:.3g} kg m^2"
        return f"Scene({self.name!r}: {self.t_end:g} s, body of {body}{driven}{tied}; {contacts}{more})"

    def _repr_html_(self) -> str:
        return picture("scene in a notebook", self)

    def breaks(self, t_end: float | None = None) -> np.ndarray:
        """Return 0, the times [s] at which any signal jumps or bends, and `t_end` (default: the scene's).

        Breaks within rounding of each other (`SAME_TIME`) count as one.

        Raises InvalidValueError for an end that is not > 0.
        """
        t_end = self.t_end if t_end is None else validation.positive("t_end", t_end)
        signals = [self.force, self.velocity]
        signals += [spring.anchor for spring in self.springs]
        for contact in self.contacts:
            signals += [contact.normal_force, contact.support_velocity]
        breaks = [signal.breaks for signal in signals if signal is not None]
        return breaks_between(np.concatenate(breaks), t_end)

    def to_dict(self) -> dict[str, Any]:
        """Return the scene as plain numbers, texts, lists and tables; `from_dict` restores it to the last bit."""
        from planarfriction.scenes.files import scene_to_dict

        return scene_to_dict(self)

    @classmethod
    def from_dict(
        cls,
        data: dict[str, Any],
        folder: str | Path | None = None,
        source: str = "scene",
    ) -> Scene:
        """Make a scene from a table as in scene files; relative paths in it start from `folder`.

        Raises FileError in one line that begins with `source` and names the table and the key.
        """
        from planarfriction.scenes.files import parts_of_scene

        table, parts = parts_of_scene(data, folder, source)
        with table.located():
            return cls(**parts)

    @classmethod
    def from_file(cls, path: str | Path) -> Scene:
        """Read a TOML or JSON file. Raises FileError in one line that names the file, the table and the key."""
        from planarfriction.scenes.files import read_table

        path = validation.path("path", path)
        return cls.from_dict(read_table(path), path.parent, str(path))

    def to_file(self, path: str | Path) -> None:
        """Write the scene to `path` (`.toml` or `.json`). Raises FileError if that is not possible."""
        from planarfriction.scenes.files import write_table

        write_table(self.to_dict(), path)

    def to_json(self) -> str:
        """Return the scene as one line of JSON, the same for equal scenes."""
        return json.dumps(
            self.to_dict(),
            sort_keys=True,
            separators=(",", ":"),
            ensure_ascii=False,
            allow_nan=False,
        )

    def digest(self) -> str:
        """Return the SHA-256 of the content, in hexadecimal: equal scenes have equal digests."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()


MAX_STEPS = 5 * MOST_SAMPLES
"""Steps that a run tries at most by default: five for each sample of the longest signal, a minute with few states."""


class Plan(NamedTuple):
    """Checked options of one simulation."""

    end: float
    """End [s]."""
    times: np.ndarray
    """Instants to record `[M]` [s]."""
    rtol: float
    """Relative tolerance [-]."""
    atol: float
    """Absolute tolerance, as a share of the nominal values [-]."""
    max_steps: int
    """Largest number of steps."""


@dataclass(frozen=True)
class SolverOptions(Checked):
    """Options of the simulation of a scene; None takes those of the scene, or of the function that gets them.

    Raises InvalidValueError for numbers that are not > 0, and a number of steps that is no integer.
    """

    t_end: float | None = checked(validation.positive, default=None)
    """End [s], at most the scene's own."""
    rtol: float | None = checked(validation.positive, default=None)
    """Relative tolerance [-], > 0."""
    atol: float | None = checked(validation.positive, default=None)
    """Tolerance as a share of the nominal values [-], > 0 (see `simulate`); it follows `rtol` by default."""
    save_every: float | None = checked(validation.positive, default=None)
    """Recording interval [s]; the end is always recorded."""
    max_steps: int = checked(validation.count, default=MAX_STEPS)
    """Largest number of steps: whatever the scene asks for, a run ends."""

    def plan(self, scene: Scene, rtol: float | None = None) -> Plan:
        """Return what the options say for a scene; with `rtol` given, both tolerances are that by default.

        Raises InvalidValueError for an end after the scene's own.
        """
        end = scene.t_end if self.t_end is None else self.t_end
        if end > scene.t_end:
            raise InvalidValueError(
                "t_end", f"be at most the scene's {scene.t_end:g} s", end
            )
        least, default = (scene.atol, scene.rtol) if rtol is None else (rtol, rtol)
        relative = default if self.rtol is None else self.rtol
        absolute = least * (relative / default) if self.atol is None else self.atol
        every = scene.save_every if self.save_every is None else self.save_every
        return Plan(
            end, recording_times(end, every), relative, absolute, self.max_steps
        )


def recording_times(end: float, every: float) -> np.ndarray:
    """Return every multiple of `every` up to the end, and the end [s]."""
    times = np.arange(sample_count(end, every, "save_every") + 1) * every
    return np.append(times, end) if end - times[-1] > SAME_TIME else times
