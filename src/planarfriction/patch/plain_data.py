"""A patch as numbers, strings and lists, and back."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from planarfriction import validation
from planarfriction.patch import outline as outlines
from planarfriction.patch.grid import Grid
from planarfriction.patch.pressure import Pressure

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch


def to_dict(patch: ContactPatch) -> dict[str, Any]:
    """Implement `ContactPatch.to_dict`."""
    data = {
        "shape": "cells",
        "name": patch.name,
        "positions": patch.positions.tolist(),
        "areas": patch.areas.tolist(),
        "pressure": patch.pressure.to_dict(),
        **patch._anisotropy_to_dict(),
        **outlines.outline_to_dict(patch.outline),
    }
    if patch.cell_size is not None:
        data["cell_size"] = list(patch.cell_size)
    return data if patch.grid is None else {**data, "grid": dataclasses.asdict(patch.grid)}


def from_dict(make: type[ContactPatch], data: Mapping[str, Any]) -> ContactPatch:
    """Implement `ContactPatch.from_dict`."""
    optional = ("shape", "name", "pressure", "grid", "cell_size", "metric", "asymmetry", "outline")
    validation.keys("patch", data, required=("positions", "areas"), optional=optional)
    validation.choice("patch shape", data.get("shape", "cells"), ("cells",))
    pressure, grid = data.get("pressure"), data.get("grid")
    if isinstance(pressure, Mapping):
        pressure = Pressure.from_dict(pressure)
    if grid is not None:
        validation.keys("grid", grid, required=[entry.name for entry in dataclasses.fields(Grid)])
        grid = Grid(**grid)
    name, options = data.get("name", "patch"), {key: data.get(key) for key in ("cell_size", "metric", "asymmetry")}
    patch = make(data["positions"], data["areas"], pressure, grid, name, **options)
    return outlines.with_outline(patch, outlines.outline_from_dict(data.get("outline")))
