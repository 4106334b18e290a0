"""Costs of the runs: the paper's table on this machine, and work against precision for ours and SciPy's solvers."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from functools import partial
from importlib import metadata
from typing import Any

import numpy as np

from planarfriction.plots.style import PAGE, PlotFigure, new_figure, paper, tidy
from planarfriction.plots.symbols import HALO
from planarfriction_studies.experiments import experiment, facts, looks
from planarfriction_studies.experiments.experiment import (
    UNITS,
    Arrays,
    Comparison,
    Result,
    Table,
    Work,
    entry,
)
from planarfriction_studies.experiments.timing import runs
from planarfriction_studies.experiments.timing.runs import (
    BREAKAWAY,
    CIRCLE,
    QUICK_WINDOW,
    ROWS,
    Problem,
)
from planarfriction_studies.experiments.wording import power, report, short

KINDS = ("distributed", "reduced")

DEFAULT = "RODAS4"
"""Solver of the library by default."""

GREYS = ("0.0", "0.35", "0.5", "0.65")
"""Colours of the other solvers."""

AGREEMENT = {"reduced": (1e-6, 1e-5), "distributed": (1e-8, 1e-7)}
"""Allowed difference of a general solver at its tightest tolerance from our reference: position [m], angle [rad].

The whole reduced run amplifies errors at every breakaway; the distributed window has one.
"""

CONVERGED = {"reduced": "in_hand/Circle/r1", "distributed": "in_hand/Circle/d1"}
"""Converged solutions of the same runs."""

CONVERGED_ALLOWANCE = {"x": 1e-7, "y": 1e-7, "theta": 1e-6}
"""Accuracy of our reference and of the start of the window [m, m, rad]."""

PUBLISHED_STEP_RATIO = 80
"""Ratio of the costs of one step, distributed over reduced, according to the paper."""

LEVELS = {"reduced": 1e-6, "distributed": 1e-8}
"""Position errors [m] at which times are compared."""

TIMES = ("time", "first quartile", "third quartile")
"""Median and quartiles of the time in the entries of `Points`."""

Points = dict[str, list[dict[str, float]]]
"""Solver -> its runs: tolerance, error [m], median and quartiles of the time [s], evaluations, repeats."""


def run(work: Work) -> Result:
    """Carry out the experiment."""
    repeats = 1 if work.quick else runs.MOST_REPEATS
    times = {
        row: {
            kind: work.piece(
                f"timing, {row}, {kind}, whole run",
                partial(runs.whole_runs, scene, repeats),
            )
            for kind, scene in scenes.items()
        }
        for row, scenes in ROWS.items()
    }
    baselines = _baselines(work)
    problems = runs.problems(work)
    references = {problem: runs.reference(problem, work) for problem in problems}
    solved = {problem: runs.work_precision(problem, work) for problem in problems}
    points = {
        problem: _points(solved[problem], references[problem]) for problem in problems
    }
    agreements = [c for p in problems for c in _agreements(p, solved[p], references[p])]
    rows = {row: _row_numbers(times[row], baselines.get(row, {})) for row in ROWS}
    cost = {
        kind: each["solver"] / each["trials"] for kind, each in times[CIRCLE].items()
    }
    numbers = {
        "machine": _machine(),
        "table": rows,
        "work_precision": {problem.name: points[problem] for problem in problems},
        "step_ratio": _ratio(*(cost[kind] for kind in KINDS)),
    }
    return report(
        "timing",
        {"timing_work_precision": _figure(points)},
        numbers,
        {
            "rebuilding": _ratio(
                *(times[row]["reduced"]["time"] for row in ("k = 2 f_N", "k = 2"))
            ),
            "published": facts.published_table("timing"),
            "circle": CIRCLE,
            "published_step": PUBLISHED_STEP_RATIO,
            "quick": work.quick,
            "precision": [
                _precision(problem, each) for problem, each in points.items()
            ],
            "agreed": max(each.difference for each in agreements if each.unit == "m"),
        },
        comparisons=agreements
        + [c for p in problems for c in _against_converged(p, references[p])],
        tables=[
            _published_table(rows),
            *(_points_table(problem, points[problem]) for problem in problems),
        ],
        data={
            f"work_precision_{problem.kind}": _dataset(points[problem])
            for problem in problems
        },
    )


def _machine() -> dict[str, Any]:
    """Return the properties of the machine that the times depend on."""
    return {
        "platform": platform.platform(),
        "machine": platform.machine(),
        "cpus": os.cpu_count() or 0,
        "load average": os.getloadavg()[0] if hasattr(os, "getloadavg") else -1.0,
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("numpy", "scipy", "numba")},
    }


def _baselines(work: Work) -> dict[str, dict[str, Arrays]]:
    """Time LSODA beside ours, by row and kind; the distributed model over a window unless all is wanted."""
    spans: dict[str, tuple[float, float]]
    spans = {
        "distributed": (0.0, 2.0) if work.full else BREAKAWAY,
        "reduced": (0.0, 2.0),
    }
    spans = dict.fromkeys(KINDS, QUICK_WINDOW) if work.quick else spans

    def beside(row: str, kind: str) -> Arrays:
        label = f"timing, {row}, {kind}, LSODA as published, {spans[kind][0]:g} to {spans[kind][1]:g} s"
        return work.piece(
            label, partial(runs.beside_lsoda, ROWS[row][kind], *spans[kind])
        )

    return {
        row: {kind: beside(row, kind) for kind in KINDS}
        for row in ([CIRCLE] if work.quick else ROWS)
    }


def _points(
    solved: Mapping[tuple[str, float], Arrays], reference: np.ndarray
) -> Points:
    points: Points = {}
    for (solver, tolerance), found in solved.items():
        entry = {
            "tolerance": tolerance,
            "error": runs.position_error(found["poses"], reference),
            **dict(zip(TIMES, found["time"].tolist(), strict=True)),
            **{name: float(found[name]) for name in ("evaluations", "repeats")},
        }
        points.setdefault(solver, []).append(entry)
    return points


def _row_numbers(
    row: Mapping[str, Arrays], baselines: Mapping[str, Arrays]
) -> dict[str, Any]:
    numbers: dict[str, Any] = {
        f"{kind} [s]": _spread(row[kind]["time"]) for kind in KINDS
    }
    numbers["ratio"] = _ratio(row["distributed"]["time"], row["reduced"]["time"])
    numbers |= {
        f"{kind}, LSODA over ours": _ratio(each["lsoda"], each["ours"])
        for kind, each in baselines.items()
    }
    numbers |= {f"{kind}, solver [s]": _spread(row[kind]["solver"]) for kind in KINDS}
    return numbers | {
        f"{kind}, LSODA [s]": _spread(each["lsoda"]) for kind, each in baselines.items()
    }


def _spread(times: np.ndarray) -> dict[str, float]:
    """Return the median and quartiles by name."""
    return dict(zip(("middle", "least", "most"), map(float, times), strict=True))


def _ratio(times: np.ndarray, others: np.ndarray) -> dict[str, float]:
    """Return the ratio of the medians, and the least and the greatest that the quartiles allow."""
    return _spread(times / others[[0, 2, 1]])


def _agreements(
    problem: Problem, solved: Mapping[tuple[str, float], Arrays], reference: np.ndarray
) -> list[Comparison]:
    """Compare the general solvers at their tightest tolerances with our reference."""
    found = []
    for solver, tolerances in problem.tolerances.items():
        if solver in runs.STRUCTURED:
            continue
        tight = min(tolerances)
        poses = solved[solver, tight]["poses"]
        left = f"What a relative tolerance of {power(tight)} leaves in {solver}"
        cause = f"{left}; ours was run at {power(runs.REFERENCE)}."
        position, angle = AGREEMENT[problem.kind]
        for what, difference, tolerance, unit in (
            ("position", runs.position_error(poses, reference), position, "m"),
            ("angle", runs.angle_error(poses, reference), angle, "rad"),
        ):
            words = f"{problem.name}: {what}, RODAS4 beside {solver}"
            found.append(
                Comparison(
                    words, "converged", difference, tolerance, unit, len(poses), cause
                )
            )
    return found


def _against_converged(problem: Problem, reference: np.ndarray) -> list[Comparison]:
    """Compare our reference with the converged solution, at the times they share."""
    solution = facts.converged(CONVERGED[problem.kind])
    times = problem.window.ends
    index = np.abs(solution["time"][:, None] - times).argmin(axis=0)
    shared = np.abs(solution["time"][index] - times) < 1e-9
    cause = (
        "Two solutions of the same equations at tight tolerances, by different methods."
    )
    rows = []
    for i, (name, allowance) in enumerate(CONVERGED_ALLOWANCE.items()):
        values = solution[name]
        words = f"{problem.name}: {name} of the reference"
        tolerance = allowance + facts.CONVERGED_SHARE * float(np.ptp(values))
        rows.append(
            (
                words,
                reference[shared, i],
                values[index[shared]],
                tolerance,
                UNITS[name],
                cause,
            )
        )
    return experiment.compare_all("converged", rows)


def _precision(problem: Problem, points: Points) -> dict[str, Any]:
    """Return the time of each solver to the same error, and the solvers that do not reach it."""
    level = LEVELS[problem.kind]
    times = {
        solver: runs.cheapest(
            [(each["error"], [each[name] for name in TIMES]) for each in entries], level
        )
        for solver, entries in points.items()
    }
    both = [times.get(solver) for solver in ("LSODA", "RODAS4")]
    return {
        "name": problem.name,
        "level": level,
        "lsoda": both[0][0] / both[1][0] if both[0] and both[1] else None,
        "reached": {
            solver: _spread(np.array(each))
            for solver, each in times.items()
            if each is not None
        },
        "missed": [solver for solver, each in times.items() if each is None],
    }


def _figure(points: Mapping[Problem, Points]) -> PlotFigure:
    """Draw wall time over error: the default solver in blue, the others in greys with their markers."""
    with paper():
        figure = new_figure(PAGE, 3.0)
        panels = figure.subplots(1, len(points), squeeze=False)[0]
        for axes, (problem, solvers) in zip(panels, points.items(), strict=True):
            for i, (solver, entries) in enumerate(solvers.items()):
                errors, times, first, third = (
                    np.array([entry[name] for entry in entries])
                    for name in ("error", *TIMES)
                )
                bars = {"yerr": [times - first, third - times], "elinewidth": 1.0}
                default = solver == DEFAULT
                colour = looks.REDUCED if default else GREYS[i % len(GREYS)]
                look = {"color": colour, "markersize": 4, "zorder": 4 if default else 3}
                axes.errorbar(errors, times, fmt="osD^"[i] + "-", **bars, **look)
                last = int(np.argmin(errors))
                axes.annotate(
                    solver,
                    (errors[last], times[last]),
                    (-5, 0),
                    textcoords="offset points",
                    ha="right",
                    va="center",
                    color=colour,
                    fontsize=7,
                    fontweight="bold" if default else None,
                ).set_path_effects(list(HALO))
            axes.set(xscale="log", yscale="log", xlabel="largest position error [m]")
            axes.set_title(problem.name, loc="left")
            axes.margins(x=0.36)
            tidy(axes)
        panels[0].set_ylabel("wall time [s]")
    return figure


def _published_table(rows: Mapping[str, Mapping[str, Any]]) -> Table:
    def ours(row: Any, name: str) -> str:
        return _shown(row[0][name]) if name in row[0] else "not run"

    columns: dict[str, Any] = {
        f"{kind} [s]": partial(ours, name=f"{kind} [s]") for kind in KINDS
    }
    columns |= {"factor": partial(ours, name="ratio")}
    columns |= {f"{kind}, published [s]": entry(1, f"{kind} [s]") for kind in KINDS}
    columns |= {"factor, published": entry(1, "ratio")}
    columns |= {
        f"{kind}, LSODA here over ours": partial(ours, name=f"{kind}, LSODA over ours")
        for kind in KINDS
    }
    note = (
        "Ours: all of `simulate`, default tolerances. LSODA: time in the solver, without tables, over the whole run "
        f"or, where that takes minutes, {BREAKAWAY[0]:g} to {BREAKAWAY[1]:g} s, where the plate breaks away (a quick "
        f"run: {QUICK_WINDOW[0]:g} to {QUICK_WINDOW[1]:g} s). $k = 2$: one table, $r$ follows the load; $k = 2 f_N$: "
        "all is rebuilt every 0.01 s."
    )
    published = facts.published_table("timing")
    return experiment.table(
        "In-hand run of 2 s",
        {row: (rows[row], published[row]) for row in published},
        columns,
        "contact",
        note,
    )


def _points_table(problem: Problem, points: Points) -> Table:
    rows = {
        f"{solver}, {entry['tolerance']:.0e}": entry
        for solver, entries in points.items()
        for entry in entries
    }
    columns = {
        "position error [m]": lambda entry: f"{entry['error']:.1e}",
        "time [ms]": lambda entry: _shown(
            _spread(np.array([1e3 * entry[name] for name in TIMES]))
        ),
        "evaluations": lambda entry: int(entry["evaluations"]),
        "runs": lambda entry: int(entry["repeats"]),
    }
    note = f"{problem.window.states} states. Absolute tolerance: {runs.ATOL_PER_RTOL:g} times the relative one."
    return experiment.table(
        f"Work against precision, {problem.name}",
        rows,
        columns,
        "solver, relative tolerance",
        note,
    )


def _shown(times: Mapping[str, float]) -> str:
    """Write the median, and in brackets the quartiles where they differ."""
    middle, least, most = (short(times[name]) for name in ("middle", "least", "most"))
    return middle if least == most else f"{middle} ({least} to {most})"


def _dataset(points: Points) -> Any:
    """Return the error and time over the runs, one after the other."""
    import xarray as xr

    entries = [(solver, entry) for solver, found in points.items() for entry in found]
    units = {"tolerance": "1", "error": "m", "time": "s", "evaluations": "1"}
    variables = {
        name: ("run", np.array([entry[name] for _, entry in entries]), {"units": unit})
        for name, unit in units.items()
    }
    return xr.Dataset(
        variables, coords={"solver": ("run", [solver for solver, _ in entries])}
    )
