"""The staircase of a line contact in steady state: plain sum, bilinear smoothing, and the rod that has no steps."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.kernels import spin_sums
from planarfriction.limit_surface import LimitSurfaceCells
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.scenes.ready import published_velocity
from planarfriction.scenes.signal import sample_times
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import (
    Arrays,
    Comparison,
    Reference,
    Result,
    Table,
    Work,
    compare,
    compare_curve,
    dataset,
    table,
)
from planarfriction_studies.experiments.staircase.figures import overview, zoom
from planarfriction_studies.experiments.wording import fill

if TYPE_CHECKING:
    import xarray as xr

WIDTH = 0.02
"""Length of the line [m]."""

SAMPLE_TIME = 1e-4
"""Time between the samples of the published curves [s]."""

COMPONENTS = (("fx", "N"), ("fy", "N"), ("tau", "N m"))

SLIDE_RAMP = (0.8, 1.4, 0.015)
"""Start and end [s] of the ramp of vx, and the speed that it reaches [m/s]; the spin is 1 rad/s meanwhile."""

ALLOWANCE = {"N": 1e-9, "N m": 1e-12}
"""Rounding of a sum over 21 cells, generously."""

STEP = 0.02
"""Change of fx between neighbouring samples that counts as a step of the plain sum [N]: half a cell is 0.024 N."""


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
    spinning, along = np.where(omega != 0.0, omega, 1.0), np.where(vy != 0.0, np.abs(vy), 1.0)
    spread = np.where(vy != 0.0, np.arcsinh(ends[0] / along) - np.arcsinh(ends[1] / along), 0.0)
    fx = -2.0 * vx / moving
    fy = -np.where(omega != 0.0, vy * spread / (2.0 * half_length * spinning), 2.0 * vy / moving)
    # the integral of y u/s over the rod, by parts: differences between the ends of vx s - (u s - vy^2 asinh)/2
    difference = vx * (speeds[0] - speeds[1]) - 0.5 * (ends[0] * speeds[0] - ends[1] * speeds[1] - vy**2 * spread)
    torque = difference / (2.0 * half_length * spinning**2)
    return np.stack([fx, fy, np.where(omega != 0.0, torque, 0.0)], -1)


def smoothed_wrench(twist: np.ndarray, patch: ContactPatch) -> np.ndarray:
    """Return the sliding wrench `[T, 3]` [1, 1, m] with the published bilinear smoothing; the patch is centred on the
    origin.

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
        wrench[i] = -np.array(spin_sums.smoothed_spin_sum(corners, place, x, y, weights, -vy / omega, vx / omega))
    return wrench


def run(work: Work) -> Result:
    """Carry out the experiment."""
    time = sample_times(5.0, SAMPLE_TIME)
    profile = dataclasses.replace(published_velocity(), hold="linear")
    twist = profile(time)
    patch = PUBLISHED_PATCHES["Line"](width=WIDTH)
    found = work.piece("line, 21 cells", lambda: _wrenches(twist, patch))
    steps = _steps(time, found["plain"][:, 0])
    shifts = _label_shifts(profile, patch)
    cells = (11, 21) if work.quick else (11, 21, 41, 81)
    errors = {count: _errors(work, twist, count) for count in cells}
    numbers = _numbers(time, found, steps) | {
        "miss_if_labels_mean_the_state": shifts,
        "error_against_the_rod": {str(count): error for count, error in errors.items()},
    }
    return fill("staircase", **_template_values(numbers)).result(
        {"staircase": overview(time, found), "staircase_zoom": zoom(time, found, numbers["edge"])},
        comparisons=_comparisons(time, twist, found, steps, patch),
        numbers=numbers,
        tables=(_error_table(errors),),
        data={"line": _dataset(time, twist, found)},
    )


def _wrenches(twist: np.ndarray, patch: ContactPatch) -> Arrays:
    return {
        "plain": LimitSurfaceCells(patch).wrench(twist),
        "bilinear": smoothed_wrench(twist, patch),
        "rod": rod_wrench(twist, 0.5 * WIDTH),
    }


def _steps(time: np.ndarray, fx: np.ndarray) -> Arrays:
    """Return the last sample before each step of fx, and the height of the step, while vx changes."""
    change = np.abs(np.diff(fx))
    at = np.flatnonzero(change > STEP)
    return {"time": time[at], "height": change[at]}


def _published_steps() -> tuple[np.ndarray, float]:
    """Return the last published vertex before each step of plain fx, and the time to the next one [s], the same at
    every step."""
    curve = facts.published_curve("staircase/plain/fx")
    before = np.flatnonzero(np.abs(np.diff(curve.values)) > STEP)
    return curve.time[before], float(np.diff(curve.time)[before].max())


def _label_shifts(profile: Any, patch: ContactPatch) -> dict[str, float]:
    """Compute the errors of plain fx and fy [N] at the published vertices if labels mean the sample before or after."""
    surface = LimitSurfaceCells(patch)
    result = {}
    for words, shift in (("before", -SAMPLE_TIME), ("at", 0.0), ("after", SAMPLE_TIME)):
        misses = []
        for column, name in enumerate(("fx", "fy")):
            curve = facts.published_curve(f"staircase/plain/{name}")
            ours = surface.wrench(profile(np.maximum(curve.time + shift, 0.0)))[:, column]
            misses.append(float(np.abs(ours - curve.values).max()))
        result[words] = max(misses)
    return result


def _errors(work: Work, twist: np.ndarray, count: int) -> dict[str, list[float]]:
    """Return the largest and mean distance from the rod, tangential [N] and torque [N m], of both sums over `count`
    cells."""
    patch = PUBLISHED_PATCHES["Line"](cells=count, width=WIDTH)
    found = work.piece(f"line, {count} cells", lambda: _wrenches(twist, patch))
    moving = np.abs(twist).max(axis=1) > 0.0
    result = {}
    for name in ("plain", "bilinear"):
        miss = (found[name] - found["rod"])[moving]
        force, torque = np.hypot(miss[:, 0], miss[:, 1]), np.abs(miss[:, 2])
        result[name] = [float(value) for value in (force.max(), force.mean(), torque.max(), torque.mean())]
    return result


def _crossings(patch: ContactPatch) -> np.ndarray:
    """Compute the times [s] at which the centre of rotation, y = vx/omega, meets centres of cells on the ramp of vx."""
    start, end, speed = SLIDE_RAMP
    y = np.sort(patch.positions[:, 1])
    return start + (end - start) * y[y > -1e-9] / speed


def _numbers(time: np.ndarray, found: Arrays, steps: Arrays) -> dict[str, Any]:
    spin = int(np.searchsorted(time, 0.7))  # any time of pure spin
    radius = {name: float(-found[name][spin, 2]) for name in ("plain", "bilinear", "rod")}
    smoothed = found["bilinear"]
    up = np.flatnonzero((time > 0.9) & (time < 1.4))
    down = np.flatnonzero((time > 3.4) & (time < 4.0))
    high, low = (_largest_jump(time, smoothed[:, column], part) for column, part in ((0, up), (1, down)))
    inside = (time > SLIDE_RAMP[0] + 1e-3) & (time < high["time"] - 1e-3)
    return {
        "sample_time": SAMPLE_TIME,
        "published_vertices_around_a_step": _published_steps()[1],
        "radius": radius,
        "steps": {
            "count": len(steps["time"]),
            "on the way up": int((steps["time"] < 1.4).sum()),
            "first": float(steps["height"][0]),
            "largest": float(steps["height"].max()),
            "last samples before": steps["time"].tolist(),
        },
        "edge": {"high": high, "low": low},
        "kink_of_tau": {
            name: float(np.abs(np.diff(found[name][inside, 2], 2)).max() / SAMPLE_TIME) for name in ("bilinear", "rod")
        },
    }


def _largest_jump(time: np.ndarray, values: np.ndarray, part: np.ndarray) -> dict[str, float]:
    change = np.abs(np.diff(values[part]))
    at = int(change.argmax())
    return {"time": float(time[part[at]]), "jump": float(change[at])}


def _comparisons(
    time: np.ndarray, twist: np.ndarray, found: Arrays, steps: Arrays, patch: ContactPatch
) -> list[Comparison]:
    rows = []
    same = "The same sum at the same samples: what is left is the error of reading the figure."
    for name, words in (("plain", "plain sum"), ("bilinear", "bilinear smoothing")):
        for (component, unit), values in zip(COMPONENTS, found[name].T, strict=True):
            quantity, curve = f"steady state of the line, {words}, {component}", f"staircase/{name}/{component}"
            rows.append(compare_curve(quantity, time, values, curve, ALLOWANCE[unit], same))
    same = "The same profile, at each sample's own time: what is left is the error of reading the figure."
    for component, values in zip(("vx", "vy", "omega"), twist.T, strict=True):
        quantity, curve = f"velocity profile, {component}", f"convergence/velocity/{component}"
        rows.append(compare_curve(quantity, time, values, curve, 1e-12, same))
    return [*rows, *_plateaus(time, found), *_step_comparisons(steps, patch)]


def _plateaus(time: np.ndarray, found: Arrays) -> list[Comparison]:
    """Compare the torque of a pure spin: published plateaus, plain sum and rod."""
    published = facts.published_table("patches")["Line"]
    spin = int(np.searchsorted(time, 0.7))
    cell = WIDTH / 21
    printed = "The table gives the contact radius to $10^{-11}$ m: rounding."
    sums = "The plain sum over $N$ = 21 equal cells of width $c$ is $c\\,(N^2 - 1)/(4N)$: rounding."
    rows: tuple[tuple[str, float, Reference, float, str], ...] = (
        ("plain", published["contact radius, plain sum [m]"], "published", 6e-12, printed),
        ("bilinear", published["contact radius, as published [m]"], "published", 6e-12, printed),
        ("plain", cell * (21**2 - 1) / (4 * 21), "closed form", 1e-15, sums),
        ("rod", 0.25 * WIDTH, "closed form", 1e-15, "A rod of half-length $a$ has $r = a/2$: rounding."),
    )
    return [
        compare(f"torque of a pure spin, {name}", found[name][spin, 2], -radius, reference, within, "N m", cause)
        for name, radius, reference, within, cause in rows
    ]


def _step_comparisons(steps: Arrays, patch: ContactPatch) -> list[Comparison]:
    """Compare the times and heights of the steps of plain fx."""
    theirs, _ = _published_steps()
    upward = steps["time"] < SLIDE_RAMP[1]
    # first and last the centre of rotation leaves and meets the middle cell
    heights = np.where(np.isin(np.arange(len(steps["height"])), [0, len(steps["height"]) - 1]), 1.0, 2.0) / patch.cells
    return [
        compare(
            "last sample before each step of plain fx", steps["time"], theirs, "published", 0.5 * SAMPLE_TIME, "s",
            "The same samples on both sides of every step: the labels of this figure are the times of the state.",
        ),
        compare(
            "steps of plain fx while vx grows, from when the centre of rotation meets a cell to the last sample before",
            steps["time"][upward], _crossings(patch), "closed form", SAMPLE_TIME, "s",
            "A step shows at the first sample after the centre of rotation has met a cell: less than the sample time.",
        ),
        compare(
            "height of the steps of plain fx", steps["height"], heights, "closed form", ALLOWANCE["N"], "N",
            "A cell that the centre of rotation passes turns round and changes fx by twice its load; the middle "
            "one, which adds nothing while the centre of rotation stands on it, by once.",
        ),
    ]  # fmt: skip


def _dataset(time: np.ndarray, twist: np.ndarray, found: Arrays) -> xr.Dataset:
    wrenches = {(name,): dict(zip(dict(COMPONENTS), wrench[::5].T, strict=True)) for name, wrench in found.items()}
    result = dataset(wrenches, dict(COMPONENTS), ("surface",), ("time", time[::5], "s"))
    speeds = zip(("vx", "vy", "omega"), ("m/s", "m/s", "rad/s"), twist[::5].T, strict=True)
    return result.assign({name: ("time", values, {"units": unit}) for name, unit, values in speeds})


def _template_values(numbers: dict[str, Any]) -> dict[str, Any]:
    """Return the values that the template names."""
    radius, by_cells = numbers["radius"], numbers["error_against_the_rod"]
    few, *_, many = by_cells
    sums = ("plain", "bilinear")
    return {
        "sample_time": numbers["sample_time"],
        "thinned": numbers["published_vertices_around_a_step"],
        "steps": numbers["steps"],
        "edge": numbers["edge"],
        "shifts": numbers["miss_if_labels_mean_the_state"],
        "kink": numbers["kink_of_tau"],
        "radius": radius,
        "lost": {name: 1.0 - radius[name] / radius["rod"] for name in sums},
        "by_cells": by_cells,
        "few": few,
        "many": many,
        "order": {name: _orders(by_cells, name) for name in sums},
    }


def _orders(by_cells: dict[str, dict[str, list[float]]], name: str) -> list[float]:
    """Return powers of the number of cells with which the largest and the mean error in force fall [-]."""
    few, *_, many = by_cells
    ratio = np.log(np.array(by_cells[few][name]) / by_cells[many][name]) / np.log(int(few) / int(many))
    return ratio[:2].tolist()


def _error_table(errors: dict[int, dict[str, list[float]]]) -> Table:
    """Return the largest and mean errors of both sums against the rod, by the number of cells."""
    rows = {f"{count}, {name}": values for count, error in errors.items() for name, values in error.items()}
    headings = ("force, max [N]", "force, mean [N]", "torque, max [N mm]", "torque, mean [N mm]")
    columns = {
        heading: lambda values, i=i, factor=factor: factor * values[i]
        for i, (heading, factor) in enumerate(zip(headings, (1.0, 1.0, 1e3, 1e3), strict=True))
    }
    return table("Distance from the exact rod along the profile", rows, columns, "cells, sum")
