"""Friction of a joint from goals or voltages, by simulated runs; terms are chosen by logs that were left out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.goal_verdicts import judge
from planarfriction.joints.numbers import Values, interval, least, quantile
from planarfriction.joints.problem import NEEDS, SHORT, TERMS, JointFitProblem
from planarfriction.joints.result import JointFit, Series, not_shown

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
        return (
            float(falls.mean()),
            float(scatter),
            [float(each.mean()) for each in halves],
        )

    @property
    def jackknife(self) -> dict[str, float]:
        """Standard error of each estimate by leaving out groups."""
        # Folds are alike: they differ that much less than samples drawn anew.
        more = np.sqrt(len(self.folds) - 1)
        return {
            name: float(more * np.std([each[name] for each in self.folds]))
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


def _check_related(
    problem: JointFitProblem, runs: Sequence[np.ndarray]
) -> Iterator[Verdict]:
    """Yield a verdict on a log that the run from its goal does not resemble, though others do.

    Raises InvalidValueError for several such logs, or one alone.
    """
    missed = {}
    for run, log in zip(runs, problem.logs, strict=True):
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
    for name, found in missed.items():
        yield Verdict(
            "fit",
            False,
            f"{name}: {found}: this log contradicts the others; check its gains and units, or leave it out",
        )


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
    if chosen:
        problem = base
        values = first.values
        for term in chosen:
            problem, values = with_term(problem, values, term)
        kept = attempt(problem, values, progress)
    # Again, since bristles may hide a fall of friction.
    for term in (*TERMS, "stribeck") if auto else ():
        has = kept.problem.terms
        if (
            term in has
            or NEEDS.get(term, term) not in (*has, term)
            or (term in pairs and "bristles" not in has)
        ):
            continue
        more = attempt(*with_term(kept.problem, kept.values, term), progress)
        pairs[term] = more, kept
        # Motor and load may have different shares.
        if term == "load" and not improves(more, kept):
            both = attempt(
                *with_term(more.problem, more.values, "directional"), progress
            )
            pairs[term] = (both, kept) if improves(both, kept) else pairs[term]
        kept = more if improves(*pairs[term]) else kept
    # What came later may explain what came before.
    for term in kept.problem.terms[:-1] if auto else ():
        rest = base.with_terms(
            [
                each
                for each in kept.problem.terms
                if each != term and NEEDS.get(each) != term
            ]
        )
        less = attempt(
            rest,
            minimise(rest, {name: kept.values[name] for name in rest.names}),
            progress,
        )
        pairs[term] = kept, less
        kept = kept if improves(kept, less) else less
    return result_of(kept, first, pairs)


def result_of(
    kept: Trial, first: Trial, pairs: Mapping[str, tuple[Trial, Trial]]
) -> JointFit:
    """Return the result of the trial that was kept: its intervals, and verdicts.

    Estimates also move if runs begin again at the measured motion: intervals count that shift.
    """
    problem = kept.problem
    values = kept.values
    runs = [
        trial.problem.simulated(trial.values, problem.logs) for trial in (kept, first)
    ]
    doubts = [*_check_related(problem, runs[0])]
    shifts = {name: abs(kept.again[name] - value) for name, value in values.items()}
    jackknife = kept.jackknife
    series = tuple(
        Series(log.name, log.time, log.q, fitted[:, 0], rest[:, 0])
        for log, fitted, rest in zip(problem.logs, *runs, strict=True)
    )
    spread = {name: float(np.hypot(jackknife[name], shifts[name])) for name in values}
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
