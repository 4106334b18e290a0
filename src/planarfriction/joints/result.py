"""Result of the fit of a joint: values with their spread, errors of left-out logs, verdicts on what the logs say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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


LAGS = np.arange(-20, 61) * 1e-3
"""Delays of a reported speed that are tried [s]."""

LATE = 3e-3
"""Delay of a reported speed above which it is named [s]."""

FULL, STANDING, LONG = 0.999, 0.02, 0.1
"""Duty that counts as full, share of the largest speed below which a joint stands, and time that it stands [s]."""

WORDS = {
    "load": ("the level grows with the torque through the gears", "not load-dependent as far as these logs tell"),
    "stribeck": ("friction falls with speed from rest on", "no fall of friction with speed was seen"),
    "bristles": ("the joint bends before it slips", "give rigid friction, or measure slow reversals"),
    "directional": (
        "torque of the motor and of the load raise the level by different shares",
        "no difference between motor and load driving was seen",
    ),
}
"""Meaning of a term that was kept, and of one that was not."""


def judge(fit: JointFit) -> tuple[Verdict, ...]:
    """Return all verdicts on a fit."""
    return (*_on_terms(fit), *_on_drive(fit), *_on_logs(fit))


def _on_terms(fit: JointFit) -> Iterator[Verdict]:
    for term, (trial, without) in fit.trials.items():
        gain, scatter, halves = trial.gains(without)
        ratio, low, high, *both = np.exp([-gain, -gain - scatter, -gain + scatter, *np.negative(halves)])
        numbers = f"errors of left-out logs are {ratio:.2f} ({low:.2f} to {high:.2f}) of those without it"
        numbers += f", {both[0]:.2f} and {both[1]:.2f} if half of the logs are fitted"
        good = term in fit.terms
        if term == "load":
            numbers += f", b = {trial.values['load']:.2g}"
        yield Verdict(term, good, f"{WORDS[term][0 if good else 1]} ({numbers})")
    for name, error in fit.spread.items():
        value = fit.values[name]
        if name in ("sigma_0", "sigma_1", "v_s", "rise") and not 2.0 * error < value:
            yield Verdict(name, False, f"spread {error:.2g} of {value:.2g} between fits")


def _on_drive(fit: JointFit) -> Iterator[Verdict]:
    problem, values, gain = fit.problem, fit.values, fit.torque_gain
    if gain is None:
        return
    if "back_emf" in values:
        emf = values["back_emf"]
        kt, resistance = emf / gain, emf / gain**2
        text = f"kt/R = {gain:.3g} N m/V; with the drive off: kt = {kt:.3g} N m/A, R = {resistance:.3g} Ohm"
        yield Verdict("torque_gain", True, text)
    else:
        yield Verdict("torque_gain", True, f"only kt/R = {gain:.3g} N m/V is known, neither kt nor R")
        text = "no log with the drive off: viscous friction and back-EMF cannot be told apart"
        yield Verdict("sigma_2", False, f"{text}, {values['sigma_2']:.3g} N m s/rad is both")
    if problem.plant.mass and problem.plant.arm_mass is None and problem.torque_gain is None:
        share = 0.5 / problem.plant.mass  # half the mass of an arm counts, in %
        text = f"an arm without mass is assumed: all torques grow by {share:.2g} % for each 10 g of an arm"
        yield Verdict("arm_mass", False, text)


def speed_lag(log: JointLog) -> float:
    """Estimate by how much the reported speed lags the slope of q [s]."""
    inner = slice(len(LAGS), -len(LAGS)) if len(log.time) > 4 * len(LAGS) else slice(None)
    misses = [float(np.abs(np.interp(log.time - lag, log.time, log.speed) - log.dq)[inner].mean()) for lag in LAGS]
    return float(LAGS[int(np.argmin(misses))])


def standing(log: JointLog) -> np.ndarray:
    """Return the mask of samples that stand at full duty for `LONG`, `[T]`."""
    if log.goal is None or log.drive is None:
        return np.zeros(len(log.time), dtype=bool)
    speed = np.abs(log.speed)
    full = (np.abs(log.drive.duty(log.goal - log.q)) >= FULL) & (log.on > 0.0)
    mask = full & (speed < STANDING * speed.max())
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    for first, last in edges.reshape(-1, 2):
        if log.time[last - 1] - log.time[first] < LONG:
            mask[first:last] = False
    return mask


def _on_logs(fit: JointFit) -> Iterator[Verdict]:
    lags = [speed_lag(log) for log in fit.problem.logs if log.dq is not None]
    if lags and abs(lag := float(np.median(lags))) > LATE:
        text = f"the reported speed lags by {1e3 * lag:.0f} ms ({1e3 * min(lags):.0f} to {1e3 * max(lags):.0f})"
        yield Verdict("dq", False, f"{text}: the slope of q was used")
    for i, log in enumerate(() if fit.problem.by_torque else fit.problem.logs):
        if (mask := standing(log)).any():
            yield from _on_standing(fit, i, mask)


def _on_standing(fit: JointFit, i: int, mask: np.ndarray) -> Iterator[Verdict]:
    """Compare a log that stands at full duty with what the others say: it must lie within the level of friction."""
    log, values = fit.problem.logs[i], fit.folds[i * fit.problem.parts]
    plant, joint = fit.problem.plant_numbers(values, log), fit.problem.friction(values)
    driven = plant.torque_gain * log.volts[mask]
    outside = (log.outside - plant.moment * np.sin(log.q - plant.offset))[mask]
    most = joint.mu_s + np.abs(joint.load_motor * driven - joint.load_external * outside)
    over = float(np.median(np.abs(driven + outside) - most))
    if over > 0.0:
        seconds = float(mask.sum() * np.median(np.diff(log.time)))
        text = f"{log.name}: saturated and standing for {seconds:.2g} s at {np.median(log.q[mask]):.2f} rad"
        text += f": this log contradicts the others, by which {over:.2g} N m are left over to move it"
        yield Verdict("fit", False, f"{text}; look for a current limit, heat or a stop")
