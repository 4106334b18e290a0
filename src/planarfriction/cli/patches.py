"""Contact patches by name or from a pressure map, as the command line takes them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planarfriction import validation
from planarfriction.errors import InvalidValueError

if TYPE_CHECKING:
    from planarfriction.patch import ContactPatch

WIDTH = 0.02
"""Width of named patches [m], that of the published experiments."""


def find_patch(text: str, *, cell_size: float | None, width: float = WIDTH) -> ContactPatch:
    """The patch called `text` (case does not matter), `width` [m] wide, or the pressure map in the file `text`.

    Raises
    ------
    InvalidValueError
        Unknown name (names the nearest), or a cell size that is missing for a map or given for a name.
    FileError
        The pressure map cannot be read.
    """
    from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch

    makers = {name.lower(): make for name, make in PUBLISHED_PATCHES.items()}
    makers["disc"] = lambda width: ContactPatch.disc(width / 2)
    makers["rectangle"] = lambda width: ContactPatch.rectangle(width)
    if make := makers.get(text.lower()):
        if cell_size is not None:
            raise InvalidValueError("--cell-size", "come with a pressure map", f"{cell_size} for the patch {text}")
        return make(width=width)
    if not (Path(text).suffix or Path(text).exists()):
        validation.choice("patch", text, [*PUBLISHED_PATCHES, "disc", "rectangle", "a pressure map file"])
    return pressure_map(text, cell_size)


def pressure_map(path: str | Path, cell_size: float | None) -> ContactPatch:
    """The patch of a pressure map file with cells of `cell_size` [m]."""
    from planarfriction.patch import ContactPatch

    if cell_size is None:
        raise InvalidValueError("--cell-size", f"be given for the pressure map {path}", "none")
    return ContactPatch.from_pressure(path, cell_size)
