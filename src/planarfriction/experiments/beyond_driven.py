"""Reduced models in the velocity-driven runs: error from a finer grid, beside targets, and what a step costs."""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np

from planarfriction.experiments.beyond_ladder import Row
from planarfriction.experiments.experiment import Comparison
from planarfriction.experiments.runs import IN_WORDS, LAW
from planarfriction.experiments.velocity_driven_boxes import SAMPLES
from planarfriction.models import ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES

MODELS = {"published": "published reduced", "reduced": "ReducedModel", "full": "distributed, 21 x 21"}
"""Model of the ladder -> its name in the report."""

TARGETS = {"median": 0.25, "third quartile": 0.8, "maximum": 1.0}
"""Statistic of the force error -> the share of the published reduced model's that `ReducedModel` shall stay below."""

TORQUE_TARGET = 1.0
"""The same for the largest error of the torque."""

STEP_TARGET = 1.5
"""How many times the cost of a published reduced step a step of `ReducedModel` may have."""

ROUNDS, STEPS = 9, 10_000

Errors = dict[str, dict[str, dict[str, float]]]
"""Shape -> model of the ladder -> statistic of the error."""


def driven_errors(rows: list[Row]) -> Errors:
    """The rows of the velocity-driven runs by shape and model."""
    result: Errors = {}
    for row in rows:
        before, _, shape = row.case.partition(", ")
        if before == "driven":
            result.setdefault(shape, {})[row.model] = row.errors
    return result


def ratios(errors: Errors) -> dict[str, dict[str, float]]:
    """Error of `ReducedModel` over that of the published reduced model, by shape and statistic, force and torque."""
    names = [f"{before}{name}" for before in ("", "torque ") for name in TARGETS]
    return {
        shape: {name: each["reduced"][name] / each["published"][name] for name in names}
        for shape, each in errors.items()
    }


def step_costs(shape: str = "Circle") -> dict[str, Any]:
    """Median time of a step in a compiled loop [s] of both reduced models, in turns, and the median of their ratios."""
    from planarfriction.autodiff import rollout

    patch = PUBLISHED_PATCHES[shape]()
    directions = np.random.default_rng(7).normal(size=(STEPS, 3)) * [1.0, 1.0, 150.0]
    twists = directions * 10.0 ** np.random.default_rng(8).uniform(-4.0, -1.5, size=(STEPS, 1))
    models = {"published": ReducedModelPublished(patch, LAW), "reduced": ReducedModel(patch, LAW)}
    times: dict[str, list[float]] = {name: [] for name in models}
    for _ in range(ROUNDS + 1):
        for name, model in models.items():
            begin = time.perf_counter()
            rollout(model, model.rest(), twists, 1.0, 1e-4)
            times[name].append((time.perf_counter() - begin) / STEPS)
    share = [ours / theirs for ours, theirs in zip(times["reduced"][1:], times["published"][1:], strict=True)]
    return {
        **{f"{name} [s]": statistics.median(values[1:]) for name, values in times.items()},
        "ratio": statistics.median(share),
    }


def comparisons(errors: Errors) -> list[Comparison]:
    """Errors of `ReducedModel` from the finer grid, at most a share of the published reduced model's."""
    return [
        Comparison(
            f"driven, {IN_WORDS[shape]}: ReducedModel, {name.removeprefix('torque ')} of the error of the {quantity}, "
            f"against {share:g} times the published model's",
            "converged",
            each["reduced"][name],
            share * each["published"][name],
            unit,
            SAMPLES,
            "Three states keep the first moments of the bristle field alone. The reference: the distributed model with "
            "its cells cut finely.",
        )
        for shape, each in errors.items()
        for name, share, quantity, unit in (
            *((name, share, "force", "N") for name, share in TARGETS.items()),
            ("torque maximum", TORQUE_TARGET, "torque", "N m"),
        )
    ]
