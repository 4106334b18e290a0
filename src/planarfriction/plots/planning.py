"""Pictures of plans: a grip with what becomes of the body, and a push with the path of the pusher."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import Normalize

import planarfriction as pf
from planarfriction._support.shown import unit_for
from planarfriction.planning.grip import slide_of
from planarfriction.plots import style
from planarfriction.plots.motion import (
    ROOM,
    draw_path,
    instants,
    label_poses,
    placed,
)
from planarfriction.plots.track import body_poses
from planarfriction.scenes import simulate

COLOURS = (style.REDUCED, *style.SHADES[1::2])
"""Colours of the friction of the scene, and of the least and the most."""

DOTS = 40
"""Most places of the pusher that are drawn."""

MODES = {
    "stick": ("0.0", "o"),
    "slide left": (style.SLIPS, "<"),
    "slide right": (style.SLIPS, ">"),
    "free": ("0.75", "."),
}
"""Colour and marker of the pusher by what it does."""


def plot_grip(plan: pf.planning.GripPlan) -> style.PlotFigure:
    """Draw the grip, the turn and the slide over time: broken lines have other frictions."""
    figure = style.new_figure(7.0, 5.4)
    grip, turn, slide = figure.subplots(3, 1, sharex=True)
    end = plan.scene.t_end
    times = np.append(plan.signal.times, end)
    force = unit_for("force", plan.signal.values)
    values = force.factor * plan.signal(times)
    grip.plot(times, values, "o-", color="0.0", markersize=3)
    holding = force.factor * plan.report.holding
    dotted = {
        "color": style.REFERENCE,
        "linewidth": 0.9,
        "linestyle": style.LINE_STYLES[2],
    }
    grip.axhline(holding, **dotted)
    grip.annotate("holds the body at the end", (end, holding), color="0.3",
                  fontsize="small", ha="right", va="bottom")  # fmt: skip
    grip.set_ylabel(f"grip [{force.label}]")
    solutions = [simulate(scene, save_every=end / 400.0) for scene in plan.frictions]
    place = [
        slide_of(plan.scene, each.contact_index(plan.contact), body_poses(each))
        for each in solutions
    ]
    # Of the place that was under the grip.
    slides = [np.hypot(*each.T) for each in place]
    angles = [
        each.histories["theta"].values - plan.scene.body.angle for each in solutions
    ]
    angle = unit_for("angle", *angles)
    length = unit_for("length", *slides)
    labels = ["friction of the scene"]
    if len(solutions) > 1:
        least, *_, most = plan.report.frictions
        labels += [
            f"friction {100.0 * (f - 1.0):+.3g} %".replace("-", "\N{MINUS SIGN}")
            for f in (least, most)
        ]
    # First as it is, then the others.
    for i, (solution, label) in enumerate(zip(solutions, labels, strict=True)):
        time = solution.histories["time"].values
        line = {"color": COLOURS[i], "ls": style.LINE_STYLES[i], "label": label}
        turn.plot(time, angle.factor * angles[i], **line)
        slide.plot(time, length.factor * slides[i], **line)
    wanted = plan.report.goal
    if "angle" in wanted:
        turn.axhline(angle.factor * wanted["angle"], **dotted)
    else:
        slide.axhline(length.factor * np.hypot(*wanted["slide"]), **dotted)
    turn.set_ylabel(style.with_unit("rotation", angle))
    slide.set_ylabel(f"slide [{length.label}]")
    slide.set_xlabel("time [s]")
    turn.legend(frameon=False, fontsize="small")
    style.tidy(grip, turn, slide)
    return figure


def plot_push(push: pf.planning.Push) -> style.PlotFigure:
    """Draw the slider at the start, half-way and at the end, its path, and that of the pusher by what it does."""
    figure = style.new_figure(6.4, 4.8)
    draw_push(figure.subplots(), push)
    figure.draw_without_rendering()  # the aspect sets the ticks, which the layout has to know
    return figure


def draw_push(axes: Any, push: pf.planning.Push) -> None:
    """Draw `plot_push` into axes."""
    time = push.time - push.time[0]
    scale = Normalize(0.0, time[-1])
    outline = push.slider.outline
    chosen = instants(push.pose, float(np.hypot(*outline.T).max()))
    closed = np.concatenate([outline, outline[:1]])
    corners = [1e3 * placed(closed, pose) for pose in push.pose[chosen]]
    for k, each in zip(chosen, corners, strict=True):
        colour = style.TIME_COLOURS(scale(time[k]))
        axes.plot(*each.T, color=colour, linewidth=1.4, zorder=3)
        if push.pusher.width > 0.0:
            face = placed(push.pusher.ends, push.pusher_pose[k])
            axes.plot(*(1e3 * face.T), color="0.3", linewidth=2.0, zorder=4)
    draw_path(axes, time, push.pose, scale)
    some = style.evenly(len(push.time), DOTS)
    for mode, (colour, marker) in MODES.items():
        here = some[push.mode[some] == mode]
        if len(here):
            places = 1e3 * push.pusher_pose[here, :2].T
            label = f"pusher: {mode}"
            look = {"s": 7, "color": colour, "marker": marker, "zorder": 5}
            axes.scatter(*places, **look, label=label)
    every = np.concatenate(corners)
    side = float(np.ptp(every, axis=0).max())
    turns = push.pose[chosen, 2] - push.pose[0, 2]
    view = (1.0 + 2.0 * ROOM) * side  # of both panels of a page
    label_poses(axes, time[chosen], turns, corners, view, scale)
    axes.update_datalim(every + np.array([ROOM * side, 0.0]))
    style.show_lengths(axes, float(np.abs(push.pose[:, :2]).max()))
    axes.set_aspect("equal", adjustable="datalim")
    place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 2}
    axes.legend(fontsize="small", frameon=False, **place)
    style.tidy(axes)
