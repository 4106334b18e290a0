"""The measuring rig: noise of its sensors, and what it adds to a wrench: delay, zero offsets, drift of the load cell.

    y(t) = (1 + scale + sum_k drift_k P_k(u)) W(t - delay) + bias + zero_drift u,    u from -1 to 1 over the log,

with Legendre polynomials `P_k`. All of it is estimated along with the parameters of the contact, each held loosely at
zero, so that what looks like friction in the data shows as a wider interval of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction._support import validation
from planarfriction.identify.logs import Arrays, Log

GROUPS = ("delay", "bias", "load", "twist")
"""Groups of disturbances: delay, zeros of the channels, scale and drift of the load cell, noise of the twist."""

CHANNELS = (("fx", "N"), ("fy", "N"), ("tau", "N m"))
"""Names and units of the channels of a wrench."""

FACTOR = 3
"""Place of the factor on all channels among the effects of a disturbance, after those on fx, fy and tau."""

DELAY = 0.01
"""Standard deviation of the delay a priori [s]."""

LONGEST = 0.05
"""Longest delay that is tried [s]."""

BIAS = 0.1
"""Standard deviation of the zeros a priori, as a share of the largest value of the
channel."""

ZERO_DRIFT = 0.05
"""Standard deviation of the drift of the zeros a priori, as a share of the largest
value of the channel."""

LEAST_FORCE = 1e-3
"""Least value that a force channel counts as, as a share of the largest force."""

SCALE = 0.005
"""Standard deviation of the scale of a calibrated load cell [-]."""

DRIFT = (0.05, 0.02, 0.02)
"""Standard deviations of the drift of a scale by degree [-]; the first is half of the
change over the log."""

EDGE = 1.5
"""Half the range of a load cell's drift over the standard deviation of its scale, as the time at which the cell was
right is unknown."""

ORDER = 3
"""Order of the differences that give the noise: motions at a tenth of the sampling rate
leave 2 % of themselves."""

SIZE = np.sqrt(20.0)
"""Standard deviation of these differences of unit noise: 1 + 9 + 9 + 1 under the
root."""

MEDIAN = 1.4826
"""Standard deviation of a normal distribution over its median absolute value."""

CLIP = 3.0
"""Sigmas beyond which a difference is left out."""

CLIP_VARIANCE = 0.9733
"""Variance of a unit normal distribution that is cut at `CLIP`."""

CLIPPED = 5
"""Rounds of leaving differences out."""

TINY = np.finfo(float).tiny
"""Least size of a divisor that may vanish."""

LEAST_NOISE = 1e-3
"""Least noise of a sensor, as a share of the largest force or torque."""

QUIET = 1e-3
"""Noise of a twist, as a share of its root mean square, below which it is not
smoothed."""

LEAST_TO_SMOOTH = 50
"""Number of samples below which a twist is not smoothed."""

SMOOTHNESS = 10.0 ** np.arange(0.0, 10.0, 0.25)
"""Weights of the third differences among which a smooth twist is chosen."""


class Nuisance(NamedTuple):
    """Sensor error that was estimated along with the contact."""

    name: str
    unit: str
    value: float
    """Estimate [unit]."""
    error: float
    """Standard error [unit]."""
    log: str = ""
    """Name of the log, empty for what all logs share."""

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval [unit]."""
        return self.value - 1.96 * self.error, self.value + 1.96 * self.error


class _Column(NamedTuple):
    name: str
    unit: str
    log: int | None
    width: float
    """Standard deviation a priori [unit]."""
    degree: int = 0
    """Degree of the Legendre polynomial over the log."""
    channel: int = FACTOR
    """Channel to which it adds, or `FACTOR` for the factor on all."""


class Rig:
    """Nuisance parameters of logs, K of them, in the order of `columns`."""

    def __init__(self, logs: Sequence[Log], groups: Sequence[str]):
        self.logs = logs
        self.groups = tuple(groups)
        columns = [_Column("delay", "s", None, DELAY)] if "delay" in groups else []
        columns += [_Column("load_scale", "-", None, SCALE)] if "load" in groups else []
        for i, log in enumerate(logs):
            largest = np.abs(log.wrench).max(axis=0)
            largest[:2] = np.maximum(largest[:2], LEAST_FORCE * largest[:2].max())
            for k, (channel, unit) in enumerate(CHANNELS):
                if "bias" in groups and log.channels[k]:
                    bias = BIAS * largest[k]
                    drift = ZERO_DRIFT * largest[k]
                    columns += [
                        _Column(f"bias_{channel}", unit, i, bias, 0, k),
                        _Column(f"zero_drift_{channel}", unit, i, drift, 1, k),
                    ]
            for k, width in enumerate(DRIFT if "load" in groups else (), start=1):
                name = "load_drift" if k == 1 else f"load_drift_{k}"
                columns.append(_Column(name, "-", i, width, k))
        self.columns = tuple(columns)
        self.widths = np.array([each.width for each in columns])
        self.limits = np.array(
            [LONGEST / DELAY if each.name == "delay" else np.inf for each in columns]
        )
        """Largest sizes of the values, over their widths, `[K]`."""

    def _effects(self, i: int) -> np.ndarray:
        """Return the derivatives `[T, 4, K]` of the zeros of log i and of the factor on its wrench."""
        time = self.logs[i].time
        u = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
        shapes = np.polynomial.legendre.legvander(u, len(DRIFT))
        effects = np.zeros((len(time), 4, len(self.columns)))
        for j, column in enumerate(self.columns):
            if column.log in (None, i) and column.name != "delay":
                effects[:, column.channel, j] = shapes[:, column.degree]
        return effects

    def delay(self, values: np.ndarray) -> float:
        """Return the delay [s] among the values `[K]`."""
        return values[0] if "delay" in self.groups else 0.0

    def added(
        self, i: int, values: np.ndarray, wrench: np.ndarray, later: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Compute the wrench `[T, 3]` that sensors of log i show, the factor `[T]` on it, and derivatives `[T, 3, K]`.

        `later` is the derivative of the wrench with respect to the delay.
        """
        effects = self._effects(i)
        changes = effects @ values
        factor = 1.0 + changes[:, FACTOR]
        slopes = effects[:, FACTOR, None] * wrench[:, :, None] + effects[:, :FACTOR]
        if "delay" in self.groups:
            slopes[:, :, 0] = factor[:, None] * later
        return factor[:, None] * wrench + changes[:, :FACTOR], factor, slopes

    def with_drift(self, values: np.ndarray) -> np.ndarray:
        """Return the widths `[K]`, that of the load cell's scale grown by the cell's drift, half its largest range."""
        ranges = [
            np.ptp(self._effects(i)[:, FACTOR] @ values) for i in range(len(self.logs))
        ]
        scales = [each.name == "load_scale" for each in self.columns]
        wide = np.hypot(SCALE, 0.5 * max(ranges) / EDGE)
        return np.where(scales, wide, self.widths)

    def strains(self, values: np.ndarray) -> list[tuple[float, str]]:
        """Return the size of each value `[K]` over its width and in words, the largest first."""
        words = [
            f"{column.name} {value:.2g} {column.unit}".removesuffix(" -")
            for column, value in zip(self.columns, values, strict=True)
        ]
        sizes = np.abs(values / self.with_drift(values))
        return sorted(zip(sizes.tolist(), words, strict=True), reverse=True)

    def found(self, values: np.ndarray, errors: np.ndarray) -> tuple[Nuisance, ...]:
        """Return the estimates `[K]` with their standard errors `[K]` as records."""
        several = len(self.logs) > 1
        return tuple(
            Nuisance(
                c.name,
                c.unit,
                float(v),
                float(e),
                self.logs[c.log].name if several and c.log is not None else "",
            )
            for c, v, e in zip(self.columns, values, errors, strict=True)
        )


def check_groups(name: str, nuisance: Any) -> tuple[str, ...]:
    """Return the names of disturbances as a tuple, each one of `GROUPS`, or raise InvalidValueError."""
    return tuple(dict.fromkeys(validation.choices(name, nuisance, GROUPS)))


# ---------------------------------------------------------------------- noise of the sensors


def jitter(values: np.ndarray) -> np.ndarray:
    """Estimate the standard deviation `[C]` of white noise on the columns `[T, C]` from their third differences.

    Slow changes leave hardly any third differences; those that are too large for noise come from sharp changes and are
    left out.
    """
    differences = np.abs(np.diff(values, ORDER, axis=0)) / SIZE
    sigma = MEDIAN * np.median(differences, axis=0)
    for _ in range(CLIPPED):
        kept = differences <= CLIP * sigma
        sigma = np.sqrt(
            np.sum(np.where(kept, differences, 0.0) ** 2, axis=0)
            / np.maximum(kept.sum(axis=0), 1)
        )
        sigma = sigma / np.sqrt(CLIP_VARIANCE)
    return sigma


def least_noise(logs: Sequence[Log]) -> np.ndarray:
    """Return the least noise `[3]` of a wrench that sensors can have."""
    largest = np.max([np.abs(log.wrench).max(axis=0) for log in logs], axis=0)
    force = largest[:2].max()
    return LEAST_NOISE * np.maximum([force, force, largest[2]], TINY)


def wrench_noise(logs: Sequence[Log], *residuals: Arrays) -> np.ndarray:
    """Estimate the noise `[3]` of the wrench from the jitter of the logs or of the residuals `[T, 3]`, if that is less.

    A fit takes the sharp turns of friction out of the signal; its errors extend over many samples and so leave the
    jitter alone. The noise of a channel that no log has is infinite.
    """
    sigmas = []
    for values in ([log.wrench for log in logs], *residuals):
        squares = [
            len(v) * np.where(log.channels, jitter(v), 0.0) ** 2
            for log, v in zip(logs, values, strict=True)
        ]
        samples = np.sum([len(log.time) * log.channels for log in logs], axis=0)
        sigmas.append(np.sqrt(np.sum(squares, axis=0) / np.maximum(samples, 1)))
    measured = np.any([log.channels for log in logs], axis=0)
    return np.where(
        measured, np.maximum(np.min(sigmas, axis=0), least_noise(logs)), np.inf
    )


class SmoothTwist(NamedTuple):
    """Twist from which noise was removed as far as possible."""

    values: np.ndarray
    """Twist without noise [m/s, m/s, rad/s], `[T, 3]`."""
    noise: np.ndarray
    """Standard deviation of the noise of the measured twist, `[3]`."""
    left: np.ndarray
    """Root mean square of the remaining error, `[3]`."""
    weights: np.ndarray
    """Weights of the third differences in the smoother, `[3]`; 0 for a channel that was not smoothed."""

    @property
    def noisy(self) -> np.ndarray:
        """Mask `[3]` of the channels whose remaining error counts."""
        return self.left > QUIET * _size(self.values)

    def error(self, random: np.random.Generator) -> np.ndarray:
        """Draw an error that the values may have, `[T, 3]`: noise through the same smoother."""
        drawn = random.standard_normal(self.values.shape)
        for k in np.flatnonzero(self.weights):
            drawn[:, k] = _solved(drawn[:, k], self.weights[k])
        return drawn * (self.left / _size(drawn))


def _size(values: np.ndarray) -> np.ndarray:
    """Compute the root mean square of the columns `[T, C]`, not quite zero."""
    return np.maximum(np.sqrt(np.mean(values**2, axis=0)), TINY)


def smoothed(log: Log) -> SmoothTwist:
    """Remove the noise from the twist of a log.

    Samples that are not evenly spaced in time, and twists with hardly any noise, stay as they are.
    """
    if len(log.parts) > 1:
        return _joined([smoothed(part) for part in log.parts])
    noise = jitter(log.twist)
    found = SmoothTwist(log.twist.copy(), noise, noise.copy(), np.zeros(3))
    if log.even and len(log.time) >= LEAST_TO_SMOOTH:
        for k in np.flatnonzero(noise > QUIET * _size(log.twist)):
            found.values[:, k], noise[k], found.left[k], found.weights[k] = _smooth(
                log.twist[:, k]
            )
    return found


def as_measured(log: Log) -> SmoothTwist:
    """Return the twist of a log that has no noise."""
    return SmoothTwist(log.twist, *np.zeros((3, 3)))


def _joined(parts: Sequence[SmoothTwist]) -> SmoothTwist:
    """Join the parts of a log: mean squares of errors, and the median weights."""
    sizes = [len(part.values) for part in parts]
    values, noise, left, weights = zip(*parts, strict=True)
    noise, left = (
        np.sqrt(np.average(np.square(each), axis=0, weights=sizes))
        for each in (noise, left)
    )
    return SmoothTwist(np.concatenate(values), noise, left, np.median(weights, axis=0))


def _smooth(values: np.ndarray) -> tuple[Any, ...]:
    """Smooth values `[T]`; returns them with their noise, their remaining error, and the weight of third differences.

    The weight minimises the generalised cross-validation; the remaining error is Stein's estimate.

    Sources: Eilers 2003 (the smoother); Golub, Heath, Wahba 1979 (the weight); Stein 1981.
    """
    stiffness = (2.0 - 2.0 * np.cos(np.linspace(0.0, np.pi, 4001))) ** ORDER

    def tried(weight: float) -> tuple[Any, ...]:
        smooth = _solved(values, weight)
        freedom = np.mean(1.0 / (1.0 + weight * stiffness)) + ORDER / len(values)
        square = np.mean((values - smooth) ** 2)
        variance = square / (1.0 - freedom)
        error = max(square + 2.0 * variance * freedom - variance, variance * freedom)
        score = variance / (1.0 - freedom)
        return score, smooth, np.sqrt(variance), np.sqrt(error), weight

    return min(map(tried, SMOOTHNESS), key=lambda each: each[0])[1:]


def _solved(values: np.ndarray, weight: float) -> np.ndarray:
    """Solve `(1 + weight D'D) x = values` for x `[T]`, with D the matrix of third differences."""
    from scipy.linalg import solveh_banded

    row = np.array([-1.0, 3.0, -3.0, 1.0])
    ones = np.ones(len(values) - ORDER)
    bands = np.zeros((ORDER + 1, len(values)))
    for k in range(ORDER + 1):  # upper bands
        products = row[: len(row) - k] * row[k:]
        bands[ORDER - k, k:] = weight * np.convolve(ones, products)
    bands[ORDER] += 1.0
    return solveh_banded(bands, values)
