"""Bounded least squares from several starting points, and the covariance from the Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

SAME_COST = 1e-3
"""Starts whose costs agree to this share found the same minimum."""

TOLERANCE = 1e-9
"""The search ends when coordinates or cost change by less than this share."""

MOST_EVALUATIONS = 100
"""Evaluations of one start."""

Residuals = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Residuals `[M]` over their noise, and their derivatives `[M, F]`, at coordinates `[F]`."""


@dataclass(frozen=True)
class Minimum:
    """The best of several local minima."""

    x: np.ndarray
    """Coordinates `[F]`."""
    cost: float
    """Half the sum of the squared residuals."""
    agreeing: int
    """Starts that ended at this cost."""
    at_bound: np.ndarray
    """Which coordinates lie on a bound, `[F]` of bool."""


def minimise(
    residuals: Residuals,
    starts: Sequence[np.ndarray],
    bounds: tuple[np.ndarray, np.ndarray],
    *,
    tolerance: float = TOLERANCE,
    progress: Callable[[str], None] | None = None,
) -> Minimum:
    """Least squares within bounds from every start; the residuals are evaluated once for each point."""
    from scipy.optimize import least_squares

    memory: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def evaluate(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key = x.tobytes()
        if key not in memory:
            memory.clear()
            memory[key] = condensed(*residuals(x))
        return memory[key]

    found = []
    for number, start in enumerate(starts, start=1):
        if progress is not None:
            progress(f"start {number} of {len(starts)}")
        result = least_squares(
            lambda x: evaluate(x)[0],
            start,
            jac=lambda x: evaluate(x)[1],  # pyright: ignore
            bounds=bounds,
            x_scale="jac",
            xtol=1e-9,
            ftol=tolerance,
            gtol=1e-12,
            max_nfev=MOST_EVALUATIONS,
        )
        found.append(result)
    best = min(found, key=lambda each: each.cost)
    agreeing = sum(bool(each.cost <= best.cost * (1.0 + SAME_COST)) for each in found)
    low, high = bounds
    x = np.where(best.active_mask < 0, low, np.where(best.active_mask > 0, high, best.x))
    return Minimum(x, float(best.cost), agreeing, best.active_mask != 0)


def condensed(off: np.ndarray, jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As few rows with the same sums of squares and products: the triangle of `[J, r] = Q R`.

    All that least squares asks of the residuals `[M]` and their derivatives `[M, F]`, at a fraction of the cost.
    """
    triangle = _triangle(np.column_stack([jacobian, off]))
    return triangle[:, -1], triangle[:, :-1]


def _triangle(rows: np.ndarray) -> np.ndarray:
    """R of `rows = Q R`."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def covariance(jacobian: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Covariance `[F, F]` of least squares whose residuals have unit spread: `(J' J)^-1`.

    Parameters that are not `free` (`[F]` of bool: on a bound) have the variance of a fit of that parameter alone, and
    no part in the others. One that moves no residual has an infinite variance; a combination that moves none
    has a huge one, so that all in it show it.
    """
    count = jacobian.shape[1]
    jacobian = _triangle(jacobian)
    size = np.linalg.norm(jacobian, axis=0)
    seen = free & (size > 0.0)
    result = np.zeros((count, count))
    result[np.diag_indices(count)] = np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0) ** 2, np.inf)
    if seen.any():
        _, strengths, axes = np.linalg.svd(jacobian[:, seen] / size[seen], full_matrices=False)
        strengths = np.maximum(strengths, 1e-12 * strengths[0])
        inner = (axes.T / strengths**2) @ axes
        result[np.ix_(seen, seen)] = inner / np.outer(size[seen], size[seen])
    return result


def correlations(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix `[F, F]`; zero with a parameter that has no finite spread."""
    spread = np.sqrt(np.diag(covariance))
    usable = np.isfinite(spread) & (spread > 0.0)
    safe = np.where(usable, spread, 1.0)
    result = np.where(np.outer(usable, usable), np.where(np.isfinite(covariance), covariance, 0.0), 0.0)
    result = result / np.outer(safe, safe)
    result[np.diag_indices(len(spread))] = 1.0
    return np.clip(result, -1.0, 1.0)
