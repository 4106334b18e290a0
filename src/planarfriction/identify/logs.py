"""Logs of measurements: the motion of a contact and its friction wrench over time, from arrays or a CSV file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.equality import ByValue
from planarfriction.errors import FileError, InvalidValueError
from planarfriction.identify.angles import unwrapped
from planarfriction.identify.columns import MOTION, TWIST, WRENCH, find_columns
from planarfriction.reading import Table
from planarfriction.scenes import Solution

LEAST_SAMPLES = 10
"""Fewer samples say nothing about a law."""

EVEN = 1e-3
"""Samples whose times stray from an even grid by at most this share of the sampling time lie on it: rounded stamps."""


LEVER = 1e-9
"""Torque over force [m] up to which the torque is rounding: a nanometre is no size of a contact, nor off any centre."""


@dataclass(frozen=True, eq=False)
class Log(ByValue):
    """Twist and friction wrench of one contact over time, T samples.

    Twist and wrench are about the origin of the contact frame, in its axes; the wrench acts on the moving body, so
    friction points against the motion.

    Raises InvalidValueError for fewer than ten samples, wrong shapes, numbers that are not finite, times that do not
    increase, and negative normal forces.
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
    turns: int = 0
    """Number of whole-turn jumps that were removed from the measured angle."""

    if TYPE_CHECKING:  # what is given may be more than what is kept

        def __init__(
            self,
            time: ArrayLike,
            twist: ArrayLike,
            wrench: ArrayLike,
            normal_force: ArrayLike,
            name: str = "log",
            turns: int = 0,
        ) -> None: ...

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
    def channels(self) -> np.ndarray:
        """Which of fx, fy, tau were measured, `[3]` of bool; a tau that is always 0, up to rounding, was not."""
        largest = np.abs(self.wrench).max(axis=0)
        return np.array([True, True, bool(largest[2] > LEVER * largest[:2].max())])

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
    def from_motion(
        cls,
        time: ArrayLike,
        motion: ArrayLike,
        wrench: ArrayLike,
        normal_force: ArrayLike,
        *,
        window: int = 7,
        name: str = "log",
    ) -> Log:
        """Make a log from measured poses instead of twists: `motion` is x, y, theta `[T, 3]` of the contact frame [m,
        rad].

        The pose is that of the contact frame in the world, the wrench is in the axes of the contact frame; the twist is
        obtained with `differentiated` and rotated into these axes. Jumps of theta by a whole turn, as from a tracker
        that limits it to one turn, are removed first and counted in `turns`; other jumps are refused.

        Raises InvalidValueError for such jumps, wrong shapes and times that do not grow.
        """
        time, motion = _checked_motion(time, motion)
        motion[:, 2], turns = unwrapped(time, motion[:, 2], f"theta of {name}")
        return cls(time, differentiated(time, motion, window=window), wrench, normal_force, name, turns)

    @classmethod
    def from_csv(
        cls, path: str | Path, *, normal_force: float | None = None, window: int = 7, contact: str | None = None
    ) -> Log:
        """Read a log from a CSV file with a heading: columns t, vx, vy, omega (or x, y, theta), fx, fy, tau,
        normal_force [SI].

        Other columns and lines that begin with # are ignored. `time` and `fn` are accepted for t and normal_force,
        capital letters for small ones, and semicolons and tabs for commas. `normal_force` [N] replaces a missing column
        of that name; `window` is that of `from_motion`. If columns are named `contact.vx`, as in the files of
        `planarfriction run`, those of `contact` are read, or those of the only contact.

        Raises FileError, in one line that names the line and the column of what is wrong.
        """
        path = validation.path("path", path)
        contact = None if contact is None else validation.text("contact", contact)
        table = Table(path)
        found = find_columns(path, table.names, contact=contact, with_load=normal_force is None)
        columns = dict(zip(found, table.numbers(list(found.values())).T, strict=True))
        motion = TWIST if "vx" in found else MOTION
        moved, wrench = (np.stack([columns[name] for name in names], -1) for names in (motion, WRENCH))
        loads = columns.get("normal_force")
        if loads is None:
            loads = np.array(validation.non_negative("normal_force", normal_force))
        try:
            if motion is TWIST:
                return cls(columns["t"], moved, wrench, loads, path.stem)
            return cls.from_motion(columns["t"], moved, wrench, loads, window=window, name=path.stem)
        except InvalidValueError as error:
            raise FileError(f"{path}: {error}") from None

    @classmethod
    def from_solution(cls, solution: Solution, contact: str | None = None) -> Log:
        """Make a log of one contact of a simulation: what ideal sensors would have measured.

        `contact` is a name; None takes the only contact. The wrench is that of one of `count` identical contacts.

        Raises InvalidValueError for a contact that does not exist, FileError for a solution without its scene.
        """
        if not isinstance(solution, Solution):
            raise InvalidValueError("solution", "be a Solution", type(solution).__name__)
        twist, index = solution.contact_twist(contact), solution.contact_index(contact)
        columns = {name: np.asarray(solution.histories[name].values) for name in ("time", *WRENCH, "normal_force")}
        wrench = np.stack([columns[name][:, index] for name in WRENCH], -1)
        name = f"{solution.scene.name}, {solution.scene.contacts[index].name}"
        return cls(columns["time"], twist, wrench, columns["normal_force"][:, index], name)


def as_logs(log: Log | Sequence[Log]) -> tuple[Log, ...]:
    """One log or several as a tuple."""
    logs = (log,) if isinstance(log, Log) else tuple(log) if isinstance(log, Sequence) else ()
    if not logs or not all(isinstance(each, Log) for each in logs):
        raise InvalidValueError("log", "be a Log or a list of them", log)
    return logs


def differentiated(time: ArrayLike, motion: ArrayLike, *, window: int = 7) -> np.ndarray:
    """Twist `[T, 3]` in the axes of a moving frame, from its pose x, y, theta `[T, 3]` [m, m, rad] at `time` `[T]` [s].

    The slope of a parabola through `window` neighbouring samples (fewer at the ends). Jumps of theta by whole turns are
    removed first.

    Raises InvalidValueError for times that do not increase and for other jumps of theta.
    """
    time, motion = _checked_motion(time, motion)
    motion[:, 2], _ = unwrapped(time, motion[:, 2])
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


def _checked_motion(time, motion) -> tuple[np.ndarray, np.ndarray]:
    """Times `[T]` that increase, and a copy of the poses `[T, 3]`."""
    time = validation.array("time", time, (None,))
    if not (np.diff(time) > 0.0).all():
        row = int(np.argmax(np.diff(time) <= 0.0)) + 1
        raise InvalidValueError("time", "increase", f"{time[row]:g} after {time[row - 1]:g} s")
    return time, validation.array("motion", motion, (len(time), 3))


def columns_of(log: Log) -> Mapping[str, np.ndarray]:
    """The columns of a log as `Log.from_csv` reads them."""
    names = ("t", *TWIST, *WRENCH, "normal_force")
    return dict(zip(names, [log.time, *log.twist.T, *log.wrench.T, log.normal_force], strict=True))
