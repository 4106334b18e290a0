"""Pushes from touch: the quasi-static end on a limit surface, and the force while a spring loads a friction model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction.geometry import rotate
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface
from planarfriction.planning import Pusher, Slider, push
from planarfriction.scenes import Signal
from planarfriction.scenes.ready import GRAVITY
from planarfriction_studies.measured.onsets import peak
from planarfriction_studies.measured.questions import OnsetQuestion

MU_FINGER = 0.44
"""Friction of the finger [-]: ratio of the force along the edge to that across it where the finger slides."""

MU, V_S = 0.3, 1e-3
"""Friction of the boards [-], which ratios of forces hardly see, and a Stribeck velocity below that of pushes [m/s]."""

DAMPING = 0.6
"""Damping of the object on the spring of robot and finger over the critical one: less, and it would stick and slip."""

STEP, STEPS = 5e-4, 1000
"""Time step [s] and number of steps of an onset."""

STIFFNESS, VISCOSITY = 1e5, 100.0
"""Bristles [1/m, s/m]: 50 times stiffer than robot and finger, and damped well at this step."""


def pushed_end(surface: LimitSurface, question: OnsetQuestion) -> np.ndarray:
    """Return the final pose `[3]` of the object: the pusher goes its way from the touch, without inertia."""
    begin = question.start[:2] + rotate(question.place, question.start[2])
    way = question.travel * question.velocity / np.hypot(*question.velocity)
    path = Signal.sampled([0.0, 1.0], [begin, begin + way], "linear")
    slider = Slider(surface, question.outline)
    return push(slider, Pusher(MU_FINGER), path, start=question.start, samples=2, rtol=1e-5).end


def breaking(ratio: float) -> LuGre:
    """Return a law whose static friction is `ratio` times the kinetic one."""
    damped = ElastoPlastic(0.9)
    return LuGre(MU, MU * ratio, V_S, sigma_0=STIFFNESS, sigma_1=VISCOSITY, sigma_2=0.0, elasto_plastic=damped)


def peaks(model: Any, questions: Sequence[OnsetQuestion]) -> np.ndarray:
    """Return the peak of the force over its level `[K]` when a spring pushes objects on `model` from rest.

    The spring, isotropic, with a damper beside it, joins a point that moves at constant velocity to a finger that
    slides along the edge where the force leaves its friction cone. Place and directions of the touch stay, as the
    object moves by 1 mm meanwhile.
    """
    first = questions[0]
    mass, radii = first.mass, np.array([first.mass, first.mass, first.inertia])
    stiffness = np.array([each.stiffness for each in questions])[:, None]
    damping = 2.0 * DAMPING * np.sqrt(stiffness * mass)
    drive = np.array([rotate(each.velocity, -each.start[2]) for each in questions])
    x, y = np.array([each.place for each in questions]).T
    normal = np.array([each.normal for each in questions])
    along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    state, twist = np.zeros((len(questions), *model.rest().shape)), np.zeros((len(questions), 3))
    stretch, found = np.zeros((len(questions), 2)), np.empty((STEPS, len(questions)))
    for i in range(STEPS):
        rate = drive - np.stack([twist[:, 0] - twist[:, 2] * y, twist[:, 1] + twist[:, 2] * x], axis=1)
        stretch = stretch + STEP * rate
        force = stiffness * stretch + damping * rate
        across = np.maximum(np.sum(force * normal, axis=1), 0.0)[:, None]
        slip = np.clip(np.sum(force * along, axis=1)[:, None], -MU_FINGER * across, MU_FINGER * across)
        held = across * normal + slip * along
        stretch = stretch + (held - force) / stiffness
        state, wrench = model.step(state, twist, mass * GRAVITY, STEP)
        torque = x * held[:, 1] - y * held[:, 0]
        twist = twist + STEP * (np.column_stack([held, torque]) + wrench) / radii
        found[i] = np.hypot(*held.T)
    return peak(STEP * np.arange(1, STEPS + 1), found)
