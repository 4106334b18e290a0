"""Shapes of scene files that take other keys than a constructor of `ContactPatch`."""

from __future__ import annotations

from typing import Any

from planarfriction.errors import InvalidValueError
from planarfriction.families import PUBLISHED_PATCHES
from planarfriction.patch.contact_patch import ContactPatch


def pressure_map(
    cell_size: Any, file: Any = None, files: Any = None, values: Any = None, loads: Any = None, name: str | None = None
) -> ContactPatch:
    """Return the patch of one map (a file or its values, rows from the top), or of several with their loads [N].

    Raises `InvalidValueError` unless exactly one of `file`, `files` and `values` is given.
    """
    given = {key: value for key, value in (("file", file), ("files", files), ("values", values)) if value is not None}
    if len(given) != 1:
        rule = "have either file or values (or files, one for each load)"
        raise InvalidValueError("pressure map", rule, " and ".join(given) or "none of them")
    if files is not None and loads is None:
        raise InvalidValueError("loads", "be given: the normal force of each of the files", "none")
    return ContactPatch.from_pressure(next(iter(given.values())), cell_size, loads=loads, name=name)


def published(name: str, cells: Any = None, width: Any = None) -> ContactPatch:
    """Return the published patch `name` of so many `cells` along a side, `width` [m] wide."""
    size = {key: value for key, value in (("cells", cells), ("width", width)) if value is not None}
    return PUBLISHED_PATCHES.choose(name)(**size)


def cells(
    positions: Any,
    areas: Any,
    pressure: Any = None,
    grid: Any = None,
    cell_size: Any = None,
    outline: Any = None,
    name: Any = None,
    point_shares: Any = None,
) -> ContactPatch:
    """Return the patch that `ContactPatch.to_dict` described."""
    given = {"positions": positions, "areas": areas, "pressure": pressure, "grid": grid}
    given |= {"cell_size": cell_size, "outline": outline, "name": name, "point_shares": point_shares}
    return ContactPatch.from_dict({key: value for key, value in given.items() if value is not None})
