"""Columns of the file of a log: names as files, sensors and ROS messages write them, units, what may be left out."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path

from planarfriction._support import validation
from planarfriction.errors import FileError, InvalidValueError, shown

TWIST = ("vx", "vy", "omega")
MOTION = ("x", "y", "theta")
WRENCH = ("fx", "fy", "tau")
LOAD = ("normal_force",)

ALIASES = {
    "time": "t",
    "time_s": "t",
    "t_s": "t",
    "wz": "omega",
    "fn": "normal_force",
    "fz": "normal_force",
    "mz": "tau",
    "tz": "tau",
    "force": "fx",
    "velocity": "vx",
    "position": "x",
    "torque": "tau",
    "angle": "theta",
}
"""Other names of columns, in small letters."""

MESSAGES = {
    "force.x": "fx",
    "force.y": "fy",
    "force.z": "normal_force",
    "torque.z": "tau",
    "linear.x": "vx",
    "linear.y": "vy",
    "angular.z": "omega",
    "position.x": "x",
    "position.y": "y",
}
"""Columns by the names of ROS messages; what stands before them, as in wrench.force.x, does not count."""

UNITS = {
    "t": ("s",),
    "vx": ("m/s",),
    "vy": ("m/s",),
    "omega": ("rad/s", "1/s"),
    "x": ("m",),
    "y": ("m",),
    "theta": ("rad",),
    "fx": ("n",),
    "fy": ("n",),
    "normal_force": ("n",),
    "tau": ("nm", "n*m", "n.m", "n·m"),
}
"""Units that may stand in brackets behind a name, or below it, in small letters and without spaces."""

_MESSAGE = re.compile(r"(?:.*[./_])?(force|torque|linear|angular|position)[./_]([xyz])")

_HEADING = re.compile(r"(?P<name>[^\[(]*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?")


def find_columns(
    path: Path, headings: Sequence[str], *, contact: str | None, with_load: bool
) -> dict[str, str]:
    """Find the heading of each column of a log: `t`, twist or else motion, wrench, and normal force if it is there.

    An angle beside a twist is found too: it shows if the twist is a mean (see `Log.held`). Names are read without
    regard to case and may carry a unit in brackets; `ALIASES` are known. If columns are named "contact.vx", those of
    `contact` are taken, or of the only contact that has them all.

    Raises FileError for a column that is missing, that is there twice, or that has another unit.
    """
    named = _named(path, headings)
    contacts = sorted({name.rpartition(".")[0] for name in named} - {""})
    lacks = {each: _missing(named, each, with_load) for each in ("", *contacts)}
    if contact is None:
        whole = [each for each in contacts if not lacks[each]]
        if lacks[""] and len(whole) > 1:
            raise FileError(
                f"{path}: has the contacts {shown(', '.join(whole))}: choose one of them"
            )
        # If all lack something, the message is about the nearest.
        contact = min(lacks, key=lambda each: len(lacks[each]))
    elif not contacts:
        raise FileError(
            f"{path}: contact must be left out: no column is named as pad.vx, got {shown(repr(contact))}"
        )
    else:
        try:
            validation.choice("contact", contact, contacts)
        except InvalidValueError as error:
            raise FileError(f"{path}: {error}") from None
    if lacks[contact]:
        raise FileError(
            f"{path}: has no column {', '.join(lacks[contact])}; found {shown(', '.join(headings))}; needed t, "
            f"{', '.join(TWIST)} (or {', '.join(MOTION)}), {', '.join((*WRENCH, *LOAD))}"
        )
    own = _of_contact(named, contact)
    wanted = [name for name in ("t", *_measured(own), *LOAD) if name in own]
    found = {name: own[name] for name in wanted}
    for name, heading in found.items():
        unit = _parts(heading)[1]
        if unit is not None and unit.lower().replace(" ", "") not in UNITS[name]:
            raise FileError(
                f"{path}: column {shown(repr(heading))} must be in SI units, got {shown(unit)}"
            )
    angle = own.get("theta") or named.get("theta")
    if angle is not None and (_parts(angle)[1] or "rad").strip().lower() == "rad":
        found.setdefault("theta", angle)
    return found


def _named(path: Path, headings: Sequence[str]) -> dict[str, str]:
    """Map names of columns to headings; an alias counts only where the name itself is missing."""
    named: dict[str, str] = {}
    for heading in headings:
        name = _column_name(_parts(heading)[0])
        if name in named:
            raise FileError(
                f"{path}: columns {shown(repr(named[name]))} and {shown(repr(heading))} are the same"
            )
        if name:
            named[name] = heading
    for name in list(named):
        prefix, dot, last = name.rpartition(".")
        if last in ALIASES:
            named.setdefault(prefix + dot + ALIASES[last], named[name])
    return named


def _column_name(heading: str) -> str:
    """Return the name of a column without its unit: "contact.vx" with a small vx, or that of a message's number."""
    message = _MESSAGE.fullmatch(heading.lower())
    if message is not None and ".".join(message.groups()) in MESSAGES:
        return MESSAGES[".".join(message.groups())]
    prefix, dot, name = heading.rpartition(".")
    return prefix + dot + name.lower()


def _parts(heading: str) -> tuple[str, str | None]:
    """Split a heading such as "vx [m/s]" into name and unit."""
    match = _HEADING.fullmatch(heading)
    return (heading, None) if match is None else (match["name"].strip(), match["unit"])


def _of_contact(named: dict[str, str], contact: str) -> dict[str, str]:
    """Return the headings of one contact by the names of their columns, and that of the times, which all share."""
    prefix = f"{contact}." if contact else ""
    own = {
        name.removeprefix(prefix): named[name]
        for name in named
        if name.startswith(prefix)
    }
    return {"t": named["t"], **own} if "t" in named else own


def _measured(named: Collection[str]) -> Sequence[str]:
    """Return the names of the columns of motion and wrench that a file should have: of one axis, if it has no other."""
    there = {*TWIST, *MOTION, *WRENCH}.intersection(named)
    for speed, place, wrench in zip(TWIST, MOTION, WRENCH, strict=True):
        if wrench in there and there <= {speed, place, wrench} and len(there) > 1:
            return (speed if speed in there else place), wrench
    placed = {*MOTION} <= there and not {*TWIST} <= there
    return *(MOTION if placed else TWIST), *WRENCH


def _missing(named: dict[str, str], contact: str, with_load: bool) -> list[str]:
    own = _of_contact(named, contact)
    wanted = ("t", *_measured(own), *(LOAD if with_load else ()))
    return [name for name in wanted if name not in own]
