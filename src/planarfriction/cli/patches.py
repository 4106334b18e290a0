"""Contact patches by name or from a pressure map, as the command line takes them."""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable
from pathlib import Path

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from planarfriction.families import PUBLISHED_PATCHES, SHAPES

WIDTH = 0.02
"""Width of named patches [m], that of the published experiments."""

USUAL = "Circle"
"""Patch where none is asked for."""

_PER_WIDTH = {"width": 1.0, "length": 1.0, "radius": 0.5}
"""First parameters of shapes that a width decides, and how large they are for a width of 1."""


def find_patch(text: str | None, *, cell_size: float | None, width: float = WIDTH) -> pf.ContactPatch:
    """Return the patch called `text` (case does not matter), `width` [m] wide, or the pressure map in the file `text`.

    Circle for None, not for an empty text.

    Raises
    ------
    InvalidValueError
        Unknown name (names the nearest), or a cell size that is missing for a map or given for a name.
    FileError
        The pressure map cannot be read.
    """
    text = USUAL if text is None else text
    makers = _shapes(width)
    makers |= {name.lower(): functools.partial(make, width=width) for name, make in PUBLISHED_PATCHES.items()}
    if make := makers.get(text.lower()):
        if cell_size is not None:
            given = f"{cell_size} for the patch {text}"
            raise InvalidValueError("--cell-size", "be given only for a pressure map", given)
        return make()
    if not (Path(text).suffix or (text and os.path.exists(text))):
        from planarfriction import validation  # loads NumPy

        validation.choice("patch", text, [*patch_names(), "a pressure map file"])
    return pressure_map(text, cell_size)


def patch_names() -> list[str]:
    """Return names that `find_patch` knows."""
    return [*PUBLISHED_PATCHES, *(name for name in _shapes(WIDTH) if name.title() not in PUBLISHED_PATCHES)]


def _shapes(width: float) -> dict[str, Callable[[], pf.ContactPatch]]:
    """Return the shapes that their width alone describes, by name."""
    makers = {}
    for name, make in SHAPES.items():
        parameters = list(inspect.signature(make).parameters.values())  # none, in a shape of one's own
        if any(each.default is each.empty for each in parameters[1:]):
            continue
        if parameters and parameters[0].name in _PER_WIDTH:
            makers[name] = functools.partial(make, _PER_WIDTH[parameters[0].name] * width)
    return makers


def pressure_map(path: str | Path, cell_size: float | None) -> pf.ContactPatch:
    """Return the patch of a pressure map file with cells of `cell_size` [m]."""

    if cell_size is None:
        raise InvalidValueError("--cell-size", f"be given for the pressure map {path}", "none")
    return pf.ContactPatch.from_pressure(path, cell_size)
