"""Figures of the in-hand experiments: motion, histories, distances, and what moves the end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction.plots.motion import draw_motion
from planarfriction.plots.style import LINE_STYLES, PlotFigure, new_figure
from planarfriction.scenes import Scene, Solution
from planarfriction.scenes.solution import History
from planarfriction.solvers.statistics import Statistics
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.experiment import WRENCH, Arrays
from planarfriction_studies.experiments.looks import (
    AXES,
    DISTRIBUTED,
    OTHERS,
    PUBLISHED,
    REFERENCE,
)

LOOKS: dict[str, dict[str, Any]] = {
    "distributed": {"color": DISTRIBUTED, "linewidth": 1.5},
    "reduced": {"color": PUBLISHED, "linewidth": 1.5, "linestyle": LINE_STYLES[1]},
}
"""Model -> how its line looks."""


def strobes(panels: Mapping[str, tuple[Scene, Arrays]]) -> PlotFigure:
    """Draw outlines of the plate at twelve instants, one panel for each scene and its run."""
    figure = new_figure(5.0 * len(panels), 4.4)
    parts: Any = figure.subfigures(1, len(panels), squeeze=False)[0]
    for part, (title, (scene, run)) in zip(parts, panels.items(), strict=True):
        histories = {
            name: History(("time",), run[name], {})
            for name in ("time", "x", "y", "theta")
        }
        draw_motion(part, Solution(histories, Statistics(), "success", "", scene))
        part.suptitle(title, fontsize="medium")
    return figure


Styles = Mapping[str, Mapping[str, Any]]
"""Label -> how its line looks."""


def histories(
    panels: Mapping[str, Mapping[str, Arrays]],
    names: Sequence[str],
    *,
    styles: Styles = LOOKS,
    published: Mapping[str, Mapping[str, str]] | None = None,
) -> PlotFigure:
    """Draw columns `names` over time: one column of panels for each title, one line for each label of a run.

    `published` holds, by title and label, the keys of published curves, drawn as markers.
    """
    shared = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, grid = looks.panels(
        9.6, 0.7 + 1.75 * len(names), len(names), len(panels), **shared
    )
    for column, (title, runs) in enumerate(panels.items()):
        grid[0, column].set_title(title, fontsize="medium")
        grid[-1, column].set_xlabel("time [s]")
        for axes, name in zip(grid[:, column], names, strict=True):
            _draw_runs(axes, name, runs, styles, (published or {}).get(title, {}))
    for axes, name in zip(grid[:, 0], names, strict=True):
        axes.set_ylabel(AXES[name][0])
    figure.align_ylabels(grid)
    labels = len(grid[-1, 0].get_legend_handles_labels()[1])
    looks.legend(figure, grid[-1, 0], labels if labels < 5 else 3)
    return figure


def _draw_runs(
    axes: Any,
    name: str,
    runs: Mapping[str, Arrays],
    styles: Styles,
    published: Mapping[str, str],
) -> None:
    factor = AXES[name][1]
    # The same for all runs; recorded at the end of each step that it holds over.
    if name == "normal_force":
        run = next(iter(runs.values()))
        axes.plot(
            run["time"], run[name], color="0.25", linewidth=1.3, drawstyle="steps-pre"
        )
        for load in sorted({key[-1] for key in published.values()}):
            looks.vertices(axes, f"in_hand/load/{load}", 1.0, "0.25", ms=2.8)
        return
    for label, run in runs.items():
        first = 1 if name in WRENCH else 0  # at t = 0 nothing has moved yet
        axes.plot(
            run["time"][first:],
            factor * run[name][first:],
            label=label,
            **styles[label],
        )
    for label, key in published.items():
        words = f"{label}, published"
        looks.vertices(
            axes, f"{key}/{name}", factor, styles[label]["color"], ms=2.8, label=words
        )


def distances(
    panels: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]],
    label: str,
    *,
    styles: Styles | None = None,
) -> PlotFigure:
    """Draw distances [m] over time [s], one panel for each title, one line for each label; `label` names the axis."""
    figure, (row,) = looks.panels(9.6, 3.9, 1, len(panels), sharey=True, squeeze=False)
    for axes, (title, lines) in zip(row, panels.items(), strict=True):
        for i, (words, (time, values)) in enumerate(lines.items()):
            look = {"linewidth": 1.4, "color": OTHERS[i], "linestyle": LINE_STYLES[i]}
            axes.plot(
                time,
                1e3 * values,
                label=words,
                **(look if styles is None else styles[words]),
            )
        axes.set_title(title, fontsize="medium")
        axes.set_xlabel("time [s]")
    row[0].set_ylabel(label)
    # After all lines: it ends the scaling of the shared axis.
    row[0].set_ylim(bottom=0.0)
    looks.legend(figure, row[0], 4, "lower", fontsize="small")
    return figure


def end_shifts(
    rows: Mapping[str, Mapping[str, float]], colours: Mapping[str, str], label: str
) -> PlotFigure:
    """Draw the shifts of the end [m], by case and by cause, on a logarithmic axis called `label`; friction is black."""
    figure, axes = looks.panels(8.6, 1.5 + 0.36 * len(rows))
    causes = list(dict.fromkeys(cause for shifts in rows.values() for cause in shifts))
    for cause, marker in zip(causes, "<>oD^*", strict=False):
        places = [j for j, shifts in enumerate(rows.values()) if cause in shifts]
        shown = [1e3 * shifts[cause] for shifts in rows.values() if cause in shifts]
        colour = colours.get(cause, REFERENCE)
        axes.plot(
            shown,
            places,
            linestyle="none",
            marker=marker,
            markersize=6.5,
            color=colour,
            label=cause,
        )
    axes.set(xscale="log", xlabel=label, ylim=(len(rows) - 0.5, -0.5))
    axes.margins(x=0.08)
    axes.set_yticks(range(len(rows)), list(rows))
    looks.legend(figure, axes, 3)
    return figure
