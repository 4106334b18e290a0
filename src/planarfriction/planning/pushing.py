"""Quasi-static pushes: the path of a slider for a given path of a pusher, with the contact mode at each instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.pictures import picture
from planarfriction.planning.contact_modes import LEFT, RIGHT, STICK, TouchPoint, motion_at
from planarfriction.planning.slider import Pusher, Slider
from planarfriction.planning.touch import Scenery, Touch, flush_after, place_of, touch_after
from planarfriction.scenes import Signal
from planarfriction.scenes.signal import as_signal

FREE = "free"
"""The mode of a pusher that does not touch, or that goes away."""

MOST_SAMPLES = 100_000
"""Instants that are recorded at most."""

RESTLESS, STILL = 4, 1e-6
"""Changes of mode in a row, each within a share of the whole time, after which events no longer separate the modes: on
a facet of a limit surface a push may stay at the edge of its motion cone."""

MOST_PHASES = 2_000
"""Changes of mode in a push that are followed."""


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
        modes = ", ".join(f"{name} {np.mean(self.mode == name):.0%}" for name in dict.fromkeys(self.mode.tolist()))
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
    """Predict the motion of a slider that is pushed slowly: friction balances the pusher at every instant, without
    inertia.

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
        raise InvalidValueError("path", 'be a Signal of two samples or more with hold="linear"', path)
    path = as_signal("path", path, 2 if path.columns == 2 and pusher.width == 0.0 else 3)
    start = validation.vector("start", start, 3).astype(float)
    count, rtol = validation.count("samples", samples, 2, MOST_SAMPLES), validation.positive("rtol", rtol)
    poses = path.values if path.columns == 3 else np.pad(path.values, ((0, 0), (0, 1)))
    scenery = Scenery(slider, pusher, path.times, poses)
    time = np.linspace(path.times[0], path.times[-1], count)
    found = _follow(scenery, start, time, rtol)
    at = np.array([scenery.pose(t) for t in time])
    return Push(slider, pusher, time, found[0], at, np.array(found[1]), found[2])


def _follow(scenery: Scenery, start: np.ndarray, time: np.ndarray, rtol: float) -> tuple[np.ndarray, list[str], Any]:
    """Return poses, modes and places at given times, phase after phase."""
    from scipy.integrate import solve_ivp

    poses, modes, places = np.tile(start, (len(time), 1)), [FREE] * len(time), np.full((len(time), 2), np.nan)
    slider, mu = scenery.slider, scenery.pusher.mu
    if scenery.gap(time[0], start) < -1e-6 * slider.size:
        raise InvalidValueError("path", "begin outside the slider", scenery.pose(time[0]).tolist())
    now, q, held = float(time[0]), start.copy(), ""
    contact: Touch | None = None
    restless = 0
    for _ in range(MOST_PHASES):
        if contact is None:
            touched = touch_after(scenery, now, q)
            until = time[-1] if touched is None else touched[0]
            poses[time > now] = q
            if touched is None:
                return poses, modes, places
            now, contact, held = until, touched[1], ""
        end = scenery.piece_end(now)
        place, velocity = place_of(scenery, contact, now, q, forward=True)
        if velocity[:2] @ place.normal <= 0.0:
            contact = None
            now = np.nextafter(now, np.inf) if now < time[-1] else now
            if now >= time[-1]:
                return poses, modes, places
            continue
        first = motion_at(slider.surface, place, mu, velocity)
        mode = first.mode if first.mode != held else _neighbour(slider, place, mu, velocity, held)
        held = ""
        if first.leans:
            contact = flush_after(scenery, contact, now, q, first.leans)
            continue
        mode = "" if restless >= RESTLESS and not place.half_width else mode
        phase = _Phase(scenery, contact, mode)
        span, atol = (now, end), rtol * np.array([slider.size, slider.size, 1.0])
        run = solve_ivp(
            phase.rate, span, q, rtol=rtol, atol=atol, events=phase.events, dense_output=True, first_step=end - now
        )
        here = (time > now) & (time <= run.t[-1]) | (time == now)
        if here.any():
            poses[here] = run.sol(time[here]).T
            for k in np.flatnonzero(here):
                place, velocity = place_of(scenery, contact, time[k], poses[k])
                modes[k] = mode if mode and mu > 0.0 else motion_at(slider.surface, place, mu, velocity).mode
                places[k] = place.at
        restless = restless + 1 if run.t[-1] - now < STILL * (time[-1] - time[0]) else 0
        q, now = run.y[:, -1].copy(), float(run.t[-1])
        poses[time > now] = q
        if run.status == 0:
            if now >= time[-1]:
                return poses, modes, places
            continue
        what = phase.names[next(i for i, each in enumerate(run.t_events) if len(each))]
        if what == "mode":
            held = mode
        elif what == "closes":
            contact = scenery.flush(contact, now, q)
        else:
            contact = None
    raise InvalidValueError("path", f"change the contact of the pusher at most {MOST_PHASES} times", f"t = {now:g} s")


def _neighbour(slider: Slider, place: TouchPoint, mu: float, velocity: np.ndarray, held: str) -> str:
    """Return the mode after one that has come to its end, where rounding still takes it for the old one."""
    if held != STICK:
        return STICK
    left, right = (motion_at(slider.surface, place, mu, velocity, mode).slack for mode in (LEFT, RIGHT))
    return LEFT if left > right else RIGHT


class _Phase:
    """A contact whose mode is held, and what ends it."""

    def __init__(self, scenery: Scenery, contact: Touch, mode: str) -> None:
        self._scenery, self._contact, self._mode = scenery, contact, mode
        kinds = {"mode": self._slack, "leaves": self._approach, "ends": self._range, "closes": self._clear}
        if not scenery.closes(contact):
            del kinds["closes"]
        if not mode:
            del kinds["mode"]
        self.names, self.events = list(kinds), []
        for function in kinds.values():
            event = lambda t, q, f=function: f(t, q)  # noqa: E731
            event.terminal, event.direction = True, -1
            self.events.append(event)
        self._last: Any = None

    def _motion(self, t: float, q: np.ndarray) -> tuple[Any, Any, np.ndarray]:
        key = (t, *q)
        if self._last is None or self._last[0] != key:
            place, velocity = place_of(self._scenery, self._contact, t, q)
            found = motion_at(self._scenery.slider.surface, place, self._scenery.pusher.mu, velocity, self._mode)
            self._last = key, (found, place, velocity)
        return self._last[1]

    def rate(self, t: float, q: np.ndarray) -> np.ndarray:
        """Return the velocity of the slider's frame in the world `[3]`."""
        vx, vy, omega = self._motion(t, q)[0].twist
        c, s = np.cos(q[2]), np.sin(q[2])
        return np.array([c * vx - s * vy, s * vx + c * vy, omega])

    def _slack(self, t: float, q: np.ndarray) -> float:
        return self._motion(t, q)[0].slack

    def _approach(self, t: float, q: np.ndarray) -> float:
        _, place, velocity = self._motion(t, q)
        return velocity[:2] @ place.normal

    def _range(self, t: float, q: np.ndarray) -> float:
        return self._scenery.within(self._contact, t, q)

    def _clear(self, t: float, q: np.ndarray) -> float:
        return self._scenery.clear(self._contact, t, q)
