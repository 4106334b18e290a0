"""Doubts about the fit of a joint to measured torques: what refuses it, and what is said of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.balance import Refined, predict
from planarfriction.joints.goal_fit import lags
from planarfriction.joints.log import Plant
from planarfriction.joints.result import JointFit
from planarfriction.joints.smoothing import DELAYS, smoothed_noise, white_noise
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


class Rest(NamedTuple):
    """Errors that a fit leaves."""

    times: float
    """Root mean square of the error over that which the noise of the logs explains."""
    share: float
    """Error that noise does not explain over friction."""
    steady: float
    """Median error far from reversals over the noise."""


def rest_of(data: Data, fit: Refined) -> Rest:
    """Compare the errors of a fit with the noise of torque and angle, seen through the kernel."""
    width = data.limits.width
    variances = [
        smoothed_noise(white_noise(each.even.torque) ** 2 * each.even.dt, width, 0)
        + fit.values["inertia"] ** 2 * smoothed_noise(each.even.power, width, 2)
        for each in data.rows
    ]
    noise = max(float(np.sqrt(np.mean(variances))), 1e-12)
    torques = predict(
        data.rows, {name: fit.values[name] for name in ("mu_c", "sigma_2")}
    )
    friction = np.concatenate(
        [torque[each.fitted] for torque, each in zip(torques, data.rows, strict=True)]
    )
    square = float(np.square(fit.error).mean())
    share = np.sqrt(
        max(square - noise**2, 0.0) / max(np.square(friction).mean(), 1e-24)
    )
    return Rest(np.sqrt(square) / noise, float(share), float(fit.scatter[0]) / noise)


def refuse(
    data: Data,
    fit: Refined,
    rest: Rest,
    intervals: Mapping[str, tuple[float, float] | None],
) -> None:
    """Raise InvalidValueError for logs that the model cannot make sense of, with the remedy."""
    values = fit.values
    explained = (
        1.0
        - np.square(fit.error).sum() / np.square(data.torque - data.torque.mean()).sum()
    )
    speed = np.abs(data.speed)
    power = values["mu_c"] * speed.mean() + values["sigma_2"] * np.square(speed).mean()
    backwards, pulling = (
        (intervals[each] or (0.0, np.inf))[1] < 0.0 for each in ("inertia", "mu_c")
    )
    late = "low_pass" if "low_pass" in values else "delay"
    found = (
        f"inertia {values['inertia']:.3g} kg m^2, mean power of friction {power:.3g} W"
    )
    for wrong, rule, why in (
        (
            explained < FOLLOWS,
            "follow from the motion: check that columns, times and joint belong together",
            f"{max(explained, 0.0):.0%} of its variance explained",
        ),
        (
            backwards and (power < 0.0 or values["mu_c"] < 0.0),
            "point along the acceleration: flip the sign of torque or angle",
            found,
        ),
        (
            power < 0.0 or pulling,
            "overcome friction: check the signs of torque and angle, and that the torque is that of the motor",
            found,
        ),
        (backwards, "accelerate the joint: check its sign, and its times", found),
        (
            intervals[late] is None,
            f"be less than {1e3 * DELAYS[-1]:.0f} ms late: shift its times",
            f"{1e3 * values[late]:.0f} ms or more",
        ),
        (
            rest.share > SPOILED,
            "be explained by a model of friction",
            f"{rest.share:.0%} of friction unexplained, {rest.times:.0f} times the noise",
        ),
    ):
        if wrong:
            raise InvalidValueError("torque of the logs", rule, why)


def judge(
    data: Data, found: JointFit, rest: Rest, plant: Plant, gains: Mapping[str, float]
) -> Iterator[Verdict]:
    """Yield the verdicts on a fit; `gains` are the scores without each term over the score with it."""
    for term in found.terms:
        gain = (
            f" (squared errors without it are {gains[term]:.3g} times as large)"
            if term in gains
            else ""
        )
        yield Verdict(term, True, f"{WORDS[term]}{gain}")
    if "stribeck" not in found.terms:
        text = f"no fall of friction with speed is seen from {data.slowest_fall:.2g} rad/s on; slower ones cannot be"
        yield Verdict("stribeck", True, text)
    if "bristles" not in found.terms:
        text = f"rigid friction; bends below {data.least_bend:.2g} rad cannot be seen"
        yield Verdict("bristles", True, text)
    if rest.share > INCOMPLETE or rest.steady > ABOVE_NOISE:
        text = f"{rest.share:.0%} of friction is not explained, {rest.times:.0f} times the noise"
        yield Verdict(
            "fit",
            False,
            f"{text}: backlash, heat, place or another load; intervals need not hold the truth",
        )
    yield from _on_scale(found, plant)
    late = "low_pass" if "low_pass" in found.values else "delay"
    low, high = found.intervals[late] or (0.0, 0.0)
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
            f"it is {what} {1e3 * abs(found.values[late]):.1f} ms, which was corrected",
        )
    offset = found.intervals.get("torque_offset")
    if offset is not None and not offset[0] <= 0.0 <= offset[1]:
        value = found.values["torque_offset"]
        text = f"an offset of {value:.3g} N m: of the sensor, or friction of different level in both"
        yield Verdict(
            "torque_offset", False, f"{text} directions, which no log tells apart"
        )
    used = [each.name for each in found.series]
    if still := [log.name for log in found.logs if log.name not in used]:
        yield Verdict("fit", False, f"{', '.join(still)}: hardly moves, left out")
    for log in found.logs:
        if log.turns:
            yield Verdict(
                "q", True, f"{log.name}: {log.turns} jumps by a whole turn were removed"
            )
    yield from lags(found.logs)


def _on_scale(found: JointFit, plant: Plant) -> Iterator[Verdict]:
    """Compare gravity and inertia as they show in the torque with those that are known."""
    known: dict[str, float] = {}
    if plant.mass and plant.arm_mass is not None:
        known["gravity"] = plant.moment
    if plant.inertia is not None and plant.arm_mass is not None:
        known["inertia"] = plant.inertia + plant.pendulum_inertia
    told = known.get("gravity", 0.0)
    if told and "gravity" not in found.terms:
        yield Verdict(
            "gravity",
            False,
            f"{told:.3g} N m of gravity were told, and do not show in the torque",
        )
    if "gravity" in found.terms and not plant.mass:
        size = found.values["gravity"]
        hangs = found.values["offset"]
        text = (
            f"{size:.3g} N m of gravity show, hanging at {hangs:.3g} rad; none was told"
        )
        yield Verdict("gravity", False, text)
    for name, wanted in known.items():
        interval = found.intervals.get(name)
        if interval is None or not wanted > 0.0:
            continue
        ratio, low, high = (each / wanted for each in (found.values[name], *interval))
        text = f"torques are {ratio:.3g} ({low:.3g} to {high:.3g}) of what the known {name} takes"
        right = low <= 1.0 <= high
        yield Verdict(
            "torque",
            right,
            text
            if right
            else f"{text}: a wrong torque constant or unit scales all results",
        )
    if not known:
        text = "neither gravity nor inertia is known: a wrong torque constant would scale all results"
        yield Verdict("torque", False, text)
