"""Decimation of long logs: windows of consecutive samples that differ most, and the motion between them in few steps.

The model steps through all motion, as bristles remember it: through every sample of a window, and between windows in
steps with the mean twist, which get shorter towards the next window. Bristles forget exponentially over the distance
that they slide, so they enter the window as after every sample.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planarfriction.identify.logs import Log
from planarfriction.identify.sensor_errors import LONGEST, TINY, jitter

WINDOW = 200
"""Least number of samples of a window."""

GROWTH = 1.03
"""Ratio of the distances from a window at which steps before it begin: wrenches in a
window are then off by 3e-4 of the largest at most (by 2e-2 with a ratio of 1.15)."""

LEVELS = 600
"""Number of distances from a window at which steps begin: they span a factor of 5e7, down to a part of the deflection
of a bristle."""

LEAST_SPEED = 1e-3
"""Speed below which windows count as alike, as a share of the largest speed."""

NOISE = 3.0
"""Standard deviations of the noise of a speed below which nothing moves."""


class Gap(NamedTuple):
    """Motion between two windows in G steps."""

    twist: np.ndarray
    """Mean twists [m/s, m/s, rad/s], `[G, 3]`."""
    load: np.ndarray
    """Mean loads [N], `[G]`; 0 in a step with a sample without load."""
    dt: np.ndarray
    """Durations [s], `[G]`."""
    error: np.ndarray
    """Noise of the mean twists over that of a sample [-], `[G]`."""

    def until(self, time: float, twist: np.ndarray) -> Gap:
        """Return the gap without its last `time` [s], which have this `twist` `[3]`."""
        left = self.dt[-1] - time
        mean = (self.twist[-1] * self.dt[-1] - twist * time) / left
        return self._replace(
            twist=np.vstack([self.twist[:-1], mean]), dt=np.append(self.dt[:-1], left)
        )


@dataclass(frozen=True, eq=False)
class DecimatedLog(Log):
    """Log of which only windows are left."""

    parts: tuple[Log, ...] = ()
    """Windows, each with samples before and after it that the delay of a rig may ask for."""
    gaps: tuple[Gap, ...] = ()
    """Motion between one window and the next."""
    inner: Any = ()
    """Places of the samples that are fitted."""
    total: int = 0
    """Number of samples of the whole log."""


def decimated(logs: Sequence[Log], size: float, most: int) -> tuple[Log, ...]:
    """Return the logs if they have `most` samples or fewer, else windows of them with about as many.

    `size` is the length that turns spin into speed [m]. Each log keeps one window at least.
    """
    total = sum(len(log.time) for log in logs)
    if total <= most:
        return tuple(logs)
    result = []
    for log in logs:
        count = max(most * len(log.time) // total // WINDOW, 1)
        blocks = len(log.time) // WINDOW
        if blocks > count:
            edges = np.arange(blocks + 1) * len(log.time) // blocks
            log = _decimated(log, size, edges, count)
        result.append(log)
    return tuple(result)


def samples_of(logs: Sequence[Log]) -> tuple[int, int]:
    """Return the number of samples that are fitted, and the number of all."""
    used = sum(len(log.inner) for log in logs)
    return used, sum(getattr(log, "total", len(log.time)) for log in logs)


def redrawn(log: Log, noise: np.ndarray, random: np.random.Generator) -> Log:
    """Return the log with `noise` `[3]` of a sample's twist drawn again between its windows, if it has any."""
    if not isinstance(log, DecimatedLog):
        return log
    gaps = []
    for gap in log.gaps:
        error = gap.error[:, None] * noise * random.standard_normal(gap.twist.shape)
        gaps.append(gap._replace(twist=gap.twist + error))
    return dataclasses.replace(log, gaps=tuple(gaps))


def _decimated(log: Log, size: float, edges: np.ndarray, count: int) -> DecimatedLog:
    """Return `count` of the windows of a log between rows `edges`."""
    still = NOISE * jitter(log.twist)
    moving = np.where(np.abs(log.twist) > still, np.abs(log.twist), 0.0)
    speed = moving @ [1.0, 1.0, size]
    path = np.append(0.0, np.cumsum(speed[1:] * np.diff(log.time)))
    chosen = farthest(features(log, edges, still), count)
    around = min(int(np.ceil(LONGEST / log.interval)), WINDOW // 2)
    fitted, near = np.zeros((2, len(log.time)), dtype=bool)
    for first, last in zip(edges[chosen], edges[chosen + 1], strict=True):
        fitted[first:last] = near[max(first - around, 0) : last + around] = True
    stepped = np.flatnonzero(near)
    spans = np.split(stepped, np.flatnonzero(np.diff(stepped) > 1) + 1)

    def cut(rows: np.ndarray, kind: type[Any] = Log, **more: Any) -> Any:
        names = ("time", "twist", "wrench", "normal_force")
        columns = {name: getattr(log, name)[rows] for name in names}
        return kind(**columns, name=log.name, held=log.held, **more)

    gaps = [_gap(log, path, a[-1], b[0]) for a, b in itertools.pairwise(spans)]
    return cut(
        stepped,
        DecimatedLog,
        turns=log.turns,
        parts=tuple(map(cut, spans)),
        gaps=tuple(gaps),
        inner=np.flatnonzero(fitted[stepped]),
        total=len(log.time),
    )


def features(log: Log, edges: np.ndarray, still: np.ndarray) -> np.ndarray:
    """Compute what tells windows between rows `edges` apart, `[B, 15]` with values of about one.

    These are the largest twist in either direction on a scale that is logarithmic above the speeds `still` `[3]`, the
    least and the largest load, mean and spread of the wrench, and the place in time: a slip of one sample shows.
    """
    starts = edges[:-1]
    lengths = np.diff(edges)
    columns = [starts / edges[-1]]
    for values, noise in zip(log.twist.T, still, strict=True):
        largest = max(np.abs(values).max(), TINY)
        least = max(noise, LEAST_SPEED * largest)
        for end in (np.minimum, np.maximum):
            scaled = np.arcsinh(end.reduceat(values, starts) / least)
            columns.append(scaled / np.arcsinh(largest / least))
    load = log.normal_force / max(log.normal_force.max(), TINY)
    columns += [end.reduceat(load, starts) for end in (np.minimum, np.maximum)]
    for values in log.wrench.T:
        largest = max(np.abs(values).max(), TINY)
        mean, square = (
            np.add.reduceat((values / largest) ** power, starts) / lengths
            for power in (1, 2)
        )
        columns += [mean, np.sqrt(np.maximum(square - mean**2, 0.0))]
    return np.stack(columns, -1)


def farthest(points: np.ndarray, count: int) -> np.ndarray:
    """Choose `count` points `[B, D]`, the first, then each the farthest from those chosen; returns sorted places.

    No point is left farther from a chosen one than chosen ones are from each other (Gonzalez 1985).
    """
    chosen = [0]
    distance = np.full(len(points), np.inf)
    while len(chosen) < count:
        new = ((points - points[chosen[-1]]) ** 2).sum(axis=1)
        distance = np.minimum(distance, new)
        chosen.append(int(np.argmax(distance)))
    return np.unique(chosen)


def _gap(log: Log, path: np.ndarray, first: int, last: int) -> Gap:
    """Return the motion from row `first` to row `last` in steps that begin at `GROWTH`-fold distances from `last`.

    Distances are those along the `path` `[T]` [m], and rows; a hold before a window or after one is apart.
    """
    shares = GROWTH ** -np.arange(LEVELS)
    time, twist, load, own = (
        values[first : last + 1]
        for values in (log.time, log.twist, log.normal_force, path)
    )
    marks = np.append(own[-1] - (own[-1] - own[0]) * shares, own[0])
    by_path = np.searchsorted(own, marks, "right") - 1
    hold = np.searchsorted(own, own[-1])
    by_row = last - first - np.round((last - first) * shares).astype(int)
    rows = np.concatenate([by_path, by_row, [hold, last - first]])
    rows = np.unique(np.maximum(rows, 0))
    at = rows[:-1]
    steps = np.diff(time)
    since = twist[1:] if log.held else 0.5 * (twist[1:] + twist[:-1])
    dt = np.diff(time[rows])
    mean = np.add.reduceat(since * steps[:, None], at, axis=0) / dt[:, None]
    loads = np.add.reduceat(0.5 * (load[1:] + load[:-1]) * steps, at) / dt
    loads = np.where(np.minimum.reduceat(load[1:], at) > 0.0, loads, 0.0)
    return Gap(mean, loads, dt, 1.0 / np.sqrt(np.diff(rows)))
