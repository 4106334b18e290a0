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

SHORT = 0.2
"""Time after which a simulated run begins again where terms are judged [s]."""


@dataclass(frozen=True)
class Trial:
    """Fit of one choice of terms, with a fit for each group that was left out."""

    problem: Problem
    values: Mapping[str, float]
    """Estimates by name."""
    folds: tuple[Mapping[str, float], ...]
    """Estimates without each group."""
    errors: np.ndarray
    """Mean absolute error of each left-out group [rad], or [N m]."""
    short: np.ndarray
    """Errors of simulated runs that begin again at the measured motion every `SHORT` [rad], or `errors`.

    A whole run that once stands where the joint went on says little about the rest: terms are judged by short ones.
    """

    def gain(self, less: Trial) -> tuple[float, float]:
        """Compute the mean logarithm of another trial's `short` over this one's, and its scatter (one-sided, 95 %)."""
        from scipy.stats import t

        falls = np.log(np.maximum(less.short, 1e-300) / np.maximum(self.short, 1e-300))
        return float(falls.mean()), float(t.ppf(0.95, len(falls) - 1) * falls.std(ddof=1) / np.sqrt(len(falls)))

    @property
    def spread(self) -> dict[str, float]:
        """Standard error of each estimate by leaving out groups (jackknife)."""
        n = len(self.folds)
        table = np.array([[fold[name] for name in self.values] for fold in self.folds])
        errors = np.sqrt((n - 1) / n * ((table - table.mean(axis=0)) ** 2).sum(axis=0))
        return dict(zip(self.values, errors.tolist(), strict=True))

    def interval(self, name: str) -> tuple[float, float]:
        """Compute the 95 % interval of an estimate from its spread; factors for those searched by logarithm."""
        from scipy.stats import t

        value, kind = self.values[name], PARAMETERS[name]
        reach = float(t.ppf(0.975, len(self.folds) - 1)) * self.spread[name]
        if kind.logarithmic:
            factor = float(np.exp(min(reach / value, 700.0)))
            return value / factor, value * factor
        return max(value - reach, kind.low), min(value + reach, kind.high)


@described
@dataclass(frozen=True)
class JointFit:
    """Friction of a joint with the numbers of its plant and drive."""

    trial: Trial
    """Fit of the terms that were kept."""
    baseline: Trial
    """Fit of Coulomb and viscous friction alone."""
    trials: Mapping[str, tuple[Trial, Trial]]
    """Trials with and without a term, by the term."""
    verdicts: tuple[Verdict, ...]
    """Findings in words, each with its number."""

    @property
    def terms(self) -> tuple[str, ...]:
        """Terms that were kept beside Coulomb and viscous friction."""
        return self.trial.problem.terms

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name."""
        return dict(self.trial.values)

    @property
    def spread(self) -> dict[str, float]:
        """Standard errors by leaving out logs."""
        return self.trial.spread

    @property
    def friction(self) -> JointFriction:
        """The friction of the joint."""
        return self.trial.problem.friction(self.trial.values)

    @property
    def plant(self) -> Plant:
        """The plant with its estimates."""
        return self.trial.problem.settled(self.trial.values)

    @property
    def torque_gain(self) -> float | None:
        """kt/R, known or estimated [N m/V]; None for logs with a torque."""
        return self.values.get("torque_gain", self.trial.problem.torque_gain)

    @property
    def unit(self) -> str:
        """Unit of the errors."""
        return "N m" if self.trial.problem.by_torque else "rad"

    @property
    def error(self) -> float:
        """Mean absolute error over all groups, which were all fitted, [rad] or [N m]."""
        return float(np.mean([np.abs(each).mean() for each in self.trial.problem.errors(self.values)]))

    def interval(self, name: str) -> tuple[float, float]:
        """Compute the 95 % interval of an estimate."""
        return self.trial.interval(name)

    def simulate(self, log: JointLog) -> np.ndarray:
        """Simulate q and dq `[T, 2]` of a log from its goal or voltage."""
        return self.trial.problem.simulated(self.values, log)

    def torque(self, log: JointLog) -> np.ndarray:
        """Compute the torque `[T]` [N m] that the measured motion of a log takes."""
        return self.trial.problem.torque(self.values, log)

    def table(self) -> str:
        """Return estimates, left-out errors and verdicts as text."""
        lines = [f"{'parameter':14} {'value':>11} {'std. error':>10}  95 % interval, unit"]
        for name, value in self.values.items():
            low, high = self.interval(name)
            lines.append(
                f"{name:14} {value:11.4g} {self.spread[name]:10.2g}  {low:.4g} to {high:.4g} {PARAMETERS[name].unit}"
            )
        lines += ["", f"{'left-out log':34} {'error':>9} {'Coulomb + viscous':>18}  {self.unit}"]
        rows = zip(self.trial.problem.groups, self.trial.errors, self.baseline.errors, strict=True)
        lines += [f"{name:34} {one:9.4g} {other:18.4g}" for name, one, other in rows]
        lines.append(f"{'mean':34} {self.trial.errors.mean():9.4g} {self.baseline.errors.mean():18.4g}")
        return "\n".join([*lines, "", *map(str, self.verdicts)])

    def plot(self) -> Any:
        """Draw a log with its simulation, what is left, and friction over speed at three loads."""
        return picture("joint", self)

    def to_dict(self) -> dict[str, Any]:
        """Return numbers and texts for JSON."""
        names = self.trial.problem.groups
        return {
            "terms": list(self.terms),
            "parameters": {
                name: {"value": value, "spread": self.spread[name], "unit": PARAMETERS[name].unit,
                       "interval": list(self.interval(name))}
                for name, value in self.values.items()
            },
            "unit_of_errors": self.unit,
            "error_fitted": self.error,
            "errors_left_out": dict(zip(names, self.trial.errors.tolist(), strict=True)),
            "errors_coulomb_viscous": dict(zip(names, self.baseline.errors.tolist(), strict=True)),
            "verdicts": [str(each) for each in self.verdicts],
        }  # fmt: skip
