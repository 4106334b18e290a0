"""One picture of the comparison of simulators: what each kind of friction gets wrong, and what it costs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from planarfriction.plots.style import PlotFigure, new_figure, tidy
from planarfriction_studies.experiments import looks

COLOURS = {"patches, distributed": looks.DISTRIBUTED, "patches": looks.MOMENTS, "without": looks.EXACT}
"""Colours by the beginning of a way's name; the simulator's own friction has `OWN`."""

OWN = looks.OTHERS[2]


def overview(found: Mapping[str, Any], own: str) -> PlotFigure:
    """Draw six panels: a row for each way, a point for each case."""

    def times(values: Mapping[str, float], case: Mapping[str, Any]) -> float:
        return values["seconds"] / case[own]["seconds"]

    panels: tuple[tuple[str, str, tuple[float, float], Callable[..., float]], ...] = (
        (
            "held",
            "creep of what is held [µm/s]",
            (1e-6, 1e5),
            lambda v, _: np.inf if v["dropped"] else 1e6 * v["creep"],
        ),
        ("shaken", "slip while shaken [µm]", (1e-2, 1e5), lambda v, _: 1e6 * v["slip"]),
        ("in hand", "end in the hand, error [mm]", (0.1, 1e3), lambda v, _: 1e3 * float(np.hypot(v["x"], v["y"]))),
        ("disc", "distance of the disc, error [%]", (1e-3, 1e2), lambda v, _: 100.0 * abs(v["distance"])),
        ("disc", "angle of the disc, error [%]", (1e-3, 1e2), lambda v, _: 100.0 * abs(v["angle"])),
        ("cost", "time of a step, ratio", (0.1, 10.0), times),
    )
    figure = new_figure(11.0, 6.0)
    for axes, (kind, label, limits, value) in zip(figure.subplots(2, 3).flat, panels, strict=True):
        ways = list(next(iter(found[kind].values())))
        for row, way in enumerate(ways):
            shown = [value(case[way], case) for case in found[kind].values()]
            colour = next((COLOURS[begin] for begin in COLOURS if way.startswith(begin)), OWN)
            # beyond the axis: at its edge, an arrow
            for x in shown:
                marker = "<" if x < limits[0] else ">" if x > limits[1] else "o"
                axes.plot(np.clip(x, *limits), row, marker, color=colour, ms=6, alpha=0.75, clip_on=False, mew=0)
        axes.set(xscale="log", xlim=limits, xlabel=label, ylim=(len(ways) - 0.5, -0.5))
        axes.set_yticks(range(len(ways)), ways, fontsize="small")
        tidy(axes)
    return figure
