"""Patches of finer cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planarfriction import validation
from planarfriction.patch.grid import MOST_CELLS, check_cells
from planarfriction.patch.point_shares import point_shares

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch


def refined(patch: ContactPatch, parts: int, name: str = "parts") -> ContactPatch:
    """Implement `ContactPatch.refined`."""
    parts, extent = validation.count(name, parts, at_most=MOST_CELLS), patch.cell_extents()
    if parts == 1 or not extent.any():
        return patch
    check_cells(patch.cells * parts ** int(extent.any(axis=0).sum()), f"cells (by {name})")
    fine = (np.arange(parts) - (parts - 1) / 2) / parts
    inside = np.stack(np.meshgrid(*(fine if side else [0.0] for side in extent.max(axis=0))), -1).reshape(-1, 2)
    times, (width, height) = len(inside), patch.cell_size or (0.0, 0.0)
    own = {"metric": (patch.metric, 2), "asymmetry": (patch.asymmetry, 1)}  # what each cell has is repeated
    fields = {
        name: value if value is None or value.ndim == axes else np.repeat(value, times, axis=0)
        for name, (value, axes) in own.items()
    }
    positions, areas = patch.positions[:, None] + inside * extent[:, None], np.repeat(patch.areas / times, times)
    positions, size = positions.reshape(-1, 2), (width / parts, height / parts)
    shares = None if patch.point_shares is None else point_shares(positions, areas, size)
    pressure = patch.pressure.repeated(times)
    return type(patch)(positions, areas, pressure, None, patch.name, size, shares, **fields)
