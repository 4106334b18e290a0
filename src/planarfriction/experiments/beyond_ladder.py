"""Error against cost between 3 bristle states and 882: the reduced model, compressed patches, the whole grid."""

from __future__ import annotations

import functools
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.experiments import velocity_driven_boxes as boxes
from planarfriction.experiments.in_hand_runs import CENTRES_OF_MASS, TIGHT, Case, distance
from planarfriction.experiments.runs import LAW, SIX_SHAPES, at_centre_of_pressure, columns
from planarfriction.limit_surface import LimitSurfaceEllipsoid, LimitSurfaceTable
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.scenes import Scene, simulate
from planarfriction.scenes.ready import driven, in_hand, in_hand_load

DEGREES = (3, 5, 8)
"""Degrees of the compressed patches."""

CASES = (
    *(Case(shape, load) for shape in (*SIX_SHAPES, "LineGradX") for load in (1, 2)),
    *(Case("Circle", load, 2) for load in (1, 2)),
)
"""In-hand runs."""

REFERENCE_CELLS = 4200
"""Most cells of a reference grid; its own staircase must be well below the errors that are measured."""

LEAST_PARTS, MOST_PARTS = 3, 63

REPEATS = 3

LONG = 0.1
"""A run that takes longer is timed once, after one that does not count [s]."""


@dataclass(frozen=True)
class Row:
    """One model in one run."""

    case: str
    model: str
    """"reduced" (as published), the same with another surface, "moments", "full", or "degree d"."""
    states: int
    """Bristle states."""
    errors: dict[str, float]
    """In-hand: largest distance "position" and distance at the "end" [m] from the full model. Velocity-driven: the
    statistics of a box plot (`boxes.COLUMNS`) of the error of the force [N] and, as "torque median" and so on, of the
    torque [N m] at the centre of pressure, from a finer grid."""
    time: float
    """Median time in the solver at the default tolerances over that of the full model."""


def models(patch: ContactPatch, degrees: tuple[int, ...] = DEGREES) -> dict[str, Any]:
    """The models of a patch by name, each number of cells once."""
    result: dict[str, Any] = {
        "full": DistributedModel(patch, LAW),
        "reduced": ReducedModelPublished(patch, LAW),
        "reduced, smooth": ReducedModelPublished(patch, LAW, surface=LimitSurfaceTable(patch)),
        "reduced, ellipsoid": ReducedModelPublished(patch, LAW, surface=LimitSurfaceEllipsoid(patch)),
        "moments": ReducedModel(patch, LAW),
    }
    sizes = {patch.cells}
    for degree in degrees:
        few = patch.compressed(degree)
        if few.cells not in sizes:
            sizes.add(few.cells)
            result[f"degree {degree}"] = DistributedModel(few, LAW)
    return result


@functools.lru_cache(maxsize=2)
def _models_of(shape: str, degrees: tuple[int, ...]) -> dict[str, Any]:
    """`models` of a published patch, once for all its runs: fitting the few cells takes seconds."""
    return models(PUBLISHED_PATCHES[shape](), degrees)


def in_hand_rows(cases: tuple[Case, ...] = CASES, degrees: tuple[int, ...] = DEGREES) -> list[Row]:
    """Every model in every in-hand run, against the full distributed model of the same grid."""
    rows = []
    for case in cases:
        load = in_hand_load(case.load, placement=case.placement)
        centre = CENTRES_OF_MASS[case.placement]
        whole: dict[str, np.ndarray] = {}

        def scene(model: Any, load=load, centre=centre) -> Scene:
            return in_hand(model, normal_force=load, centre_of_mass=centre)

        def errors(run: dict[str, np.ndarray], whole=whole) -> dict[str, float]:
            if not whole:
                whole.update(run)
            apart = distance(run, whole)
            return {"position": float(apart.max()), "end": float(apart[-1])}

        rows += _rows(case.words, _models_of(case.shape, degrees), scene, errors, TIGHT)
    return rows


def reference(patch: ContactPatch) -> ContactPatch:
    """The patch with each cell cut along its sides into an odd number of parts, as many as `REFERENCE_CELLS` allow."""
    sides = int((patch.cell_extents() > 0.0).any(axis=0).sum())
    most = (REFERENCE_CELLS / patch.cells) ** (1.0 / sides)
    return patch.refined(int(np.clip((int(most) - 1) // 2 * 2 + 1, LEAST_PARTS, MOST_PARTS)))


def driven_rows(shapes: tuple[str, ...] = SIX_SHAPES, degrees: tuple[int, ...] = DEGREES) -> list[Row]:
    """Every model in the velocity-driven runs, against the distributed model of a finer grid."""
    rows = []
    for shape in shapes:
        patch = PUBLISHED_PATCHES[shape]()
        fine = columns(simulate(driven(DistributedModel(reference(patch), LAW))))
        wanted = at_centre_of_pressure(fine, patch)

        def errors(run: dict[str, np.ndarray], patch=patch, wanted=wanted) -> dict[str, float]:
            miss = (at_centre_of_pressure(run, patch) - wanted)[1:]
            force, torque = np.hypot(miss[:, 0], miss[:, 1]), np.abs(miss[:, 2])
            named = {"": force, "torque ": torque}
            return {
                before + name: value
                for before, values in named.items()
                for name, value in boxes.statistics(values).items()
            }

        rows += _rows(f"driven, {shape}", _models_of(shape, degrees), driven, errors, {})
    return rows


def _rows(
    case: str, named: dict[str, Any], scene: Callable[[Any], Scene], errors: Callable, tolerances: dict[str, Any]
) -> list[Row]:
    rows, whole = [], 0.0
    for name, model in named.items():
        run, seconds = _timed(scene(model), tolerances)
        whole = whole or seconds
        rows.append(Row(case, name, int(np.prod(model.state_shape)), errors(columns(run)), seconds / whole))
    return rows


def _timed(scene: Scene, tolerances: dict[str, Any]) -> tuple[Any, float]:
    """A run at the given tolerances, and the median time in the solver of runs at the default ones [s]."""
    solution = simulate(scene)
    repeats = REPEATS if solution.statistics.wall_time < LONG else 1
    times = [simulate(scene).statistics.wall_time for _ in range(repeats)]
    if tolerances:
        solution = simulate(scene, **tolerances)
    return solution, statistics.median(times)
