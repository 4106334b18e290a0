"""Pressure map of a contact patch."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.ticker import MaxNLocator

import planarfriction as pf
from planarfriction._support import validation
from planarfriction._support.shown import Unit, unit_for
from planarfriction.patch.grid import grid_sides
from planarfriction.plots import style, symbols

MOST_EDGES = 5000
"""Cells whose edges are drawn: those of more would hide them."""

NARROWEST = 0.3
"""Least side of the view over the other one [-]: ticks need room."""

_CORNERS = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


def plot_patch(
    patch: pf.ContactPatch,
    *,
    normal_force: float | None = None,
    size: Any = None,
    ax: Any = None,
) -> style.PlotFigure:
    """Draw the pressure on a patch, and its centre of pressure.

    Cells of a grid are drawn with their true area at their true centroid and coloured by their pressure; a
    patch without a grid is drawn as points, or as its discs, coloured by the force on them, `w f_N`. Without
    `normal_force` [N] the colours show both per newton of load. Lengths in mm. `size` is the width and the height of
    the figure [inch]; `ax` are axes to draw into instead of a new figure, without a legend.

    Raises InvalidValueError unless `patch` is a patch, for a load below zero, without a load that is needed, and for a
    wrong size or axes.
    """
    validation.instance("patch", patch, pf.ContactPatch, "a ContactPatch")
    load = 1.0 if normal_force is None else normal_force
    load = validation.non_negative("normal_force", load)
    weights = patch.weights(normal_force)
    centre = 1e3 * patch.centre_of_pressure(normal_force)
    figure, axes = style.place(ax, 5.6, _height(patch), size)
    if patch.grid is None:
        drawn, label = _draw_points(axes, patch, weights * load, normal_force)
    else:
        pressure = patch.tile_weights(normal_force) * load / patch.areas
        drawn, label = _draw_cells(axes, patch, patch.grid, pressure, normal_force)
    figure.colorbar(drawn, ax=axes, label=label)
    symbols.centre_of_pressure(axes, centre, 12.0, label="centre of pressure")
    axes.set_aspect("equal")
    limits = 1e-3 * np.array([axes.get_xlim(), axes.get_ylim()])
    sides = np.diff(limits, axis=-1)[:, 0]
    for axis, share in zip((axes.xaxis, axes.yaxis), sides / sides.max(), strict=True):
        number = max(2, round(style.ticks(axes, 6) * share))
        axis.set_major_locator(MaxNLocator(number, steps=[1, 2, 2.5, 5, 10]))
    style.show_lengths(axes, float(np.abs(limits).max()))
    if ax is not None:
        axes.set_title(style.wrapped(patch.name, 24), fontsize="medium")
    else:
        narrow = figure.get_figwidth() < style.NARROW
        title = _title(patch, weights, normal_force, 44 if narrow else 62)
        figure.suptitle(title, fontsize="small" if narrow else "medium")
        figure.legend(
            *axes.get_legend_handles_labels(),
            loc="outside lower center",
            frameon=False,
            fontsize="small",
        )
    style.tidy(axes)
    return figure


def cell_boxes(patch: pf.ContactPatch, grid: pf.Grid) -> np.ndarray:
    """Return the corners of the cells of a patch on a grid, `[N, 4, 2]` [m], contact frame.

    A cell cut by the rim is drawn as a smaller box of the area and at the centroid of the part inside.
    """
    box = _CORNERS * (grid.cell_width, grid.cell_height)
    scale = np.sqrt(patch.areas / grid.cell_area)
    return patch.positions[:, None, :] + scale[:, None, None] * box


def _height(patch: pf.ContactPatch) -> float:
    """Return the height of the figure [inch] that fits the proportions of the patch."""
    if patch.grid is None:
        return 4.6
    width, height = grid_sides(patch.grid)
    return float(np.clip(1.2 + 3.4 * height / width, 2.6, 5.6))


def _draw_cells(
    axes,
    patch: pf.ContactPatch,
    grid: pf.Grid,
    pressure: np.ndarray,
    normal_force: float | None,
):
    unit = unit_for("pressure", pressure)
    edges: Any = (
        {"edgecolor": "white", "linewidth": 0.25}
        if len(pressure) < MOST_EDGES
        else {"edgecolor": "face"}
    )
    cells = PolyCollection(
        list(1e3 * cell_boxes(patch, grid)), cmap=style.PRESSURE_MAP, **edges
    )
    cells.set_array(unit.factor * pressure)
    cells.set_clim(0.0, unit.factor * float(pressure.max()) or 1.0)
    axes.add_collection(cells)
    sides = 1e3 * grid_sides(grid)
    middle = 1e3 * np.array([grid.x_min, grid.y_min]) + 0.5 * sides
    half = 0.5 * np.maximum(sides, NARROWEST * sides.max()) + 0.03 * sides.max()
    limits = np.stack([middle - half, middle + half], -1)
    axes.set(xlim=limits[0], ylim=limits[1])
    if normal_force is None:
        return cells, f"pressure per load [{unit.label}/N]"
    return cells, f"pressure [{unit.label}]"


def _draw_points(
    axes, patch: pf.ContactPatch, force: np.ndarray, normal_force: float | None
):
    share = force / force.max() if force.any() else np.zeros_like(force)
    unit = unit_for("force", force) if normal_force is not None else Unit(1.0, "-")
    look: Any = {"cmap": style.PRESSURE_MAP, "edgecolor": "0.3", "linewidth": 0.6}
    places = 1e3 * patch.positions
    points = axes.scatter(
        *places.T, s=30 + 170 * share, c=unit.factor * force, vmin=0.0, **look
    )
    axes.margins(0.2)
    if patch.has_discs:
        points.set_sizes(np.where(patch.radii > 0.0, 0.0, points.get_sizes()))
        wide = 2e3 * patch.radii
        options = {"units": "xy", "offsets": places, "offset_transform": axes.transData}
        round_ones = wide, wide, np.zeros(len(wide))
        values = unit.factor * force
        discs = EllipseCollection(*round_ones, array=values, **options, **look)
        discs.set_clim(0.0, unit.factor * float(force.max()) or 1.0)
        axes.add_collection(discs)
        radii = 1e3 * patch.radii[:, None]
        axes.update_datalim(np.concatenate([places - radii, places + radii]))
        axes.margins(0.08)
    name = "fraction of the normal force" if normal_force is None else "normal force"
    return points, f"{name} [{unit.label}]"


def _title(
    patch: pf.ContactPatch, weights: np.ndarray, normal_force: float | None, width: int
) -> str:
    loaded = int((weights > 0.0).sum())
    size = patch.contact_radius(normal_force)
    radius = unit_for("length", size)
    what = "point" if patch.grid is None else "cell"
    what = ("disc" if patch.has_discs else what) + "s" * (loaded != 1)
    parts = [
        f"{patch.name}: {loaded} loaded {what}",
        f"r = {radius.factor * size:.3g} {radius.label}",
    ]
    if normal_force is not None:
        force = unit_for("force", normal_force)
        parts.append(f"load {force.factor * normal_force:.6g} {force.label}")
    # A number keeps its unit.
    whole = [part.replace(" ", "\N{NO-BREAK SPACE}") for part in parts[1:]]
    return style.wrapped(", ".join(parts[:1] + whole), width)
