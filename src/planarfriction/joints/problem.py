"""Least-squares problem of simulated runs of a joint: its unknowns, the start of a search, the errors of values."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planarfriction.joints.friction import JointFriction
from planarfriction.joints.log import JointLog, Plant
from planarfriction.joints.loops.runs import PlantNumbers, run_plant
from planarfriction.joints.numbers import Values, least

TERMS: dict[str, tuple[str, ...]] = {
    "load": ("load",),
    "stribeck": ("rise", "v_s"),
    "bristles": ("sigma_0", "sigma_1"),
    "directional": ("load_external",),
}
"""Terms beside Coulomb and viscous friction, in the order in which they are tried, with their parameters."""

UNKNOWN = ("inertia", "offset")
"""Numbers of a plant that are estimated where they are not given; a mass of the arm would only scale all torques."""

LEAST_INERTIA = 1e-12
"""Inertia that stands for none [kg m^2]."""

NEEDS = {"directional": "load"}
"""Terms that stand beside another alone."""

STEP = 2e-3
"""Longest step of a simulated run [s]: a tenth of it moves positions by 4e-5 rad on average, with bristles by 5e-4."""

SHORT = 0.2
"""Time after which a simulated run begins again where terms are judged [s]."""

OFFSETS = (np.pi * np.array([0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0])).tolist()
"""Angles at which a pendulum may hang, from which a search begins [rad]."""

MOVING = 0.05
"""Share of the largest speed above which the torque balance counts a joint as moving."""


@dataclass(frozen=True)
class JointFitProblem:
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
        """Names of the parameters that are estimated, `[P]`."""
        names = [each for each in UNKNOWN if getattr(self.plant, each) is None]
        if self.torque_gain is None:
            names.append("torque_gain")
        if any((moving(log) & (log.on == 0.0)).any() for log in self.logs):
            names.append("back_emf")
        return (*names, "mu_c", "sigma_2", *self._more)

    @property
    def _more(self) -> list[str]:
        return [name for term in self.terms for name in TERMS[term]]

    def with_terms(self, terms: Sequence[str]) -> JointFitProblem:
        """Return the problem with other terms."""
        return replace(self, terms=tuple(each for each in TERMS if each in terms))

    def settled(self, values: Values) -> Plant:
        """Make the plant of parameters by name."""
        given = {
            each: values.get(each, getattr(self.plant, each) or 0.0) for each in UNKNOWN
        }
        return replace(self.plant, arm_mass=self.plant.arm_mass or 0.0, **given)

    def plant_numbers(self, values: Values, log: JointLog) -> PlantNumbers:
        """Return what the loops read of plant and drive."""
        plant = self.settled(values)
        drive = log.drive
        servo = (0.0, 0.0, 0.0)
        if log.voltage is None and drive is not None:
            servo = drive.kp * drive.gain, drive.supply, drive.sag
        return PlantNumbers(
            max(plant.inertia + plant.pendulum_inertia, LEAST_INERTIA),
            plant.moment,
            plant.offset,
            values.get("torque_gain", self.torque_gain or 0.0),
            values.get("back_emf", 0.0),
            *servo,
        )

    # ------------------------------------------------------------------ errors

    def simulated(
        self, values: Values, logs: Sequence[JointLog], span: float = np.inf
    ) -> list[np.ndarray]:
        """Simulate q and dq `[T, 2]` of logs from goal or voltage.

        Runs begin again at the measured motion every `span` [s].
        """
        motions = []
        joint = friction_of(values).rigid_numbers
        for log in logs:
            rate = len(log.time) / (log.time[-1] - log.time[0])
            again = int(min(max(2.0, span * rate), 1e9))
            motion = np.empty((len(log.time), 2))
            motions.append(motion)
            run_plant(
                joint,
                self.plant_numbers(values, log),
                log.time,
                log.goal if log.voltage is None else log.voltage,
                log.on,
                log.outside,
                log.motion,
                again,
                STEP,
                motion,
            )
        return motions

    def errors(self, values: Values, span: float = np.inf) -> np.ndarray:
        """Compute the errors of all samples [rad]."""
        runs = zip(self.simulated(values, self.logs, span), self.logs, strict=True)
        return np.concatenate([motion[:, 0] - log.q for motion, log in runs])

    def costs(self, values: Values, span: float = np.inf) -> np.ndarray:
        """Compute the mean absolute error of each group [rad]."""
        return np.bincount(
            self.labels, np.abs(self.errors(values, span))
        ) / np.bincount(self.labels)

    @cached_property
    def labels(self) -> np.ndarray:
        """Number of the group of each sample."""
        counts = [len(log.time) for log in self.logs]
        return np.concatenate(
            [self.parts * (i + np.arange(n) / n) for i, n in enumerate(counts)]
        ).astype(int)

    @property
    def groups(self) -> list[str]:
        """Names of the groups that are left out in turn."""
        parts = [f", part {k + 1}" for k in range(self.parts)]
        parts = parts if self.parts > 1 else [""]
        return [log.name + part for log in self.logs for part in parts]

    # ------------------------------------------------------------------ start

    def start(self) -> dict[str, float]:
        """Compute the least squares of the torque balance of rigid friction, where the joint moves.

        `I a - tau_e + mu_c sign(v) + sigma_2 v = kt/R V - back_emf v`; the angle at which a pendulum hangs is searched
        from several.
        """
        names = [each for each in self.names if each not in self._more]
        zero = dict.fromkeys(names, 0.0)

        def errors(values: Values) -> np.ndarray:
            return np.concatenate(
                [self._balance(values, log)[moving(log)] for log in self.logs]
            )

        angles = OFFSETS if "offset" in names else [0.0]
        starts = [zero | {"offset": angle} for angle in angles]
        ends = [least(errors, each, names, True) for each in starts]
        found = min(ends, key=lambda each: np.square(errors(each)).sum())
        strong = np.abs(errors(zero))
        fast = max(np.abs(log.speed).max() for log in self.logs)
        found["mu_c"] = max(found["mu_c"], 0.05 * np.median(strong) + 1e-6)
        found["sigma_2"] = max(found["sigma_2"], 0.01 * strong.max() / max(fast, 1e-9))
        return found

    def _balance(self, values: Values, log: JointLog) -> np.ndarray:
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

    def guesses(self, term: str, values: Values) -> list[dict[str, float]]:
        """Return starts of a term beside the values of a fit without it; the first changes little."""
        mu_c = values["mu_c"]
        load = values.get("load", 0.0)
        if term == "load":
            return [
                {"load": b, "mu_c": share * mu_c}
                for b, share in ((0.02, 1.0), (0.1, 0.5), (0.3, 0.2))
            ]
        if term == "directional":
            shares = ((1.0, 1.0), (0.3, 1.5), (2.0, 1.0))
            return [
                {"load_external": min(external * load, 0.9), "load": motor * load}
                for external, motor in shares
            ]
        if term == "stribeck":
            fast = max(np.quantile(np.abs(log.speed), 0.9) for log in self.logs)
            parts = itertools.product((0.1, 0.4), (0.01, 0.03, 0.1, 0.3))
            return [{"rise": share * mu_c, "v_s": part * fast} for share, part in parts]
        most = mu_c + values.get("rise", 0.0)
        bent = itertools.product((1e-4, 1e-3, 3e-3, 1e-2, 0.1), (1e-3, 1e-2))
        return [
            {"sigma_0": most / angle, "sigma_1": time * most / angle}
            for angle, time in bent
        ]


DIRECT = (
    "mu_c",
    "sigma_2",
    "v_s",
    "sigma_0",
    "sigma_1",
    "asymmetry",
    "viscous_asymmetry",
)
"""Estimates that are fields of a friction."""


def friction_of(values: Values) -> JointFriction:
    """Make the friction of estimates by name."""
    load = values.get("load", 0.0)
    return JointFriction(
        **{name: values[name] for name in DIRECT if name in values},
        mu_s=values["mu_c"] + values.get("rise", 0.0),
        load_motor=load,
        load_external=values.get("load_external", load),
    )


def moving(log: JointLog) -> np.ndarray:
    """Return the mask of samples that count as moving, `[T]`."""
    speed = np.abs(log.speed)
    return speed > MOVING * speed.max()
