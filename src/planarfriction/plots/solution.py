"""The picture of a solution: its motion and its time histories in one figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planarfriction.plots import style
from planarfriction.plots.histories import draw_histories
from planarfriction.plots.motion import draw_motion

if TYPE_CHECKING:
    from planarfriction.scenes import Solution


def plot_solution(solution: Solution) -> style.PlotFigure:
    """Draw the motion of the body (left) and the time histories of body and contacts (right).

    Raises InvalidValueError for what is not a solution of a scene.
    """
    figure = style.new_figure(14.0, 6.8)
    parts: Any = figure.subfigures(1, 2, width_ratios=(1.0, 1.45))
    motion, histories = parts
    draw_motion(motion, solution)
    draw_histories(histories, solution)
    figure.suptitle(f"{solution.scene.name}", fontsize="large")
    return figure
