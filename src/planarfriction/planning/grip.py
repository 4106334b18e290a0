"""Profiles of a grip force that let a held body turn or slide by a given amount, and then hold it."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.compiler import threads
from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction._support.pictures import picture
from planarfriction.derivatives import scene_sensitivities
from planarfriction.derivatives.scene_inputs import STATES
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import rotate
from planarfriction.planning.holding import dynamic_holding_load, holding_load
from planarfriction.scenes import Scene, Signal, SolverOptions, simulate
from planarfriction.scenes.body import pull_on
from planarfriction.scenes.contact import with_friction
from planarfriction.scenes.start import contact_map

TIGHT = 1e-5
"""Relative tolerance of the motions that are planned with [-]."""

LOOSE = 3e-4
"""Relative tolerance of derivatives and of motions to start from [-]."""

ANGLE = 3e-4
"""Unit of the residual of a goal that is an angle: 0.03 % of it, and 0.1 % of a
slide."""

SHIFT = 3e-3
"""Unit of the residual of a slide where the goal is an angle, in contact radii."""

SPEED = 1e-3
"""Unit of the residual of the speed at the end [m/s]."""

TURN = 1e-3
"""Unit of the residual of a turn where the goal is a slide [rad]."""

ROUGH = 0.08
"""Weight of the second differences of a profile over the holding load [-]: they decide between equal profiles."""


class Aim(NamedTuple):
    """A goal, and how far ends of motions miss it.

    An end is `[6]`: velocity `(vx, vy, omega)`, slide of the place under the grip (2), angle of the turn, [SI].
    """

    angle: float | None
    """Angle to rotate by [rad], without slide; None where the goal is a slide."""
    slide: np.ndarray
    """Slide to make `[2]` [m], without turning; zeros where the goal is an angle."""
    radius: float
    """Contact radius [m]."""

    @property
    def end(self) -> np.ndarray:
        """Wanted end `[6]`."""
        return np.array([0.0, 0.0, 0.0, *self.slide, self.angle or 0.0])

    def progress(self, end: np.ndarray) -> float:
        """Return the share of the goal that is reached [-]."""
        return float(end @ self.end / (self.end @ self.end))

    def scales(self) -> np.ndarray:
        """Units of the speeds (3), the slide (2) and the angle, as `[6]`."""
        if self.angle is not None:
            slide = SHIFT * self.radius
            angle = ANGLE * abs(self.angle)
        else:
            slide = 1e-3 * np.hypot(*self.slide)
            angle = TURN
        return np.array([SPEED, SPEED, SPEED / self.radius, slide, slide, angle])

    def misses(self, end: np.ndarray) -> np.ndarray:
        """Return the misses `[6]`, each over what counts as one."""
        return (end - self.end) / self.scales()


class Grips:
    """The scene under different profiles of one contact's normal force, with the frictions of an ensemble.

    Members differ by a factor on mu_c and mu_s of all contacts. What they share is built once, and they run in threads.
    """

    def __init__(self, scene: Scene, contact: int, factors: Sequence[float]) -> None:
        self.scene = scene
        self.index = contact
        self.name = f"{scene.contacts[contact].name}.normal_force"
        for each in scene.contacts:
            law = each.model.law
            if not (hasattr(law, "mu_c") or hasattr(law, "mu_s")):
                raise InvalidValueError(
                    "law",
                    "have mu_c and mu_s to plan with uncertain friction",
                    type(law).__name__,
                )
        self._members = {
            factor: [with_friction(each, factor) for each in scene.contacts]
            for factor in factors
        }
        held = scene.start == "equilibrium"
        self.first = scene.contacts[contact].normal_force(0.0) if held else None
        """Normal force that holds the body at first [N]; None where it may be any."""
        self._ends: dict[Any, np.ndarray] = {}
        self.jacobians = 0

    @property
    def simulations(self) -> int:
        """Number of simulations so far."""
        return len(self._ends)

    def scene_of(self, profile: Signal, factor: float = 1.0) -> Scene:
        """Return the scene with the profile in place."""
        contacts = list(self._members[factor])
        own = contacts[self.index]
        contacts[self.index] = dataclasses.replace(own, normal_force=profile)
        return dataclasses.replace(self.scene, contacts=contacts)

    def ends(
        self, profile: Signal, factors: Sequence[float], rtol: float | None = TIGHT
    ) -> list[np.ndarray]:
        """Return the end `[6]` of the motion under each friction; of one that was simulated, as it was."""
        known = profile.times.tobytes(), profile.values.tobytes(), rtol

        def one(factor: float) -> np.ndarray:
            if (factor, *known) not in self._ends:
                scene = self.scene_of(profile, factor)
                histories = simulate(scene, rtol=rtol, save_every=scene.t_end).histories
                last = np.array([histories[name].values[-1] for name in STATES])
                slide = slide_of(scene, self.index, last[3:])
                end = np.array([*last[:3], *slide, last[5] - scene.body.angle])
                self._ends[factor, *known] = end
            return self._ends[factor, *known]

        return threads.each(one, factors)

    def slopes(self, profile: Signal, factors: Sequence[float]) -> list[np.ndarray]:
        """Return the derivatives of the end by the knots `[6, K]` under each friction."""
        self.jacobians += len(factors)

        def one(factor: float) -> np.ndarray:
            scene = self.scene_of(profile, factor)
            knots = {self.name: profile.times}
            options = SolverOptions(rtol=LOOSE, save_every=scene.t_end)
            found = scene_sensitivities(scene, (), signals=knots, options=options)
            slopes = found.d_motion[-1].copy()
            pose = found.motion[-1, 3:]
            place = grip_position(scene, self.index) - pose[:2]
            x, y = slide_of(scene, self.index, pose) + place
            slopes[3:5] += np.outer([-y, x], slopes[5])
            return slopes

        return threads.each(one, factors)


def grip_position(scene: Scene, contact: int) -> np.ndarray:
    """Return the initial position of the contact frame's origin in the world `[2]` [m]."""
    body = scene.body
    chosen = scene.contacts[contact]
    if chosen.mounted_on == "world":
        return np.array(chosen.position)
    return body.position + rotate(chosen.position, body.angle)


def slide_of(scene: Scene, contact: int, pose: np.ndarray) -> np.ndarray:
    """Return the displacement `[..., 2]` [m] of the place that was under a contact, at poses `[..., 3]`."""
    grip = grip_position(scene, contact)
    arm = rotate(grip - scene.body.position, pose[..., 2] - scene.body.angle)
    return pose[..., :2] + arm - grip


def load_on(
    scene: Scene, contact: int, angle: float, slide: Any, time: float
) -> np.ndarray:
    """Return the load of gravity, applied force and springs on one contact `[3]` [N, N, N m] once the body has moved.

    By `angle` [rad] about the grip and by `slide` `[2]` [m]; about the origin of the contact frame, in its axes, of one
    of the identical contacts.
    """
    body = scene.body
    chosen = scene.contacts[contact]
    grip = grip_position(scene, contact)
    at = grip + slide + rotate(body.position - grip, angle)
    moved = dataclasses.replace(
        body, position=at, angle=body.angle + angle, velocity=(0.0, 0.0, 0.0)
    )
    there = dataclasses.replace(scene, body=moved, start="rest")
    pull = pull_on(scene, moved, time)
    return np.linalg.solve(contact_map(there, chosen).T, pull) / chosen.count


@dataclass(frozen=True, eq=False, repr=False)
class GripReport(ByValue):
    """Result of a plan with the scene's friction and with F other values, and the time that planning took."""

    goal: dict[str, Any]
    """The goal as given."""
    angle: float
    """Angle by which the body turns [rad]."""
    slide: np.ndarray
    """Displacement `[2]` of the point of the body under the grip, world axes [m]."""
    speed: float
    """Speed of that point at the end [m/s]."""
    grip: float
    """Normal force at the end [N]."""
    holding: float
    """Smallest normal force that would hold the body there [N]."""
    frictions: np.ndarray
    """Factors on mu_c and mu_s, ascending `[F]`."""
    angles: np.ndarray
    """Angle by which the body turns with each friction `[F]` [rad]."""
    slides: np.ndarray
    """Slide with each friction `[F, 2]` [m]."""
    per_percent: float
    """Change of the goal's quantity per percent of friction: angle [rad] or slide [m]."""
    simulations: int
    """Number of simulations."""
    jacobians: int
    """Number of Jacobians with respect to all knots."""
    wall_time: float
    """Computing time [s]."""

    @property
    def spread(self) -> float:
        """Largest error of the goal over all frictions: angle [rad] or slide [m]."""
        if "angle" in self.goal:
            return float(np.abs(self.angles - self.goal["angle"]).max())
        return float(np.hypot(*(self.slides - self.goal["slide"]).T).max())

    def __str__(self) -> str:
        if "angle" in self.goal:
            wanted = f"rotate by {np.rad2deg(self.goal['angle']):.4g} degrees"
            per = f"{np.rad2deg(self.per_percent):.2g} degrees"
        else:
            x, y = 1e3 * np.array(self.goal["slide"])
            wanted = f"slide by ({x:.4g}, {y:.4g}) mm"
            per = f"{1e3 * self.per_percent:.2g} mm"
        lines = [
            f"Grip plan: {wanted}.",
            "",
            f"{'friction':>9}{'angle [deg]':>13}{'slide x [mm]':>15}{'slide y [mm]':>15}",
        ]
        both = zip(self.frictions, self.angles, self.slides, strict=True)
        for factor, angle, (x, y) in both:
            change = f"{100.0 * (factor - 1.0):+.3g} %" if factor != 1.0 else "nominal"
            lines.append(
                f"{change:>9}{np.rad2deg(angle):>13.3f}{1e3 * x:>15.3f}{1e3 * y:>15.3f}"
            )
        lines += [
            "",
            f"An error of one percent in friction changes the result by {per}.",
            f"The final grip is {self.grip:.3g} N, {self.grip / self.holding:.2f} times the holding force.",
            f"{self.simulations} simulations, {self.jacobians} Jacobians, {self.wall_time:.2g} s.",
        ]
        return "\n".join(lines)

    __repr__ = __str__


def report_of(
    aim: Any,
    frictions: Sequence[float],
    ends: Sequence[np.ndarray],
    grip: float,
    holding: float,
    cost: Any,
) -> GripReport:
    """Return the report on the ends `[6]` of a plan, one for each friction (see `motions.Aim`)."""
    less, end, more = (ends[frictions.index(each)] for each in (0.99, 1.0, 1.01))
    goal = {"angle": aim.angle}
    if aim.angle is None:
        goal = {"slide": tuple(aim.slide.tolist())}
    change = 0.5 * abs(aim.progress(more) - aim.progress(less))
    speed = float(np.linalg.norm(end[:3] * [1.0, 1.0, aim.radius]))
    per_percent = change * float(np.linalg.norm(aim.end))
    every = np.array(ends)
    of_nominal = goal, float(end[5]), end[3:5], speed, grip, holding
    return GripReport(
        *of_nominal, np.array(frictions), every[:, 5], every[:, 3:5], per_percent, *cost
    )


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

GAIN = 2e-3
"""Share of the cost that a further step must save."""

MOST_KNOTS = 200
"""Largest number of knots of a profile."""


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
        `{"angle": radians}`: rotate by that angle and slide as little as possible; or `{"slide": (dx, dy)}`: slide by
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
    model = chosen.model
    patch = model.patch
    law = model.law.numbers
    first = load_on(scene, index, 0.0, np.zeros(2), 0.0)
    at_start = holding_load(first, patch, law.mu_c)
    if at_start == 0.0:
        raise InvalidValueError(
            "scene", "have a load that moves the body", "no gravity and no force"
        )
    last = load_on(scene, index, angle or 0.0, slide, scene.t_end)
    at_end = holding_load(last, patch, law.mu_c)
    # laws that creep, and models whose bristles cannot start in equilibrium, have the load of mu_c alone
    if model.law.holds_at_rest and hasattr(model, "state_of"):
        apart = np.subtract(scene.body.position, grip_position(scene, index))
        mass = scene.body.mass
        inertia = scene.body.inertia + mass * float(apart @ apart)
        own = {"mass": mass / chosen.count, "inertia": inertia / chosen.count}
        at_end = max(at_end, dynamic_holding_load(last, model, **own))
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
        cost = lambda values: (self._residuals(values, LOOSE) ** 2).sum()
        costs = threads.each(cost, profiles)
        best = np.argmin(costs)
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

        earliest = times[0] - rise
        latest = times[-1] - rise

        def progress(until: float) -> float:
            (end,) = self._grips.ends(self._signal(released(until)), [1.0], rtol=LOOSE)
            return self._aim.progress(end)

        def missing(until: float) -> float:
            """Return what is missing in the root of the progress, which grows with the time: the load accelerates."""
            share = max(progress(until), 0.0) if until > earliest else 0.0
            return share**0.5 - 1.0 if abs(share - 1.0) > NEAR else 0.0

        most = progress(latest)
        if most <= 1.0:
            return most, None
        return most, released(float(brentq(missing, earliest, latest, xtol=1e-4)))  # pyright: ignore

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

    def _misses(self, values: np.ndarray, rtol: float = TIGHT) -> np.ndarray:
        """Return the misses `[F, 6]` with each friction."""
        ends = self._grips.ends(self._signal(values), self._factors, rtol)
        return self._aim.misses(np.array(ends))

    def _inside(self, values: np.ndarray) -> np.ndarray:
        inside = 1e-2 * np.minimum(self._highest - self._low, self._holding)
        return np.clip(values, self._low + inside, self._highest - inside)

    def _residuals(self, values: np.ndarray, rtol: float = TIGHT) -> np.ndarray:
        misses = self._weights[:, None] ** 0.5 * self._misses(values, rtol)
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
