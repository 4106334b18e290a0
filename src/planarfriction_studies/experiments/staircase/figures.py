"""Figures of the staircase: the whole profile, and its telling parts."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.plots.style import LINE_STYLES, PlotFigure, new_figure, tidy
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.experiment import Arrays

PANELS = (("fx", "$f_x$ [N]", 1.0), ("fy", "$f_y$ [N]", 1.0), ("tau", "$\\tau$ [N mm]", 1e3))
LINES = (
    ("plain", "plain sum", "-", 1.3),
    ("bilinear", "bilinear smoothing", "-", 1.3),
    ("rod", "rod, exact", LINE_STYLES[1], 1.1),
)
COLOURS = {"plain": looks.DISTRIBUTED, "bilinear": looks.REDUCED, "rod": looks.EXACT}


def overview(time: np.ndarray, found: Arrays) -> PlotFigure:
    """Draw the force [N] and torque [N mm] over the whole profile."""
    figure = new_figure(9.0, 7.2)
    panels = figure.subplots(3, 1, sharex=True)
    for axes, column in zip(panels, range(3), strict=True):
        _draw(axes, time, found, column, (0.0, 5.0), size=3.0)
    panels[-1].set_xlabel("time [s]")
    looks.legend(figure, panels[0], 5)
    return figure


def zoom(time: np.ndarray, found: Arrays, edge: dict[str, dict[str, float]]) -> PlotFigure:
    """Draw the first steps of fx and of the torque; where the smoothing ends, at the times that `edge` holds."""
    figure = new_figure(9.6, 6.4)
    panels = figure.subplots(2, 2)
    high, low = edge["high"]["time"], edge["low"]["time"]
    parts = (
        (0, (0.79, 0.97), "first steps, force"),
        (2, (0.79, 0.97), "first steps, torque"),
        (0, (high - 0.045, high + 0.03), "centre of rotation leaves at the high edge"),
        (1, (low - 0.06, low + 0.04), "centre of rotation leaves at the low edge"),
    )
    for axes, (column, limits, title) in zip(panels.flat, parts, strict=True):
        _draw(axes, time, found, column, limits)
        axes.set(title=title, xlabel="time [s]")
        axes.title.set_fontsize("medium")
    looks.legend(figure, panels[0, 0], 5)
    return figure


def _draw(
    axes: Any, time: np.ndarray, found: Arrays, column: int, limits: tuple[float, float], *, size: float = 4.0
) -> None:
    component, label, factor = PANELS[column]
    part = (time >= limits[0]) & (time <= limits[1])
    for name, words, line, width in LINES:
        axes.plot(time[part], factor * found[name][part, column], ls=line, lw=width, color=COLOURS[name], label=words)
    for name, marker in (("plain", "o"), ("bilinear", "s")):
        look = {"ms": size, "mew": 0.9, "label": f"published, {name}"}
        looks.vertices(axes, f"staircase/{name}/{component}", factor, COLOURS[name], limits, marker, **look)
    axes.set(ylabel=label, xlim=limits)
    tidy(axes)
