"""What measured_pushes.py shows: the tables, the error of each push as CSV, and a picture.

Layouts have name, surface, feet, corners and twists `[M, 3]`; errors are angles `[M]` [deg] by method; fits have
tested, errors `[splits, pushes]` and values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

SAMPLES = 2000
THEIRS = {"poly4_convex": "quartic", "gp": "Gaussian process", "quadratic_ellipsoid": "ellipsoid"}
STYLES = {"patch": ("#0072B2", "o"), "quartic": ("#D55E00", "s"), "ellipsoid": ("#009E73", "^")}
LENGTH = 0.05


def print_table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout."""
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    for column, heading in enumerate(headings):
        table.add_column(heading, justify="right" if column else "left")
    for row in rows:
        table.add_row(*row)
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = 120  # a pipe has no width of its own
    console.print(table)


def boards(layouts: Sequence[Any]) -> dict[str, list[str]]:
    """Names of the layouts with feet on each board."""
    found: dict[str, list[str]] = {}
    for layout in layouts:
        if layout.feet is not None:
            found.setdefault(layout.surface, []).append(layout.name)
    return found


def drawings(errors: Sequence[np.ndarray], seed: int) -> np.ndarray:
    """Mean over layouts of the mean angle, in SAMPLES drawings of the pushes of each with replacement, `[SAMPLES]`."""
    random, total = np.random.default_rng(seed), np.zeros(SAMPLES)
    for values in errors:
        total += values[random.integers(len(values), size=(SAMPLES, len(values)))].mean(axis=1)
    return total / len(errors)


def published_mean(published: pd.DataFrame, names: Sequence[str], method: str, splits: int = 15) -> float:
    """The authors' mean over layouts in their run of that many splits; NaN where one is missing."""
    rows = published[(published.method == method) & (published.n_splits == splits)].set_index("config")
    return float(rows["mean_deg"].reindex(list(names)).mean(skipna=False))


def number(value: float) -> str:
    """One decimal; a dash where there is none."""
    return "-" if np.isnan(value) else f"{value:.1f}"


def show_predictions(layouts: Sequence[Any], errors: Mapping, published: pd.DataFrame, seed: int) -> None:
    """Print mean angles without any fit beside the authors' after a fit, then means over the layouts of a board."""
    kinds, rows = list(errors[layouts[0].name]), []
    for layout in layouts:
        ours = [f"{e.mean():.1f} ± {e.std(ddof=1) / np.sqrt(len(e)):.1f}" for e in errors[layout.name].values()]
        median = f"{np.median(errors[layout.name]['patch']):.1f}"
        rows.append(
            (layout.name, *ours, median, *(number(published_mean(published, [layout.name], m)) for m in THEIRS))
        )
    headings = ["layout", *(kind if kind == "patch" else f"{kind} of it" for kind in kinds), "patch, median"]
    headings += [f"theirs:\n{name}" for name in THEIRS.values()]
    print_table("Angle to the measured twist [deg]: mean ± standard error, nothing fitted", headings, rows)
    rows = []
    for board, names in boards(layouts).items():
        ours = [[errors[name][kind] for name in names] for kind in kinds]
        ends = [np.percentile(drawings(each, seed), [2.5, 97.5]) for each in ours]
        cells = [
            f"{np.mean([e.mean() for e in each]):.1f}\n{a:.1f} .. {b:.1f}"
            for each, (a, b) in zip(ours, ends, strict=True)
        ]
        rows.append((board, *cells, *(number(published_mean(published, names, m)) for m in THEIRS)))
        again = [number(published_mean(published, names, m, 16)) for m in THEIRS]
        if set(again) != {"-"}:
            rows.append((f"{board}, their second run", *[""] * len(ours), *again))
    headings = ["feet on", *kinds, *(f"theirs:\n{name}" for name in THEIRS.values())]
    print_table("Mean over the layouts with feet [deg], 95 % interval below (bootstrap over pushes)", headings, rows)


def show_fits(layouts: Sequence[Any], fits: Mapping, seed: int) -> None:
    """Print mean angles on held-out pushes, and differences from no fit with their intervals."""
    if not layouts:
        return
    names = list(dict.fromkeys(name for layout in layouts for name in fits[layout.name]))
    rows = []
    for layout in layouts:
        means = {name: done.errors.mean(axis=1) for name, done in fits[layout.name].items()}
        cells = [f"{means[name].mean():.1f} ± {means[name].std():.1f}" if name in means else "-" for name in names]
        rows.append((layout.name, *cells))
    for board, group in boards(layouts).items():
        rows.append((f"mean, {board}", *(f"{np.mean([fits[n][k].errors.mean() for n in group]):.1f}" for k in names)))
    print_table("Held-out pushes [deg]: mean ± spread over splits, by what was fitted", ["layout", *names], rows)
    rows = []
    for board, group in boards(layouts).items():
        cells = []
        for name in names[1:]:
            apart = [by_push(fits[n][name]) - by_push(fits[n]["nothing"]) for n in group]
            low, high = np.percentile(drawings([each[np.isfinite(each)] for each in apart], seed), [2.5, 97.5])
            cells.append(f"{low:+.1f} .. {high:+.1f}")
        rows.append((board, *cells))
    if rows:
        title = "Minus no fit on the same pushes [deg], 95 % interval (bootstrap over pushes)"
        print_table(title, ["feet on", *names[1:]], rows)
    for layout in layouts:
        values = [
            f"{k}: {centre(done.values)}" for k, done in fits[layout.name].items() if 0 < done.values.shape[1] < 15
        ]
        if values:
            print(f"{layout.name}, median parameters: {'; '.join(values)}")


def centre(values: np.ndarray) -> str:
    """Medians of the columns, as words."""
    return ", ".join(f"{value:.2f}" if abs(value) >= 0.1 else f"{value:.3f}" for value in np.median(values, axis=0))


def by_push(done: Any) -> np.ndarray:
    """Mean error of each push over the splits that held it out; NaN where none did."""
    count = int(done.tested.max()) + 1
    times = np.bincount(done.tested.ravel(), minlength=count)
    total = np.bincount(done.tested.ravel(), weights=done.errors.ravel(), minlength=count)
    return np.where(times > 0, total / np.maximum(times, 1), np.nan)


def write_errors(path: Path, layouts: Sequence[Any], errors: Mapping) -> None:
    """One line for each layout and push."""
    parts = [
        pd.DataFrame({"config": layout.name, "push": range(len(layout.twists))} | dict(errors[layout.name]))
        for layout in layouts
    ]
    pd.concat(parts).to_csv(path, index=False, float_format="%.4f")


def draw(layouts: Sequence[Any], errors: Mapping, published: pd.DataFrame, predicted: np.ndarray, seed: int) -> Figure:
    """Mean angles of all layouts beside the authors'; measured and `predicted` centres of rotation of one layout."""
    figure = Figure(figsize=(10.0, 4.6), dpi=100, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    rows = -np.arange(len(layouts))
    kinds = list(errors[layouts[0].name])
    for shift, name in zip(np.linspace(0.2, -0.2, len(kinds)), kinds, strict=True):
        colour, marker = STYLES[name]
        each = [errors[layout.name][name] for layout in layouts]
        ends = np.array([np.percentile(drawings([e], seed), [2.5, 97.5]) for e in each]).T
        mean = np.array([e.mean() for e in each])
        label = "patch, nothing fitted" if name == "patch" else f"{name} of the patch"
        look = {"color": colour, "marker": marker, "markersize": 5, "linestyle": "none"}
        left.errorbar(mean, rows + shift, xerr=np.abs(ends - mean), **look, elinewidth=1.0, label=label)
    best = [min(published_mean(published, [layout.name], m) for m in THEIRS) for layout in layouts]
    left.plot(best, rows, color="0.2", marker="|", markersize=22, linestyle="none", label="best of the authors' fits")
    left.set_yticks(rows, [layout.name for layout in layouts])
    left.set(xlabel="mean angle to the measured twist [deg]", xlim=(0.0, None))
    left.grid(True, axis="x", color="0.9", linewidth=0.6)
    left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, fontsize="small")
    layout = layouts[min(2, len(layouts) - 1)]
    places = [1e3 * centres(layout.twists), 1e3 * centres(predicted)]
    limit = 1.6e3 * np.abs(layout.corners).max()
    for start, end in zip(*places, strict=True):
        right.plot(*np.stack([start, end], axis=1), color="0.8", linewidth=0.8, zorder=1)
    right.plot(*places[0].T, color="0.2", marker="o", markersize=4, linestyle="none", label="measured")
    right.plot(*places[1].T, color=STYLES["patch"][0], marker="x", markersize=5, linestyle="none", label="predicted")
    feet = 1e3 * layout.corners.T
    right.plot(*feet, color="0.2", marker="o", markersize=13, fillstyle="none", linestyle="none", label="foot")
    right.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    right.set_title(f"Centres of rotation, {layout.name}", fontsize="medium")
    right.legend(loc="upper right", frameon=False, fontsize="small")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def centres(twists: np.ndarray) -> np.ndarray:
    """Centres of rotation `[M, 2]` [m] of unit twists `(vx, vy, rho omega)`; far away where there is no spin."""
    spin = twists[:, 2] / LENGTH
    spin = np.where(np.abs(spin) > 1e-9, spin, 1e-9)
    return np.stack([-twists[:, 1], twists[:, 0]], axis=1) / spin[:, None]
