"""The models of a state side by side: how far each is from the distributed model, and what a run of it costs."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from planarfriction.errors import FrictionError
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.scenes import Signal, driven, simulate
from planarfriction_explorer.drawing import Drawing
from planarfriction_explorer.state import State

T_END = 0.2
"""Duration of a run [s]."""

REPEATS = 5
"""Runs of each model, the fastest of which counts."""

RUNGS: dict[str, Callable[[Any, Any], Any]] = {
    "distributed": DistributedModel,
    "reduced, 64 discs": lambda patch, law: ReducedModel(patch, law, cells=64),
    "reduced": ReducedModel,
    "reduced, 8 discs": lambda patch, law: ReducedModel(patch, law, cells=8),
    "reduced, as published": lambda patch, law: ReducedModelPublished(patch, law),
}
"""Models of the ladder, from the reference down to three states."""


class Rung(NamedTuple):
    """One model in the run."""

    name: str
    states: int
    """Bristle states."""
    error: float
    """Root mean square of the distance of (fx, fy, tau/r)/(mu_c f_N) from the distributed model [-]; NaN: no run."""
    seconds: float
    """Time in the solver [s]."""
    refusal: str = ""
    """Reason why the model refuses this patch or law, in one line; empty if it accepts both."""


@functools.lru_cache(maxsize=32)
def _model(name: str, drawing: Drawing, law: Any) -> Any:
    """Return a model, kept while the twist is dragged: to make one takes longer than to run it."""
    return RUNGS[name](drawing.patch, law)


def motion(state: State) -> Signal:
    """Return the twist of the state, reached in a quarter of the run and reversed after half: stick, slip, reversal."""
    times = T_END * np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    return Signal.sampled(
        times, np.outer([0.0, 1.0, 1.0, -1.0, -1.0], state.twist), "linear"
    )


def climb(state: State) -> Iterator[Rung]:
    """Return each model of `RUNGS` in the same run, the distributed one first."""
    scale = state.law.numbers.mu_c * np.array(
        [1.0, 1.0, state.drawing.surface.contact_radius]
    )
    reference = None
    for name in RUNGS:
        try:
            model = _model(name, state.drawing, state.law)
            scene = driven(
                model,
                twist=motion(state),
                normal_force=state.normal_force,
                at="origin",
                t_end=T_END,
            )
            scene = dataclasses.replace(scene, save_every=T_END / 200)
            # The first may compile, others may be disturbed.
            runs = [simulate(scene) for _ in range(REPEATS)]
        except FrictionError as error:
            yield Rung(name, 0, float("nan"), float("nan"), str(error))
            continue
        data = runs[0].data
        found = (
            np.stack([data[each].values[:, 0] for each in ("fx", "fy", "tau")], axis=1)
            / state.normal_force
        )
        reference = found if reference is None else reference
        error = float(np.sqrt((((found - reference) / scale) ** 2).sum(axis=1).mean()))
        seconds = min(run.statistics.wall_time for run in runs)
        yield Rung(name, int(np.prod(model.state_shape)), error, seconds)
