"""Signals: loads, forces and velocities as sampled data, so that a scene can be stored, hashed and compiled."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Kept
from planarfriction._support.reading import Section, Table
from planarfriction.errors import InvalidValueError, shown

Hold = Literal["previous", "linear"]

SAME_TIME = 1e-12
"""Times closer than this [s] count as one: far below any step, far above the rounding of `i * dt`."""


MOST_SAMPLES = 10_000_000
"""Largest number of samples of a signal or a recording: a gigabyte for one contact."""


def breaks_between(times: np.ndarray, t_end: float) -> np.ndarray:
    """Return 0, the different `times` [s] in between, and `t_end`; those within rounding of each other count as one."""
    if not len(times):
        return np.array([0.0, t_end])
    inner = np.unique(times)
    inner = inner[(inner > SAME_TIME) & (inner < t_end - SAME_TIME)]
    inner = inner[np.diff(inner, prepend=0.0) > SAME_TIME]
    return np.concatenate([[0.0], inner, [t_end]])


def sample_count(span: float, step: float, name: str) -> int:
    """Return the number of steps of `step` [s] in `span` [s]; raise if they would need too much memory."""
    # So that the end itself is kept in spite of rounding.
    count = span / step * (1.0 + 1e-12)
    if count > MOST_SAMPLES:
        rule = f"be at least {span / MOST_SAMPLES:.3g} s (at most {MOST_SAMPLES} samples up to t_end, {span:g} s)"
        raise InvalidValueError(name, rule, step)
    return int(count)


def sample_times(t_end: float, dt: float = 0.01) -> np.ndarray:
    """Return the times `i * dt` [s] from 0 to the last one not after `t_end`; no rounding accumulates."""
    t_end = validation.non_negative("t_end", t_end)
    dt = validation.positive("dt", dt)
    # 1e-9 keeps t_end itself despite rounding.
    return np.arange(sample_count(t_end + 1e-9 * dt, dt, "dt") + 1) * dt


@dataclass(frozen=True, eq=False, repr=False)
class Signal(ByValue):
    """A sampled function of time, `[T]` or `[T, k]` values; constant before the first sample and after the last.

    With `hold="previous"` each value is held until the next sample, with `hold="linear"` the samples are joined by
    straight lines. Signals are immutable and compare by content.

    Raises InvalidValueError if times do not increase, values are not finite or shapes do not match.
    """

    times: Kept[ArrayLike, np.ndarray]
    """Sample times [s], shape `[T]`, strictly increasing."""
    values: Kept[ArrayLike, np.ndarray]
    """Sample values, shape `[T]` or `[T, k]`."""
    hold: Hold = "previous"
    """Course between the samples: "previous" or "linear"."""

    def __post_init__(self) -> None:
        times = validation.array("times", self.times, (None,))
        values = validation.numbers("values", self.values)
        values = validation.array(
            "values", values, (None,) * (2 if values.ndim == 2 else 1), largest=np.inf
        )
        if times.size == 0:
            rule = "have at least one sample"
            raise InvalidValueError("times", rule, "an empty array")
        if len(values) != len(times):
            rule = f"have one row per time ({len(times)})"
            raise InvalidValueError("values", rule, f"shape {list(values.shape)}")
        steps = np.diff(times)
        if (steps <= 0.0).any():
            i = int(np.argmax(steps <= 0.0))
            kind = "a duplicate" if steps[i] == 0.0 else "unsorted"
            given = f"{times[i]:.15g} s, then {times[i + 1]:.15g} s at index {i + 1} ({kind})"
            raise InvalidValueError("times", "increase", given)
        validation.choice("hold", self.hold, ("previous", "linear"))
        times.setflags(write=False)
        values.setflags(write=False)
        self._set(times=times, values=values)

    @classmethod
    def sampled(
        cls, times: ArrayLike, values: ArrayLike, hold: Hold = "previous"
    ) -> Signal:
        """Return a signal from samples: `times` [s] of shape `[T]`, `values` of shape `[T]` or `[T, k]`."""
        return cls(times, values, hold)

    @classmethod
    def constant(cls, value: ArrayLike) -> Signal:
        """Return a signal that never changes; `value` is a number or a vector `[k]`.

        Raises InvalidValueError for anything else.
        """
        value = validation.finite_numbers("value", value, largest=np.inf)
        if value.ndim > 1:
            raise InvalidValueError(
                "value", "be a number or a vector", f"shape {list(value.shape)}"
            )
        return cls(np.zeros(1), value[None])

    @classmethod
    def sine(
        cls,
        offset: float,
        amplitude: float,
        frequency: float,
        *,
        t_end: float,
        dt: float = 0.01,
        phase: float = 0.0,
    ) -> Signal:
        """Return the signal `offset + amplitude sin(2 pi frequency t + phase)`, held over every `dt` [s] up to `t_end`.

        `frequency` is in Hz, `phase` in rad.

        Raises InvalidValueError for a parameter that breaks its rule.
        """
        offset = validation.number("offset", offset)
        amplitude = validation.number("amplitude", amplitude)
        frequency = validation.non_negative("frequency", frequency)
        phase = validation.number("phase", phase)
        times = sample_times(t_end, dt)
        return cls(
            times, offset + amplitude * np.sin(2.0 * np.pi * frequency * times + phase)
        )

    @classmethod
    def from_csv(
        cls,
        path: str | Path,
        *,
        time: str = "time",
        value: str | Sequence[str] = "value",
        hold: Hold = "previous",
    ) -> Signal:
        """Return a signal from a CSV file with a header: `time` names the column of times, `value` one or several.

        Lines that start with # are comments. Raises FileError for a missing file, a missing column or text among the
        numbers, and InvalidValueError as the constructor does.
        """
        validation.path("path", path)
        validation.text("time", time)
        names = [value] if isinstance(value, str) else value
        texts = isinstance(names, (list, tuple)) and len(names) > 0
        if not texts or not all(isinstance(name, str) for name in names):
            raise InvalidValueError(
                "value", "be the name of a column, or a list of names", value
            )
        table = Table(path).numbers([time, *names])
        values = table[:, 1] if isinstance(value, str) else table[:, 1:]
        try:
            return cls(table[:, 0], values, hold)
        except InvalidValueError as error:
            raise InvalidValueError(
                f"{path}: {error.name}", error.rule, error.value
            ) from None

    def held(self, dt: float) -> Signal:
        """Return the signal as a digital controller sees it: sampled every `dt` [s] from the first time on, and held.

        Raises InvalidValueError for a `dt` that is not > 0, or that makes too many samples.
        """
        times = self.times[0] + sample_times(self.times[-1] - self.times[0], dt)
        return Signal(times, self(times))

    def __call__(self, t: ArrayLike) -> np.ndarray:
        """Return the value at the times `t` [s] (any shape); at a jump the value that begins there."""
        return self._value(t, "right")

    def left(self, t: ArrayLike) -> np.ndarray:
        """Return the value just before the times `t` [s] (any shape); at a jump, the value before the jump.

        Raises InvalidValueError for times that are not finite.
        """
        return self._value(t, "left")

    @property
    def columns(self) -> int | None:
        """Number of columns k of a vector signal, None for a scalar one."""
        return self.values.shape[1] if self.values.ndim == 2 else None

    @functools.cached_property
    def breaks(self) -> np.ndarray:
        """Increasing times [s] at which the value jumps or the slope changes; samples that change nothing are none."""
        if len(self.times) == 1:
            return self.times[1:]
        if self.hold == "previous":
            change = np.diff(self.values, axis=0, prepend=self.values[:1])
        else:
            before = np.concatenate([np.zeros_like(self.values[:1]), self._slopes[:-1]])
            change = self._slopes - before
        found = self.times[(change != 0.0).reshape(len(self.times), -1).any(axis=1)]
        found.setflags(write=False)
        return found

    def pieces(self, breaks: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return the linear pieces of the signal between `breaks` `[S + 1]` [s]: values at their starts, and slopes.

        On piece s the signal is `start[s] + slope[s] (t - breaks[s])`; both have shape `[S]` or `[S, k]`, and the slope
        of a held signal is exactly 0. Raises InvalidValueError if the signal breaks inside a piece.
        """
        breaks = validation.array("breaks", breaks, (None,))
        if len(breaks) < 2 or (np.diff(breaks) <= 0.0).any():
            raise InvalidValueError(
                "breaks", "be at least two increasing times", f"{breaks}"
            )
        if len(self.times) == 1:
            start = np.repeat(self.values, len(breaks) - 1, axis=0)
            return start, np.zeros_like(start)
        own = self.breaks
        piece = np.searchsorted(breaks, own, side="right") - 1
        inside = (piece >= 0) & (piece < len(breaks) - 1)
        begin = breaks[piece[inside]]
        end = breaks[piece[inside] + 1]
        inside[inside] = np.minimum(own[inside] - begin, end - own[inside]) > SAME_TIME
        if inside.any():
            raise InvalidValueError(
                "breaks",
                "contain the breaks of the signal",
                f"none at t = {own[inside][0]:g} s",
            )
        # The middle of a piece finds its interval whatever rounding does to the ends.
        i = (
            np.searchsorted(self.times, 0.5 * (breaks[:-1] + breaks[1:]), side="right")
            - 1
        )
        return self._linear(i, breaks[:-1])

    def check_non_negative(self, name: str) -> None:
        """Check that the signal is never below zero. Raises InvalidValueError with `name`, time and value otherwise."""
        below = np.argwhere(self.values < 0.0)
        if len(below):
            i = int(below[0][0])
            value = float(self.values[tuple(below[0])])
            raise InvalidValueError(
                name, "be >= 0", f"{value!r} at t = {self.times[i]:g} s"
            )

    def to_dict(self) -> dict[str, Any]:
        """Return the signal as plain numbers, lists and strings."""
        return {
            "times": self.times.tolist(),
            "values": self.values.tolist(),
            "hold": self.hold,
        }

    @classmethod
    def from_dict(cls, data: Any, folder: str | Path | None = None) -> Signal:
        """Return a signal from a number, a list of numbers (constants) or a table as in scene files.

        Raises FileError if the table is not a signal, InvalidValueError if `folder` is not a path.
        """
        where = Section(
            {"signal": data},
            folder=None if folder is None else validation.path("folder", folder),
        )
        return read_signal(where, "signal")

    def __repr__(self) -> str:
        if len(self.times) == 1:
            return f"Signal.constant({self.values[0].tolist()})"
        columns = "" if self.columns is None else f" of {self.columns} values"
        span = f"{self.times[0]:g} to {self.times[-1]:g} s"
        return f"Signal({len(self.times)} samples{columns}, {span}, hold={self.hold!r})"

    @functools.cached_property
    def _slopes(self) -> np.ndarray:
        """Slope on the interval that begins at each sample; 0 after the last one."""
        if self.hold == "previous":
            return np.zeros_like(self.values)
        with np.errstate(over="ignore"):
            slopes = np.diff(self.values, axis=0) / self._spread(np.diff(self.times))
        steep = np.argwhere(~np.isfinite(slopes))[:, 0]
        if steep.size:
            between = " s, then ".join(
                f"{time:g}" for time in self.times[steep[0] : steep[0] + 2]
            )
            raise InvalidValueError(
                "times", "be far enough apart for a finite slope", f"{between} s"
            )
        return np.concatenate([slopes, np.zeros_like(self.values[:1])])

    def _spread(self, array: np.ndarray) -> np.ndarray:
        """Return `array` over time, ready to meet values `[..., k]`."""
        return array[..., None] if self.values.ndim == 2 else array

    def _value(self, t, side: Literal["left", "right"]) -> np.ndarray:
        t = validation.finite_numbers("t", t)
        # Continuous: both limits agree, and at a sample the sample itself is exact.
        if self.hold == "linear":
            side = "right"
        i = np.searchsorted(self.times, t, side=side) - 1
        return self._linear(i, t)[0]

    def _linear(self, i: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return values at `t` on the intervals that begin at samples i, -1 before the first, and slopes."""
        # Slope -1 is that after the last sample, 0 as before the first.
        slope = self._slopes[i]
        i = np.maximum(i, 0)
        return self.values[i] + slope * self._spread(t - self.times[i]), slope


def as_signal(name: str, value: Any, columns: int | None) -> Signal:
    """Return `value` as a signal with `columns` columns (None: scalar); numbers and vectors become constants."""
    wanted = f"have {columns} columns: be {columns} numbers, or a Signal of them"
    wanted = "be a number, or a Signal of numbers" if columns is None else wanted
    try:
        signal = value if isinstance(value, Signal) else Signal.constant(value)
    except InvalidValueError as error:
        rule = wanted if "array of numbers" in error.rule else error.rule
        raise InvalidValueError(name, rule, error.value) from None
    if signal.columns != columns:
        given = (
            "numbers" if signal.columns is None else f"rows of {signal.columns} numbers"
        )
        raise InvalidValueError(
            name, wanted, f"a Signal of {given}" if signal is value else value
        )
    # Alone it may have any, in a scene it moves something.
    validation.finite_numbers(name, signal.values)
    return signal


def read_signal(parent: Section, key: str) -> Signal:
    """Read the signal under `key` of a table: a number, a list of numbers (a constant vector) or one of three tables.

    `{times, values, hold, dt}`, `{csv, time, value, hold, dt}` with a path that starts from the scene file's folder, or
    `{sine = {offset, amplitude, frequency, t_end, dt, phase}}`. `dt` holds a signal over steps of `dt` (`Signal.held`).
    """
    data = parent.get(key)
    if not isinstance(data, dict):
        here = Section({}, parent.name_of(key), parent.source, parent.folder)
        if isinstance(data, (str, bool)):
            here.fail(
                f"must be a number, a list of numbers or a table, got {shown(validation.quoted(data))}"
            )
        with here.located():
            return Signal.constant(data)
    here = parent.section(key)
    with here.located():
        if "sine" in here:
            needed = ("offset", "amplitude", "frequency", "t_end")
            sine = here.only(["sine"]).section("sine").only([*needed, "dt", "phase"])
            for name in needed:
                sine.get(name)
            with sine.located():
                return Signal.sine(**sine.data)
        if "csv" in here:
            here.only(["csv", "time", "value", "hold", "dt"])
            signal = Signal.from_csv(
                here.path("csv"),
                time=here.get("time", "time"),
                value=here.get("value", "value"),
                hold=here.get("hold", "previous"),
            )
        else:
            others = () if "times" in here or "values" in here else ("csv", "sine")
            here.only(["times", "values", "hold", "dt", *others])
            signal = Signal.sampled(
                here.get("times"), here.get("values"), here.get("hold", "previous")
            )
        return signal.held(here.get("dt")) if "dt" in here else signal


def displacement(velocity: Signal, times) -> np.ndarray:
    """Return the exact integral `[T, k]` of a velocity `[k]` from 0 to `times` `[T]` [s], which are >= 0."""
    times = np.asarray(times, dtype=float)
    breaks = np.unique(np.concatenate([[0.0], velocity.breaks, times]))
    breaks = breaks[breaks >= 0.0]
    if len(breaks) == 1:
        return np.zeros((len(times), velocity.columns or 1))
    middle = 0.5 * (breaks[1:] + breaks[:-1])
    lengths = np.diff(breaks)  # linear in between: the middle is the mean
    way = np.cumsum(
        velocity(middle).reshape(len(middle), -1) * lengths[:, None], axis=0
    )
    return np.concatenate([np.zeros((1, way.shape[1])), way])[
        np.searchsorted(breaks, times)
    ]
