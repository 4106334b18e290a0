"""Logs of one joint, the servo that drives it, and the plant that it moves; radians, newton metres, volts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Checked, checked
from planarfriction._support.reading import Table
from planarfriction.errors import FileError, InvalidValueError, shown
from planarfriction.identify.logs import (
    LEAST_SAMPLES,
    as_tuple,
    increasing,
    runs,
    slopes,
    unwrapped,
)

GRAVITY = 9.81
"""Standard acceleration of gravity of the fits [m/s^2]."""

ALIASES = {
    "time": "t",
    "position": "q",
    "angle": "q",
    "theta": "q",
    "tau": "torque",
    "speed": "dq",
    "velocity": "dq",
    "omega": "dq",
    "tau_external": "external",
    "effort": "torque",
    "__time": "t",
    "time_s": "t",
    "t_s": "t",
    "timestamp": "t",
}
"""Other names of columns, in small letters."""

COLUMNS = {
    "torque": "Nm",
    "dq": "rad/s",
    "enabled": "",
    "goal": "rad",
    "duty": "",
    "voltage": "V",
    "supply": "V",
    "external": "Nm",
}
"""Columns beside t and q, with their units."""

UNITS = {"t": "s", "q": "rad", **COLUMNS}
"""Units of all columns."""

SLOW = 0.1
"""Time between samples [s] from which on it is taken for ms."""

TURNS = 2.0
"""Turns of a pendulum from which on its angle is taken for degrees."""

DEGREES = 20.0
"""Ratio of the swings of goal and angle from which on one of them is taken for degrees."""

OPPOSED = -0.5
"""Correlation of goal and angle below which one of them has the wrong sign."""

FROZEN = 0.3
"""Time [s] for which a sensor that does not change while the joint moves is taken for dead."""

MOVED = 0.05
"""Share of its swing that a joint has moved while its torque froze."""

SUDDEN = 0.2
"""Share of the largest speed at which a joint cannot come to rest between two samples."""


@dataclass(frozen=True)
class Drive(Checked):
    """Position servo: `V = duty (supply - sag |duty|)`, `duty = kp gain (goal - q)` within -1 and 1.

    Raises InvalidValueError for numbers that are not positive (`sag`: negative, or not below `supply`).
    """

    kp: float = checked(validation.positive)
    """Gain as it is set in the servo [-]."""
    supply: float = checked(validation.positive)
    """Voltage at no load [V]."""
    gain: float = checked(validation.positive, default=1.0)
    """Duty per angle at `kp = 1` [1/rad]."""
    sag: float = checked(validation.non_negative, default=0.0)
    """Voltage that is lost at full duty [V]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sag >= self.supply:
            raise InvalidValueError("sag", "be below supply", self.sag)

    def voltage(self, duty: ArrayLike) -> np.ndarray:
        """Compute the voltage [V] at a duty within -1 and 1.

        Raises InvalidValueError for numbers that are not finite.
        """
        duty = validation.finite_numbers("duty", duty)
        return duty * (self.supply - self.sag * np.abs(duty))

    def duty(self, error: ArrayLike) -> np.ndarray:
        """Compute the duty at an error `goal - q` [rad].

        Raises InvalidValueError for numbers that are not finite.
        """
        return np.clip(
            self.kp * self.gain * validation.finite_numbers("error", error), -1.0, 1.0
        )


@dataclass(frozen=True)
class Plant(Checked):
    """Inertia on a joint, or a pendulum; numbers that are None are estimated.

    `I = inertia + (mass + arm_mass/3) length^2`, torque `-(mass + arm_mass/2) g length sin(q - offset)`.

    Raises InvalidValueError for a negative mass, length or inertia, and for a pendulum without mass or length.
    """

    inertia: float | None = checked(validation.non_negative, default=None)
    """Moment of inertia besides mass and arm, such as that of rotor and gears [kg m^2]."""
    mass: float = checked(validation.non_negative, default=0.0)
    """Mass at the end of the arm [kg]; 0 for no pendulum."""
    length: float = checked(validation.non_negative, default=0.0)
    """Length of the arm [m]."""
    arm_mass: float | None = checked(validation.non_negative, default=None)
    """Mass of the arm, spread over its length [kg]."""
    offset: float | None = checked(validation.number, default=None)
    """Angle at which the pendulum hangs [rad]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.mass > 0.0) != (self.length > 0.0):
            raise InvalidValueError(
                "length", "be positive with a mass, and only then", self.length
            )
        if not self.mass:
            self._set(arm_mass=self.arm_mass or 0.0, offset=self.offset or 0.0)

    @property
    def moment(self) -> float:
        """Largest torque of gravity [N m]; an arm without a mass counts as weightless."""
        return (self.mass + 0.5 * (self.arm_mass or 0.0)) * GRAVITY * self.length

    @property
    def pendulum_inertia(self) -> float:
        """Moment of inertia of mass and arm about the joint [kg m^2]."""
        return (self.mass + (self.arm_mass or 0.0) / 3.0) * self.length**2


@dataclass(frozen=True, eq=False)
class JointLog(ByValue):
    """Motion of one joint over time, T samples, with its torque, its voltage, or the goal of its servo.

    Raises InvalidValueError for fewer than ten samples, wrong shapes, numbers that are not finite, times that do not
    increase, and a log without torque, voltage and goal, or with a goal and no drive.
    """

    time: np.ndarray
    """Sample times [s], `[T]`."""
    q: np.ndarray
    """Angle of the joint [rad], `[T]`."""
    torque: np.ndarray | None = None
    """Torque of the motor on the joint [N m], `[T]`."""
    dq: np.ndarray | None = None
    """Speed as the joint reports it [rad/s], `[T]`; it is only checked against q."""
    enabled: np.ndarray | None = None
    """1 while the drive is on, `[T]`; None: always."""
    goal: np.ndarray | None = None
    """Commanded angle [rad], `[T]`."""
    voltage: np.ndarray | None = None
    """Voltage of the motor [V], `[T]`."""
    external: np.ndarray | None = None
    """Known torque of all else on the joint but gravity [N m], `[T]`."""
    drive: Drive | None = None
    """Servo that follows the goal."""
    name: str = "joint"
    """Name for messages and plots."""
    turns: int = 0
    """Number of whole-turn jumps that were removed from the measured angle."""

    def __post_init__(self) -> None:
        validation.instance("name", self.name, str, "a text")
        validation.count("turns", self.turns, at_least=0)
        time = increasing(self.time, f"time of {self.name}", LEAST_SAMPLES)
        self._set(time=time)
        if np.asarray(self.enabled).dtype == bool:
            self._set(enabled=np.asarray(self.enabled, dtype=float))
        for each in ("q", *COLUMNS):
            value = getattr(self, each, None)
            if value is not None:
                self._set(**{each: validation.array(each, value, (len(time),))})
        q, turns = unwrapped(time, self.q, f"q of {self.name}")
        if turns and self.goal is not None:
            rule = "be unwrapped beside a goal: add full rotations so that it does not jump"
            raise InvalidValueError(
                f"q of {self.name}", rule, f"{turns} jumps by a full rotation"
            )
        self._set(q=q, turns=self.turns + turns)
        if self.drive is not None:
            validation.instance("drive", self.drive, Drive, "a Drive")
        if (
            self.torque is None
            and self.voltage is None
            and (self.goal is None or self.drive is None)
        ):
            raise InvalidValueError(
                self.name,
                "hold a torque, a voltage, or a goal with a drive",
                "none of them",
            )

    @cached_property
    def speed(self) -> np.ndarray:
        """Slope of a parabola through seven samples of q [rad/s], `[T]`."""
        return slopes(self.time, self.q[:, None])[:, 0]

    @cached_property
    def acceleration(self) -> np.ndarray:
        """Slope of the speed [rad/s^2], `[T]`."""
        return slopes(self.time, self.speed[:, None])[:, 0]

    @cached_property
    def on(self) -> np.ndarray:
        """Share of the drive that is on, 1 or 0, `[T]`."""
        if self.enabled is None:
            return np.ones(len(self.time))
        return (self.enabled > 0.5).astype(float)

    @cached_property
    def outside(self) -> np.ndarray:
        """Known torque of all else [N m], 0 where none is given, `[T]`."""
        return np.zeros(len(self.time)) if self.external is None else self.external

    @cached_property
    def motion(self) -> np.ndarray:
        """Measured q and its slope [rad, rad/s], `[T, 2]`."""
        return np.column_stack([self.q, self.speed])

    @cached_property
    def volts(self) -> np.ndarray:
        """Voltage of the motor [V], 0 while the drive is off, `[T]`: measured, or that of the servo at the measured q.

        Raises InvalidValueError for a log with a torque only.
        """
        if self.voltage is not None:
            return self.on * self.voltage
        if self.goal is None or self.drive is None:
            raise InvalidValueError(
                self.name, "hold a voltage, or a goal with a drive", "neither"
            )
        return self.on * self.drive.voltage(self.drive.duty(self.goal - self.q))

    @classmethod
    def from_csv(cls, path: str | Path, *, drive: Drive | None = None) -> JointLog:
        """Read a log from a CSV file with a heading: t [s], q [rad], and any of torque [N m], dq [rad/s], enabled,
        goal [rad], voltage [V], external [N m]; without a voltage, duty and supply [V] together make it.

        Other columns are ignored; position, angle and theta are accepted for q, speed, velocity and omega for dq, tau
        for torque. A `drive` makes the goal count, and a voltage is then not read.

        Raises FileError in one line for what is wrong in the file.
        """
        path = validation.path("path", path)
        table = Table(path)
        headings: dict[str, str] = {}
        for heading in table.names:
            word, *unit = re.split(r"[\[(]", heading.lower())
            name = ALIASES.get(word.strip(), word.strip())
            if name in UNITS and name in headings:
                raise FileError(
                    f"{path}: columns {headings[name]!r} and {heading!r} are both {name}: keep one of them"
                )
            headings[name] = heading
            wanted = UNITS.get(name, "")
            if unit and wanted and re.sub(r"[^a-z/]", "", unit[0]) != wanted.lower():
                raise FileError(
                    f"{path}: {name} must be in {wanted}, got the column {heading!r}"
                )
        if missing := [each for each in ("t", "q") if each not in headings]:
            spaced = (
                " (cells must be separated by commas)" if len(table.names) == 1 else ""
            )
            found = f"found {shown(', '.join(table.names))}{spaced}"
            raise FileError(
                f"{path}: no column {missing[0]}; {found}; needed t, q, and torque, voltage or goal"
            )
        names = ["t", "q", *(each for each in COLUMNS if each in headings)]
        flags = [headings["enabled"]] if "enabled" in headings else []
        columns = table.numbers([headings[each] for each in names], flags=flags).T
        read: dict[str, Any] = dict(zip(names, columns, strict=True))
        read["time"] = read.pop("t")
        duty = read.pop("duty", None)
        supply = read.pop("supply", None)
        if duty is not None and supply is not None and "voltage" not in read:
            read["voltage"] = duty * supply
        if drive is not None and "goal" in read:
            read.pop("voltage", None)
        try:
            return cls(**read, drive=drive, name=path.stem)
        except InvalidValueError as error:
            raise FileError(f"{path}: {error}") from None


def as_joint_logs(
    logs: JointLog | Sequence[JointLog], plant: Plant
) -> tuple[JointLog, ...]:
    """Return one log or several as a tuple, or raise InvalidValueError, for other units and dead sensors too."""
    result = as_tuple("logs", logs, JointLog)
    if len({each.torque is None for each in result}) > 1:
        raise InvalidValueError("logs", "all hold a torque, or none", "some do")
    for log in result:
        if (step := np.median(np.diff(log.time))) > SLOW:
            raise InvalidValueError(
                f"time of {log.name}", "be in s", f"steps of {step:.3g}: is it in ms?"
            )
        if plant.mass and (swing := np.ptp(log.q)) > TURNS * 2.0 * np.pi:
            raise InvalidValueError(
                f"q of {log.name}",
                "be in rad",
                f"a swing of {swing:.3g}: is it in degrees?",
            )
        if log.torque is not None:
            _check_sensors(log)
        elif log.voltage is None:
            _check_goal(log)
    return result


def _check_sensors(log: JointLog) -> None:
    """Raise InvalidValueError for a torque or an angle that does not change while the joint moves."""
    assert log.torque is not None
    if not np.ptp(log.torque) > 0.0:
        raise InvalidValueError(
            f"torque of {log.name}", "vary", f"{log.torque[0]:.3g} N m throughout"
        )
    first, last = _longest_run(log.torque)
    seconds = log.time[last] - log.time[first]
    if seconds > FROZEN and np.ptp(log.q[first : last + 1]) > MOVED * np.ptp(log.q):
        raise InvalidValueError(
            f"torque of {log.name}",
            "change while the joint moves (a dead sensor?)",
            f"{log.torque[first]:.3g} N m for {seconds:.2g} s from t = {log.time[first]:g} s on",
        )
    first, last = _longest_run(log.q)
    seconds = log.time[last] - log.time[first]
    speed = np.abs(log.speed)
    before = speed[max(first - 5, 0)]
    if first > 5 and seconds > FROZEN and before > SUDDEN * speed.max():
        raise InvalidValueError(
            f"q of {log.name}",
            "come to rest gradually (a dead sensor, or a stop: cut it out)",
            f"still for {seconds:.2g} s from t = {log.time[first]:g} s on, right after {before:.2g} rad/s",
        )


def _longest_run(values: np.ndarray) -> Sequence[int]:
    """Return the first and the last index of the longest run of equal values."""
    equal = runs(np.diff(values) == 0.0)
    return max(equal.tolist(), key=lambda ends: ends[1] - ends[0], default=(0, 0))


def _check_goal(log: JointLog) -> None:
    """Raise InvalidValueError for a goal in degrees or of the other sign."""
    assert log.goal is not None
    driven = log.on > 0.0
    if driven.sum() < LEAST_SAMPLES:
        return
    goal = log.goal[driven]
    q = log.q[driven]
    wide = np.ptp(goal)
    narrow = np.ptp(q)
    if not (wide > 0.0 and narrow > 0.0):
        return
    if max(wide / narrow, narrow / wide) > DEGREES:
        raise InvalidValueError(
            f"goal of {log.name}",
            "swing as q does, in rad",
            f"{wide:.3g} beside {narrow:.3g} of q: is one of them in degrees?",
        )
    correlation = np.corrcoef(goal, q)[0, 1]
    if correlation < OPPOSED:
        raise InvalidValueError(
            f"goal of {log.name}",
            "lead q in its own direction",
            f"a correlation of {correlation:.2f}: flip the sign of one of them",
        )
