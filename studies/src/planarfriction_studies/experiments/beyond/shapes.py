"""Reduced models on patches that no table holds, moved by smooth random twists: their largest errors."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction.models import DistributedModel
from planarfriction.patch import ContactPatch
from planarfriction.scenes.ready import driven
from planarfriction.scenes.signal import Signal
from planarfriction_studies.experiments import experiment
from planarfriction_studies.experiments.beyond.ladder import reduced_models
from planarfriction_studies.experiments.experiment import Table
from planarfriction_studies.experiments.runs import (
    LAW,
    at_centre_of_pressure,
    simulated,
)

DISCS, SEEDS = (8, 16, 64), tuple(range(10))
"""Numbers of discs of `ReducedModel`, beside its default, and seeds of the twists."""

T_END, DT, WAVES = 2.0, 5e-3, 5
"""End of a twist and time between its samples [s], linear in between, and its half waves over that time, at most."""

SLOWEST, FASTEST = -3.3, -1.7
"""Powers of ten between which the speed of a twist is drawn [m/s]: from half of v_s to twenty times it."""

ARM, START = 6.5e-3, 0.2
"""Speed over angular speed of a twist, as large as the patches [m], and the time over which it grows from zero [s]."""

EVERY = 1e-3
"""Time between samples of the errors [s]: a patch breaks away within a few milliseconds, and samples 10 ms apart miss
the largest error of the one model and meet that of the other."""

FINER = 3
"""Parts into which a side of a cell is cut for the reference."""

QUANTITIES = {"force": "N", "torque": "N m"}


def _sector() -> ContactPatch:
    angle = np.linspace(0.0, 1.9, 25)
    outer, inner = (
        radius * np.column_stack([np.cos(angle), np.sin(angle)])
        for radius in (0.012, 0.006)
    )
    return ContactPatch.polygon(
        np.concatenate([outer, inner[::-1]]), 21, name="annulus sector"
    )


def _feet() -> ContactPatch:
    places = np.array([(0.0, 0.010), (-0.009, -0.006), (0.008, -0.005)])
    grid = 6e-4 * (
        np.stack(np.meshgrid(range(4), range(4)), axis=-1).reshape(-1, 2) - 1.5
    )
    return ContactPatch.points(
        (places[:, None] + grid).reshape(-1, 2), name="three feet"
    )


def _gaussian() -> ContactPatch:
    def pressure(x: float, y: float) -> float:
        return float(np.exp(-((x - 0.004) ** 2 + (y + 0.003) ** 2) / (2.0 * 0.004**2)))

    return ContactPatch.rectangle(0.02, pressure=pressure, name="Gaussian off centre")


_CORNER = [
    (0.0, 0.0),
    (0.02, 0.0),
    (0.02, 0.006),
    (0.006, 0.006),
    (0.006, 0.02),
    (0.0, 0.02),
]

SHAPES: dict[str, Callable[[], ContactPatch]] = {
    "L": lambda: ContactPatch.polygon(_CORNER, 21, name="L"),
    "annulus sector": _sector,
    "three feet": _feet,
    "Gaussian off centre": _gaussian,
}
"""Patches by name: not convex, in separate places, and pressed unevenly."""


def twist(seed: int) -> Signal:
    """Return a smooth random twist that starts from rest: half waves of random size and phase, at a random speed."""
    rng = np.random.default_rng([seed, 17])
    time = np.arange(0.0, T_END + 0.5 * DT, DT)
    waves = np.arange(1, WAVES + 1)[:, None, None]
    sizes = rng.normal(size=(WAVES, 1, 3)) / waves
    phases = rng.uniform(0.0, 2.0 * np.pi, (WAVES, 1, 3))
    sums = (sizes * np.sin(np.pi * waves * time[:, None] / T_END + phases)).sum(axis=0)
    speed = 10.0 ** rng.uniform(SLOWEST, FASTEST)
    return Signal.sampled(
        time,
        np.minimum(time / START, 1.0)[:, None] * speed * sums * [1.0, 1.0, 1.0 / ARM],
        "linear",
    )


def largest_errors(shape: str, seeds: tuple[int, ...] = SEEDS) -> dict[str, np.ndarray]:
    """Return the largest errors `[twists, 2]` of force [N] and torque [N m] about the centre of pressure by model.

    The reference is the distributed model with its cells cut finely; points stay as they are.
    """
    patch = SHAPES[shape]()
    fine = patch.refined(FINER) if (patch.cell_extents() > 0.0).any() else patch
    models = reduced_models(patch, DISCS)
    reference = DistributedModel(fine, LAW)
    result = {}
    for seed in seeds:
        wrench = functools.partial(_wrench, twist=twist(seed))
        wanted = wrench(reference)
        for name, model in models.items():
            miss = wrench(model) - wanted
            worst = [np.hypot(miss[:, 0], miss[:, 1]).max(), np.abs(miss[:, 2]).max()]
            result.setdefault(name, []).append(worst)
    return {name: np.array(errors) for name, errors in result.items()}


def _wrench(model: Any, twist: Signal) -> np.ndarray:
    return at_centre_of_pressure(
        simulated(driven(model, twist=twist, t_end=T_END), save_every=EVERY),
        model.patch,
    )


def ratios(errors: dict[str, np.ndarray]) -> dict[str, dict[str, list[float]]]:
    """Return the largest errors of `ReducedModel` over the published model's, by model and quantity, of each twist."""
    return {
        name: {
            quantity: (errors[name] / errors["published"])[:, i].tolist()
            for i, quantity in enumerate(QUANTITIES)
        }
        for name in errors
        if name != "published"
    }


def table(found: dict[str, dict[str, np.ndarray]]) -> Table:
    """Return the largest errors over the published model's: the median twist and the worst."""
    models = [name for name in next(iter(found.values())) if name != "published"]
    words = {"reduced": "default"}
    columns = {
        f"{quantity}, {words.get(model, model)}": lambda each, m=model, q=quantity: (
            f"{np.median(each[m][q]):.2f} / {max(each[m][q]):.2f}"
        )
        for quantity in QUANTITIES
        for model in models
    }
    note = f"Twists of {T_END:g} s, samples every {1e3 * EVERY:g} ms; from a grid cut {FINER} times finer."
    title = "New shapes: largest error over the published reduced model's, median / worst twist"
    return experiment.table(
        title,
        {shape: ratios(each) for shape, each in found.items()},
        columns,
        "patch",
        note,
    )
