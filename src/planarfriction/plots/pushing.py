"""The picture of a push: the slider at instants of it, the path of the pusher, and what the contact does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import Normalize

from planarfriction import geometry
from planarfriction.plots import style

if TYPE_CHECKING:
    from planarfriction.planning import Push

INSTANTS = 8
"""Outlines that are drawn."""

MODES = ("stick", "slide left", "slide right", "free")


def plot_push(push: Push) -> style.PlotFigure:
    """Draw the outline of the slider at 8 instants, coloured by time, and the path of the pusher by what it does."""
    figure = style.new_figure(6.4, 4.8)
    draw_push(figure.subplots(), push)
    figure.draw_without_rendering()  # the aspect sets the ticks, which the layout has to know
    return figure


def draw_push(axes: Any, push: Push) -> None:
    """Draw `plot_push` into axes."""
    scale = Normalize(push.time[0], push.time[-1])
    chosen = np.unique(np.linspace(0, len(push.time) - 1, INSTANTS).round().astype(int))
    closed = np.concatenate([push.slider.outline, push.slider.outline[:1]])
    for k in chosen:
        corners = push.pose[k, :2] + geometry.rotate(closed, push.pose[k, 2])
        axes.plot(*(1e3 * corners.T), color=style.TIME_COLOURS(scale(push.time[k])), linewidth=1.3, zorder=3)
        if push.pusher.width > 0.0:
            face = push.pusher_pose[k, :2] + geometry.rotate(push.pusher.ends, push.pusher_pose[k, 2])
            axes.plot(*(1e3 * face.T), color="0.3", linewidth=2.0, zorder=4)
    axes.plot(*(1e3 * push.pose[:, :2].T), color="0.5", linewidth=0.8, zorder=2)
    for i, mode in enumerate(MODES):
        here = push.mode == mode
        if here.any():
            dots = {"s": 9, "zorder": 5, "color": "0.75" if mode == "free" else style.PALETTE[i]}
            axes.scatter(*(1e3 * push.pusher_pose[here, :2].T), label=f"pusher: {mode}", **dots)
    style.show_times(axes, push.time)
    style.show_lengths(axes, float(np.abs(push.pose[:, :2]).max()))
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(fontsize="small")
    style.tidy(axes)
