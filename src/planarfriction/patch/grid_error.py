"""Errors of sums over cells against the continuous patch, and patches of finer cells."""

from __future__ import annotations

import dataclasses
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction import geometry
from planarfriction._support import validation
from planarfriction._support.described import described
from planarfriction.families import SURFACES
from planarfriction.patch.grid import MOST_CELLS, check_cells, point_shares
from planarfriction.patch.pressure import Uniform

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch


def finer(patch: ContactPatch, parts: int, name: str = "parts") -> ContactPatch:
    """Implement `ContactPatch.refined`."""
    parts = validation.count(name, parts, at_most=MOST_CELLS)
    extent = patch.cell_extents()
    if parts == 1 or not extent.any():
        return patch
    check_cells(
        patch.cells * parts ** int(extent.any(axis=0).sum()), f"cells (by {name})"
    )
    fine = (np.arange(parts) - (parts - 1) / 2) / parts
    sides = (fine if side else [0.0] for side in extent.max(axis=0))
    inside = np.stack(np.meshgrid(*sides), -1).reshape(-1, 2)
    times = len(inside)
    (width, height) = patch.cell_size or (0.0, 0.0)
    # What each cell has is repeated.
    fields: dict[str, Any] = {"radii": np.repeat(patch.radii / parts, times)}
    for name, axes in (("metric", 2), ("asymmetry", 1)):
        value = getattr(patch, name)
        if value is not None and value.ndim > axes:
            value = np.repeat(value, times, axis=0)
        fields[name] = value
    positions = patch.positions[:, None] + inside * extent[:, None]
    areas = np.repeat(patch.areas / times, times)
    positions = positions.reshape(-1, 2)
    size = (width / parts, height / parts)
    shares = patch.point_shares
    if shares is not None:
        shares = point_shares(positions, areas, size)
    pressure = patch.pressure.repeated(times)
    return type(patch)(
        positions, areas, pressure, None, patch.name, size, shares, **fields
    )


NEAREST = 60
"""Largest number of cells, those nearest to the centre of pressure, beside which the centre of rotation is placed."""

BESIDE = (0.01,)
"""Distance of the centre of rotation from the middle of a cell, in cells: a point there
pulls with all its load, while its continuous friction nearly cancels."""

BESIDE_DISCS = (0.01, 0.2, 0.35, 0.5)
"""Distances of the centre of rotation from the middle of a disc, in cells: a disc
differs most at its rim."""

FINER = 3
"""Refinement by which a pressure that is given by a law, and not cell by cell, is taken to be continuous."""

DIRECTIONS = 200
"""Number of directions of the load in which breakaway is compared."""


@described
@dataclass(frozen=True)
class GridError:
    """Errors of a sum over cells against the continuous patch, per unit friction; `print` shows them in percent."""

    force: float
    """Largest error of the force of steady sliding, `|f_cells - f|/(mu f_N)`, while the patch turns about a point that
    is at most a contact radius from its centre of pressure [-]."""
    torque: float
    """Largest error of the torque about the centre of pressure of the same, `|tau_cells - tau|/(mu f_N r)` [-]."""
    breakaway: float
    """Largest relative error of the load at slip onset, over all directions of the load [-]."""
    cells: int
    """Number of cells."""
    as_discs: GridError | None = None
    """The same of `ContactPatch.discs()`, each cell a small disc, where cells are points; else None."""

    def __str__(self) -> str:
        errors = ", ".join(
            f"{name} {100.0 * getattr(self, name):.2g} %"
            for name in ("force", "torque", "breakaway")
        )
        discs = ""
        if self.as_discs is not None:
            discs = f"; as discs {self.as_discs}".partition(" (")[0]
        return f"{errors} ({self.cells} cells){discs}"


def grid_error(
    patch: ContactPatch, normal_force: float | None, refined: int
) -> GridError:
    """Implement `ContactPatch.grid_error`."""
    # Of the patch's size, said when it was made.
    with warnings.catch_warnings(action="ignore"):
        fine = finer(patch, refined, "refined")
    if not patch.cell_extents().any():
        return GridError(0.0, 0.0, 0.0, fine.cells)
    exact = _continuous(patch, normal_force)
    discs = None if fine.has_discs else _error(fine.discs(), exact, normal_force)
    return dataclasses.replace(_error(fine, exact, normal_force), as_discs=discs)


def _error(fine: ContactPatch, exact: Any, normal_force: float | None) -> GridError:
    """Return the errors of the sum over the cells of a patch against an exact surface."""
    cells = SURFACES["cells"](fine, normal_force=normal_force)
    centre = exact.centre_of_pressure
    radius = exact.contact_radius
    x, y = _beside_cells(fine, centre, radius, normal_force)
    turns = np.stack([y, -x, np.ones_like(x)], -1)  # about (x, y) with 1 rad/s
    fx, fy, torque = geometry.wrench_at(
        cells.wrench(turns) - exact.wrench(turns), centre
    ).T
    breakaway = cells.compare(exact, samples=DIRECTIONS).radius.largest
    return GridError(
        float(np.hypot(fx, fy).max()),
        float(np.abs(torque).max()) / radius,
        breakaway,
        fine.cells,
    )


def _continuous(patch: ContactPatch, normal_force: float | None):
    """Return the exact limit surface of the outline, or of cells so small that a pressure law is continuous on them."""
    exact = SURFACES["exact"](patch, normal_force=normal_force)
    pressure = patch.pressure
    by_law = pressure.repeated(2) is pressure and not isinstance(pressure, Uniform)
    if exact.integrates_outline or not by_law:
        return exact
    return SURFACES["exact"](patch.refined(FINER), normal_force=normal_force)


def _beside_cells(
    patch: ContactPatch, centre: np.ndarray, radius: float, normal_force: float | None
) -> np.ndarray:
    """Return points to all four sides of the middles of loaded cells, `[2, M]` [m].

    Of the cells within `radius` [m] of `centre` those nearest to it, or the nearest of all.
    """
    loaded = np.flatnonzero(patch.weights(normal_force) > 0.0)
    distance = np.hypot(*(patch.positions[loaded] - centre).T)
    order = np.argsort(distance, kind="stable")[:NEAREST]
    near = loaded[order[distance[order] <= max(radius, distance.min())]]
    sides = np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
    away = BESIDE_DISCS if patch.has_discs else BESIDE
    sides = np.concatenate([distance * sides for distance in away])
    points = patch.positions[near, None] + sides * patch.cell_extents()[near, None]
    return points.reshape(-1, 2).T
