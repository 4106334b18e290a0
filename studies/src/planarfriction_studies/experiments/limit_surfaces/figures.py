"""Figures of the limit surfaces: all six, which point belongs to which twist, and the gradient line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planarfriction.limit_surface import LimitSurfaceCells, LimitSurfaceEllipsoid
from planarfriction.plots.limit_surface import draw_surface, scaled_samples
from planarfriction.plots.style import (
    LINE_STYLES,
    LINES,
    PAGE,
    PlotFigure,
    new_figure,
    paper,
    tidy,
)
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.limit_surfaces.patches import spin_about
from planarfriction_studies.experiments.runs import IN_WORDS

SUM, BESIDE, LINK = looks.DISTRIBUTED, looks.ELLIPSOID, "0.45"
"""Colours of the sum over the cells, of the ellipsoid, and of what joins them."""

ACROSS_Y = ("NonConvex1", "NonConvex2")
"""Shapes that extend along x: their section is that of twists (0, vy, omega), of the others (vx, 0, omega)."""

MATCHED = (120, 200, 1000)
"""Twists of a section, of 1441, that are marked on both surfaces."""


def overview(
    surfaces: Mapping[str, LimitSurfaceCells], *, coarse: bool = False
) -> PlotFigure:
    """Draw the six limit surfaces, with circles of the ellipsoid (there the unit sphere) around them."""
    figure = new_figure(10.0, 6.6)
    count = 10 if coarse else 48
    polar = np.linspace(0.0, np.pi, count + 1)[:, None]
    azimuth = np.linspace(0.0, 2.0 * np.pi, 2 * count + 1)[None, :]
    for place, (name, surface) in enumerate(surfaces.items()):
        axes: Any = figure.add_subplot(2, 3, place + 1, projection="3d")
        directions, mesh = scaled_samples(surface, polar, azimuth)
        draw_surface(axes, mesh, directions, 1.05)
        for each in axes.collections:
            each.set_rasterized(True)  # thousands of facets
        axes.set_proj_type("ortho")  # the outline of a sphere is then a great circle
        axes.set_box_aspect((1.0, 1.0, 1.0), zoom=0.84)
        axes.tick_params(labelsize="x-small", pad=0)
        ticks: Any = {f"{name}ticks": [-1, 0, 1] for name in "xyz"}
        axes.set(
            xlabel="$f_x$ [-]", ylabel="$f_y$ [-]", zlabel="$\\tau/r$ [-]", **ticks
        )
        axes.zaxis.labelpad = -6
        _circles(axes)
        axes.set_title(IN_WORDS[name], fontsize="medium", y=0.95)
    return figure


def _circles(axes: Any) -> None:
    """Draw the outline of the unit sphere, and the near halves of its equator and two meridians."""
    elevation, azimuth = np.radians([axes.elev, axes.azim])
    towards = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    for axis in (2, 1, 0):
        ring = np.insert([np.cos(around), np.sin(around)], axis, 0.0, axis=0)
        near = np.where(towards @ ring > 0.0, ring, np.nan)
        axes.plot(*near, color=BESIDE, lw=0.9, zorder=10)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    outline = np.outer(right, np.cos(around)) + np.outer(
        np.cross(towards, right), np.sin(around)
    )
    axes.plot(*outline, color=BESIDE, lw=1.3, zorder=10)


def correspondence(surfaces: Mapping[str, LimitSurfaceCells]) -> PlotFigure:
    """Draw a section of both surfaces of each shape; for three twists a line joins the wrenches on both."""
    with paper():
        figure = new_figure(PAGE, 4.9)
        panels = figure.subplots(2, 3)
        for axes, (name, surface) in zip(panels.flat, surfaces.items(), strict=True):
            _section(axes, surface, 1 if name in ACROSS_Y else 0)
            axes.set_title(IN_WORDS[name], pad=3.0)
        for axes in panels[:, 1:].flat:
            axes.set_ylabel("")
        looks.legend(figure, panels[0, 0], 3)
    return figure


def _section(axes: Any, surface: LimitSurfaceCells, column: int) -> None:
    """Draw points (f, tau/r) of twists (v, r omega) with velocity along one axis, f the force along it."""
    ellipsoid = LimitSurfaceEllipsoid(surface.patch)
    exact, beside = (_points_of(each, column, 1441) for each in (surface, ellipsoid))
    axes.plot(*exact, color=looks.REFERENCE, lw=1.3, label="sum over the cells")
    dashes = LINES[BESIDE]
    axes.plot(*beside, color=BESIDE, lw=1.3, ls=dashes, label="ellipsoid")
    for place, label in zip(MATCHED, ("same twist", None, None), strict=True):
        ends = np.stack([exact[:, place], beside[:, place]], axis=1)
        axes.plot(*ends, "o-", color=LINK, ms=2.6, lw=0.9, label=label)
    force = ("$f_x$", "$f_y$")[column]
    axes.set_xlabel(f"{force} / $\\mu f_N$")
    axes.set_ylabel("$\\tau$ / $\\mu f_N r$")
    axes.set(aspect="equal", xlim=(-1.12, 1.12), ylim=(-1.12, 1.12))
    axes.set(xticks=[-1, 0, 1], yticks=[-1, 0, 1])
    tidy(axes)


def _points_of(
    surface: Any, column: int, count: int, *, closed: bool = True
) -> np.ndarray:
    """Return force along axis `column` and torque over r, `[2, count]`, of twists at equal angles around a section."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=closed)
    azimuth = np.where(angle <= np.pi, 0.0, np.pi) + 0.5 * np.pi * column
    points = scaled_samples(
        surface, np.where(angle <= np.pi, angle, 2.0 * np.pi - angle), azimuth
    )[1]
    return points[:, [column, 2]].T


def gradient_line(surface: LimitSurfaceCells, numbers: dict[str, Any]) -> PlotFigure:
    """Draw the line and its load, the force over the centre of rotation, and the section with the two spins marked."""
    figure, (load, force, section) = looks.panels(
        10.0, 4.6, 1, 3, width_ratios=(0.55, 1.0, 1.25)
    )
    sides = surface, LimitSurfaceEllipsoid(surface.patch)
    centres = (
        (
            "about the centre of pressure",
            numbers["cells"]["centre of pressure"],
            looks.OTHERS[1],
            "D",
        ),
        (
            "about the middle of the load",
            numbers["cells"]["middle cell"],
            looks.OTHERS[2],
            "o",
        ),
    )
    _load_panel(load, numbers, centres)
    _force_panel(force, sides, numbers, centres)
    _spin_panel(section, sides, numbers, centres)
    looks.legend(figure, section, 3, fontsize="small")
    return figure


def _load_panel(axes: Any, numbers: dict[str, Any], centres: Any) -> None:
    cell = 1e3 * numbers["cell"]
    places = 1e3 * np.array(numbers["places"])
    loads = np.array(numbers["loads"])
    axes.barh(places, loads, height=0.85 * cell, color="0.75")
    for _, y, colour, marker in centres:
        axes.axhline(1e3 * y, color=colour, lw=1.2)
        axes.plot([0.0], [1e3 * y], marker=marker, ms=7, color=colour, clip_on=False)
    axes.set(
        xlabel="load of a cell [N]",
        ylabel="y [mm]",
        ylim=(-10.5, 10.5),
        xlim=(0.0, 0.1),
    )


def _force_panel(axes: Any, sides: Any, numbers: dict[str, Any], centres: Any) -> None:
    """Draw fx of unit spins about the points (0, y)."""
    half = 0.5 * numbers["cell"] * len(numbers["loads"])
    y = np.linspace(-1.25 * half, 1.25 * half, 2001)
    continuous = 1.0 - 2.0 * np.clip((y + half) / (2.0 * half), 0.0, 1.0) ** 2
    for each, colour in zip(sides, (SUM, BESIDE), strict=True):
        axes.plot(spin_about(each, y)[:, 0], 1e3 * y, color=colour, lw=1.4)
    axes.plot(continuous, 1e3 * y, color=looks.REFERENCE, lw=1.0, ls=LINE_STYLES[1])
    for _, at, colour, marker in centres:
        axes.axhline(1e3 * at, color=colour, lw=0.8)
        for each in sides:
            axes.plot(
                spin_about(each, at)[0],
                1e3 * at,
                marker=marker,
                ms=5,
                color=colour,
                ls="",
            )
    axes.set(
        xlabel="$f_x$ [N]",
        ylabel="centre of rotation, y [mm]",
        ylim=(-10.5, 10.5),
        xlim=(-1.05, 1.05),
    )


def _spin_panel(axes: Any, sides: Any, numbers: dict[str, Any], centres: Any) -> None:
    """Draw the upper half of the section, turned to positive torque: what balances the friction of a negative spin."""
    for each, colour, name in zip(
        sides, (SUM, BESIDE), ("sum over the cells", "ellipsoid"), strict=True
    ):
        axes.plot(*_points_of(each, 0, 2881), color=colour, lw=1.4, label=name)
    axes.plot(
        [],
        [],
        color=looks.REFERENCE,
        lw=1.0,
        ls=LINE_STYLES[1],
        label="continuous pressure",
    )
    for name, y, colour, marker in centres:
        points = [
            spin_about(each, y) / [1.0, 1.0, each.contact_radius] for each in sides
        ]
        axes.plot(
            *np.array(points)[:, [0, 2]].T,
            color=colour,
            lw=0.9,
            marker=marker,
            ms=5.5,
            label=f"spin {name}",
        )
    torque = numbers["cells"]["torque"] / sides[0].contact_radius
    axes.plot(
        [0.0],
        [-torque],
        marker="*",
        ms=10,
        ls="",
        color=looks.REFERENCE,
        label="torque without force",
        zorder=1,
    )
    axes.set(
        xlabel="$f_x$ [-]",
        ylabel="$\\tau/r$ [-]",
        xlim=(-0.32, 0.32),
        ylim=(-1.01, -0.86),
    )
