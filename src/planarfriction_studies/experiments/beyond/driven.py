"""Reduced models in the velocity-driven runs: error from a finer grid, and what a step costs."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction_studies.experiments.beyond.ladder import AUTO, Row, name_of_parts
from planarfriction_studies.experiments.experiment import Arrays
from planarfriction_studies.experiments.runs import LAW

MODELS = {
    "published": "published reduced",
    "reduced": "ReducedModel",
    AUTO: 'ReducedModel, parts="auto"',
    "full": "distributed, 21 x 21",
}
"""Model of the ladder -> its name in the report."""

STATISTICS = ("median", "third quartile", "maximum")
"""Statistics of the errors over a run, of force and of torque."""

PARTS = (1, 4, 6)
"""Parts whose steps are timed."""

ROUNDS, STEPS = 9, 10_000

SPIN, SPIN_STEPS, SPIN_STEP = 0.02, 400, 1e-8
"""Speed of the spin from rest [rad/s], its steps, and how far each goes at the contact radius [m]: 1e-6 m are full
deflection."""

Errors = dict[str, dict[str, dict[str, float]]]
"""Shape -> model of the ladder -> statistic of the error."""


def driven_errors(rows: list[Row]) -> Errors:
    """Return the rows of the velocity-driven runs by shape and model."""
    result: Errors = {}
    for row in rows:
        before, _, shape = row.case.partition(", ")
        if before == "driven":
            result.setdefault(shape, {})[row.model] = row.errors
    return result


def ratios(errors: Errors, model: str = "reduced", over: str = "published") -> dict[str, dict[str, float]]:
    """Return the error of a model of the ladder over that of another, by shape and statistic, force and torque."""
    names = [f"{before}{name}" for before in ("", "torque ") for name in STATISTICS]
    return {shape: {name: each[model][name] / each[over][name] for name in names} for shape, each in errors.items()}


def step_costs(shape: str = "Circle") -> dict[str, Any]:
    """Return times of a step in a compiled loop [s] by reduced model, one of each round in which all take part."""
    from planarfriction.derivatives import rollout

    patch = PUBLISHED_PATCHES[shape]()
    directions = np.random.default_rng(7).normal(size=(STEPS, 3)) * [1.0, 1.0, 150.0]
    twists = directions * 10.0 ** np.random.default_rng(8).uniform(-4.0, -1.5, size=(STEPS, 1))
    models: dict[str, Any] = {"published": ReducedModelPublished(patch, LAW)}
    models |= {name_of_parts(count): ReducedModel(patch, LAW, parts=count) for count in PARTS}
    times = {name: np.empty(ROUNDS) for name in models}
    for turn in range(-1, ROUNDS):  # the first compiles
        for name, model in models.items():
            begin = time.process_time()
            rollout(model, model.rest(), twists, 1.0, 1e-4)
            if turn >= 0:
                times[name][turn] = (time.process_time() - begin) / STEPS
    return times


def step_numbers(times: Arrays) -> dict[str, dict[str, list[float]]]:
    """Return the median and quartiles of the time of a step [s], and of its ratio to the published model's in the same
    round."""
    return {
        name: {"time": median_and_quartiles(each), "ratio": median_and_quartiles(each / times["published"])}
        for name, each in times.items()
    }


def median_and_quartiles(values: Any) -> list[float]:
    """Return the median, first and third quartile."""
    return np.percentile(values, [50.0, 25.0, 75.0]).tolist()


def spin_up(shape: str) -> dict[str, float]:
    """Return the largest error of the torque [N m] of a spin from rest until the patch slides, from its own cells, by
    model."""
    patch = PUBLISHED_PATCHES[shape]()
    models: dict[str, Any] = {"published": ReducedModelPublished(patch, LAW)}
    models |= {name_of_parts(parts): ReducedModel(patch, LAW, parts=parts) for parts in (1, AUTO)}
    dt = SPIN_STEP / (SPIN * patch.contact_radius())
    wanted = _spun(DistributedModel(patch, LAW), dt)
    return {name: float(np.abs(_spun(model, dt) - wanted).max()) for name, model in models.items()}


def _spun(model: Any, dt: float) -> np.ndarray:
    """Return the torque [N m] of a spin from rest, step by step."""
    state, torques = model.rest(), np.empty(SPIN_STEPS)
    for i in range(SPIN_STEPS):
        state, wrench = model.step(state, (0.0, 0.0, SPIN), 1.0, dt)
        torques[i] = wrench[2]
    return torques
