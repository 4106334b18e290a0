"""Least-squares problem of a joint: what is unknown, where the search starts, and the errors of a choice of values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from planarfriction.joints.friction import JointFriction
from planarfriction.joints.log import GRAVITY, JointLog, Plant
from planarfriction.joints.loops.plant import VARIED, PlantNumbers, run_plant
from planarfriction.joints.loops.runs import run_measured


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
    "offset": Parameter("rad", -0.5, 0.5, 0.02),
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

NEEDS = {"directional": "load"}
"""Terms that stand beside another alone."""

STEP = 2e-3
"""Longest step of a simulated run [s]: a tenth of it moves positions by 4e-5 rad on average, with bristles by 5e-4."""

DIFFERENCE = 1e-3
"""Step of differences of torques, over the size of a parameter."""

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
    """Parts of a log with a measured torque that count as groups; other logs are cut before."""

    @property
    def by_torque(self) -> bool:
        """True if torques were measured."""
        return self.logs[0].torque is not None

    @property
    def seen_off(self) -> bool:
        """True if a log moves while the drive is off."""
        return any((moving(log) & (log.on == 0.0)).any() for log in self.logs)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that are estimated, `[P]`.

        Without a torque, the mass of an arm would only scale all torques: it is then none.
        """
        unknown = [each for each in ("inertia", "arm_mass", "offset") if getattr(self.plant, each) is None]
        if self.by_torque:
            return (*unknown, "mu_c", "sigma_2", *self._more)
        unknown = [each for each in unknown if each != "arm_mass"]
        gain = ["torque_gain"] if self.torque_gain is None else []
        return (*unknown, *gain, *(["back_emf"] if self.seen_off else []), "mu_c", "sigma_2", *self._more)

    @property
    def _more(self) -> Iterator[str]:
        return (name for term in self.terms for name in TERMS[term])

    def with_terms(self, terms: Sequence[str]) -> Problem:
        """Return the problem with other terms."""
        return replace(self, terms=tuple(each for each in TERMS if each in terms))

    def friction(self, values: Mapping[str, float]) -> JointFriction:
        """Make the friction of parameters by name."""
        load = values.get("load", 0.0)
        return JointFriction(
            values["mu_c"], values["sigma_2"], load, values.get("load_external", load),
            values["mu_c"] + values.get("rise", 0.0), values.get("v_s", 1.0),
            values.get("sigma_0"), values.get("sigma_1", 0.0),
        )  # fmt: skip

    def settled(self, values: Mapping[str, float]) -> Plant:
        """Make the plant of parameters by name."""
        known = {each: getattr(self.plant, each) for each in ("inertia", "arm_mass", "offset")}
        return replace(self.plant, **{each: values.get(each, value or 0.0) for each, value in known.items()})

    def plant_numbers(self, values: Mapping[str, float], log: JointLog) -> PlantNumbers:
        """Return what the loops read of plant and drive."""
        plant, drive = self.settled(values), log.drive if log.voltage is None else None
        arm = plant.arm_mass or 0.0
        inertia = (plant.inertia or 0.0) + (plant.mass + arm / 3.0) * plant.length**2
        moment = (plant.mass + 0.5 * arm) * GRAVITY * plant.length
        gain = values.get("torque_gain", self.torque_gain or 0.0)
        servo = (0.0, 0.0, 0.0) if drive is None else (drive.kp * drive.gain, drive.supply, drive.sag)
        return PlantNumbers(max(inertia, 1e-12), moment, plant.offset or 0.0, gain, values.get("back_emf", 0.0), *servo)

    # ------------------------------------------------------------------ errors

    def simulated(self, values: Mapping[str, float], log: JointLog, span: float = np.inf) -> np.ndarray:
        """Simulate q and dq `[T, 2]` from goal or voltage; the run begins at the measured motion every `span` [s]."""
        return self._run(values, log, span, np.empty((len(VARIED), 0)))[0]

    def _run(
        self, values: Mapping[str, float], log: JointLog, span: float, seeds: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return q and dq `[T, 2]`, and the slopes of q by P parameters `[T, P]`, of whose numbers `seeds` are."""
        motion, slopes = np.empty((len(log.time), 2)), np.empty((len(log.time), seeds.shape[1]))
        again = int(min(max(2.0, span * len(log.time) / (log.time[-1] - log.time[0])), 1e9))
        joint, plant = self.friction(values).rigid_numbers, self.plant_numbers(values, log)
        given, lanes = log.goal if log.voltage is None else log.voltage, np.empty((9, seeds.shape[1]))
        run_plant(
            joint, plant, log.time, given, log.on, log.outside, log.motion, again, STEP, seeds, lanes, motion, slopes
        )
        return motion, slopes

    def _numbers(self, values: Mapping[str, float]) -> np.ndarray:
        """Return `VARIED` at parameters by name: linear in each of them."""
        joint, plant = self.friction(values).rigid_numbers, self.plant_numbers(values, self.logs[0])
        named = {**joint.law._asdict(), **joint._asdict(), **plant._asdict()}
        return np.array([named[each] for each in VARIED])

    def torque(self, values: Mapping[str, float], log: JointLog) -> np.ndarray:
        """Compute the torque [N m] that the measured motion of a log takes, `[T]`."""
        plant, taken = self.plant_numbers(values, log), np.empty(len(log.time))
        outside = log.outside - plant.moment * np.sin(log.q - plant.offset)
        run_measured(self.friction(values).numbers, log.time, log.speed, log.torque, outside, taken)
        return plant.inertia * log.acceleration - outside + taken

    def errors(self, values: Mapping[str, float], span: float = np.inf, without: int = -1) -> list[np.ndarray]:
        """Compute the errors of each group of samples [rad], or [N m]; empty for the group that is left out."""
        if self.by_torque:
            whole = [self.torque(values, log) - log.torque for log in self.logs]
            groups = [each for log in whole for each in np.array_split(log, self.parts)]
            return [each[:0] if i == without else each for i, each in enumerate(groups)]
        return [
            np.empty(0) if i == without else self.simulated(values, log, span)[:, 0] - log.q
            for i, log in enumerate(self.logs)
        ]

    def slopes(self, values: Mapping[str, float], span: float = np.inf, without: int = -1) -> np.ndarray:
        """Compute the slopes of all errors by the parameters, `[T, P]`: of runs exactly, of torques by differences."""
        if self.by_torque:
            here, columns = np.concatenate(self.errors(values, span, without)), []
            for name in self.names:
                step = DIFFERENCE * max(abs(values[name]), PARAMETERS[name].scale)
                more = self.errors({**values, name: values[name] + step}, span, without)
                columns.append((np.concatenate(more) - here) / step)
            return np.column_stack(columns)
        here = self._numbers(values)
        seeds = np.column_stack([self._numbers({**values, name: values[name] + 1.0}) - here for name in self.names])
        logs = (log for i, log in enumerate(self.logs) if i != without)
        return np.concatenate([self._run(values, log, span, seeds)[1] for log in logs])

    @property
    def groups(self) -> list[str]:
        """Names of the groups that are left out in turn."""
        if not self.by_torque or self.parts == 1:
            return [log.name for log in self.logs]
        return [f"{log.name}, part {k + 1}" for log in self.logs for k in range(self.parts)]

    # ------------------------------------------------------------------ start

    def start(self) -> dict[str, float]:
        """Compute the least squares of the torque balance, where the joint moves, of the linear parameters.

        `I a - tau_e + mu_c sign(v) + sigma_2 v = kt/R V - back_emf v`, or a measured torque.
        """
        names = [each for each in self.names if each in ("inertia", "arm_mass", "offset", "torque_gain", "back_emf")]
        names += ["mu_c", "sigma_2"]
        rows, right = [], []
        for log in self.logs:
            v, a, plant = log.speed, log.acceleration, self.plant
            on, moves = log.on, moving(log)
            weight = GRAVITY * plant.length * np.sin(log.q - (plant.offset or 0.0))
            columns = {
                "inertia": a,
                "arm_mass": plant.length**2 / 3.0 * a + 0.5 * weight,
                "offset": -plant.mass * GRAVITY * plant.length * np.cos(log.q),
                "back_emf": on * v,
                "mu_c": np.sign(v),
                "sigma_2": v,
            }
            pushed: Any = log.torque if self.by_torque else (self.torque_gain or 0.0) * log.volts
            if not self.by_torque:
                columns["torque_gain"] = -log.volts
            inertia = (plant.inertia or 0.0) + (plant.mass + (plant.arm_mass or 0.0) / 3.0) * plant.length**2
            known = inertia * a + (plant.mass + 0.5 * (plant.arm_mass or 0.0)) * weight - log.outside
            rows.append(np.column_stack([columns[each] for each in names])[moves])
            right.append((pushed - known)[moves])
        table = np.concatenate(rows)
        size = np.maximum(np.abs(table).max(axis=0), 1e-300)
        found = dict(
            zip(names, np.linalg.lstsq(table / size, np.concatenate(right), rcond=1e-8)[0] / size, strict=True)
        )
        speeds = np.concatenate([np.abs(log.speed) for log in self.logs])
        forces = np.abs(np.concatenate(right))
        least = {"mu_c": 0.05 * np.median(forces) + 1e-6, "sigma_2": 0.01 * forces.max() / max(speeds.max(), 1e-9)}
        found = {each: max(value, least.get(each, PARAMETERS[each].low)) for each, value in found.items()}
        return {each: min(value, PARAMETERS[each].high) for each, value in found.items()}

    def guesses(self, term: str, values: Mapping[str, float]) -> list[dict[str, float]]:
        """Return starts of a term beside the values of a fit without it; the first changes little."""
        mu_c = values["mu_c"]
        if term == "load":
            return [{"load": 0.02}, {"load": 0.1, "mu_c": 0.5 * mu_c}, {"load": 0.3, "mu_c": 0.2 * mu_c}]
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
                {"rise": share * mu_c, "v_s": part * fast} for share in (0.1, 0.4) for part in (0.01, 0.03, 0.1, 0.3)
            ]
        most = mu_c + values.get("rise", 0.0)
        bent = ((most / angle, time) for angle in (1e-4, 1e-3, 3e-3, 1e-2, 0.1) for time in (1e-3, 1e-2))
        return [{"sigma_0": stiffness, "sigma_1": time * stiffness} for stiffness, time in bent]


def moving(log: JointLog) -> np.ndarray:
    """Return the mask of samples that count as moving, `[T]`."""
    speed = np.abs(log.speed)
    return speed > MOVING * speed.max()
