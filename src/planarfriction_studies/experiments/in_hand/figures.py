"""Figures of the in-hand experiments: motion, histories, distances, and what moves the end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction.plots.motion import draw_motion
from planarfriction.plots.style import LINE_STYLES, PlotFigure, new_figure, tidy
from planarfriction.scenes import Scene, Solution
from planarfriction.scenes.solution import History
from planarfriction.solvers.statistics import Statistics
from planarfriction_studies.experiments import looks as report_looks
from planarfriction_studies.experiments.experiment import Arrays
from planarfriction_studies.experiments.looks import DISTRIBUTED, EXACT, OTHERS, REDUCED

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

LOOKS: dict[str, dict[str, Any]] = {
    "distributed": {"color": DISTRIBUTED, "linewidth": 1.5},
    "reduced": {"color": REDUCED, "linewidth": 1.5, "linestyle": LINE_STYLES[1]},
}
"""Model -> how its line looks."""


def strobes(panels: Mapping[str, tuple[Scene, Arrays]]) -> PlotFigure:
    """Draw outlines of the plate at twelve instants, one panel for each scene and its run."""
    figure = new_figure(5.0 * len(panels), 4.4)
    parts: Any = figure.subfigures(1, len(panels), squeeze=False)[0]
    for part, (title, (scene, run)) in zip(parts, panels.items(), strict=True):
        histories = {name: History(("time",), run[name], {}) for name in ("time", "x", "y", "theta")}
        draw_motion(part, Solution(histories, Statistics(), "success", "", scene))
        part.suptitle(title, fontsize="medium")
    return figure


def histories(
    panels: Mapping[str, Mapping[str, Arrays]],
    names: Sequence[str],
    *,
    looks: Mapping[str, Mapping[str, Any]] = LOOKS,
    published: Mapping[str, Mapping[str, str]] | None = None,
) -> PlotFigure:
    """Draw columns `names` over time: one column of panels for each title, one line for each label of a run.

    `published` holds, by title and label, the keys of published curves, drawn as markers.
    """
    figure = new_figure(9.6, 0.7 + 1.75 * len(names))
    grid = figure.subplots(len(names), len(panels), sharex=True, sharey="row", squeeze=False)
    for column, (title, runs) in enumerate(panels.items()):
        grid[0, column].set_title(title, fontsize="medium")
        grid[-1, column].set_xlabel("time [s]")
        for axes, name in zip(grid[:, column], names, strict=True):
            _draw_runs(axes, name, runs, looks)
            _draw_published(axes, name, (published or {}).get(title, {}), looks)
            tidy(axes)
    for axes, name in zip(grid[:, 0], names, strict=True):
        axes.set_ylabel(AXES[name][0])
    figure.align_ylabels(grid)
    labels = len(grid[-1, 0].get_legend_handles_labels()[1])
    report_looks.legend(figure, grid[-1, 0], labels if labels < 5 else 3)
    return figure


def _draw_runs(axes: Any, name: str, runs: Mapping[str, Arrays], looks: Mapping[str, Mapping[str, Any]]) -> None:
    factor = AXES[name][1]
    if name == "normal_force":  # the same for all runs; recorded at the end of each step that it holds over
        run = next(iter(runs.values()))
        axes.plot(run["time"], run[name], color="0.25", linewidth=1.3, drawstyle="steps-pre")
        return
    for label, run in runs.items():
        first = 1 if name in ("fx", "fy", "tau") else 0  # at t = 0 nothing has moved yet
        axes.plot(run["time"][first:], factor * run[name][first:], label=label, **looks[label])


def _draw_published(axes: Any, name: str, keys: Mapping[str, str], looks: Mapping[str, Mapping[str, Any]]) -> None:
    if name == "normal_force":
        for key in sorted({f"in_hand/load/{key[-1]}" for key in keys.values()}):
            report_looks.vertices(axes, key, 1.0, "0.25", ms=2.8)
        return
    for label, key in keys.items():
        words = f"{label}, published"
        report_looks.vertices(axes, f"{key}/{name}", AXES[name][1], looks[label]["color"], ms=2.8, label=words)


def distances(
    panels: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]],
    label: str,
    *,
    looks: Mapping[str, Mapping[str, Any]] | None = None,
) -> PlotFigure:
    """Draw distances [m] over time [s], one panel for each title, one line for each label; `label` names the axis."""
    figure = new_figure(9.6, 3.9)
    row = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (title, lines) in zip(row, panels.items(), strict=True):
        for i, (words, (time, values)) in enumerate(lines.items()):
            look = {"color": OTHERS[i % len(OTHERS)], "linestyle": LINE_STYLES[i % len(LINE_STYLES)]}
            axes.plot(time, 1e3 * values, label=words, **({"linewidth": 1.4} | look if looks is None else looks[words]))
        axes.set(title=title, xlabel="time [s]")
        axes.title.set_fontsize("medium")
        tidy(axes)
    row[0].set_ylabel(label)
    row[0].set_ylim(bottom=0.0)  # after all lines: it ends the scaling of the shared axis
    report_looks.legend(figure, row[0], 4, "lower", fontsize="small")
    return figure


def end_shifts(rows: Mapping[str, Mapping[str, float]], colours: Mapping[str, str], label: str) -> PlotFigure:
    """Draw the shifts of the end [m], by case and by cause, on a logarithmic axis called `label`; friction is black."""
    figure = new_figure(8.6, 1.5 + 0.36 * len(rows))
    axes = figure.subplots()
    causes = list(dict.fromkeys(cause for shifts in rows.values() for cause in shifts))
    for cause, marker in zip(causes, "<>oD^", strict=False):
        places = [j for j, shifts in enumerate(rows.values()) if cause in shifts]
        shown = [1e3 * shifts[cause] for shifts in rows.values() if cause in shifts]
        colour = colours.get(cause, EXACT)
        axes.plot(shown, places, linestyle="none", marker=marker, markersize=6.5, color=colour, label=cause)
    axes.set(xscale="log", xlabel=label, ylim=(len(rows) - 0.5, -0.5))
    axes.margins(x=0.08)
    axes.set_yticks(range(len(rows)), list(rows))
    tidy(axes)
    report_looks.legend(figure, axes, 3)
    return figure
