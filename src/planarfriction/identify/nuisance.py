"""Disturbances that a rig adds to a wrench: a delay, zeros that are wrong and drift, a load cell that drifts.

    y(t) = (1 + scale + sum_k drift_k P_k(u)) W(t - delay) + bias + zero_drift u,    u from -1 to 1 over the log,

with Legendre polynomials `P_k`. All of it is estimated along with the parameters of the contact, each held loosely at
zero, so that what looks like friction in the data shows as a wider interval of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.identify.logs import Log

GROUPS = ("delay", "bias", "load", "twist")
"""What can be switched off: delay, zeros of the channels, scale and drift of the load cell, noise of the twist."""

CHANNELS = (("fx", "N"), ("fy", "N"), ("tau", "N m"))

DELAY, LONGEST = 0.01, 0.05
"""Spread of delays that is taken for granted, and the longest that is tried [s]."""

BIAS, ZERO_DRIFT = 0.1, 0.05
"""Spreads of the zeros and of their drift, as shares of the largest value of the channel."""

LEAST = 1e-3
"""Share of the largest force that either of its channels counts as, also where it stays at 0."""

DRIFT = (0.05, 0.02, 0.02)
"""Spreads of the drift of the load cell by degree [-]; its first is half of the change over the log."""

SCALE = 0.005
"""Spread of the scale of a calibrated load cell [-]."""

EDGE = 1.5
"""Where a load cell drifts nobody knows when it was right: half its range counts as so many spreads of the scale."""


@dataclass(frozen=True)
class Nuisance:
    """One quantity of the rig that was estimated along with the contact."""

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


@dataclass(frozen=True)
class _Column:
    name: str
    unit: str
    log: int | None
    width: float
    """Spread that is taken for granted [unit]."""


class Rig:
    """The nuisance parameters of logs, K of them, in the order of `columns`."""

    def __init__(self, logs: Sequence[Log], groups: Sequence[str]):
        self.logs, self.groups = logs, tuple(groups)
        columns = []
        if "delay" in groups:
            columns.append(_Column("delay", "s", None, DELAY))
        if "load" in groups:
            columns.append(_Column("load_scale", "-", None, SCALE))
        for i, log in enumerate(logs):
            largest = np.abs(log.wrench).max(axis=0)
            largest[:2] = np.maximum(largest[:2], LEAST * largest[:2].max())
            for k, (channel, unit) in enumerate(CHANNELS):
                if "bias" in groups and log.channels[k]:
                    columns.append(_Column(f"bias_{channel}", unit, i, BIAS * largest[k]))
                    columns.append(_Column(f"zero_drift_{channel}", unit, i, ZERO_DRIFT * largest[k]))
            if "load" in groups:
                names = ["load_drift", *(f"load_drift_{k}" for k in range(2, len(DRIFT) + 1))]
                columns += [_Column(name, "-", i, width) for name, width in zip(names, DRIFT, strict=True)]
        self.columns = tuple(columns)
        self.widths = np.array([each.width for each in columns])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the values over their widths."""
        edge = np.array([LONGEST / DELAY if each.name == "delay" else np.inf for each in self.columns])
        return -edge, edge

    def delay(self, values: np.ndarray) -> float:
        """The delay [s] among the values `[K]`."""
        return float(values[0]) if "delay" in self.groups else 0.0

    def added(
        self, i: int, values: np.ndarray, wrench: np.ndarray, later: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What log i shows of a wrench `[T, 3]`: that, the factor `[T]` on it, and derivatives `[T, 3, K]`.

        `later`: derivative of the wrench by the delay.
        """
        u = self._course(i)
        slopes, factor, added = np.zeros((*wrench.shape, len(self.columns))), np.ones(len(u)), np.zeros(wrench.shape)
        shapes = self._shapes(u)
        for j, column in enumerate(self.columns):
            if column.log not in (None, i) or column.name == "delay":
                continue
            if column.name in shapes:
                factor = factor + values[j] * shapes[column.name]
                slopes[:, :, j] = shapes[column.name][:, None] * wrench
            else:
                k = [channel for channel, _ in CHANNELS].index(column.name.rsplit("_", 1)[1])
                slopes[:, k, j] = u if column.name.startswith("zero") else 1.0
                added[:, k] += values[j] * slopes[:, k, j]
        if "delay" in self.groups:
            slopes[:, :, 0] = factor[:, None] * later
        return factor[:, None] * wrench + added, factor, slopes

    def range_of_drift(self, values: np.ndarray) -> float:
        """Half of what the factor of the load cell changes over a log [-], of the log where it changes most."""
        most = 0.0
        for i in range(len(self.logs)):
            shapes = self._shapes(self._course(i))
            here = [(v, c) for v, c in zip(values, self.columns, strict=True) if c.log == i and c.name in shapes]
            if here:
                most = max(most, 0.5 * float(np.ptp(sum(v * shapes[c.name] for v, c in here))))
        return most

    def with_drift(self, values: np.ndarray) -> np.ndarray:
        """Widths `[K]` that know that the load cell drifts."""
        widths = self.widths.copy()
        for j, column in enumerate(self.columns):
            if column.name == "load_scale":
                widths[j] = np.hypot(SCALE, self.range_of_drift(values) / EDGE)
        return widths

    def strain(self, values: np.ndarray) -> float:
        """How many times its width the scale of the load cell was moved: friction does not show it."""
        at = [j for j, column in enumerate(self.columns) if column.name == "load_scale"]
        return float(np.abs(values / self.with_drift(values))[at].max(initial=0.0))

    def found(self, values: np.ndarray, errors: np.ndarray) -> tuple[Nuisance, ...]:
        """The estimates with their errors, as records."""
        several = len(self.logs) > 1
        return tuple(
            Nuisance(c.name, c.unit, float(v), float(e), self.logs[c.log].name if several and c.log is not None else "")
            for c, v, e in zip(self.columns, values, errors, strict=True)
        )

    def _course(self, i: int) -> np.ndarray:
        time = self.logs[i].time
        return 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0

    @staticmethod
    def _shapes(u: np.ndarray) -> dict[str, np.ndarray]:
        """Courses of the factor over a log by name."""
        return {
            "load_scale": np.ones_like(u),
            "load_drift": u,
            "load_drift_2": 0.5 * (3.0 * u**2 - 1.0),
            "load_drift_3": 0.5 * (5.0 * u**3 - 3.0 * u),
        }


def check_groups(nuisance: Any) -> tuple[str, ...]:
    """The groups that are on, each one of `GROUPS`."""
    return tuple(dict.fromkeys(validation.choices("nuisance", nuisance, GROUPS)))
