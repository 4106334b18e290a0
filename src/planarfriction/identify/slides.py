"""Free slides: a body that was thrown onto a level table and measured until it stops, and its simulated motion.

Slides that friction alone cannot explain (pushed, without contact, far from the others) are found too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Checked, checked
from planarfriction.derivatives.scene_inputs import STATES
from planarfriction.identify.logs import Linear, increasing, runs, unwrapped
from planarfriction.identify.problem import check_noise
from planarfriction.identify.verdicts import Verdict, caution, few_of
from planarfriction.scenes import simulate
from planarfriction.scenes.ready import free_slide

TOLERANCES: dict[str, Any] = {"rtol": 1e-5, "atol": 0.05}
"""Tolerances of the solver: ends are exact to a few um, so that differences of two simulations are derivatives."""

CHANGES = np.array([2e-3, 2e-3, 2e-2])
"""Changes of the initial twist for derivatives [m/s, m/s, rad/s]: some mm at the end."""

WINDOW = 8
"""Number of samples of a window whose poses give a speed."""

GROWS = 0.1
"""Growth of the speed, as a share of the largest, beyond which a body was pushed."""

NOISE = 6.0
"""Growth of the speed over the sigma of its noise beyond which a body was pushed."""

FREE = 0.2
"""Deceleration below which a body counts as free of friction, as a share of the usual deceleration."""

LONG = 0.25
"""Duration of a motion without friction, as a share of the slide, beyond which a body lost contact or was pushed."""

MODEST = 2.5
"""Error of a slide over that of the median slide from which it counts less."""

FAR = 6.0
"""Error of a slide over that of the median slide beyond which it does not count."""

STRONG = 0.7
"""Standard errors by which one slide alone moves an estimate if it is to be named: it makes half of the variance."""


@dataclass(frozen=True, eq=False)
class Slide(ByValue):
    """Measured slide of a body on a level table, T samples.

    Raises InvalidValueError for fewer than five samples, wrong shapes, numbers that are not finite, times that do not
    increase, and an angle that jumps by anything but full rotations.
    """

    time: np.ndarray
    """Sample times [s], `[T]`."""
    pose: np.ndarray
    """x, y of the centre of mass and the angle, world axes [m, m, rad], `[T, 3]`; full rotations are removed."""
    twist: np.ndarray | None = None
    """Measured initial velocity, world axes [m/s, m/s, rad/s], `[3]`; None estimates it from the first poses."""
    name: str = "slide"
    """Name for messages and plots."""
    turns: int = field(default=0, init=False)
    """Number of whole-turn jumps that were removed from the angle."""

    def __post_init__(self) -> None:
        time = increasing(self.time, f"time of {self.name}", 5)
        pose = validation.array("pose", self.pose, (len(time), 3))
        pose[:, 2], turns = unwrapped(time, pose[:, 2], f"theta of {self.name}")
        # the slope of a parabola through the first poses
        twist = polynomial.polyfit(time[:WINDOW] - time[0], pose[:WINDOW], 2)[1]
        if self.twist is not None:
            twist = validation.vector("twist", self.twist, 3)
        self._set(time=time - time[0], pose=pose, twist=twist, turns=turns)
        for value in (self.time, self.pose, twist):
            value.setflags(write=False)

    def first(self, samples: int) -> Slide:
        """Return the first samples of the slide, at least five.

        Raises InvalidValueError for fewer samples than a slide needs.
        """
        samples = validation.count("samples", samples, at_least=5)
        return Slide(self.time[:samples], self.pose[:samples], self.twist, self.name)


@dataclass(frozen=True)
class MassProperties(Checked):
    """Mass and inertia of a body that slides, and gravity.

    Raises InvalidValueError for a mass, an inertia or a load that is not > 0.
    """

    mass: float = checked(validation.positive)
    """Mass [kg]; in a slide under the body's own weight only `inertia/mass` matters."""
    inertia: float = checked(validation.positive)
    """Moment of inertia about the vertical through the centre of mass [kg m^2]."""
    gravity: float = checked(validation.positive, default=9.81)
    """Acceleration of gravity [m/s^2]."""


def slide_poses(
    model: Any, body: MassProperties, time: np.ndarray, start: np.ndarray
) -> np.ndarray:
    """Simulate poses x, y, theta `[T, 3]` at `time` `[T]` of a body on `model`, from a start (pose, then twist, `[6]`).

    A body that stopped stays where it is.
    """
    from scipy.interpolate import CubicHermiteSpline

    length = time[-1] - time[0]
    scene = free_slide(
        model,
        mass=body.mass,
        inertia=body.inertia,
        normal_force=body.mass * body.gravity,
        t_end=length,
        position=tuple(start[:2]),
        angle=start[2],
        twist=start[3:].tolist(),
    )
    every = max(length / max(len(time) - 1, 1), 1e-3)
    data = simulate(scene, save_every=every, **TOLERANCES).histories
    saved = data["time"].values
    motion = np.stack([data[name].values for name in STATES], -1)
    spline = CubicHermiteSpline(saved, motion[:, 3:], motion[:, :3])
    return spline(np.minimum(time - time[0], saved[-1]))


def start_slopes(
    model: Any, body: MassProperties, slide: Slide, start: np.ndarray
) -> Linear:
    """Simulate poses `[T, 3]` from a start (pose, then twist, `[6]`), with derivatives `[T, 3, 6]` by differences.

    The start pose shifts the motion as a whole; the start angle of a contact that is not round changes more than that,
    which is left out.
    """
    poses = slide_poses(model, body, slide.time, start)
    slopes = np.zeros((*poses.shape, 6))
    slopes[:, [0, 1, 2], [0, 1, 2]] = 1.0
    for i, change in enumerate(CHANGES, start=3):
        moved = start + change * np.eye(6)[i]
        changed = slide_poses(model, body, slide.time, moved)
        slopes[:, :, i] = (changed - poses) / change
    return poses, slopes


def fit_start(
    model: Any,
    body: MassProperties,
    slide: Slide,
    *,
    samples: int | None = None,
    noise: Any = (1e-3, 1e-3, 2e-2),
) -> np.ndarray:
    """Estimate the initial pose and twist `[6]` of a slide from its first `samples` poses (None: all).

    Least squares, a few Gauss-Newton steps from the measured start; `noise` `[3]` weights metres against radians.

    Raises InvalidValueError for a `noise` that is not > 0.
    """
    _check(body, slide)
    part = slide if samples is None else slide.first(samples)
    weights = check_noise("noise", noise)
    return improve_start(model, body, part, start_of(slide), weights, 3)


def _check(body: Any, slide: Any) -> None:
    validation.instance("body", body, MassProperties, "MassProperties")
    validation.instance("slide", slide, Slide, "a Slide")


def start_of(slide: Slide) -> np.ndarray:
    """Return the measured start pose and twist `[6]`."""
    return np.concatenate([slide.pose[0], np.asarray(slide.twist)])


def improve_start(
    model: Any,
    body: MassProperties,
    slide: Slide,
    start: np.ndarray,
    noise: np.ndarray,
    turns: int,
):
    """Improve a start `[6]` by some Gauss-Newton steps."""
    for _ in range(turns):
        poses, slopes = start_slopes(model, body, slide, start)
        residual = ((slide.pose - poses) / noise).ravel()
        rows = (slopes / noise[:, None]).reshape(-1, 6)
        start = start + np.linalg.lstsq(rows, residual, rcond=None)[0]
    return start


def predict_slide(
    model: Any, body: MassProperties, slide: Slide, *, samples: int | None = None
) -> np.ndarray:
    """Predict the poses `[T, 3]` of a slide by the model from its initial state.

    The initial state is the measured one or, with `samples`, the one that `fit_start` finds from that many poses.

    Raises InvalidValueError for what is not a body or a slide, SolverError where the simulation fails.
    """
    _check(body, slide)
    start = start_of(slide)
    if samples is not None:
        start = fit_start(model, body, slide, samples=samples)
    return slide_poses(model, body, slide.time, start)


# ---------------------------------------------------------------------- slides that friction cannot explain


def speeds(slide: Slide, body: MassProperties) -> tuple[np.ndarray, np.ndarray, float]:
    """Compute middle times of windows, speeds `sqrt(v^2 + I omega^2/m)` in them, and the sigma of their noise."""
    scale = np.array([1.0, 1.0, np.sqrt(body.inertia / body.mass)])
    times, twists, left = window_twists(slide)
    length = np.median(np.diff(slide.time)) * WINDOW
    sigma = np.std(left * scale) * np.sqrt(12.0 / WINDOW) / length
    return times, np.linalg.norm(twists * scale, axis=1), sigma


def window_twists(slide: Slide) -> tuple[np.ndarray, ...]:
    """Compute middle times `[W]` of windows, twists `[W, 3]` in them (world axes), and residuals of all poses `[T, 3]`.

    The twist of a window is the slope of a parabola through its poses.
    """
    times = []
    twists = []
    left = []
    count = len(slide.time)
    for rows in np.array_split(np.arange(count), max(count // WINDOW, 1)):
        middle = slide.time[rows].mean()
        since = slide.time[rows] - middle
        fit = polynomial.polyfit(since, slide.pose[rows], 2 if len(rows) > 4 else 1)
        left.append(slide.pose[rows] - polynomial.polyval(since, fit).T)
        times.append(middle)
        twists.append(fit[1])
    return np.array(times), np.array(twists), np.concatenate(left)


def contradictions(slides: Sequence[Slide], body: MassProperties) -> dict[int, str]:
    """Find the slides that friction alone cannot have made; returns their indices with the reason.

    If half of the slides or more are strange, none is named: then it is the fit that will be poor.
    """
    seen = [speeds(slide, body) for slide in slides]
    brakes = [brake for time, speed, _ in seen if (brake := _brake(time, speed)) > 0.0]
    usual = np.median(brakes) if brakes else 0.0
    found = {}
    for i, (time, speed, noise) in enumerate(seen):
        grown = speed - np.minimum.accumulate(speed)
        last = grown.argmax()
        if grown[last] > max(GROWS * speed.max(), NOISE * noise):
            first = speed[: last + 1].min()
            found[i] = (
                f"its speed grows from {first:.2g} to {speed[last]:.2g} m/s: it was pushed"
            )
            continue
        moves = np.minimum(speed[:-1], speed[1:]) > 0.25 * speed.max()
        slow = -np.diff(speed) < FREE * usual * np.diff(time)
        # the longest time over which the moving body hardly decelerates
        free = np.ptp(time[runs(moves & slow)], axis=1).max(initial=0.0)
        most = max(LONG * np.ptp(time), 1.5 * np.diff(time[:2]).sum())
        if len(slides) > 2 and free > most:
            found[i] = (
                f"its speed hardly falls for {1e3 * free:.0f} ms: it lost contact, or was pushed"
            )
    return found if 2 * len(found) < len(slides) else {}


def _brake(time: np.ndarray, speed: np.ndarray) -> float:
    """Compute the mean deceleration until the speed is a tenth of the first [m/s^2]."""
    last = np.append(np.flatnonzero(speed < 0.1 * speed[0]), len(speed) - 1)[0]
    return (speed[0] - speed[last]) / (time[last] - time[0]) if last > 0 else 0.0


def weights(errors: np.ndarray) -> np.ndarray:
    """Compute the weights `[S]` of slides from their root mean square residuals: 1 near the median, 0 beyond `FAR`."""
    middle = np.median(errors)
    ratio = errors / middle if middle > 0.0 else np.ones(len(errors))
    return np.where(ratio > FAR, 0.0, (MODEST / np.maximum(ratio, MODEST)) ** 2)


def verdicts_on_weights(
    slides: Sequence[Slide], weighed: np.ndarray, errors: np.ndarray
) -> list[Verdict]:
    """Return verdicts on slides whose weight `[S]` is 0 or below 1; `errors` are residuals over the median slide's."""
    found = []
    for slide, weight, error in zip(slides, weighed, errors, strict=True):
        if weight == 0.0:
            why = f"its residuals are {error:.2g} times those of the median slide"
            found.append(caution(f"{slide.name} is left out: {why}"))
    both = zip(slides, weighed, strict=True)
    less = [slide.name for slide, weight in both if 0.0 < weight < 1.0]
    if less:
        found.append(caution(f"{few_of(less, 5)} have less weight: large residuals"))
    return found


def verdicts_on_influence(
    slides: Sequence[Slide], moved: np.ndarray, names: Sequence[str], errors: np.ndarray
) -> list[Verdict]:
    """Return a verdict on the slide that moves an estimate most, if that is much.

    `moved` `[S, F]` is the change of the estimates `names` without each slide, `errors` `[F]` their standard errors.
    """
    known = np.isfinite(errors) & (errors > 0.0)
    share = np.abs(moved) / np.where(known, errors, np.inf)
    if len(slides) <= 2 or share.max() <= STRONG:
        return []
    i, j = np.argwhere(share == share.max())[0]
    change = f"{names[j]} would change by {moved[i, j]:+.2g} ({share[i, j]:.1f} standard errors)"
    return [caution(f"without {slides[i].name}, {change}")]
