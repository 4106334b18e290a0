"""What a model is asked: one kind of question for each task, about one slide, one layout of feet, or one push."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from planarfriction.patch import ContactPatch

FIRST_POSES = 8
"""Poses of a slide that a model may look at."""


@dataclass(frozen=True, eq=False)
class SlideQuestion:
    """Where is a body that slides freely on a level table? Answer: its poses `[T, 3]` at `time`, world axes.

    The first poses are measured; the rest is to be predicted.
    """

    time: np.ndarray
    """Sample times from 0 [s], `[T]`; the first of them are those of `first`."""
    first: np.ndarray
    """The first measured poses x, y, theta of the centre of mass, world axes [m, m, rad], `[8, 3]`."""
    patch: ContactPatch
    """The face that touches the table, frame at the centre of mass; its pressure is not known, uniform here."""
    mass: float
    """[kg]"""
    inertia: float
    """About the vertical through the centre of mass [kg m^2]."""
    height: float
    """Of the centre of mass above the table [m]."""
    task: Literal["slides"] = field(default="slides", init=False)


@dataclass(frozen=True, eq=False)
class PushQuestion:
    """Which way does an object go that is pushed slowly? Answer: a twist `[M, 3]` for each wrench, of any length.

    Twists `(vx, vy, omega)` and wrenches `(fx, fy, tau)` are about the centre of mass, in the axes of the object.
    """

    wrenches: np.ndarray
    """Wrench of the pusher on the object [N, N, N m], `[M, 3]`; friction is minus this."""
    patch: ContactPatch
    """The feet with their shares of the load, or the flat face under uniform pressure."""
    layout: str
    """Name of the layout: its pushes share object, board and feet."""
    task: Literal["pushes"] = field(default="pushes", init=False)


@dataclass(frozen=True, eq=False)
class SeriesQuestion:
    """One push in time, from rest: the twists of its wrenches, or the wrenches of its twists. Answer `[T, 3]`.

    Both are about the centre of mass, in the axes of the object; only the direction of an answer counts.
    """

    time: np.ndarray
    """Sample times from 0 [s], `[T]`; the object is at rest at first."""
    given: np.ndarray
    """Wrenches of the pusher on the object [N, N, N m], or twists of the object [m/s, m/s, rad/s], `[T, 3]`."""
    wanted: Literal["twists", "wrenches"]
    """Which of the two is asked for; wrenches are those of the pusher, friction is minus them."""
    patch: ContactPatch
    """The feet with their shares of the load."""
    normal_force: float
    """Weight of the object [N]."""
    task: Literal["series"] = field(default="series", init=False)


Question = SlideQuestion | PushQuestion | SeriesQuestion


class Case(NamedTuple):
    """A question with what was measured."""

    question: Any
    """One of the three kinds."""
    answer: np.ndarray
    """What was measured, of the shape of an answer."""
    name: str
    """Which slide, layout or push it is."""
    group: str
    """Cases of one group are no independent evidence: they stay on one side of the split, and are drawn together."""
    scored: np.ndarray
    """Rows of the answer that count, or all."""
    board: str = ""
    """What it slid on, or which kind of contact it had."""
