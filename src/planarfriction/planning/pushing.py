"""Quasi-static pushes: the path of a slider for a given path of a pusher, with the contact mode at each instant."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.planning.contact_modes import (
    LEFT,
    RIGHT,
    STICK,
    TouchPoint,
    motion_at,
    rotation,
)
from planarfriction.planning.slider import (
    FACE,
    Pusher,
    Scenery,
    Slider,
    Touch,
    flush_after,
    place_of,
    touch_after,
)
from planarfriction.scenes import Signal
from planarfriction.scenes.signal import as_signal

FREE = "free"
"""The mode of a pusher that does not touch, or that goes away."""

MOST_SAMPLES = 100_000
"""Largest number of instants that are recorded."""

MOST_PHASES = 2_000
"""Largest number of changes of mode that are followed."""

RESTLESS = 4
"""Quick changes of mode in a row after which events no longer separate the modes: on a
facet of a limit surface a push may stay at the edge of its motion cone."""

STILL = 1e-6
"""Share of the whole time within which a change of mode is quick."""


@dataclass(frozen=True, eq=False, repr=False)
class Push(ByValue):
    """The motion of a pushed slider, and its contact with the pusher."""

    slider: Slider
    """The slider."""
    pusher: Pusher
    """The pusher."""
    time: np.ndarray
    """Instants `[T]` [s]."""
    pose: np.ndarray
    """Pose `(x, y, theta)` of the slider's frame in the world `[T, 3]` [m, m, rad]."""
    pusher_pose: np.ndarray
    """Pose of the pusher `[T, 3]` [m, m, rad]."""
    mode: np.ndarray
    """"stick", "slide left", "slide right" (as seen from the pusher) or "free", `[T]`."""
    place: np.ndarray
    """Point of contact in the slider's axes `[T, 2]` [m], NaN without contact; the middle of a face that lies flush."""

    @property
    def end(self) -> np.ndarray:
        """The last pose of the slider `[3]` [m, m, rad]."""
        return self.pose[-1]

    def __repr__(self) -> str:
        x, y, theta = self.end
        modes = ", ".join(
            f"{name} {np.mean(self.mode == name):.0%}"
            for name in dict.fromkeys(self.mode.tolist())
        )
        return f"Push to ({1e3 * x:.4g} mm, {1e3 * y:.4g} mm, {np.degrees(theta):.4g} deg): {modes}"

    def plot(self) -> Any:
        """Draw the slider at instants of the push, with the path of the pusher; returns a matplotlib Figure."""
        return picture("push", self)


def push(
    slider: Slider,
    pusher: Pusher,
    path: Signal,
    *,
    start: ArrayLike = (0.0, 0.0, 0.0),
    samples: int = 101,
    rtol: float = 1e-7,
) -> Push:
    """Predict the motion of a slider that is pushed slowly: friction balances the pusher, without inertia.

    The twist is normal to the limit surface where the pusher's wrench meets it. The pusher sticks while its velocity is
    inside the motion cone, and slides along the slider otherwise. A face that lies flush sticks or slides too, or turns
    about the end that carries its pressure. A pusher that moves away leaves the slider where it is.

    Parameters
    ----------
    slider, pusher
        The object, and what pushes it.
    path
        Pose of the pusher over time, linear between its samples: `(x, y)` `[K, 2]` [m] of a point, `(x, y, angle)` `[K,
        3]` [m, m, rad] of a face, which faces along its own x axis. Only the path matters, not the speed.
    start
        First pose `(x, y, theta)` of the slider's frame [m, m, rad].
    samples
        Number of recorded instants, spread evenly over the path, including both ends.
    rtol
        Relative tolerance of each step of the integration.

    Raises `InvalidValueError` for arguments out of range and a pusher that begins inside the slider.

    Source: Mason 1986; Goyal, Ruina and Papadopoulos 1991; Lynch, Maekawa and Tanie 1992.
    """
    validation.instance("slider", slider, Slider, "a Slider")
    validation.instance("pusher", pusher, Pusher, "a Pusher")
    if not isinstance(path, Signal) or path.hold != "linear" or len(path.times) < 2:
        raise InvalidValueError(
            "path", 'be a Signal of two samples or more with hold="linear"', path
        )
    of_point = path.columns == 2 and pusher.width == 0.0
    path = as_signal("path", path, 2 if of_point else 3)
    start = validation.vector("start", start, 3)
    count = validation.count("samples", samples, 2, MOST_SAMPLES)
    rtol = validation.positive("rtol", rtol)
    poses = path.values if path.columns == 3 else np.pad(path.values, ((0, 0), (0, 1)))
    scenery = Scenery(slider, pusher, path.times, poses)
    time = np.linspace(path.times[0], path.times[-1], count)
    pose, modes, places = _follow(scenery, start, time, rtol)
    at = np.array([scenery.pose(t) for t in time])
    return Push(slider, pusher, time, pose, at, np.array(modes), places)


def _follow(
    scenery: Scenery, start: np.ndarray, time: np.ndarray, rtol: float
) -> tuple[np.ndarray, list[str], Any]:
    """Return poses, modes and places at given times, phase after phase."""
    from scipy.integrate import solve_ivp

    poses = np.tile(start, (len(time), 1))
    modes = [FREE] * len(time)
    places = np.full((len(time), 2), np.nan)
    slider = scenery.slider
    mu = scenery.pusher.mu
    if scenery.gap(time[0], start) < -1e-6 * slider.size:
        raise InvalidValueError(
            "path", "begin outside the slider", scenery.pose(time[0]).tolist()
        )
    now = time[0]
    q = start
    held = ""
    contact: Touch | None = None
    restless = 0
    for _ in range(MOST_PHASES):
        if now >= time[-1]:
            break
        if contact is None:
            poses[time > now] = q
            touched = touch_after(scenery, now, q)
            if touched is None:
                break
            now, contact = touched
            held = ""
        end = scenery.piece_end(now)
        place, velocity = place_of(scenery, contact, now, q, forward=True)
        if velocity[:2] @ place.normal <= 0.0:
            now = np.nextafter(now, np.inf)
            contact = None
            continue
        first = motion_at(slider.surface, place, mu, velocity)
        mode = (
            first.mode
            if first.mode != held
            else _neighbour(slider, place, mu, velocity, held)
        )
        held = ""
        if first.leans:
            contact = flush_after(scenery, contact, now, q, first.leans)
            continue
        mode = "" if restless >= RESTLESS and not place.half_width else mode
        rate, ends = _phase(scenery, contact, mode)
        run = solve_ivp(
            rate,
            (now, end),
            q,
            events=[*ends.values()],
            dense_output=True,
            rtol=rtol,
            atol=rtol * np.array([slider.size, slider.size, 1.0]),
            first_step=end - now,
        )
        here = (time > now) & (time <= run.t[-1]) | (time == now)
        for k in np.flatnonzero(here):
            poses[k] = run.sol(time[k])
            place, velocity = place_of(scenery, contact, time[k], poses[k])
            modes[k] = (
                mode
                if mode and mu > 0.0
                else motion_at(slider.surface, place, mu, velocity).mode
            )
            places[k] = place.at
        restless = restless + 1 if run.t[-1] - now < STILL * (time[-1] - time[0]) else 0
        q = run.y[:, -1].copy()
        now = run.t[-1]
        poses[time > now] = q
        if run.status == 0:
            continue
        what = next(
            name for name, each in zip(ends, run.t_events, strict=True) if len(each)
        )
        if what == "mode":
            held = mode
        elif what == "closes":
            contact = scenery.flush(now, q)
        else:
            contact = None
    else:
        raise InvalidValueError(
            "path",
            f"change the contact of the pusher at most {MOST_PHASES} times",
            f"t = {now:g} s",
        )
    return poses, modes, places


def _neighbour(
    slider: Slider, place: TouchPoint, mu: float, velocity: np.ndarray, held: str
) -> str:
    """Return the mode after one that has come to its end, where rounding still takes it for the old one."""
    if held != STICK:
        return STICK
    slack = lambda mode: motion_at(slider.surface, place, mu, velocity, mode).slack
    return LEFT if slack(LEFT) > slack(RIGHT) else RIGHT


def _phase(scenery: Scenery, contact: Touch, mode: str) -> tuple[Any, dict[str, Any]]:
    """Return the rate of a slider whose contact keeps its mode, and by name the functions whose fall to 0 ends it."""

    @functools.lru_cache(maxsize=1)
    def motion(t: float, *q: float) -> tuple[Any, Any, np.ndarray]:
        place, velocity = place_of(scenery, contact, t, np.array(q))
        surface = scenery.slider.surface
        found = motion_at(surface, place, scenery.pusher.mu, velocity, mode)
        return found, place, velocity

    def rate(t: float, q: np.ndarray) -> np.ndarray:
        twist = motion(t, *q)[0].twist
        return np.append(rotation(q[2]) @ twist[:2], twist[2])

    def approach(t: float, q: np.ndarray) -> float:
        _, place, velocity = motion(t, *q)
        return velocity[:2] @ place.normal

    ends: dict[str, Any] = {"mode": lambda t, q: motion(t, *q)[0].slack} if mode else {}
    ends |= {"leaves": approach, "ends": functools.partial(scenery.within, contact)}
    # Something else may begin to touch.
    if scenery.pusher.width > 0.0 and contact.kind != FACE:
        ends["closes"] = functools.partial(scenery.clear, contact)
    for event in ends.values():
        event.terminal = True
        event.direction = -1
    return rate, ends
