"""Open-loop pushes to a pose, with a pusher that sticks and forces inside its friction cone."""

from __future__ import annotations

import itertools
import math
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.described import described
from planarfriction._support.equality import ByValue
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError, SolverError
from planarfriction.geometry import rotate
from planarfriction.limit_surface import LimitSurfaceEllipsoid
from planarfriction.planning.pushing import (
    STICK,
    Push,
    Pusher,
    Slider,
    TouchPoint,
    push,
    pushed_by,
)
from planarfriction.scenes import Signal

PARTS = 3
"""Parts of a plan, each of constant force: turn, go on, turn."""

PLACES = ((0.5,), (0.35, 0.65))
"""Places at which an edge may be pushed, as shares of its length: the others are tried if its middle leads nowhere."""

CHORDS = 40
"""Smallest number of lines that the arc of the pusher in one part is made of."""

BEND = 0.02
"""Largest rotation of the slider along one line [rad]: a longer line leaves the motion
cone, and the pusher slips."""

NODES = 65
"""Forces whose twists are joined by a spline for the search."""

ROUNDS = 2
"""Times that a plan aims off the goal by the error of the spline and the lines."""

CLOSE = 1e-3
"""Error at which a plan counts as one that ends at its goal, as a share of the slider's
size and as an angle [rad]."""

_TURNS = 0.7 * np.array([[-1, 0, 1], [1, 0, -1], [1, 0, 1], [-1, 0, -1]])
"""Forces that a search begins with, as shares of the angle that they may have."""

REACHED = 1e-6
"""Miss of a plan before it is made of lines, as a share of the slider's size and as an angle [rad]."""


@described
@dataclass(frozen=True)
class PushReport:
    """Result of a plan of a push."""

    goal: tuple[float, float, float]
    """Goal [m, m, rad]."""
    end: tuple[float, float, float]
    """Final pose of a push that follows the path [m, m, rad]."""
    error: tuple[float, float]
    """Distance [m] and angle [rad] from `end` to the goal."""
    reached: bool
    """True if both errors are below 0.1 % of the slider's size and 1 mrad."""
    ellipsoid_end: tuple[float, float, float]
    """Final pose if the limit surface of the patch were its ellipsoid [m, m, rad]."""
    edge: int
    """Number of the edge that is pushed; edge j begins at corner j, counter-clockwise."""
    place: tuple[float, float]
    """Point that is pushed, in the slider's axes [m]."""
    length: float
    """Length of the pusher's path [m]."""
    used: float
    """Largest share of the friction cone's half angle that the plan uses [-]."""
    sticks: bool
    """True if the pusher sticks all the way."""
    wall_time: float
    """Computing time of the plan [s]."""

    def __str__(self) -> str:
        rows = {
            "goal": self.goal,
            "reached": self.end,
            "with an ellipsoid": self.ellipsoid_end,
        }
        lines = [f"{'':18}{'x [mm]':>10}{'y [mm]':>10}{'angle [deg]':>12}"]
        for name, (x, y, a) in rows.items():
            lines.append(
                f"{name:18}{1e3 * x:>10.2f}{1e3 * y:>10.2f}{math.degrees(a):>12.2f}"
            )
        lines.append(
            f"{1e3 * self.length:.4g} mm long, on edge {self.edge}, using {self.used:.0%} of the friction cone."
        )
        if not self.reached:
            lines.append(f"Misses its goal by {_miss(*self.error)}.")
        return "\n".join(lines)


@dataclass(frozen=True, eq=False, repr=False)
class PushPlan(ByValue):
    """A path of a pusher that brings a slider to a pose."""

    path: Signal
    """Position of the pusher over time, at unit speed `[K, 2]` [m]."""
    push: Push
    """The simulated push along this path."""
    report: PushReport
    """Result of the plan."""

    def __repr__(self) -> str:
        return str(self.report)

    def plot(self) -> Any:
        """Draw the push, its goal and the length of the path; returns a matplotlib Figure."""
        return picture("push plan", self)


def plan_push(
    slider: Slider,
    pusher: Pusher,
    goal: ArrayLike,
    *,
    start: ArrayLike = (0.0, 0.0, 0.0),
    margin: float = 0.2,
    edges: Sequence[int] | None = None,
) -> PushPlan:
    """Plan a short path of a point pusher that brings a slider to the pose `goal` `(x, y, theta)` [m, m, rad].

    A sticking pusher stays at one point of the slider, and a constant force in the slider's axes then gives a constant
    twist, on every limit surface. A plan has three parts of constant force, each within the friction cone reduced by a
    `margin` of its half angle; their motions are arcs. Angles and lengths are found by shooting (SciPy), starting from
    rotations to either side, at the middle of each edge (or off its middle). Each path is simulated, and the shortest
    one that ends at the goal is returned. As with a car that only drives forward, a goal beside or behind the slider
    needs a long path. Pushing is unstable: errors of a long path grow, until the pusher slips. If every path misses the
    goal, the nearest is returned with a warning; `report.error` and the printed plan say by how much.

    `start` is the first pose, `edges` the edges that may be pushed (all by default).

    Raises `InvalidValueError` for arguments out of range and pushers other than a point with friction, `SolverError` if
    no plan is found.

    Source: Lynch and Mason 1996.
    """
    validation.instance("slider", slider, Slider, "a Slider")
    validation.instance("pusher", pusher, Pusher, "a Pusher")
    if pusher.width > 0.0 or pusher.mu == 0.0:
        raise InvalidValueError(
            "pusher", "be a point with friction, for a plan", pusher
        )
    start = validation.vector("start", start, 3)
    goal = validation.vector("goal", goal, 3)
    margin = validation.number("margin", margin)
    if not 0.0 <= margin < 1.0:
        raise InvalidValueError("margin", "be >= 0 and < 1", margin)
    count = len(slider.outline)
    chosen: Any = range(count) if edges is None else edges
    chosen = [validation.count("edges", each, 0, count - 1) for each in chosen]
    begin = time.perf_counter()
    cone = math.atan(pusher.mu)
    largest = (1.0 - margin) * cone
    if not np.any(goal - start):
        raise InvalidValueError("goal", "differ from the start", goal.tolist())
    aim = rotate(goal - start, -start[2])
    found = []
    for shares in PLACES:
        for edge, share in itertools.product(chosen, shares):
            corner = slider.outline[edge]
            at = corner + share * (slider.outline[(edge + 1) % count] - corner)
            place = TouchPoint(at, slider.inward[edge])
            length, x = _shortest(slider, place, largest, aim)
            if length < math.inf:
                found.append((length, x, edge, place))
        if found:
            break
    if not found:
        raise SolverError(
            "no plan reaches the goal: try other edges, a smaller margin or a pose further ahead"
        )
    tries = []
    for _, x, edge, place in sorted(found, key=lambda each: each[0]):
        x, path, done = _aimed(slider, pusher, place, x, largest, start, goal)
        distance, angle = _error(done.end, goal)
        off = max(distance / slider.size, angle)
        tries.append((off, edge, place, x, path, done))
        if off <= CLOSE:
            break
    off, edge, place, x, path, done = min(tries, key=lambda each: each[0])
    error = _error(done.end, goal)
    if off > CLOSE:
        message = f"the push misses its goal by {_miss(*error)}"
        warnings.warn(message, RuntimeWarning, stacklevel=2)
    surface = slider.surface
    rest = push(
        Slider(
            LimitSurfaceEllipsoid(surface.patch, normal_force=surface.normal_force),
            slider.outline,
        ),
        pusher,
        path,
        start=start,
    )
    goal, end, ellipsoid_end, at = (
        tuple(each.tolist()) for each in (goal, done.end, rest.end, place.at)
    )
    report = PushReport(
        goal,
        end,
        error,
        off <= CLOSE,
        ellipsoid_end,
        edge,
        at,
        slider.size * float(x[PARTS:].sum()),
        float(np.abs(x[:PARTS]).max() / cone),
        bool((done.mode[1:] == STICK).all()),
        time.perf_counter() - begin,
    )
    return PushPlan(path, done, report)


def _error(end: np.ndarray, goal: np.ndarray) -> tuple[float, float]:
    """Return distance [m] and angle [rad] between two poses."""
    x, y, angle = (end - goal).tolist()
    return math.hypot(x, y), abs(angle)


def _miss(distance: float, angle: float) -> str:
    """Return an error in words."""
    return f"{1e3 * distance:.3g} mm and {math.degrees(angle):.3g} deg"


def _aimed(
    slider: Slider,
    pusher: Pusher,
    place: TouchPoint,
    x: np.ndarray,
    largest: float,
    start: np.ndarray,
    goal: np.ndarray,
) -> tuple[np.ndarray, Signal, Push]:
    """Return angles and lengths, path and push of a plan that aims off the goal by the error of its push."""
    scale = [1.0, 1.0, slider.size]
    aim = wanted = rotate(goal - start, -start[2])
    path = _path(slider, place, x, start)
    done = push(slider, pusher, path, start=start)
    for _ in range(ROUNDS):
        aim = aim + wanted - rotate(done.end - start, -start[2])
        length, other = _shortest(slider, place, largest, aim, x)
        if length == math.inf:
            break
        tried = _path(slider, place, other, start)
        pair = (
            (x, path, done),
            (other, tried, push(slider, pusher, tried, start=start)),
        )
        x, path, done = min(pair, key=lambda e: np.abs((e[2].end - goal) * scale).max())
    return x, path, done


def _moved(pose: np.ndarray, twist: np.ndarray, distance: float) -> np.ndarray:
    """Return a pose after a twist of its own axes has been held: an arc."""
    vx, vy, omega = twist.tolist()
    half = 0.5 * distance * omega
    x, y, angle = pose.tolist()
    chord = distance * (math.sin(half) / half if abs(half) > 1e-12 else 1.0)
    c = chord * math.cos(angle + half)
    s = chord * math.sin(angle + half)
    return np.array([x + c * vx - s * vy, y + s * vx + c * vy, angle + 2.0 * half])


def _twist(slider: Slider, place: TouchPoint, angle: float) -> np.ndarray:
    """Return the twist under a force at an angle to the normal, at unit speed of the place."""
    twist, moved = pushed_by(slider.surface, place, angle)
    return twist / math.hypot(*moved)


def _shortest(
    slider: Slider,
    place: TouchPoint,
    largest: float,
    goal: np.ndarray,
    known: np.ndarray | None = None,
) -> tuple[float, np.ndarray]:
    """Return the length of the shortest plan at a place, infinite without one, and angles and lengths `[2 PARTS]`."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import least_squares, minimize

    unit = slider.size
    nodes = np.linspace(-largest, largest, NODES)
    twists = CubicSpline(nodes, [_twist(slider, place, each) for each in nodes])

    def miss(x: np.ndarray) -> np.ndarray:
        pose = np.zeros(3)
        for twist, distance in zip(twists(x[:PARTS]), x[PARTS:], strict=True):
            pose = _moved(pose, twist, unit * distance)
        return (pose - goal) / [unit, unit, 1.0]

    def length(x: np.ndarray) -> float:
        return x[PARTS:].sum()

    far = max(math.hypot(goal[0], goal[1]) / unit, 0.3)
    low = np.repeat([-largest, 0.0], PARTS)
    high = np.repeat([largest, 10.0 * far + 20.0], PARTS)
    slope = np.repeat([0.0, 1.0], PARTS)
    best = math.inf
    found = np.zeros(2 * PARTS)
    begins = [np.append(largest * turns, [0.4 * far] * PARTS) for turns in _TURNS]
    for begin in begins if known is None else [known]:
        # Older SciPy rounds beyond the bounds.
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            run = minimize(
                length,
                begin,
                jac=lambda x: slope,
                method="SLSQP",
                bounds=np.stack([low, high], -1),
                constraints={"type": "eq", "fun": miss},
                options={"ftol": 1e-6, "maxiter": 30},
            )
        inside = np.clip(run.x, low + 1e-9, high - 1e-9)
        x = least_squares(miss, inside, bounds=(low, high), xtol=1e-14, ftol=1e-14).x
        if np.abs(miss(x)).max() < REACHED and length(x) < best:
            best = length(x)
            found = x
    return unit * best, found


def _path(
    slider: Slider, place: TouchPoint, x: np.ndarray, start: np.ndarray
) -> Signal:
    """Return the path of the pusher at unit speed, as lines."""
    pose = start
    now = 0.0
    times = []
    at = []
    for angle, distance in zip(x[:PARTS], slider.size * x[PARTS:], strict=True):
        if distance < 1e-9:
            continue
        twist = _twist(slider, place, angle)
        count = max(CHORDS, math.ceil(abs(twist[2]) * distance / BEND))
        for way in np.linspace(0.0, distance, count + 1)[1 if times else 0 :]:
            here = _moved(pose, twist, way)
            at.append(here[:2] + rotate(place.at, here[2]))
            times.append(now + way)
        pose = _moved(pose, twist, distance)
        now = now + distance
    return Signal.sampled(times, at, "linear")
