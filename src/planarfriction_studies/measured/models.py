"""The models that are compared: each answers the questions of a task, after a fit of what it does not know.

A model is any callable that takes a question and returns an answer (see `questions`). What it may have besides:
`fit(cases)`, which gets the training cases of one task and returns the model to be used for it, and
`answer_all(questions)`, which is quicker than one by one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.kernels.surfaces import sliding_batch
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceExact, LimitSurfaceQuartic
from planarfriction.limit_surface.base import scaling
from planarfriction.patch import ContactPatch
from planarfriction_studies.measured import fitting, slide_integrator
from planarfriction_studies.measured.questions import BatchModel, Case, Question, SlideQuestion


@dataclass(frozen=True)
class SurfaceModel(BatchModel):
    """A limit surface of the given patch, friction normal to it; on slides times a fitted friction coefficient."""

    surface: Callable[[ContactPatch], LimitSurface]
    mu: float = fitting.MU

    def answer_all(self, questions: Sequence[Any]) -> list[np.ndarray]:
        """Return answers to questions of one task."""
        made = surfaces(self.surface, questions)
        if questions[0].task == "slides":
            wrench = quick(made[0])
            return slide_integrator.slides(lambda twist, _: self.mu * wrench(twist), questions)
        return [_direction(surface, question) for surface, question in zip(made, questions, strict=True)]

    def fit(self, cases: Sequence[Case]) -> SurfaceModel:
        """Fit the friction coefficient to the training slides; directions need none."""
        if cases[0].question.task != "slides":
            return self
        (made,), radius = surfaces(self.surface, [cases[0].question]), cases[0].question.patch.contact_radius()
        wrench = quick(made)
        predict = lambda values, asked: slide_integrator.slides(lambda twist, _: values[0] * wrench(twist), asked)  # noqa: E731
        return dataclasses.replace(self, mu=float(fitting.fit_slides(predict, [fitting.MU], cases, radius)[0]))

    def fitted_values(self) -> dict[str, float]:
        """Return the numbers fitted to slides, by name."""
        return {"mu": self.mu}


def quick(surface: LimitSurface) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that computes `surface.wrench` of twists `[K, 3]` from the numbers that compiled loops take:
    errors of 1e-5 at most."""
    numbers, frame = surface.numbers, scaling(surface.centre_of_pressure, surface.contact_radius)

    def wrench(twist: np.ndarray) -> np.ndarray:
        scaled = np.ascontiguousarray(twist @ frame.T)
        sliding, speed = np.empty_like(scaled), np.linalg.norm(scaled, axis=1)
        sliding_batch(numbers.kind, numbers.data, 0, numbers.size, scaled, sliding)
        return -(sliding / np.where(speed > 0.0, speed, 1.0)[:, None]) @ frame

    return wrench


def surfaces(make: Callable[[ContactPatch], LimitSurface], questions: Sequence[Any]) -> list[LimitSurface]:
    """Return a surface for each question, one for each different patch."""
    made: dict[int, LimitSurface] = {}
    for question in questions:
        if id(question.patch) not in made:
            made[id(question.patch)] = make(question.patch)
    return [made[id(question.patch)] for question in questions]


def _direction(surface: LimitSurface, question: Any) -> np.ndarray:
    """Return twists of wrenches of a pusher, or the other way round; zero where nothing is given."""
    given = question.wrenches if question.task == "pushes" else question.given
    backwards = question.task == "pushes" or question.wanted == "twists"
    moved, answer = np.abs(given).max(axis=1) > 0.0, np.zeros_like(given)
    answer[moved] = surface.twist(-given[moved]) if backwards else -surface.wrench(given[moved])
    return answer


@dataclass(frozen=True)
class UncoupledModel(BatchModel):
    """Force against the velocity and torque against the spin, each at its full value as if the other were not there.

    The torque has a lever: that of the patch in pure spin, or a fitted one. A wrench then moves the object along its
    force, or turns it: whichever of the two limits it is nearer to.
    """

    fitted_lever: bool
    share: float = 1.0
    """The lever over the contact radius of the patch, which is the lever of a pure spin [-]."""
    mu: float = fitting.MU

    def answer_all(self, questions: Sequence[Any]) -> list[np.ndarray]:
        """Return answers to questions of one task."""
        if questions[0].task == "slides":
            lever = self._lever(questions[0])
            return slide_integrator.slides(lambda twist, _: self.mu * uncoupled(twist, lever), questions)
        return [self._direction(question, self._lever(question)) for question in questions]

    def fit(self, cases: Sequence[Case]) -> UncoupledModel:
        """Fit friction coefficient and lever to the training cases."""
        from planarfriction_studies.measured.tasks import TASKS

        question = cases[0].question
        if question.task == "slides":
            radius, begin = question.patch.contact_radius(), [self.mu, self.share][: 1 + self.fitted_lever]

            def predict(values: np.ndarray, asked: Sequence[Any]) -> list[np.ndarray]:
                lever = radius * (values[1] if self.fitted_lever else self.share)
                return slide_integrator.slides(lambda twist, _: values[0] * uncoupled(twist, lever), asked)

            found = fitting.fit_slides(predict, begin, cases, radius)
            return dataclasses.replace(self, mu=float(found[0]), share=float([*found, self.share][1]))
        if not self.fitted_lever:
            return self
        task = TASKS[question.task]

        def misfit(share: float) -> float:
            tried = dataclasses.replace(self, share=share)
            return float(np.mean(np.concatenate([task.errors(case, tried(case.question)) for case in cases])))

        return dataclasses.replace(self, share=fitting.fit_angles(misfit, 0.2, 5.0))

    def fitted_values(self) -> dict[str, float]:
        """Return the fitted numbers by name."""
        return {"mu": self.mu, "lever/radius": self.share}

    def _lever(self, question: Any) -> float:
        return self.share * float(question.patch.contact_radius())

    def _direction(self, question: Any, lever: float) -> np.ndarray:
        """Return directions of twists or wrenches about the centre of mass."""
        given = question.wrenches if question.task == "pushes" else question.given
        if question.task == "series" and question.wanted == "wrenches":
            return -uncoupled(given, lever)
        turns = np.abs(given[:, 2]) / lever > np.hypot(given[:, 0], given[:, 1])
        return np.where(turns[:, None], given * [0.0, 0.0, 1.0], given * [1.0, 1.0, 0.0])


def uncoupled(twist: np.ndarray, lever: float) -> np.ndarray:
    """Return the friction `(-v/|v|, -lever sign(omega))` of twists `[K, 3]`; none of either where it is zero."""
    speed = np.hypot(twist[:, 0], twist[:, 1])[:, None]
    force = -np.divide(twist[:, :2], speed, out=np.zeros((len(twist), 2)), where=speed > 0.0)
    return np.column_stack([force, -lever * np.sign(twist[:, 2])])


@dataclass(frozen=True)
class PushedQuartic:
    """A convex quartic for each layout, fitted to its training pushes: friction learned without knowing the feet."""

    made: Mapping[str, LimitSurface] = dataclasses.field(default_factory=dict)

    def __call__(self, question: Question) -> np.ndarray:
        """Return the answer to one question; slides have no pushes to learn from."""
        if question.task == "slides":
            raise NotImplementedError
        return _direction(self.made[_layout(question)], question)

    def fit(self, cases: Sequence[Case]) -> PushedQuartic:
        """Fit a quartic to each layout of the training pushes, all of one size: that of the median limit force."""
        if cases[0].question.task == "slides":
            raise NotImplementedError
        pairs: dict[str, list[tuple[Any, np.ndarray, np.ndarray]]] = {}
        for case in cases:
            question = case.question
            if question.task == "pushes" or question.wanted == "twists":
                given = question.wrenches if question.task == "pushes" else question.given
                pair = (question.patch, given[case.scored], case.answer[case.scored])
                pairs.setdefault(_layout(question), []).append(pair)
        made = {}
        for layout, parts in pairs.items():
            patch, wrenches, twists = parts[0][0], *(np.concatenate([part[i] for part in parts]) for i in (1, 2))
            power = np.einsum("mi,mi->m", wrenches, twists) / LimitSurfaceExact(patch).dissipation(twists)
            made[layout] = LimitSurfaceQuartic.fit(-wrenches / np.median(power), twists, patch=patch)
        return PushedQuartic(made)


def _layout(question: Any) -> str:
    return question.layout if question.task == "pushes" else "series"


def stiff(mu: float) -> LuGre:
    """Return a law of dry friction with bristles so stiff that only mu counts.

    They deflect by mu um; ten times stiffer ones move no end of a slide by 0.03 mm or 0.02 deg.
    """
    return LuGre(mu_c=mu, mu_s=mu, v_s=1e-3, sigma_0=1e6, sigma_1=20.0, sigma_2=0.0, elasto_plastic=ElastoPlastic(0.9))


@dataclass(frozen=True)
class BristleModel(BatchModel):
    """One of the library's friction models with stiff bristles, simulated as it stands.

    A push in time is followed from rest with its measured twist. A twist of a wrench is searched among those whose
    steady wrench has that direction.
    """

    build: Callable[[ContactPatch, LuGre], Any]
    mu: float = fitting.MU

    def answer_all(self, questions: Sequence[Any]) -> list[np.ndarray]:
        """Return answers to questions of one task."""
        from planarfriction_studies.measured.steady import follow, twists_of

        models: dict[int, Any] = {}
        for question in questions:
            if id(question.patch) not in models:
                models[id(question.patch)] = self.build(question.patch, stiff(self.mu))
        answers = []
        for question in questions:
            model = models[id(question.patch)]
            if question.task == "slides":
                answers.append(_slide(model, question))
            elif question.task == "series" and question.wanted == "wrenches":
                answers.append(-follow(model, question.time, question.given, question.normal_force))
            else:
                given = question.wrenches if question.task == "pushes" else question.given
                answers.append(twists_of(model, -given))
        return answers

    def fit(self, cases: Sequence[Case]) -> BristleModel:
        """Fit the friction coefficient to the training slides; directions need none."""
        if cases[0].question.task != "slides":
            return self
        radius = cases[0].question.patch.contact_radius()
        predict = lambda values, asked: dataclasses.replace(self, mu=float(values[0])).answer_all(asked)  # noqa: E731
        return dataclasses.replace(self, mu=float(fitting.fit_slides(predict, [fitting.MU], cases, radius)[0]))

    def fitted_values(self) -> dict[str, float]:
        """Return the fitted numbers by name."""
        return {"mu": self.mu}


def _slide(model: Any, question: SlideQuestion) -> np.ndarray:
    """Simulate a slide from the start that fits the first poses best."""
    from planarfriction.identify import Slide, SlidingBody
    from planarfriction.identify.slides import improve_start, slide_poses

    body = SlidingBody(question.mass, question.inertia)
    first = len(question.first)
    begun = slide_integrator.parabolas([question])[0]
    part = Slide(question.time[:first], question.first, begun[3:])
    noise = np.array([1.0, 1.0, 1.0 / np.sqrt(question.inertia / question.mass)])
    begun = improve_start(model, body, part, begun, noise, slide_integrator.TURNS - 1)
    return slide_poses(model, body, question.time, begun[:3], begun[3:])
