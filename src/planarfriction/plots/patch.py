"""Pressure map of a contact patch."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.ticker import MaxNLocator

import planarfriction as pf
from planarfriction._support import validation
from planarfriction._support.shown import Unit, unit_for
from planarfriction.plots import style

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
    load = (
        1.0
        if normal_force is None
        else validation.non_negative("normal_force", normal_force)
    )
    weights = patch.weights(normal_force)
    centre = 1e3 * patch.centre_of_pressure(normal_force)
    figure, axes = style.place(ax, 5.6, _height(patch), size)
    if patch.grid is None:
        drawn, label = _draw_points(axes, patch, weights * load, normal_force)
    else:
        pressure = patch.tile_weights(normal_force) * load / patch.areas
        drawn, label = _draw_cells(axes, patch, patch.grid, pressure, normal_force)
    figure.colorbar(drawn, ax=axes, label=label)
    mark = {"marker": "+", "markersize": 13, "linestyle": "none"}
    axes.plot(*centre, **mark, markeredgewidth=4.0, color="white")
    axes.plot(
        *centre,
        **mark,
        markeredgewidth=1.8,
        color=style.PAD_COLOUR,
        label="centre of pressure",
    )
    axes.set_aspect("equal")
    limits = 1e-3 * np.array([axes.get_xlim(), axes.get_ylim()])
    sides = np.diff(limits, axis=-1)[:, 0]
    for axis, share in zip((axes.xaxis, axes.yaxis), sides / sides.max(), strict=True):
        axis.set_major_locator(
            MaxNLocator(
                max(2, round(style.ticks(axes, 6) * share)), steps=[1, 2, 2.5, 5, 10]
            )
        )
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
    ratio = (
        patch.grid.rows
        * patch.grid.cell_height
        / (patch.grid.columns * patch.grid.cell_width)
    )
    return float(np.clip(1.2 + 3.4 * ratio, 2.6, 5.6))


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
    width = 1e3 * grid.columns * grid.cell_width
    height = 1e3 * grid.rows * grid.cell_height
    for set_limits, low, side in (
        (axes.set_xlim, grid.x_min, width),
        (axes.set_ylim, grid.y_min, height),
    ):
        half = 0.5 * max(side, NARROWEST * max(width, height)) + 0.03 * max(
            width, height
        )
        set_limits(1e3 * low + 0.5 * side - half, 1e3 * low + 0.5 * side + half)
    return (
        cells,
        f"pressure [{unit.label}]"
        if normal_force is not None
        else f"pressure per load [{unit.label}/N]",
    )


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
        discs = EllipseCollection(
            wide,
            wide,
            np.zeros(len(wide)),
            array=unit.factor * force,
            **options,
            **look,
        )
        discs.set_clim(0.0, unit.factor * float(force.max()) or 1.0)
        axes.add_collection(discs)
        axes.update_datalim(
            np.concatenate(
                [places + side * 1e3 * patch.radii[:, None] for side in (-1.0, 1.0)]
            )
        )
        axes.margins(0.08)
    name = "share of the normal force" if normal_force is None else "normal force"
    return points, f"{name} [{unit.label}]"


def _title(
    patch: pf.ContactPatch, weights: np.ndarray, normal_force: float | None, width: int
) -> str:
    loaded = int((weights > 0.0).sum())
    radius = unit_for("length", patch.contact_radius(normal_force))
    what = (
        "disc" if patch.has_discs else "point" if patch.grid is None else "cell"
    ) + "s" * (loaded != 1)
    parts = [f"{patch.name}: {loaded} loaded {what}"]
    parts.append(
        f"r = {radius.factor * patch.contact_radius(normal_force):.3g} {radius.label}"
    )
    if normal_force is not None:
        force = unit_for("force", normal_force)
        parts.append(f"load {force.factor * normal_force:.6g} {force.label}")
    # A number keeps its unit.
    whole = [part.replace(" ", "\N{NO-BREAK SPACE}") for part in parts[1:]]
    return style.wrapped(", ".join(parts[:1] + whole), width)
