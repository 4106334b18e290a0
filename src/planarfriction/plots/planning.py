"""The picture of a grip plan: the profile, and what becomes of the body as the scene is and with other frictions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planarfriction.planning.motions import slide_of
from planarfriction.plots import style
from planarfriction.plots.track import body_poses
from planarfriction.scenes import Solution, simulate

if TYPE_CHECKING:
    from planarfriction.planning import GripPlan


def plot_grip(plan: GripPlan) -> style.PlotFigure:
    """Draw the grip, the turn and the slide over time: solid as the scene is, dashed with other frictions."""
    figure = style.new_figure(7.2, 6.4)
    grip, turn, slide = figure.subplots(3, 1, sharex=True)
    end = plan.scene.t_end
    times = np.append(plan.signal.times, end)
    force = style.unit_for("force", plan.signal.values)
    grip.plot(times, force.factor * plan.signal(times), "o-", color=style.PALETTE[0], markersize=3)
    grip.axhline(force.factor * plan.report.holding, color="0.4", linewidth=0.9, linestyle=style.LINE_STYLES[2])
    grip.annotate("holds the body at the end", (end, force.factor * plan.report.holding), color="0.3",
                  fontsize="small", ha="right", va="bottom")  # fmt: skip
    grip.set_ylabel(f"grip [{force.label}]")
    solutions = [simulate(scene, save_every=end / 400.0) for scene in plan.frictions]
    slides = [_slide(plan, solution) for solution in solutions]
    angles = [np.asarray(each.histories["theta"].values) - plan.scene.body.angle for each in solutions]
    angle, length = style.unit_for("angle", *angles), style.unit_for("length", *slides)
    factors = [1.0, *(each for each in (plan.report.frictions[0], plan.report.frictions[-1]) if len(solutions) > 1)]
    for i, (solution, factor) in enumerate(zip(solutions, factors, strict=True)):  # first as it is, then the others
        time = np.asarray(solution.histories["time"].values)
        label = "as the scene is" if i == 0 else f"friction {100.0 * (factor - 1.0):+.3g} %"
        line = {"color": style.PALETTE[i], "linestyle": style.LINE_STYLES[i], "label": label}
        turn.plot(time, angle.factor * angles[i], **line)
        slide.plot(time, length.factor * slides[i], **line)
    wanted = plan.report.goal
    if "angle" in wanted:
        turn.axhline(angle.factor * wanted["angle"], color="0.4", linewidth=0.9, linestyle=style.LINE_STYLES[2])
    else:
        size = float(np.hypot(*wanted["slide"]))
        slide.axhline(length.factor * size, color="0.4", linewidth=0.9, linestyle=style.LINE_STYLES[2])
    turn.set_ylabel(f"turn [{angle.label}]")
    slide.set_ylabel(f"slide [{length.label}]")
    slide.set_xlabel("time [s]")
    turn.legend(frameon=False, fontsize="small")
    for axes in (grip, turn, slide):
        style.tidy(axes)
    return figure


def _slide(plan: GripPlan, solution: Solution) -> np.ndarray:
    """Return the distance of the place that was under the grip from where it was `[T]` [m]."""
    return np.hypot(*slide_of(plan.scene, solution.contact_index(plan.contact), body_poses(solution)).T)
