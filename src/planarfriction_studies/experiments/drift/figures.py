"""Figures of the drift experiment: motion under both loads, and the deflections before the oscillation."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from planarfriction.plots.style import LINE_STYLES, PlotFigure, new_figure, tidy
from planarfriction.scenes.ready import drift_force
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.experiment import Arrays
from planarfriction_studies.experiments.runs import NAMES

WORDS = {
    "d": "distributed, plain",
    "d_ep": "distributed, elasto-plastic",
    "r": "reduced, plain",
    "r_ep": "reduced, elasto-plastic",
    "e_ep": "ellipsoid, elasto-plastic",
    "straight": "reduced, straight ramp",
}
"""Model in the names of curves -> words."""

ROWS = (("x", "$x$ [nm]", 1e9), ("theta", "$\\theta$ [µrad]", 1e6))
LAW_LINES = {"": LINE_STYLES[1], "_ep": "-"}
LAW_WORDS = {"": "plain", "_ep": "elasto-plastic"}
DOTS: dict[str, Any] = {"ms": 2.4, "mew": 0.6}
LOAD_COLOURS = {"fx": "0.15", "tau": "0.55", "normal": "0.55"}


def motion(load: Literal["tangential", "normal"], found: dict[tuple[str, str], Arrays]) -> PlotFigure:
    """Draw the applied load, x [nm] and theta [µrad] over time: left the distributed model, right the reduced one."""
    figure = new_figure(9.6, 7.0)
    panels = figure.subplots(3, 2, sharex=True, sharey="row")
    for column, (kind, title) in enumerate((("d", "distributed"), ("r", "reduced"))):
        _draw_load(panels[0, column], load, found[load, kind], last=column == 1)
        panels[0, column].set_title(title, fontsize="medium")
        for axes, (name, label, factor) in zip(panels[1:, column], ROWS, strict=True):
            for law, line in LAW_LINES.items():
                run, colour = found[load, kind + law], looks.OF_MODEL[kind]
                axes.plot(run["time"], factor * run[name], color=colour, ls=line, lw=1.3, label=LAW_WORDS[law])
                if load == "tangential":
                    looks.vertices(axes, f"drift/{kind}{law}/{name}", factor, colour, **DOTS)
            if column == 0:
                axes.set_ylabel(label)
            tidy(axes)
    for axes in panels[-1]:
        axes.set(xlabel="time [s]", xlim=(0.0, 5.0))
    figure.align_ylabels(panels[:, 0])
    looks.legend(figure, _key(load), 4, fontsize=9)
    return figure


def plateaus(found: dict[tuple[str, str], Arrays], straight: Arrays, numbers: dict[str, Any]) -> PlotFigure:
    """Draw deflections x [nm] and theta [µrad] in the first second of the normal-load run, elasto-plastic bristles."""
    figure = new_figure(9.6, 3.9)
    lines = {
        "d_ep": (looks.DISTRIBUTED, "-", 3.4, 0.5),
        "r_ep": (looks.REDUCED, "-", 3.4, 0.5),
        "e_ep": (looks.ELLIPSOID, LINE_STYLES[1], 1.4, 1.0),
        "straight": (looks.REDUCED, LINE_STYLES[3], 1.1, 1.0),
    }
    for axes, (name, label, factor) in zip(figure.subplots(1, 2), ROWS, strict=True):
        for model, (colour, line, width, opacity) in lines.items():
            run = straight if model == "straight" else found["normal", model]
            part = run["time"] <= 1.0
            look = {"color": colour, "linestyle": line, "linewidth": width, "alpha": opacity}
            axes.plot(run["time"][part], factor * run[name][part], label=WORDS[model], **look)
            closed = numbers["closed form"].get(model)
            if closed is not None:
                axes.axhline(factor * closed[name], color=colour, ls=LINE_STYLES[2], lw=1.0, zorder=1)
        axes.set(xlabel="time [s]", ylabel=label, xlim=(0.0, 1.0), ylim=(0.0, None))
        tidy(axes)
    looks.legend(figure, figure.axes[0], 4, fontsize=9)
    return figure


def _draw_load(axes: Any, load: Literal["tangential", "normal"], run: Arrays, *, last: bool) -> None:
    """Draw the applied force [N] and torque [N mm], or under the normal load force and normal force."""
    time = np.arange(0.0, 5.0, 0.001)
    applied = drift_force(load)(time)
    axes.plot(time, applied[:, 0], color=LOAD_COLOURS["fx"], lw=1.0)
    other = axes.twinx()
    if load == "tangential":
        other.plot(time, 1e3 * applied[:, 2], color=LOAD_COLOURS["tau"], lw=1.0)
        looks.vertices(axes, "drift/applied/fx", 1.0, LOAD_COLOURS["fx"], slice(None, None, 4), **DOTS)
        looks.vertices(other, "drift/applied/tau", 1e3, LOAD_COLOURS["tau"], slice(None, None, 4), **DOTS)
        other.set_ylim(0.0, 120.0)
        label = "$\\tau$ [N mm]"
    else:
        other.plot(run["time"], run["normal_force"], color=LOAD_COLOURS["normal"], lw=1.0)
        other.set_ylim(0.0, 13.0)
        label = "$f_N$ [N]"
    axes.set_ylim(0.0, 1.6)
    if last:
        other.set_ylabel(label)
    else:
        axes.set_ylabel("$f_x$ [N]")
        other.tick_params(labelright=False)
    tidy(axes)
    other.spines["top"].set_visible(False)


def _key(load: str) -> list[Any]:
    lines = [
        (looks.OF_MODEL[kind], line, f"{NAMES[kind]}, {LAW_WORDS[law]}")
        for kind in "dr"
        for law, line in LAW_LINES.items()
    ]
    other = ("tau", "applied $\\tau$") if load == "tangential" else ("normal", "normal force")
    lines += [(LOAD_COLOURS["fx"], "-", "applied $f_x$"), (LOAD_COLOURS[other[0]], "-", other[1])]
    handles = [looks.line_key(words, color=colour, ls=line, lw=1.4) for colour, line, words in lines]
    if load == "tangential":
        handles.append(looks.line_key("published", ls="", marker="o", ms=3, mfc="white", mec="0.3"))
    return handles
