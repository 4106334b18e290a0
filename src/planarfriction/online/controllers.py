"""Grip forces that hold a part, or let it slip on purpose, from what an observer says of its friction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.online.loops import grips
from planarfriction.online.observer import (
    GRAVITY,
    Estimate,
    FrictionObserver,
    Measurement,
    estimate_of,
)

_LEAST_MU = 3.0902
"""Standard deviations by which mu_c is assumed to be smaller where it cannot be found: one part in a thousand slips."""


_PERIODS = 5.0
"""Periods of the slip sensor for which it may be silent [-]."""

START = 20.0
"""Grip force that is asked of an empty hand [N]."""


class GripController:
    """Base of the controllers: an observer, and the load of the part that it sees.

    While the hand is empty they ask for the grip `start` [N]; the first grip that is measured then stays until the load
    is known. `most` [N] bounds all grips.

    `state` `[...]`, of the shape of the observer's batch, is all that changes beside the observer's: a copy of both is
    a checkpoint. Its fields are those of `planarfriction.online.loops.grips.STATE`.
    """

    def __init__(
        self,
        observer: FrictionObserver,
        grip: Any,
        *settings: float,
        start: float,
        most: float,
    ) -> None:
        self.observer = validation.instance(
            "observer", observer, FrictionObserver, "a FrictionObserver"
        )
        self.state = np.full(observer.state.shape, grips.FRESH)
        if grip is not grips.hold and not observer.sensors.slip_rate:
            raise InvalidValueError(
                "observer", "have a slip sensor to let parts slip", observer.sensors
            )
        known = observer._filter
        least_mu = math.exp(known.prior[0] - _LEAST_MU * known.prior_spread[0])
        self._grip = grip
        rate = observer.sensors.slip_rate
        silence = _PERIODS / rate if rate else grips.PAUSE
        most = validation.positive("most", most)
        self._settings = (
            known.least_load,
            known.quantum,
            silence,
            most,
            least_mu,
            *settings,
        )
        self.state["grip"] = min(validation.positive("start", start), most)
        self._found: Any = None

    @property
    def estimate(self) -> Estimate:
        """Estimate of the observer after the last sample."""
        return estimate_of(self._found)

    @property
    def blind(self) -> np.ndarray:
        """True where sensors do not say what a part does, so that it is held firmly, bool `[...]`.

        It began to fall and the slip sensor did not say so, or no slip velocity comes, or wrench or load are missing or
        cannot be right: the force is less than half of the weight, or the load does not follow the grip.
        """
        state = self.state
        return (
            (state["blind"] >= grips.LATE)
            | (state["mute"] >= grips.LATE)
            | (state["silent"] > 0.0)
        )

    def update(self, measurement: Measurement) -> np.ndarray:
        """Take a sample of the sensors; return the grip force `[...]` [N].

        Raises InvalidValueError for a measurement that does not fit the observer.
        """
        self._found = self.observer._take(measurement)
        self._grip(self.state.reshape(-1), self._found.reshape(-1), *self._settings)
        return self.state["grip"].copy()


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
        start: float = START,
        most: float = 60.0,
    ) -> None:
        from scipy.special import ndtri

        probability = validation.number("probability", probability)
        if not 0.0 < probability < 0.5:
            raise InvalidValueError("probability", "be between 0 and 0.5", probability)
        explore = validation.non_negative("explore", explore)
        super().__init__(
            observer,
            grips.hold,
            -float(ndtri(probability)),
            validation.positive("reserve", reserve),
            validation.non_negative("gain", gain),
            explore,
            start=start,
            most=most,
        )
        self.state["found"] = explore == 0.0


class Slip(GripController):
    """Slip on purpose along a trapezoid of speed, and hold: base of `SlideBy` and `TurnBy`.

    While the part slips, a grip f accelerates it by `A (1 - f/f_b)`, A that of its load alone and `f_b` the grip that
    balances it. So `f = f_b (1 - a/A)`, `a = a_d + k_v (v_d - v) + k_x (x_d - x)`, with the place and the speed of the
    part when the grip acts. `f_b` is that of the first slip, then follows `f_b' = f_b k_i (v - v_c)`, `v_c = v_d + 2
    (x_d - x)`. A part that has stuck is released slowly. Near the goal it is caught; where it sticks there, or after
    `duration`, short dips of the grip let it slip on until it is within `tolerance`: a part whose static friction is
    larger would move by millimetres before late samples show it. The next dip is deeper if it moved too little.
    """

    axis: int
    """Component of the slip."""
    tolerance: float
    """Distance from the goal that is good enough [m or rad]."""
    acceleration: float
    """Usual acceleration of the part without friction [m/s^2 or rad/s^2]."""
    adapt: float
    """Usual gain k_i of the grip that balances the load [1/m or 1/rad]."""

    def __init__(
        self,
        observer: FrictionObserver,
        goal: Any,
        *,
        duration: float = 2.0,
        acceleration: float | None = None,
        adapt: float | None = None,
        delay: float = 0.02,
        start: float = START,
        most: float = 60.0,
    ) -> None:
        positive = validation.positive
        least = validation.non_negative
        acceleration = self.acceleration if acceleration is None else acceleration
        super().__init__(
            observer,
            grips.slip,
            self.axis,
            self.tolerance,
            positive("duration", duration),
            positive("acceleration", acceleration),
            least("adapt", self.adapt if adapt is None else adapt),
            least("delay", delay),
            start=start,
            most=most,
        )
        self.state["goal"] = validation.filled("goal", goal, self.state.shape)
        if not self.state["goal"].all():
            raise InvalidValueError("goal", "be finite and not zero", goal)


class SlideBy(Slip):
    """Let a part slide down by `goal` [m] under its weight within `duration` [s], and hold it (see `Slip`)."""

    axis = 1
    tolerance = 0.9e-3
    acceleration = GRAVITY
    adapt = 20.0


class TurnBy(Slip):
    """Let a part rotate by `goal` [rad] under its weight within `duration` [s], and hold it (see `Slip`).

    `acceleration` [rad/s^2] is that of the part without friction, 100 by default.
    """

    axis = 2
    tolerance = math.radians(1.6)
    acceleration = 100.0
    adapt = 1.0


class Hinge(GripController):
    """Let a part pivot about the grip under its weight, with the least grip that carries its force alone.

    The grip first falls until the part slips. Then `f = reserve |f_t|/mu_c + gain v`: the torque that friction still
    has slows the pivot, and the part slides a little as it turns, more the smaller the reserve. A part that has stuck
    before it hangs (the lever of its load is above an eighth of the contact radius) is released slowly.

    Raises InvalidValueError for values out of range.
    """

    def __init__(
        self,
        observer: FrictionObserver,
        *,
        reserve: float = 1.1,
        gain: float = 50.0,
        start: float = START,
        most: float = 60.0,
    ) -> None:
        super().__init__(
            observer,
            grips.hinge,
            validation.positive("reserve", reserve),
            validation.non_negative("gain", gain),
            start=start,
            most=most,
        )
