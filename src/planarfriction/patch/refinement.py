"""The same patch on finer cells."""

from __future__ import annotations

import numpy as np

from planarfriction.patch.contact_patch import ContactPatch
from planarfriction.patch.size import check_cells


def refined(patch: ContactPatch, parts: int) -> ContactPatch:
    """Implement `ContactPatch.refined`."""
    extent = patch.cell_extents()
    if parts == 1 or not extent.any():
        return patch
    check_cells(patch.cells * parts ** int(extent.any(axis=0).sum()))
    fine = (np.arange(parts) - (parts - 1) / 2) / parts
    offsets = [fine if side else np.zeros(1) for side in extent.max(axis=0)]
    inside = np.stack([axis.ravel() for axis in np.meshgrid(*offsets)], -1)
    positions = (patch.positions[:, None] + inside * extent[:, None]).reshape(-1, 2)
    pressure = patch.pressure.repeated(len(inside))
    areas = np.repeat(patch.areas / len(inside), len(inside))
    width, height = patch.cell_size or (0.0, 0.0)
    metric, asymmetry = (_repeated(each, size, len(inside)) for each, size in ((patch.metric, 2), (patch.asymmetry, 1)))
    size = (width / parts, height / parts)
    return ContactPatch(positions, areas, pressure, None, patch.name, size, metric=metric, asymmetry=asymmetry)


def _repeated(value: np.ndarray | None, size: int, times: int) -> np.ndarray | None:
    """Return a metric or an asymmetry for the new cells: what each cell has for itself is repeated."""
    return value if value is None or value.ndim == size else np.repeat(value, times, axis=0)
