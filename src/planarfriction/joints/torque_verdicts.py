"""Doubts about the fit of a joint to measured torques: what refuses it, and what is said of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.balance import Refined
from planarfriction.joints.goal_verdicts import lags
from planarfriction.joints.log import GRAVITY, JointLog, Plant
from planarfriction.joints.smoothing import DELAYS, acceleration_noise, torque_noise
from planarfriction.joints.torque_fit import Data

FOLLOWS = 0.3
"""Share of the torque's variance that a fit must explain."""

SPOILED = 0.5
"""Share of friction that is left unexplained from which on no number is to be trusted."""

INCOMPLETE = 0.08
"""Share of friction that is left unexplained from which on intervals need not hold."""

ABOVE_NOISE = 1.25
"""Median error far from reversals over the noise from which on intervals need not hold: backlash shows there."""

LATE = 1e-3
"""Delay of the torque [s] from which on it is named."""

WORDS = {
    "gravity": "gravity, or a spring like it",
    "stribeck": "friction falls with speed from rest on",
    "load": "the level grows with the torque through the gears",
    "bristles": "the joint bends before it slips",
    "asymmetry": "friction differs between the directions",
}
"""Meanings of the terms."""

Interval = tuple[float, float] | None
"""95 % interval, or None at a bound."""


class Rest(NamedTuple):
    """Errors that a fit leaves."""

    error: float
    """Root mean square of the error [N m]."""
    noise: float
    """Share of it that the noise of the logs explains [N m]."""
    friction: float
    """Root mean square of friction [N m]."""
    steady: float
    """Median error far from reversals over the noise."""

    @property
    def share(self) -> float:
        """Error that noise does not explain over friction."""
        return float(
            np.sqrt(max(self.error**2 - self.noise**2, 0.0)) / max(self.friction, 1e-12)
        )


def rest_of(data: Data, fit: Refined) -> Rest:
    """Compare the errors of a fit with the noise of torque and angle, seen through the kernel."""
    width = data.limits.width
    inertia = fit.values["inertia"]
    variances = [
        torque_noise(each, width)
        + inertia**2 * acceleration_noise(each.noise**2 * each.dt, width)
        for each in data.evens
    ]
    friction = np.concatenate(
        [
            rows.smoothed(
                rows.direction * fit.values["mu_c"] + fit.values["sigma_2"] * rows.speed
            )[rows.fitted]
            for rows in data.rows
        ]
    )
    error, noise, level = (
        float(np.sqrt(np.mean(each))) for each in (fit.error**2, variances, friction**2)
    )
    return Rest(error, noise, level, float(fit.scatter[0]) / max(noise, 1e-12))


def refuse(
    data: Data, fit: Refined, rest: Rest, intervals: Mapping[str, Interval]
) -> None:
    """Raise InvalidValueError for logs that the model cannot make sense of, with the remedy."""
    name = "torque of the logs"
    values = fit.values
    explained = (
        1.0
        - np.square(fit.error).sum() / np.square(data.torque - data.torque.mean()).sum()
    )
    if explained < FOLLOWS:
        rule = "follow from the motion: check that columns, times and joint belong together"
        raise InvalidValueError(
            name, rule, f"{max(explained, 0.0):.0%} of its variance explained"
        )
    speed = np.abs(data.speed)
    power = values["mu_c"] * speed.mean() + values["sigma_2"] * np.square(speed).mean()
    highest = {
        each: (intervals[each] or (0.0, np.inf))[1] for each in ("inertia", "mu_c")
    }
    found = (
        f"inertia {values['inertia']:.3g} kg m^2, mean power of friction {power:.3g} W"
    )
    if highest["inertia"] < 0.0 and (power < 0.0 or values["mu_c"] < 0.0):
        raise InvalidValueError(
            name,
            "point along the acceleration: flip the sign of torque or angle",
            found,
        )
    if in_degrees(data):
        raise InvalidValueError(
            "q of the logs",
            "be in rad",
            "steps of 360 over a power of two: it is in degrees",
        )
    if power < 0.0 or highest["mu_c"] < 0.0:
        rule = "overcome friction: check the signs of torque and angle, and that the torque is that of the motor"
        raise InvalidValueError(name, rule, found)
    if highest["inertia"] < 0.0:
        raise InvalidValueError(
            name, "accelerate the joint: check its sign, and its times", found
        )
    late = values.get("delay", values.get("low_pass", 0.0))
    if not DELAYS[0] < late < DELAYS[-1]:
        rule = f"be less than {1e3 * DELAYS[-1]:.0f} ms late: shift its times"
        raise InvalidValueError(name, rule, f"{1e3 * late:.0f} ms or more")
    if rest.share > SPOILED:
        found = f"{rest.share:.0%} of friction unexplained, {rest.error / max(rest.noise, 1e-12):.0f} times the noise"
        raise InvalidValueError(name, "be explained by a model of friction", found)


def in_degrees(data: Data) -> bool:
    """Return True if the encoder has a power of two of steps per turn in degrees, and not in rad."""
    step = max(each.resolution for each in data.evens)
    if step < 1e-6:
        return False
    bits = np.log2(np.array([360.0, 2.0 * np.pi]) / step)
    off = np.abs(bits - np.round(bits))
    return bool(off[0] < 2e-3 < off[1] and 6.0 < bits[0] < 30.0)


def judge(
    data: Data,
    fit: Refined,
    rest: Rest,
    logs: Sequence[JointLog],
    plant: Plant,
    values: Mapping[str, float],
    intervals: Mapping[str, Interval],
    gains: Mapping[str, float],
) -> tuple[Verdict, ...]:
    """Return the verdicts on a fit; `gains` are the scores without each term over the score with it."""
    return (
        *_on_terms(data, fit, gains),
        *_on_rest(rest),
        *_on_scale(fit, plant, values, intervals),
        *_on_torque(fit, values, intervals),
        *_on_logs(data, logs),
        *lags(logs),
    )


def _on_terms(
    data: Data, fit: Refined, gains: Mapping[str, float]
) -> Iterator[Verdict]:
    for term in fit.terms:
        gain = (
            f" (squared errors without it are {gains[term]:.3g} times as large)"
            if term in gains
            else ""
        )
        yield Verdict(term, True, f"{WORDS[term]}{gain}")
    if "stribeck" not in fit.terms:
        text = f"no fall of friction with speed is seen from {data.slowest_fall:.2g} rad/s on; slower ones cannot be"
        yield Verdict("stribeck", True, text)
    if "bristles" not in fit.terms:
        text = f"rigid friction; bends below {data.least_bend:.2g} rad cannot be seen"
        yield Verdict("bristles", True, text)


def _on_rest(rest: Rest) -> Iterator[Verdict]:
    if rest.share > INCOMPLETE or rest.steady > ABOVE_NOISE:
        times = rest.error / max(rest.noise, 1e-12)
        text = f"{rest.share:.0%} of friction is not explained, {times:.0f} times the noise"
        yield Verdict(
            "fit",
            False,
            f"{text}: backlash, heat, place or another load; intervals need not hold the truth",
        )


def _on_scale(
    fit: Refined,
    plant: Plant,
    values: Mapping[str, float],
    intervals: Mapping[str, Interval],
) -> Iterator[Verdict]:
    """Compare gravity and inertia as they show in the torque with those that are known."""
    arm = plant.arm_mass
    known: dict[str, float] = {}
    if plant.mass and arm is not None:
        known["gravity"] = (plant.mass + 0.5 * arm) * GRAVITY * plant.length
    if plant.inertia is not None and arm is not None:
        known["inertia"] = plant.inertia + (plant.mass + arm / 3.0) * plant.length**2
    if "gravity" in known and "gravity" not in fit.terms:
        yield Verdict(
            "gravity",
            False,
            f"{known['gravity']:.3g} N m of gravity were told, and do not show in the torque",
        )
    if "gravity" in fit.terms and not plant.mass:
        text = f"{values['gravity']:.3g} N m of gravity show, hanging at {values['offset']:.3g} rad; none was told"
        yield Verdict("gravity", False, text)
    for name, wanted in known.items():
        interval = intervals.get(name)
        if interval is None or not wanted > 0.0:
            continue
        low, high = (each / wanted for each in interval)
        text = f"torques are {values[name] / wanted:.3g} ({low:.3g} to {high:.3g}) of what the known {name} takes"
        if low <= 1.0 <= high:
            yield Verdict("torque", True, text)
        else:
            yield Verdict(
                "torque",
                False,
                f"{text}: a wrong torque constant or unit scales all results",
            )
    if not known:
        text = "neither gravity nor inertia is known: a wrong torque constant would scale all results"
        yield Verdict("torque", False, text)


def _on_torque(
    fit: Refined, values: Mapping[str, float], intervals: Mapping[str, Interval]
) -> Iterator[Verdict]:
    late = "low_pass" if "low_pass" in values else "delay"
    low, high = intervals[late] or (0.0, 0.0)
    if low > LATE or high < -LATE:
        what = (
            "filtered by a low pass of"
            if late == "low_pass"
            else "late by"
            if low > 0.0
            else "early by"
        )
        yield Verdict(
            "torque",
            False,
            f"it is {what} {1e3 * abs(values[late]):.1f} ms, which was corrected",
        )
    offset = intervals.get("torque_offset")
    if offset is not None and not offset[0] <= 0.0 <= offset[1]:
        text = f"an offset of {values['torque_offset']:.3g} N m: of the sensor, or friction of different level in both"
        yield Verdict(
            "torque_offset", False, f"{text} directions, which no log tells apart"
        )


def _on_logs(data: Data, logs: Sequence[JointLog]) -> Iterator[Verdict]:
    used = [each.log.name for each in data.evens]
    if still := [log.name for log in logs if log.name not in used]:
        yield Verdict("fit", False, f"{', '.join(still)}: hardly moves, left out")
    for log in logs:
        if log.turns:
            yield Verdict(
                "q", True, f"{log.name}: {log.turns} jumps by a whole turn were removed"
            )
