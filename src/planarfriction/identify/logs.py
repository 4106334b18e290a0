"""Logs of measurements: the motion of a contact and its friction wrench over time, from arrays or a CSV file."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planarfriction import validation
from planarfriction.errors import FileError, InvalidValueError

TWIST = ("vx", "vy", "omega")
MOTION = ("x", "y", "theta")
WRENCH = ("fx", "fy", "tau")

LEAST_SAMPLES = 10
"""Fewer samples say nothing about a law."""

EVEN = 1e-3
"""Samples whose times stray from an even grid by at most this share of the sampling time lie on it: rounded stamps."""


@dataclass(frozen=True, eq=False)
class Log:
    """Twist and friction wrench of one contact over time, T samples.

    Twist and wrench are about the origin of the contact frame, in its axes; the wrench acts on the moving body, so that
    friction points against the motion.

    Raises InvalidValueError for fewer than ten samples, wrong shapes, numbers that are not finite, times that do not
    increase and negative normal forces.
    """

    time: np.ndarray
    """Sample times [s], `[T]`."""
    twist: np.ndarray
    """`(vx, vy, omega)` [m/s, m/s, rad/s], `[T, 3]`."""
    wrench: np.ndarray
    """`(fx, fy, tau)` [N, N, N m], `[T, 3]`."""
    normal_force: np.ndarray
    """Normal force [N], `[T]`, or one number for all samples."""
    name: str = "log"
    """Name for messages and plots."""

    def __post_init__(self) -> None:
        time = validation.array("time", self.time, (None,))
        samples = len(time)
        if samples < LEAST_SAMPLES:
            raise InvalidValueError(f"time of {self.name}", f"hold at least {LEAST_SAMPLES} samples", f"{samples}")
        if not (np.diff(time) > 0.0).all():
            row = int(np.argmax(np.diff(time) <= 0.0)) + 1
            raise InvalidValueError(f"time of {self.name}", "increase", f"{time[row]:g} after {time[row - 1]:g} s")
        load = validation.numbers("normal_force", self.normal_force)
        values = {
            "time": time,
            "twist": validation.array("twist", self.twist, (samples, 3)),
            "wrench": validation.array("wrench", self.wrench, (samples, 3)),
            "normal_force": validation.non_negative_array(
                "normal_force", np.broadcast_to(load, samples) if load.ndim == 0 else load, (samples,)
            ),
        }
        for name, value in values.items():
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def interval(self) -> float:
        """Median time between two samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def even(self) -> bool:
        """Whether the samples are evenly spaced in time."""
        steps = np.arange(len(self.time)) * (self.time[-1] - self.time[0]) / (len(self.time) - 1)
        return bool(np.abs(self.time - self.time[0] - steps).max() <= EVEN * self.interval)

    @classmethod
    def from_motion(cls, time, motion, wrench, normal_force, *, window: int = 7, name: str = "log") -> Log:
        """Log whose motion was measured, not its twist: `motion` is x, y, theta `[T, 3]` of the contact frame [m, rad].

        The pose is that of the contact frame in the world, the wrench in the contact frame's axes; the twist is
        `differentiated` and turned into them.
        """
        return cls(time, differentiated(time, motion, window=window), wrench, normal_force, name)

    @classmethod
    def from_csv(cls, path: str | Path, *, normal_force: float | None = None, window: int = 7) -> Log:
        """Log of a CSV file with a heading: columns t, vx, vy, omega (or x, y, theta), fx, fy, tau, normal_force [SI].

        Other columns are ignored, lines that begin with # too. `normal_force` [N] stands in for a missing column of
        that name; `window` is that of `from_motion`.

        Raises FileError in one line with the line and the column of what is wrong.
        """
        path = Path(path)
        columns = read_columns(path)
        time = columns.get("t", columns.get("time"))
        if normal_force is not None and "normal_force" not in columns:
            columns["normal_force"] = np.array(float(normal_force))
        motion = TWIST if all(name in columns for name in TWIST) else MOTION
        missing = [name for name in (*motion, *WRENCH, "normal_force") if name not in columns]
        if time is None or missing:
            lacking = [*([] if time is not None else ["t"]), *missing]
            raise FileError(
                f"{path}: has no column {', '.join(lacking)}; a log has t, {', '.join(TWIST)} (or "
                f"{', '.join(MOTION)}), {', '.join(WRENCH)}, normal_force"
            )
        moved, wrench = (np.stack([columns[name] for name in names], -1) for names in (motion, WRENCH))
        try:
            if motion is TWIST:
                return cls(time, moved, wrench, columns["normal_force"], path.stem)
            return cls.from_motion(time, moved, wrench, columns["normal_force"], window=window, name=path.stem)
        except InvalidValueError as error:
            raise FileError(f"{path}: {error}") from None


def as_logs(log: Log | Sequence[Log]) -> tuple[Log, ...]:
    """One log or several as a tuple."""
    logs = (log,) if isinstance(log, Log) else tuple(log)
    if not logs or not all(isinstance(each, Log) for each in logs):
        raise InvalidValueError("log", "be a Log or a list of them", log)
    return logs


def differentiated(time, motion, *, window: int = 7) -> np.ndarray:
    """Twist `[T, 3]` in the moving frame's axes from its pose x, y, theta `[T, 3]` [m, m, rad] at `time` `[T]` [s].

    Slope of a parabola through `window` neighbouring samples (fewer at the ends); theta must be unwrapped.
    """
    time = validation.array("time", time, (None,))
    motion = validation.array("motion", motion, (len(time), 3))
    window = validation.count("window", window, at_least=3)
    if len(time) < window:
        raise InvalidValueError("motion", f"hold at least window={window} samples", f"{len(time)}")
    half, slopes = window // 2, np.empty_like(motion)
    for i in range(len(time)):
        first = min(max(i - half, 0), len(time) - window)
        since = time[first : first + window] - time[i]
        scale = np.abs(since).max()
        powers = np.vander(since / scale, 3, increasing=True)
        slopes[i] = np.linalg.lstsq(powers, motion[first : first + window], rcond=None)[0][1] / scale
    cos, sin = np.cos(motion[:, 2]), np.sin(motion[:, 2])
    return np.stack(
        [cos * slopes[:, 0] + sin * slopes[:, 1], cos * slopes[:, 1] - sin * slopes[:, 0], slopes[:, 2]], -1
    )


def read_columns(path: Path) -> dict[str, np.ndarray]:
    """Columns of numbers of a CSV file with a heading; raises FileError with line and column of what is no number."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return _columns(path, _rows(file))
    except FileNotFoundError:
        raise FileError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise FileError(f"{path}: cannot be read as a table: {reason}") from None


def _rows(file) -> list[tuple[int, list[str]]]:
    reader = csv.reader(file)
    return [
        (reader.line_num, row)
        for row in reader
        if any(entry.strip() for entry in row) and not row[0].lstrip().startswith("#")
    ]


def _columns(path: Path, rows: Sequence[tuple[int, list[str]]]) -> dict[str, np.ndarray]:
    if len(rows) < 2:
        raise FileError(f"{path}: holds no numbers (a heading and one line for each sample are needed)")
    names = [entry.strip() for entry in rows[0][1]]
    for name in names:
        if names.count(name) > 1:
            raise FileError(f"{path}: line {rows[0][0]} has two columns {name!r}")
    needed = [i for i, name in enumerate(names) if name in {"t", "time", *TWIST, *MOTION, *WRENCH, "normal_force"}]
    values = np.empty((len(rows) - 1, len(names)))
    for row, (line, entries) in zip(values, rows[1:], strict=True):
        if len(entries) != len(names):
            raise FileError(f"{path}: line {line} has {len(entries)} values, the heading has {len(names)}")
        for i in needed:
            row[i] = _number(path, line, names[i], entries[i])
    return {names[i]: values[:, i] for i in needed}


def _number(path: Path, line: int, column: str, entry: str) -> float:
    try:
        value = float(entry)
    except ValueError:
        raise FileError(f"{path}: line {line}, column {column}: {entry.strip()!r} is no number") from None
    if not math.isfinite(value):
        raise FileError(f"{path}: line {line}, column {column}: {entry.strip()!r} is not finite")
    return value


def columns_of(log: Log) -> Mapping[str, np.ndarray]:
    """The columns of a log as `Log.from_csv` reads them."""
    names = ("t", *TWIST, *WRENCH, "normal_force")
    return dict(zip(names, [log.time, *log.twist.T, *log.wrench.T, log.normal_force], strict=True))
