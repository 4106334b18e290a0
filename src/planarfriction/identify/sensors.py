"""What sensors add to a log: the noise of its channels, estimated from their jitter, and twists without theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction.identify.logs import Log

ORDER = 3
"""Order of the differences that give the noise: motions of a tenth of the sampling rate leave 2 % of themselves."""

SIZE = float(np.sqrt(20.0))
"""Spread of third differences of noise of unit spread: 1 + 9 + 9 + 1 under the root."""

MEDIAN = 1.4826
"""Spread of a normal distribution over its median absolute value."""

CLIP, CLIP_VARIANCE, CLIPPED = 3.0, 0.9733, 5
"""Spreads beyond which a difference is left out, the variance of a normal distribution cut there, and rounds."""

LEAST_NOISE = 1e-3
"""Noise below this share of the largest force or torque is none that sensors have, nor what is between samples."""

QUIET = 1e-3
"""Noise of the twist below this share of its root mean square is left as it is."""

LEAST_TO_SMOOTH = 50
"""Samples below which a twist is not smoothed."""

SMOOTHNESS = 10.0 ** np.arange(0.0, 10.0, 0.25)
"""Weights of the third differences that are tried for a smooth twist."""


def jitter(values: np.ndarray) -> np.ndarray:
    """Spread `[C]` of white noise on the columns `[T, C]`: of third differences, which slow changes leave, without
    those that are too large for noise, which sharp ones make."""
    differences = np.abs(np.diff(values, ORDER, axis=0)) / SIZE
    spread = MEDIAN * np.median(differences, axis=0)
    for _ in range(CLIPPED):
        kept = differences <= CLIP * spread
        spread = np.sqrt(np.sum(np.where(kept, differences, 0.0) ** 2, axis=0) / np.maximum(kept.sum(axis=0), 1))
        spread = spread / np.sqrt(CLIP_VARIANCE)
    return spread


def least_noise(logs: Sequence[Log]) -> np.ndarray:
    """Least noise `[3]` that is believed of a wrench."""
    largest = np.max([np.abs(log.wrench).max(axis=0) for log in logs], axis=0)
    force = max(largest[:2].max(), np.finfo(float).tiny)
    return LEAST_NOISE * np.array([force, force, max(largest[2], np.finfo(float).tiny)])


def first_noise(logs: Sequence[Log]) -> np.ndarray:
    """Noise `[3]` of the wrenches to begin a search with."""
    return wrench_noise(logs, [log.wrench for log in logs])


def wrench_noise(logs: Sequence[Log], offs: Sequence[np.ndarray]) -> np.ndarray:
    """Noise `[3]` of the wrench from the jitter of the logs, or from that of what a fit leaves `[T, 3]`, if less.

    A fit takes the sharp turns of friction out of the signal; what it misses, it misses over many samples and so leaves
    the jitter alone. Infinite for a channel that no log has.
    """
    spreads = []
    for values in ([log.wrench for log in logs], offs):
        squares = [len(v) * np.where(log.channels, jitter(v), 0.0) ** 2 for log, v in zip(logs, values, strict=True)]
        samples = np.sum([len(log.time) * log.channels for log in logs], axis=0)
        spreads.append(np.sqrt(np.sum(squares, axis=0) / np.maximum(samples, 1)))
    measured = np.any([log.channels for log in logs], axis=0)
    return np.where(measured, np.maximum(np.minimum(*spreads), least_noise(logs)), np.inf)


@dataclass(frozen=True)
class SmoothTwist:
    """A twist whose noise was taken out as far as it can be."""

    values: np.ndarray
    """`[T, 3]`"""
    noise: np.ndarray
    """Noise of the measured one, `[3]`."""
    left: np.ndarray
    """Root mean square of the error that is left, `[3]`."""
    weights: np.ndarray
    """Of the third differences, `[3]`; 0 where the twist stayed as it was."""

    def error(self, random: np.random.Generator) -> np.ndarray:
        """An error as the values may have, `[T, 3]`: noise through the same smoother."""
        drawn = random.standard_normal(self.values.shape)
        for k, weight in enumerate(self.weights):
            if weight > 0.0:
                drawn[:, k] = _solved(drawn[:, k], weight)
            drawn[:, k] *= self.left[k] / max(np.sqrt(np.mean(drawn[:, k] ** 2)), np.finfo(float).tiny)
        return drawn


def smoothed(log: Log) -> SmoothTwist:
    """The twist of a log without its noise.

    Samples that are not even in time, and twists whose noise is hardly any, stay as they are.
    """
    found = as_measured(log)
    if not log.even or len(log.time) < LEAST_TO_SMOOTH:
        return found
    values, noise, left, weights = log.twist.copy(), found.noise, found.left, found.weights
    size = np.maximum(np.sqrt(np.mean(log.twist**2, axis=0)), np.finfo(float).tiny)
    for k in np.flatnonzero(noise > QUIET * size):
        values[:, k], noise[k], left[k], weights[k] = _smooth(log.twist[:, k])
    return SmoothTwist(values, noise, left, weights)


def as_measured(log: Log) -> SmoothTwist:
    """The twist of a log as it is, with its noise."""
    noise = jitter(log.twist)
    return SmoothTwist(log.twist, noise, noise.copy(), np.zeros(3))


def _smooth(values: np.ndarray) -> tuple[np.ndarray, float, float, float]:
    """Values whose third differences are held small, their noise, the error that is left, and the weight.

    The weight is that of the least generalised cross-validation; what is left is Stein's estimate of the error.

    Sources: Eilers 2003 (the smoother); Golub, Heath, Wahba 1979 (the weight); Stein 1981.
    """
    count = len(values)
    stiffness = (2.0 - 2.0 * np.cos(np.linspace(0.0, np.pi, 4001))) ** ORDER
    best = (np.inf, values, 0.0, 0.0, 0.0)
    for weight in SMOOTHNESS:
        smooth = _solved(values, weight)
        freedom = float(np.mean(1.0 / (1.0 + weight * stiffness))) + ORDER / count
        square = float(np.mean((values - smooth) ** 2))
        score = square / (1.0 - freedom) ** 2
        if score < best[0]:
            variance = square / (1.0 - freedom)
            error = max(square + 2.0 * variance * freedom - variance, variance * freedom)
            best = score, smooth, float(np.sqrt(variance)), float(np.sqrt(error)), float(weight)
    return best[1:]


def _solved(values: np.ndarray, weight: float) -> np.ndarray:
    """`(1 + weight D'D)^-1` of values, with D their third differences."""
    from scipy.linalg import solveh_banded

    count, row = len(values), (-1.0, 3.0, -3.0, 1.0)
    bands = np.zeros((ORDER + 1, count))
    for shift in range(ORDER + 1):  # upper bands
        for i in range(ORDER + 1 - shift):
            bands[ORDER - shift, i + shift : count - ORDER + i + shift] += weight * row[i] * row[i + shift]
    bands[ORDER] += 1.0
    return solveh_banded(bands, values)
