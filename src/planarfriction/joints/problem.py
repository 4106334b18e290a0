"""Least-squares problem of simulated runs of a joint: its unknowns, the start of a search, the errors of values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planarfriction.joints.friction import JointFriction
from planarfriction.joints.log import GRAVITY, JointLog, Plant
from planarfriction.joints.loops.runs import PlantNumbers, run_plant


class Parameter(NamedTuple):
    """Range and scale of a parameter."""

    unit: str
    low: float
    high: float
    scale: float
    """Size at which a step of the search begins, where the start is smaller."""
    logarithmic: bool = False


PARAMETERS = {
    "inertia": Parameter("kg m^2", 0.0, np.inf, 1e-4),
    "arm_mass": Parameter("kg", 0.0, np.inf, 0.01),
    "offset": Parameter("rad", -2.0 * np.pi, 2.0 * np.pi, 0.02),
    "torque_gain": Parameter("N m/V", 1e-9, np.inf, 1e-3),
    "back_emf": Parameter("N m s/rad", 0.0, np.inf, 1e-3),
    "mu_c": Parameter("N m", 1e-9, np.inf, 1e-4),
    "sigma_2": Parameter("N m s/rad", 0.0, np.inf, 1e-4),
    "load": Parameter("-", 0.0, 0.95, 0.05),
    "rise": Parameter("N m", 0.0, np.inf, 1e-4),
    "v_s": Parameter("rad/s", 1e-4, 1e3, 1.0, True),
    "sigma_0": Parameter("N m/rad", 1e-6, 1e9, 1.0, True),
    "sigma_1": Parameter("N m s/rad", 0.0, np.inf, 1e-4),
    "load_external": Parameter("-", 0.0, 0.95, 0.05),
}
"""Parameters by name, `rise` for `mu_s - mu_c`; `load` is b_m, and b_e too where that is not estimated."""

TERMS: dict[str, tuple[str, ...]] = {
    "load": ("load",),
    "stribeck": ("rise", "v_s"),
    "bristles": ("sigma_0", "sigma_1"),
    "directional": ("load_external",),
}
"""Terms beside Coulomb and viscous friction, in the order in which they are tried, with their parameters."""

UNKNOWN = ("inertia", "arm_mass", "offset")
"""Numbers of a plant that are estimated where they are not given."""

LEAST_INERTIA = 1e-12
"""Inertia that stands for none [kg m^2]."""

NEEDS = {"directional": "load"}
"""Terms that stand beside another alone."""

STEP = 2e-3
"""Longest step of a simulated run [s]: a tenth of it moves positions by 4e-5 rad on average, with bristles by 5e-4."""

SHORT = 0.2
"""Time after which a simulated run begins again where terms are judged [s]."""

DIFFERENCE = 1e-5
"""Step of differences, over the size of a parameter."""

OFFSETS = np.pi * np.array([0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0])
"""Angles at which a pendulum may hang, from which a search begins [rad]."""

MOVING = 0.05
"""Share of the largest speed above which the torque balance counts a joint as moving."""


@dataclass(frozen=True)
class Problem:
    """Logs and plant with the terms of the friction that are tried."""

    logs: tuple[JointLog, ...]
    plant: Plant
    torque_gain: float | None
    """Known kt/R [N m/V], or None."""
    terms: tuple[str, ...]
    parts: int = 1
    """Parts of each log that count as groups."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that are estimated, `[P]`; the mass of an arm would only scale all torques."""
        names = [
            each
            for each in UNKNOWN
            if getattr(self.plant, each) is None and each != "arm_mass"
        ]
        names += ["torque_gain"] if self.torque_gain is None else []
        names += (
            ["back_emf"]
            if any((moving(log) & (log.on == 0.0)).any() for log in self.logs)
            else []
        )
        return (*names, "mu_c", "sigma_2", *self._more)

    @property
    def _more(self) -> list[str]:
        return [name for term in self.terms for name in TERMS[term]]

    def with_terms(self, terms: Sequence[str]) -> Problem:
        """Return the problem with other terms."""
        return replace(self, terms=tuple(each for each in TERMS if each in terms))

    def settled(self, values: Mapping[str, float]) -> Plant:
        """Make the plant of parameters by name."""
        return replace(
            self.plant,
            **{
                each: values.get(each, getattr(self.plant, each) or 0.0)
                for each in UNKNOWN
            },
        )

    def plant_numbers(self, values: Mapping[str, float], log: JointLog) -> PlantNumbers:
        """Return what the loops read of plant and drive."""
        plant = self.plant
        drive = log.drive if log.voltage is None else None
        inertia, arm, offset = (
            values.get(each, getattr(plant, each) or 0.0) for each in UNKNOWN
        )
        inertia += (plant.mass + arm / 3.0) * plant.length**2
        moment = (plant.mass + 0.5 * arm) * GRAVITY * plant.length
        gain = values.get("torque_gain", self.torque_gain or 0.0)
        back_emf = values.get("back_emf", 0.0)
        servo = (
            (0.0, 0.0, 0.0)
            if drive is None
            else (drive.kp * drive.gain, drive.supply, drive.sag)
        )
        return PlantNumbers(
            max(inertia, LEAST_INERTIA), moment, offset, gain, back_emf, *servo
        )

    # ------------------------------------------------------------------ errors

    def simulated(
        self,
        values: Mapping[str, float],
        logs: Sequence[JointLog],
        span: float = np.inf,
    ) -> list[np.ndarray]:
        """Simulate q and dq `[T, 2]` of logs from goal or voltage.

        Runs begin again at the measured motion every `span` [s].
        """
        motions = [np.empty((len(log.time), 2)) for log in logs]
        joint = friction_of(values).rigid_numbers
        for log, motion in zip(logs, motions, strict=True):
            plant = self.plant_numbers(values, log)
            given = log.goal if log.voltage is None else log.voltage
            again = int(
                min(max(2.0, span * len(log.time) / (log.time[-1] - log.time[0])), 1e9)
            )
            run_plant(
                joint,
                plant,
                log.time,
                given,
                log.on,
                log.outside,
                log.motion,
                again,
                STEP,
                motion,
            )
        return motions

    def errors(
        self, values: Mapping[str, float], span: float = np.inf
    ) -> list[np.ndarray]:
        """Compute the errors of each group of samples [rad]."""
        runs = zip(self.simulated(values, self.logs, span), self.logs, strict=True)
        return self._groups([motion[:, 0] - log.q for motion, log in runs])

    def costs(self, values: Mapping[str, float], span: float = np.inf) -> np.ndarray:
        """Compute the mean absolute error of each group [rad]."""
        return np.array([np.abs(each).mean() for each in self.errors(values, span)])

    def slopes(
        self, values: Mapping[str, float], span: float = np.inf
    ) -> list[np.ndarray]:
        """Compute the slopes of each group's errors by the parameters by differences, `[T, P]`."""
        here = self.errors(values, span)
        columns = []
        for name in self.names:
            step = DIFFERENCE * max(abs(values[name]), PARAMETERS[name].scale)
            more = self.errors({**values, name: values[name] + step}, span)
            columns.append(
                [(far - near) / step for far, near in zip(more, here, strict=True)]
            )
        return [np.column_stack(each) for each in zip(*columns, strict=True)]

    def _groups(self, rows: list[np.ndarray]) -> list[np.ndarray]:
        """Cut the rows of each log into its groups."""
        return [each for log in rows for each in np.array_split(log, self.parts)]

    @property
    def groups(self) -> list[str]:
        """Names of the groups that are left out in turn."""
        parts = (
            [f", part {k + 1}" for k in range(self.parts)] if self.parts > 1 else [""]
        )
        return [log.name + part for log in self.logs for part in parts]

    # ------------------------------------------------------------------ start

    def start(self) -> dict[str, float]:
        """Compute the least squares of the torque balance, where the joint moves, of the linear parameters.

        `I a - tau_e + mu_c sign(v) + sigma_2 v = kt/R V - back_emf v`. The angle at which a pendulum hangs is not
        linear: it is searched from several.
        """
        angles = OFFSETS if "offset" in self.names else OFFSETS[:1]
        return min(
            (self._start(float(each)) for each in angles), key=lambda found: found[1]
        )[0]

    def _start(self, offset: float) -> tuple[dict[str, float], float]:
        """Return the least squares near an offset [rad], and their squared error."""
        names = [each for each in self.names if each not in self._more]
        zero = dict.fromkeys(names, 0.0)
        if "offset" in zero:
            zero["offset"] = offset
        rows = []
        right = []
        for log in self.logs:
            here = self._balance(zero, log)
            moves = moving(log)
            scales = [PARAMETERS[name].scale for name in names]
            columns = [
                self._balance({**zero, name: zero[name] + scale}, log) - here
                for name, scale in zip(names, scales, strict=True)
            ]
            rows.append(np.column_stack(columns)[moves] / scales)
            right.append(-here[moves])
        table = np.concatenate(rows)
        forces = np.concatenate(right)
        size = np.maximum(np.abs(table).max(axis=0), 1e-300)
        steps = np.linalg.lstsq(table / size, forces, rcond=1e-8)[0] / size
        found = dict(zip(names, (steps + list(zero.values())).tolist(), strict=True))
        fast = max(np.abs(log.speed).max() for log in self.logs)
        strong = np.abs(forces)
        least = {
            "mu_c": 0.05 * np.median(strong) + 1e-6,
            "sigma_2": 0.01 * strong.max() / max(fast, 1e-9),
        }
        for name in names:
            found[name] = float(
                np.clip(
                    found[name],
                    least.get(name, PARAMETERS[name].low),
                    PARAMETERS[name].high,
                )
            )
        rest = [self._balance(found, log)[moving(log)] for log in self.logs]
        return found, float(np.square(np.concatenate(rest)).sum())

    def _balance(self, values: Mapping[str, float], log: JointLog) -> np.ndarray:
        """Compute the torque that is missing in the balance of rigid friction [N m], `[T]`."""
        plant = self.plant_numbers(values, log)
        v = log.speed
        driven = plant.torque_gain * log.volts - plant.back_emf * log.on * v
        outside = log.outside - plant.moment * np.sin(log.q - plant.offset)
        return (
            plant.inertia * log.acceleration
            - outside
            + values["mu_c"] * np.sign(v)
            + values["sigma_2"] * v
            - driven
        )

    def guesses(self, term: str, values: Mapping[str, float]) -> list[dict[str, float]]:
        """Return starts of a term beside the values of a fit without it; the first changes little."""
        mu_c = values["mu_c"]
        if term == "load":
            return [
                {"load": 0.02},
                {"load": 0.1, "mu_c": 0.5 * mu_c},
                {"load": 0.3, "mu_c": 0.2 * mu_c},
            ]
        if term == "directional":
            load = values["load"]
            return [
                {"load_external": load},
                {"load_external": 0.3 * load, "load": 1.5 * load},
                {"load_external": min(2.0 * load, 0.9)},
            ]
        if term == "stribeck":
            fast = max(float(np.quantile(np.abs(log.speed), 0.9)) for log in self.logs)
            return [
                {"rise": share * mu_c, "v_s": part * fast}
                for share in (0.1, 0.4)
                for part in (0.01, 0.03, 0.1, 0.3)
            ]
        most = mu_c + values.get("rise", 0.0)
        bent = (
            (most / angle, time)
            for angle in (1e-4, 1e-3, 3e-3, 1e-2, 0.1)
            for time in (1e-3, 1e-2)
        )
        return [
            {"sigma_0": stiffness, "sigma_1": time * stiffness}
            for stiffness, time in bent
        ]


def friction_of(values: Mapping[str, float]) -> JointFriction:
    """Make the friction of parameters by name."""
    load = values.get("load", 0.0)
    return JointFriction(
        values["mu_c"],
        values["sigma_2"],
        load,
        values.get("load_external", load),
        values["mu_c"] + values.get("rise", 0.0),
        values.get("v_s", 1.0),
        values.get("sigma_0"),
        values.get("sigma_1", 0.0),
        values.get("asymmetry", 0.0),
        values.get("viscous_asymmetry", 0.0),
    )


def moving(log: JointLog) -> np.ndarray:
    """Return the mask of samples that count as moving, `[T]`."""
    speed = np.abs(log.speed)
    return speed > MOVING * speed.max()
