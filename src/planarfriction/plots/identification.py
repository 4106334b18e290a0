"""Plots of fits: measured and fitted channels, what is left, and the speeds that were covered; the same of a joint."""

from __future__ import annotations

from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction import formulas
from planarfriction._support.shown import Unit, unit_for
from planarfriction.plots import style

KINDS = {"N": "force", "N m": "torque", "m": "length", "rad": "angle"}
"""Unit of a channel -> kind of quantity."""

MOST_NOISE = 5.0
"""Largest residual over the noise that is drawn where it is [-]; the rest stand at the rim."""

STILL = 1e-5
"""Speed below which nothing slides, over the largest one."""

LOADED = 5.0
"""Displacement that is drawn after a reversal, over the deflection of a bristle at the static friction [-]."""

MOST_POINTS = 4000
"""Samples that are drawn; of more, evenly chosen ones."""


def plot_identification(result: pf.identify.Identification) -> style.PlotFigure:
    """Draw each measured channel with its fit (left) and the residual over the noise (right), logs one after another.

    Residuals of a good fit fill the band of two spreads of the noise and show no pattern; triangles at the rim stand
    for larger ones. With wrenches, the friction coefficient over the sliding speed is drawn below with the fitted
    Stribeck curve: where it has no samples, the data say nothing. Beside it the correlation of the residuals over time,
    which that of noise leaves at zero. At the bottom predictions of fits that did not see a sample or its block, over
    what was measured; of a log of one coordinate also the friction over its velocity, and over the displacement since
    the last reversal, as long as bristles still load.
    """
    with_speed = "speed" in result.histories[0]
    shown = [
        i
        for i in range(len(result.channels))
        if any(np.isfinite(h["measured"][:, i]).any() for h in result.histories)
    ]
    rows = len(shown)
    figure = style.new_figure(9.6, 1.75 * rows + (5.8 if with_speed else 0.6))
    grid = figure.add_gridspec(
        rows + 2 * with_speed, 2, height_ratios=[1.0] * rows + [1.5, 1.6] * with_speed
    )
    place = _places(result)
    left = right = None
    for row, i in enumerate(shown):
        left = figure.add_subplot(grid[row, 0], sharex=left)
        right = figure.add_subplot(grid[row, 1], sharex=left, sharey=right)
        _draw_channel(left, right, result, i, place)
    assert left is not None and right is not None
    several = len(result.histories) > 1
    for axes in (left, right):
        axes.set_xlabel("time, one after another [s]" if several else "time [s]")
    figure.axes[1].set_title(
        "(measured \N{MINUS SIGN} fitted) / noise", fontsize="medium"
    )
    if with_speed:
        _draw_speeds(figure.add_subplot(grid[rows, 0]), result)
        _draw_correlations(figure.add_subplot(grid[rows, 1]), result)
        below = grid[rows + 1, :].subgridspec(1, rows if rows > 1 else 3)
        for column, i in enumerate(shown):
            _draw_held_out(figure.add_subplot(below[0, column]), result, i)
        if rows == 1:
            _draw_loops(
                figure.add_subplot(below[0, 1]),
                figure.add_subplot(below[0, 2]),
                result,
                shown[0],
            )
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside upper left",
        ncols=2,
        frameon=False,
        fontsize="small",
    )
    return figure


def _places(result: pf.identify.Identification) -> list[np.ndarray]:
    """Return the times of each log [s], shifted so that the logs follow each other with a gap."""
    total = sum(each["time"][-1] - each["time"][0] for each in result.histories)
    gap = 0.01 * total
    at = 0.0
    places = []
    for each in result.histories:
        time = np.asarray(each["time"])
        places.append(time if len(result.histories) == 1 else time - time[0] + at)
        at += time[-1] - time[0] + gap
    return places


def _unit_of(result: pf.identify.Identification, i: int) -> Unit:
    """Return the unit in which a measured channel reads well."""
    measured = (np.nan_to_num(each["measured"][:, i]) for each in result.histories)
    return unit_for(KINDS[result.channels[i][1]], *measured)


def _draw_channel(
    left: Any,
    right: Any,
    result: pf.identify.Identification,
    i: int,
    places: list[np.ndarray],
) -> None:
    name, _ = result.channels[i]
    shown = _unit_of(result, i)
    for number, (each, time) in enumerate(zip(result.histories, places, strict=True)):
        for key, words, colour, width in (
            ("measured", "measured", style.MEASURED, 2.2),
            ("predicted", "fitted", style.REDUCED, 0.9),
        ):
            values = shown.factor * each[key][:, i]
            label = words if number == 0 else None
            left.plot(time, values, color=colour, linewidth=width, label=label)
        off = (each["measured"][:, i] - each["predicted"][:, i]) / result.noise[i]
        every = max(1, len(time) // MOST_POINTS)
        right.plot(
            time[::every], off[::every], ".", color=style.REDUCED, markersize=1.5
        )
        beyond = np.abs(off) > MOST_NOISE
        for sign, marker in ((1.0, "^"), (-1.0, "v")):
            there = time[beyond & (sign * off > 0.0)][::every]
            rim = np.full(len(there), 0.96 * sign * MOST_NOISE)
            right.plot(there, rim, marker, color=style.REDUCED, markersize=2.5)
    right.axhspan(-2.0, 2.0, color="0.92", zorder=0)
    left.set_ylabel(f"{name} [{shown.label}]")
    style.tidy(left, right)
    right.set_ylim(-MOST_NOISE, MOST_NOISE)


def _draw_speeds(axes: Any, result: pf.identify.Identification) -> None:
    """Draw measured friction over load against the sliding speed, beside the fitted steady friction of pure sliding."""
    speed = np.concatenate([each["speed"] for each in result.histories])
    coefficient = np.concatenate([each["coefficient"] for each in result.histories])
    usable = (speed > STILL * speed.max()) & np.isfinite(coefficient)
    speed = speed[usable]
    coefficient = coefficient[usable]
    if not len(speed):
        return
    every = max(1, len(speed) // MOST_POINTS)
    slides = 1e3 * speed[::every]
    axes.plot(
        slides,
        coefficient[::every],
        ".",
        color=style.MEASURED,
        ms=2.0,
        label="measured",
    )
    law = result.law
    grid = np.geomspace(max(speed.min(), 1e-4 * speed.max()), speed.max(), 200)
    steady = formulas.stribeck(np, grid, law) + law.sigma_2 * grid
    axes.plot(
        1e3 * grid, steady, color=style.REDUCED, label="fitted law, steady sliding"
    )
    axes.set(xscale="log", xlabel="sliding speed [mm/s]", ylabel="friction / load [-]")
    axes.set_ylim(0.0, 1.1 * max(steady.max(), np.quantile(coefficient, 0.995)))
    axes.legend(frameon=False, fontsize="small", loc="lower right")
    style.tidy(axes)


def _draw_correlations(axes: Any, result: pf.identify.Identification) -> None:
    """Draw the correlations of the residuals of each channel over the lag, with the band of those of noise."""
    values = result.residual_correlations()
    samples = sum(len(each["time"]) for each in result.histories)
    step = float(np.median(np.diff(result.histories[0]["time"])))
    band = 2.0 / np.sqrt(samples)
    axes.axhspan(-band, band, color="0.92", zorder=0)
    lags = 1e3 * step * np.arange(len(values))
    for i, (name, _) in enumerate(result.channels):
        if values[:, i].any():
            axes.plot(lags, values[:, i], color=style.SERIES[i], label=name)
    axes.set(xlabel="lag [ms]", ylabel="correlation of residuals [-]")
    axes.legend(frameon=False, fontsize="small")
    style.tidy(axes)


def _draw_held_out(axes: Any, result: pf.identify.Identification, i: int) -> None:
    """Draw predictions of samples that fits did not see over their measurements; a good fit keeps to the diagonal."""
    name, unit = result.channels[i]
    pairs = np.concatenate(
        [
            np.stack([each["measured"][:, i], each["held_out"][:, i]])
            for each in result.histories
        ],
        axis=1,
    )
    pairs = pairs[:, np.isfinite(pairs).all(axis=0)]
    shown = unit_for(KINDS[unit], pairs[0])
    pairs = shown.factor * pairs
    every = max(1, pairs.shape[1] // MOST_POINTS)
    axes.plot(*pairs[:, ::every], ".", color=style.MEASURED, markersize=2.0)
    edges = [pairs[0].min(), pairs[0].max()]
    axes.plot(edges, edges, color=style.REFERENCE, linewidth=0.9, zorder=1)
    axes.set(
        xlabel=f"measured {name} [{shown.label}]",
        ylabel=f"held-out prediction [{shown.label}]",
    )
    style.tidy(axes)


def _draw_loops(
    over_speed: Any, over_way: Any, result: pf.identify.Identification, i: int
) -> None:
    """Draw a channel over the velocity along it, and over the displacement since the last reversal."""
    name, unit = result.channels[i]
    turning = unit == "N m"
    force = _unit_of(result, i)
    size = float(result.model.patch.contact_radius()) if turning else 1.0
    longest = LOADED * result.law.mu_s / result.law.sigma_0 / size
    way = unit_for("angle" if turning else "length", np.array([longest]))
    for each in result.histories:
        speed = each["twist"][:, i]
        time = each["time"]
        step = np.concatenate([[0.0], 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)])
        since = np.cumsum(step)
        turned = np.concatenate([[True], np.sign(step[1:]) * np.sign(step[:-1]) < 0.0])
        last = np.maximum.accumulate(np.where(turned, np.arange(len(time)), 0))
        since = since - since[np.maximum(last - 1, 0)]
        near = np.where(np.abs(since) <= longest, since, np.nan)
        for key, look in (
            (
                "measured",
                {"color": style.MEASURED, "ls": "none", "marker": ".", "ms": 2.0},
            ),
            ("predicted", {"color": style.REDUCED, "lw": 0.8}),
        ):
            values = force.factor * each[key][:, i]
            over_speed.plot(speed, values, **look)
            over_way.plot(way.factor * near, values, **look)
    over_speed.set_xlabel("velocity [rad/s]" if turning else "velocity [m/s]")
    over_way.set_xlabel(f"displacement since reversal [{way.label}]")
    for axes in (over_speed, over_way):
        axes.set_ylabel(f"{name} [{force.label}]")
    style.tidy(over_speed, over_way)


SHARES = (0.0, 0.5, 1.0)
"""Loads that are drawn, over the largest of the logs."""


def plot_joint(fit: Any) -> style.PlotFigure:
    """Draw the log that gains most from the fit, what is left of it, and friction over speed by load.

    Orange is the fit of Coulomb and viscous friction alone, which simulators have. Friction over speed is left out
    while the fit has a term that the logs do not show.
    """
    gains = [np.abs(each.baseline - each.measured).mean() - np.abs(each.fitted - each.measured).mean()
             for each in fit.series]  # fmt: skip
    series = fit.series[int(np.argmax(gains))]
    what = "angle" if fit.unit == "rad" else "torque"
    figure = style.new_figure(7.4, 4.4)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.4, 1.0], width_ratios=[1.6, 1.0])
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    side = figure.add_subplot(grid[:, 1])
    words = f"measured, {series.name}"
    upper.plot(series.time, series.measured, color=style.MEASURED, lw=3.0, label=words)
    runs = (
        (series.baseline, style.BUILT_IN, "Coulomb + viscous"),
        (series.fitted, style.REDUCED, "fit"),
    )
    for run, colour, name in runs:
        upper.plot(series.time, run, color=colour, lw=1.2, label=name)
        lower.plot(series.time, run - series.measured, color=colour, lw=1.0)
    upper.set_ylabel(f"{what} [{fit.unit}]")
    figure.legend(
        *upper.get_legend_handles_labels(),
        loc="outside upper left",
        ncols=3,
        frameon=False,
    )
    lower.set(xlabel="time [s]", ylabel=f"error [{fit.unit}]")
    side.set(xlabel="speed [rad/s]", ylabel="friction [N m]")
    if fit.unclear:
        words = f"not shown by these logs:\n{', '.join(fit.unclear)}"
        side.text(0.5, 0.5, words, ha="center", va="center", transform=side.transAxes)
    else:
        _plot_levels(fit, side)
    style.tidy(upper, lower, side)
    return figure


def _plot_levels(fit: Any, axes: Any) -> None:
    """Draw friction over speed at the loads of the logs."""
    fastest = max(float(np.abs(each.speed).max()) for each in fit.logs)
    speed = np.geomspace(1e-3 * fastest, fastest, 200)
    friction = fit.friction
    level = friction.law.steady_friction(speed)
    motor = (
        each.torque if fit.unit == "N m" else fit.torque_gain * each.volts
        for each in fit.logs
    )
    pushed = max(float(np.abs(each).max()) for each in motor)
    shares = SHARES if friction.load_motor or friction.load_external else SHARES[:1]
    for share, colour, line in zip(
        shares, style.SHADES[::-1], style.LINE_STYLES, strict=False
    ):
        load = friction.load(share * pushed, -share * pushed)
        label = f"load {share * pushed:.2g} N m"
        axes.semilogx(speed, level + load, color=colour, ls=line, label=label)
    axes.set_ylim(0.0, None)
    if len(shares) > 1:
        axes.legend(frameon=False)
