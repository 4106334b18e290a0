"""Profiles of a grip force that let a held body turn or slide by a given amount, and then hold it."""

from __future__ import annotations

import functools
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planarfriction._engine.compiler import threads
from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.planning.holding import dynamic_holding_load, holding_load
from planarfriction.planning.motions import (
    LOOSE,
    ROUGH,
    Aim,
    GripReport,
    Grips,
    grip_position,
    load_on,
    report_of,
)
from planarfriction.scenes import Scene, Signal

LEVELS = (0.93, 0.85, 0.7, 0.5, 0.25, 0.02)
"""Grips to start from, as shares of the load that holds a sliding body: above it nothing follows from a change."""

KICK = 0.7
"""Share of the load that holds a body at rest with which the grip begins: bristles at rest give way at once."""

SPANS = (0.75, 0.2)
"""Shares of the duration over which knots are spread: a short drop needs them close, a slow turn far apart."""

ROUNDS = 2
"""Rounds in which the worst friction gets more weight."""

TRIES = 16
"""Profiles that are tried for one friction; for several, half as many in each round."""

NEAR = 1e-3
"""Share of the goal by which a profile to start from may miss it."""

GAIN = 1e-3
"""Share of the cost that a further step must save."""

MOST_KNOTS = 200


@dataclass(frozen=True, eq=False, repr=False)
class GripPlan(ByValue):
    """A grip force over time that brings a body to its goal, and the resulting motion."""

    scene: Scene
    """The scene with the planned grip: `simulate(plan.scene)` runs the plan."""
    signal: Signal
    """Normal force of one of the identical contacts [N], linear between its knots, constant after the last."""
    report: GripReport
    """Result of the plan, with the scene's friction and with other values."""
    contact: str
    """Name of the contact that was planned."""
    frictions: tuple[Scene, ...] = field(default=(), compare=False)
    """Simulations of the plan with each friction of the report."""

    def __repr__(self) -> str:
        return str(self.report)

    def plot(self) -> Any:
        """Draw the profile and the motion with each friction; returns a matplotlib Figure."""
        return picture("grip", self)


def plan_grip(
    scene: Scene,
    goal: Mapping[str, Any],
    *,
    contact: str | None = None,
    knots: Any = 20,
    bounds: Sequence[float] | None = None,
    margin: float = 0.5,
    friction: float = 0.05,
    aim: str = "nominal",
) -> GripPlan:
    """Plan the normal force of a contact so that the body it holds turns or slides by a given amount, and stops.

    The load on the body drives it, and friction brakes it. The search starts with profiles that release the body at a
    few levels below the holding load, for the time that reaches the goal (a root of one variable). It takes the best of
    them, and improves its knots by least squares with the derivatives of `scene_sensitivities`.

    Parameters
    ----------
    scene
        A free body, its contacts and the duration. With `start="equilibrium"` the grip begins with the scene's own
        normal force, which must hold the body; with relaxed bristles it may begin with any value.
    goal
        `{"angle": radians}`: turn by that angle and slide as little as possible; or `{"slide": (dx, dy)}`: slide by
        that distance [m], world axes, and turn as little as possible. Slide is the displacement of the point under the
        grip.
    contact
        Name of the contact whose normal force is planned; None takes the only one.
    knots
        Number of knots, spread evenly over the first three quarters or the first fifth of the duration, whichever is
        better; or their times [s]. The last value is held.
    bounds
        Least and largest normal force [N]; None for 0.02 and 4 times the load that holds the body.
    margin
        Share by which the last knot, and all knots in the last quarter of the duration, must exceed the load that holds
        the body at the goal: the `holding_load` with mu_c, or the `dynamic_holding_load` of the scene's model after a
        fall in one step, whichever is larger.
    friction
        Uncertainty of mu_c and mu_s, as a share; the report shows its effect.
    aim
        "nominal": reach the goal with the scene's friction; "worst": minimise the error for the worst of the frictions.

    Raises
    ------
    InvalidValueError
        A parameter breaks its rule, or no grip within the bounds brings the body to the goal.
    """
    begin = time.perf_counter()
    index = _contact_of(scene, contact)
    angle, slide = _goal(goal)
    spread = _knots(scene, knots)
    friction = validation.non_negative("friction", friction)
    if friction >= 1.0:
        raise InvalidValueError("friction", "be below 1", friction)
    validation.choice("aim", aim, ("nominal", "worst"))
    chosen = scene.contacts[index]
    patch = chosen.model.patch
    law = chosen.model.law.numbers
    first = load_on(scene, index, 0.0, np.zeros(2), 0.0)
    at_start = holding_load(first, patch, law.mu_c)
    if at_start == 0.0:
        raise InvalidValueError(
            "scene", "have a load that moves the body", "no gravity and no force"
        )
    last = load_on(scene, index, angle or 0.0, slide, scene.t_end)
    at_end = _holding_at(scene, index, last)
    low, high = _bounds(bounds, at_start)
    least = (1.0 + validation.non_negative("margin", margin)) * at_end
    if least > high:
        raise InvalidValueError(
            "bounds",
            f"reach the {least:.3g} N that hold the body at the end",
            [low, high],
        )
    shares = (1.0, 1.0 - friction, 1.0 + friction) if friction else (1.0,)
    seen = sorted({*shares, 0.99, 1.01})
    grips = Grips(scene, index, seen)
    wanted = Aim(angle, slide, patch.contact_radius(at_start))
    factors = shares if aim == "worst" else (1.0,)
    searches = [
        _ProfileSearch(grips, wanted, factors, times, (low, least, high), at_start)
        for times in spread
    ]
    kick = KICK * law.mu_c / law.mu_s
    hold = min(high, max(2.0 * least, at_start))
    profile = max(searches, key=lambda each: each.begin(kick, hold)).bent()
    ends = grips.ends(profile, seen, rtol=None)
    cost = grips.simulations, grips.jacobians, time.perf_counter() - begin
    report = report_of(wanted, seen, ends, float(profile.values[-1]), at_end, cost)
    found = tuple(grips.scene_of(profile, factor) for factor in shares)
    return GripPlan(found[0], profile, report, chosen.name, found)


@dataclass(eq=False)
class _ProfileSearch:
    """Search for the values at some knots, between `low`, `least` for those that hold, and `high` [N]."""

    _grips: Grips
    _aim: Aim
    _factors: Sequence[float]
    _times: np.ndarray
    _between: tuple[float, float, float]
    _holding: float

    def __post_init__(self) -> None:
        low, least, high = self._between
        count = len(self._times)
        held = self._times >= SPANS[0] * self._grips.scene.t_end
        held[-1] = True
        self._low = np.where(held, least, low)
        self._highest = np.full(count, high * (1.0 + 1e-6))
        self._first = self._grips.first
        # A grip that holds the body at first goes on from there.
        if self._first is not None:
            self._low[0] = self._first * (1.0 - 1e-6)
            self._highest[0] = self._first * (1.0 + 1e-6)
        self._bend = ROUGH / self._holding * np.diff(np.eye(count), 2, axis=0)
        self._weights = np.full(len(self._factors), 1.0 / len(self._factors))
        self._values = np.zeros(0)
        self._reached = 0.0

    def begin(self, kick: float, hold: float) -> float:
        """Return the cost of the best profile that releases the body at one level until the goal is reached.

        Minus what the search makes least; far less without such a profile.
        """
        found = threads.each(lambda level: self._released(level, kick, hold), LEVELS)
        self._reached = max(reached for reached, _ in found)
        profiles = [values for _, values in found if values is not None]
        if not profiles:
            return -np.inf
        cost = lambda values: float((self._residuals(values) ** 2).sum())
        costs = threads.each(cost, profiles)
        best = int(np.argmin(costs))
        self._values = profiles[best]
        return -0.5 * costs[best]

    def _released(
        self, level: float, kick: float, hold: float
    ) -> tuple[float, np.ndarray | None]:
        """Return the share of the goal that a release at one level reaches at most, and its knots if it reaches it."""
        from scipy.optimize import brentq

        times = self._times
        first = np.array([min(level, kick), level]) * self._holding
        first = first if self._first is None else np.append(self._first, first)
        rise = np.diff(times).max()
        low = np.interp(times, times[0] + rise * np.arange(len(first)), first)

        def released(until: float) -> np.ndarray:
            """Return the values of a profile that stays low until some time, and then holds."""
            held = np.interp(times, [until, until + rise], [0.0, 1.0])
            return self._inside(low + (hold - low) * held)

        @functools.cache
        def missing(until: float) -> float:
            (end,) = self._grips.ends(self._signal(released(until)), [1.0], rtol=LOOSE)
            off = self._aim.progress(end) - 1.0
            return off if abs(off) > NEAR else 0.0

        earliest = times[0] - rise
        latest = times[-1] - rise
        most = missing(latest)
        if most <= 0.0:
            return most + 1.0, None
        return most + 1.0, released(float(brentq(missing, earliest, latest, xtol=1e-4)))  # pyright: ignore

    def bent(self) -> Signal:
        """Return the profile after a search that begins at that of the start."""
        from scipy.optimize import least_squares

        if not len(self._values):
            rule = f"be within reach of the load on the body (it gets at most {100.0 * self._reached:.3g} % of the way)"
            if self._aim.angle is None:
                raise InvalidValueError("slide", rule, self._aim.slide.tolist())
            raise InvalidValueError("angle", rule, self._aim.angle)
        values = self._values
        best = self._values
        least = np.inf
        several = len(self._factors) > 1
        tries = TRIES // 2 if several else TRIES
        for _ in range(1 + ROUNDS * several):
            found = least_squares(
                self._residuals,
                values,
                jac=self._slopes,  # pyright: ignore[reportArgumentType]
                bounds=(self._low, self._highest),
                x_scale=self._holding,
                max_nfev=tries,
                ftol=GAIN,
            )
            values = found.x
            misses = np.linalg.norm(self._misses(values), axis=1)
            if misses.max() < least:
                best = values
                least = misses.max()
            if misses.any():
                self._weights = self._weights * misses / (self._weights @ misses)
        return self._signal(best)

    def _signal(self, values: np.ndarray) -> Signal:
        return Signal.sampled(self._times, values, "linear")

    def _misses(self, values: np.ndarray) -> np.ndarray:
        """Return the misses `[F, 6]` with each friction."""
        ends = self._grips.ends(self._signal(values), self._factors)
        return self._aim.misses(np.array(ends))

    def _inside(self, values: np.ndarray) -> np.ndarray:
        inside = 1e-2 * np.minimum(self._highest - self._low, self._holding)
        return np.clip(values, self._low + inside, self._highest - inside)

    def _residuals(self, values: np.ndarray) -> np.ndarray:
        misses = self._weights[:, None] ** 0.5 * self._misses(values)
        return np.concatenate([misses.ravel(), self._bend @ values])

    def _slopes(self, values: np.ndarray) -> np.ndarray:
        slopes = self._grips.slopes(self._signal(values), self._factors)
        shares = self._weights[:, None, None] ** 0.5 / self._aim.scales()[:, None]
        return np.concatenate([*(shares * slopes), self._bend])


# ---------------------------------------------------------------------- what was asked for


def _contact_of(scene: Any, name: str | None) -> int:
    """Return the index of the contact whose grip is planned."""
    validation.instance("scene", scene, Scene, "a Scene")
    if scene.start == "sliding":
        raise InvalidValueError(
            "start", "be 'rest' or 'equilibrium' for a grip plan", scene.start
        )
    names = [each.name for each in scene.contacts]
    unset = {
        "velocity": (scene.velocity, "a body that a grip moves"),
        "stop_speed": (scene.stop_speed, "a plan, which has to hold until the end"),
    }
    for each in scene.contacts:
        support = f"support_velocity of contact {each.name!r}"
        unset[support] = (each.support_velocity, "a grip plan")
    for what, (given, purpose) in unset.items():
        if given is not None:
            raise InvalidValueError(what, f"be None for {purpose}", given)
    if name is None and len(names) > 1:
        raise InvalidValueError(
            "contact", f"be given if there are several ({', '.join(names)})", name
        )
    return 0 if name is None else names.index(validation.choice("contact", name, names))


def _holding_at(scene: Scene, contact: int, load: np.ndarray) -> float:
    """Return the normal force [N] that stops and holds a load `[3]` on a contact, however quickly the grip falls to it.

    Laws that creep, and models whose bristles cannot start in equilibrium, have that of mu_c alone.
    """
    body = scene.body
    chosen = scene.contacts[contact]
    model = chosen.model
    apart = np.subtract(body.position, grip_position(scene, contact))
    stops = holding_load(load, model.patch, model.law.numbers.mu_c)
    if not (model.law.holds_at_rest and hasattr(model, "state_of")):
        return stops
    mass = body.mass / chosen.count
    inertia = (body.inertia + body.mass * float(apart @ apart)) / chosen.count
    return max(stops, dynamic_holding_load(load, model, mass=mass, inertia=inertia))


def _goal(goal: Any) -> tuple[float | None, np.ndarray]:
    """Return the angle of the goal, None for a slide, and the slide, zeros for an angle."""
    if not isinstance(goal, Mapping) or len(goal) != 1:
        raise InvalidValueError(
            "goal",
            'be {"angle": radians} or {"slide": (dx, dy)}',
            validation.quoted(goal),
        )
    validation.keys("goal", goal, [], ["angle", "slide"])
    angle = None
    slide = np.zeros(2)
    if "angle" in goal:
        angle = validation.number("angle", goal["angle"])
    else:
        slide = validation.array("slide", goal["slide"], (2,))
    if not angle and not slide.any():
        raise InvalidValueError("goal", "not be zero", dict(goal))
    return angle, slide


def _knots(scene: Scene, knots: Any) -> list[np.ndarray]:
    """Return the times of the knots [s], of which the best are taken."""
    if isinstance(knots, (int, np.integer)) and not isinstance(knots, bool):
        count = validation.count("knots", knots, 4, MOST_KNOTS)
        return [np.linspace(0.0, share * scene.t_end, count) for share in SPANS]
    times = validation.array("knots", knots, (None,))
    increasing = times[:1] == 0.0 and (np.diff(times) > 0.0).all()
    if not (4 <= len(times) <= MOST_KNOTS and increasing):
        raise InvalidValueError(
            "knots", f"be 4 to {MOST_KNOTS} increasing times >= 0", times.tolist()
        )
    if times[-1] >= scene.t_end:
        raise InvalidValueError(
            "knots", f"end before the scene does, at {scene.t_end:g} s", times.tolist()
        )
    return [times]


def _bounds(bounds: Any, holding: float) -> tuple[float, float]:
    if bounds is None:
        return 0.02 * holding, 4.0 * holding
    low, high = validation.non_negative_array("bounds", bounds, (2,)).tolist()
    if not low < high:
        raise InvalidValueError(
            "bounds", "be the least and the largest normal force", [low, high]
        )
    return low, high
