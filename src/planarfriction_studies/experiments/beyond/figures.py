"""Figures beyond the paper: errors of surfaces, the staircase, errors of models, grooves."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.plots.style import PlotFigure, new_figure, tidy
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.beyond import grooves as grooved
from planarfriction_studies.experiments.beyond.driven import MODELS, Errors
from planarfriction_studies.experiments.beyond.surfaces import KINDS
from planarfriction_studies.experiments.experiment import Arrays
from planarfriction_studies.experiments.runs import IN_WORDS
from planarfriction_studies.experiments.velocity_driven import boxes

COLOURS = dict(
    zip(KINDS, (looks.REDUCED, looks.MOMENTS, looks.DISTRIBUTED, looks.QUARTIC, looks.ELLIPSOID), strict=True)
)

MODEL_COLOURS = dict(zip(MODELS, (looks.REDUCED, looks.MOMENTS, looks.PARTS, looks.DISTRIBUTED), strict=True))


def surface_errors(errors: dict[str, Arrays]) -> PlotFigure:
    """Draw errors of force [N] and torque [N mm] of each kind of surface from the exact one."""
    figure = new_figure(9.6, 6.8)
    panels: Any = figure.subplots(2, 1, sharex=True)
    for axes, (quantity, factor, label) in zip(
        panels, (("force", 1.0, "error of the force [N]"), ("torque", 1e3, "error of the torque [N mm]")), strict=True
    ):
        for place, each in enumerate(errors.values()):
            kinds = [kind for kind in KINDS if f"{kind}/{quantity}" in each]
            for i, kind in enumerate(kinds):
                at = place + 0.15 * (i - 0.5 * (len(kinds) - 1))
                numbers = np.percentile(factor * each[f"{kind}/{quantity}"], [5, 25, 50, 75, 95, 100])
                looks.box(axes, at, numbers, COLOURS[kind], 0.12)
        axes.set(yscale="log", ylabel=label)
        tidy(axes)
        axes.grid(False, axis="x")
    panels[1].set_xticks(range(len(errors)), [IN_WORDS[shape].replace(", ", ",\n") for shape in errors])
    figure.align_ylabels(panels)
    shown = [kind for kind in KINDS if any(f"{kind}/force" in each for each in errors.values())]
    key = looks.box_key({kind: COLOURS[kind] for kind in shown})
    looks.legend(figure, [*key, looks.line_key(**looks.MAXIMUM)], 6, fontsize="small")
    return figure


def staircase(stairs: Arrays) -> PlotFigure:
    """Draw the torque [N mm] and force [N] of a spin over its centre [mm], summed and exact, for line and disc."""
    figure = new_figure(9.6, 6.0)
    panels: Any = figure.subplots(2, 2, sharex=True)
    place = 1e3 * stairs["place"]
    for row, shape in zip(panels, ("Line", "Circle"), strict=True):
        for axes, ending, factor, label in (
            (row[0], "", 1e3, "torque [N mm]"),
            (row[1], ", force", 1.0, "force [N]"),
        ):
            cells, exact = factor * stairs[f"{shape}/sum{ending}"], factor * stairs[f"{shape}/exact{ending}"]
            if shape == "Circle":  # steps of a few thousandths do not show beside the curve itself
                cells, exact, label = 1e3 * (cells - exact), 0.0 * exact, f"{label[:5].strip()} - exact"
                label = "torque, from the exact one [N µm]" if not ending else "force, from the exact one [mN]"
            axes.plot(place, cells, color=looks.DISTRIBUTED, lw=1.1, label="sum over the 21 x 21 grid's cells")
            axes.plot(place, exact, color=looks.EXACT, lw=1.3, label="exact")
            axes.set(ylabel=label, xlim=(0.0, place[-1]))
            axes.set_title(IN_WORDS[shape], fontsize="medium", loc="left")
            tidy(axes)
    for axes in panels[1]:
        axes.set_xlabel("centre of rotation from the middle [mm]")
    figure.align_ylabels(panels)
    looks.legend(figure, panels[0, 0], 2)
    return figure


def driven_boxes(errors: Errors) -> PlotFigure:
    """Draw errors of force [mN] and torque [N mm] of the models, from the finer grid."""
    figure = new_figure(9.6, 7.0)
    panels: Any = figure.subplots(2, 1, sharex=True)
    rows = (("", 1e3, "error of the force [mN]", 1e-2), ("torque ", 1e3, "error of the torque [N mm]", 1e-4))
    for axes, (before, factor, label, linear) in zip(panels, rows, strict=True):
        axes.set_yscale("symlog", linthresh=linear, linscale=0.4)
        for place, each in enumerate(errors.values()):
            for offset, (model, colour) in zip((-0.3, -0.1, 0.1, 0.3), MODEL_COLOURS.items(), strict=True):
                values = [factor * each[model][before + name] for name in boxes.COLUMNS]
                looks.box(axes, place + offset, values, colour, 0.16)
        axes.set(ylabel=label, ylim=(0.0, None))
        tidy(axes)
        axes.grid(False, axis="x")
    panels[1].set_xticks(range(len(errors)), [IN_WORDS[shape] for shape in errors])
    figure.align_ylabels(panels)
    key = looks.box_key({MODELS[model]: colour for model, colour in MODEL_COLOURS.items()})
    looks.legend(figure, [*key, looks.line_key(**looks.MAXIMUM)], 5, fontsize="small")
    return figure


def grooves(numbers: dict[str, Any]) -> PlotFigure:
    """Draw the drift of the grooved block [deg] over the slope [deg], simulated and in closed form."""
    figure = new_figure(5.4, 3.6)
    axes: Any = figure.subplots()
    slopes = np.array(numbers["slope"])
    fine = np.linspace(slopes[0], slopes[-1], 100)
    axes.plot(
        np.degrees(fine), np.degrees([grooved.closed_drift(s) for s in fine]), color=looks.EXACT, label="closed form"
    )
    for kind, marker, colour in zip(
        grooved.MODELS, "ox+", (looks.DISTRIBUTED, looks.MOMENTS, looks.REDUCED), strict=True
    ):
        axes.plot(
            np.degrees(slopes), np.degrees(numbers[kind]), marker, color=colour, label=kind, fillstyle="none", ms=7
        )
    axes.set(xlabel="slope [deg]", ylabel="drift from the fall line [deg]", ylim=(0.0, None))
    axes.legend(frameon=False)
    tidy(axes)
    return figure
