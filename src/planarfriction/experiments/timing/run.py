"""What the runs cost: the paper's table on this machine, and work against precision for ours and SciPy's solvers."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.experiments import facts
from planarfriction.experiments.experiment import Arrays, Comparison, Picture, Result, Table, Work
from planarfriction.experiments.timing import runs
from planarfriction.experiments.timing.runs import BREAKAWAY, CIRCLE, QUICK_WINDOW, ROWS, Problem

if TYPE_CHECKING:
    import xarray as xr

KINDS = ("distributed", "reduced")

AGREEMENT = {"reduced": (1e-6, 1e-5), "distributed": (1e-8, 1e-7)}
"""Allowed difference of a general solver at its tightest tolerance from our reference: position [m], angle [rad].

The whole reduced run amplifies errors at every breakaway; the distributed window has one.
"""

CONVERGED = {"reduced": "in_hand/Circle/r1", "distributed": "in_hand/Circle/d1"}
"""Converged solutions of the same runs."""

CONVERGED_ALLOWANCE = {"x": 1e-7, "y": 1e-7, "theta": 1e-6}
"""Accuracy of our reference and of the start of the window [m, m, rad]."""

PUBLISHED_STEP_RATIO = 80.0
"""How many times cheaper one step of the reduced model is, according to the paper."""

LEVELS = {"reduced": 1e-6, "distributed": 1e-8}
"""Position errors [m] at which times are compared."""

Points = dict[str, list[dict[str, float]]]
"""Solver -> its runs: tolerance, error [m], time [s], evaluations, repeats."""


def run(work: Work) -> Result:
    """Carry out the experiment."""
    table = {row: {kind: runs.whole_runs(row, kind, work) for kind in KINDS} for row in ROWS}
    baselines = _baselines(work)
    problems = runs.problems(work)
    references = {problem: runs.reference(problem, work) for problem in problems}
    solved = {problem: runs.work_precision(problem, work) for problem in problems}
    points = {problem: _points(solved[problem], references[problem]) for problem in problems}
    comparisons = [c for p in problems for c in _agreements(p, solved[p], references[p])]
    comparisons += [c for p in problems for c in _against_converged(p, references[p])]
    machine = _machine()
    return Result(
        findings=_findings(table, baselines, points, comparisons, machine),
        pictures=[_picture(points)],
        comparisons=comparisons,
        numbers={
            "machine": machine,
            "table": {row: _row_numbers(table[row], baselines.get(row, {})) for row in ROWS},
            "work_precision": {problem.name: points[problem] for problem in problems},
            "step_ratio": _step_ratio(table),
        },
        tables=[_published_table(table, baselines), *(_points_table(problem, points[problem]) for problem in problems)],
        data={f"work_precision_{problem.kind}": _dataset(points[problem]) for problem in problems},
    )


def _machine() -> dict[str, Any]:
    """What the times depend on."""
    versions = {name: metadata.version(name) for name in ("numpy", "scipy", "numba")}
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else -1.0
    return {
        "platform": platform.platform(),
        "machine": platform.machine(),
        "cpus": os.cpu_count() or 0,
        "load average": load,
        "python": platform.python_version(),
        **versions,
    }


def _baselines(work: Work) -> dict[str, dict[str, Arrays]]:
    """Row -> kind -> LSODA beside ours; the distributed model over a window unless all is wanted."""
    if work.quick:
        return {CIRCLE: {kind: runs.beside_lsoda(CIRCLE, kind, *QUICK_WINDOW, work) for kind in KINDS}}
    spans = {"distributed": (0.0, 2.0) if work.full else BREAKAWAY, "reduced": (0.0, 2.0)}
    return {row: {kind: runs.beside_lsoda(row, kind, *spans[kind], work) for kind in KINDS} for row in ROWS}


def _points(solved: Mapping[tuple[str, float], Arrays], reference: np.ndarray) -> Points:
    points: Points = {}
    for (solver, tolerance), found in solved.items():
        entry = {
            "tolerance": tolerance,
            "error": runs.position_error(found["poses"], reference),
            **{name: float(found[name]) for name in ("time", "evaluations", "repeats")},
        }
        points.setdefault(solver, []).append(entry)
    return points


def _row_numbers(row: Mapping[str, Arrays], baselines: Mapping[str, Arrays]) -> dict[str, Any]:
    numbers: dict[str, Any] = {f"{kind} [s]": float(row[kind]["time"]) for kind in KINDS}
    numbers["ratio"] = numbers["distributed [s]"] / numbers["reduced [s]"]
    numbers |= {f"{kind}, LSODA over ours": float(b["lsoda"] / b["ours"]) for kind, b in baselines.items()}
    numbers |= {f"{kind}, solver [s]": float(row[kind]["solver"]) for kind in KINDS}
    return numbers | {f"{kind}, LSODA [s]": float(b["lsoda"]) for kind, b in baselines.items()}


def _step_ratio(table: Mapping[str, Mapping[str, Arrays]]) -> float:
    """Cost of one step of the distributed model over one of the reduced model."""
    cost = {kind: float(run["solver"] / run["trials"]) for kind, run in table[CIRCLE].items()}
    return cost["distributed"] / cost["reduced"]


# ---------------------------------------------------------------------- comparisons


def _agreements(
    problem: Problem, solved: Mapping[tuple[str, float], Arrays], reference: np.ndarray
) -> list[Comparison]:
    """General solvers at their tightest tolerances beside our reference."""
    found = []
    for solver, tolerances in problem.tolerances.items():
        if solver in runs.STRUCTURED:
            continue
        tight = min(tolerances)
        poses = solved[solver, tight]["poses"]
        cause = f"What a relative tolerance of {tight:.0e} leaves in {solver}; ours was run at {runs.REFERENCE:.0e}."
        differences = (runs.position_error(poses, reference), "m"), (runs.angle_error(poses, reference), "rad")
        for (difference, unit), tolerance in zip(differences, AGREEMENT[problem.kind], strict=True):
            what = f"{problem.name}: {'position' if unit == 'm' else 'angle'}, RODAS4 beside {solver}"
            found.append(Comparison(what, "converged", difference, tolerance, unit, len(poses), cause))
    return found


def _against_converged(problem: Problem, reference: np.ndarray) -> list[Comparison]:
    """Our reference beside the converged solution, at the times they share."""
    solution = facts.converged(CONVERGED[problem.kind])
    times = problem.window.ends
    index = np.abs(solution["time"][:, None] - times).argmin(axis=0)
    shared = np.abs(solution["time"][index] - times) < 1e-9
    found = []
    for i, (name, allowance) in enumerate(CONVERGED_ALLOWANCE.items()):
        values = solution[name]
        difference = float(np.abs(reference[shared, i] - values[index[shared]]).max())
        tolerance = allowance + facts.CONVERGED_SHARE * float(np.ptp(values))
        cause = "Two solutions of the same equations at tight tolerances, by different methods."
        words = f"{problem.name}: {name} of the reference"
        unit = "rad" if name == "theta" else "m"
        found.append(Comparison(words, "converged", difference, tolerance, unit, int(shared.sum()), cause))
    return found


# ---------------------------------------------------------------------- words, figure, tables


def _findings(
    table: Mapping[str, Mapping[str, Arrays]],
    baselines: Mapping[str, Mapping[str, Arrays]],
    points: Mapping[Problem, Points],
    comparisons: Sequence[Comparison],
    machine: Mapping[str, Any],
) -> list[str]:
    published = facts.published_table("timing")[CIRCLE]
    ours = {kind: float(table[CIRCLE][kind]["time"]) for kind in KINDS}
    ratios = {kind: float(b["lsoda"] / b["ours"]) for kind, b in baselines[CIRCLE].items()}
    rebuilt, kept = (float(table[row]["reduced"]["time"]) for row in ("k = 2 f_N", "k = 2"))
    solver = {row: 1e3 * float(kinds["reduced"]["solver"]) for row, kinds in table.items()}
    agreed = max(c.difference for c in comparisons if c.unit == "m" and "beside" in c.quantity)
    found = [
        f"The in-hand run of 2 s takes {ours['distributed'] * 1e3:.3g} ms with the distributed and "
        f"{ours['reduced'] * 1e3:.3g} ms with the reduced model (disc, default tolerances, all of `simulate`, without "
        f"compile time); published are {published['distributed [s]']:g} s and {published['reduced [s]']:g} s on the "
        f"authors' machine, a factor of {published['ratio']:g} between the models where it is "
        f"{ours['distributed'] / ours['reduced']:.2g} here. Machine: {machine['cpus']} CPUs, {machine['machine']}, "
        f"load average {machine['load average']:.1f} at the end.",
        "LSODA as published (compiled right-hand side, restarted at every jump of the load) takes "
        f"{ratios['distributed']:.3g} times longer than ours for the distributed model and {ratios['reduced']:.3g} "
        "times longer for the reduced one, over the spans named in the table. It makes its Jacobian from one "
        "evaluation for each state and solves a dense system; ours eliminates the bristles at the cost of an "
        f"evaluation. One of our steps is {_step_ratio(table):.2g} times cheaper with the reduced model than with the "
        f"distributed one (published: about {PUBLISHED_STEP_RATIO:g}).",
        f"A table rebuilt at every load costs the reduced model {rebuilt / kept:.2g} times the run with one table "
        f"(k = 2 f_N beside k = 2); published are {_published_rebuild_ratio():.2g} times. "
        f"The solver has {solver['k = 2']:.2g} and {solver['k = 2 f_N']:.2g} ms of the two; the rest makes the "
        "contact's shape for each load.",
    ]
    found += [_precision_finding(problem, points[problem]) for problem in points]
    found.append(
        f"All solvers find the same motion: SciPy's at their tightest tolerances differ from our reference by at most "
        f"{agreed:.1e} m."
    )
    return found


def _published_rebuild_ratio() -> float:
    published = facts.published_table("timing")
    return published["k = 2 f_N"]["reduced [s]"] / published["k = 2"]["reduced [s]"]


def _precision_finding(problem: Problem, points: Points) -> str:
    level = LEVELS[problem.kind]
    times = {
        solver: runs.cheapest([(entry["error"], entry["time"]) for entry in entries], level)
        for solver, entries in points.items()
    }
    reached = {solver: seconds for solver, seconds in times.items() if seconds is not None}
    missed = [solver for solver, seconds in times.items() if seconds is None]
    listed = ", ".join(f"{solver} {seconds * 1e3:.3g} ms" for solver, seconds in reached.items())
    words = f"Work against precision, {problem.name}: to a position error of {level:.0e} m or less, {listed or 'none'}"
    return words + (f"; not reached by {', '.join(missed)} at the tolerances tried." if missed else ".")


def _picture(points: Mapping[Problem, Points]) -> Picture:
    from planarfriction.plots.style import PALETTE, new_figure, tidy

    figure = new_figure(9.6, 4.2)
    panels = figure.subplots(1, len(points), squeeze=False)[0]
    for axes, (problem, solvers) in zip(panels, points.items(), strict=True):
        for i, (solver, entries) in enumerate(solvers.items()):
            errors, times = ([entry[name] for entry in entries] for name in ("error", "time"))
            axes.loglog(errors, times, "osD^"[i] + "-", color=PALETTE[i], markersize=5, linewidth=1.3, label=solver)
        axes.set(xlabel="largest position error [m]", ylabel="wall time [s]")
        axes.set_title(problem.name, fontsize="medium")
        tidy(axes)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    caption = (
        "Work against precision: wall time over the error of the centre of mass, in-hand run, disc, load 1. "
        "Each marker is a tolerance."
    )
    return Picture("timing_work_precision", caption, figure)


def _published_table(table: Mapping[str, Mapping[str, Arrays]], baselines: Mapping[str, Mapping[str, Arrays]]) -> Table:
    headings = ["contact", *(f"{kind} [s]" for kind in KINDS), "factor"]
    headings += [*(f"{kind}, published [s]" for kind in KINDS), "factor, published"]
    headings += [f"{kind}, LSODA here over ours" for kind in KINDS]
    rows = []
    for row, published in facts.published_table("timing").items():
        numbers = _row_numbers(table[row], baselines.get(row, {}))
        ratios = [numbers.get(f"{kind}, LSODA over ours") for kind in KINDS]
        rows.append(
            [
                row,
                *(_short(numbers[f"{kind} [s]"]) for kind in KINDS),
                _short(numbers["ratio"]),
                *(published[f"{kind} [s]"] for kind in KINDS),
                published["ratio"],
                *("not run" if ratio is None else _short(ratio) for ratio in ratios),
            ]
        )
    note = (
        "Ours: all of `simulate`, default tolerances, median. LSODA over ours: time in the solver over the same span, "
        f"the whole run or, where that takes minutes, {BREAKAWAY[0]:g} to {BREAKAWAY[1]:g} s (the plate breaks away; a "
        f"quick look takes {QUICK_WINDOW[0]:g} to {QUICK_WINDOW[1]:g} s), without the tables. k = 2: the table is kept "
        "and r follows the load; k = 2 f_N: all is rebuilt every 0.01 s."
    )
    return Table("In-hand run of 2 s", headings, rows, note)


def _points_table(problem: Problem, points: Points) -> Table:
    rows = [
        [
            solver,
            f"{entry['tolerance']:.0e}",
            f"{entry['error']:.1e}",
            _short(entry["time"] * 1e3),
            int(entry["evaluations"]),
            int(entry["repeats"]),
        ]
        for solver, entries in points.items()
        for entry in entries
    ]
    headings = ["solver", "relative tolerance", "position error [m]", "time [ms]", "evaluations", "runs"]
    note = (
        f"{problem.window.states} states. Absolute tolerance: {runs.ATOL_PER_RTOL:g} times the relative one, as a "
        "share of the natural scales. Median of the runs; what takes over a second runs once."
    )
    return Table(f"Work against precision, {problem.name}", headings, rows, note)


def _short(value: float) -> float:
    """To three digits."""
    return float(f"{value:.3g}")


def _dataset(points: Points) -> xr.Dataset:
    """Error and time over the runs, one after the other."""
    import xarray as xr

    entries = [(solver, entry) for solver, found in points.items() for entry in found]
    units = {"tolerance": "1", "error": "m", "time": "s", "evaluations": "1"}
    variables = {
        name: ("run", np.array([entry[name] for _, entry in entries]), {"units": unit}) for name, unit in units.items()
    }
    return xr.Dataset(variables, coords={"solver": ("run", [solver for solver, _ in entries])})
