"""The staircase of a line contact in steady state: plain sum, bilinear smoothing, and the rod that has no steps."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from planarfriction.extend import smoothed_spin_sum
from planarfriction.limit_surface import LimitSurfaceCells
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.plots.style import LINE_STYLES, PlotFigure
from planarfriction.scenes import Signal
from planarfriction.scenes.ready import published_velocity
from planarfriction.scenes.signal import sample_times
from planarfriction_studies.experiments import experiment, facts, looks
from planarfriction_studies.experiments.experiment import (
    TWIST,
    WRENCH,
    Arrays,
    Comparison,
    Reference,
    Result,
    Work,
)
from planarfriction_studies.experiments.runs import WIDTH
from planarfriction_studies.experiments.wording import report

SAMPLE_TIME = 1e-4
"""Time between the samples of the published curves [s]."""

SLIDE_RAMP = (0.8, 1.4, 0.015)
"""Start and end [s] of the ramp of vx, and the speed that it reaches [m/s]; the spin is 1 rad/s meanwhile."""

ALLOWANCE = {"N": 1e-9, "N m": 1e-12}
"""Rounding of a sum over 21 cells, generously."""

STEP = 0.02
"""Change of fx between neighbouring samples that counts as a step of the plain sum [N]: half a cell is 0.024 N."""

LINES = {
    "plain": ("plain sum", "-", 1.3, looks.DISTRIBUTED),
    "bilinear": ("bilinear smoothing", "-", 1.3, looks.PUBLISHED),
    "rod": ("rod, exact", LINE_STYLES[1], 1.1, looks.REFERENCE),
}
"""Wrenches that are compared -> words, style, width and colour of their lines."""


def rod_wrench(twist: np.ndarray, half_length: float) -> np.ndarray:
    """Return the sliding wrench `[..., 3]` [1, 1, m] of a uniform rod along y about its middle, exact; zero at rest.

    `W = -dPhi/dV` of `Phi = [F(u1) - F(u0)]/(4 a omega)`, `F(u) = u s + vy^2 asinh(u/|vy|)`, `s = sqrt(u^2 + vy^2)`,
    where `u1, u0 = vx +- omega a` are the speeds of the ends across the rod and `a` is `half_length` [m].
    """
    vx, vy, omega = np.moveaxis(np.asarray(twist, dtype=float), -1, 0)
    ends = np.stack([vx + omega * half_length, vx - omega * half_length])
    speeds = np.hypot(ends, vy)
    total = speeds.sum(axis=0)
    moving = np.where(total > 0.0, total, 1.0)
    spinning = np.where(omega != 0.0, omega, 1.0)
    along = np.where(vy != 0.0, np.abs(vy), 1.0)
    spread = np.where(
        vy != 0.0, np.arcsinh(ends[0] / along) - np.arcsinh(ends[1] / along), 0.0
    )
    fx = -2.0 * vx / moving
    fy = -np.where(
        omega != 0.0, vy * spread / (2.0 * half_length * spinning), 2.0 * vy / moving
    )
    # the integral of y u/s over the rod, by parts: differences between the ends of vx s - (u s - vy^2 asinh)/2
    difference = vx * (speeds[0] - speeds[1]) - 0.5 * (
        ends[0] * speeds[0] - ends[1] * speeds[1] - vy**2 * spread
    )
    torque = difference / (2.0 * half_length * spinning**2)
    return np.stack([fx, fy, np.where(omega != 0.0, torque, 0.0)], -1)


def smoothed_wrench(twist: np.ndarray, patch: ContactPatch) -> np.ndarray:
    """Return the sliding wrench `[T, 3]` [1, 1, m] with the published bilinear smoothing; the patch has its centre at
    the origin.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """
    grid = patch.grid
    assert grid is not None, "the smoothing needs a grid"
    place = (grid.x_min, grid.y_min, grid.cell_width, grid.cell_height)
    corners = np.full((grid.columns + 1, grid.rows + 1, 3), np.nan)
    x, y = np.ascontiguousarray(patch.positions.T)
    weights = np.array(patch.weights())
    # a slide has its centre of rotation outside every grid: there the plain sum holds
    wrench = LimitSurfaceCells(patch).wrench(twist)
    for i in np.flatnonzero(twist[:, 2] > 0.0):
        vx, vy, omega = twist[i]
        wrench[i] = -np.array(
            smoothed_spin_sum(corners, place, x, y, weights, -vy / omega, vx / omega)
        )
    return wrench


def run(work: Work) -> Result:
    """Carry out the experiment."""
    time = sample_times(5.0, SAMPLE_TIME)
    profile = dataclasses.replace(published_velocity(), hold="linear")
    twist = profile(time)
    cells = (11, 21) if work.quick else (11, 21, 41, 81)
    every = {
        count: work.piece(
            f"line, {count} cells", lambda count=count: _wrenches(twist, _line(count))
        )
        for count in cells
    }
    found = every[21]
    errors = {count: _errors(twist, each) for count, each in every.items()}
    steps = _steps(time, found["plain"][:, 0])
    numbers = _numbers(time, found, steps) | {
        "miss_if_labels_mean_the_state": _label_shifts(profile),
        "error_against_the_rod": {str(count): error for count, error in errors.items()},
    }
    along = ("time", time[::5], "s")
    speeds = experiment.with_units(twist[::5], TWIST)
    wrenches = {
        (name,): experiment.columns_of(time[::5], wrench[::5], WRENCH)
        for name, wrench in found.items()
    }
    return report(
        "staircase",
        {
            "staircase": _overview(time, found),
            "staircase_zoom": _zoom(time, found, numbers["edge"]),
        },
        numbers,
        _orders(errors),
        comparisons=_comparisons(time, profile, found, steps),
        tables=(_error_table(errors),),
        data={
            "line": experiment.dataset(wrenches, WRENCH, ("surface",), along, speeds)
        },
    )


def _line(cells: int = 21) -> ContactPatch:
    return PUBLISHED_PATCHES["Line"](cells=cells)


def _wrenches(twist: np.ndarray, patch: ContactPatch) -> Arrays:
    plain = LimitSurfaceCells(patch).wrench(twist)
    return {
        "plain": plain,
        "bilinear": smoothed_wrench(twist, patch),
        "rod": rod_wrench(twist, 0.5 * WIDTH),
    }


def _steps(time: np.ndarray, fx: np.ndarray) -> Arrays:
    """Return the last sample before each step of fx, and the height of the step, while vx changes."""
    change = np.abs(np.diff(fx))
    at = np.flatnonzero(change > STEP)
    return {"time": time[at], "height": change[at]}


def _published_steps() -> tuple[np.ndarray, float]:
    """Return the last published vertex before each step of plain fx, and the time to the next one [s]."""
    curve = facts.published_curve("staircase/plain/fx")
    before = np.flatnonzero(np.abs(np.diff(curve.values)) > STEP)
    return curve.time[before], float(np.diff(curve.time)[before].max())


def _label_shifts(profile: Any) -> dict[str, float]:
    """Compute the errors of plain fx and fy [N] at the published vertices if labels mean the sample before or after."""
    surface = LimitSurfaceCells(_line())
    curves = [facts.published_curve(f"staircase/plain/{name}") for name in WRENCH]
    result = {}
    for words, shift in (("before", -SAMPLE_TIME), ("at", 0.0), ("after", SAMPLE_TIME)):
        ours = [
            surface.wrench(profile(np.maximum(curve.time + shift, 0.0)))
            for curve in curves
        ]
        result[words] = max(
            float(np.abs(ours[i][:, i] - curves[i].values).max()) for i in (0, 1)
        )
    return result


def _errors(twist: np.ndarray, found: Arrays) -> dict[str, list[float]]:
    """Return the largest and mean distance from the rod, tangential [N] and torque [N m], of both sums."""
    moving = np.abs(twist).max(axis=1) > 0.0
    result = {}
    for name in ("plain", "bilinear"):
        miss = (found[name] - found["rod"])[moving]
        force = np.hypot(miss[:, 0], miss[:, 1])
        torque = np.abs(miss[:, 2])
        result[name] = [
            float(value)
            for value in (force.max(), force.mean(), torque.max(), torque.mean())
        ]
    return result


def _numbers(time: np.ndarray, found: Arrays, steps: Arrays) -> dict[str, Any]:
    spin = int(np.searchsorted(time, 0.7))  # any time of pure spin
    smoothed = found["bilinear"]
    high = _largest_jump(
        time, smoothed[:, 0], np.flatnonzero((time > 0.9) & (time < 1.4))
    )
    low = _largest_jump(
        time, smoothed[:, 1], np.flatnonzero((time > 3.4) & (time < 4.0))
    )
    inside = (time > SLIDE_RAMP[0] + 1e-3) & (time < high["time"] - 1e-3)
    return {
        "sample_time": SAMPLE_TIME,
        "published_vertices_around_a_step": _published_steps()[1],
        "radius": {name: float(-found[name][spin, 2]) for name in LINES},
        "steps": {
            "count": len(steps["time"]),
            "on the way up": int((steps["time"] < SLIDE_RAMP[1]).sum()),
            "first": float(steps["height"][0]),
            "largest": float(steps["height"].max()),
            "last samples before": steps["time"].tolist(),
        },
        "edge": {"high": high, "low": low},
        "kink_of_tau": {
            name: float(np.abs(np.diff(found[name][inside, 2], 2)).max() / SAMPLE_TIME)
            for name in ("bilinear", "rod")
        },
    }


def _largest_jump(
    time: np.ndarray, values: np.ndarray, part: np.ndarray
) -> dict[str, float]:
    change = np.abs(np.diff(values[part]))
    at = int(change.argmax())
    return {"time": float(time[part[at]]), "jump": float(change[at])}


def _comparisons(
    time: np.ndarray, profile: Signal, found: Arrays, steps: Arrays
) -> list[Comparison]:
    rows = []
    for name in ("plain", "bilinear"):
        ours = experiment.columns_of(time, found[name], WRENCH)
        words = f"steady state of the line, {LINES[name][0]}, "
        cause = "The same sum at the same samples: what is left is the error of reading the figure."
        curve = f"staircase/{name}"
        rows += experiment.compare_columns(
            "published", words, ours, curve, ALLOWANCE, cause, WRENCH
        )
    cause = "The same profile, at each sample's own time: what is left is the error of reading the figure."
    rows += experiment.compare_profile(
        profile, "convergence/velocity", TWIST, cause, dt=SAMPLE_TIME
    )
    return [*rows, *_plateaus(time, found), *_step_comparisons(steps)]


def _plateaus(time: np.ndarray, found: Arrays) -> list[Comparison]:
    """Compare the torque of a pure spin: published plateaus, plain sum and rod."""
    published = facts.published_table("patches")["Line"]
    spin = int(np.searchsorted(time, 0.7))
    cell = WIDTH / 21
    printed = "The table gives the contact radius to $10^{-11}$ m: rounding."
    sums = "The plain sum over $N$ = 21 equal cells of width $c$ is $c\\,(N^2 - 1)/(4N)$: rounding."
    rows: tuple[tuple[str, float, Reference, float, str], ...] = (
        (
            "plain",
            published["contact radius, plain sum [m]"],
            "published",
            6e-12,
            printed,
        ),
        (
            "bilinear",
            published["contact radius, as published [m]"],
            "published",
            6e-12,
            printed,
        ),
        ("plain", cell * (21**2 - 1) / (4 * 21), "closed form", 1e-15, sums),
        (
            "rod",
            0.25 * WIDTH,
            "closed form",
            1e-15,
            "A rod of half-length $a$ has $r = a/2$: rounding.",
        ),
    )
    return [
        experiment.compare(
            f"torque of a pure spin, {name}",
            found[name][spin, 2],
            -radius,
            of,
            within,
            "N m",
            cause,
        )
        for name, radius, of, within, cause in rows
    ]


def _step_comparisons(steps: Arrays) -> list[Comparison]:
    """Compare the times and heights of the steps of plain fx."""
    patch = _line()
    (start, end, speed) = SLIDE_RAMP
    upward = steps["time"] < end
    y = np.sort(patch.positions[:, 1])
    # The centre of rotation is at y = vx/omega.
    crossings = start + (end - start) * y[y > -1e-9] / speed
    # first and last the centre of rotation leaves and meets the middle cell
    heights = (
        np.where(
            np.isin(np.arange(len(steps["height"])), [0, len(steps["height"]) - 1]),
            1.0,
            2.0,
        )
        / patch.cells
    )
    return [
        experiment.compare(
            "last sample before each step of plain fx", steps["time"], _published_steps()[0], "published",
            0.5 * SAMPLE_TIME, "s",
            "The same samples on both sides of every step: the labels of this figure are the times of the state.",
        ),
        experiment.compare(
            "steps of plain fx while vx grows, from when the centre of rotation meets a cell to the last sample before",
            steps["time"][upward], crossings, "closed form", SAMPLE_TIME, "s",
            "A step shows at the first sample after the centre of rotation has met a cell: less than the sample time.",
        ),
        experiment.compare(
            "height of the steps of plain fx", steps["height"], heights, "closed form", ALLOWANCE["N"], "N",
            "A cell that the centre of rotation passes turns round and changes fx by twice its load; the middle "
            "one, which adds nothing while the centre of rotation stands on it, by once.",
        ),
    ]  # fmt: skip


def _orders(errors: dict[int, dict[str, list[float]]]) -> dict[str, Any]:
    """Return the fewest and most cells, and powers of their number with which largest and mean error in force fall."""
    few, *_, many = errors
    ratio = {
        name: np.log(np.array(errors[few][name]) / errors[many][name])
        / np.log(few / many)
        for name in errors[few]
    }
    return {
        "few": few,
        "many": many,
        "order": {name: values[:2].tolist() for name, values in ratio.items()},
    }


def _error_table(errors: dict[int, dict[str, list[float]]]) -> experiment.Table:
    """Return the largest and mean errors of both sums against the rod, by the number of cells."""
    rows = {
        f"{count}, {name}": values
        for count, error in errors.items()
        for name, values in error.items()
    }
    headings = {
        "force, max [N]": 1.0,
        "force, mean [N]": 1.0,
        "torque, max [N mm]": 1e3,
        "torque, mean [N mm]": 1e3,
    }
    columns = {
        heading: experiment.entry(i, scale=scale)
        for i, (heading, scale) in enumerate(headings.items())
    }
    return experiment.table(
        "Distance from the exact rod along the profile", rows, columns, "cells, sum"
    )


def _overview(time: np.ndarray, found: Arrays) -> PlotFigure:
    """Draw the force [N] and torque [N mm] over the whole profile."""
    figure, panels = looks.panels(9.0, 7.2, 3, sharex=True)
    for axes, name in zip(panels, WRENCH, strict=True):
        _draw(axes, time, found, name, (0.0, 5.0), size=3.0)
    panels[-1].set_xlabel("time [s]")
    looks.legend(figure, panels[0], 5)
    return figure


def _zoom(
    time: np.ndarray, found: Arrays, edge: dict[str, dict[str, float]]
) -> PlotFigure:
    """Draw the first steps of fx and of the torque; where the smoothing ends, at the times that `edge` holds."""
    figure, panels = looks.panels(9.6, 6.4, 2, 2)
    high = edge["high"]["time"]
    low = edge["low"]["time"]
    parts = (
        ("fx", (0.79, 0.97), "first steps, force"),
        ("tau", (0.79, 0.97), "first steps, torque"),
        (
            "fx",
            (high - 0.045, high + 0.03),
            "centre of rotation leaves at the high edge",
        ),
        ("fy", (low - 0.06, low + 0.04), "centre of rotation leaves at the low edge"),
    )
    for axes, (name, limits, title) in zip(panels.flat, parts, strict=True):
        _draw(axes, time, found, name, limits)
        axes.set_title(title, fontsize="medium")
        axes.set_xlabel("time [s]")
    looks.legend(figure, panels[0, 0], 5)
    return figure


def _draw(
    axes: Any,
    time: np.ndarray,
    found: Arrays,
    column: str,
    limits: tuple[float, float],
    size: float = 4.0,
) -> None:
    label, factor = looks.AXES[column]
    part = (time >= limits[0]) & (time <= limits[1])
    index = list(WRENCH).index(column)
    for name, (words, line, width, colour) in LINES.items():
        axes.plot(
            time[part],
            factor * found[name][part, index],
            ls=line,
            lw=width,
            color=colour,
            label=words,
        )
    for name, marker in (("plain", "o"), ("bilinear", "s")):
        look = {"ms": size, "mew": 0.9, "label": f"published, {name}"}
        looks.vertices(
            axes,
            f"staircase/{name}/{column}",
            factor,
            LINES[name][-1],
            limits,
            marker,
            **look,
        )
    axes.set(ylabel=label, xlim=limits)
