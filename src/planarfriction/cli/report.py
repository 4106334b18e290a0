"""Numbers of one or several solutions, next to each other."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import planarfriction as pf

FINISHED = "success"
"""Status of a simulation that ran until its last time."""


def comparison(solutions: Mapping[str, pf.Solution]) -> list[list[str]]:
    """Return rows of text for a table with one column for each solution; differences are those from the first."""
    from planarfriction.shown import unit_for

    every = list(solutions.values())
    ends = {name: [_last(each, name) for each in every] for name in ("x", "y", "theta")}
    length, angle = unit_for("length", ends["x"], ends["y"]), unit_for("angle", ends["theta"])
    rows = [
        [f"final {called} [{unit.label}]", *(f"{unit.factor * end:.5g}" for end in ends[name])]
        for name, called, unit in (("x", "x", length), ("y", "y", length), ("theta", "angle", angle))
    ]
    if len(every) > 1:
        differences = [largest_differences(each, every[0]) for each in every[1:]]
        rows.append(["largest difference, position [mm]", "", *(f"{1e3 * each[0]:.4g}" for each in differences)])
        rows.append(["largest difference, angle [deg]", "", *(f"{np.degrees(each[1]):.4g}" for each in differences)])
    statistics = [each.statistics for each in every]
    rows += [
        ["simulated time [s]", *(f"{_last(each, 'time'):g}" for each in every)],
        ["steps", *(f"{each.steps}" for each in statistics)],
        ["rejected steps", *(f"{each.rejections}" for each in statistics)],
        ["wall time [s]", *(f"{each.wall_time:.3g}" for each in statistics)],
        ["times faster than real time", *(_speed(each) for each in every)],
    ]
    if any(each.compile_time > 0.1 for each in statistics):
        rows.append(["loading or compiling the solver [s]", *(f"{each.compile_time:.3g}" for each in statistics)])
    if any(each.status != FINISHED for each in every):
        rows.append(["ended", *(each.status for each in every)])
    return rows


def largest_differences(solution: pf.Solution, reference: pf.Solution) -> tuple[float, float]:
    """Return the largest differences of position [m] and angle [rad] over the time that both solutions cover."""
    time, own = reference.histories["time"].values, solution.histories["time"].values
    time = time[time <= own[-1]]
    dx, dy, dtheta = (
        np.interp(time, own, solution.histories[name].values) - reference.histories[name].values[: len(time)]
        for name in ("x", "y", "theta")
    )
    return float(np.hypot(dx, dy).max()), float(np.abs(dtheta).max())


def _last(solution: pf.Solution, name: str) -> float:
    return float(solution.histories[name].values[-1])


def _speed(solution: pf.Solution) -> str:
    wall = solution.statistics.wall_time
    return f"{_last(solution, 'time') / wall:.3g}" if wall > 0.0 else ""
