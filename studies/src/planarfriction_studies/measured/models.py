"""The models that are compared: each answers the questions of a task, after a fit of what it does not know.

A model is any callable that takes a question and returns an answer (see `questions`). What it may have besides:
`fit(cases)`, which gets the training cases of one task and returns the model to be used for it, and
`answer_all(questions)`, which is quicker than one by one.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.extend import sliding_batch
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import (
    LimitSurface,
    LimitSurfaceExact,
    LimitSurfaceQuartic,
)
from planarfriction.limit_surface.base import scaling
from planarfriction.limit_surface.comparison import directions
from planarfriction.patch import ContactPatch
from planarfriction_studies.measured.onsets import breaking, peaks, pushed_end
from planarfriction_studies.measured.questions import (
    BatchModel,
    Case,
    OnsetQuestion,
    SlideQuestion,
)
from planarfriction_studies.measured.slide_integrator import (
    MU,
    TURNS,
    fit_slides,
    parabolas,
    slides,
)


@functools.lru_cache(maxsize=64)
def made(make: Callable[..., Any], patch: ContactPatch, *arguments: Any) -> Any:
    """Return what `make` makes of a patch, once: a surface, or a model with a law."""
    return make(patch, *arguments)


class SlideFit(BatchModel):
    """Base of models whose friction coefficient `mu` is fitted to the training slides; directions need none."""

    mu: float

    def _fitted(self, cases: Sequence[Case]) -> BatchModel:
        if cases[0].question.task != "slides":
            return self
        model: Any = self
        predict = lambda values, asked: dataclasses.replace(
            model, mu=float(values[0])
        ).answer_all(asked)
        return dataclasses.replace(model, mu=float(fit_slides(predict, [MU], cases)[0]))

    def fitted_values(self) -> dict[str, float]:
        """Return the numbers fitted to slides, by name."""
        return {"mu": self.mu}


@dataclass(frozen=True)
class SurfaceModel(SlideFit):
    """A limit surface of the given patch, friction normal to it; on slides times a fitted friction coefficient.

    Without bristles the force has no peak at breakaway.
    """

    tasks = (*BatchModel.tasks, "onsets")

    surface: Callable[[ContactPatch], LimitSurface]
    mu: float = MU

    def _answers(self, questions: Sequence[Any]) -> list[np.ndarray]:
        if questions[0].task == "slides":
            wrench = quick(made(self.surface, questions[0].patch))
            return slides(lambda twist, _: self.mu * wrench(twist), questions)
        if questions[0].task == "onsets":
            return [
                np.append(pushed_end(made(self.surface, each.patch), each), 1.0)
                for each in questions
            ]
        return [
            _direction(made(self.surface, question.patch), question)
            for question in questions
        ]


def quick(surface: LimitSurface) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that computes `surface.wrench` of twists `[K, 3]` in compiled loops, within 1e-5."""
    numbers = surface.numbers
    frame = scaling(surface.centre_of_pressure, surface.contact_radius)

    def wrench(twist: np.ndarray) -> np.ndarray:
        scaled = np.ascontiguousarray(twist @ frame.T)
        sliding = np.empty_like(scaled)
        speed = np.linalg.norm(scaled, axis=1)
        sliding_batch(numbers.kind, numbers.data, 0, numbers.size, scaled, sliding)
        return -(sliding / np.where(speed > 0.0, speed, 1.0)[:, None]) @ frame

    return wrench


def _given(question: Any) -> np.ndarray:
    """Return the wrenches or twists that a question about pushes gives."""
    return question.wrenches if question.task == "pushes" else question.given


def _direction(surface: LimitSurface, question: Any) -> np.ndarray:
    """Return twists of wrenches of a pusher, or the other way round; zero where nothing is given."""
    given = _given(question)
    backwards = question.task == "pushes" or question.wanted == "twists"
    moved = np.abs(given).max(axis=1) > 0.0
    answer = np.zeros_like(given)
    answer[moved] = (
        surface.twist(-given[moved]) if backwards else -surface.wrench(given[moved])
    )
    return answer


@dataclass(frozen=True)
class UncoupledModel(SlideFit):
    """Force against the velocity and torque against the spin, each at its full value as if the other were not there.

    The torque has a lever: that of the patch in pure spin, or a fitted one. A wrench then moves the object along its
    force, or turns it: whichever of the two limits it is nearer to.
    """

    fitted_lever: bool
    share: float = 1.0
    """The lever over the contact radius of the patch, which is the lever of a pure spin [-]."""
    mu: float = MU

    def _answers(self, questions: Sequence[Any]) -> list[np.ndarray]:
        if questions[0].task == "slides":
            lever = self._lever(questions[0])
            return slides(lambda twist, _: self.mu * uncoupled(twist, lever), questions)
        return [
            self._direction(question, self._lever(question)) for question in questions
        ]

    def _fitted(self, cases: Sequence[Case]) -> BatchModel:
        """Fit friction coefficient and lever to the training cases."""
        from planarfriction_studies.measured.tasks import TASKS

        if not self.fitted_lever:
            return super()._fitted(cases)
        task = TASKS[cases[0].question.task]
        if task.name == "slides":
            changed = lambda values: dataclasses.replace(
                self, mu=float(values[0]), share=float(values[1])
            )
            predict = lambda values, asked: changed(values).answer_all(asked)
            return changed(fit_slides(predict, [self.mu, self.share], cases))

        def misfit(share: float) -> float:
            tried = dataclasses.replace(self, share=share)
            return float(
                np.mean(
                    np.concatenate(
                        [task.errors(case, tried(case.question)) for case in cases]
                    )
                )
            )

        return dataclasses.replace(self, share=_least(misfit, 0.2, 5.0))

    def fitted_values(self) -> dict[str, float]:
        """Return the fitted numbers by name."""
        return {"mu": self.mu, "lever/radius": self.share}

    def _lever(self, question: Any) -> float:
        return self.share * float(question.patch.contact_radius())

    def _direction(self, question: Any, lever: float) -> np.ndarray:
        """Return directions of twists or wrenches about the centre of mass."""
        given = _given(question)
        if question.task == "series" and question.wanted == "wrenches":
            return -uncoupled(given, lever)
        turns = np.abs(given[:, 2]) / lever > np.hypot(given[:, 0], given[:, 1])
        return np.where(
            turns[:, None], given * [0.0, 0.0, 1.0], given * [1.0, 1.0, 0.0]
        )


def _least(errors: Callable[[float], float], low: float, high: float) -> float:
    """Return the number between `low` and `high` with the least error, by a search over 24 of them and a finer one."""
    tried = np.geomspace(low, high, 24)
    best = tried[np.argmin([errors(value) for value in tried])]
    fine = best * np.geomspace(low / high, high / low, 25) ** (1.0 / 23.0)
    return float(fine[np.argmin([errors(value) for value in fine])])


def uncoupled(twist: np.ndarray, lever: float) -> np.ndarray:
    """Return the friction `(-v/|v|, -lever sign(omega))` of twists `[K, 3]`; none of either where it is zero."""
    speed = np.hypot(twist[:, 0], twist[:, 1])[:, None]
    force = -np.divide(
        twist[:, :2], speed, out=np.zeros((len(twist), 2)), where=speed > 0.0
    )
    return np.column_stack([force, -lever * np.sign(twist[:, 2])])


@dataclass(frozen=True)
class PushedQuartic(BatchModel):
    """A convex quartic for each layout, fitted to its training pushes: friction learned without knowing the feet."""

    tasks = ("pushes", "series")

    made: Mapping[str, LimitSurface] = dataclasses.field(default_factory=dict)

    def _answers(self, questions: Sequence[Any]) -> list[np.ndarray]:
        return [
            _direction(self.made[_layout(question)], question) for question in questions
        ]

    def _fitted(self, cases: Sequence[Case]) -> PushedQuartic:
        """Fit a quartic to each layout of the training pushes, all of one size: that of the median limit force."""
        pairs: dict[str, list[tuple[Any, np.ndarray, np.ndarray]]] = {}
        for case in cases:
            question = case.question
            if question.task == "pushes" or question.wanted == "twists":
                pair = (
                    question.patch,
                    _given(question)[case.scored],
                    case.answer[case.scored],
                )
                pairs.setdefault(_layout(question), []).append(pair)
        quartics = {}
        for layout, parts in pairs.items():
            patch, wrenches, twists = (
                parts[0][0],
                *(np.concatenate([part[i] for part in parts]) for i in (1, 2)),
            )
            power = np.einsum("mi,mi->m", wrenches, twists) / LimitSurfaceExact(
                patch
            ).dissipation(twists)
            quartics[layout] = LimitSurfaceQuartic.fit(
                -wrenches / np.median(power), twists, patch=patch
            )
        return PushedQuartic(quartics)


def _layout(question: Any) -> str:
    return question.layout if question.task == "pushes" else "series"


def stiff(mu: float) -> LuGre:
    """Return a law of dry friction with bristles so stiff that only mu counts.

    They deflect by mu um; ten times stiffer ones move no end of a slide by 0.03 mm or 0.02 deg.
    """
    return LuGre(
        mu_c=mu,
        mu_s=mu,
        v_s=1e-3,
        sigma_0=1e6,
        sigma_1=20.0,
        sigma_2=0.0,
        elasto_plastic=ElastoPlastic(0.9),
    )


@dataclass(frozen=True)
class BristleModel(SlideFit):
    """One of the library's friction models with stiff bristles, simulated as it stands.

    A push in time is followed from rest with its measured twist. A twist of a wrench is searched among those whose
    steady wrench has that direction. Pushes from touch end where those on the exact surface end; the ratio of static to
    kinetic friction, which makes their peak, is fitted to feet and to flat faces.
    """

    tasks = (*BatchModel.tasks, "onsets")

    build: Callable[[ContactPatch, LuGre], Any]
    mu: float = MU
    ratios: tuple[float, float] | None = None
    """Static over kinetic friction of feet and of flat faces."""

    def _fitted(self, cases: Sequence[Case]) -> BatchModel:
        if cases[0].question.task != "onsets":
            return super()._fitted(cases)
        tried = np.linspace(1.0, LARGEST, 5)
        fine = np.linspace(1.0, LARGEST, 81)
        ratios = []
        for board in ("feet", "flat"):
            own = [case for case in cases if case.board == board]
            found = np.stack(
                [
                    self._peaks([case.question for case in own], [ratio] * 2)
                    for ratio in tried
                ]
            )
            off = _between(tried, found, fine) - [case.answer[3] for case in own]
            ratios.append(float(fine[np.argmin(np.abs(np.median(off, axis=1)))]))
        return dataclasses.replace(self, ratios=tuple(ratios))

    def fitted_values(self) -> dict[str, float]:
        """Return the fitted numbers by name."""
        if self.ratios is None:
            return super().fitted_values()
        return dict(
            zip(("mu_s/mu_c, feet", "mu_s/mu_c, flat face"), self.ratios, strict=True)
        )

    def _peaks(
        self, questions: Sequence[OnsetQuestion], ratios: Sequence[float]
    ) -> np.ndarray:
        """Return simulated peaks `[K]` for static over kinetic friction of feet and of flat faces."""
        found = np.empty(len(questions))
        for patch in {id(each.patch): each.patch for each in questions}.values():
            rows = [i for i, each in enumerate(questions) if each.patch is patch]
            law = breaking(ratios[len(patch.positions) > FEET])
            found[rows] = peaks(
                made(self.build, patch, law), [questions[i] for i in rows]
            )
        return found

    def _answers(self, questions: Sequence[Any]) -> list[np.ndarray]:
        if questions[0].task == "onsets":
            ends = SurfaceModel(LimitSurfaceExact).answer_all(questions)
            both = zip(
                ends, self._peaks(questions, self.ratios or (1.0, 1.0)), strict=True
            )
            return [np.append(end[:3], each) for end, each in both]
        answers = []
        law = stiff(self.mu)
        for question in questions:
            model = made(self.build, question.patch, law)
            if question.task == "slides":
                answers.append(_slide(model, question))
            elif question.task == "series" and question.wanted == "wrenches":
                answers.append(
                    -follow(model, question.time, question.given, question.normal_force)
                )
            else:
                answers.append(twists_of(model, -_given(question)))
        return answers


def _slide(model: Any, question: SlideQuestion) -> np.ndarray:
    """Simulate a slide from the start that fits the first poses best."""
    from planarfriction.identify import MassProperties, Slide
    from planarfriction.identify.slides import improve_start, slide_poses

    body = MassProperties(question.mass, question.inertia)
    first = len(question.first)
    begun = parabolas([question])[0]
    part = Slide(question.time[:first], question.first, begun[3:])
    noise = np.array([1.0, 1.0, 1.0 / np.sqrt(question.inertia / question.mass)])
    begun = improve_start(model, body, part, begun, noise, TURNS - 1)
    return slide_poses(model, body, question.time, begun)


LARGEST, FEET = 1.8, 3
"""Largest ratio of static to kinetic friction that is tried, and number of feet; flat faces have more cells."""


def _between(nodes: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the columns of `values` `[N, K]` at `nodes`, linear in between, `[A, K]`."""
    return np.stack([np.interp(at, nodes, column) for column in values.T], axis=1)


# ---------------------------------------------------------------------- steady motions

DIRECTIONS = 2000
"""Directions of twists that are tried at first: neighbours are 3 deg apart."""

ROUNDS, NEAR = 4, 40
"""Times that twists around the best are tried, four times nearer each time, and how many: 0.01 deg at last."""

WAY, SEGMENTS = 1e-3, 4
"""Way of a steady motion [m], far above the deflection of stiff bristles, in so many steps."""


def follow(model: Any, time: np.ndarray, twists: np.ndarray, load: float) -> np.ndarray:
    """Return the friction wrenches `[T, 3]` of a model that is moved from rest with the measured twists `[T, 3]`."""
    state = model.rest()
    wrenches = np.zeros_like(twists)
    for i in range(1, len(time)):
        state, wrenches[i] = model.step(
            state, 0.5 * (twists[i - 1] + twists[i]), load, float(time[i] - time[i - 1])
        )
    return wrenches


def steady(model: Any, twists: np.ndarray, length: float) -> np.ndarray:
    """Return directions `(fx, fy, tau/length)` of the friction of steady motions along unit twists `[K, 3]`."""
    state = np.zeros((len(twists), *model.rest().shape))
    wrenches = np.zeros_like(twists)
    for _ in range(SEGMENTS):
        state, wrenches = model.step(state, twists, 1.0, WAY / SEGMENTS)
    return unit(wrenches / [1.0, 1.0, length])


def twists_of(model: Any, friction: np.ndarray) -> np.ndarray:
    """Return twists `[M, 3]` whose steady friction has the directions of `friction` `[M, 3]`, by search."""
    length = float(model.patch.contact_radius())
    wanted = unit(friction / [1.0, 1.0, length])
    back = np.array([1.0, 1.0, 1.0 / length])
    tried = directions(DIRECTIONS)
    found = tried[np.argmax(wanted @ steady(model, tried * back, length).T, axis=1)]
    random = np.random.default_rng(0)
    size = 0.06
    for _ in range(ROUNDS):
        around = found[:, None] + size * random.normal(size=(len(found), NEAR, 3))
        around[:, 0] = found
        around = unit(around)
        wrenches = steady(model, (around * back).reshape(-1, 3), length).reshape(
            around.shape
        )
        found = around[
            np.arange(len(found)),
            np.einsum("mki,mi->mk", wrenches, wanted).argmax(axis=1),
        ]
        size /= 4.0
    return found * back


def unit(vectors: np.ndarray) -> np.ndarray:
    """Scale vectors `[..., 3]` to length 1; zeros stay."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0.0)
