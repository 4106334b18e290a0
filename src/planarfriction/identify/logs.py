"""Logs of measurements: the motion of a contact and its friction wrench over time, from arrays or a CSV file."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Kept
from planarfriction._support.reading import Table
from planarfriction.errors import FileError, InvalidValueError, shown
from planarfriction.geometry import rotate
from planarfriction.scenes import Solution

TWIST = ("vx", "vy", "omega")
"""Names of the columns of a twist."""

MOTION = ("x", "y", "theta")
"""Names of the columns of a pose."""

WRENCH = ("fx", "fy", "tau")
"""Names of the columns of a wrench."""

LOAD = ("normal_force",)
"""Name of the column of the load, as a tuple."""

ALIASES = {
    "time": "t",
    "time_s": "t",
    "t_s": "t",
    "wz": "omega",
    "fn": "normal_force",
    "fz": "normal_force",
    "mz": "tau",
    "tz": "tau",
    "force": "fx",
    "velocity": "vx",
    "position": "x",
    "torque": "tau",
    "angle": "theta",
}
"""Other names of columns, in small letters."""

MESSAGES = {
    "force.x": "fx",
    "force.y": "fy",
    "force.z": "normal_force",
    "torque.z": "tau",
    "linear.x": "vx",
    "linear.y": "vy",
    "angular.z": "omega",
    "position.x": "x",
    "position.y": "y",
}
"""Names of columns by the names of fields of ROS messages, without their prefix, such as wrench in wrench.force.x."""

_DEGREE = np.pi / 180.0

_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}

_SPEEDS = {f"{unit}/s": factor for unit, factor in _LENGTHS.items()}

_FORCES = {"n": 1.0, "mn": 1e-3, "kn": 1e3}

_TORQUES = {
    f"{force}{between}{length}": per_newton * per_metre
    for force, per_newton in _FORCES.items()
    for between in ("", "*", ".", "·")
    for length, per_metre in _LENGTHS.items()
}

UNITS: Mapping[str, Mapping[str, float]] = {
    "t": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9},
    "vx": _SPEEDS,
    "vy": _SPEEDS,
    "omega": {"rad/s": 1.0, "1/s": 1.0, "deg/s": _DEGREE, "°/s": _DEGREE},
    "x": _LENGTHS,
    "y": _LENGTHS,
    "theta": {"rad": 1.0, "deg": _DEGREE, "degrees": _DEGREE, "°": _DEGREE},
    "fx": _FORCES,
    "fy": _FORCES,
    "normal_force": _FORCES,
    "tau": _TORQUES,
}
"""Units in brackets behind a name, or below it, in small letters and without spaces, and their values in SI units."""

_MESSAGE = re.compile(r"(?:.*[./_])?(force|torque|linear|angular|position)[./_]([xyz])")
"""Pattern of the name of a field of a ROS message."""

_HEADING = re.compile(r"(?P<name>[^\[(]*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?")
"""Pattern of a heading: a name, and a unit in brackets."""


def find_columns(
    path: Path, headings: Sequence[str], *, contact: str | None, with_load: bool
) -> dict[str, str]:
    """Find the heading of each column of a log: `t`, twist or else motion, wrench, and normal force if it is there.

    An angle beside a twist is found too: it shows if the twist is a mean (see `Log.held`). Names are read without
    regard to case and may carry a unit in brackets; `ALIASES` are known. If columns are named "contact.vx", those of
    `contact` are taken, or of the only contact that has them all.

    Raises FileError for a column that is missing, that is there twice, or that has an unknown unit.
    """
    named = _named(path, headings)
    contacts = sorted({name.rpartition(".")[0] for name in named} - {""})
    lacks = {each: _missing(named, each, with_load) for each in ("", *contacts)}
    if contact is None:
        whole = [each for each in contacts if not lacks[each]]
        if lacks[""] and len(whole) > 1:
            raise FileError(
                f"{path}: has the contacts {shown(', '.join(whole))}: choose one of them"
            )
        # If all lack something, the message is about the nearest.
        contact = min(lacks, key=lambda each: len(lacks[each]))
    elif not contacts:
        raise FileError(
            f"{path}: contact must be left out: no column is named as pad.vx, got {shown(repr(contact))}"
        )
    else:
        try:
            validation.choice("contact", contact, contacts)
        except InvalidValueError as error:
            raise FileError(f"{path}: {error}") from None
    if lacks[contact]:
        raise FileError(
            f"{path}: has no column {', '.join(lacks[contact])}; found {shown(', '.join(headings))}; needed t, "
            f"{', '.join(TWIST)} (or {', '.join(MOTION)}), {', '.join((*WRENCH, *LOAD))}"
        )
    own = _of_contact(named, contact)
    wanted = [name for name in ("t", *_measured(own), *LOAD) if name in own]
    found = {name: own[name] for name in wanted}
    for name, heading in found.items():
        if _si_value(name, heading) is None:
            usual = {"n": "N", "nm": "N m"}
            first = next(iter(UNITS[name]))
            raise FileError(
                f"{path}: column {shown(repr(heading))} must be in {usual.get(first, first)} or a multiple of it, "
                f"got {shown(_parts(heading)[1])}"
            )
    angle = own.get("theta") or named.get("theta")
    if angle is not None and _si_value("theta", angle) is not None:
        found.setdefault("theta", angle)
    return found


def _named(path: Path, headings: Sequence[str]) -> dict[str, str]:
    """Map names of columns to headings; an alias counts only where the name itself is missing."""
    named: dict[str, str] = {}
    for heading in headings:
        name = _column_name(_parts(heading)[0])
        if name in named:
            raise FileError(
                f"{path}: columns {shown(repr(named[name]))} and {shown(repr(heading))} are the same"
            )
        if name:
            named[name] = heading
    for name in list(named):
        prefix, dot, last = name.rpartition(".")
        if last in ALIASES:
            named.setdefault(prefix + dot + ALIASES[last], named[name])
    return named


def _column_name(heading: str) -> str:
    """Return the name of a column without its unit: "contact.vx" with a small vx, or that of a message's number."""
    message = _MESSAGE.fullmatch(heading.lower())
    if message is not None and ".".join(message.groups()) in MESSAGES:
        return MESSAGES[".".join(message.groups())]
    prefix, dot, name = heading.rpartition(".")
    return prefix + dot + name.lower()


def _parts(heading: str) -> tuple[str, str | None]:
    """Split a heading such as "vx [m/s]" into name and unit."""
    match = _HEADING.fullmatch(heading)
    return (heading, None) if match is None else (match["name"].strip(), match["unit"])


def _si_value(name: str, heading: str) -> float | None:
    """Return the SI value of the unit in the heading of a column; 1 without a unit, None for one that is not known."""
    unit = _parts(heading)[1]
    if unit is None:
        return 1.0
    return UNITS[name].get(unit.lower().replace(" ", ""))


def _of_contact(named: dict[str, str], contact: str) -> dict[str, str]:
    """Return the headings of one contact by the names of their columns, and that of the times, which all share."""
    prefix = f"{contact}." if contact else ""
    own = {
        name.removeprefix(prefix): named[name]
        for name in named
        if name.startswith(prefix)
    }
    return {"t": named["t"], **own} if "t" in named else own


def _measured(named: Collection[str]) -> Sequence[str]:
    """Return the names of the columns of motion and wrench that a file should have: of one axis, if it has no other."""
    there = {*TWIST, *MOTION, *WRENCH}.intersection(named)
    for speed, place, wrench in zip(TWIST, MOTION, WRENCH, strict=True):
        if wrench in there and there <= {speed, place, wrench} and len(there) > 1:
            return (speed if speed in there else place), wrench
    placed = {*MOTION} <= there and not {*TWIST} <= there
    return *(MOTION if placed else TWIST), *WRENCH


def _missing(named: dict[str, str], contact: str, with_load: bool) -> list[str]:
    own = _of_contact(named, contact)
    wanted = ("t", *_measured(own), *(LOAD if with_load else ()))
    return [name for name in wanted if name not in own]


Arrays = Sequence[np.ndarray]
"""Several arrays, such as one of each log or slide."""

Linear = tuple[np.ndarray, np.ndarray]
"""Values and their derivatives."""

LEAST_SAMPLES = 10
"""Least number of samples of a log."""

EVEN = 1e-3
"""Largest distance of a sample from an even grid of times, as a share of the sampling time: time stamps are rounded."""

MEAN = 1e-3
"""Largest error of an angle that is summed from means, as a share of that of the trapezoidal rule."""

LEVER = 1e-9
"""Torque over force [m] up to which the torque is rounding, force over torque [1/m] or the largest force up to which a
force is: no contact and no offset is as small as a nanometre."""

AT_ONCE = 50_000
"""Number of samples that are differentiated together."""

TWO_LOADS = 1.2
"""Ratio of loads above which logs show if the stiffness grows with the load."""

TURN = 2.0 * np.pi
"""One turn [rad]."""

QUARTER = 0.5 * np.pi
"""Largest step of an angle, or change of its step, between two samples that shows the
turns [rad]."""

ROUNDED = 1e-3
"""Excess of the range of a wrapped angle over one turn that is put down to rounding
[turns]."""

NEIGHBOURS = 3
"""Number of steps on either side with which a step is compared."""


@dataclass(frozen=True, eq=False)
class Log(ByValue):
    """Twist and friction wrench of one contact over time, T samples.

    Twist and wrench are about the origin of the contact frame, in its axes; the wrench acts on the moving body, so
    friction points against the motion.

    Raises InvalidValueError for fewer than ten samples, wrong shapes, numbers that are not finite, times that do not
    increase, negative normal forces, and a `name`, `turns` or `held` of another kind.
    """

    time: Kept[ArrayLike, np.ndarray]
    """Sample times [s], `[T]`."""
    twist: Kept[ArrayLike, np.ndarray]
    """`(vx, vy, omega)` [m/s, m/s, rad/s], `[T, 3]`."""
    wrench: Kept[ArrayLike, np.ndarray]
    """`(fx, fy, tau)` [N, N, N m], `[T, 3]`."""
    normal_force: Kept[ArrayLike, np.ndarray]
    """Normal force [N], `[T]`, or one number for all samples."""
    name: str = "log"
    """Name for messages and plots."""
    turns: int = 0
    """Number of whole-turn jumps that were removed from the measured angle."""
    held: bool = False
    """True if the twist of a sample is the mean since the one before: held by a controller, or differences of poses.
    Files and simulations show it by their angle, so only where the contact turns."""

    def __post_init__(self) -> None:
        validation.instance("name", self.name, str, "a text")
        validation.instance("held", self.held, bool, "True or False")
        validation.count("turns", self.turns, at_least=0)
        time = increasing(self.time, f"time of {self.name}", LEAST_SAMPLES)
        twist = validation.array("twist", self.twist, (len(time), 3))
        wrench = validation.array("wrench", self.wrench, (len(time), 3))
        load = validation.numbers("normal_force", self.normal_force)
        load = np.broadcast_to(load, len(time)) if load.ndim == 0 else load
        if (load <= 0.0).all() and (load < 0.0).any():
            rule = "be >= 0; negate it if the sensor counts pressure as negative"
            raise InvalidValueError(
                "normal_force", rule, f"{load.min():.3g} to {load.max():.3g} N"
            )
        load = validation.non_negative_array("normal_force", load, (len(time),))
        self._set(time=time, twist=twist, wrench=wrench, normal_force=load)
        for value in (time, twist, wrench, load):
            value.setflags(write=False)

    @property
    def channels(self) -> np.ndarray:
        """Mask `[3]` of the measured ones of fx, fy, tau: a channel that is always 0, up to rounding, was not."""
        largest = np.abs(self.wrench).max(axis=0)
        return largest > LEVER * largest.max()

    @property
    def interval(self) -> float:
        """Median time between two samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def even(self) -> bool:
        """True if the samples are evenly spaced in time."""
        grid = np.linspace(self.time[0], self.time[-1], len(self.time))
        return bool(np.abs(self.time - grid).max() <= EVEN * self.interval)

    @property
    def parts(self) -> tuple[Log, ...]:
        """Parts with consecutive samples: the whole log, unless it was decimated."""
        return (self,)

    @property
    def inner(self) -> Any:
        """Places of the samples that are fitted: all, unless the log was decimated."""
        return np.arange(len(self.time))

    @property
    def durations(self) -> np.ndarray:
        """Times since the sample before, `[T]` [s]; 0 where there is none."""
        return np.concatenate(
            [np.diff(part.time, prepend=part.time[0]) for part in self.parts]
        )

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
        """Make a log from poses instead of twists: `motion` is x, y, theta `[T, 3]` of the contact frame [m, m, rad].

        The pose is that of the contact frame in the world, the wrench is in the axes of the contact frame; the twist is
        obtained with `differentiated` and rotated into these axes. Jumps of theta by a full rotation, as from a tracker
        that limits it to one turn, are removed first and counted in `turns`; other jumps are refused.

        Raises InvalidValueError for such jumps, wrong shapes and times that do not grow.
        """
        validation.instance("name", name, str, "a text")
        time = increasing(time)
        motion = validation.array("motion", motion, (len(time), 3))
        motion[:, 2], turns = unwrapped(time, motion[:, 2], f"theta of {name}")
        twist = differentiated(time, motion, window=window)
        return cls(time, twist, wrench, normal_force, name, turns)

    @classmethod
    def from_axis(
        cls,
        time: ArrayLike,
        force: ArrayLike,
        normal_force: ArrayLike,
        *,
        velocity: ArrayLike | None = None,
        position: ArrayLike | None = None,
        axis: str = "x",
        window: int = 7,
        name: str = "log",
    ) -> Log:
        """Make a log of one coordinate: a slide with a force gauge, or with `axis="theta"` a joint with a torque.

        `force` `[T]` is the friction on the moving body [N, or N m], against the motion: minus the force of a gauge.
        `velocity` `[T]` [m/s or rad/s] is used as it is; `position` `[T]` [m or rad] is differentiated over `window`
        samples. The other coordinates stay at 0 and take no part in a fit.

        Raises InvalidValueError unless one of the two is given, for wrong shapes, and for times that do not increase.
        """
        place = MOTION.index(validation.choice("axis", axis, MOTION))
        if (velocity is None) == (position is None):
            raise InvalidValueError(
                "velocity", "be given, or position, and not both", "both or neither"
            )
        time = increasing(time)
        motion, wrench = np.zeros((2, len(time), 3))
        moved = ("velocity", velocity) if position is None else ("position", position)
        motion[:, place] = validation.array(*moved, (len(time),))
        wrench[:, place] = validation.array("force", force, (len(time),))
        if position is None:
            return cls(time, motion, wrench, normal_force, name)
        return cls.from_motion(
            time, motion, wrench, normal_force, window=window, name=name
        )

    @classmethod
    def from_csv(
        cls,
        path: str | Path,
        *,
        normal_force: float | None = None,
        window: int = 7,
        contact: str | None = None,
    ) -> Log:
        """Read a log from a CSV file with a heading: columns t, vx, vy, omega (or x, y, theta), fx, fy, tau,
        normal_force [SI]. A file of one coordinate has only t, vx (or x) and fx, or `velocity` (or `position`) and
        `force`, or omega (or theta) and tau: the others are 0, as in `from_axis`.

        Other columns and lines that begin with # are ignored, but for a theta of numbers beside the twist, which shows
        if that is `held`. `time` and `fn` are accepted for t and normal_force, capital letters for small ones, and
        semicolons and tabs for commas; Fz, Mz, Tz and the names of ROS (wrench.force.x) too. Units in brackets behind
        names or below them, such as `Time (ms)`, `vx [mm/s]` or `tau [N mm]`, are converted. `normal_force` [N]
        replaces a missing column of that name; `window` is that of `from_motion`. If columns are named `contact.vx`,
        as in the files of `planarfriction run`, those of `contact` are read, or those of the only contact.

        Raises FileError, in one line that names the line and the column of what is wrong, and InvalidValueError for a
        wrong argument, used or not.
        """
        path = validation.path("path", path)
        contact = None if contact is None else validation.text("contact", contact)
        window = validation.count("window", window, at_least=3)
        if normal_force is not None:
            normal_force = validation.non_negative("normal_force", normal_force)
        table = Table(path)
        found = find_columns(
            path, table.names, contact=contact, with_load=normal_force is None
        )
        motion = MOTION if found.keys().isdisjoint(TWIST) else TWIST
        spare = [found["theta"]] if motion is TWIST and "theta" in found else []
        values = table.numbers(list(found.values()), spare)
        factors = [_si_value(*each) for each in found.items()]
        columns = {
            name: value if factor == 1.0 else factor * value
            for name, factor, value in zip(found, factors, values.T, strict=True)
        }
        zeros = np.zeros(len(values))
        moved, wrench = (
            np.stack([columns.get(name, zeros) for name in names], -1)
            for names in (motion, WRENCH)
        )
        loads: Any = columns.get("normal_force", normal_force)
        try:
            time = columns["t"]
            if motion is MOTION:
                return cls.from_motion(
                    time, moved, wrench, loads, window=window, name=path.stem
                )
            held = {"theta", "omega"} <= found.keys() and is_mean(
                time, columns["omega"], columns["theta"]
            )
            return cls(time, moved, wrench, loads, path.stem, held=held)
        except InvalidValueError as error:
            raise FileError(f"{path}: {error}") from None

    @classmethod
    def from_solution(cls, solution: Solution, contact: str | None = None) -> Log:
        """Make the log that ideal sensors would record of one contact of a simulation.

        `contact` is a name; None takes the only contact. The wrench is that of one of `count` identical contacts.

        Raises InvalidValueError for a contact that does not exist, FileError for a solution without its scene.
        """
        if not isinstance(solution, Solution):
            raise InvalidValueError(
                "solution", "be a Solution", type(solution).__name__
            )
        twist = solution.contact_twist(contact)
        index = solution.contact_index(contact)
        names = ("time", *WRENCH, *LOAD)
        time, *contacts = (solution.histories[name].values for name in names)
        *wrench, load = (each[:, index] for each in contacts)
        name = f"{solution.scene.name}, {solution.scene.contacts[index].name}"
        held = is_mean(time, twist[:, 2], solution.data["theta"].values)
        return cls(time, twist, np.stack(wrench, -1), load, name, held=held)


def as_tuple(name: str, value: Any, kind: type) -> tuple[Any, ...]:
    """Return one record of a kind or several as a tuple, or raise InvalidValueError."""
    result = (value,)
    if not isinstance(value, kind):
        result = tuple(value) if isinstance(value, Sequence) else ()
    if not result or not all(isinstance(each, kind) for each in result):
        raise InvalidValueError(name, f"be a {kind.__name__} or a list of them", value)
    return result


def load_ratio(logs: Sequence[Log]) -> float:
    """Return the largest load over the least, of which no log has 5 % of its samples beyond."""
    spans = np.array([np.quantile(loads(log), (0.05, 0.95)) for log in logs])
    return spans[:, 1].max() / spans[:, 0].min()


def mean_load(log: Log) -> float:
    """Return the mean of the loads > 0 of a log [N], or raise InvalidValueError."""
    return loads(log).mean()


def loads(log: Log) -> np.ndarray:
    """Return the loads > 0 of a log [N], or raise InvalidValueError if there is none."""
    found = log.normal_force[log.normal_force > 0.0]
    if not len(found):
        raise InvalidValueError(
            f"normal_force of {log.name}", "be > 0 somewhere", "0 everywhere"
        )
    return found


def differentiated(
    time: ArrayLike, motion: ArrayLike, *, window: int = 7
) -> np.ndarray:
    """Compute the twist `[T, 3]` of a frame, in its axes, from poses x, y, theta `[T, 3]` [m, m, rad] over time [s].

    The twist is the slope of a parabola through `window` samples. Jumps of theta by full rotations are removed first.

    Raises InvalidValueError for times that do not increase and for other jumps of theta.
    """
    time = increasing(time)
    motion = validation.array("motion", motion, (len(time), 3))
    motion[:, 2] = unwrapped(time, motion[:, 2])[0]
    window = validation.count("window", window, at_least=3)
    if len(time) < window:
        raise InvalidValueError(
            "motion", f"hold at least window={window} samples", f"{len(time)}"
        )
    return rotate(slopes(time, motion, window), -motion[:, 2])


def slopes(time: np.ndarray, values: np.ndarray, window: int = 7) -> np.ndarray:
    """Compute the slopes of parabolas through `window` samples of `values` `[T, C]` at each of the times `[T]`."""
    found = np.empty_like(values)
    for begin in range(0, len(time), AT_ONCE):
        rows = np.arange(begin, min(begin + AT_ONCE, len(time)))[:, None]
        first = np.clip(rows - window // 2, 0, len(time) - window)
        around = first + np.arange(window)
        since = time[around] - time[rows]
        scale = np.abs(since).max(axis=1, keepdims=True)
        powers = (since / scale)[..., None] ** np.arange(3)
        across = powers.swapaxes(1, 2)
        inverse = np.linalg.pinv(across @ powers, hermitian=True) @ across
        parabolas = inverse @ (values[around] - values[rows])
        found[rows[:, 0]] = parabolas[:, 1] / scale
    return found


def increasing(time: ArrayLike, name: str = "time", at_least: int = 0) -> np.ndarray:
    """Return increasing times `[T]`, `at_least` as many, or raise InvalidValueError."""
    result = validation.array("time", time, (None,))
    if len(result) < at_least:
        raise InvalidValueError(
            name, f"hold at least {at_least} samples", f"{len(result)}"
        )
    falls = np.flatnonzero(np.diff(result) <= 0.0).tolist()
    if falls:
        before, after = result[falls[0] : falls[0] + 2].tolist()
        raise InvalidValueError(
            name, "increase", f"{after} after {before} s in sample {falls[0] + 2}"
        )
    return result


def runs(mask: np.ndarray) -> np.ndarray:
    """Return the first index of each run of True, and the first behind it, `[N, 2]`."""
    return np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0)).reshape(-1, 2)


def is_mean(time: np.ndarray, omega: np.ndarray, angle: np.ndarray) -> bool:
    """Return True if each `omega` `[T]` is the mean since the sample before, and not the spin at its own instant.

    The angle `[T]` may be wrapped to one turn; samples of it that are not known (NaN) are left out.
    """
    steps = np.diff(time)
    turned = np.diff(angle)
    of_mean = turned - steps * omega[1:]
    of_ends = turned - 0.5 * steps * (omega[1:] + omega[:-1])
    known = np.isfinite(turned)
    missed, usual = (
        np.abs(each - TURN * np.round(each / TURN))[known].max(initial=0.0)
        for each in (of_mean, of_ends)
    )
    return bool(missed < MEAN * usual)


def columns_of(log: Log) -> Mapping[str, np.ndarray]:
    """Return the columns of a log by the names that `Log.from_csv` reads."""
    columns = (log.time, *log.twist.T, *log.wrench.T, log.normal_force)
    return dict(zip(("t", *TWIST, *WRENCH, *LOAD), columns, strict=True))


# ---------------------------------------------------------------------- angles


def unwrapped(
    time: np.ndarray, angle: np.ndarray, name: str = "theta"
) -> tuple[np.ndarray, int]:
    """Remove the jumps by full rotations from an angle `[T]` [rad]; returns the angle and the number of jumps.

    An angle whose range exceeds a turn was not wrapped and stays as it is.

    Raises InvalidValueError for a jump that no full rotation explains, and where a wrapped angle rotates by more than a
    quarter of a turn between two samples, so that its direction is unknown.
    """
    if len(angle) < 2:
        return angle, 0
    measured = np.diff(angle)
    turns = np.round(measured / TURN)
    wrapped = turns.any() and np.ptp(angle) <= (1.0 + ROUNDED) * TURN
    turns = turns * wrapped
    steps = measured - TURN * turns
    mode = "reflect" if len(steps) > NEIGHBOURS else "edge"
    padded = np.pad(steps, NEIGHBOURS, mode=mode)
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBOURS + 1)
    jump = np.abs(steps - np.median(around, axis=1)) > QUARTER
    fast = wrapped & (np.abs(steps) > QUARTER)
    slower = "rotate by less than 90 degrees between samples, or be unwrapped"
    for where, shown_steps, rule in (
        (jump, measured, "only jump by full rotations"),
        (fast, steps, slower),
    ):
        if where.any():
            i = np.argmax(where)
            raise InvalidValueError(
                f"{name} [rad]",
                rule,
                f"a step of {shown_steps[i]:.3g} at t = {time[i + 1]:g} s",
            )
    return angle - TURN * np.append(0.0, np.cumsum(turns)), int(np.count_nonzero(turns))
