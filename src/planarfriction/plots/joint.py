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
    problem, base = fit.trial.problem, fit.baseline.problem
    gains = fit.baseline.errors - fit.trial.errors
    log = problem.logs[int(np.argmax(gains)) // problem.parts]
    if problem.by_torque:
        measured, runs = log.torque, (base.torque(fit.baseline.values, log), fit.torque(log))
    else:
        measured, runs = log.q, (base.simulated(fit.baseline.values, log)[:, 0], fit.simulate(log)[:, 0])
    what = f"torque [{fit.unit}]" if problem.by_torque else f"angle [{fit.unit}]"
    figure = style.new_figure(9.6, 5.4)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.4, 1.0], width_ratios=[1.6, 1.0])
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    upper.plot(log.time, measured, color=style.EXACT, lw=1.0, label=f"measured, {log.name}")
    for run, colour, name in zip(runs, (style.MEASURED, style.DISTRIBUTED), ("Coulomb + viscous", "fit"), strict=True):
        upper.plot(log.time, run, color=colour, lw=1.2, label=name)
        lower.plot(log.time, run - measured, color=colour, lw=1.0)
    upper.set_ylabel(what)
    figure.legend(*upper.get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False)
    lower.set(xlabel="time [s]", ylabel=f"error [{fit.unit}]")
    side = figure.add_subplot(grid[:, 1])
    fastest = max(float(np.abs(each.speed).max()) for each in problem.logs)
    speed, friction = np.geomspace(1e-3 * fastest, fastest, 200), fit.friction
    pushed = max(
        float(np.abs(each.torque if problem.by_torque else fit.torque_gain * each.volts).max()) for each in problem.logs
    )
    level = friction.mu_c + (friction.mu_s - friction.mu_c) * np.exp(-((speed / friction.v_s) ** 2))
    shares = SHARES if friction.load_motor or friction.load_external else SHARES[:1]
    for share, colour, line in zip(shares, style.PALETTE, style.LINE_STYLES, strict=False):
        load = friction.load(share * pushed, -share * pushed)
        look = {"color": colour, "ls": line, "label": f"held load {share * pushed:.2g} N m"}
        side.semilogx(speed, level + load + friction.sigma_2 * speed, **look)
    side.set(xlabel="speed [rad/s]", ylabel="friction [N m]", ylim=(0.0, None))
    side.legend(frameon=False)
    for axes in (upper, lower, side):
        style.tidy(axes)
    return figure
