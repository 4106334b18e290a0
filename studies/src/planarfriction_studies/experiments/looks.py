"""Style of the report's figures: one colour for each model, others for shapes, solvers and loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.plots import style
from planarfriction.plots.style import (
    DISTRIBUTED,
    ELLIPSOID,
    PUBLISHED,
    REDUCED,
    REFERENCE,
    PlotFigure,
)
from planarfriction_studies.experiments import facts

__all__ = ["DISTRIBUTED", "ELLIPSOID", "PUBLISHED", "QUARTIC", "REDUCED", "REFERENCE"]

QUARTIC = style.OTHER
"""Colour of the quartic surface."""

OTHERS = (REDUCED, "0.0", "0.45", "0.7")
"""Colours of what is no model: shapes, solvers, components, loads, causes; blue for the one that is meant."""

OF_MODEL = {"d": DISTRIBUTED, "r": PUBLISHED, "e": ELLIPSOID}
"""Letter of a model in the names of curves -> its colour."""


def vertices(
    axes: Any,
    name: str,
    factor: float,
    colour: str,
    shown: Any = slice(None),
    marker: str = "o",
    **look: Any,
) -> None:
    """Draw the vertices of a published curve, in shown units per SI unit; `shown`: which, or from when to when [s]."""
    curve = facts.published_curve(name)
    part = (
        shown
        if isinstance(shown, slice)
        else (curve.time >= shown[0]) & (curve.time <= shown[1])
    )
    look = {"ms": 3.0, "mfc": "white", "mec": colour, "mew": 0.7, "zorder": 3} | look
    axes.plot(
        curve.time[part], factor * curve.values[part], ls="", marker=marker, **look
    )


def panels(
    width: float, height: float, rows: int = 1, columns: int = 1, **options: Any
) -> tuple[PlotFigure, Any]:
    """Return a figure of `width` x `height` inches and its tidy panels, as `Figure.subplots` makes them."""
    figure = style.new_figure(width, height)
    made: Any = figure.subplots(rows, columns, **options)
    for axes in np.ravel(made):
        style.tidy(axes)
    return figure, made


def box_panels(names: list[str], height: float) -> tuple[PlotFigure, Any]:
    """Return a figure of two panels, one above the other, with a place for the boxes of each name."""
    figure, made = panels(9.6, height, 2, sharex=True)
    for axes in made:
        axes.grid(False, axis="x")
    made[1].set_xticks(range(len(names)), names)
    figure.align_ylabels(made)
    return figure, made


def box(
    axes: Any, at: float, numbers: Any, colour: str, width: float, filled: bool = True
) -> None:
    """Draw a box of low whisker, first quartile, median, third quartile, high whisker; a sixth number is a cross."""
    low, first, median, third, high, *most = numbers
    line = {"color": colour, "linewidth": 1.1}
    axes.bxp(
        [{"whislo": low, "q1": first, "med": median, "q3": third, "whishi": high}],
        positions=[at], widths=width, showfliers=False, patch_artist=True, manage_ticks=False,
        boxprops={"facecolor": colour if filled else "white", "edgecolor": colour, "linewidth": 1.1},
        medianprops={"color": "white" if filled else colour, "linewidth": 1.5}, whiskerprops=line, capprops=line,
    )  # fmt: skip
    if most:
        axes.plot(at, *most, marker="x", ms=5, mew=1.4, color=colour)


def span(axes: Any, at: float, numbers: Any, colour: str) -> None:
    """Draw the numbers of a box as a dot at the median, a broad line of quartiles, a thin range and a cross."""
    low, first, median, third, high, *most = numbers
    axes.vlines(at, low, high, color=colour, lw=1.0)
    axes.vlines(at, first, third, color=colour, lw=4.0)
    axes.plot(at, median, "o", ms=5, color=colour, mec="white", mew=0.6, zorder=4)
    if most:
        axes.plot(at, *most, marker="x", ms=4, mew=1.1, color=colour)


def box_legend(
    figure: PlotFigure,
    colours: dict[str, str],
    columns: int,
    also: dict[str, str] | None = None,
) -> None:
    """Draw the legend of boxes by their words, filled, then `also` open ones, and of the crosses of maxima."""
    from matplotlib.patches import Patch

    filled = [
        Patch(facecolor=colour, edgecolor=colour, label=words)
        for words, colour in colours.items()
    ]
    empty = [
        Patch(facecolor="white", edgecolor=colour, label=words)
        for words, colour in (also or {}).items()
    ]
    cross = line_key("maximum", ls="", marker="x", ms=5, mew=1.4, color="0.3")
    legend(
        figure,
        [*filled, *empty, cross],
        columns,
        fontsize="medium" if also else "small",
    )


def line_key(label: str, **look: Any) -> Any:
    """Return an entry of a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **look)


AXES = {
    "normal_force": ("normal force [N]", 1.0),
    "x": ("$x$ [mm]", 1e3),
    "y": ("$y$ [mm]", 1e3),
    "theta": ("$\\theta$ [deg]", 180.0 / np.pi),
    "fx": ("$f_x$ [N]", 1.0),
    "fy": ("$f_y$ [N]", 1.0),
    "tau": ("$\\tau$ [N mm]", 1e3),
}
"""Column of a run -> its label on an axis, shown units per SI unit."""


def legend(
    figure: PlotFigure, handles: Any, columns: int, place: str = "upper", **options: Any
) -> None:
    """Draw the legend of a whole figure, above or below it; `handles`: entries, or axes that have them."""
    if not isinstance(handles, list):
        handles, options["labels"] = handles.get_legend_handles_labels()
    loc: Any = f"outside {place} center"
    figure.legend(handles=handles, loc=loc, ncols=columns, frameon=False, **options)
