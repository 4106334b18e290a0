"""Many free slides at once under dry friction: a few thousand slides in the time of one by one simulations of fifty.

Bristles are left out: friction is a function of the twist alone, as in steady sliding. `tests/studies/test_measured.py`
holds its ends against those of `simulate`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planarfriction.scenes.ready import GRAVITY
from planarfriction_studies.measured.questions import FIRST_POSES, Case, SlideQuestion

STEP = 3.4e-3
"""Step [s], half a sample: ends move by less than 0.01 mm and 0.01 deg where it is halved."""

CHANGES = np.array([2e-3, 2e-3, 2e-2])
"""Changes of the initial twist that derivatives are taken over [m/s, m/s, rad/s]."""

TURNS = 2
"""Gauss-Newton steps from the velocity of a parabola to that of the model: a third moves it by less than 1e-5 m/s."""

MU, DIFFERENCE = 0.22, 0.02
"""Initial guess of the friction coefficient of a slide [-], and share of a number over which a fit differentiates."""

USUAL = 5e-3
"""Error of an end [m], twice the usual one, from which on it counts in proportion and no longer by its square."""

Friction = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Friction wrenches `[K, 3]` over the weight [1, 1, m] of twists `[K, 3]`, both in the axes of the bodies.

The second argument are numbers of each slide's own, `[K, P]`, the columns of its start behind pose and twist."""


def integrate(
    friction: Friction, starts: np.ndarray, time: np.ndarray, radius_squared: float
) -> np.ndarray:
    """Integrate slides: poses `[K, T, 3]` at `time` `[T]` from 0 from `starts` `[K, 6 + P]`: pose, twist, numbers of
    their own.

    `radius_squared` is the inertia over the mass [m^2]. The fourth order method of Runge and Kutta; a body whose last
    step would turn it round stops where its deceleration ends.
    """
    end = float(time[-1])
    steps = max(int(np.ceil(end / STEP)), 1)
    step = end / steps
    state = starts[:, :6].copy()
    own = starts[:, 6:]
    per = GRAVITY * np.array([1.0, 1.0, 1.0 / radius_squared])
    energy = np.array([1.0, 1.0, radius_squared])

    def rates(state: np.ndarray, own: np.ndarray) -> np.ndarray:
        cos = np.cos(state[:, 2])
        sin = np.sin(state[:, 2])
        vx, vy, omega = state[:, 3:].T
        fx, fy, tau = friction(
            np.stack([cos * vx + sin * vy, cos * vy - sin * vx, omega], axis=1), own
        ).T
        return np.concatenate(
            [
                state[:, 3:],
                np.stack([cos * fx - sin * fy, sin * fx + cos * fy, tau], 1) * per,
            ],
            axis=1,
        )

    states = np.empty((steps + 1, *state.shape))
    moving = np.ones(len(state), dtype=bool)
    states[0] = state
    for i in range(steps):
        now = state[moving]
        state = state.copy()
        if len(now):
            mine = own[moving]
            a = rates(now, mine)
            speed = np.sqrt(now[:, 3:] ** 2 @ energy)
            brake = np.sqrt(a[:, 3:] ** 2 @ energy)
            left = np.divide(
                speed, brake, out=np.full(len(now), np.inf), where=brake > 0.0
            )
            stops = left <= step
            b = rates(now + 0.5 * step * a, mine)
            c = rates(now + 0.5 * step * b, mine)
            d = rates(now + step * c, mine)
            after = now + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
            after[stops, :3] = now[stops, :3] + 0.5 * left[stops, None] * now[stops, 3:]
            after[stops, 3:] = 0.0
            state[moving] = after
            moving[moving] = ~stops
        states[i + 1] = state
    return _between(states, step, time)


def _between(states: np.ndarray, step: float, time: np.ndarray) -> np.ndarray:
    """Interpolate poses `[K, T, 3]` by the cubic through the poses and twists of `states` `[steps + 1, K, 6]`."""
    left = np.clip((time / step).astype(int), 0, len(states) - 2)
    share = (time / step - left)[:, None, None]
    rest = 1.0 - share
    p0 = states[left, :, :3]
    p1 = states[left + 1, :, :3]
    v0 = states[left, :, 3:]
    v1 = states[left + 1, :, 3:]
    poses = (1.0 + 2.0 * share) * rest**2 * p0 + share**2 * (3.0 - 2.0 * share) * p1
    return np.moveaxis(poses + step * share * rest * (rest * v0 - share * v1), 0, 1)


def parabolas(questions: Sequence[SlideQuestion]) -> np.ndarray:
    """Return starts `[K, 6]`: pose and velocity at the first sample of a parabola through the first poses."""
    found = []
    for question in questions:
        fit = np.polynomial.polynomial.polyfit(
            question.time[:FIRST_POSES], question.first, 2
        )
        found.append(np.concatenate([fit[0], fit[1]]))
    return np.array(found)


def linearised(
    poses_of: Callable[[np.ndarray], np.ndarray],
    starts: np.ndarray,
    changes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return poses `[K, T, 3]` of `starts` `[K, N]` and their derivatives `[K, T, 3, N]` to the starts.

    Differences over `changes` of all columns but the pose, which moves the whole path; `poses_of` is called once, with
    all starts.
    """
    size = starts.shape[1]
    moved = (
        starts + change * row
        for change, row in zip(changes, np.eye(size)[3:], strict=True)
    )
    found = poses_of(np.concatenate([starts, *moved]))
    poses = found.reshape(size - 2, len(starts), *found.shape[1:])
    slopes = np.zeros((*poses.shape[1:], size))
    slopes[..., [0, 1, 2], [0, 1, 2]] = 1.0
    slopes[..., 3:] = np.moveaxis(
        (poses[1:] - poses[0]) / changes[:, None, None, None], 0, -1
    )
    return poses[0], slopes


def improved(
    poses_of: Callable[[np.ndarray], np.ndarray],
    found: np.ndarray,
    first: np.ndarray,
    radius_squared: float,
):
    """Return starts `[K, 6]` one Gauss-Newton step nearer to those that go through the `first` poses `[K, T, 3]` best.

    An angle counts as its way at the radius of gyration.
    """
    weights = np.array([1.0, 1.0, np.sqrt(radius_squared)])
    poses, slopes = linearised(poses_of, found, CHANGES)
    rows = slopes * weights[:, None]
    off = (first - poses) * weights
    normal = np.einsum("ktci,ktcj->kij", rows, rows)
    return (
        found
        + np.linalg.solve(normal, np.einsum("ktci,ktc->ki", rows, off)[..., None])[
            ..., 0
        ]
    )


def starts(
    friction: Friction, questions: Sequence[SlideQuestion], radius_squared: float
) -> np.ndarray:
    """Return starts `[K, 6]` with which slides go through their first poses best: least squares over pose and twist."""
    found = parabolas(questions)
    first = np.array([each.first for each in questions])
    time = questions[0].time[:FIRST_POSES]
    for _ in range(TURNS):
        found = improved(
            lambda each: integrate(friction, each, time, radius_squared),
            found,
            first,
            radius_squared,
        )
    return found


def slides(friction: Friction, questions: Sequence[SlideQuestion]) -> list[np.ndarray]:
    """Return poses `[T, 3]` of each slide at its own times, from its first poses.

    The samples of all slides are taken to be equally far apart.
    """
    first = questions[0]
    radius_squared = first.inertia / first.mass
    begun = starts(friction, questions, radius_squared)
    longest = max((each.time for each in questions), key=len)
    poses = integrate(friction, begun, longest, radius_squared)
    return [poses[i, : len(each.time)] for i, each in enumerate(questions)]


Slides = Callable[[np.ndarray, Sequence[SlideQuestion]], list[np.ndarray]]
"""Poses `[T, 3]` of slides for given numbers."""


def fit_slides(
    predict: Slides, begin: Sequence[float], cases: Sequence[Case]
) -> np.ndarray:
    """Return numbers with the least errors of the end, by Huber's loss: position, and yaw at the contact radius."""
    from scipy.optimize import least_squares

    questions = [case.question for case in cases]
    ends = np.array([case.answer[-1] for case in cases])
    scale = np.asarray(begin, dtype=float)
    length = questions[0].patch.contact_radius()

    def off(shares: np.ndarray) -> np.ndarray:
        found = np.array([poses[-1] for poses in predict(shares * scale, questions)])
        return ((found - ends) * [1.0, 1.0, length]).ravel()

    # sharing 1e-3 of a number is a tenth of its standard error; the path of a slide is nearly linear in 1/mu
    found = least_squares(
        off,
        np.ones(len(scale)),
        diff_step=DIFFERENCE,
        xtol=1e-3,
        ftol=1e-4,
        bounds=(0.2, 5.0),
        loss="huber",
        f_scale=USUAL,
    )
    return found.x * scale
