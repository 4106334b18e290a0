"""Intervals of estimates on curved ridges of the cost, where linear standard errors are too small: its profile."""

from __future__ import annotations

import numpy as np

from planarfriction.identify.parameters import ALL
from planarfriction.identify.search import Descent
from planarfriction.identify.uncertainty import Fit, Uncertainty, covariance_of
from planarfriction.identify.verdicts import VAGUE

REACH, NEAR, ROUNDS = 2.0, 0.8, 3
"""Standard errors at which the cost is looked at, share of the rise it should have there from which on no further
value is tried, and most values that are tried on a side."""

SURE = 0.02
"""Standard error, as a share of the estimate, below which a ridge looks straight."""

STIFF, SETTLED = 1e4, 0.02
"""Weight of a value that is held, over its share off, and change of the cost at which a search ends."""


def stretches(fit: Fit, u: Uncertainty) -> np.ndarray:
    """Compute factors >= 1 on the standard errors, `[F]`.

    An estimate is held at two standard errors to either side while all else is fitted. Where the cost rises by less
    than the 2 that a parabola would have there, it is held further away (Venzon and Moolgavkar 1988).
    """
    spread = covariance_of(fit, np.concatenate([u.jacobian, u.pull]), ~fit.at_bound)
    result = np.ones(len(fit.problem.names))
    for i, value in enumerate(fit.values[: len(result)]):
        error = np.sqrt(spread[i, i])
        if SURE * abs(value) < error < VAGUE * abs(value) and not fit.at_bound[i]:
            fit.problem.report(f"interval of {fit.problem.names[i]}")
            way = np.where(np.isfinite(spread[i]), spread[i], 0.0) / error
            result[i] = max(_stretch(fit, i, way, sign) for sign in (-REACH, REACH))
    fit.problem.forget()
    return result


def _stretch(fit: Fit, i: int, way: np.ndarray, sign: float) -> float:
    """Return the factor on the standard error of value i on one side, along the `way` `[F + K]` that it would take."""
    problem, coordinates = fit.problem, fit.coordinates
    residuals, share = problem.residuals(coordinates, fit.sigma), way[i] / fit.values[i]
    own = ALL[problem.names[i]]
    factor: float = 1.0
    wanted = 0.5 * REACH**2
    for _ in range(ROUNDS):
        by = np.exp(sign * factor * share) if own.logarithmic else 1.0 + sign * factor * share
        target = fit.values[i] * by
        if not own.low < target < own.high:
            break

        def held(x: np.ndarray, at: float = target) -> tuple[np.ndarray, np.ndarray]:
            rows, slopes = residuals(x)
            off, slope = coordinates.values(x)[i] / at - 1.0, coordinates.slopes(x)[i] / at
            return np.append(rows, STIFF * off), np.concatenate([slopes, STIFF * slope[None]])

        start = fit.values + way * (target - fit.values[i]) / way[i]
        search: Descent = Descent(held, coordinates.of(start), SETTLED / max(fit.cost, 1.0))
        search.run(coordinates.bounds())
        rise: float = search.cost - fit.cost
        factor *= min(max(np.sqrt(wanted / max(rise, 1e-9)), 1.0), 2.0)
        if rise > NEAR * wanted:
            break
    return factor
