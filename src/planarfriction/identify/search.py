"""The search for the best values: several starts, noise from the signal, steps as fine as the errors ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction.identify.least_squares import minimise
from planarfriction.identify.parameters import Coordinates
from planarfriction.identify.problem import Problem

ROUGH, FINE = 0.1, 1e-3
"""Changes of the cost (half a sum of squares) below which a search ends, for rough starts and in the end: 0.001 is a
change of an estimate by 0.04 standard errors."""

ROUNDS = 6
"""Most rounds of noise and finer steps."""

STEADY = 0.02
"""Share by which the noise may still change from round to round."""


@dataclass(frozen=True)
class Fit:
    """A model at its best values."""

    problem: Problem
    coordinates: Coordinates
    x: np.ndarray
    """Coordinates `[F + K]`."""
    values: np.ndarray
    """Values `[F + K]`."""
    at_bound: np.ndarray
    """Which coordinates lie on a bound, `[F + K]` of bool."""
    noise: np.ndarray
    """Noise of the wrench `[3]`."""
    spread: list[np.ndarray]
    """Spread of each sample `[T, 3]` of each log."""
    starts: tuple[int, int]
    """How many starts ended here, and how many there were."""


def search(
    problem: Problem,
    starts: Sequence[np.ndarray],
    *,
    noise: np.ndarray,
    known_noise: bool,
    fixed_steps: bool,
    rig: np.ndarray | None = None,
    say: Callable[[str], None],
) -> Fit:
    """The best fit from values `[F]` to start with, and values `[K]` of the rig."""
    coordinates = Coordinates(problem.names, starts[0], problem.law.mu_c)
    count, widths = len(problem.names), problem.rig.widths
    (low, high), (rig_low, rig_high) = coordinates.bounds(), problem.rig.bounds()
    bounds = np.concatenate([low, rig_low]), np.concatenate([high, rig_high])
    first = np.zeros(len(widths)) if rig is None else rig / widths
    samples = sum(int(log.channels.sum()) * len(log.time) for log in problem.logs)

    def values_of(x: np.ndarray) -> np.ndarray:
        return np.concatenate([coordinates.values(x[:count]), x[count:] * widths])

    def best(points: Sequence[np.ndarray], spread: Sequence[np.ndarray], change: float):
        tolerance = change / (0.5 * samples)
        return minimise(problem.residuals(coordinates, spread), points, bounds, tolerance=tolerance, progress=say)

    spread = problem.evenly(noise)
    found = best([np.concatenate([coordinates.of(each), first]) for each in starts], spread, ROUGH)
    agreement = (found.agreeing, len(starts))
    for turn in range(ROUNDS):
        values = values_of(found.x)
        before = noise
        if not known_noise:
            noise = problem.noise(values)
        spread = problem.spread(values, noise)
        told = np.isfinite(noise)
        settled = turn > 0 and bool((np.abs(noise[told] / before[told] - 1.0) < STEADY).all())
        factor = 1 if fixed_steps else problem.finer(values, spread)
        if factor > 1:
            problem.refine_by(factor)
            say(f"{problem.refine} steps between two samples")
        elif settled:
            break
        found = best([found.x], spread, ROUGH if factor > 1 else FINE)
    found = best([found.x], spread, FINE)
    return Fit(problem, coordinates, found.x, values_of(found.x), found.at_bound, noise, spread, agreement)
