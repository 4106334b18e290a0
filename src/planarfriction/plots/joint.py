"""Plot of a fitted joint: measured and simulated motion, what is left, and friction over speed by load."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.plots import style

SHARES = (0.0, 0.5, 1.0)
"""Loads that are drawn, over the largest of the logs."""


def plot_joint(fit: Any) -> style.PlotFigure:
    """Draw the log that gains most from the fit, what is left of it, and friction over speed by load.

    Grey is the fit of Coulomb and viscous friction alone.
    """
    problem = fit.problem
    gains = fit.baseline.errors - fit.errors
    log = problem.logs[int(np.argmax(gains)) // problem.parts]
    if problem.by_torque:
        measured, runs, what = log.torque, [each.torque(log) for each in (fit.baseline, fit)], "torque"
    else:
        measured, runs, what = log.q, [each.simulate(log)[:, 0] for each in (fit.baseline, fit)], "angle"
    figure = style.new_figure(9.6, 5.4)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.4, 1.0], width_ratios=[1.6, 1.0])
    upper = figure.add_subplot(grid[0, 0])
    lower, side = figure.add_subplot(grid[1, 0], sharex=upper), figure.add_subplot(grid[:, 1])
    upper.plot(log.time, measured, color=style.EXACT, lw=1.0, label=f"measured, {log.name}")
    for run, colour, name in zip(runs, (style.MEASURED, style.DISTRIBUTED), ("Coulomb + viscous", "fit"), strict=True):
        upper.plot(log.time, run, color=colour, lw=1.2, label=name)
        lower.plot(log.time, run - measured, color=colour, lw=1.0)
    upper.set_ylabel(f"{what} [{fit.unit}]")
    figure.legend(*upper.get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False)
    lower.set(xlabel="time [s]", ylabel=f"error [{fit.unit}]")
    fastest = max(float(np.abs(each.speed).max()) for each in problem.logs)
    speed, friction = np.geomspace(1e-3 * fastest, fastest, 200), fit.friction
    level = friction.law.steady_friction(speed)
    motor = (each.torque if problem.by_torque else fit.torque_gain * each.volts for each in problem.logs)
    pushed = max(float(np.abs(each).max()) for each in motor)
    shares = SHARES if friction.load_motor or friction.load_external else SHARES[:1]
    for share, colour, line in zip(shares, style.PALETTE, style.LINE_STYLES, strict=False):
        load = friction.load(share * pushed, -share * pushed)
        look = {"color": colour, "ls": line, "label": f"held load {share * pushed:.2g} N m"}
        side.semilogx(speed, level + load, **look)
    side.set(xlabel="speed [rad/s]", ylabel="friction [N m]", ylim=(0.0, None))
    side.legend(frameon=False)
    for axes in (upper, lower, side):
        style.tidy(axes)
    return figure
