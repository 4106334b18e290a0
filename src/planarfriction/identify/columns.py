"""Columns of log files: finding the required names among the existing ones."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from planarfriction import validation
from planarfriction.errors import FileError, InvalidValueError, shown

TIME = ("t",)
TWIST = ("vx", "vy", "omega")
MOTION = ("x", "y", "theta")
WRENCH = ("fx", "fy", "tau")
LOAD = ("normal_force",)

ALIASES = {"time": "t", "time_s": "t", "t_s": "t", "fn": "normal_force", "wz": "omega"}
"""Other names of columns, in small letters."""

UNITS = {
    "t": ("s",),
    **dict.fromkeys(("vx", "vy"), ("m/s",)),
    "omega": ("rad/s", "1/s"),
    **dict.fromkeys(("x", "y"), ("m",)),
    "theta": ("rad",),
    **dict.fromkeys(("fx", "fy", "normal_force"), ("n",)),
    "tau": ("nm", "n*m", "n.m", "n·m"),
}
"""Units that may stand in brackets behind a name, in small letters and without spaces."""

_HEADING = re.compile(r"(?P<name>[^\[(]*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?")


def find_columns(path: Path, headings: Sequence[str], *, contact: str | None, with_load: bool) -> dict[str, str]:
    """Heading of each column of a log that a file has: `t`, twist or else motion, wrench, normal force if there.

    Names are read without regard to case and may carry a unit in brackets; `ALIASES` are known. Where columns are named
    "contact.vx", those of `contact` are taken, or of the only contact that has them all.

    Raises FileError for a column that is missing, that is there twice, or that has another unit.
    """
    named = _named(path, headings)
    contacts = sorted({name.rpartition(".")[0] for name in named} - {""})
    if contact is not None:
        try:
            contact = validation.choice("contact", contact, contacts)
        except InvalidValueError as error:
            raise FileError(f"{path}: {error}") from None
    elif _missing(named, "", with_load):
        whole = [each for each in contacts if not _missing(named, f"{each}.", with_load)]
        if len(whole) > 1:
            raise FileError(f"{path}: has the contacts {shown(', '.join(whole))}: choose one of them")
        contact = whole[0] if whole else None
    prefix = "" if contact is None else f"{contact}."
    if missing := _missing(named, prefix, with_load):
        raise FileError(
            f"{path}: has no column {', '.join(missing)}; found {shown(', '.join(headings))}; needed t, "
            f"{', '.join(TWIST)} (or {', '.join(MOTION)}), {', '.join((*WRENCH, *LOAD))}"
        )
    motion = _motion(named, prefix)
    wanted = [name for name in (*motion, *WRENCH, *LOAD) if prefix + name in named]
    found = {"t": named.get(f"{prefix}t") or named["t"], **{name: named[prefix + name] for name in wanted}}
    for name, heading in found.items():
        unit = _parts(heading)[1]
        if unit is not None and unit.lower().replace(" ", "") not in UNITS[name]:
            raise FileError(f"{path}: column {shown(repr(heading))} must be in SI units, got {shown(unit)}")
    return found


def _named(path: Path, headings: Sequence[str]) -> dict[str, str]:
    """Heading of each name: as it stands, else its first alias."""
    named: dict[str, str] = {}
    for heading in headings:
        prefix, dot, name = _parts(heading)[0].rpartition(".")
        name = prefix + dot + name.lower()
        if name in named:
            raise FileError(f"{path}: columns {shown(repr(named[name]))} and {shown(repr(heading))} are the same")
        if name:
            named[name] = heading
    for name in list(named):
        prefix, dot, last = name.rpartition(".")
        if last in ALIASES:
            named.setdefault(prefix + dot + ALIASES[last], named[name])
    return named


def _parts(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as "vx [m/s]"."""
    match = _HEADING.fullmatch(heading)
    return (heading, None) if match is None else (match["name"].strip(), match["unit"])


def _motion(named: dict[str, str], prefix: str) -> Sequence[str]:
    twist, motion = (all(prefix + name in named for name in names) for names in (TWIST, MOTION))
    return MOTION if motion and not twist else TWIST


def _missing(named: dict[str, str], prefix: str, with_load: bool) -> list[str]:
    wanted = (*_motion(named, prefix), *WRENCH, *(LOAD if with_load else ()))
    lacking = [name for name in wanted if prefix + name not in named]
    return [*([] if "t" in named or f"{prefix}t" in named else TIME), *lacking]
