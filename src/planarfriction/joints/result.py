"""Result of the fit of a joint: values with their spread, errors of left-out logs, verdicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.described import described
from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.friction import JointFriction
from planarfriction.joints.log import JointLog, Plant
from planarfriction.joints.problem import PARAMETERS, Problem
from planarfriction.pictures import picture


@dataclass(frozen=True)
class Trial:
    """Fit of one choice of terms, with a fit for each group of samples that was left out."""

    problem: Problem
    """Logs, plant, and the terms that were fitted."""
    values: dict[str, float]
    """Estimates by name."""
    folds: tuple[dict[str, float], ...]
    """Estimates without each group."""
    again: dict[str, float]
    """Estimates by runs that begin again every `SHORT`."""
    errors: np.ndarray
    """Mean absolute error of each left-out group [rad], or [N m]."""
    short: np.ndarray
    """Errors of simulated runs that begin again at the measured motion every `SHORT` [rad], or `errors`.

    A whole run that once stands where the joint went on says little about the rest: terms are judged by short ones.
    """
    halves: tuple[np.ndarray, ...]
    """Such errors of the groups of either half, when that half was left out."""

    def gains(self, less: Trial) -> tuple[float, float, list[float]]:
        """Compute the mean logarithm of another trial's errors over this one's, its scatter, and that of either half.

        The scatter is that of a one-sided t-test, 95 %.
        """
        from scipy.stats import t

        pairs = zip((less.short, *less.halves), (self.short, *self.halves), strict=True)
        falls, *halves = (np.log(np.maximum(one, 1e-300) / np.maximum(other, 1e-300)) for one, other in pairs)
        scatter = t.ppf(0.95, len(falls) - 1) * falls.std(ddof=1) / np.sqrt(len(falls))
        return float(falls.mean()), float(scatter), [float(each.mean()) for each in halves]

    @property
    def others(self) -> list[dict[str, float]]:
        """Estimates of other fits, which terms that are missing shift by other amounts."""
        return [self.again]

    @property
    def spread(self) -> dict[str, float]:
        """Standard error of each estimate: by leaving out groups (jackknife), and the largest shift to `others`."""
        n, names = len(self.folds), list(self.values)
        table = np.array([[each[name] for name in names] for each in (self.values, *self.others, *self.folds)])
        folds, shifts = table[-n:], table[:-n] - table[0]
        jackknife = np.sqrt((n - 1) / n * ((folds - folds.mean(axis=0)) ** 2).sum(axis=0))
        return dict(zip(names, np.hypot(jackknife, np.abs(shifts).max(axis=0)).tolist(), strict=True))

    def interval(self, name: str) -> tuple[float, float]:
        """Compute the 95 % interval of an estimate from its spread; factors for those searched by logarithm."""
        from scipy.stats import t

        value, kind = self.values[name], PARAMETERS[name]
        reach = float(t.ppf(0.975, len(self.folds) - 1)) * self.spread[name]
        if kind.logarithmic:
            factor = float(np.exp(min(reach / value, 700.0)))
            return value / factor, value * factor
        return max(value - reach, kind.low), min(value + reach, kind.high)

    @property
    def terms(self) -> tuple[str, ...]:
        """Terms beside Coulomb and viscous friction."""
        return self.problem.terms

    @property
    def friction(self) -> JointFriction:
        """The friction of the joint."""
        return self.problem.friction(self.values)

    @property
    def plant(self) -> Plant:
        """The plant with its estimates."""
        return self.problem.settled(self.values)

    @property
    def torque_gain(self) -> float | None:
        """kt/R, known or estimated [N m/V]; None for logs with a torque."""
        return self.values.get("torque_gain", self.problem.torque_gain)

    @property
    def unit(self) -> str:
        """Unit of the errors."""
        return "N m" if self.problem.by_torque else "rad"

    @property
    def error(self) -> float:
        """Mean absolute error over all groups, which were all fitted, [rad] or [N m]."""
        return float(self.problem.costs(self.values).mean())

    def simulate(self, log: JointLog) -> np.ndarray:
        """Simulate q and dq `[T, 2]` of a log from its goal or voltage."""
        return self.problem.simulated(self.values, [log])[0]

    def torque(self, log: JointLog) -> np.ndarray:
        """Compute the torque `[T]` [N m] that the measured motion of a log takes."""
        return self.problem.torque(self.values, log)


@described
@dataclass(frozen=True)
class JointFit(Trial):
    """Friction of a joint with the numbers of its plant and drive: the fit with the terms that were kept."""

    baseline: Trial
    """Fit of Coulomb and viscous friction alone."""
    trials: Mapping[str, tuple[Trial, Trial]]
    """Trials with and without a term, by the term."""
    verdicts: tuple[Verdict, ...]
    """Findings in words, each with its number."""

    @property
    def others(self) -> list[dict[str, float]]:
        """Estimates by runs that begin again every `SHORT`, and with terms that were tried besides."""
        return [self.again, *(more.values for more, _ in self.trials.values() if {*self.terms} < {*more.terms})]

    def table(self) -> str:
        """Return estimates, left-out errors and verdicts as text."""
        lines = [f"{'parameter':14} {'value':>11} {'std. error':>10}  95 % interval, unit"]
        for name, value in self.values.items():
            low, high = self.interval(name)
            lines.append(
                f"{name:14} {value:11.4g} {self.spread[name]:10.2g}  {low:.4g} to {high:.4g} {PARAMETERS[name].unit}"
            )
        lines += ["", f"{'left-out log':34} {'error':>9} {'Coulomb + viscous':>18}  {self.unit}"]
        names, both = [*self.problem.groups, "mean"], (self.errors, self.baseline.errors)
        rows = zip(names, *([*each, each.mean()] for each in both), strict=True)
        lines += [f"{name:34} {one:9.4g} {other:18.4g}" for name, one, other in rows]
        return "\n".join([*lines, "", *map(str, self.verdicts)])

    def plot(self) -> Any:
        """Draw a log with its simulation, what is left, and friction over speed at three loads."""
        return picture("joint", self)

    def to_dict(self) -> dict[str, Any]:
        """Return numbers and texts for JSON."""
        errors = {"errors_left_out": self.errors, "errors_coulomb_viscous": self.baseline.errors}
        return {
            "terms": list(self.terms),
            "parameters": {
                name: {"value": value, "spread": self.spread[name], "unit": PARAMETERS[name].unit,
                       "interval": list(self.interval(name))}
                for name, value in self.values.items()
            },
            "unit_of_errors": self.unit,
            "error_fitted": self.error,
            **{name: dict(zip(self.problem.groups, each.tolist(), strict=True)) for name, each in errors.items()},
            "verdicts": [str(each) for each in self.verdicts],
        }  # fmt: skip
