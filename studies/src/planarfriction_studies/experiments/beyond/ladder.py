"""Errors and costs of models with 3 to 951 bristle states, in hand and moved with a given velocity."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from planarfriction.derivatives import rollout
from planarfriction.limit_surface import LimitSurfaceEllipsoid, LimitSurfaceTable
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.scenes import Scene, simulate
from planarfriction.scenes.ready import FINE, driven, in_hand, in_hand_load
from planarfriction_studies.experiments.experiment import Arrays, median_and_quartiles
from planarfriction_studies.experiments.in_hand import runs
from planarfriction_studies.experiments.in_hand.runs import Case
from planarfriction_studies.experiments.runs import (
    IN_WORDS,
    LAW,
    SIX_SHAPES,
    at_centre_of_pressure,
    simulated,
)
from planarfriction_studies.experiments.velocity_driven import boxes

DISCS = (1, 4, 8, 16, 32, 64)
"""Numbers of discs of `ReducedModel`, beside its default."""

DEFAULT = ReducedModel.cells

NAMES = {
    n: "reduced" if n == DEFAULT else f"{n} discs" for n in sorted({*DISCS, DEFAULT})
}
"""Number of discs -> name of the model."""

ALL = "all discs"
"""Name of `ReducedModel` with a disc for every cell of the patch."""

CASES = (
    *(Case(shape, load) for shape in (*SIX_SHAPES, "LineGradX") for load in (1, 2)),
    *(Case("Circle", load, 2) for load in (1, 2)),
)
"""In-hand runs."""

CLOSE: dict[str, Any] = {"rtol": 1e-7, "atol": 3e-7}
"""Tolerances of the in-hand runs: ten times those of the in-hand experiment, for here micrometres are compared."""

REFERENCE_CELLS = 2100
"""Most cells of a reference grid; its own staircase must be well below the errors that are measured."""

LEAST_PARTS, MOST_PARTS = 3, 33

REPEATS, LONG, SHORT = 9, 0.1, 0.02
"""A run is timed once and, if it takes less than LONG [s], so many times more; a short one before does not count."""

MOVED = {
    "published": "published reduced",
    "8 discs": "ReducedModel, 8 discs",
    "reduced": f"ReducedModel, {DEFAULT} discs",
    ALL: "ReducedModel, one disc per cell",
    "full": "distributed, 21 x 21",
}
"""Model of the ladder -> its name in the report."""

STATISTICS = ("median", "third quartile", "maximum")
"""Statistics of the errors over a run, of force and of torque."""

ROUNDS, STEPS = 9, 10_000

SPIN, SPIN_STEPS, SPIN_STEP = 0.02, 400, 1e-8
"""Speed of the spin from rest [rad/s], its steps, and how far each goes at the contact radius [m]: 1e-6 m are full
deflection."""

ENDS = {name: words for name, words in MOVED.items() if name != "full"}
"""Models of the in-hand runs -> their names in the report."""

SHIFT = "friction"
"""Column of the numbers that holds the shift of the end by friction."""

SHIFTS = 1e-5, 1e-3
"""A run is measured in units of friction if 0.1 % of it moves the end by so much [m]: less says nothing, and more is
the difference between holding and slipping."""


class Row(NamedTuple):
    """One model in one run."""

    case: str
    model: str
    """"published", the same with another surface, "n discs", "reduced" by default, "all discs", or "full"."""
    states: int
    """Bristle states."""
    errors: dict[str, float]
    """In-hand: largest distance "position" and distance at the "end" [m] from the full model. Velocity-driven: the
    statistics of a box plot (`boxes.COLUMNS`) of the error of the force [N] and, as "torque median" and so on, of the
    torque [N m] at the centre of pressure, from a finer grid."""
    time: float = float("nan")
    """Time in the solver at the default tolerances over that of the full model; `run_times` measures it."""


def shape_of(case: str) -> str:
    """Return the patch of a case in words."""
    if case.startswith("driven, "):
        return IN_WORDS[case.removeprefix("driven, ")]
    return case.rpartition(", load")[0].removesuffix(", far placement")


def reduced_models(patch: ContactPatch, discs: Iterable[int]) -> dict[str, Any]:
    """Return the published reduced model, and `ReducedModel` by default and with numbers of discs, by name."""
    few: dict[str, Any] = {
        "published": ReducedModelPublished(patch, LAW),
        "reduced": ReducedModel(patch, LAW),
    }
    return few | {
        f"{count} discs": ReducedModel(patch, LAW, cells=count) for count in discs
    }


@functools.lru_cache(maxsize=8)
def models(shape: str) -> dict[str, Any]:
    """Return the models of a published patch by name; numbers of discs only below that of its cells."""
    patch = PUBLISHED_PATCHES[shape]()
    result: dict[str, Any] = {
        "full": DistributedModel(patch, LAW),
        "published, smooth": ReducedModelPublished(
            patch, LAW, surface=LimitSurfaceTable(patch)
        ),
        "published, ellipsoid": ReducedModelPublished(
            patch, LAW, surface=LimitSurfaceEllipsoid(patch)
        ),
    }
    result |= reduced_models(patch, (count for count in DISCS if count < patch.cells))
    return result | {ALL: ReducedModel(patch, LAW, cells=patch.cells)}


def scenes_of(shape: str) -> dict[str, Callable[[Any], Scene]]:
    """Return functions that make the scene of each run of a shape from a model, by case."""
    result: dict[str, Callable[[Any], Scene]] = {}
    for case in CASES:
        if case.shape == shape:
            result[case.words] = functools.partial(
                in_hand,
                normal_force=in_hand_load(case.load, placement=case.placement),
                centre_of_mass=runs.CENTRES_OF_MASS[case.placement],
            )
    return result | ({f"driven, {shape}": driven} if shape in SIX_SHAPES else {})


def in_hand_rows(cases: tuple[Case, ...] = CASES) -> list[Row]:
    """Run every model in every in-hand run, against the full distributed model of the same grid."""
    rows = []
    for case in cases:
        scene = scenes_of(case.shape)[case.words]
        run = functools.cache(
            lambda model, scene=scene: simulated(scene(model), **CLOSE)
        )
        whole = run(models(case.shape)["full"])
        for name, model in models(case.shape).items():
            apart = runs.distance(run(model), whole)
            errors = {"position": float(apart.max()), "end": float(apart[-1])}
            rows.append(Row(case.words, name, int(np.prod(model.state_shape)), errors))
    return rows


def reference(patch: ContactPatch) -> ContactPatch:
    """Return the patch with each cell cut into an odd number of parts a side, as many as `REFERENCE_CELLS` allow."""
    sides = int((patch.cell_extents() > 0.0).any(axis=0).sum())
    most = (REFERENCE_CELLS / patch.cells) ** (1.0 / sides)
    return patch.refined(
        int(np.clip((int(most) - 1) // 2 * 2 + 1, LEAST_PARTS, MOST_PARTS))
    )


def driven_rows(shapes: tuple[str, ...] = SIX_SHAPES) -> list[Row]:
    """Run every model in the velocity-driven runs, against the distributed model of a finer grid."""
    rows = []
    for shape in shapes:
        patch = PUBLISHED_PATCHES[shape]()
        fine = simulated(driven(DistributedModel(reference(patch), LAW)))
        wanted = at_centre_of_pressure(fine, patch)
        run = functools.cache(lambda model: simulated(driven(model)))
        for name, model in models(shape).items():
            miss = (at_centre_of_pressure(run(model), patch) - wanted)[1:]
            torque = boxes.statistics(np.abs(miss[:, 2]))
            errors = boxes.statistics(np.hypot(miss[:, 0], miss[:, 1])) | {
                f"torque {k}": v for k, v in torque.items()
            }
            rows.append(
                Row(f"driven, {shape}", name, int(np.prod(model.state_shape)), errors)
            )
    return rows


def run_times(shape: str) -> dict[str, dict[str, float]]:
    """Time in the solver over that of the full model, by case and model; nothing else should run beside it."""
    result = {}
    for case, scene in scenes_of(shape).items():
        time_of = functools.cache(lambda model, scene=scene: _time(scene(model)))
        times = {name: time_of(model) for name, model in models(shape).items()}
        result[case] = {name: value / times["full"] for name, value in times.items()}
    return result


def _time(scene: Scene) -> float:
    """Return the least time in the solver [s] of a few runs: other work beside them only ever adds to it."""
    simulate(scene, t_end=SHORT)
    first = simulate(scene).statistics.wall_time
    return min(
        [
            first,
            *(
                simulate(scene).statistics.wall_time
                for _ in range(REPEATS * (first < LONG))
            ),
        ]
    )


def driven_errors(rows: list[Row]) -> dict[str, dict[str, dict[str, float]]]:
    """Return the errors of the velocity-driven runs by shape, model and statistic."""
    result: dict[str, dict[str, dict[str, float]]] = {}
    for row in rows:
        before, _, shape = row.case.partition(", ")
        if before == "driven":
            result.setdefault(shape, {})[row.model] = row.errors
    return result


def ratios(
    errors: dict[str, dict[str, dict[str, float]]], model: str, over: str = "published"
) -> dict[str, dict[str, float]]:
    """Return the error of a model of the ladder over that of another, by shape and statistic, force and torque."""
    names = [f"{before}{name}" for before in ("", "torque ") for name in STATISTICS]
    return {
        shape: {name: each[model][name] / each[over][name] for name in names}
        for shape, each in errors.items()
    }


def step_costs(shape: str = "Circle") -> dict[str, Any]:
    """Return times of a step in a compiled loop [s] by reduced model, one of each round in which all take part."""
    patch = PUBLISHED_PATCHES[shape]()
    directions = np.random.default_rng(7).normal(size=(STEPS, 3)) * [1.0, 1.0, 150.0]
    twists = directions * 10.0 ** np.random.default_rng(8).uniform(
        -4.0, -1.5, size=(STEPS, 1)
    )
    models = reduced_models(patch, DISCS)
    times = {name: np.empty(ROUNDS) for name in models}
    for turn in range(-1, ROUNDS):  # the first compiles
        for name, model in models.items():
            begin = time.process_time()
            rollout(model, model.rest(), twists, 1.0, 1e-4)
            if turn >= 0:
                times[name][turn] = (time.process_time() - begin) / STEPS
    return times


def step_numbers(times: Arrays) -> dict[str, dict[str, list[float]]]:
    """Return medians and quartiles of the time of a step [s], and of its ratio to the published model's in a round."""
    return {
        name: {
            "time": median_and_quartiles(each),
            "ratio": median_and_quartiles(each / times["published"]),
        }
        for name, each in times.items()
    }


def spin_up(shape: str) -> dict[str, float]:
    """Return the largest error of the torque [N m] of a spin from rest, from the patch's own cells, by model."""
    patch = PUBLISHED_PATCHES[shape]()
    dt = SPIN_STEP / (SPIN * patch.contact_radius())
    wanted = _spun(DistributedModel(patch, LAW), dt)
    models = reduced_models(patch, (8,)) | {
        ALL: ReducedModel(patch, LAW, cells=patch.cells)
    }
    return {
        name: float(np.abs(_spun(model, dt) - wanted).max())
        for name, model in models.items()
    }


def _spun(model: Any, dt: float) -> np.ndarray:
    """Return the torque [N m] of a spin from rest, step by step."""
    state = model.rest()
    torques = np.empty(SPIN_STEPS)
    for i in range(SPIN_STEPS):
        state, wrench = model.step(state, (0.0, 0.0, SPIN), 1.0, dt)
        torques[i] = wrench[2]
    return torques


def depends_on_friction(each: dict[str, float]) -> bool:
    """Return True if the distances of a run are measured in units of friction."""
    return SHIFTS[0] < each[SHIFT] < SHIFTS[1]


def cases_of(shape: str) -> tuple[Case, ...]:
    """Return the in-hand runs of a shape."""
    return tuple(case for case in CASES if case.shape == shape)


def friction_shift(case: Case) -> float:
    """Return the mean distance [m] by which 0.1 % more and less friction move the end of the distributed model."""
    base = simulated(case.scene("d"), **FINE)
    changed = (simulated(case.scene("d", law), **FINE) for law in runs.CHANGED.values())
    return 0.5 * sum(runs.end_distance(run, base) for run in changed)


def end_distances(
    rows: list[Row], shifts: dict[str, float]
) -> dict[str, dict[str, float]]:
    """Return by case the distance of the end [m] from the distributed model's by model, and the shift by friction."""
    result: dict[str, dict[str, float]] = {}
    for row in rows:
        if "end" in row.errors and row.model != "full":
            result.setdefault(row.case, {SHIFT: shifts[row.case]})[row.model] = (
                row.errors["end"]
            )
    return result


def score(ends: dict[str, dict[str, float]], load: int, model: str) -> dict[str, Any]:
    """Count the runs under a load in which a model ends nearer than the published one, and compute the ratios."""
    ratios = {
        case: each[model] / each["published"]
        for case, each in ends.items()
        if case.endswith(f"load {load}")
    }
    return {
        "runs": len(ratios),
        "nearer": sum(ratio < 1.0 for ratio in ratios.values()),
        "ratios": ratios,
    }
