"""The search for the best values: several starts, noise from the signal, steps as fine as the errors ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction.identify.guess import misfit
from planarfriction.identify.least_squares import Minimum, minimise
from planarfriction.identify.parameters import Coordinates
from planarfriction.identify.problem import Problem

ROUGH, FINE = 0.1, 1e-3
"""Changes of the cost (half a sum of squares) below which a search ends, for rough starts and in the end: 0.001 is a
change of an estimate by 0.04 standard errors."""

ROUNDS = 6
"""Most rounds of noise and finer steps."""

STEADY = 0.02
"""Share by which the noise may still change from round to round."""

NEAR = 4.0
"""Mean square of the residuals over that of the noise up to which a rough fit is near the data: steps are coarse."""


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
    """How many starting points led to this minimum, and how many there were."""
    cost: float
    """Half the sum of the squared residuals."""

    @property
    def near(self) -> bool:
        """Whether hardly more than noise is left."""
        return 2.0 * self.cost <= NEAR * _measured(self.problem)


def look(problem: Problem, starts: Sequence[np.ndarray], *, noise: np.ndarray, say: Callable[[str], None]) -> Fit:
    """The best rough fit from starts `[F]` or `[F + K]`, with the same noise for all samples of a channel."""
    count, widths = len(problem.names), problem.rig.widths
    coordinates = Coordinates(problem.names, starts[0][:count], problem.law.mu_c)
    spread, points = problem.evenly(noise), []
    for each in starts:
        values, rig = problem.split(each)
        points.append(np.concatenate([coordinates.of(values), rig / widths]))
    found = _best(problem, coordinates, points, spread, ROUGH, say)
    values = _values(problem, coordinates, found.x)
    return Fit(
        problem, coordinates, found.x, values, found.at_bound, noise, spread, (found.agreeing, len(starts)), found.cost
    )


def refined(fit: Fit, *, known_noise: bool, fixed_steps: bool, say: Callable[[str], None]) -> Fit:
    """The best fit that a rough one leads to: noise from what is left, steps as fine as the errors ask for."""
    problem, coordinates, x, noise = fit.problem, fit.coordinates, fit.x, fit.noise
    spread = fit.spread
    for turn in range(ROUNDS):
        values = _values(problem, coordinates, x)
        before = noise
        if not known_noise:
            noise = problem.noise(values)
        spread = problem.spread(values, noise)
        known = np.isfinite(noise)
        settled = turn > 0 and bool((np.abs(noise[known] / before[known] - 1.0) < STEADY).all())
        factor = 1 if fixed_steps else problem.finer(values, spread)
        if factor > 1:
            problem.refine_by(factor)
            say(f"{problem.refine} steps between two samples")
        elif settled:
            break
        x = _best(problem, coordinates, [x], spread, ROUGH if factor > 1 else FINE, say).x
    found = _best(problem, coordinates, [x], spread, FINE, say)
    values = _values(problem, coordinates, found.x)
    return Fit(problem, coordinates, found.x, values, found.at_bound, noise, spread, fit.starts, found.cost)


def follow(
    problem: Problem, lead: Fit, guesses: Sequence[np.ndarray], *, noise: np.ndarray, say: Callable[[str], None]
) -> Fit:
    """The best rough fit of another model than that of `lead`.

    It begins where the lead ended, if that is near the data, else at the best of the `guesses` `[F]`: a model that does
    not fit ends far away. Where this does not come near the data, the other start is tried too.
    """
    guess = min(guesses, key=lambda values: misfit(problem, values, noise))
    fits = []
    for start in (lead.values, guess) if lead.near else (guess, lead.values):
        fits.append(look(problem, [start], noise=noise, say=say))
        if fits[-1].near:
            break
    return min(fits, key=lambda fit: fit.cost)


def _measured(problem: Problem) -> int:
    """Count of measured numbers."""
    return sum(int(log.channels.sum()) * len(log.time) for log in problem.logs)


def _values(problem: Problem, coordinates: Coordinates, x: np.ndarray) -> np.ndarray:
    """Values `[F + K]` of coordinates."""
    count = len(problem.names)
    return np.concatenate([coordinates.values(x[:count]), x[count:] * problem.rig.widths])


def _best(
    problem: Problem,
    coordinates: Coordinates,
    points: Sequence[np.ndarray],
    spread: Sequence[np.ndarray],
    change: float,
    say: Callable[[str], None],
) -> Minimum:
    """The least cost from coordinates, until it changes by less than `change`."""
    (low, high), (rig_low, rig_high) = coordinates.bounds(), problem.rig.bounds()
    bounds = np.concatenate([low, rig_low]), np.concatenate([high, rig_high])
    tolerance = change / (0.5 * _measured(problem))
    return minimise(problem.residuals(coordinates, spread), points, bounds, tolerance=tolerance, progress=say)
