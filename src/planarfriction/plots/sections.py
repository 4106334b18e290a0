"""Limit surface in three plane sections, with others drawn over it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.patches import PathPatch

import planarfriction as pf
from planarfriction._support import validation
from planarfriction.families import SURFACES
from planarfriction.plots import style, symbols
from planarfriction.plots.limit_surface import even_mesh, kind_of, scaled_samples
from planarfriction.plots.motion import outline_of
from planarfriction.plots.panels import cell_polygons

OF_SURFACE = {
    "exact": style.REFERENCE,
    "cells": style.DISTRIBUTED,
    "table-published": style.PUBLISHED,
    "ellipsoid": style.ELLIPSOID,
}
"""Name of a surface -> its colour where it is drawn over another one."""

PLANES = ((0, 1), (0, 2), (1, 2))
"""Components of the wrench that a section shows; the third one is 0 there."""

LABELS = (r"$f_x\,/\,\mu f_N$", r"$f_y\,/\,\mu f_N$", r"$\tau\,/\,\mu f_N r$")
"""Names of the components, with what they are divided by."""

POLAR = 121
"""Points of the mesh of directions from pole to pole, besides those of `even_mesh`."""

SEAM = 0.1
"""Azimuth at which the mesh begins and ends [rad]: a component that is 0 there would lose half of its line."""

REACH = 1.15
"""Least limit of the axes [-]."""

SEEN = 0.005
"""Difference between two sections that is named [-]."""

LETTER = 8.0
"""Size of letters in narrow figures [pt]."""

PATCH = 0.6
"""Reach of the patch that is drawn into the first section, whose radius is 1 [-]."""


def plot_sections(
    surface: Any, *, beside: Any = "ellipsoid", size: Any = None
) -> style.PlotFigure:
    """Draw the sections fx-fy, fx-tau and fy-tau of a limit surface, with others over them.

    Wrenches are about the centre of pressure, divided by mu f_N and, torques, by mu f_N r, with the contact radius r of
    their own surface; in each section the third component is 0. `surface` is any limit surface; `beside` is another one
    of the same patch, "ellipsoid" for that of the patch, a list of these, or None. The words above a section tell by
    how much the first of them is off at most, in the direction of the wrench. The first section, a circle if friction
    is the same in all directions, also shows the patch. `size` is the width and the height of the figure [inch]; it is
    legible from 3.5 x 1.55 inches on.

    Raises InvalidValueError unless all are limit surfaces, and for a wrong size.
    """
    words = "a limit surface"
    validation.instance("surface", surface, pf.limit_surface.LimitSurface, words)
    others = [_other(each, surface) for each in _listed(beside)]
    figure = style.new_figure(style.PAGE, 2.75, size)
    narrow = figure.get_figwidth() < style.NARROW
    letter = min(rcParams["font.size"], LETTER) if narrow else rcParams["font.size"]
    figure.get_layout_engine().set(w_pad=0.02, h_pad=0.02, wspace=0.03)  # type: ignore[union-attr]
    cuts = [sections(each) for each in (surface, *others)]
    looks = [{"color": style.REFERENCE, "linestyle": "-", "linewidth": 1.5}]
    looks += [_look(each, number) for number, each in enumerate(others)]
    reach = max(REACH, 1.05 * max(np.abs(cut).max() for each in cuts for cut in each))
    panels = figure.subplots(1, 3)
    for number, (axes, (i, j)) in enumerate(zip(panels, PLANES, strict=True)):
        axes.fill(*cuts[0][number].T, color=style.HOLDS, linewidth=0.0)
        for each, look in zip(cuts, looks, strict=True):
            axes.plot(*each[number].T, **look)
        ticks = (-1, 0, 1)
        axes.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach))
        axes.set(xticks=ticks, yticks=ticks)
        axes.set_xlabel(LABELS[i], fontsize=letter)
        axes.set_ylabel(LABELS[j], fontsize=letter, labelpad=-2.0)
        axes.tick_params(labelsize=letter - 1.0)
        if others:
            off = farthest(cuts[1][number], cuts[0][number])
            said = f"up to {100.0 * off:.0f} % off" if off > SEEN else "the same"
            colour = style.LETTERS.get(looks[1]["color"], looks[1]["color"])
            axes.set_title(said, fontsize=letter - 1.0, pad=2.0, color=colour)
        style.tidy(axes)
    _draw_patch(panels[0], surface, narrow)
    names = [f"{surface.patch.name}, {kind_of(surface)}", *map(kind_of, others)]
    figure.legend(
        [panels[0].plot([], [], **look)[0] for look in looks],
        [style.wrapped(name, 24 if narrow else 40) for name in names],
        loc="outside upper center",
        ncols=3,
        frameon=False,
        fontsize=letter - 1.0,
        columnspacing=1.0,
        handlelength=2.2,
    )
    return figure


def sections(surface: Any) -> list[np.ndarray]:
    """Return the closed sections of a surface by `PLANES`, points `[P, 2]` in order of their angle, as in the plot."""
    from contourpy import contour_generator

    polar, azimuth = even_mesh(surface)
    polar = np.union1d(polar, np.linspace(0.0, np.pi, POLAR))
    azimuth = np.union1d(azimuth, np.linspace(0.0, 2.0 * np.pi, 2 * POLAR - 1))
    _, points = scaled_samples(surface, polar[:, None], SEAM + azimuth[None, :])
    found = []
    for i, j in PLANES:
        # Lines of the mesh on which the third component is 0, as places (column, row) between its points.
        lines: Any = contour_generator(z=points[..., 3 - i - j]).lines(0.0)
        cut = np.concatenate([_between(points[..., [i, j]], line) for line in lines])
        cut = cut[np.argsort(np.arctan2(cut[:, 1], cut[:, 0]))]
        found.append(np.concatenate([cut, cut[:1]]))
    return found


def _between(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return `points` `[P, A, 2]` at places (column, row) `[L, 2]` between them."""
    column, row = np.minimum(
        places.astype(int).T, np.subtract(points.shape[1::-1], 2)[:, None]
    )
    across = (places[:, 0] - column)[:, None]
    down = (places[:, 1] - row)[:, None]
    upper = (1.0 - across) * points[row, column] + across * points[row, column + 1]
    lower = (1.0 - across) * points[row + 1, column] + across * points[
        row + 1, column + 1
    ]
    return (1.0 - down) * upper + down * lower


def farthest(cut: np.ndarray, other: np.ndarray) -> float:
    """Return by how much a section is longer or shorter than another one at most, along rays from the centre [-]."""
    rays = np.linspace(-np.pi, np.pi, 721)
    length, right = (
        np.interp(
            rays,
            np.arctan2(each[:-1, 1], each[:-1, 0]),
            np.hypot(*each[:-1].T),
            period=2.0 * np.pi,
        )
        for each in (cut, other)
    )
    return float(np.abs(length / right - 1.0).max())


def _listed(beside: Any) -> Sequence[Any]:
    if beside is None:
        return ()
    return beside if isinstance(beside, (list, tuple)) else (beside,)


def _other(beside: Any, surface: Any) -> Any:
    if isinstance(beside, str) and beside == "ellipsoid":
        load = surface.normal_force
        return pf.LimitSurfaceEllipsoid(surface.patch, normal_force=load)
    words = 'a limit surface, "ellipsoid", a list of these, or None'
    return validation.instance("beside", beside, pf.limit_surface.LimitSurface, words)


def _look(surface: Any, number: int) -> dict[str, Any]:
    """Return the line of a surface that is drawn over another one."""
    colour = OF_SURFACE.get(SURFACES.name_of(surface) or "", style.OTHER)
    line = style.LINES.get(colour, style.LINE_STYLES[(number + 1) % 4])
    return {"color": colour, "linestyle": line, "linewidth": 1.4}


def _draw_patch(axes: Any, surface: Any, narrow: bool) -> None:
    """Draw the patch about its centre of pressure into the section of the force."""
    boxes = cell_polygons(surface.patch) - surface.centre_of_pressure
    boxes = PATCH / max(float(np.abs(boxes).max()), 1e-12) * boxes
    axes.add_patch(PathPatch(outline_of(boxes), fc="0.6", ec="0.6", lw=0.2, zorder=1))
    symbols.centre_of_pressure(axes, (0.0, 0.0), 5.0 if narrow else 8.0)
