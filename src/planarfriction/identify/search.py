"""Search for the best values: starting points, bounded least squares, noise from the residuals, finer steps.

On curved ridges of the cost linear standard errors are too small: there intervals follow from its profile.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.errors import IdentificationInterrupted
from planarfriction.identify.logs import Arrays, Linear
from planarfriction.identify.parameters import ALL, Coordinates
from planarfriction.identify.problem import LeastSquaresProblem, LogProblem
from planarfriction.identify.uncertainty import Fit, Uncertainty, covariance_of, finite
from planarfriction.identify.verdicts import VAGUE
from planarfriction.laws import LuGre

ROUGH = 0.1
"""Change of the cost, half a sum of squares, below which the search from a rough start
ends."""

FINE = 1e-3
"""Change of the cost below which a search ends: a change of an estimate by 0.04
standard errors."""

FAR = 1e-3
"""Change of the cost, as a share, below which a search ends that is far from the data."""

ROUNDS = 6
"""Most rounds of noise and finer steps."""

STEADY = 0.02
"""Largest change of the noise, as a share, for which it is settled."""

MOST_EVALUATIONS = 100
"""Most evaluations of one start."""

SAME_COST = 1e-3
"""Largest difference of costs, as a share, of starts that found one minimum."""

TOUCHING = 1e-9
"""Distance from a bound, over the size of a coordinate above 1, at which a search has ended on it."""

IN_CACHE = 256
"""Number of rows that are reduced at a time: a triangle of triangles takes a third of the time."""

SPEEDS = 6
"""Number of Stribeck speeds from which a search starts."""

STIFFNESSES = 7
"""Number of stiffnesses from which a search starts."""

SCATTER = 0.7
"""Standard deviation of the logarithms of starts around a given one."""


def multistart(problem: LeastSquaresProblem, starts: Arrays, noise: np.ndarray) -> Fit:
    """Find the best rough fit from starts `[F]` or `[F + K]`, with the same noise for all samples of a channel."""
    coordinates = problem.coordinates(starts[0])
    sigma = problem.even_sigma(noise)
    points = [coordinates.of(each) for each in starts]
    return _best(problem, coordinates, points, noise, sigma, ROUGH)


def refine(fit: Fit) -> Fit:
    """Find the best fit that a rough one leads to: noise from what is left, steps as fine as the errors ask for."""
    problem = fit.problem
    coordinates = fit.coordinates
    starts = fit.starts
    for turn in range(ROUNDS):
        noise, sigma = problem.estimate_noise(fit.values, fit.noise)
        settled = turn > 0 and np.allclose(noise, fit.noise, rtol=STEADY, atol=0.0)
        finer = problem.refine_steps(fit.values, sigma)
        if finer:
            problem.forget()
            problem.report(f"{problem.steps} steps between two samples")
        elif settled:
            break
        fit = _best(
            problem, coordinates, [fit.x], noise, sigma, ROUGH if finer else FINE
        )
    problem.forget()
    found = _best(problem, coordinates, [fit.x], noise, sigma, FINE)
    return found._replace(starts=starts)


def warm_start(
    problem: LogProblem, lead: Fit, guesses: Arrays, noise: np.ndarray
) -> Fit:
    """Find the best rough fit of another model than that of `lead`, from where this ended and from the best guess.

    A lead that does not fit ends far away, and one that fits may stay where the corner of the bristles is not seen.
    """
    guess = min(guesses, key=lambda values: misfit(problem, values, noise))
    return multistart(problem, [lead.values, guess], noise)


@contextlib.contextmanager
def interruptible(problems: Sequence[LeastSquaresProblem]) -> Iterator[None]:
    """Let Ctrl-C raise `IdentificationInterrupted` with the best values so far of the last problem that has any."""
    try:
        yield
    except KeyboardInterrupt:
        for problem in reversed(problems):
            if problem.so_far is not None:
                raise IdentificationInterrupted(
                    problem.by_name(problem.so_far)
                ) from None
        raise


class _SettledError(Exception):
    """The cost changes no more."""


@dataclass(eq=False)
class Descent:
    """Search from one start, and the best point that it has found.

    It ends where a try changes the cost by less than `share` of it, up or down, or above `far` by less than `FAR` of
    it. `least_squares` alone continues until its steps vanish, if derivatives that are kept from nearby promise a gain
    that is not there.
    """

    residuals: Callable[[np.ndarray], Linear]
    x: np.ndarray
    share: float
    far: float = np.inf
    cost: Any = np.inf
    _last: Any = None

    def run(self, bounds: tuple[np.ndarray, np.ndarray]) -> None:
        """Minimise the sum of squares."""
        from scipy.optimize import least_squares

        with contextlib.suppress(_SettledError):
            least_squares(
                self._residual,
                self.x,
                jac=self._jacobian,  # pyright: ignore[reportArgumentType]
                bounds=bounds,
                x_scale="jac",
                xtol=1e-9,
                ftol=self.share,
                gtol=1e-12,
                max_nfev=MOST_EVALUATIONS,
            )

    def _residual(self, x: np.ndarray) -> np.ndarray:
        self._last = condensed(*self.residuals(x))
        cost = 0.5 * float(self._last[0] @ self._last[0])
        share = self.share if cost < self.far else FAR
        settled = abs(cost - self.cost) < share * cost
        if cost < self.cost:
            self.x = x.copy()
            self.cost = cost
        if settled:
            raise _SettledError
        return self._last[0]

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._last[1]  # least_squares asks for those at its last residuals


def _best(
    problem: LeastSquaresProblem,
    coordinates: Coordinates,
    points: Arrays,
    noise: np.ndarray,
    sigma: np.ndarray,
    change: float,
) -> Fit:
    """Minimise the sum of squares from coordinates `[F + K]` until the cost changes by less than `change`.

    Coordinates at a bound are set to it.
    """
    residuals = problem.residuals(coordinates, sigma)
    bounds = coordinates.bounds()
    evaluations = itertools.count(1)
    share = max(change / (0.5 * problem.numbers), problem.least_change)
    found = []

    def told(x: np.ndarray) -> Linear:
        problem.report(
            f"start {len(found)} of {len(points)}, evaluation {next(evaluations)}"
        )
        problem.so_far = coordinates.values(min(found, key=lambda each: each.cost).x)
        return residuals(x)

    for point in points:
        found.append(Descent(told, point, share, problem.far))
        found[-1].run(bounds)
    best = min(found, key=lambda each: each.cost)
    agreeing = sum(each.cost <= best.cost * (1.0 + SAME_COST) for each in found)
    low, high = (
        np.abs(best.x - each) <= TOUCHING * np.maximum(1.0, np.abs(best.x))
        for each in bounds
    )
    x = np.select([low, high], bounds, best.x)
    return Fit(
        problem,
        coordinates,
        x,
        coordinates.values(x),
        low | high,
        noise,
        sigma,
        (agreeing, len(points)),
        best.cost,
    )


def condensed(residual: np.ndarray, jacobian: np.ndarray) -> Linear:
    """Reduce residuals `[M]` and derivatives `[M, F]` to `F + 1` rows with the same sums of squares and products.

    They are the triangle of `[J, r] = Q R`: all that least squares needs, at a fraction of the cost.
    """
    rows = np.column_stack([jacobian, residual])
    width = rows.shape[1]
    last = len(rows) // IN_CACHE * IN_CACHE
    blocks = rows[:last].reshape(-1, IN_CACHE, width)
    blocks = np.asarray(np.linalg.qr(blocks, mode="r")).reshape(-1, width)
    rows = np.concatenate([blocks, rows[last:]])
    triangle = np.asarray(np.linalg.qr(rows, mode="r"))
    return triangle[:, -1], triangle[:, :-1]


# ---------------------------------------------------------------------- starting points


def guess_starts(
    problem: LogProblem, given: dict[str, float] | None, noise: np.ndarray
) -> Arrays:
    """Return as many vectors of values `[F]` as the options of the problem ask for, the best first.

    A whole law as start (`given` is None) leads, scattered copies follow. Otherwise the best points of a grid over
    Stribeck speed and stiffness are taken, with the values `given` by name.
    """
    ranked = [problem.start_values()]
    if given is not None:
        grid = _grid(problem, given)
        ranked = sorted(grid, key=lambda values: misfit(problem, values, noise))
    starts = problem.options.starts
    random = np.random.default_rng(problem.options.seed)
    more = max(starts - len(ranked), 0), len(problem.names)
    positive = [
        ALL[name].logarithmic or name.startswith("sigma") for name in problem.names
    ]
    factors = np.exp(SCATTER * random.standard_normal(more) * positive)
    return [*ranked[:starts], *(ranked[0] * factors)]


def _grid(problem: LogProblem, given: dict[str, float]) -> Arrays:
    """Return the values at all points of the grid; a parameter that is not estimated or is given has one value."""
    base = problem.start_values()
    law = problem.law
    speeds = problem.sliding(base)[0]
    # friction of fast sliding, and the largest
    coefficient = problem.coefficients(base)
    usable = np.isfinite(coefficient)
    coefficient = coefficient[usable]
    fast = speeds[usable] >= np.quantile(speeds[usable], 0.7)
    mu_c = np.clip(np.median(coefficient[fast]), 0.01, 10.0)
    mu_s = np.clip(np.quantile(coefficient, 0.98), 1.1 * mu_c, 2.0 * mu_c)
    wanted = [name for name in problem.names if name not in given]
    interval = min(log.interval for log in problem.logs)
    grid = itertools.product(
        _speeds(speeds) if "v_s" in wanted else [law.v_s],
        _stiffnesses(problem, speeds, mu_c) if "sigma_0" in wanted else [law.sigma_0],
    )
    results = []
    for v_s, sigma_0 in grid:
        guess = {
            "mu_c": mu_c,
            "mu_s": mu_s,
            "v_s": v_s,
            "gamma": 1.5,
            "sigma_0": sigma_0,
            "sigma_1": 0.3 * sigma_0 * interval,
            "sigma_2": 0.02 * mu_c / max(problem.split_logs(speeds)[0].max(), 1e-9),
        }
        picked = {name: guess[name] for name in wanted if name in guess}
        results.append(np.array([*(problem.by_name(base) | picked).values()]))
    return results


def _speeds(speeds: np.ndarray) -> np.ndarray:
    """Return Stribeck speeds to try [m/s], spread over the sliding speeds of the logs."""
    moving = speeds[speeds > 0.0]
    if not len(moving):
        return np.array([LuGre.v_s])
    low, high = np.quantile(moving, [0.05, 0.9])
    return np.geomspace(max(low, 1e-3 * high), high, SPEEDS)


def _stiffnesses(problem: LogProblem, speeds: np.ndarray, mu_c: float) -> np.ndarray:
    """Return stiffnesses to try [1/m]: full deflection after a tenth of a usual step up to a tenth of all travel."""
    steps = speeds * np.concatenate([log.durations for log in problem.logs])
    moving = steps[steps > 0.0]
    if not len(moving):
        return np.array([LuGre.sigma_0])
    short = 0.1 * np.median(moving)
    long = 0.1 * moving.sum()
    return np.geomspace(mu_c / short, mu_c / max(long, 10.0 * short), STIFFNESSES)


def misfit(problem: LogProblem, values: np.ndarray, noise: np.ndarray) -> float:
    """Compute the sum of the squared residuals of values `[F]` or `[F + K]` over the noise `[3]`."""
    return (problem.residual(values, problem.even_sigma(noise)) ** 2).sum()


REACH = 2.0
"""Distance from an estimate, in standard errors, at which its profile of the cost is computed."""

NEAR = 0.8
"""Rise of the cost at `REACH` standard errors, over that of a parabola, from which on no further value is tried."""

TRIES = 3
"""Largest number of held values that are tried on one side of an estimate."""

SURE = 0.02
"""Standard error, as a share of the estimate, below which a ridge looks straight."""

STIFF = 1e4
"""Weight of the relative deviation from the value at which a parameter is held."""

SETTLED = 0.02
"""Change of the cost at which a search with a held value ends."""


def stretches(fit: Fit, u: Uncertainty) -> np.ndarray:
    """Compute factors >= 1 on the standard errors, `[F]`.

    An estimate is fixed at two standard errors to either side while all else is fitted. Where the cost rises by less
    than the 2 that a parabola would have there, it is held further away (Venzon and Moolgavkar 1988).
    """
    spread = covariance_of(fit, np.concatenate([u.jacobian, u.pull]), ~fit.at_bound)
    result = np.ones(len(fit.problem.names))
    for i, value in enumerate(fit.values[: len(result)]):
        error = np.sqrt(spread[i, i])
        if SURE * abs(value) < error < VAGUE * abs(value) and not fit.at_bound[i]:
            fit.problem.report(f"interval of {fit.problem.names[i]}")
            way = finite(spread[i]) / error
            result[i] = max(_stretch(fit, i, way, sign) for sign in (-REACH, REACH))
    fit.problem.forget()
    return result


def _stretch(fit: Fit, i: int, way: np.ndarray, sign: float) -> float:
    """Return the factor on the standard error of value i on one side, along the `way` `[F + K]` that it would take."""
    problem = fit.problem
    coordinates = fit.coordinates
    residuals = problem.residuals(coordinates, fit.sigma)
    share = way[i] / fit.values[i]
    own = ALL[problem.names[i]]
    factor: Any = 1.0
    wanted = 0.5 * REACH**2
    for _ in range(TRIES):
        by = sign * factor * share
        target = fit.values[i] * (np.exp(by) if own.logarithmic else 1.0 + by)
        if not own.low < target < own.high:
            break

        def held(x: np.ndarray, at: float = target) -> Linear:
            rows, slopes = residuals(x)
            off = coordinates.values(x)[i] / at - 1.0
            slope = coordinates.slopes(x)[i] / at
            return np.append(rows, STIFF * off), np.vstack([slopes, STIFF * slope])

        start = coordinates.of(fit.values + way * (target - fit.values[i]) / way[i])
        search = Descent(held, start, SETTLED / max(fit.cost, 1.0))
        search.run(coordinates.bounds())
        rise = search.cost - fit.cost
        factor *= min(max(np.sqrt(wanted / max(rise, 1e-9)), 1.0), 2.0)
        if rise > NEAR * wanted:
            break
    return factor
