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

from planarfriction import validation
from planarfriction.equality import ByValue, Checked, checked
from planarfriction.errors import FileError, InvalidValueError
from planarfriction.identify.logs import LEAST_SAMPLES, as_tuple, increasing, slopes
from planarfriction.reading import Table

GRAVITY = 9.81
"""Standard acceleration of gravity of the fits [m/s^2]."""

ALIASES = {
    **{"time": "t", "position": "q", "angle": "q", "theta": "q", "tau": "torque", "speed": "dq", "velocity": "dq"},
    **{"omega": "dq", "tau_external": "external"},
}
"""Other names of columns, in small letters."""

COLUMNS = {
    **{"torque": "Nm", "dq": "rad/s", "enabled": "", "goal": "rad", "duty": "", "voltage": "V", "supply": "V"},
    "external": "Nm",
}
"""Columns beside t and q, with their units."""

UNITS = {"t": "s", "q": "rad", **COLUMNS}
"""Units of all columns."""

SLOW, TURNS = 0.1, 2.0
"""Time between samples [s] from which on it is taken for ms, and turns of a pendulum for degrees."""


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
        return np.clip(self.kp * self.gain * validation.finite_numbers("error", error), -1.0, 1.0)


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
            raise InvalidValueError("length", "be positive with a mass, and only then", self.length)
        if not self.mass:
            self._set(arm_mass=self.arm_mass or 0.0, offset=self.offset or 0.0)


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

    def __post_init__(self) -> None:
        validation.instance("name", self.name, str, "a text")
        time = increasing(self.time, f"time of {self.name}", LEAST_SAMPLES)
        given = {each: getattr(self, each, None) for each in ("q", *COLUMNS)}
        columns = {each: value for each, value in given.items() if value is not None}
        self._set(time=time, **{each: validation.array(each, columns[each], (len(time),)) for each in columns})
        if self.drive is not None:
            validation.instance("drive", self.drive, Drive, "a Drive")
        if self.torque is None and self.voltage is None and (self.goal is None or self.drive is None):
            raise InvalidValueError(self.name, "hold a torque, a voltage, or a goal with a drive", "none of them")

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
        return np.ones(len(self.time)) if self.enabled is None else (self.enabled > 0.5).astype(float)

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
            raise InvalidValueError(self.name, "hold a voltage, or a goal with a drive", "neither")
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
            headings.setdefault(name, heading)
            wanted = UNITS.get(name, "")
            if unit and wanted and re.sub(r"[^a-z/]", "", unit[0]) != wanted.lower():
                raise FileError(f"{path}: {name} must be in {wanted}, got the column {heading!r}")
        if missing := [each for each in ("t", "q") if each not in headings]:
            raise FileError(f"{path}: no column {missing[0]} (t, q, and torque, voltage or goal)")
        names = ["t", "q", *(each for each in COLUMNS if each in headings)]
        read: dict[str, Any] = dict(zip(names, table.numbers([headings[each] for each in names]).T, strict=True))
        duty, supply = read.pop("duty", None), read.pop("supply", None)
        if duty is not None and supply is not None and "voltage" not in read:
            read["voltage"] = duty * supply
        if drive is not None and "goal" in read:
            read.pop("voltage", None)
        try:
            return cls(read.pop("t"), read.pop("q"), **read, drive=drive, name=path.stem)
        except InvalidValueError as error:
            raise FileError(f"{path}: {error}") from None


def as_joint_logs(logs: JointLog | Sequence[JointLog], plant: Plant) -> tuple[JointLog, ...]:
    """Return one log or several as a tuple, or raise InvalidValueError, for other units than s and rad too."""
    result = as_tuple("logs", logs, JointLog)
    if len({each.torque is None for each in result}) > 1:
        raise InvalidValueError("logs", "all hold a torque, or none", "some do")
    for log in result:
        if (step := float(np.median(np.diff(log.time)))) > SLOW:
            raise InvalidValueError(f"time of {log.name}", "be in s", f"steps of {step:.3g}: is it in ms?")
        if plant.mass and (swing := float(np.ptp(log.q))) > TURNS * 2.0 * np.pi:
            raise InvalidValueError(f"q of {log.name}", "be in rad", f"a swing of {swing:.3g}: is it in degrees?")
    return result
