"""Fits of the friction of a joint, and the choice of its terms by logs that were left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.joints.log import JointLog, Plant, as_joint_logs
from planarfriction.joints.problem import NEEDS, PARAMETERS, SHORT, TERMS, Problem
from planarfriction.joints.result import JointFit, Trial, judge

SPANS = (SHORT, 0.6, np.inf)
"""Times [s] after which a simulated run begins again at the measured motion: short runs have one minimum, the last is
the whole log."""

GROUPS = 4
"""Least number of groups that are left out in turn; fewer logs are cut into parts."""

LEAST = 0.15
"""Least fall of the logarithm of left-out errors that a term must make: on synthetic joints whose friction and voltage
differ between logs, terms that are not there take up some of that and gain less than this in 95 % of them."""

FINE, MOST = 1e-5, 40
"""Share of the squared errors that a step of the search must gain, far below what one log more or less changes, and
most steps."""

BEST = 2
"""Number of starts of a term that are followed to the end."""


def minimise(
    problem: Problem, start: Mapping[str, float], spans: Sequence[float] = SPANS, without: Sequence[int] = ()
) -> dict[str, float]:
    """Return the values of least squared errors, then of least softened ones, which large errors sway less.

    Runs begin again after each of the `spans` in turn; softened errors are those of whole runs. Groups `without` do not
    count.
    """
    values = dict(start)
    for span in spans:
        values = _least(problem, values, span, without)
    width = float(np.median(np.abs(_rest(problem.errors(values), without))))
    return _least(problem, values, np.inf, without, loss="soft_l1", f_scale=max(width, 1e-12))


def _rest(groups: list[np.ndarray], without: Sequence[int]) -> np.ndarray:
    return np.concatenate([each for i, each in enumerate(groups) if i not in without])


def _least(
    problem: Problem, values: Mapping[str, float], span: float, without: Sequence[int], **loss: Any
) -> dict[str, float]:
    from scipy.optimize import least_squares

    kinds = [PARAMETERS[each] for each in problem.names]
    log = np.array([each.logarithmic for each in kinds])

    def factor(x: np.ndarray) -> np.ndarray:
        return np.exp(np.where(log, x, 0.0))

    def by_name(x: np.ndarray) -> dict[str, float]:
        return dict(zip(problem.names, np.where(log, factor(x), x).tolist(), strict=True))

    def coordinates(numbers: Sequence[float]) -> np.ndarray:
        return np.where(log, np.log(np.where(log, numbers, 1.0)), numbers)

    low, high = (coordinates([getattr(each, end) for each in kinds]) for end in ("low", "high"))
    slopes: Any = lambda x: _rest(problem.slopes(by_name(x), span), without) * factor(x)  # noqa: E731
    settings: Any = {"x_scale": "jac", "ftol": FINE, "max_nfev": MOST, **loss}
    found = least_squares(
        lambda x: _rest(problem.errors(by_name(x), span), without),
        np.clip(coordinates([values[each] for each in problem.names]), low, high),
        slopes,
        (low, high),
        **settings,
    )
    return by_name(found.x)


def with_term(problem: Problem, values: Mapping[str, float], term: str) -> tuple[Problem, dict[str, float]]:
    """Return a problem with one term more than that of `values`, and its best values from the best of its starts."""
    problem = problem.with_terms([*problem.terms, term])
    starts = [{**values, **guess} for guess in problem.guesses(term, values)]
    ranked = [starts[0], *sorted(starts[1:], key=lambda each: problem.costs(each, SHORT).mean())[: BEST - 1]]
    return problem, min((minimise(problem, each) for each in ranked), key=lambda each: problem.costs(each).mean())


def attempt(problem: Problem, values: dict[str, float], progress: Callable[[str], None]) -> Trial:
    """Fit a problem with each group left out, then with each half, and measure the errors of what was left out."""
    folds, errors, short, halves = [], [], [], []
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
    return Trial(problem, values, tuple(folds), again, np.array(errors), np.array(short), tuple(halves))


def improves(more: Trial, less: Trial) -> bool:
    """Return True if left-out errors fall by more than their scatter and `LEAST`, and by `LEAST` in either half too."""
    gain, scatter, halves = more.gains(less)
    return gain > scatter and min(gain, *halves) > LEAST


def identify_joint(
    logs: JointLog | Sequence[JointLog],
    plant: Plant,
    *,
    torque_gain: float | None = None,
    terms: Sequence[str] | str = "auto",
    progress: Callable[[str], None] | None = None,
) -> JointFit:
    """Estimate the friction of a joint, and of plant and drive what is not known, from logs of its motion.

    Logs with a torque are fitted to the torque that the measured motion takes; others to the position that a run from
    goal or voltage gives. `torque_gain` is a known kt/R [N m/V]. `terms` are some of "load", "stribeck", "bristles" and
    "directional", beside Coulomb and viscous friction. "auto" keeps a term only if the errors of logs that were left
    out fall by more than their scatter (t-test of their logarithms, 95 %, one-sided), and by 14 % at least (`LEAST`);
    by that much also in either half of the logs if the other half is fitted. Fewer than four logs are cut into parts
    that are left out in turn. `progress` is told each step; what it raises, and Ctrl-C, end the fit.

    Raises InvalidValueError for unknown terms, logs of both kinds, in ms or degrees, and a plant and drive that leave
    the scale of the torques open.
    """
    if progress is not None and not callable(progress):
        raise InvalidValueError("progress", "be a function of words, or None", progress)
    plant = validation.instance("plant", plant, Plant, "a Plant")
    logs, progress = as_joint_logs(logs, plant), progress or (lambda words: None)
    gain = None if torque_gain is None else validation.positive("torque_gain", torque_gain)
    auto = isinstance(terms, str) and terms == "auto"
    chosen = () if auto else tuple(validation.choices("terms", terms, TERMS))
    for term, other in NEEDS.items():
        if term in chosen and other not in chosen:
            raise InvalidValueError("terms", f"have {other} with {term}", chosen)
    if logs[0].torque is None and gain is None and not plant.mass and not plant.inertia:
        raise InvalidValueError("plant", "have a mass or an inertia, or torque_gain be given", plant)
    base = Problem(logs, plant, gain, (), -(-GROUPS // len(logs)))
    kept = first = attempt(base, minimise(base, base.start()), progress)
    pairs: dict[str, tuple[Trial, Trial]] = {}
    if chosen:
        problem, values = base, first.values
        for term in chosen:
            problem, values = with_term(problem, values, term)
        kept = attempt(problem, values, progress)
    for term in (*TERMS, "stribeck") if auto else ():  # again, since bristles may hide a fall of friction
        has = kept.problem.terms
        if term in has or NEEDS.get(term, term) not in (*has, term) or (term in pairs and "bristles" not in has):
            continue
        more = attempt(*with_term(kept.problem, kept.values, term), progress)
        pairs[term] = more, kept
        if term == "load" and not improves(more, kept):  # motor and load may have different shares
            both = attempt(*with_term(more.problem, more.values, "directional"), progress)
            pairs[term] = (both, kept) if improves(both, kept) else pairs[term]
        kept = more if improves(*pairs[term]) else kept
    for term in kept.problem.terms[:-1] if auto else ():  # what came later may explain what came before
        rest = base.with_terms([each for each in kept.problem.terms if each != term and NEEDS.get(each) != term])
        less = attempt(rest, minimise(rest, {name: kept.values[name] for name in rest.names}), progress)
        pairs[term] = kept, less
        kept = kept if improves(kept, less) else less
    fit = JointFit(**vars(kept), baseline=first, trials=pairs, verdicts=())
    return replace(fit, verdicts=judge(fit))
