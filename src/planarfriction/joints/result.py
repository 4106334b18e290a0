"""Result of the fit of a joint: values with their intervals, errors of the logs, verdicts on what the logs say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from planarfriction._support.described import described
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.friction import JointFriction
from planarfriction.joints.log import JointLog, Plant
from planarfriction.joints.numbers import PARAMETERS, interval, quantile
from planarfriction.joints.problem import JointFitProblem, friction_of


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
        heading = "left-out log" if self.unit == "rad" else "log"
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
