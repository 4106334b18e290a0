"""Costs of a whole in-hand run, and of the import before it."""

from __future__ import annotations

import math
import statistics
import subprocess
import sys
import time
from typing import Any, Literal

from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch, SoftFinger
from planarfriction.scenes import Scene, Solution, in_hand, in_hand_load, simulate
from planarfriction.scenes.ready import IN_HAND_LOADS
from planarfriction_studies.bench.baselines import lsoda_time
from planarfriction_studies.bench.measurement import (
    Measurement,
    disc,
    law,
    line,
    median,
)

WINDOW = 0.1
"""Part of the in-hand run [s] that the general solver is given where the whole run would take it minutes."""


def _run_times(
    *scenes: Scene, repeats: int, **options: Any
) -> tuple[list[float], list[Solution]]:
    """Return the least processor time of `simulate` [s] for each scene, in turns, and their last solutions."""
    solutions = [simulate(scene, **{**options, "t_end": 0.02}) for scene in scenes]
    least = [math.inf] * len(scenes)
    for _ in range(repeats):
        for i, scene in enumerate(scenes):
            begin = time.process_time()
            solutions[i] = simulate(scene, **options)
            least[i] = min(least[i], time.process_time() - begin)
    return least, solutions


def distributed(full: bool) -> Measurement:
    """Measure the distributed model on 21 x 21 cells."""
    scene = in_hand(DistributedModel(disc(), law()))
    (value,), _ = _run_times(scene, repeats=5)
    if full:
        return line(
            value, "s", "SciPy LSODA over the whole run", lsoda_time(scene, scene.t_end)
        )
    (ours,), _ = _run_times(scene, repeats=5, t_end=WINDOW)
    theirs = lsoda_time(scene, WINDOW)
    words = f"SciPy LSODA over the first {WINDOW} s (the ratio is to the {ours * 1e3:.2g} ms of that window here)"
    return line(value, "s", words, theirs, theirs / ours)


def distributed_101(full: bool) -> Measurement:
    """Measure the distributed model on 101 x 101 cells, per cell and step."""
    patches = disc(101), disc(21)
    scenes = (in_hand(DistributedModel(patch, law())) for patch in patches)
    times, solutions = _run_times(*scenes, repeats=3, t_end=WINDOW)
    ours, theirs = (
        taken
        / (solution.statistics.steps + solution.statistics.rejections)
        / patch.cells
        for taken, solution, patch in zip(times, solutions, patches, strict=True)
    )
    unit = "ns per loaded cell and step"
    return line(1e9 * ours, unit, "the same on 21 x 21 cells", 1e9 * theirs)


def published(full: bool, load: Literal[1, 2] = 1) -> Measurement:
    """Measure the published reduced model."""
    scene = in_hand(
        ReducedModelPublished(disc(), law()), normal_force=in_hand_load(load)
    )
    (value,), _ = _run_times(scene, repeats=9)
    return line(
        value, "s", "SciPy LSODA over the whole run", lsoda_time(scene, scene.t_end)
    )


def reduced(full: bool) -> Measurement:
    """Measure `ReducedModel`."""
    models = ReducedModel(disc(), law()), ReducedModelPublished(disc(), law())
    (value, theirs), _ = _run_times(*map(in_hand, models), repeats=9)
    return line(value, "s", "the published reduced model", theirs)


def _soft() -> ContactPatch:
    """Return the published soft finger whose profile follows the load."""
    finger = SoftFinger(
        c=6.0 * 0.02 / 21, n=1.0 / 3.0, k_per_newton=2.0, radius_max=0.01
    )
    return ContactPatch.rectangle(0.02, cells=21, pressure=finger)


def reduced_load_dependent(full: bool) -> Measurement:
    """Measure `ReducedModel` with shares that follow the load beside fixed ones."""
    soft = _soft()
    fixed = ContactPatch(
        soft.positions, soft.areas, soft.weights(IN_HAND_LOADS[1, 1][0]), soft.grid
    )
    scenes = (in_hand(ReducedModel(patch, law())) for patch in (soft, fixed))
    (value, theirs), _ = _run_times(*scenes, repeats=9)
    return line(value, "s", "the same with a fixed shape", theirs)


def load_dependent(full: bool) -> Measurement:
    """Measure the published reduced model, rebuilt as the load changes."""
    soft = _soft()
    rebuilt = median(lambda: simulate(in_hand(ReducedModelPublished(soft, law()))), 3)
    fixed = median(lambda: simulate(in_hand(ReducedModelPublished(disc(), law()))), 3)
    return line(
        rebuilt, "s", "the same with a fixed shape (both: all of simulate)", fixed
    )


def importing(full: bool) -> Measurement:
    """Measure `import planarfriction`, in a process of its own."""

    def seconds(module: str) -> float:
        code = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
        command = [sys.executable, "-c", code]
        return float(
            subprocess.run(command, capture_output=True, text=True, check=True).stdout
        )

    ours, theirs = (
        statistics.median(seconds(module) for _ in range(7))
        for module in ("planarfriction", "numpy")
    )
    return line(ours, "s", "import numpy", theirs)
