"""Figures of the velocity-driven experiment: profile, wrenches over time, box plots of the errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.experiments import facts, runs
from planarfriction.experiments.experiment import Arrays
from planarfriction.experiments.velocity_driven import boxes
from planarfriction.plots.style import LINE_STYLES, PALETTE, PlotFigure, new_figure, tidy
from planarfriction.scenes.ready import published_velocity

FORCES = (("fx", 0, "$f_x$", PALETTE[0]), ("fy", 1, "$f_y$", PALETTE[1]))
TORQUE = (("tau", 2, "$\\tau$", PALETTE[2]),)
PANELS = ((FORCES, "force [N]", 1.0), (TORQUE, "torque [N mm]", 1e3))

LOOKS = {"d": ("-", 2.6, 0.45), "r": (LINE_STYLES[1], 1.3, 1.0), "e": (LINE_STYLES[2], 1.5, 1.0)}
"""Letter of a model -> line style, width, opacity: the distributed model broad and pale below the others."""

MARKERS = {"d": "o", "r": "s", "e": "^"}

BOX_COLOURS = {"corrected": PALETTE[0], "ellipsoid": PALETTE[1]}
BOX_WORDS = {"corrected": "table", "ellipsoid": "ellipsoid"}
BOX_PANELS = (("ft", "error of the force [N]", 1.0, 1e-5), ("tau", "error of the torque [N mm]", 1e3, 1e-4))
"""Quantity, label, factor, and where the axis turns from linear to logarithmic."""


def profile(disc: Arrays) -> PlotFigure:
    """Velocity profile [mm/s, rad/s], and the wrench of the distributed model of the disc [N, N mm]."""
    figure = new_figure(9.0, 6.6)
    speeds, forces = figure.subplots(2, 1, sharex=True)
    time = np.arange(0.0, 5.0, 0.001)
    velocity = published_velocity()
    spin = speeds.twinx()
    quantities = (
        (speeds, 0, "vx", "$v_x$", 1e3, PALETTE[0]),
        (speeds, 1, "vy", "$v_y$", 1e3, PALETTE[1]),
        (spin, 2, "omega", "$\\omega$", 1.0, PALETTE[2]),
    )
    for axes, column, name, label, factor, colour in quantities:
        axes.plot(time, factor * velocity(time)[:, column], color=colour, lw=1.4, label=label)
        _vertices(axes, f"driven/velocity/{name}", factor, colour, "o")
    speeds.set_ylabel("speed [mm/s]")
    spin.set_ylabel("angular speed [rad/s]")
    tidy(speeds)
    spin.spines["top"].set_visible(False)
    torque = forces.twinx()
    for axes, lines, factor in ((forces, FORCES, 1.0), (torque, TORQUE, 1e3)):
        for name, column, label, colour in lines:
            axes.plot(disc["time"], factor * disc["d"][:, column], color=colour, lw=1.4, label=label)
            _vertices(axes, f"driven/Circle/d, alone/{name}", factor, colour, "o")
    forces.set(ylabel="force [N]", xlabel="time [s]", xlim=(0.0, 5.0))
    torque.set_ylabel("torque [N mm]")
    # zero at the same height on both sides
    forces.set_ylim(-1.3, 0.1)
    torque.set_ylim(-9.1, 0.7)
    tidy(forces)
    torque.spines["top"].set_visible(False)
    for first, second in ((speeds, spin), (forces, torque)):
        _legend_of(first, (first, second), frameon=False, loc="upper left", bbox_to_anchor=(1.08, 1.0))
    return figure


def pair(shape: str, kind: str, wrenches: Arrays) -> PlotFigure:
    """Force [N] and torque [N mm] of one reduced model on top of those of the distributed one, as published."""
    figure = new_figure(9.6, 4.0)
    for axes, (lines, label, factor) in zip(figure.subplots(1, 2), PANELS, strict=True):
        _draw(axes, wrenches, ("d", kind), lines, factor)
        beside = ", beside the ellipsoid" if kind == "e" else ""
        for model, ending in (("d", beside), (kind, "")):
            for name, _, _, colour in lines:
                _vertices(axes, f"driven/{shape}/{model}{ending}/{name}", factor, colour, MARKERS[model])
        axes.set(xlabel="time [s]", ylabel=label)
        handles = _key(("d", kind), lines) + _marker_key(("d", kind))
        ncols = len(handles) // 2
        above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0)}
        axes.legend(handles=handles, ncols=ncols, frameon=False, fontsize=8, **above)
    return figure


def page(found: dict[str, Arrays]) -> PlotFigure:
    """Force [N] and torque [N mm] of several shapes, a row for each, with all three models."""
    figure = new_figure(9.6, 2.3 * len(found) + 0.7)
    panels = figure.subplots(len(found), 2, sharex=True, squeeze=False)
    for row, (shape, wrenches) in zip(panels, found.items(), strict=True):
        for axes, (lines, label, factor) in zip(row, PANELS, strict=True):
            _draw(axes, wrenches, ("d", "r", "e"), lines, factor)
            axes.set_ylabel(label)
            axes.set_title(runs.IN_WORDS[shape], fontsize="medium", loc="left")
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    figure.align_ylabels(panels)
    handles = [handle for lines in (FORCES, TORQUE) for handle in _key(("d", "r", "e"), lines)]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    return figure


def box_plots(every: dict[str, boxes.Errors]) -> PlotFigure:
    """Errors of force [N] and torque [N mm] of all shapes, ours filled and the published boxes open beside them."""
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
    figure.legend(handles=_box_key(), loc="outside upper center", ncols=5, frameon=False)
    return figure


def _draw_boxes(axes: Any, place: int, shape: str, quantity: str, errors: dict[str, np.ndarray], factor: float) -> None:
    table = facts.published_table("box")
    for offset, (model, values) in zip((-0.28, 0.12), errors.items(), strict=True):
        colour = BOX_COLOURS[model]
        ours = boxes.statistics(values)
        _draw_box(axes, place + offset, ours, factor, colour, filled=True)
        axes.plot(place + offset, factor * ours["maximum"], marker="x", ms=6, mew=1.6, color=colour)
        published = table.get(f"{quantity}/{shape}/{model}")
        if published is not None:
            _draw_box(axes, place + offset + 0.16, published, factor, colour, filled=False)


def _draw_box(axes: Any, at: float, box: dict[str, float], factor: float, colour: str, *, filled: bool) -> None:
    low, first, median, third, high = (factor * box[name] for name in boxes.COLUMNS[:5])
    drawn = {"whislo": low, "q1": first, "med": median, "q3": third, "whishi": high}
    line = {"color": colour, "linewidth": 1.1}
    axes.bxp(
        [drawn],
        positions=[at],
        widths=0.14,
        showfliers=False,
        patch_artist=True,
        boxprops={"facecolor": colour if filled else "white", "edgecolor": colour, "linewidth": 1.1},
        medianprops={"color": "white" if filled else colour, "linewidth": 1.6},
        whiskerprops=line,
        capprops=line,
        manage_ticks=False,
    )


def _box_key() -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    for filled, words in ((True, ""), (False, ", published")):
        for model, colour in BOX_COLOURS.items():
            face = colour if filled else "white"
            handles.append(Patch(facecolor=face, edgecolor=colour, label=BOX_WORDS[model] + words))
    handles.append(Line2D([], [], ls="", marker="x", ms=6, mew=1.6, color="0.3", label="maximum"))
    return handles


# ------------------------------------------------------------------ lines, markers, keys


def _draw(axes: Any, wrenches: Arrays, kinds: tuple[str, ...], lines: Any, factor: float) -> None:
    for kind in kinds:
        style, width, opacity = LOOKS[kind]
        for _, column, _, colour in lines:
            values = factor * wrenches[kind][:, column]
            axes.plot(wrenches["time"], values, ls=style, lw=width, alpha=opacity, color=colour)
    axes.set_xlim(0.0, 5.0)
    tidy(axes)


def _vertices(axes: Any, name: str, factor: float, colour: str, marker: str) -> None:
    curve = facts.published_curve(name)
    axes.plot(
        curve.time, factor * curve.values, ls="", marker=marker, ms=3.2, mfc="white", mec=colour, mew=0.7, zorder=3
    )


def _key(kinds: tuple[str, ...], lines: Any) -> list[Any]:
    from matplotlib.lines import Line2D

    handles = []
    for _, _, label, colour in lines:
        for kind in kinds:
            style, width, opacity = LOOKS[kind]
            words = f"{label}, {runs.NAMES[kind]}"
            handles.append(Line2D([], [], ls=style, lw=width, alpha=opacity, color=colour, label=words))
    return handles


def _marker_key(kinds: tuple[str, ...]) -> list[Any]:
    from matplotlib.lines import Line2D

    return [
        Line2D(
            [], [], ls="", marker=MARKERS[kind], ms=4, mfc="white", mec="0.3", label=f"published, {runs.NAMES[kind]}"
        )
        for kind in kinds
    ]


def _legend_of(axes: Any, sources: tuple[Any, ...], **options: Any) -> None:
    axes.legend(handles=[line for each in sources for line in each.get_legend_handles_labels()[0]], **options)
