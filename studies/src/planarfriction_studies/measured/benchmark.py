"""Every model on every task: fitted to the training cases, scored on the others, and reported."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import FrictionError, InvalidValueError
from planarfriction.sweeps.records import reason_of
from planarfriction_studies.measured.library import library
from planarfriction_studies.measured.pushes import published
from planarfriction_studies.measured.questions import Case
from planarfriction_studies.measured.scores import Measure, drawings, interval
from planarfriction_studies.measured.tasks import TASKS, Task

AT_ONCE = 16
"""Questions between two reports of progress."""


@dataclass(frozen=True)
class Score:
    """The value of one measure for a model."""

    value: float
    low: float
    """Lower end of the 95 % interval, from a bootstrap over independent cases."""
    high: float
    cases: int
    """Number of independent cases: tosses with their copies, or pushes."""


@dataclass(frozen=True, eq=False)
class Result:
    """The result of one model on one task."""

    scores: Mapping[str, Score]
    """Scores by the key of the measure."""
    answers: tuple[np.ndarray, ...]
    """Answers to the test cases, in their order."""
    errors: tuple[np.ndarray, ...]
    """Errors `[rows, columns]` of each test case, as the task defines them."""
    fitted: Mapping[str, float]
    """Fitted numbers by name."""
    checked: Mapping[str, Any]
    """Checks of the model's own uncertainty on the test cases, if it states any: numbers, or lists of them."""
    seconds: float
    """Time of fit and prediction [s]."""
    regions: np.ndarray | None = None
    """Regions of the final poses of slides `[K, 3, 3]`, for models that have `regions`."""


@dataclass
class Benchmark:
    """Models compared on measured data. `run` fills `results` model by model, so that an interrupt loses nothing.

    Raises `InvalidValueError` for names that are not known and models that cannot be called.
    """

    models: Mapping[str, Callable[[Any], np.ndarray]] | None = None
    """Models by name; by default those of the library that are installed."""
    tasks: Sequence[str] = tuple(TASKS)
    """Names of tasks."""
    folder: Path | None = None
    """Folder with the tables; by default those of the package."""
    seed: int = 0
    """Seed of the bootstrap."""
    results: dict[str, dict[str, Result]] = field(default_factory=dict, init=False)
    """Results by task and model."""
    left_out: list[str] = field(default_factory=list, init=False)
    """Models that were not run and cases that are not used, with the reason."""

    def __post_init__(self) -> None:
        self.tasks = [validation.choice("task", name, TASKS) for name in self.tasks]
        self.seed = validation.count("seed", self.seed, 0)
        if self.models is None:
            self.models = library(self.left_out)
        for name, model in self.models.items():
            if not callable(model):
                raise InvalidValueError(
                    f"model {name}", "be a function of a question", model
                )
        self.cases = {}
        for name in self.tasks:
            cases = TASKS[name].read(self.folder)
            refused = TASKS[name].refused(cases)
            self.left_out += [f"{cases[i].name}: {why}" for i, why in refused.items()]
            self.cases[name] = cases = [
                case for i, case in enumerate(cases) if i not in refused
            ]
            if len({case.is_training for case in cases}) != 2:
                raise InvalidValueError(
                    f"table of {name}",
                    "contain cases to fit and cases to test",
                    f"{len(cases)} cases",
                )

    def test(self, task: str) -> list[Case]:
        """Return the cases that are scored."""
        return [case for case in self.cases[task] if not case.is_training]

    def run(
        self, progress: Callable[[str], None] | None = None
    ) -> dict[str, dict[str, Result]]:
        """Fit and score every model on every task; returns `results`.

        Raises `InvalidValueError` if a model raised an error, or gave an answer of the wrong shape or with numbers that
        are not finite. The other models are run first, and `results` has theirs.
        """
        say = (lambda text: None) if progress is None else progress
        wrong: list[Exception] = []
        for name in self.tasks:
            task = TASKS[name]
            test = self.test(name)
            training = [case for case in self.cases[name] if case.is_training]
            for called, model in (self.models or {}).items():
                say(f"{name}: {called}, fit")
                begun = time.perf_counter()
                try:
                    fitted = model.fit(training) if hasattr(model, "fit") else model  # pyright: ignore
                    answers = _answers(
                        fitted,
                        called,
                        test,
                        lambda part, n=name, c=called: say(f"{n}: {c}, {part}"),
                    )
                except NotImplementedError:
                    continue  # a model need not answer every task
                except Exception as error:
                    wrong.append(_failure(called, error))
                    continue
                errors = tuple(
                    task.errors(case, answer)
                    for case, answer in zip(test, answers, strict=True)
                )
                # friction coefficients cancel in the other tasks
                told = name == "slides" or (name == "onsets" and fitted is not model)
                values = (
                    fitted.fitted_values()
                    if told and hasattr(fitted, "fitted_values")
                    else {}
                )
                checked = fitted.check(test) if hasattr(fitted, "check") else {}
                regions = (
                    fitted.regions([case.question for case in test])
                    if hasattr(fitted, "regions")
                    else None
                )
                seconds = time.perf_counter() - begun
                scores = score(task, test, errors, self.seed)
                self.results.setdefault(name, {})[called] = Result(
                    scores, tuple(answers), errors, values, checked, seconds, regions
                )
        if wrong:
            raise wrong[0]
        return self.results


def _failure(name: str, error: Exception) -> Exception:
    """Return the error of a model as one of the library, whose cause it is."""
    if isinstance(error, FrictionError):
        return error
    told = InvalidValueError(f"model {name}", "answer its questions", reason_of(error))
    told.__cause__ = error
    return told


def _answers(
    model: Any, name: str, cases: Sequence[Case], say: Callable[[str], None]
) -> list[np.ndarray]:
    answers: list[np.ndarray] = []
    questions = [case.question for case in cases]
    for first in range(0, len(cases), AT_ONCE):
        say(f"{first} of {len(cases)}")
        part = questions[first : first + AT_ONCE]
        answers += (
            model.answer_all(part)
            if hasattr(model, "answer_all")
            else [model(each) for each in part]
        )
    return [
        validation.array(f"answer of {name} to {case.name}", answer, case.answer.shape)
        for case, answer in zip(cases, answers, strict=True)
    ]


def score(
    task: Task, cases: Sequence[Case], errors: Sequence[np.ndarray], seed: int
) -> dict[str, Score]:
    """Compute each measure of a task over its cases, with the interval of a bootstrap over independent ones."""
    found = {}
    for measure in task.measures:
        values, groups = rows_of(task, measure, cases, errors)
        if not len(values):
            continue
        low, high = interval(measure.total(values, drawings(groups, seed)))
        found[measure.key] = Score(
            float(measure.total(values)), low, high, len(set(groups))
        )
    return found


def rows_of(
    task: Task, measure: Measure, cases: Sequence[Case], errors: Sequence[np.ndarray]
):
    """Return errors `[N]` that a measure counts, and the groups that they belong to."""
    values = []
    groups = []
    for case, rows in zip(cases, errors, strict=True):
        if measure.board in ("", case.board):
            values.append(rows[:, measure.column])
            # There each row is a push, in the others a case is one.
            one_each = task.name == "pushes"
            groups += (
                [f"{case.name} {i}" for i in range(len(rows))]
                if one_each
                else [case.group] * len(rows)
            )
    return (np.concatenate(values) if values else np.zeros(0)), groups


REFERENCE = "exact surface"
"""Model that the others are compared with, on the same cases."""


def table(benchmark: Benchmark, task: str) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows: one model a row, each measure with its 95 % interval."""
    measures = TASKS[task].measures
    results = benchmark.results[task]
    headings = ["model", *(measure.heading for measure in measures)]
    rows = []
    for name, result in results.items():
        scores = [result.scores.get(measure.key) for measure in measures]
        rows.append(
            [name, *("" if score is None else _cell(score) for score in scores)]
        )
    return headings, rows


def _cell(score: Score) -> str:
    return f"{score.value:.2f}\n({score.low:.2f} to {score.high:.2f})"


def differences(
    benchmark: Benchmark, task: str, reference: str
) -> dict[str, dict[str, tuple[float, float, float]]]:
    """Return by model and measure its value minus that of `reference`, with the ends of the 95 % interval of that.

    The same drawings for both: what all models find hard does not blur their difference.
    """
    known = TASKS[task]
    test = benchmark.test(task)
    results = benchmark.results[task]
    found: dict[str, dict[str, tuple[float, float, float]]] = {}
    for measure in known.measures:
        base, groups = rows_of(known, measure, test, results[reference].errors)
        if not len(base):
            continue
        drawn = drawings(groups, benchmark.seed)
        of_base = measure.total(base)
        base_drawn = measure.total(base, drawn)
        for name, result in results.items():
            if name != reference:
                values, _ = rows_of(known, measure, test, result.errors)
                ends = interval(measure.total(values, drawn) - base_drawn)
                found.setdefault(name, {})[measure.key] = (
                    float(measure.total(values) - of_base),
                    *ends,
                )
    return found


def to_dict(benchmark: Benchmark) -> dict[str, Any]:
    """Return everything as plain data: scores, fitted numbers, the errors of every test case."""
    tasks = {}
    for name, results in benchmark.results.items():
        cases = benchmark.test(name)
        models = {}
        for called, result in results.items():
            scores = {
                key: {
                    "value": score.value,
                    "interval_95": [score.low, score.high],
                    "cases": score.cases,
                }
                for key, score in result.scores.items()
            }
            errors = {
                case.name: np.round(rows, 4).tolist()
                for case, rows in zip(cases, result.errors, strict=True)
            }
            models[called] = {
                "scores": scores,
                "fitted": dict(result.fitted),
                "checked": dict(result.checked),
                "seconds": round(result.seconds, 2),
                "errors": errors,
            }
        tasks[name] = {
            "title": TASKS[name].title,
            "cases": len(cases),
            "models": models,
        }
        if name == "pushes":
            tasks[name]["published"] = published(benchmark.folder)
        if REFERENCE in results:
            apart = differences(benchmark, name, REFERENCE)
            tasks[name]["minus"] = {"reference": REFERENCE, "models": apart}
    return {
        "tasks": tasks,
        "left_out": list(benchmark.left_out),
        "seed": benchmark.seed,
    }
