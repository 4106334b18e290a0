"""Picture of a planned push: the motion of the part, its goal, and the length of the path."""

from __future__ import annotations

import numpy as np

import planarfriction as pf
from planarfriction._support.shown import unit_for
from planarfriction.plots import style
from planarfriction.plots.motion import placed
from planarfriction.plots.planning import draw_push


def plot_push_plan(plan: pf.planning.PushPlan) -> style.PlotFigure:
    """Draw the push of a plan, the outline of the part at the goal (dashed), and the length of the path."""
    figure = style.new_figure(6.4, 4.8)
    axes = figure.subplots()
    draw_push(axes, plan.push)
    outline = plan.push.slider.outline
    goal = placed(np.concatenate([outline, outline[:1]]), np.array(plan.report.goal))
    axes.plot(
        *(1e3 * goal.T), "--", color=style.REFERENCE, lw=1.0, zorder=6, label="goal"
    )
    axes.legend(fontsize="small")
    length = unit_for("length", plan.report.length)
    words = (
        f"path of the pusher: {length.factor * plan.report.length:.3g} {length.label}"
    )
    axes.set_title(words, fontsize="medium")
    figure.draw_without_rendering()  # the aspect sets the ticks, which the layout has to know
    return figure
