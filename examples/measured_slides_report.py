"""What measured_slides.py shows: the tables, the errors of each toss as CSV, and a few tosses drawn.

Tosses have number, unique_id, time `[T]`, pose `[T, 3]` and twist `[3]`; results have mu and errors `[tosses, 4]`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

REFERENCE = "distributed square"
MEASURES = ("final_mm", "final_deg", "path_mm", "path_deg")
HEADINGS = ("at the end\nposition [mm]", "\nyaw [deg]", "along the way\nposition [mm]", "\nyaw [deg]")
SAMPLES = 2000

STYLES = {
    "uncoupled Coulomb": ("#D55E00", (0, (5, 1.5))),
    "distributed square": ("#0072B2", "-"),
    "four corners": ("#CC79A7", (0, (5, 1.5, 1, 1.5))),
    "reduced, ellipsoid": ("#009E73", (0, (1, 1.2))),
}
"""Colour and line of each model that is drawn; the reduced one with the table lies on the distributed square."""


def show(test: Sequence[Any], results: Mapping[str, Any], seed: int) -> None:
    """Print the errors on the test half, and how sure the differences are."""
    rows = []
    for name, result in results.items():
        both = zip(rms(result.errors, axis=0), np.median(result.errors, axis=0), strict=True)
        rows.append((name, f"{result.mu:.4f}", *(f"{a:.2f} / {b:.2f}" for a, b in both)))
    print_table(f"Errors on the {len(test)} test tosses: RMS / median", ["model", "mu", *HEADINGS], rows)
    if REFERENCE not in results:
        return
    spread, rows = bootstrap(test, results, seed), []
    for name in [name for name in results if name != REFERENCE]:
        ends = np.percentile(spread[name] - spread[REFERENCE], [2.5, 97.5], axis=0)
        rows.append((name, *(f"{a:+.2f} .. {b:+.2f}" for a, b in zip(*ends, strict=True))))
    title = f"RMS minus that of the {REFERENCE}, 95 % interval (bootstrap over unique_id)"
    print_table(title, ["model", *HEADINGS], rows)


def print_table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout."""
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "model" else "right")
    for row in rows:
        table.add_row(*row)
    console = Console(highlight=False, markup=False)  # [mm] is no markup
    if not console.is_terminal:
        console.width = 120  # a pipe has no width of its own
    console.print(table)


def bootstrap(test: Sequence[Any], results: Mapping[str, Any], seed: int) -> dict[str, np.ndarray]:
    """RMS of each measure in SAMPLES drawings of the test ids with replacement, the same for all: `[SAMPLES, 4]`."""
    ids = np.array([toss.unique_id for toss in test])
    names = np.unique(ids)
    drawn = np.random.default_rng(seed).multinomial(len(names), np.full(len(names), 1 / len(names)), size=SAMPLES)
    counts = drawn[:, np.searchsorted(names, ids)]
    counts = counts / counts.sum(axis=1, keepdims=True)
    return {name: np.sqrt(counts @ result.errors**2) for name, result in results.items()}


def rms(values: np.ndarray, axis: int | None = None) -> np.ndarray:
    """Root mean square."""
    return np.sqrt(np.mean(np.square(values), axis=axis))


def write_errors(path: Path, test: Sequence[Any], results: Mapping[str, Any]) -> None:
    """One line for each model and test toss."""
    keys = {"toss": [toss.number for toss in test], "unique_id": [toss.unique_id for toss in test]}
    parts = [
        pd.DataFrame({"model": name, "mu": result.mu, **keys, **dict(zip(MEASURES, result.errors.T, strict=True))})
        for name, result in results.items()
    ]
    pd.concat(parts).to_csv(path, index=False)


def draw(tosses: Sequence[Any], predictions: Mapping[str, Callable], outline: np.ndarray, count: int = 3) -> Figure:
    """Draw `count` tosses, from little initial spin to much: the way of the cube above, its yaw over time below.

    `predictions` give poses `[T, 3]` for a toss; `outline` is the cube's, `[M, 2]` [m].
    """
    by_spin = sorted(tosses, key=lambda toss: abs(toss.twist[2]))
    chosen = [by_spin[i] for i in np.unique(np.linspace(len(by_spin) // 2, len(by_spin) - 1, count).astype(int))]
    figure = Figure(figsize=(3.1 * len(chosen) + 0.4, 6.4), dpi=100, layout="constrained")
    rows = figure.subplots(2, len(chosen), squeeze=False, height_ratios=(1.35, 1.0))
    for toss, top, bottom in zip(chosen, *rows, strict=True):
        spin = np.degrees(toss.twist[2])
        top.set_title(f"toss {toss.number}: {np.hypot(*toss.twist[:2]):.2f} m/s, {spin:.0f} deg/s", fontsize="medium")
        _draw_cube(top, toss, toss.pose[0], outline, color="0.75", linewidth=1.0)
        _draw_cube(top, toss, toss.pose[-1], outline, color="0.2", linewidth=2.2)
        top.plot(*_shift(toss, toss.pose), color="0.2", linewidth=2.2)
        bottom.plot(toss.time, _turn(toss, toss.pose), color="0.2", linewidth=2.2, label="measured")
        for name, (colour, line) in STYLES.items():
            if name in predictions:
                pose = predictions[name](toss)
                _draw_cube(top, toss, pose[-1], outline, color=colour, linestyle=line, linewidth=1.2)
                top.plot(*_shift(toss, pose), color=colour, linestyle=line, linewidth=1.2)
                bottom.plot(toss.time, _turn(toss, pose), color=colour, linestyle=line, linewidth=1.5, label=name)
        top.set(aspect="equal", xlabel="x from the start [mm]")
        top.set_adjustable("datalim")
        bottom.set(xlabel="time [s]")
        for axes in (top, bottom):
            axes.grid(True, color="0.9", linewidth=0.6)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
    rows[0, 0].set_ylabel("y from the start [mm]")
    rows[1, 0].set_ylabel("turned [deg]")
    figure.legend(*rows[1, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
    return figure


def _shift(toss: Any, pose: np.ndarray) -> np.ndarray:
    """x and y of `pose` `[..., 3]` from the start [mm], first axis x and y."""
    return 1e3 * np.moveaxis(pose[..., :2] - toss.pose[0, :2], -1, 0)


def _turn(toss: Any, pose: np.ndarray) -> np.ndarray:
    """Yaw since the start [deg]."""
    return np.degrees(pose[:, 2] - toss.pose[0, 2])


def _draw_cube(axes: Any, toss: Any, pose: np.ndarray, outline: np.ndarray, **look: Any) -> None:
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    corners = np.concatenate([outline, outline[:1]]) @ np.array([[cos, sin], [-sin, cos]])
    axes.plot(*(_shift(toss, pose)[:, None] + 1e3 * corners.T), **look)
