"""`plan_motion`: which motion adds most information to the logs so far.

With the derivatives J of the wrenches over their noise, information adds up over logs,

    C_0 = (P + sum over logs J' J)^-1,    C_m = (C_0^-1 + J_m' J_m)^-1,    gain = log2(det C_0 / det C_m) / 2   [bit],

P that of what is taken for granted. What the rig adds is estimated too: zeros and drift for each log, delay and
scale of the load cell once for all. To first order in the parameters, so the gain holds near the law that is given.

Sources: Lindley 1956 (gain of information); Chaloner and Verdinelli 1995 (its form for normal errors, section 4).
"""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.identify import parameters as known
from planarfriction.identify.candidates import candidate_motions
from planarfriction.identify.logs import Log, as_logs
from planarfriction.identify.nuisance import GROUPS, check_groups
from planarfriction.identify.parameters import ALL, PRIOR, SHAPE_PRIOR, Coordinates
from planarfriction.identify.problem import Problem, block_diag, given_noise
from planarfriction.identify.result import WIDTH, Identification
from planarfriction.identify.sensors import first_noise
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurfaceTablePublished
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_anisotropy

NOISE = 0.01
"""Noise over the largest sliding friction where nobody says it."""

REFINE = 4
"""Steps between two samples."""

KNOWN = 0.5
"""Standard error over the value above which a parameter counts as unknown."""


FAINT = 1e-14
"""Share of the largest information below which rounding decides."""


@dataclass(frozen=True, eq=False, repr=False)
class MotionPlan(ByValue):
    """Motions ranked by the information that they are expected to add, the best first; M motions, F parameters."""

    names: tuple[str, ...]
    """Names of the parameters."""
    values: np.ndarray
    """Their values, near which the plan is valid [SI], `[F]`."""
    motions: tuple[Log, ...]
    """The motions, with their expected wrenches."""
    gains: np.ndarray
    """Information that each motion is expected to add [bit], `[M]`."""
    errors_so_far: np.ndarray
    """Standard errors before any of these motions [SI], `[F]`."""
    errors: np.ndarray
    """Expected standard errors after each motion [SI], `[M, F]`."""

    @property
    def best(self) -> Log:
        """The motion that adds the most information."""
        return self.motions[0]

    def table(self) -> str:
        """Text in 80 columns: the gain of each motion and the parameter it leaves least certain; the errors before and
        after the best one."""
        lines = [f"{'motion':<38}{'gain [bit]':>10}   {'least certain afterwards'}"]
        for motion, gain, errors in zip(self.motions, self.gains, self.errors, strict=True):
            at = int(np.argmax(errors / self._sizes))
            lines.append(f"{motion.name[:37]:<38}{gain:>10.1f}   {self.names[at]}, {self._share(errors, at)}")
        after = [f"{'parameter':<18}{'value':>11}   {'error so far':>14}   {'after the best':>14}"]
        for i, (name, value) in enumerate(zip(self.names, self.values, strict=True)):
            before, then = self._share(self.errors_so_far, i), self._share(self.errors[0], i)
            after.append(f"{name:<18}{value:>11.4g}   {before:>14}   {then:>14}   {ALL[name].unit}")
        first = textwrap.fill(f"Next motion to measure: {self.best.name}.", WIDTH)
        return "\n\n".join([first, "\n".join(lines), "\n".join(after)])

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return self.table()

    @property
    def _sizes(self) -> np.ndarray:
        return np.where(self.values != 0.0, np.abs(self.values), 1.0)

    def _share(self, errors: np.ndarray, i: int) -> str:
        share = errors[i] / self._sizes[i]
        if self.values[i] == 0.0:
            return f"{errors[i]:.2g}"
        return f"{100.0 * share:.2g} %" if share < KNOWN else "unknown"


def plan_motion(
    patch: ContactPatch,
    law: LuGre,
    *,
    logs: Log | Sequence[Log] = (),
    motions: Log | Sequence[Log] | None = None,
    parameters: Sequence[str] = known.USUAL,
    wanted: Sequence[str] | None = None,
    noise: Sequence[float] | None = None,
    nuisance: Sequence[str] = GROUPS,
) -> MotionPlan:
    """Rank motions by the information that they are expected to add to that of the logs so far.

    Wrenches and derivatives are those of `ReducedModelPublished`; the information is Lindley's gain for normal errors
    (see the module).

    Parameters
    ----------
    patch, law
        The contact, as far as it is known: a guess before the first log, then `known_so_far`.
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
        Disturbances that the rig may add, as in `identify_lugre`; future motions are assumed to have no noise on the
        twist.

    Raises
    ------
    InvalidValueError
        A parameter breaks its rule, or a motion does not move.
    """
    names = known.check_names(parameters)
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    refuse_anisotropy(patch, "plan_motion")
    validation.instance("law", law, LuGre, "a LuGre law")
    if "breakaway_ratio" in names and law.elasto_plastic is None:
        raise InvalidValueError("parameters", "contain breakaway_ratio only for elasto-plastic bristles", names)
    groups, before = check_groups(nuisance), () if isinstance(logs, (list, tuple)) and not logs else as_logs(logs)
    chosen = names if wanted is None else known.check_names(wanted, names)
    if motions is None:
        loads = sorted({float(f"{np.median(log.normal_force):.3g}") for log in before}) or [1.0]
        motions = candidate_motions(patch, law, normal_force=loads)
    candidates = as_logs(motions)
    for each in candidates:
        if not each.twist.any():
            raise InvalidValueError(f"twist of {each.name}", "move the contact", "0 throughout")
    spread = _noise(noise, before, candidates, patch, law)
    task = _Task(patch, law, names, tuple(group for group in groups if group != "twist"), spread)
    so_far = task.granted() + (task.of_logs(before, groups) if before else 0.0)
    pick = [names.index(name) for name in chosen]
    start, expected, gains, errors = task.covariance(so_far), [], [], []
    for each in candidates:
        shown = task.expected(each)
        expected.append(shown)
        after = task.covariance(so_far + task.of_logs((task.measured(shown),), task.groups))
        gains.append(_entropy(start, pick) - _entropy(after, pick))
        errors.append(task.errors(after))
    order = np.argsort(-np.array(gains), kind="stable")
    return MotionPlan(
        names,
        task.values,
        tuple(expected[i] for i in order),
        np.array(gains)[order],
        task.errors(start),
        np.array(errors)[order],
    )


def known_so_far(found: Identification, patch: ContactPatch, law: LuGre) -> tuple[ContactPatch, LuGre]:
    """The patch and the law to plan with: values that `found` knows to within a factor of about two, else those given.

    A value of `law` that lies outside the interval of `found` is moved to its middle.

    Raises InvalidValueError if `found` is not an Identification, or `law` not a LuGre law.
    """
    validation.instance("found", found, Identification, "an Identification")
    validation.instance("law", law, LuGre, "a LuGre law")
    good = [name for name, value in found.estimates.items() if found.errors[name] < KNOWN * abs(value)]
    fields: dict[str, Any] = {
        name: found.estimates[name] for name in good if name in known.LAW and name != "breakaway_ratio"
    }
    for name, (low, high) in found.intervals().items():
        if name not in (*good, "breakaway_ratio") and name in known.LAW and not low <= getattr(law, name) <= high:
            fields[name] = 0.5 * (low + high)
    if "breakaway_ratio" in good:
        fields["elasto_plastic"] = found.law.elasto_plastic
    fields["mu_s"] = max(fields.get("mu_s", law.mu_s), fields.get("mu_c", law.mu_c))
    shape = {*known.SHAPE, *known.SOFT_FINGER} & set(found.names)
    moved = bool(shape) and shape <= {*good, "centre_x", "centre_y"}
    return (found.model.patch if moved else patch), dataclasses.replace(law, **fields)


class _Task:
    """The information of logs about the coordinates `[F]` of the contact and what all logs share of the rig `[S]`."""

    def __init__(self, patch: Any, law: LuGre, names: tuple[str, ...], groups: tuple[str, ...], noise: np.ndarray):
        self.patch, self.law, self.names, self.groups, self.noise = patch, law, names, groups, noise

    def problem(self, logs: Sequence[Log], groups: Sequence[str]) -> Problem:
        """The fit of these logs."""
        return Problem(
            logs, self.patch, self.names, self.law, LimitSurfaceTablePublished, "rest", REFINE, groups=groups
        )

    def granted(self) -> np.ndarray:
        """Information `[F + S, F + S]` that is taken for granted: a factor of 20 either way, and the rig's widths."""
        probe = self._probe()
        self.values = probe.start_values(self.law)
        self.coordinates = Coordinates(self.names, self.values, self.law.mu_c)
        self.slopes = self.coordinates.slopes(self.coordinates.of(self.values))
        width = np.full(len(self.names), PRIOR)
        for i, name in enumerate(self.names):
            if name in ("gamma", "mu_s"):
                width[i] = SHAPE_PRIOR
            elif name in ("centre_x", "centre_y"):
                width[i] = float(probe.model.patch.contact_radius()) / self.coordinates.scale[i]
        shared = sum(column.log is None for column in probe.rig.columns)
        return np.diag(np.concatenate([width**-2.0, np.ones(shared)]))

    def _probe(self) -> Problem:
        time = np.linspace(0.0, 1.0, 10)
        return self.problem([Log(time, np.ones((10, 3)), np.ones((10, 3)), np.ones(10))], self.groups)

    def expected(self, motion: Log) -> Log:
        """The motion with its wrenches."""
        problem = self.problem([dataclasses.replace(motion, wrench=np.ones_like(motion.twist))], ())
        return dataclasses.replace(motion, wrench=problem.shown(self.values)[0])

    def measured(self, log: Log) -> Log:
        """The log with wrenches off by their noise: a torque of 0 throughout would count as not measured."""
        return dataclasses.replace(log, wrench=log.wrench + np.where(np.isfinite(self.noise), self.noise, 0.0))

    def of_logs(self, logs: Sequence[Log], groups: Sequence[str]) -> np.ndarray:
        """Information `[F + S, F + S]` of logs, with what each adds of its own estimated along."""
        problem, count = self.problem(logs, groups), len(self.names)
        values = np.concatenate([self.values, np.zeros(len(problem.rig.columns))])
        jacobian = problem.linearised(values, problem.spread(values, self.noise))[1]
        jacobian = jacobian @ block_diag(self.slopes, np.diag(problem.rig.widths))
        whole = jacobian.T @ jacobian
        own = np.array([False] * count + [column.log is not None for column in problem.rig.columns])
        inner = whole[np.ix_(own, own)] + np.eye(int(own.sum()))
        both = whole[np.ix_(~own, own)]
        return whole[np.ix_(~own, ~own)] - both @ np.linalg.solve(inner, both.T)

    def covariance(self, information: np.ndarray) -> np.ndarray:
        """Covariance `[F, F]` of the coordinates of the contact."""
        size = 1.0 / np.sqrt(np.diag(information))
        strengths, axes = np.linalg.eigh(information * np.outer(size, size))
        strengths = np.maximum(strengths, FAINT * strengths[-1])
        inverse = (axes / strengths) @ axes.T * np.outer(size, size)
        return inverse[: len(self.names), : len(self.names)]

    def errors(self, covariance: np.ndarray) -> np.ndarray:
        """Standard errors `[F]` of the values."""
        return np.sqrt(np.diag(self.slopes @ covariance @ self.slopes.T))


def _entropy(covariance: np.ndarray, pick: Sequence[int]) -> float:
    """Entropy of the picked coordinates [bit], but for a constant."""
    return float(0.5 * np.linalg.slogdet(covariance[np.ix_(pick, pick)])[1] / np.log(2.0))


def _noise(given: Any, logs: Sequence[Log], motions: Sequence[Log], patch: ContactPatch, law: LuGre) -> np.ndarray:
    """Noise `[3]` of the wrenches: as given, that of the logs, or a share of friction."""
    if given is not None:
        return given_noise(given)
    if logs:
        return first_noise(logs)
    load = max(float(motion.normal_force.max()) for motion in motions)
    validation.positive("normal_force of the motions", load)
    force = NOISE * law.mu_c * load
    return np.array([force, force, force * float(patch.contact_radius(load))])
