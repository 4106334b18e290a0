"""Friction of a joint from goals or voltages, by simulated runs: the choice of terms, and verdicts on the fit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.log import JointLog, runs
from planarfriction.joints.problem import (
    NEEDS,
    SHORT,
    TERMS,
    JointFit,
    JointFitProblem,
    Series,
    Values,
    friction_of,
    interval,
    least,
    not_shown,
    quantile,
)

LAGS = np.arange(-20, 61) * 1e-3
"""Delays of a reported speed that are tried [s]."""

LATE = 3e-3
"""Delay of a reported speed above which it is named [s]."""

FULL = 0.999
"""Duty that counts as full."""

STANDING = 0.02
"""Share of the largest speed below which a joint stands."""

LONG = 0.1
"""Time [s] for which a joint stands."""

WORDS = {
    "load": (
        "the level grows with the torque through the gears",
        "not load-dependent within the accuracy of these logs",
    ),
    "stribeck": (
        "friction falls with speed from rest on",
        "no fall of friction with speed was seen",
    ),
    "bristles": (
        "the joint bends before it slips",
        "give rigid friction, or measure slow reversals",
    ),
    "directional": (
        "torque of the motor and of the load raise the level by different shares",
        "no difference between motor and load driving was seen",
    ),
}
"""Meaning of a term that was kept, and of one that was not."""


def judge(kept: Trial, pairs: Mapping[str, tuple[Trial, Trial]]) -> Iterator[Verdict]:
    """Yield the verdicts on a trial that was kept, and on the `pairs` of trials with and without a term."""
    for term, (trial, without) in pairs.items():
        gain, scatter, halves = trial.gains(without)
        ratio, low, high, *both = np.exp(
            [-gain, -gain - scatter, -gain + scatter, *np.negative(halves)]
        )
        numbers = f"errors of held-out logs are {ratio:.2f} ({low:.2f} to {high:.2f}) of those without it"
        numbers += f", {both[0]:.2f} and {both[1]:.2f} if half of the logs are fitted"
        good = term in kept.terms
        if term == "load":
            numbers += f", b = {trial.values['load']:.2g}"
        yield Verdict(term, good, f"{WORDS[term][0 if good else 1]} ({numbers})")
    problem = kept.problem
    values = kept.values
    gain = values.get("torque_gain", problem.torque_gain or 0.0)
    if "back_emf" in values:
        emf = values["back_emf"]
        kt = emf / gain
        resistance = emf / gain**2
        text = f"kt/R = {gain:.3g} N m/V; with the drive off: kt = {kt:.3g} N m/A, R = {resistance:.3g} Ohm"
        yield Verdict("torque_gain", True, text)
    else:
        yield Verdict(
            "torque_gain",
            True,
            f"only kt/R = {gain:.3g} N m/V is known, neither kt nor R",
        )
        text = "no log with the drive off: viscous friction and back-EMF cannot be told apart"
        yield Verdict(
            "sigma_2", False, f"{text}, {values['sigma_2']:.3g} N m s/rad is both"
        )
    if (
        problem.plant.mass
        and problem.plant.arm_mass is None
        and problem.torque_gain is None
    ):
        share = 0.5 / problem.plant.mass  # half the mass of an arm counts, in %
        text = f"an arm without mass is assumed: all torques grow by {share:.2g} % for each 10 g of an arm"
        yield Verdict("arm_mass", False, text)
    yield from lags(problem.logs)
    for i, log in enumerate(problem.logs):
        mask = standing(log)
        if not mask.any():
            continue
        # a log that stands at full duty must lie within the level of friction that the others show
        values = kept.folds[i * problem.parts]
        plant = problem.plant_numbers(values, log)
        joint = friction_of(values)
        driven = plant.torque_gain * log.volts[mask]
        outside = (log.outside - plant.moment * np.sin(log.q - plant.offset))[mask]
        load = joint.load_motor * driven - joint.load_external * outside
        over = np.median(np.abs(driven + outside) - joint.mu_s - np.abs(load))
        if over > 0.0:
            seconds = mask.sum() * np.median(np.diff(log.time))
            text = f"{log.name}: saturated and standing for {seconds:.2g} s at {np.median(log.q[mask]):.2f} rad"
            text += f": this log contradicts the others, by which {over:.2g} N m are left over to move it"
            text += "; look for a current limit, heat or a stop"
            yield Verdict("fit", False, text)


def speed_lag(log: JointLog) -> float:
    """Estimate by how much the reported speed lags the slope of q [s]."""
    inner = (
        slice(len(LAGS), -len(LAGS)) if len(log.time) > 4 * len(LAGS) else slice(None)
    )
    misses = [
        float(
            np.abs(np.interp(log.time - lag, log.time, log.speed) - log.dq)[
                inner
            ].mean()
        )
        for lag in LAGS
    ]
    return LAGS[np.argmin(misses)]


def standing(log: JointLog) -> np.ndarray:
    """Return the mask of samples that stand at full duty for `LONG`, `[T]`."""
    if log.goal is None or log.drive is None:
        return np.zeros(len(log.time), dtype=bool)
    speed = np.abs(log.speed)
    full = (np.abs(log.drive.duty(log.goal - log.q)) >= FULL) & (log.on > 0.0)
    mask = full & (speed < STANDING * speed.max())
    for first, last in runs(mask):
        if log.time[last - 1] - log.time[first] < LONG:
            mask[first:last] = False
    return mask


def lags(logs: Sequence[JointLog]) -> Iterator[Verdict]:
    """Yield a verdict on a reported speed that lags."""
    late = [speed_lag(log) for log in logs if log.dq is not None]
    if late and abs(lag := np.median(late)) > LATE:
        text = f"the reported speed lags by {1e3 * lag:.0f} ms ({1e3 * min(late):.0f} to {1e3 * max(late):.0f})"
        yield Verdict("dq", False, f"{text}: the slope of q was used")


SPANS = (SHORT, 0.6, np.inf)
"""Times [s] after which a simulated run begins again at the measured motion: short runs have one minimum, the last is
the whole log."""

GROUPS = 4
"""Least number of groups that are left out in turn; fewer logs are cut into parts."""

LEAST = 0.15
"""Least fall of the logarithm of left-out errors that a term must make: on synthetic joints whose friction and voltage
differ between logs, terms that are not there take up some of that and gain less than this in 95 % of them."""

MOST = 40
"""Most steps of a search."""

UNRELATED = 0.7
"""Mean error over the mean deviation of the angle from its mean from which on a run has nothing to do with the log:
beside one log that contradicts them, the runs of the others miss by up to 0.5."""


@dataclass(frozen=True)
class Trial:
    """Fit of one choice of terms, with a fit for each group of samples that was left out."""

    problem: JointFitProblem
    """Logs, plant, and the terms that were fitted."""
    values: dict[str, float]
    """Estimates by name."""
    folds: tuple[dict[str, float], ...]
    """Estimates without each group."""
    again: dict[str, float]
    """Estimates by runs that begin again every `SHORT`."""
    errors: np.ndarray
    """Mean absolute error of each left-out group [rad]."""
    short: np.ndarray
    """Errors of simulated runs that begin again at the measured motion every `SHORT` [rad].

    A whole run that once stands where the joint went on says little about the rest: terms are judged by short ones.
    """
    halves: tuple[np.ndarray, ...]
    """Such errors of the groups of either half, when that half was left out."""

    @property
    def terms(self) -> tuple[str, ...]:
        """Terms beside Coulomb and viscous friction."""
        return self.problem.terms

    def gains(self, less: Trial) -> tuple[float, float, list[float]]:
        """Compute the mean logarithm of another trial's errors over this one's, its scatter, and that of either half.

        The scatter is that of a one-sided t-test, 95 %.
        """
        pairs = zip((less.short, *less.halves), (self.short, *self.halves), strict=True)
        falls, *halves = (
            np.log(np.maximum(one, 1e-300) / np.maximum(other, 1e-300))
            for one, other in pairs
        )
        scatter = (
            quantile(len(falls) - 1, 0.95) * falls.std(ddof=1) / np.sqrt(len(falls))
        )
        return falls.mean(), scatter, [each.mean() for each in halves]

    @property
    def jackknife(self) -> dict[str, float]:
        """Standard error of each estimate by leaving out groups."""
        # Folds are alike: they differ that much less than samples drawn anew.
        more = np.sqrt(len(self.folds) - 1)
        return {
            name: more * np.std([each[name] for each in self.folds])
            for name in self.values
        }


def minimise(
    problem: JointFitProblem,
    start: Values,
    spans: Sequence[float] = SPANS,
    without: Sequence[int] = (),
) -> dict[str, float]:
    """Return the values of least squared errors, then of least softened ones, which large errors sway less.

    Runs begin again after each of the `spans` in turn; softened errors are those of whole runs. Groups `without` do not
    count.
    """
    values = dict(start)
    for span in spans:
        values = _least(problem, values, span, without)
    width = float(
        np.median(np.abs(problem.errors(values)[~np.isin(problem.labels, without)]))
    )
    return _least(
        problem, values, np.inf, without, loss="soft_l1", f_scale=max(width, 1e-12)
    )


def _least(
    problem: JointFitProblem,
    values: Values,
    span: float,
    without: Sequence[int],
    **loss: Any,
) -> dict[str, float]:
    counted = ~np.isin(problem.labels, without)
    return least(
        lambda values: problem.errors(values, span)[counted],
        values,
        problem.names,
        True,
        max_nfev=MOST,
        **loss,
    )


def with_term(
    problem: JointFitProblem, values: Values, term: str
) -> tuple[JointFitProblem, dict[str, float]]:
    """Return a problem with one term more than that of `values`, and its best values from the best of its starts."""
    problem = problem.with_terms([*problem.terms, term])
    starts = [{**values, **guess} for guess in problem.guesses(term, values)]
    best = min(starts[1:], key=lambda each: problem.costs(each, SHORT).mean())
    ends = [minimise(problem, each) for each in (starts[0], best)]
    return problem, min(ends, key=lambda each: problem.costs(each).mean())


def attempt(
    problem: JointFitProblem, values: dict[str, float], progress: Callable[[str], None]
) -> Trial:
    """Fit a problem with each group left out, then with each half, and measure the errors of what was left out."""
    folds = []
    errors = []
    short = []
    halves = []
    words = " and ".join(problem.terms) or "Coulomb and viscous friction"
    for i, name in enumerate(problem.groups):
        progress(f"{words}; left out: {name}")
        folds.append(minimise(problem, values, (), [i]))
        errors.append(problem.costs(folds[i])[i])
        short.append(problem.costs(folds[i], SHORT)[i])
    for half in (each.tolist() for each in np.array_split(np.arange(len(folds)), 2)):
        progress(f"{words}; left out: {len(half)} of {len(folds)}")
        halves.append(problem.costs(minimise(problem, values, (), half), SHORT)[half])
    again = _least(problem, values, SHORT, ())
    return Trial(
        problem,
        values,
        tuple(folds),
        again,
        np.array(errors),
        np.array(short),
        tuple(halves),
    )


def improves(more: Trial, less: Trial) -> bool:
    """Return True if left-out errors fall by more than their scatter and `LEAST`, and by `LEAST` in either half too."""
    gain, scatter, halves = more.gains(less)
    return gain > scatter and min(gain, *halves) > LEAST


VAGUE = 0.5
"""Standard error over the value from which on the number of a term is not known."""


def fit_goals(
    base: JointFitProblem,
    chosen: Sequence[str],
    auto: bool,
    progress: Callable[[str], None],
) -> JointFit:
    """Fit the positions that runs from goal or voltage give, with the `chosen` terms, or with those that they ask for.

    Raises InvalidValueError for logs that no run from their goals resembles.
    """
    kept = first = attempt(base, minimise(base, base.start()), progress)
    pairs: dict[str, tuple[Trial, Trial]] = {}
    problem = base
    values = first.values
    for term in chosen:
        problem, values = with_term(problem, values, term)
    if chosen:
        kept = attempt(problem, values, progress)
    # Again, since bristles may hide a fall of friction.
    for term in (*TERMS, "stribeck") if auto else ():
        has = kept.terms
        lacks = NEEDS.get(term, term) not in (*has, term)
        if term in has or lacks or (term in pairs and "bristles" not in has):
            continue
        more = attempt(*with_term(kept.problem, kept.values, term), progress)
        pairs[term] = more, kept
        # Motor and load may have different shares.
        if term == "load" and not improves(more, kept):
            wider = with_term(more.problem, more.values, "directional")
            both = attempt(*wider, progress)
            pairs[term] = (both, kept) if improves(both, kept) else pairs[term]
        kept = more if improves(*pairs[term]) else kept
    # What came later may explain what came before.
    for term in kept.terms[:-1] if auto else ():
        others = [each for each in kept.terms if term not in (each, NEEDS.get(each))]
        rest = base.with_terms(others)
        start = {name: kept.values[name] for name in rest.names}
        less = attempt(rest, minimise(rest, start), progress)
        pairs[term] = kept, less
        kept = kept if improves(kept, less) else less
    return result_of(kept, first, pairs)


def result_of(
    kept: Trial, first: Trial, pairs: Mapping[str, tuple[Trial, Trial]]
) -> JointFit:
    """Return the result of the trial that was kept: its intervals, and verdicts.

    Estimates also move if runs begin again at the measured motion: intervals count that shift. A verdict names a log
    that the run from its goal does not resemble, though others do.

    Raises InvalidValueError for several such logs, or one alone.
    """
    problem = kept.problem
    values = kept.values
    runs = [
        trial.problem.simulated(trial.values, problem.logs) for trial in (kept, first)
    ]
    missed = {}
    for run, log in zip(runs[0], problem.logs, strict=True):
        error = np.abs(run[:, 0] - log.q).mean()
        swing = np.abs(log.q - log.q.mean()).mean()
        if error > UNRELATED * swing:
            missed[log.name] = (
                f"{error:.2g} rad left of a mean swing of {swing:.2g} rad about its mean"
            )
    if len(missed) > 1 or len(missed) == len(problem.logs):
        raise InvalidValueError(
            f"q of {', '.join(missed)}",
            "follow from goal or voltage: check units, signs, gains, and that all belong to one joint",
            next(iter(missed.values())),
        )
    doubts = [
        Verdict(
            "fit",
            False,
            f"{name}: {found}: this log contradicts the others; check its gains and units, or leave it out",
        )
        for name, found in missed.items()
    ]
    jackknife = kept.jackknife
    series = tuple(
        Series(log.name, log.time, log.q, fitted[:, 0], rest[:, 0])
        for log, fitted, rest in zip(problem.logs, *runs, strict=True)
    )
    spread = {
        name: float(np.hypot(jackknife[name], kept.again[name] - value))
        for name, value in values.items()
    }
    freedom = len(kept.folds) - 1
    unclear = {}
    for term in kept.terms:
        vague = [
            name
            for name in TERMS[term]
            if name != "sigma_1" and not spread[name] < VAGUE * values[name]
        ]
        bounded = [
            name for name in TERMS[term] if interval(name, values[name], 0.0) is None
        ]
        for name in [*bounded, *vague][:1]:
            unclear[term] = (
                f"{name} = {values[name]:.2g}, spread {spread[name]:.2g} between fits"
            )
    verdicts = (*judge(kept, pairs), *doubts, *not_shown(unclear))
    return JointFit(
        problem.logs, problem.settled(values), values.get("torque_gain", problem.torque_gain), kept.terms, values,
        spread, freedom, tuple(problem.groups), kept.errors, first.errors, series, unclear, verdicts,
    )  # fmt: skip
