"""Grip forces that hold a part, or let it slip on purpose, from what an observer says of its friction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.online.gripper import DT, GRAVITY, Measurement
from planarfriction.online.observer import FrictionObserver

LOAD_TIME = 0.3
"""Time in which the largest load of late fades from the grip [s]."""

SETTLED = 0.03
"""Time after which the load of a part is known [s]."""

RELEASE = 1.0
"""Rate at which a grip falls until the part slips [1/s]."""

STICKS = 0.05
"""Time without slip after which a part has stuck [s]."""

STUCK = 1.0
"""Rate at which it falls if a part that shall slip has stuck [1/s]."""

AIM = 0.3
"""Share of the tolerance by which a part is caught before the goal: late samples let it go on."""

REGRIP = 5.0
"""Rate at which the grip of a hinge that was released rises again while the part moves [1/s]."""

HANGS = 0.12
"""Lever of the load of a part that hangs, over the contact radius [-]."""

CAUGHT = 1.5
"""Grip after a slip on purpose, over the one that balances the load [-]."""


def trapezoid(time: Any, size: Any, duration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return place, speed and acceleration at times [s] of a way of a `size` whose ramps take a quarter each."""
    ramp = 0.25 * duration
    top = np.asarray(size) / (duration - ramp)
    t = np.clip(np.nan_to_num(time), 0.0, duration)
    left = duration - t
    rising, falling = t < ramp, left < ramp
    place = np.where(rising, 0.5 * top / ramp * t * t, top * (t - 0.5 * ramp))
    place = np.where(falling, size - 0.5 * top / ramp * left * left, place)
    speed = top * np.minimum(np.minimum(t, left) / ramp, 1.0)
    return place, speed, top / ramp * (1.0 * (rising & (t > 0.0)) - 1.0 * (falling & (left > 0.0)))


class GripController:
    """Base of the controllers: an observer, and the load of the part that it sees.

    Arrays have the shape of the observer's batch.
    """

    def __init__(self, observer: FrictionObserver, *, most: float = 60.0) -> None:
        self.observer = validation.instance("observer", observer, FrictionObserver, "a FrictionObserver")
        self.most = validation.positive("most", most)
        self.estimate: Any = None
        shape = observer.state.shape[:-1]
        self.load, self.grip = np.zeros(shape), np.full(shape, self.most)
        self.slid, self.velocity = np.zeros((*shape, 3)), np.zeros((*shape, 3))
        self._time, self._ticked, self._age = np.full(shape, -math.inf), np.full(shape, math.nan), np.zeros(shape)
        self._start = np.full(shape, math.nan)

    def update(self, measurement: Measurement) -> np.ndarray:
        """Take a sample of the sensors; return the grip force `[...]` [N].

        Raises InvalidValueError for a measurement that does not fit the observer.
        """
        self.estimate = estimate = self.observer.update(measurement)
        self.wrench = np.asarray(measurement.wrench, float) - self.observer.bias
        time, force = np.asarray(measurement.time, float), np.asarray(measurement.normal_force, float)
        dt = np.where(np.isfinite(self._time), np.nan_to_num(np.clip(time - self._time, 0.0, 0.1)), 0.0)
        self._time = np.fmax(self._time, time)
        needed = np.nan_to_num(estimate.gauge * np.maximum(force, 0.0), posinf=0.0)
        self.load, self._age = np.maximum(needed, self.load * np.exp(-dt / LOAD_TIME)), self._age + dt
        if measurement.slip_velocity is not None:
            velocity = np.broadcast_to(np.asarray(measurement.slip_velocity, float), self.slid.shape)
            came = np.isfinite(velocity).all(axis=-1) & (dt > 0.0)
            span = np.where(np.isfinite(self._ticked), time - self._ticked, 0.0)
            self.slid = self.slid + np.where(came[..., None], np.nan_to_num(velocity) * span[..., None], 0.0)
            self.velocity = np.where(came[..., None], velocity, self.velocity)
            self._ticked = np.where(came, time, self._ticked)
        asked = np.clip(self._grip(needed, dt), 0.0, self.most)
        held = np.fmin(np.fmax(force, 0.0), self.most)  # as it is, until the filters have settled
        self.grip = np.where(self._age < SETTLED, held, asked)
        return self.grip

    def _begin(self, value: np.ndarray) -> np.ndarray:
        """Return the grip `[...]` from which it first falls: the `value` once the filters have settled."""
        self._start = np.where(
            np.isnan(self._start) & (self._age >= SETTLED), np.minimum(value, self.most), self._start
        )
        return np.fmin(self._start, self.most)

    def _grip(self, needed: np.ndarray, dt: np.ndarray) -> np.ndarray:
        """Return the grip for the grip that holds the present load at mu = 1, `needed` [N]."""
        raise NotImplementedError


class Hold(GripController):
    """Least grip with a stated probability of slip, `reserve * load/mu_low + gain |v|`.

    `load` is the largest `holding_load` at mu = 1 of the last 0.3 s, `mu_low` the quantile of mu_c at `probability`,
    `reserve` what taps may add. With `explore`, the grip first falls until the part slips a little, so that friction is
    known: until it is determined, or the slip is as long as `explore` [m].

    Raises InvalidValueError for values out of range.
    """

    def __init__(
        self,
        observer: FrictionObserver,
        *,
        probability: float = 1e-3,
        reserve: float = 1.2,
        gain: float = 100.0,
        explore: float = 3e-4,
        most: float = 60.0,
    ) -> None:
        from scipy.special import ndtri

        super().__init__(observer, most=most)
        if not 0.0 < validation.number("probability", probability) < 0.5:
            raise InvalidValueError("probability", "be between 0 and 0.5", probability)
        self._z = -float(ndtri(probability))
        self.reserve = validation.positive("reserve", reserve)
        self.gain, self.explore = validation.non_negative("gain", gain), validation.non_negative("explore", explore)
        self._found = np.full(self.grip.shape, self.explore == 0.0)

    def _grip(self, needed: np.ndarray, dt: np.ndarray) -> np.ndarray:
        e = self.estimate
        slips = e.slip > 0.5
        far = self._path() >= self.explore
        self._found = self._found | (slips & (self._age >= SETTLED) & (e.determined[..., 0] | far))
        low = e.mu_c * np.exp(-self._z * np.sqrt(e.covariance[..., 0, 0]))
        speed = np.where(slips, np.hypot(self.velocity[..., 0], self.velocity[..., 1]), 0.0)
        spin = np.where(slips, e.radius * np.abs(self.velocity[..., 2]), 0.0)
        held = self.reserve * self.load / low + self.gain * (speed + spin)
        falls = np.where(slips, self.grip, self.grip * np.exp(-RELEASE * dt))
        start = self._begin(held)
        held = np.where(slips, np.maximum(held, start), held)  # as if nothing were known, until it sticks
        first = np.minimum(start, falls)
        return np.where(self._found, held, first)

    def _path(self) -> np.ndarray:
        slid = np.abs(self.slid)
        return np.hypot(slid[..., 0], slid[..., 1]) + self.estimate.radius * slid[..., 2]


class Slip(GripController):
    """Slip on purpose along a trapezoid of speed, and hold: base of `SlideBy` and `TurnBy`.

    While the part slips, a grip f accelerates it by `A (1 - f/f_b)`, A that of its load alone and `f_b` the grip that
    balances it. So `f = f_b (1 - a/A)`, `a = a_d + k_v (v_d - v) + k_x (x_d - x)`, with the place and the speed of the
    part when the grip acts. `f_b` is that of the first slip, then follows `f_b' = f_b k_i (v - v_c)`, `v_c = v_d + 2
    (x_d - x)`. A part that has stuck is released slowly; at the goal, or where it sticks within `tolerance` of it, it
    is caught: to release it there would move it by more.
    """

    axis: int
    """Component of the slip."""
    gains = (8.0, 16.0)
    """`k_v` [1/s] and `k_x` [1/s^2]."""
    tolerance: float
    """Distance from the goal that is good enough [m or rad]."""

    def __init__(
        self,
        observer: FrictionObserver,
        goal: Any,
        *,
        duration: float = 2.0,
        acceleration: float,
        adapt: float,
        delay: float = 0.02,
        most: float = 60.0,
    ) -> None:
        super().__init__(observer, most=most)
        self.goal = validation.filled("goal", goal, self.grip.shape)
        if not self.goal.all():
            raise InvalidValueError("goal", "be finite and not zero", goal)
        self.duration = validation.positive("duration", duration)
        self.acceleration = validation.positive("acceleration", acceleration)
        self.adapt, self.delay = validation.non_negative("adapt", adapt), validation.non_negative("delay", delay)
        shape = self.grip.shape
        self.balance, self._began, self._since = np.full(shape, math.nan), np.full(shape, math.nan), np.zeros(shape)
        self.caught = np.zeros(shape, bool)

    def _grip(self, needed: np.ndarray, dt: np.ndarray) -> np.ndarray:
        e, sign = self.estimate, np.sign(self.goal)
        slips = e.slip > 0.5
        v = sign * self.velocity[..., self.axis] * slips
        x = sign * self.slid[..., self.axis]
        force = needed / np.maximum(e.gauge, 1e-9)
        begins = slips & np.isnan(self._began) & (self._age >= SETTLED)
        self._began = np.where(begins, self._time, self._began)
        self.balance = np.where(begins, 1.05 * force, self.balance)
        now = self._time + self.delay
        ahead = self.balance
        place, speed, push = trapezoid(now - self._began, np.abs(self.goal), self.duration)
        there = x + v * self.delay
        left = np.abs(self.goal) - there
        self.caught = self.caught | (0.5 * v * v / self._braking() >= left - AIM * self.tolerance)
        wish = speed + 2.0 * (place - there)
        self.balance = self.balance * np.exp(np.where(slips, self.adapt * (v - wish) * dt, 0.0))
        self._since = np.where(slips, 0.0, self._since + dt)
        stuck = self._since > STICKS  # then the wrench is that of the load, and says which grip balances it
        self.caught = self.caught | (stuck & (left < self.tolerance))
        self.balance = np.where(stuck & ~np.isnan(self.balance), 1.1 * needed / e.mu_c, self.balance)
        a = push + self.gains[0] * (speed - v) + self.gains[1] * (place - there)
        lead = np.clip(a / self.acceleration, -0.6, 0.25)
        running = ahead * (1.0 - lead) * np.exp(-STUCK * np.maximum(self._since - STICKS, 0.0))
        start = self._begin(2.5 * self.load / e.mu_c)
        first = np.minimum(start, self.grip) * np.exp(-RELEASE * dt)
        moving = np.where(np.isnan(self._began), first, running)
        return np.where(self.caught, CAUGHT * np.fmax(self.balance, self.load / e.mu_c), moving)

    def _braking(self) -> float:
        """Return the deceleration of a part that is caught."""
        return 0.5 * self.acceleration


class SlideBy(Slip):
    """Let a part slide down by `goal` [m] under its weight within `duration` [s], and hold it (see `Slip`)."""

    axis, tolerance = 1, 0.9e-3

    def __init__(self, observer: FrictionObserver, goal: Any, *, duration: float = 2.0, **options: Any) -> None:
        options = {"acceleration": GRAVITY, "adapt": 20.0} | options
        super().__init__(observer, goal, duration=duration, **options)


class TurnBy(Slip):
    """Let a part turn by `goal` [rad] under its weight within `duration` [s], and hold it (see `Slip`).

    `acceleration` [rad/s^2] is that of the part without friction.
    """

    axis, tolerance = 2, math.radians(1.6)

    def __init__(self, observer: FrictionObserver, goal: Any, *, duration: float = 2.0, **options: Any) -> None:
        options = {"acceleration": 100.0, "adapt": 1.0} | options
        super().__init__(observer, goal, duration=duration, **options)


class Hinge(GripController):
    """Let a part pivot about the grip under its weight, with the least grip that carries its force alone.

    The grip first falls until the part slips. Then `f = reserve |f_t|/mu_c + gain v`: the torque that friction still
    has slows the pivot, and the part slides a little as it turns, more the smaller the reserve. A part that has stuck
    before it hangs (the lever of its load is above an eighth of the contact radius) is released slowly.

    Raises InvalidValueError for values out of range.
    """

    def __init__(
        self, observer: FrictionObserver, *, reserve: float = 1.1, gain: float = 50.0, most: float = 60.0
    ) -> None:
        super().__init__(observer, most=most)
        self.reserve, self.gain = validation.positive("reserve", reserve), validation.non_negative("gain", gain)
        shape = self.grip.shape
        self._force, self._torque, self._since, self._eased = *np.zeros((3, *shape)), np.ones(shape)
        self._found = np.zeros(shape, bool)

    def _grip(self, needed: np.ndarray, dt: np.ndarray) -> np.ndarray:
        e, force = self.estimate, np.hypot(self.wrench[..., 0], self.wrench[..., 1])
        share = DT / 0.05 * (np.isfinite(force) & np.isfinite(self.wrench[..., 2]))
        self._force = self._force + share * np.nan_to_num(force - self._force)
        self._torque = self._torque + share * np.nan_to_num(self.wrench[..., 2] - self._torque)
        slips = e.slip > 0.5
        self._found = self._found | (slips & (self._age >= SETTLED))
        moves = slips & self.velocity.any(axis=-1)  # near the surface a slip is probable, before any is seen
        self._since = np.where(moves, 0.0, self._since + dt)
        eases = (self._since > STICKS) & (np.abs(self._torque) > HANGS * e.radius * self._force)
        rate = np.where(moves, REGRIP, -RELEASE * eases)
        self._eased = np.minimum(self._eased * np.exp(rate * dt), 1.0)
        speed = np.hypot(self.velocity[..., 0], self.velocity[..., 1]) * slips
        start = self._begin(2.5 * self.load / e.mu_c)
        first = np.minimum(start, self.grip * np.exp(-RELEASE * dt))
        return np.where(self._found, self.reserve * self._eased * self._force / e.mu_c + self.gain * speed, first)
