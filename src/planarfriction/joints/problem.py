"""Fit of a joint: its numbers, the problem of simulated runs with its errors, and the result with its intervals."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from planarfriction._support.described import described
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.friction import JointFriction
from planarfriction.joints.log import JointLog, Plant
from planarfriction.joints.loops.runs import PlantNumbers, run_plant

Values = Mapping[str, float]
"""Numbers by name."""


class Parameter(NamedTuple):
    """Range and scale of a number."""

    unit: str
    scale: float = 1e-4
    """Size at which a step of a search begins, where the start is smaller."""
    low: float = 0.0
    high: float = np.inf
    logarithmic: bool = False
    """True for a number that is searched by its logarithm."""


PARAMETERS = {
    "inertia": Parameter("kg m^2"),
    "offset": Parameter("rad", 0.02, -2.0 * np.pi, 2.0 * np.pi),
    "gravity": Parameter("N m"),
    "gravity_sin": Parameter("N m"),
    "gravity_cos": Parameter("N m"),
    "torque_offset": Parameter("N m", low=-np.inf),
    "delay": Parameter("s", 1e-3, -6e-3, 40e-3),
    "low_pass": Parameter("s", 1e-3, high=40e-3),
    "torque_gain": Parameter("N m/V", 1e-3, 1e-9),
    "back_emf": Parameter("N m s/rad", 1e-3),
    "mu_c": Parameter("N m", low=1e-9),
    "sigma_2": Parameter("N m s/rad"),
    "load": Parameter("-", 0.05, high=0.95),
    "load_external": Parameter("-", 0.05, high=0.95),
    "rise": Parameter("N m"),
    "v_s": Parameter("rad/s", 1.0, 1e-4, 1e3, True),
    "sigma_0": Parameter("N m/rad", 1.0, 1e-6, 1e9, True),
    "sigma_1": Parameter("N m s/rad"),
    "asymmetry": Parameter("N m", low=-np.inf),
    "viscous_asymmetry": Parameter("N m s/rad", low=-np.inf),
}
"""Numbers by name: `rise` is `mu_s - mu_c`, `load` is b_m, and b_e too where that is not estimated. Ranges are those of
fits to goals; those to torques may leave them, which then refuses the log."""

FINE = 1e-5
"""Share of the squared errors that a step of a search must gain, far below what one log more or less changes."""

DIFFERENCE = 1e-5
"""Step of differences, over the size of a number."""

FARTHEST = 30.0
"""Largest logarithm of a number."""


def slopes(
    errors: Callable[[Values], np.ndarray],
    values: Values,
    names: Sequence[str],
    here: np.ndarray,
) -> np.ndarray:
    """Compute the slopes of errors `[T]`, which are `here` now, by some numbers or their logarithms, `[T, P]`."""
    columns = []
    for name in names:
        step = DIFFERENCE * max(abs(values[name]), PARAMETERS[name].scale)
        factor = values[name] if PARAMETERS[name].logarithmic else 1.0
        columns.append(
            (errors({**values, name: values[name] + step}) - here) * factor / step
        )
    return np.column_stack(columns)


def least(
    errors: Callable[[Values], np.ndarray],
    start: Values,
    names: Sequence[str],
    bounded: bool,
    **settings: Any,
) -> dict[str, float]:
    """Return the numbers of least squared errors `[T]`, from a start, within their ranges if they are `bounded`."""
    from scipy.optimize import least_squares

    log = np.array([PARAMETERS[name].logarithmic for name in names])

    def by_name(x: np.ndarray) -> dict[str, float]:
        numbers = np.exp(np.clip(x, -FARTHEST, FARTHEST), out=x.copy(), where=log)
        return dict(zip(names, numbers.tolist(), strict=True))

    def coordinates(numbers: list[float]) -> np.ndarray:
        return np.log(numbers, out=np.array(numbers), where=log)

    ends = [
        coordinates([getattr(PARAMETERS[name], end) for name in names])
        for end in ("low", "high")
    ]
    x = coordinates([start[name] for name in names])

    @functools.lru_cache(maxsize=1)
    def at(coordinates: bytes) -> np.ndarray:
        return errors(by_name(np.frombuffer(coordinates)))

    found = least_squares(
        lambda x: at(x.tobytes()).copy(),
        np.clip(x, *ends) if bounded else x,
        lambda x: slopes(errors, by_name(x), names, at(x.tobytes())),  # pyright: ignore[reportArgumentType]
        ends if bounded else (-np.inf, np.inf),
        **{"x_scale": "jac", "ftol": FINE, **settings},
    )
    return by_name(found.x)


def quantile(freedom: int, share: float) -> float:
    """Return a quantile of Student's t."""
    from scipy.special import stdtrit  # `scipy.stats` takes a second to load

    return float(stdtrit(freedom, share))


AT_BOUND = 1e-3
"""Distance from a bound, over the size of a number or in its logarithm, within which an estimate ended there."""


def interval(name: str, value: float, reach: float) -> tuple[float, float] | None:
    """Return the interval of an estimate from its reach, by factors for a logarithm; None for one at its bound."""
    kind = PARAMETERS[name]
    if kind.logarithmic:
        if min(np.log(value / kind.low), np.log(kind.high / value)) < AT_BOUND:
            return None
        factor = float(np.exp(min(reach / value, 700.0)))
        return value / factor, value * factor
    near = AT_BOUND * max(abs(value), kind.scale)
    if kind.high - value < near or (kind.low < 0.0 and value - kind.low < near):
        return None
    return max(value - reach, kind.low), min(value + reach, kind.high)


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
            servo = drive.kp * drive.gain, drive.supply, drive.sag  # pyright: ignore
        return PlantNumbers(
            max(plant.inertia + plant.pendulum_inertia, LEAST_INERTIA),  # pyright: ignore[reportOptionalOperand]
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
            """Return the torques that are missing in the balance [N m]."""
            missing = []
            for log in self.logs:
                plant = self.plant_numbers(values, log)
                v = log.speed
                driven = plant.torque_gain * log.volts - plant.back_emf * log.on * v
                outside = log.outside - plant.moment * np.sin(log.q - plant.offset)
                torque = (
                    plant.inertia * log.acceleration
                    - outside
                    + values["mu_c"] * np.sign(v)
                    + values["sigma_2"] * v
                    - driven
                )
                missing.append(torque[moving(log)])
            return np.concatenate(missing)

        angles = OFFSETS if "offset" in names else [0.0]
        starts = [zero | {"offset": angle} for angle in angles]
        ends = [least(errors, each, names, True) for each in starts]
        found = min(ends, key=lambda each: np.square(errors(each)).sum())
        strong = np.abs(errors(zero))
        fast = max(np.abs(log.speed).max() for log in self.logs)
        found["mu_c"] = max(found["mu_c"], 0.05 * np.median(strong) + 1e-6)
        found["sigma_2"] = max(found["sigma_2"], 0.01 * strong.max() / max(fast, 1e-9))
        return found

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


class Series(NamedTuple):
    """Measured and modelled torque, or angle, of one log."""

    name: str
    """Name of the log."""
    time: np.ndarray
    """Times [s], `[T]`."""
    measured: np.ndarray
    """Measured torque, smoothed [N m], or angle [rad], `[T]`."""
    fitted: np.ndarray
    """Same of the fit."""
    baseline: np.ndarray
    """Same of the fit of Coulomb and viscous friction alone."""


def not_shown(unclear: Mapping[str, str]) -> list[Verdict]:
    """Return the verdicts on terms that were asked for and that the logs do not show."""
    return [
        Verdict(term, False, f"not shown by these logs: {why}")
        for term, why in unclear.items()
    ]


@described
@dataclass(frozen=True)
class JointFit:
    """Friction of a joint with the numbers of its plant and drive: the fit with the terms that were kept."""

    logs: tuple[JointLog, ...]
    """Logs that were fitted."""
    plant: Plant
    """Plant with its estimates."""
    torque_gain: float | None
    """kt/R, known or estimated [N m/V]; None for logs with a torque."""
    terms: tuple[str, ...]
    """Terms beside Coulomb and viscous friction."""
    values: Mapping[str, float]
    """Estimates by name."""
    spread: Mapping[str, float]
    """Standard error of each estimate."""
    freedom: int
    """Degrees of freedom of the standard errors."""
    groups: tuple[str, ...]
    """Names of the logs, or of their parts, that have an error each."""
    errors: np.ndarray
    """Mean absolute error of each group [rad] or [N m]: that of a fit without it for logs without a torque."""
    baseline_errors: np.ndarray
    """Mean absolute errors [rad] or [N m] for Coulomb and viscous friction alone."""
    series: tuple[Series, ...]
    """Course of each log as measured and fitted."""
    unclear: Mapping[str, str]
    """Terms that were asked for and that the logs do not show, with the reason."""
    verdicts: tuple[Verdict, ...]
    """Findings in words, each with its number."""

    @cached_property
    def intervals(self) -> dict[str, tuple[float, float] | None]:
        """95 % interval of each estimate; None for one that ended at a bound of its search."""
        reach = quantile(self.freedom, 0.975)
        return {
            name: interval(name, value, reach * self.spread[name])
            for name, value in self.values.items()
        }

    @property
    def friction(self) -> JointFriction:
        """Friction of the joint.

        Raises InvalidValueError while a term was asked for that the logs do not show.
        """
        if self.unclear:
            raise InvalidValueError(
                "terms of the fit",
                f"be without {', '.join(self.unclear)}: {'; '.join(self.unclear.values())}",
                ", ".join(self.terms),
            )
        return friction_of(self.values)

    @property
    def unit(self) -> str:
        """Unit of the errors."""
        return "rad" if self.logs[0].torque is None else "N m"

    @property
    def error(self) -> float:
        """Mean absolute error over all logs, which were all fitted, [rad] or [N m]."""
        return float(
            np.mean(
                [np.abs(each.fitted - each.measured).mean() for each in self.series]
            )
        )

    def interval(self, name: str) -> tuple[float, float] | None:
        """Return the 95 % interval of an estimate; None for one that ended at a bound of its search."""
        return self.intervals[name]

    def simulate(self, log: JointLog) -> np.ndarray:
        """Simulate q and dq `[T, 2]` of a log from its goal or voltage."""
        return JointFitProblem(
            (log,), self.plant, self.torque_gain, self.terms
        ).simulated(self.values, [log])[0]

    def table(self) -> str:
        """Return estimates, errors of the logs and verdicts as text."""
        lines = [
            f"{'parameter':17} {'value':>11} {'std. error':>10}  95 % interval, unit"
        ]
        lines += [self._row(name) for name in self.values]
        heading = "held-out log" if self.unit == "rad" else "log"
        lines += [
            "",
            f"{heading:34} {'error':>9} {'Coulomb + viscous':>18}  {self.unit}",
        ]
        names = [*self.groups, "mean"]
        both = (self.errors, self.baseline_errors)
        rows = zip(names, *([*each, each.mean()] for each in both), strict=True)
        lines += [f"{name:34} {one:9.4g} {other:18.4g}" for name, one, other in rows]
        return "\n".join([*lines, "", *map(str, self.verdicts)])

    def _row(self, name: str) -> str:
        value = self.values[name]
        interval = self.intervals[name]
        if interval is None:
            return f"{name:17} {value:11.4g} {'-':>10}  at the bound of its search, {PARAMETERS[name].unit}"
        low, high = interval
        return f"{name:17} {value:11.4g} {self.spread[name]:10.2g}  {low:.4g} to {high:.4g} {PARAMETERS[name].unit}"

    def plot(self) -> Any:
        """Draw the log that gains most from the terms, what is left of it, and friction over speed at three loads."""
        return picture("joint", self)

    def to_dict(self) -> dict[str, Any]:
        """Return numbers and texts for JSON."""
        errors = {"errors": self.errors, "errors_coulomb_viscous": self.baseline_errors}
        return {
            "terms": list(self.terms),
            "unclear": dict(self.unclear),
            "parameters": {
                name: {"value": value, "spread": self.spread[name], "unit": PARAMETERS[name].unit,
                       "interval": self.intervals[name] and list(self.intervals[name] or ())}
                for name, value in self.values.items()
            },
            "unit_of_errors": self.unit,
            "error_fitted": self.error,
            **{name: dict(zip(self.groups, each.tolist(), strict=True)) for name, each in errors.items()},
            "verdicts": [str(each) for each in self.verdicts],
        }  # fmt: skip
