"""The questions that models answer: one kind for each task, about one slide, one layout of feet, or one push."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from planarfriction.patch import ContactPatch

FIRST_POSES = 8
"""Poses of a slide that a model may look at."""


@dataclass(frozen=True, eq=False)
class SlideQuestion:
    """Question of a free slide on a level table: the path of the body. Answer: its poses `[T, 3]` at `time`, world
    axes.

    The first poses are measured; the model predicts the rest.
    """

    time: np.ndarray
    """Sample times from 0 [s], `[T]`; the first eight are those of `first`."""
    first: np.ndarray
    """The first measured poses x, y, theta of the centre of mass, world axes [m, m, rad], `[8, 3]`."""
    patch: ContactPatch
    """The face that touches the table, frame at the centre of mass; its pressure is unknown, and uniform here."""
    mass: float
    """Mass [kg]."""
    inertia: float
    """Moment of inertia about the vertical through the centre of mass [kg m^2]."""
    height: float
    """Height of the centre of mass above the table [m]."""
    task: Literal["slides"] = field(default="slides", init=False)


@dataclass(frozen=True, eq=False)
class PushQuestion:
    """Question of slow pushes: the motion of the pushed object. Answer: a twist `[M, 3]` for each wrench, of any
    length.

    Twists `(vx, vy, omega)` and wrenches `(fx, fy, tau)` are about the centre of mass, in the axes of the object.
    """

    wrenches: np.ndarray
    """Wrench of the pusher on the object [N, N, N m], `[M, 3]`; the friction wrench is its negative."""
    patch: ContactPatch
    """The feet with their shares of the load, or the flat face under uniform pressure."""
    layout: str
    """Name of the layout: its pushes share object, board and feet."""
    task: Literal["pushes"] = field(default="pushes", init=False)


@dataclass(frozen=True, eq=False)
class SeriesQuestion:
    """One push over time, from rest: the twists for its wrenches, or the wrenches for its twists. Answer `[T, 3]`.

    Both are about the centre of mass, in the axes of the object; only the direction of an answer counts.
    """

    time: np.ndarray
    """Sample times from 0 [s], `[T]`; the object is at rest at first."""
    given: np.ndarray
    """Wrenches of the pusher on the object [N, N, N m], or twists of the object [m/s, m/s, rad/s], `[T, 3]`."""
    wanted: Literal["twists", "wrenches"]
    """Quantity that the model must predict; wrenches are those of the pusher, friction is their negative."""
    patch: ContactPatch
    """The feet with their shares of the load."""
    normal_force: float
    """Weight of the object [N]."""
    task: Literal["series"] = field(default="series", init=False)


@dataclass(frozen=True, eq=False)
class OnsetQuestion:
    """Question of one push from touch. Answer `[4]`: the final pose, and the first peak of the force over its level.

    Peak and level are those of `onsets.peak`; the pose is x, y, theta of the centre of mass, world axes [m, m, rad].
    """

    patch: ContactPatch
    """The feet with their shares of the load, or the flat face under uniform pressure."""
    outline: np.ndarray
    """Corners of the object about the centre of mass, counter-clockwise [m], `[M, 2]`."""
    edge: int
    """Number of the edge that is touched, which begins at the corner of that number."""
    start: np.ndarray
    """First pose x, y, theta of the centre of mass, world axes [m, m, rad], `[3]`."""
    place: np.ndarray
    """Place of the touch, in the axes of the object [m], `[2]`."""
    velocity: np.ndarray
    """Velocity of the pusher, world axes [m/s], `[2]`."""
    travel: float
    """Way of the pusher from touch to its end, less the deflection of robot and finger [m]."""
    stiffness: float
    """Stiffness of robot and finger, from the rise of the force at touch [N/m]: a nuisance."""
    mass: float
    """Mass [kg]."""
    inertia: float
    """Moment of inertia about the vertical through the centre of mass [kg m^2]."""
    task: Literal["onsets"] = field(default="onsets", init=False)

    @property
    def normal(self) -> np.ndarray:
        """Unit normal of the touched edge, into the object `[2]`."""
        x, y = (
            self.outline[(self.edge + 1) % len(self.outline)] - self.outline[self.edge]
        )
        return np.array([-y, x]) / np.hypot(x, y)


Question = SlideQuestion | PushQuestion | SeriesQuestion | OnsetQuestion


class Case(NamedTuple):
    """A question together with the measured answer."""

    question: Any
    """One of the four kinds."""
    answer: np.ndarray
    """The measured answer, of the same shape as a model's."""
    name: str
    """Name of the slide, layout or push."""
    group: str
    """Group of cases that are not independent: they stay on one side of the split, and are drawn as a unit."""
    scored: np.ndarray
    """Rows of the answer that are scored, or all."""
    board: str = ""
    """The board it slid on, or the kind of contact."""

    @property
    def is_training(self) -> bool:
        """True for cases to fit to, whose group is a multiple of 4; the others are predicted."""
        return int(self.group) % 4 == 0


class BatchModel:
    """Base of models that answer many questions at once; raises `NotImplementedError` for tasks that are not theirs."""

    tasks: ClassVar[tuple[str, ...]] = ("slides", "pushes", "series")

    def __call__(self, question: Question) -> np.ndarray:
        """Return the answer to one question."""
        return self.answer_all([question])[0]

    def answer_all(self, questions: Sequence[Any]) -> list[np.ndarray]:
        """Return the answers to questions of one task."""
        if questions[0].task not in self.tasks:
            raise NotImplementedError
        return self._answers(questions)

    def fit(self, cases: Sequence[Case]) -> BatchModel:
        """Return the model fitted to the training cases of one task."""
        if cases[0].question.task not in self.tasks:
            raise NotImplementedError
        return self._fitted(cases)

    def _answers(self, questions: Sequence[Any]) -> list[np.ndarray]:
        raise NotImplementedError

    def _fitted(self, cases: Sequence[Case]) -> BatchModel:
        return self
