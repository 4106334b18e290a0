"""Alarms by motion, by incipient and by gross slip: parts between two soft fingertips, pulled while they are held.

The grip is `reserve` times the least that holds the part. An alarm doubles it, through the loop of a gripper. Motion is
the velocity of the part, incipient slip a share of the load on cells near their limit (`tactile.slip_ratio`), as an
ideal tactile sensor would see it, and gross slip both, with nearly all of the load. All come at the rate of a camera,
with a delay.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import planarfriction as pf

RADIUS = 0.008
"""Radius of the contact of a fingertip [m]."""

MU = 0.8
"""Friction coefficient [-]."""

WEIGHT = 0.5 * 9.81 * 0.2
"""Weight of the part that each of the two fingertips carries [N]."""

LEAST = WEIGHT / MU
"""Least grip that holds the part [N]."""

DT = 1e-3
"""Time step [s]."""

EVERY = 8
"""Steps between two looks of the sensor, 125 Hz."""

GAIN = 100.0
"""Gain of the loop of the grip [1/s]."""

RAISED = 2.0
"""Factor of the grip after an alarm [-]."""

SPEED = 2e-3
"""Velocity of the part that counts as motion [m/s]."""

NEAR = 0.97
"""Slip ratio of cells near their limit [-]."""

ALARMS = {"motion": 0.0, "incipient slip": 0.3, "gross slip": 0.9}
"""Alarm -> share of the load on cells near their limit from which it is given [-]."""

LONGEST = 1e-3
"""Distance that a part may slide [m]."""

SETTLED = 0.05
"""Time at which the grip is that of the trial; it begins at twice as much [s]."""

BEGIN = 0.25
"""Time at which parts are pulled [s]."""

END = 0.8
"""End of a trial [s]."""


class Pulls(NamedTuple):
    """Half sines by which parts are pulled down, P of them."""

    most: np.ndarray
    """Largest pull over the weight [-]."""
    duration: np.ndarray
    """[s]"""

    @staticmethod
    def drawn(count: int, seed: int = 0) -> Pulls:
        """Return random pulls: up to the weight of the part, for 30 to 300 ms."""
        rng = np.random.default_rng(seed)
        lengths = 10.0 ** rng.uniform(np.log10(0.03), np.log10(0.3), count)
        return Pulls(rng.uniform(0.2, 1.0, count), lengths)

    def at(self, time: float) -> np.ndarray:
        """Return the pulls at a time [N]."""
        phase = np.clip((time - BEGIN) / self.duration, 0.0, 1.0)
        return WEIGHT * self.most * np.sin(np.pi * phase)


class Outcome(NamedTuple):
    """Outcome of a trial for each part."""

    slid: np.ndarray
    """Distance between the places before the pull and at the end [m]."""
    alarm: np.ndarray
    """Time of the alarm [s]; infinite without one."""


def fingertip() -> pf.ReducedModel:
    """Return a round fingertip under Hertz pressure, thick beside its contact."""

    def pressure(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.maximum(1.0 - (x * x + y * y) / RADIUS**2, 0.0) ** 0.5

    patch = pf.ContactPatch.disc(RADIUS, pressure=pressure)
    law = pf.LuGre(mu_c=MU, sigma_1=0.0, elasto_plastic=0.9)
    return pf.ReducedModel(patch, law, pad=pf.Pad.half_space(0.2e6, 0.49))


def trial(
    model: pf.ReducedModel,
    pulls: Pulls,
    reserve: float,
    alarm: str,
    *,
    delay: float = 0.02,
    raises: bool = True,
) -> Outcome:
    """Hold parts with a `reserve` and pull them; `alarm` is one of `ALARMS`, which `raises` the grip or does not."""
    count = len(pulls.most)
    hand = pf.SlidingBody(WEIGHT / 9.81, 1e-4, model)
    shares = model.reduction.patch.weights()
    state = hand.rest(count)
    twist = np.zeros((count, 3))
    wrench = np.zeros((count, 3))
    height = np.zeros(count)
    before = height
    grip = np.full(count, 2.0 * reserve * LEAST)
    time = np.full(count, np.inf)
    for step in range(round(END / DT)):
        now = step * DT
        first = 2.0 if now < SETTLED else 1.0
        factor = np.where(raises & (now > time + delay), RAISED, first)
        grip = grip + DT * GAIN * (factor * reserve * LEAST - grip)
        wrench[:, 1] = -WEIGHT - pulls.at(now)
        state, twist, _ = hand.step(state, twist, grip, DT, wrench=wrench)
        height = height - DT * twist[:, 1]
        if now < BEGIN:
            before = height
        elif step % EVERY == 0:
            ratio = pf.tactile.slip_ratio(model, state, np.zeros(3), grip)
            seen = (shares * (ratio > NEAR)).sum(axis=1) >= ALARMS[alarm]
            if alarm != "incipient slip":
                seen &= np.abs(twist[:, 1]) > SPEED
            time = np.minimum(time, np.where(seen, now, np.inf))
    return Outcome(height - before, time)


def least_reserve(model: pf.ReducedModel, pulls: Pulls, alarm: str) -> float:
    """Return the least reserve, to 0.05, from which on no part slides farther than `LONGEST`."""
    reserve = 2.5
    while trial(model, pulls, reserve - 0.05, alarm).slid.max() <= LONGEST:
        reserve -= 0.05
    return reserve


def lead(model: pf.ReducedModel, pulls: Pulls, alarm: str, reserve: float) -> float:
    """Return the median time by which an alarm comes before that of gross slip, where that comes [s]."""
    first, last = (
        trial(model, pulls, reserve, each, raises=False).alarm
        for each in (alarm, "gross slip")
    )
    slips = np.isfinite(last)
    return float(np.median(last[slips] - first[slips]))
