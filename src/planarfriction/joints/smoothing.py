"""Logs of torque and angle through one smoothing kernel, which keeps the torque balance exact.

Angle, speed and acceleration are the angle smoothed by a Gaussian and its derivatives. The torque, and every regressor
that is not linear in the angle, go through the same kernel: a jump of friction is as blurred in the model as in the
data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planarfriction.joints.log import JointLog, runs
from planarfriction.joints.loops.balance import follow_path

DELAYS = np.arange(-6, 42, 2) * 1e-3
"""Delays of a measured torque that are tried [s]."""

BLOCK = 1.0
"""Time [s] over which errors are correlated at most: samples count by blocks of it."""

PER_WIDTH = 3
"""Rows for each width of the kernel on which the model is computed; every third of them is fitted."""

REACH = 5.0
"""Widths after which the kernel ends."""

WIDEST = 0.04
"""Largest width of the kernel [s]."""

SLOW_FACTOR = 4.0
"""Width of the kernel for slow motion over that for all else: slow motion changes slowly."""

SLOW_SHARE = 0.5
"""Largest width of the kernel for slow motion, as a share of the motion's root mean square speed over acceleration."""

ATTENUATED = 5e-4
"""Largest share of noise in the variance of the acceleration: more would make the inertia look too small."""

NOISY_SPEED = 1e-4
"""Largest share of noise in the variance of the speed."""

STANDS = 0.1
"""Time [s] after which a joint that does not move is left out: its friction is not known."""

NORMAL = 1.4826
"""Standard deviation of a normal distribution over the median of its absolute value."""


class EvenLog(NamedTuple):
    """A log with a torque on an even grid of times."""

    log: JointLog
    """Log as it was measured."""
    dt: float
    """Sampling time [s]."""
    time: np.ndarray
    """Times [s]."""
    angle: np.ndarray
    """Angle [rad]."""
    torque: np.ndarray
    """Torque of the motor and known torque of all else but gravity [N m]."""
    external: np.ndarray
    """Known torque of all else but gravity [N m]."""
    resolution: float
    """Step of the encoder [rad], 0 if none shows."""
    noise: float
    """Standard deviation of the angle's white noise [rad]."""

    @property
    def power(self) -> float:
        """Power of the angle's noise [rad^2 s]."""
        return self.noise**2 * self.dt


def evenly(log: JointLog) -> EvenLog:
    """Interpolate a log to its median sampling time, and measure the noise of its angle."""
    assert log.torque is not None
    dt = np.median(np.diff(log.time))
    time = np.arange(log.time[0], log.time[-1] + 0.5 * dt, dt)
    angle, torque, external = (
        np.interp(time, log.time, each) for each in (log.q, log.torque, log.outside)
    )
    resolution = encoder_step(angle)
    noise = max(resolution / np.sqrt(12.0), white_noise(angle), 1e-12)
    return EvenLog(log, dt, time, angle, torque + external, external, resolution, noise)


def encoder_step(angle: np.ndarray) -> float:
    """Estimate the resolution of an angle: the change of which all small changes are multiples; 0 if there is none."""
    changes = np.abs(np.diff(angle))
    changes = changes[changes > 1e-9 * max(1.0, np.abs(angle).max())]
    if len(changes) < 5:
        return 0.0
    single = changes < 1.2 * np.percentile(changes, 1)
    if single.mean() < 0.002:
        return 0.0
    ratios = changes / changes[single].mean()
    small = ratios[ratios < 30.0]
    off = np.median(np.abs(small - np.round(small)))
    return changes[single].mean() if len(small) > 5 and off < 0.05 else 0.0


def white_noise(signal: np.ndarray) -> float:
    """Estimate the standard deviation of the white noise of a signal from its third differences."""
    third = np.diff(signal, 3)
    return np.median(np.abs(third)) * NORMAL / np.sqrt(20.0)


def derivatives(
    log: EvenLog, width: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the smoothed angle, speed and acceleration.

    Kernels have exact moments: a tail cut at 5 widths would leak 3e-7 q/dt^2 into the acceleration, which looks like
    gravity at 2 kHz.
    """
    from scipy.ndimage import correlate1d

    samples = width / log.dt
    half = int(REACH * samples + 1.0)
    x = np.arange(-half, half + 1)
    mean = np.exp(-0.5 * (x / samples) ** 2)
    mean /= mean.sum()
    slope = x * mean / (mean @ x**2) / log.dt
    bend = (x**2 - mean @ x**2) * mean
    bend *= 2.0 / (bend @ x**2) / log.dt**2
    first = log.angle[0]
    angle, speed, acceleration = (
        correlate1d(log.angle - first, each, mode="nearest")
        for each in (mean, slope, bend)
    )
    return angle + first, speed, acceleration


def kernel_width(logs: Sequence[EvenLog]) -> float:
    """Choose the shortest kernel whose noise is small beside the motion's speed and acceleration [s]."""
    coarse = [derivatives(log, max(0.03, 2.0 * log.dt)) for log in logs]
    speed, acceleration = (
        np.concatenate([each[k] for each in coarse]).std() for k in (1, 2)
    )
    slowest = max(log.dt for log in logs)
    width = max(
        1.5 * slowest, 3e-3, min(0.02 * speed / max(acceleration, 1e-300), WIDEST)
    )
    power = float(np.mean([log.power for log in logs]))
    while width < WIDEST:
        found = [derivatives(log, width) for log in logs]
        moved, bent = (
            np.mean([2.0 * np.median(np.abs(each[k])) ** 2 for each in found])
            for k in (1, 2)
        )
        quiet = smoothed_noise(power, width, 1) < NOISY_SPEED * moved
        if quiet and smoothed_noise(power, width, 2) < ATTENUATED * bent:
            break
        width *= 1.2
    return width


def smoothed_noise(power: float, width: float, order: int) -> float:
    """Compute the variance of white noise behind the kernel, or behind its first or second derivative.

    `power` is the variance of a sample times the sampling time.
    """
    return (
        (0.5, 0.25, 0.375)[order] * power / (np.sqrt(np.pi) * width ** (2 * order + 1))
    )


class Scales(NamedTuple):
    """Limits of what logs can show through a kernel."""

    width: float
    """Standard deviation of the kernel [s]."""
    noisy: float
    """Speed below which the kernel for slow motion takes over [rad/s]."""
    slow_width: float
    """Standard deviation of the kernel for slow motion [s]."""
    slow: float
    """Speed below which the direction of motion is not sure [rad/s]."""


def scales(logs: Sequence[EvenLog], width: float) -> Scales:
    """Compute the limits of logs: three standard deviations of the speed, or a fifth of an encoder step each width.

    A Gaussian keeps the instant at which a steadily accelerated joint turns round, so the speed of slow motion may go
    through a wider kernel, whose noise is smaller.
    """
    power = float(np.mean([log.power for log in logs]))
    resolution = max(log.resolution for log in logs)

    def sure(width: float) -> float:
        return float(
            max(
                3.0 * np.sqrt(smoothed_noise(power, width, 1)),
                0.2 * resolution / width,
                1e-9,
            )
        )

    speed, acceleration = (
        np.concatenate([derivatives(log, width)[k] for log in logs]).var()
        for k in (1, 2)
    )
    moved = max(acceleration - smoothed_noise(power, width, 2), 1e-300)
    slow_width = float(
        np.clip(SLOW_SHARE * np.sqrt(speed / moved), width, SLOW_FACTOR * width)
    )
    return Scales(width, sure(width), slow_width, sure(slow_width))


@dataclass(frozen=True)
class Rows:
    """Smoothed motion and torque of one log, `PER_WIDTH` rows for each width of the kernel."""

    even: EvenLog
    """Log on its grid."""
    spacing: float
    """Time between two rows [s]."""
    blur: float
    """Width of the kernel in rows."""
    time: np.ndarray
    """Times of the rows [s], `[R]`."""
    angle: np.ndarray
    """Angle [rad], `[R]`."""
    speed: np.ndarray
    """Speed [rad/s], of slow motion through the wider kernel, `[R]`."""
    acceleration: np.ndarray
    """Acceleration [rad/s^2], `[R]`."""
    external: np.ndarray
    """Known torque of all else but gravity [N m], `[R]`."""
    direction: np.ndarray
    """Direction of the motion, -1 to 1: linear in the speed below the one that is sure, `[R]`."""
    torque: np.ndarray
    """Smoothed torque on the log's grid [N m]."""
    fitted: np.ndarray
    """Indices of the rows that are fitted, `[F]`."""
    reversing: np.ndarray
    """1 for fitted rows near a reversal, whose errors are larger, 0 for others, `[F]`."""
    block: np.ndarray
    """Number of the block of each fitted row, `[F]`."""

    def smoothed(self, columns: np.ndarray) -> np.ndarray:
        """Smooth columns of all rows as the torque was, `[R, ...]`."""
        from scipy.ndimage import correlate1d

        return correlate1d(columns, self.weights, axis=0, mode="nearest")

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights of the kernel over rows, two zeros at either end, `[W]`."""
        half = int(4.0 * self.blur + 0.5)
        found = np.pad(np.exp(-0.5 * (np.arange(-half, half + 1) / self.blur) ** 2), 2)
        return found / found.sum()

    @cached_property
    def sloping(self) -> np.ndarray:
        """Slope of the weights over time, `[W]`."""
        return np.gradient(self.weights, self.spacing)

    @cached_property
    def linear(self) -> np.ndarray:
        """Smoothed speed, its size, and sine and cosine of the angle, `[4, R]`."""
        columns = [
            self.speed,
            np.abs(self.speed),
            np.sin(self.angle),
            np.cos(self.angle),
        ]
        return np.array([self.smoothed(each) for each in columns])

    def low_passed(self, values: np.ndarray, time_constant: float) -> np.ndarray:
        """Filter values at all rows by a low pass of first order, as a drive filters its torque, `[R]`."""
        if time_constant <= 1e-5:
            return values
        path = np.full(len(values), self.spacing / time_constant)
        path[0] = np.inf
        means = 0.5 * (values + np.append(values[0], values[:-1]))
        return follow_path(means[:, None], path)[:, 0]

    def measured(self, delay: float) -> np.ndarray:
        """Return the torque of the fitted rows, read later by a delay [s], `[F]` [N m]."""
        return np.interp(self.time[self.fitted] + delay, self.even.time, self.torque)

    @cached_property
    def path(self) -> np.ndarray:
        """Distance [rad] from the row before, `[R]`."""
        return np.abs(np.diff(self.angle, prepend=self.angle[0]))

    @property
    def reversals(self) -> np.ndarray:
        """Indices of the rows at which the joint turns round."""
        turns = np.flatnonzero(np.diff(np.sign(self.speed)))
        return turns[(turns > 5) & (turns < len(self.speed) - 5)]


def rows_of(log: EvenLog, limits: Scales) -> Rows:
    """Smooth a log, and choose the rows that are fitted: not at its ends, and not where the joint stands."""
    from scipy.ndimage import gaussian_filter1d

    width = limits.width
    torque, external = (
        gaussian_filter1d(each, width / log.dt, mode="nearest", truncate=REACH)
        for each in (log.torque, log.external)
    )
    spacing = max(width / PER_WIDTH, log.dt)
    time = np.arange(log.time[0], log.time[-1], spacing)
    angle, speed, acceleration = derivatives(log, width)
    slow_speed = derivatives(log, limits.slow_width)[1]
    sharp = np.clip(np.abs(speed) / limits.noisy - 1.0, 0.0, 1.0)
    speed = slow_speed + sharp * (speed - slow_speed)
    columns = (angle, speed, acceleration, external)
    angle, speed, acceleration, external = (
        np.interp(time, log.time, each) for each in columns
    )
    margin = max(REACH * width, 3.0 * limits.slow_width) + np.abs(DELAYS).max()
    usable = (time > time[0] + margin) & (time < time[-1] - margin)
    usable &= np.arange(len(time)) % PER_WIDTH == 0
    for first, last in runs(np.abs(speed) < limits.slow):
        if (last - first) * spacing > STANDS:
            usable[first:last] = False
    fitted = np.flatnonzero(usable)
    blur = width / spacing
    turns = np.diff(np.sign(speed), append=np.sign(speed[-1])) != 0.0
    near = (
        gaussian_filter1d(turns.astype(float), blur, mode="nearest", truncate=4)
        > 1e-4 / blur
    )
    block = ((time - time[0]) / BLOCK).astype(int)
    return Rows(
        log, spacing, blur, time, angle, speed, acceleration, external, np.clip(speed / limits.slow, -1.0, 1.0), torque,
        fitted, near[fitted].astype(int), block[fitted],
    )  # fmt: skip
