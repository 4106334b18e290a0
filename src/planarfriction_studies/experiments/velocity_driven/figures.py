"""Figures of the velocity-driven experiment: profile, wrenches over time, box plots of the errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.plots.style import LINE_STYLES, PlotFigure, new_figure, tidy
from planarfriction.scenes.ready import published_velocity
from planarfriction_studies.experiments import facts, looks, runs
from planarfriction_studies.experiments.experiment import Arrays
from planarfriction_studies.experiments.velocity_driven import boxes

COMPONENTS = (("fx", "$f_x$ [N]", 1.0), ("fy", "$f_y$ [N]", 1.0), ("tau", "$\\tau$ [N mm]", 1e3))

LOOKS = {"d": ("-", 2.6, 0.45), "r": (LINE_STYLES[1], 1.3, 1.0), "e": (LINE_STYLES[2], 1.5, 1.0)}
"""Letter of a model -> line style, width, opacity: the distributed model broad and pale below the others."""

MARKERS = {"d": "o", "r": "s", "e": "^"}

BOX_COLOURS = {"corrected": looks.REDUCED, "ellipsoid": looks.ELLIPSOID}
BOX_WORDS = {"corrected": "table", "ellipsoid": "ellipsoid"}
BOX_PANELS = (("ft", "error of the force [N]", 1.0, 1e-5), ("tau", "error of the torque [N mm]", 1e3, 1e-4))
"""Quantity, label, factor, and where the axis turns from linear to logarithmic."""


def profile(disc: Arrays) -> PlotFigure:
    """Draw the velocity profile [mm/s, rad/s], and the wrench of the distributed model of the disc [N, N mm]."""
    figure = new_figure(9.6, 4.6)
    above, below = figure.subplots(2, 3, sharex=True)
    time = np.arange(0.0, 5.0, 0.001)
    velocity = published_velocity()(time).T
    speeds = (("vx", "$v_x$ [mm/s]", 1e3), ("vy", "$v_y$ [mm/s]", 1e3), ("omega", "$\\omega$ [rad/s]", 1.0))
    for axes, (name, label, factor), values in zip(above, speeds, velocity, strict=True):
        axes.plot(time, factor * values, color="0.15", lw=1.4)
        looks.vertices(axes, f"driven/velocity/{name}", factor, "0.15")
        axes.set_ylabel(label)
        tidy(axes)
    for axes, (name, label, factor), values in zip(below, COMPONENTS, disc["d"].T, strict=True):
        axes.plot(disc["time"], factor * values, color=looks.DISTRIBUTED, lw=1.4)
        looks.vertices(axes, f"driven/Circle/d, alone/{name}", factor, looks.DISTRIBUTED)
        axes.set(xlabel="time [s]", ylabel=label, xlim=(0.0, 5.0))
        tidy(axes)
    return figure


def pair(shape: str, kind: str, wrenches: Arrays) -> PlotFigure:
    """Draw forces [N] and torque [N mm] of one reduced model on top of those of the distributed one, as published."""
    figure = new_figure(9.6, 3.4)
    panels = figure.subplots(1, 3)
    beside = ", beside the ellipsoid" if kind == "e" else ""
    for column, (axes, (name, label, factor)) in enumerate(zip(panels, COMPONENTS, strict=True)):
        _draw(axes, wrenches, ("d", kind), column)
        for model, ending in (("d", beside), (kind, "")):
            curve = f"driven/{shape}/{model}{ending}/{name}"
            looks.vertices(axes, curve, factor, looks.OF_MODEL[model], marker=MARKERS[model])
        axes.set(xlabel="time [s]", ylabel=label)
    handles = _key(("d", kind)) + _marker_key(("d", kind))
    looks.legend(figure, handles, 4, fontsize=9)
    return figure


def page(found: dict[str, Arrays]) -> PlotFigure:
    """Draw forces [N] and torque [N mm] of several shapes, a row for each, with all three models."""
    figure = new_figure(9.6, 2.1 * len(found) + 0.7)
    panels = figure.subplots(len(found), 3, sharex=True, squeeze=False)
    for row, (shape, wrenches) in zip(panels, found.items(), strict=True):
        row[0].set_title(runs.IN_WORDS[shape], fontsize="medium", loc="left")
        for column, (axes, (_, label, _)) in enumerate(zip(row, COMPONENTS, strict=True)):
            _draw(axes, wrenches, ("d", "r", "e"), column)
            axes.set_ylabel(label)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    figure.align_ylabels(panels)
    looks.legend(figure, _key(("d", "r", "e")), 3, fontsize=9)
    return figure


def box_plots(every: dict[str, boxes.Errors]) -> PlotFigure:
    """Draw errors of force [N] and torque [N mm] of all shapes, ours filled and the published boxes open beside
    them."""
    figure = new_figure(9.6, 7.4)
    panels = figure.subplots(2, 1, sharex=True)
    for axes, (quantity, label, factor, linear) in zip(panels, BOX_PANELS, strict=True):
        axes.set_yscale("symlog", linthresh=linear, linscale=0.5)
        for place, (shape, each) in enumerate(every.items()):
            _draw_boxes(axes, place, shape, quantity, each[quantity], factor)
        axes.set_ylim(bottom=0.0)
        axes.set_ylabel(label)
        tidy(axes)
        axes.grid(False, axis="x")
    panels[-1].set_xticks(range(len(every)), [runs.IN_WORDS[shape] for shape in every])
    figure.align_ylabels(panels)
    colours = {BOX_WORDS[model]: colour for model, colour in BOX_COLOURS.items()}
    published = looks.box_key(colours, ", published", filled=False)
    looks.legend(figure, [*looks.box_key(colours), *published, looks.line_key(**looks.MAXIMUM)], 5)
    return figure


def _draw_boxes(axes: Any, place: int, shape: str, quantity: str, errors: dict[str, np.ndarray], factor: float) -> None:
    table = facts.published_table("box")
    for offset, (model, values) in zip((-0.28, 0.12), errors.items(), strict=True):
        colour = BOX_COLOURS[model]
        ours = factor * np.array(list(boxes.statistics(values).values()))
        looks.box(axes, place + offset, ours, colour, 0.14)
        published = table.get(f"{quantity}/{shape}/{model}")
        if published is not None:
            theirs = [factor * published[name] for name in boxes.COLUMNS[:5]]
            looks.box(axes, place + offset + 0.16, theirs, colour, 0.14, filled=False)


# ------------------------------------------------------------------ lines, markers, keys


def _draw(axes: Any, wrenches: Arrays, kinds: tuple[str, ...], column: int) -> None:
    for kind in kinds:
        values = COMPONENTS[column][2] * wrenches[kind][:, column]
        axes.plot(wrenches["time"], values, **_look(kind))
    axes.set_xlim(0.0, 5.0)
    tidy(axes)


def _look(kind: str) -> dict[str, Any]:
    style, width, opacity = LOOKS[kind]
    return {"ls": style, "lw": width, "alpha": opacity, "color": looks.OF_MODEL[kind]}


def _key(kinds: tuple[str, ...]) -> list[Any]:
    return [looks.line_key(runs.NAMES[kind], **_look(kind)) for kind in kinds]


def _marker_key(kinds: tuple[str, ...]) -> list[Any]:
    marks = {"ls": "", "ms": 4, "mfc": "white"}
    return [
        looks.line_key(f"{runs.NAMES[kind]}, published", marker=MARKERS[kind], mec=looks.OF_MODEL[kind], **marks)
        for kind in kinds
    ]
