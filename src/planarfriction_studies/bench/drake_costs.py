"""A disc that slides and spins in Drake: what patch friction adds to a step."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from typing import Literal

import numpy as np

from planarfriction_studies.bench.drake_scenes import DISC, Way
from planarfriction_studies.bench.measurement import Measurement, line, once

DT, STEPS, ROUNDS = 2e-3, 100, 9
"""Time step [s], steps that are timed at once, and how often, in turns."""


def disc(full: bool, contact: Literal["point", "hydroelastic"]) -> Measurement:
    """Measure patch friction and Drake's own in turns. Raises `MissingExtraError` without Drake."""
    import planarfriction.adapters.drake  # noqa: F401  (says how to install Drake)

    runs = [_thrown(Way(contact, patch=patch)) for patch in (True, False)]
    times = np.array([[once(run) for run in runs] for _ in range(ROUNDS)]) / STEPS
    value, plain = (statistics.median(column) * 1e6 for column in times.T)
    words = f"the plant with Drake's own friction (patch friction costs {value / plain:.1f} times as much)"
    return line(value, "us per step", words, plain)


def _thrown(way: Way) -> Callable[[], None]:
    """Return a function that throws the disc at 1 m/s and 10 rad/s and runs it for a number of steps, again at each
    call."""
    simulator, plant, context = DISC.build(way, DT)
    simulator.AdvanceTo(100.5 * DT)

    def run() -> None:
        plant.SetVelocities(context, np.array([0.0, 0.0, 10.0, 1.0, 0.0, 0.0]))
        simulator.AdvanceTo(simulator.get_context().get_time() + STEPS * DT)

    run()
    return run
