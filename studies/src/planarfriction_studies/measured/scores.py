"""Errors, what is said of many of them, and how sure that is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

SAMPLES = 2000
"""Drawings of a bootstrap."""


class Measure(NamedTuple):
    """A column of the table of a task."""

    key: str
    """Name in the JSON, with the unit."""
    heading: str
    """Heading in the table."""
    total: Callable[..., Any]
    """`rms`, `mean` or `median`."""
    board: str = ""
    """Board whose cases count; all cases if empty."""
    column: int = 0
    """Column of the errors of a case."""
    quantity: str = "error"
    """Quantity of the axis of a figure."""


def rms(values: np.ndarray, weights: np.ndarray | None = None) -> Any:
    """Return the root mean square of values `[N]`, with weights `[..., N]`."""
    return np.sqrt(mean(np.square(values), weights))


def mean(values: np.ndarray, weights: np.ndarray | None = None) -> Any:
    """Return the mean of values `[N]`, with weights `[..., N]`."""
    return (
        np.mean(values) if weights is None else weights @ values / weights.sum(axis=-1)
    )


def median(values: np.ndarray, weights: np.ndarray | None = None) -> Any:
    """Return the median of values `[N]`, or the values at half of all weights `[..., N]`."""
    if weights is None:
        return np.median(values)
    order = np.argsort(values)
    sums = np.cumsum(weights[..., order], axis=-1)
    return values[order][np.argmax(sums >= 0.5 * sums[..., -1:], axis=-1)]


def angles(first: np.ndarray, second: np.ndarray, length: float) -> np.ndarray:
    """Return angles [deg] between rows `(x, y, length z)` `[M, 3]`; a row of zeros is 90 deg off everything."""
    a = first * [1.0, 1.0, length]
    b = second * [1.0, 1.0, length]
    return np.degrees(
        np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("mi,mi->m", a, b))
    )


def drawings(groups: Sequence[str], seed: int) -> np.ndarray:
    """Draw counts of each of N cases, `[SAMPLES, N]`: bootstrap samples of whole groups, with replacement."""
    names, which = np.unique(np.asarray(groups), return_inverse=True)
    drawn = np.random.default_rng(seed).multinomial(
        len(names), np.full(len(names), 1 / len(names)), size=SAMPLES
    )
    return drawn[:, which].astype(float)


def interval(values: np.ndarray) -> tuple[float, float]:
    """Return the middle 95 % of drawings."""
    low, high = np.percentile(values, [2.5, 97.5])
    return float(low), float(high)
