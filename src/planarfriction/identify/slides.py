"""Free slides: a body that was thrown onto a level table and measured until it stops, and its simulated motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.described import described
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.identify.angles import unwrapped
from planarfriction.scenes import simulate
from planarfriction.scenes.ready import free_slide

TOLERANCES: dict[str, Any] = {"rtol": 1e-5, "atol": 0.05}
"""Of the solver: ends exact to a few um, so that differences of two simulations are derivatives."""

CHANGES = np.array([2e-3, 2e-3, 2e-2])
"""Changes of the initial twist that derivatives are taken over [m/s, m/s, rad/s]: some mm at the end."""


@dataclass(frozen=True, eq=False)
class Slide(ByValue):
    """One measured slide of a body on a level table, T samples.

    Raises InvalidValueError for fewer than five samples, wrong shapes, numbers that are not finite, times that do not
    increase, and an angle that jumps by anything but whole turns.
    """

    time: np.ndarray
    """Sample times [s], `[T]`."""
    pose: np.ndarray
    """x, y of the centre of mass and the angle, world axes [m, m, rad], `[T, 3]`; jumps by whole turns are removed."""
    twist: np.ndarray | None = None
    """Measured initial velocity, world axes [m/s, m/s, rad/s], `[3]`; None estimates it from the first poses."""
    name: str = "slide"
    """Name for messages and plots."""
    turns: int = field(default=0, init=False)
    """Number of whole-turn jumps that were removed from the angle."""

    def __post_init__(self) -> None:
        time = validation.array("time", self.time, (None,))
        if len(time) < 5:
            raise InvalidValueError(f"time of {self.name}", "hold at least 5 samples", f"{len(time)}")
        if not (np.diff(time) > 0.0).all():
            raise InvalidValueError(f"time of {self.name}", "increase", "a time that does not")
        pose = validation.array("pose", self.pose, (len(time), 3))
        pose[:, 2], turns = unwrapped(time, pose[:, 2], f"theta of {self.name}")
        twist = parabola(time, pose) if self.twist is None else validation.vector("twist", self.twist, 3)
        for name, value in {"time": time - time[0], "pose": pose, "twist": twist}.items():
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "turns", turns)

    def first(self, samples: int) -> Slide:
        """The first samples of the slide, at least five.

        Raises InvalidValueError for fewer samples than a slide needs.
        """
        samples = validation.count("samples", samples, at_least=5)
        return Slide(self.time[:samples], self.pose[:samples], self.twist, self.name)


@described
@dataclass(frozen=True)
class SlidingBody:
    """The body that slides: its mass and inertia, and gravity.

    Raises InvalidValueError for a mass, an inertia or a load that is not > 0.
    """

    mass: float
    """Mass [kg]; in a slide under the body's own weight only `inertia/mass` matters."""
    inertia: float
    """Moment of inertia about the vertical through the centre of mass [kg m^2]."""
    gravity: float = 9.81
    """Acceleration of gravity [m/s^2]."""

    def __post_init__(self) -> None:
        for name in ("mass", "inertia", "gravity"):
            object.__setattr__(self, name, validation.positive(name, getattr(self, name)))


def parabola(time: np.ndarray, pose: np.ndarray, samples: int = 8) -> np.ndarray:
    """Velocity `[3]` at the first sample: slope of a parabola through the first poses."""
    count = min(samples, len(time))
    return np.polynomial.polynomial.polyfit(time[:count] - time[0], pose[:count], 2)[1]


def slide_poses(model: Any, body: SlidingBody, time: np.ndarray, pose: Any, twist: Any) -> np.ndarray:
    """Simulated poses x, y, theta `[T, 3]` at `time` `[T]` of a body on `model`, from a start pose and twist `[3]`.

    A body that stopped stays where it is.
    """
    length = float(time[-1] - time[0])
    every = max(length / max(len(time) - 1, 1), 1e-3)
    scene = free_slide(
        model,
        mass=body.mass,
        inertia=body.inertia,
        twist=twist,
        position=tuple(pose[:2]),
        angle=float(pose[2]),
        normal_force=body.mass * body.gravity,
        t_end=length,
    )
    data = simulate(scene, save_every=every, **TOLERANCES).histories
    saved = data["time"].values
    since = np.minimum(time - time[0], saved[-1])
    left = np.clip(np.searchsorted(saved, since, side="right") - 1, 0, len(saved) - 2)
    step = saved[left + 1] - saved[left]
    share = (since - saved[left]) / step
    columns = []
    for place, speed in (("x", "vx"), ("y", "vy"), ("theta", "omega")):
        p, v = data[place].values, data[speed].values
        columns.append(_hermite(share, step, p[left], p[left + 1], v[left], v[left + 1]))
    return np.stack(columns, -1)


def _hermite(share, step, p0, p1, v0, v1):
    """Cubic through two places with two speeds, at `share` of the way between them."""
    rest = 1.0 - share
    value = (1.0 + 2.0 * share) * rest**2 * p0 + share**2 * (3.0 - 2.0 * share) * p1
    return value + step * share * rest * (rest * v0 - share * v1)


def start_slopes(model: Any, body: SlidingBody, slide: Slide, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses `[T, 3]` from a start (pose, then twist, `[6]`) and their derivatives `[T, 3, 6]`, by differences.

    The start pose shifts the motion as a whole (what an angle changes beyond that, for a contact that is not round, is
    left out).
    """
    poses = slide_poses(model, body, slide.time, start[:3], start[3:])
    slopes = np.zeros((*poses.shape, 6))
    slopes[:, [0, 1, 2], [0, 1, 2]] = 1.0
    for i, change in enumerate(CHANGES):
        changed = slide_poses(model, body, slide.time, start[:3], start[3:] + change * np.eye(3)[i])
        slopes[:, :, 3 + i] = (changed - poses) / change
    return poses, slopes


def fit_start(
    model: Any, body: SlidingBody, slide: Slide, *, samples: int | None = None, noise: Any = (1e-3, 1e-3, 2e-2)
) -> np.ndarray:
    """Initial pose and twist `[6]` for which the simulated slide best fits the first `samples` poses (None: all).

    Least squares, a few Gauss-Newton steps from the measured start; `noise` `[3]` weights metres against radians.

    Raises InvalidValueError for a `noise` that is not > 0.
    """
    _check(body, slide)
    noise = validation.vector("noise", noise, 3)
    if not (noise > 0.0).all():
        raise InvalidValueError("noise", "be > 0", noise.tolist())
    part = slide if samples is None else slide.first(samples)
    return improve_start(model, body, part, start_of(slide), noise, 3)


def _check(body: Any, slide: Any) -> None:
    for name, value, kind in (("body", body, SlidingBody), ("slide", slide, Slide)):
        if not isinstance(value, kind):
            raise InvalidValueError(name, f"be a {kind.__name__}", value)


def start_of(slide: Slide) -> np.ndarray:
    """Measured start pose and twist `[6]`."""
    return np.concatenate([slide.pose[0], np.asarray(slide.twist)])


def improve_start(model: Any, body: SlidingBody, slide: Slide, start: np.ndarray, noise: np.ndarray, turns: int):
    """A start `[6]` after some Gauss-Newton steps."""
    for _ in range(turns):
        poses, slopes = start_slopes(model, body, slide, start)
        off = ((slide.pose - poses) / noise).ravel()
        start = start + np.linalg.lstsq((slopes / noise[:, None]).reshape(-1, 6), off, rcond=None)[0]
    return start


def predict_slide(model: Any, body: SlidingBody, slide: Slide, *, samples: int | None = None) -> np.ndarray:
    """Poses `[T, 3]` of a slide, predicted by the model from its initial state.

    That is the measured one or, with `samples`, the one that `fit_start` finds from that many poses.

    Raises InvalidValueError for what is not a body or a slide, SolverError where the simulation fails.
    """
    _check(body, slide)
    if samples is None:
        return slide_poses(model, body, slide.time, slide.pose[0], slide.twist)
    start = fit_start(model, body, slide, samples=samples)
    return slide_poses(model, body, slide.time, start[:3], start[3:])


def as_slides(slides: Slide | Sequence[Slide]) -> tuple[Slide, ...]:
    """One slide or several as a tuple."""
    result = (slides,) if isinstance(slides, Slide) else tuple(slides)
    if not result or not all(isinstance(each, Slide) for each in result):
        raise InvalidValueError("slides", "be a Slide or a list of them", slides)
    return result
