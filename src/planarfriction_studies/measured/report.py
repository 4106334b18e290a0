"""Report of a comparison: tables for people, and everything as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction_studies.measured.benchmark import Benchmark, Score, rows_of
from planarfriction_studies.measured.pushes import published
from planarfriction_studies.measured.scores import drawings, interval
from planarfriction_studies.measured.tasks import TASKS

REFERENCE = "exact surface"
"""Model that the others are compared with, on the same cases."""


def table(benchmark: Benchmark, task: str) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows: one model a row, each measure with its 95 % interval."""
    measures, results = TASKS[task].measures, benchmark.results[task]
    headings = ["model", *(measure.heading for measure in measures)]
    rows = []
    for name, result in results.items():
        scores = [result.scores.get(measure.key) for measure in measures]
        rows.append([name, *("" if score is None else _cell(score) for score in scores)])
    return headings, rows


def _cell(score: Score) -> str:
    return f"{score.value:.2f}\n({score.low:.2f} to {score.high:.2f})"


def differences(benchmark: Benchmark, task: str, reference: str) -> dict[str, dict[str, tuple[float, float, float]]]:
    """Return by model and measure its value minus that of `reference`, with the ends of the 95 % interval of that.

    The same drawings for both: what all models find hard does not blur their difference.
    """
    known, test, results = TASKS[task], benchmark.test(task), benchmark.results[task]
    found: dict[str, dict[str, tuple[float, float, float]]] = {}
    for measure in known.measures:
        base, groups = rows_of(known, measure, test, results[reference].errors)
        if not len(base):
            continue
        drawn = drawings(groups, benchmark.seed)
        of_base, base_drawn = measure.total(base), measure.total(base, drawn)
        for name, result in results.items():
            if name != reference:
                values, _ = rows_of(known, measure, test, result.errors)
                ends = interval(measure.total(values, drawn) - base_drawn)
                found.setdefault(name, {})[measure.key] = (float(measure.total(values) - of_base), *ends)
    return found


def to_dict(benchmark: Benchmark) -> dict[str, Any]:
    """Return everything as plain data: scores, fitted numbers, the errors of every test case."""
    tasks = {}
    for name, results in benchmark.results.items():
        cases = benchmark.test(name)
        models = {}
        for called, result in results.items():
            scores = {
                key: {"value": score.value, "interval_95": [score.low, score.high], "cases": score.cases}
                for key, score in result.scores.items()
            }
            errors = {case.name: np.round(rows, 4).tolist() for case, rows in zip(cases, result.errors, strict=True)}
            models[called] = {
                "scores": scores,
                "fitted": dict(result.fitted),
                "checked": dict(result.checked),
                "seconds": round(result.seconds, 2),
                "errors": errors,
            }
        tasks[name] = {"title": TASKS[name].title, "cases": len(cases), "models": models}
        if name == "pushes":
            tasks[name]["published"] = published(benchmark.folder)
        if REFERENCE in results:
            apart = differences(benchmark, name, REFERENCE)
            tasks[name]["minus"] = {"reference": REFERENCE, "models": apart}
    return {"tasks": tasks, "left_out": list(benchmark.left_out), "seed": benchmark.seed}
