"""Error against cost between 3 bristle states and 882: reduced models, their parts, few cells, the whole grid."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.limit_surface import LimitSurfaceEllipsoid, LimitSurfaceTable
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.scenes import Scene, simulate
from planarfriction.scenes.ready import driven, in_hand, in_hand_load
from planarfriction_studies.experiments.in_hand.runs import CENTRES_OF_MASS, Case, distance
from planarfriction_studies.experiments.runs import IN_WORDS, LAW, SIX_SHAPES, at_centre_of_pressure, columns
from planarfriction_studies.experiments.velocity_driven import boxes

DEGREES = (3, 5)
"""Degrees of the compressed patches: 28 and 45 cells."""

PARTS = (1, 4, 6, 16)
"""Parts of `ReducedModel`."""

AUTO = "auto"
"""Value of `parts` with which the model chooses their number, and the name of that model."""

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

REPEATS, LONG, SHORT = 3, 0.05, 0.02
"""A run is timed once and, if it takes less than LONG [s], so many times more; a short one before does not count."""


@dataclass(frozen=True)
class Row:
    """One model in one run."""

    case: str
    model: str
    """"published", the same with another surface, "reduced", "n parts", "auto", "degree d", or "full"."""
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


@functools.lru_cache(maxsize=8)
def models(shape: str) -> dict[str, Any]:
    """Return the models of a published patch by name, each number of cells once; kept, for fitting few cells takes
    seconds.

    `AUTO` is one of the others by another name, where its number of parts is among `PARTS`.
    """
    patch = PUBLISHED_PATCHES[shape]()
    result: dict[str, Any] = {
        "full": DistributedModel(patch, LAW),
        "published": ReducedModelPublished(patch, LAW),
        "published, smooth": ReducedModelPublished(patch, LAW, surface=LimitSurfaceTable(patch)),
        "published, ellipsoid": ReducedModelPublished(patch, LAW, surface=LimitSurfaceEllipsoid(patch)),
    }
    parts = {count: ReducedModel(patch, LAW, parts=count) for count in PARTS}
    result |= {name_of_parts(count): model for count, model in parts.items()}
    auto = ReducedModel(patch, LAW, parts=AUTO)
    result[AUTO] = parts.get(auto.parts, auto)
    sizes = {patch.cells}
    for degree in DEGREES:
        few = patch.compressed(degree)
        if few.cells not in sizes:
            sizes.add(few.cells)
            result[f"degree {degree}"] = DistributedModel(few, LAW)
    return result


def name_of_parts(parts: Any) -> str:
    """Return the name of `ReducedModel` with so many parts, or with `AUTO`."""
    return {1: "reduced", AUTO: AUTO}.get(parts, f"{parts} parts")


def scenes_of(shape: str) -> dict[str, Callable[[Any], Scene]]:
    """Return functions that make the scene of each run of a shape from a model, by case."""
    result: dict[str, Callable[[Any], Scene]] = {}
    for case in CASES:
        if case.shape == shape:
            result[case.words] = functools.partial(
                in_hand,
                normal_force=in_hand_load(case.load, placement=case.placement),
                centre_of_mass=CENTRES_OF_MASS[case.placement],
            )
    return result | ({f"driven, {shape}": driven} if shape in SIX_SHAPES else {})


def in_hand_rows(cases: tuple[Case, ...] = CASES) -> list[Row]:
    """Run every model in every in-hand run, against the full distributed model of the same grid."""
    rows = []
    for case in cases:
        scene = scenes_of(case.shape)[case.words]
        run = functools.cache(lambda model, scene=scene: columns(simulate(scene(model), **CLOSE)))
        whole = run(models(case.shape)["full"])
        for name, model in models(case.shape).items():
            apart = distance(run(model), whole)
            errors = {"position": float(apart.max()), "end": float(apart[-1])}
            rows.append(Row(case.words, name, int(np.prod(model.state_shape)), errors))
    return rows


def reference(patch: ContactPatch) -> ContactPatch:
    """Return the patch with each cell cut along its sides into an odd number of parts, as many as `REFERENCE_CELLS`
    allow."""
    sides = int((patch.cell_extents() > 0.0).any(axis=0).sum())
    most = (REFERENCE_CELLS / patch.cells) ** (1.0 / sides)
    return patch.refined(int(np.clip((int(most) - 1) // 2 * 2 + 1, LEAST_PARTS, MOST_PARTS)))


def driven_rows(shapes: tuple[str, ...] = SIX_SHAPES) -> list[Row]:
    """Run every model in the velocity-driven runs, against the distributed model of a finer grid."""
    rows = []
    for shape in shapes:
        patch = PUBLISHED_PATCHES[shape]()
        fine = columns(simulate(driven(DistributedModel(reference(patch), LAW))))
        wanted = at_centre_of_pressure(fine, patch)
        run = functools.cache(lambda model: columns(simulate(driven(model))))
        for name, model in models(shape).items():
            miss = (at_centre_of_pressure(run(model), patch) - wanted)[1:]
            named = {"": np.hypot(miss[:, 0], miss[:, 1]), "torque ": np.abs(miss[:, 2])}
            errors = {
                before + statistic: value
                for before, values in named.items()
                for statistic, value in boxes.statistics(values).items()
            }
            rows.append(Row(f"driven, {shape}", name, int(np.prod(model.state_shape)), errors))
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
    return min([first, *(simulate(scene).statistics.wall_time for _ in range(REPEATS * (first < LONG)))])
