"""Reduced models in the in-hand runs: how far the end is from the distributed model's, and what friction does there."""

from __future__ import annotations

from typing import Any

from planarfriction.scenes import simulate
from planarfriction.scenes.ready import FINE
from planarfriction_studies.experiments.beyond.ladder import AUTO, CASES, Row
from planarfriction_studies.experiments.in_hand.runs import FRICTION_CHANGE, Case, columns, end_distance, with_friction

ENDS = {
    "published": "published reduced",
    "reduced": "ReducedModel",
    "4 parts": "ReducedModel, 4 parts",
    AUTO: 'ReducedModel, parts="auto"',
}
"""Model of the ladder -> its name in the report."""

SHIFT = "friction"
"""Column of the numbers that holds the shift of the end by friction."""


SHIFTS = 1e-5, 1e-3
"""A run is measured in units of friction if 0.1 % of it moves the end by so much [m]: less says nothing, and more is
the difference between holding and slipping."""


def depends_on_friction(each: dict[str, float]) -> bool:
    """Return True if the distances of a run are measured in units of friction."""
    return SHIFTS[0] < each[SHIFT] < SHIFTS[1]


def cases_of(shape: str) -> tuple[Case, ...]:
    """Return the in-hand runs of a shape."""
    return tuple(case for case in CASES if case.shape == shape)


def friction_shift(case: Case) -> float:
    """Return the distance [m] by which 0.1 % more and 0.1 % less friction move the end of the distributed model, their
    mean."""
    base = columns(simulate(case.scene("d"), **FINE))
    changed = (columns(simulate(case.scene("d", with_friction(s * FRICTION_CHANGE)), **FINE)) for s in (1.0, -1.0))
    return 0.5 * sum(end_distance(run, base) for run in changed)


def end_distances(rows: list[Row], shifts: dict[str, float]) -> dict[str, dict[str, float]]:
    """Return by case the distance of the end [m] from the distributed model's by model, and the shift by friction."""
    result: dict[str, dict[str, float]] = {}
    for row in rows:
        if "end" in row.errors and row.model != "full":
            result.setdefault(row.case, {})[row.model] = row.errors["end"]
    return {case: each | {SHIFT: shifts[case]} for case, each in result.items()}


def score(ends: dict[str, dict[str, float]], load: int, model: str = "reduced") -> dict[str, Any]:
    """Count the runs under a load in which a model ends nearer than the published one, and compute the ratios."""
    ratios = {case: each[model] / each["published"] for case, each in ends.items() if case.endswith(f"load {load}")}
    return {"runs": len(ratios), "nearer": sum(ratio < 1.0 for ratio in ratios.values()), "ratios": ratios}
