"""Fits of the friction of a joint, and the choice of its terms by logs that were left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.joints.log import JointLog, Plant, as_joint_logs
from planarfriction.joints.problem import NEEDS, PARAMETERS, TERMS, Problem
from planarfriction.joints.result import SHORT, JointFit, Trial
from planarfriction.joints.verdicts import judge

SPANS = (SHORT, 0.6, np.inf)
"""Times [s] after which a simulated run begins again at the measured motion: short runs have one minimum, the last is
the whole log."""

GROUPS = 4
"""Least number of groups that are left out in turn; fewer logs are cut into parts."""

LEAST = 0.15
"""Least fall of the logarithm of left-out errors that a term must make: on synthetic joints whose friction and voltage
differ between logs, terms that are not there take up some of that and gain less than this in 95 % of them."""

FINE = 1e-5
"""Share of the squared errors that a step of the search must gain: far below what one log more or less changes."""

MOST = 40
"""Most steps of a search."""

BEST = 2
"""Number of starts of a term that are followed to the end."""


class Coordinates:
    """Scaled values of the parameters, their bounds, and the way back."""

    def __init__(self, names: Sequence[str], start: Mapping[str, float]):
        self.names, kinds = tuple(names), [PARAMETERS[each] for each in names]
        self._log = np.array([each.logarithmic for each in kinds])
        self._scale = np.array([max(abs(start[name]), kind.scale) for name, kind in zip(names, kinds, strict=True)])
        low, high = (np.array([getattr(each, end) for each in kinds]) for end in ("low", "high"))
        self.bounds = self._from(low), self._from(high)
        self.start = np.clip(self._from([start[each] for each in names]), *self.bounds)

    def _from(self, values: Any) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self._log, np.log(values), np.array(values) / self._scale)

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Return the parameters by name."""
        with np.errstate(over="ignore"):
            return dict(zip(self.names, np.where(self._log, np.exp(x), x * self._scale).tolist(), strict=True))

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Compute the slopes of the parameters by their scaled values, `[P]`."""
        return np.where(self._log, np.exp(np.where(self._log, x, 0.0)), self._scale)


def minimise(problem: Problem, start: Mapping[str, float], spans: Sequence[float] = SPANS, without: int = -1) -> dict:
    """Return the values of least squared errors, then of least softened ones, which large errors sway less.

    Runs begin again after each of the `spans` in turn; softened errors are those of whole runs.
    """
    values = dict(start)
    for span in spans:
        values = _descended(problem, values, span, without, np.inf)
    width = float(np.median(np.abs(np.concatenate(problem.errors(values, np.inf, without)))))
    return _descended(problem, values, np.inf, without, max(width, 1e-12))


def _descended(problem: Problem, values: Mapping[str, float], span: float, without: int, width: float) -> dict:
    """Minimise `sum 2 w^2 (sqrt(1 + (e/w)^2) - 1)`, squares for an infinite width w, by damped steps within bounds."""
    at = Coordinates(problem.names, values)
    x, damping = at.start, 1e-3

    def errors(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        found = np.concatenate(problem.errors(at.values(x), span, without))
        if not np.isfinite(width):
            return found, np.ones(1), float(found @ found)
        root = np.sqrt(1.0 + (found / width) ** 2)
        return found, 1.0 / root, float(2.0 * width**2 * np.sum(root - 1.0))

    here, weights, cost = errors(x)
    for _ in range(MOST):
        slopes = problem.slopes(at.values(x), span, without) * at.slopes(x)
        down, matrix = -slopes.T @ (weights * here), slopes.T @ (slopes * np.broadcast_to(weights, here.shape)[:, None])
        free = ((x > at.bounds[0]) | (down > 0.0)) & ((x < at.bounds[1]) | (down < 0.0))
        down, matrix = down[free], matrix[np.ix_(free, free)]
        scale, before = np.diag(matrix) + 1e-12 * np.trace(matrix) + 1e-300, cost
        while cost == before and damping < 1e9:
            tried = x.copy()
            tried[free] += np.linalg.solve(matrix + damping * np.diag(scale), down)
            tried = np.clip(tried, *at.bounds)
            found = errors(tried)
            if found[2] < cost:
                x, (here, weights, cost) = tried, found
            damping *= 0.1 if cost < before else 8.0
        if not before - cost > FINE * before:
            break
        damping = max(damping, 1e-9)
    return at.values(x)


def cost(problem: Problem, values: Mapping[str, float], span: float = np.inf) -> float:
    """Compute the mean absolute error of all groups, [rad] or [N m]."""
    return float(np.mean([np.abs(each).mean() for each in problem.errors(values, span)]))


def fit_term(problem: Problem, term: str, values: Mapping[str, float]) -> dict[str, float]:
    """Return the best values with one term more than `values` have, from the best of its starts."""
    starts = [{**values, **guess} for guess in problem.guesses(term, values)]
    first = SPANS[0] if not problem.by_torque else np.inf
    ranked = [starts[0], *sorted(starts[1:], key=lambda each: cost(problem, each, first))[: BEST - 1]]
    spans = SPANS if not problem.by_torque else SPANS[-1:]
    return min((minimise(problem, each, spans) for each in ranked), key=lambda each: cost(problem, each))


def attempt(problem: Problem, values: dict[str, float], progress: Callable[[str], None] = lambda words: None) -> Trial:
    """Fit a problem with each group left out, and measure the error of that group."""
    folds, errors, short = [], [], []
    words = " and ".join(problem.terms) or "Coulomb and viscous friction"
    for i, name in enumerate(problem.groups):
        progress(f"{words}; left out: {name}")
        fold = minimise(problem, values, (), without=i)
        folds.append(fold)
        errors.append(float(np.abs(problem.errors(fold)[i]).mean()))
        short.append(float(np.abs(problem.errors(fold, SHORT)[i]).mean()))
    return Trial(problem, values, tuple(folds), np.array(errors), np.array(short))


def improves(more: Trial, less: Trial) -> bool:
    """Return True if errors of left-out groups fall by more than their scatter, and by `LEAST`."""
    gain, scatter = more.gain(less)
    return gain > max(scatter, LEAST)


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
    "directional", beside Coulomb and viscous friction; "auto" keeps a term only if the errors of logs that were left
    out fall by more than their scatter (t-test of their logarithms, 95 %, one-sided) and by 14 % at least (`LEAST`).
    Fewer than four logs are cut into parts that are left out in turn. `progress` is told each step; what it raises, and
    Ctrl-C, end the fit.

    Raises InvalidValueError for unknown terms, logs of both kinds, and a plant and drive that leave the scale of the
    torques open.
    """
    if progress is not None and not callable(progress):
        raise InvalidValueError("progress", "be a function of words, or None", progress)
    logs, progress = as_joint_logs(logs), progress or (lambda words: None)
    plant = validation.instance("plant", plant, Plant, "a Plant")
    gain = None if torque_gain is None else validation.positive("torque_gain", torque_gain)
    auto = isinstance(terms, str) and terms == "auto"
    chosen = () if auto else tuple(validation.choices("terms", terms, TERMS))
    for term, other in NEEDS.items():
        if term in chosen and other not in chosen:
            raise InvalidValueError("terms", f"have {other} with {term}", chosen)
    if logs[0].torque is None and gain is None and not plant.mass and not plant.inertia:
        raise InvalidValueError("plant", "have a mass or an inertia, or torque_gain be given", plant)
    parts = -(-GROUPS // len(logs)) if len(logs) < GROUPS else 1
    if logs[0].torque is None and parts > 1:
        logs, parts = tuple(each for log in logs for each in log.cut(parts)), 1
    base = Problem(logs, plant, gain, (), parts)
    spans = SPANS if not base.by_torque else SPANS[-1:]
    kept = first = attempt(base, minimise(base, base.start(), spans), progress)
    pairs: dict[str, tuple[Trial, Trial]] = {}
    if not auto:
        problem, values = base, dict(first.values)
        for term in chosen:
            problem, values = _with(problem, values, term)
        kept = attempt(problem, values, progress) if chosen else first
        return JointFit(kept, first, pairs, judge(kept, pairs))
    for term in (*TERMS, "stribeck"):  # again, since bristles may hide a fall of friction
        has = kept.problem.terms
        if term in has or NEEDS.get(term, term) not in (*has, term) or (term in pairs and "bristles" not in has):
            continue
        more = attempt(*_with(kept.problem, kept.values, term), progress)
        pairs[term] = more, kept
        kept = more if improves(more, kept) else kept
    for term in kept.problem.terms[:-1]:  # what came later may explain what came before
        rest = base.with_terms([each for each in kept.problem.terms if each != term and NEEDS.get(each) != term])
        less = attempt(rest, minimise(rest, {name: kept.values[name] for name in rest.names}, spans), progress)
        pairs[term] = kept, less
        kept = kept if improves(kept, less) else less
    return JointFit(kept, first, pairs, judge(kept, pairs))


def _with(problem: Problem, values: Mapping[str, float], term: str) -> tuple[Problem, dict[str, float]]:
    problem = problem.with_terms([*problem.terms, term])
    return problem, fit_term(problem, term, values)
