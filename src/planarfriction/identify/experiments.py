"""`design_experiment`: the motion that adds most information to the logs so far.

With the derivatives J of the wrenches over their noise, information adds up over logs,

    C_0 = (P + sum over logs J' J)^-1,    C_m = (C_0^-1 + J_m' J_m)^-1,    gain = log2(det C_0 / det C_m) / 2   [bit],

with P the information a priori. Sensor errors are estimated too: zeros and drift for each log, delay and
scale of the load cell once for all. The gain is of first order in the parameters, so it holds near the given law.

Sources: Lindley 1956 (gain of information); Chaloner and Verdinelli 1995 (its form for normal errors, section 4).
"""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.identify.logs import Log, as_tuple
from planarfriction.identify.parameters import (
    ALL,
    LAW,
    PRIOR,
    SHAPE,
    SHAPE_PRIOR,
    SOFT_FINGER,
    USUAL,
    Coordinates,
    check_names,
    check_patch,
    fitted_law,
)
from planarfriction.identify.problem import FitOptions, LogProblem, check_noise
from planarfriction.identify.result import WIDTH, Identification
from planarfriction.identify.sensor_errors import GROUPS, check_groups, wrench_noise
from planarfriction.identify.uncertainty import finite
from planarfriction.laws import LuGre
from planarfriction.patch import ContactPatch

NOISE = 0.01
"""Noise over the largest sliding friction, unless it is given."""

REFINE = 4
"""Steps between two samples."""

KNOWN = 0.5
"""Standard error over the value above which a parameter counts as unknown."""

FAINT = 1e-14
"""Share of the largest information below which rounding decides."""

SAMPLES = (100, 100_000)
"""Fewest samples that show a motion, and most samples of a plan."""

LOADS = 20
"""Largest number of loads of a plan."""

SINES = (2.3, 1.7, 3.1)
"""Frequencies of vx, vy and omega [Hz]: no two periods meet again soon."""

SLOWEST = 1e-3
"""Speed at the begin of a slide over its largest speed."""

STROKE = 3.0
"""Amplitude of reversals over the displacement at which bristles break away,
`mu_s/sigma_0`."""

SLOW = 1.0
"""Frequency of slow reversals [Hz]."""

PER_PERIOD = 25.0
"""Samples of a period of the quickest reversals."""


@dataclass(frozen=True, eq=False, repr=False)
class MotionPlan(ByValue):
    """Plan of an experiment: M motions ranked by the information they should add on F parameters, the best first."""

    names: tuple[str, ...]
    """Names of the parameters."""
    values: np.ndarray
    """Values of the parameters, near which the plan is valid [SI], `[F]`."""
    motions: tuple[Log, ...]
    """Motions with their expected wrenches."""
    gains: np.ndarray
    """Information that each motion is expected to add [bit], `[M]`."""
    errors_so_far: np.ndarray
    """Standard errors before any of these motions [SI], `[F]`."""
    errors: np.ndarray
    """Expected standard errors after each motion [SI], `[M, F]`."""

    @property
    def best(self) -> Log:
        """Motion that adds the most information."""
        return self.motions[0]

    def table(self) -> str:
        """Return a text in 80 columns: the gain of each motion, and the errors before and after the best one."""
        lines = [f"{'motion':<38}{'gain [bit]':>10}   {'least certain afterwards'}"]
        sizes = np.where(self.values != 0.0, np.abs(self.values), 1.0)
        for motion, gain, errors in zip(
            self.motions, self.gains, self.errors, strict=True
        ):
            at = int(np.argmax(errors / sizes))
            least = f"{self.names[at]}, {self._share(errors, at)}"
            lines.append(f"{motion.name[:37]:<38}{gain:>10.1f}   {least}")
        after = [
            f"{'parameter':<18}{'value':>11}   {'error so far':>14}   {'after the best':>14}"
        ]
        for i, name in enumerate(self.names):
            before = self._share(self.errors_so_far, i)
            then = self._share(self.errors[0], i)
            after.append(
                f"{name:<18}{self.values[i]:>11.4g}   {before:>14}   {then:>14}   {ALL[name].unit}"
            )
        first = textwrap.fill(f"Next motion to measure: {self.best.name}.", WIDTH)
        return "\n\n".join([first, "\n".join(lines), "\n".join(after)])

    def __repr__(self) -> str:
        return self.table()

    def _share(self, errors: np.ndarray, i: int) -> str:
        if self.values[i] == 0.0:
            return f"{errors[i]:.2g}"
        share = errors[i] / abs(self.values[i])
        return f"{100.0 * share:.2g} %" if share < KNOWN else "unknown"


def design_experiment(
    patch: ContactPatch,
    law: LuGre,
    *,
    logs: Log | Sequence[Log] = (),
    motions: Log | Sequence[Log] | None = None,
    parameters: Sequence[str] = USUAL,
    wanted: Sequence[str] | None = None,
    noise: Sequence[float] | None = None,
    nuisance: Sequence[str] = GROUPS,
) -> MotionPlan:
    """Rank motions by the information that they are expected to add to that of the logs so far.

    Wrenches and derivatives are those of `ReducedModelPublished`; the information is Lindley's gain (see the module).

    Parameters
    ----------
    patch, law
        The contact, as far as it is known: a guess before the first log, then `current_estimate`.
    logs
        Logs measured so far; none before the first experiment.
    motions
        Motions to choose from, as logs that begin at rest and whose wrenches are ignored; None for `candidate_motions`
        at the loads of `logs`, or at 1 N.
    parameters
        Names of what is estimated, as in `identify_lugre`.
    wanted
        The parameters whose information counts; None for all.
    noise
        Standard deviation of the measured fx, fy [N] and tau [N m]; None takes that of `logs`, or 1 % of the largest
        friction.
    nuisance
        Sensor errors that the fit may include, as in `identify_lugre`; twists of future motions count as free of noise.

    Raises
    ------
    InvalidValueError
        A parameter breaks its rule, or a motion does not move.
    """
    names = check_names(parameters)
    groups = check_groups("nuisance", nuisance)
    check_patch(patch, "design_experiment")
    validation.instance("law", law, LuGre, "a LuGre law")
    if "breakaway_ratio" in names and law.elasto_plastic is None:
        raise InvalidValueError(
            "parameters",
            "contain breakaway_ratio only for elasto-plastic bristles",
            names,
        )
    before = ()
    if not isinstance(logs, (list, tuple)) or logs:
        before = as_tuple("logs", logs, Log)
    chosen = names if wanted is None else check_names(wanted, names)
    if motions is None:
        loads = {float(f"{np.median(log.normal_force):.3g}") for log in before}
        motions = candidate_motions(patch, law, normal_force=sorted(loads) or [1.0])
    candidates = as_tuple("motions", motions, Log)
    for each in candidates:
        if not each.twist.any():
            raise InvalidValueError(
                f"twist of {each.name}", "move the contact", "0 throughout"
            )
    if noise is not None:
        sigma = check_noise("noise", noise)
    elif before:
        sigma = wrench_noise(before)
    else:
        load = max(each.normal_force.max() for each in candidates)
        validation.positive("normal_force of the motions", load)
        force = NOISE * law.mu_c * load
        sigma = np.array([force, force, force * patch.contact_radius(load)])
    later = tuple(group for group in groups if group != "twist")
    information = _Information(patch, law, names, later, sigma)
    so_far = information.prior()
    if before:
        so_far = so_far + information.of_logs(before, groups)
    start = information.covariance(so_far)
    pick = [names.index(name) for name in chosen]
    found = []
    for each in candidates:
        motion = information.expected(each)
        # a torque of 0 throughout would count as not measured
        measured = dataclasses.replace(motion, wrench=motion.wrench + finite(sigma))
        added = information.of_logs((measured,), later)
        after = information.covariance(so_far + added)
        gain = _entropy(start, pick) - _entropy(after, pick)
        found.append((gain, motion, information.errors(after)))
    found.sort(key=lambda each: -each[0])
    gains, expected, errors = zip(*found, strict=True)
    return MotionPlan(
        names,
        information.values,
        expected,
        np.array(gains),
        information.errors(start),
        np.array(errors),
    )


def current_estimate(
    found: Identification, patch: ContactPatch, law: LuGre
) -> tuple[ContactPatch, LuGre]:
    """Return patch and law to plan with: the values that `found` knows to a factor of about two, else those given.

    A value of `law` that lies outside the interval of `found` is moved to its middle.

    Raises InvalidValueError if `found` is not an Identification, or `law` not a LuGre law.
    """
    validation.instance("found", found, Identification, "an Identification")
    validation.instance("law", law, LuGre, "a LuGre law")
    given = {
        name: value
        for name, value in found.estimates.items()
        if found.errors[name] < KNOWN * abs(value)
    }
    good = {*given, "centre_x", "centre_y"}
    for name, (low, high) in found.intervals().items():
        held = name in LAW and name not in (*given, "breakaway_ratio")
        if held and not low <= getattr(law, name) <= high:
            given[name] = 0.5 * (low + high)
    shape = {*SHAPE, *SOFT_FINGER} & set(found.names)
    if shape and shape <= good:
        patch = found.model.patch
    return patch, fitted_law(law, given)


@dataclass(eq=False)
class _Information:
    """Information of logs on the coordinates `[F]` of the contact and the disturbances `[S]` that all logs share."""

    patch: ContactPatch
    law: LuGre
    names: tuple[str, ...]
    groups: tuple[str, ...]
    noise: np.ndarray

    def __post_init__(self) -> None:
        ones = np.ones((10, 3))
        probe = Log(np.linspace(0.0, 1.0, 10), ones, ones, 1.0)
        self._probe = self.problem([probe], self.groups)
        self.values = self._probe.start_values()
        coordinates = Coordinates(self.names, self.values, self.law.mu_c)
        self._scale = coordinates.scale
        self._slopes = coordinates.slopes(coordinates.of(self.values))

    def problem(self, logs: Sequence[Log], groups: Sequence[str]) -> LogProblem:
        """Make the problem of a fit of these logs."""
        return LogProblem(
            logs,
            self.patch,
            self.names,
            self.law,
            FitOptions(nuisance=groups, refine=REFINE),
        )

    def prior(self) -> np.ndarray:
        """Return the information `[F + S, F + S]` a priori: a factor of 20 either way, and the rig's widths."""
        centre = self._probe.fixed_patch.contact_radius() / self._scale
        width = np.where(np.isin(self.names, ("centre_x", "centre_y")), centre, PRIOR)
        width[np.isin(self.names, ("gamma", "mu_s"))] = SHAPE_PRIOR
        shared = sum(column.log is None for column in self._probe.rig.columns)
        return np.diag(np.concatenate([width**-2.0, np.ones(shared)]))

    def expected(self, motion: Log) -> Log:
        """Return the motion with its expected wrenches."""
        unmeasured = dataclasses.replace(motion, wrench=np.ones_like(motion.twist))
        problem = self.problem([unmeasured], ())
        return dataclasses.replace(motion, wrench=problem.shown(self.values))

    def of_logs(self, logs: Sequence[Log], groups: Sequence[str]) -> np.ndarray:
        """Compute the information `[F + S, F + S]` of logs, with the disturbances of each log estimated along."""
        problem = self.problem(logs, groups)
        coordinates = problem.coordinates(self.values)
        values = coordinates.values(coordinates.of(self.values))
        jacobian = problem.linearised(values, problem.sigma(values, self.noise))[1]
        jacobian = jacobian @ coordinates.slopes(coordinates.of(values))
        whole = jacobian.T @ jacobian
        of_log = [column.log is not None for column in problem.rig.columns]
        own = np.append(np.full(len(self.names), False), of_log).astype(bool)
        inner = whole[np.ix_(own, own)] + np.eye(own.sum())
        both = whole[np.ix_(~own, own)]
        return whole[np.ix_(~own, ~own)] - both @ np.linalg.solve(inner, both.T)

    def covariance(self, information: np.ndarray) -> np.ndarray:
        """Compute the covariance `[F, F]` of the coordinates of the contact."""
        size = 1.0 / np.sqrt(np.diag(information))
        strengths, axes = np.linalg.eigh(information * np.outer(size, size))
        axes = size[: len(self.names), None] * axes[: len(self.names)]
        return axes / np.maximum(strengths, FAINT * strengths[-1]) @ axes.T

    def errors(self, covariance: np.ndarray) -> np.ndarray:
        """Return the standard errors `[F]` of the values."""
        return np.sqrt(np.diag(self._slopes @ covariance @ self._slopes.T))


def _entropy(covariance: np.ndarray, pick: Sequence[int]) -> float:
    """Compute the entropy of the picked coordinates [bit], up to a constant."""
    return 0.5 * np.linalg.slogdet(covariance[np.ix_(pick, pick)])[1] / np.log(2.0)


# ---------------------------------------------------------------------- motions to choose from


def candidate_motions(
    patch: ContactPatch,
    law: LuGre,
    *,
    normal_force: float | Sequence[float] = 1.0,
    speed: float = 0.05,
    spin: float | None = None,
    duration: float = 2.0,
    rate: float = 1000.0,
) -> tuple[Log, ...]:
    """Make motions to choose from for an experiment: six for each load, from rest, as logs whose wrenches are zero.

    They are: growing sines of slide and spin, a slide that becomes faster, slow and quick reversals over three times
    the distance at which bristles break away, spin alone, and rotation during a slide.

    Parameters
    ----------
    patch, law
        The contact, as far as it is known.
    normal_force
        One load or several [N].
    speed, spin
        The largest that the rig can produce [m/s, rad/s]; None for `spin` moves the rim of the contact as fast as
        `speed`.
    duration, rate
        Length of each motion [s] and samples per second [Hz].

    Raises
    ------
    InvalidValueError
        A number that is not > 0, more than 20 loads, or fewer than 100 or more than 100000 samples.
    """
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    validation.instance("law", law, LuGre, "a LuGre law")
    given = validation.numbers("normal_force", normal_force)
    if given.ndim > 1 or not 1 <= given.size <= LOADS:
        raise InvalidValueError(
            "normal_force",
            f"be one load or a list of up to {LOADS}",
            f"shape {given.shape}",
        )
    loads = [validation.positive("normal_force", each) for each in given.reshape(-1)]
    speed = validation.positive("speed", speed)
    duration = validation.positive("duration", duration)
    rate = validation.positive("rate", rate)
    samples = duration * rate
    if not SAMPLES[0] <= samples <= SAMPLES[1]:
        raise InvalidValueError(
            "duration * rate",
            f"be between {SAMPLES[0]} and {SAMPLES[1]} samples",
            f"{samples:g}",
        )
    time = np.arange(round(samples)) / rate
    result = []
    for load in loads:
        radius = patch.contact_radius(load)
        turn = speed / radius if spin is None else validation.positive("spin", spin)
        twists = _twists(time, speed, turn, law.mu_s / law.sigma_0, rate)
        for name, twist in twists.items():
            called = f"{name}, {load:g} N" if len(loads) > 1 else name
            result.append(Log(time, twist, np.zeros_like(twist), load, called))
    return tuple(result)


def _twists(
    time: np.ndarray, speed: float, spin: float, breakaway: float, rate: float
) -> dict[str, np.ndarray]:
    """Return the twists `[T, 3]` of the motions by name."""
    share = time / time[-1]
    zero = np.zeros_like(time)
    # From 0, soon by the same factor in the same time.
    grown = SLOWEST ** (1.0 - share) - SLOWEST * (1.0 - share)
    sines = [np.sin(2.0 * np.pi * hertz * time) for hertz in SINES]
    swept = (0.03 + 0.97 * share**2) * np.array(sines)

    def reversals(hertz: float) -> np.ndarray:
        hertz = min(hertz, speed / (2.0 * np.pi * STROKE * breakaway))
        pace = 2.0 * np.pi * hertz
        return STROKE * breakaway * pace * np.sin(pace * time)

    columns: dict[str, tuple[Any, Any, Any]] = {
        "grown sines": (speed * swept[0], 0.7 * speed * swept[1], spin * swept[2]),
        "slide from slow to fast": (speed * grown, zero, zero),
        "slow reversals": (reversals(SLOW), zero, zero),
        "quick reversals": (reversals(rate / PER_PERIOD), zero, zero),
        "spin": (zero, zero, spin * swept[2]),
        "rotation during a slide": (speed * grown, zero, spin * grown * sines[2]),
    }
    return {name: np.stack(column, -1) for name, column in columns.items()}
