"""Friction of a joint from measured torques: the terms, the numbers with their intervals, and doubts about the fit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.balance import (
    TERMS,
    Refined,
    TermGrid,
    errors,
    predict,
    refine,
    search,
)
from planarfriction.joints.goal_fit import lags
from planarfriction.joints.log import JointLog, Plant
from planarfriction.joints.problem import (
    PARAMETERS,
    JointFit,
    Series,
    Values,
    not_shown,
)
from planarfriction.joints.smoothing import (
    DELAYS,
    Rows,
    Scales,
    evenly,
    kernel_width,
    rows_of,
    scales,
    smoothed_noise,
    white_noise,
)

LEAST_ROWS = 10
"""Number of rows that a log must have to be fitted."""

SURE = 3.0
"""Standard errors from zero from which on a term is seen."""

MATTERS = 0.03
"""Share of the level from which on a term matters."""

FLAT = 0.02
"""Share of the best score within which a smaller set of terms is as good."""

SURE_FACTOR = 0.7
"""Largest standard error of the logarithm of a number that is seen."""

EXACT = 0.0025
"""Relative error of every number: the model itself is not better."""

REFINED = 4
"""Number of sets of terms, the best ones by their sums, that are refined."""

RISES = (0.3, 0.8)
"""Rises of the level towards rest, over the Coulomb level, from which a fall of friction is searched."""

FAR = 10.0
"""Factor on the best score by the sums above which a set of terms is not refined."""

REVERSALS = 4
"""Number of reversals from which on bristles can be seen."""

LATEST = 7e-4
"""Delay of the torque [s] from which on it may be a low pass instead."""

WIDER = 1.6
"""Factor on the width of the kernel with which estimates are computed again."""

MOST_RISE = 2.0
"""Rise of the level towards rest, over the Coulomb level, above which `BANDS` bands of speed must show it."""

BANDS = 3
"""Number of equal bands of speed below the Stribeck speed, each with `LEAST_ROWS` rows, that show a large rise."""

GRID = 9
"""Number of Stribeck speeds, and of bends, that are searched."""


class Data(NamedTuple):
    """Logs of torques, smoothed by one kernel, with what they can show."""

    limits: Scales
    """Width of the kernel, and least speed."""
    rows: tuple[Rows, ...]
    """Rows of each log that moves."""
    speed: np.ndarray
    """Speed at all fitted rows [rad/s]."""
    torque: np.ndarray
    """Measured torque at all fitted rows [N m]."""
    fastest: float
    """Speed that 1 % of the rows exceed [rad/s]."""
    slowest_fall: float
    """Stribeck speed below which the logs show none [rad/s]."""
    least_bend: float
    """Deflection of bristles below which the logs show none [rad]."""
    grid: TermGrid
    """Stribeck speeds and bends that the logs can show."""
    allowed: list[str]
    """Terms that the logs can show."""


def prepare(logs: Sequence[JointLog]) -> Data:
    """Smooth logs by one kernel; those that stand are left out.

    Raises InvalidValueError for logs that all stand, or move in one direction only.
    """
    evens = [evenly(log) for log in logs]
    moving = [
        each
        for each in evens
        if np.ptp(each.angle) >= max(30.0 * each.resolution, 20.0 * each.noise)
    ]
    if not moving:
        raise InvalidValueError(
            f"q of {logs[0].name}",
            "move: friction of a joint that stands is only known to be at least its torque",
            f"a swing of {np.ptp(logs[0].q):.2g} rad",
        )
    step = max(1e-6, *(each.resolution for each in moving))
    bits = np.log2(np.array([360.0, 2.0 * np.pi]) / step)
    degrees, radians = np.abs(bits - np.round(bits))
    if degrees < 2e-3 < radians and bits[0] > 6.0:
        raise InvalidValueError(
            "q of the logs",
            "be in rad",
            "steps of 360 over a power of two: it is in degrees",
        )
    limits = scales(moving, kernel_width(moving))
    rows = tuple(
        each
        for each in (rows_of(even, limits) for even in moving)
        if len(each.fitted) >= LEAST_ROWS
    )
    if not rows:
        raise InvalidValueError(
            "logs", "move for longer than a second", "too few samples in motion"
        )
    speed = np.concatenate([each.speed[each.fitted] for each in rows])
    forth = np.mean(speed > 2.0 * limits.slow)
    back = np.mean(speed < -2.0 * limits.slow)
    if min(forth, back) < MATTERS:
        raise InvalidValueError(
            "logs",
            "move in both directions: Coulomb friction and an offset of the torque look alike in one",
            f"{forth:.0%} of the samples forwards, {back:.0%} backwards",
        )
    torque = np.concatenate([each.measured(0.0) for each in rows])
    slow = np.sort(np.abs(speed))
    fastest = np.percentile(slow, 99)
    turning = np.concatenate(
        [np.abs(each.acceleration[each.reversals]) for each in rows]
    )
    # change of the speed within half a width of the kernel at a gentle reversal
    crossed = 0.5 * limits.width * np.percentile(turning, 20) if len(turning) else 0.0
    slowest_fall = max(1.5 * limits.slow, slow[min(40, len(slow) - 1)], crossed)
    resolution = max(each.even.resolution for each in rows)
    least_bend = max(resolution, crossed * limits.width if len(turning) else 1.0, 1e-6)
    swing = np.ptp(np.concatenate([each.angle for each in rows]))
    bends = np.geomspace(least_bend, max(0.1 * swing, 4.0 * least_bend), GRID)
    falls = 0.5 * fastest > 1.3 * slowest_fall
    speeds = (
        np.geomspace(slowest_fall, 0.5 * fastest, GRID)
        if falls
        else np.array([0.5 * fastest])
    )
    blind = {"stribeck": not falls, "bristles": len(turning) < REVERSALS}
    allowed = [term for term in TERMS if not blind.get(term)]
    grid = TermGrid(speeds, bends)
    return Data(
        limits, rows, speed, torque, fastest, slowest_fall, least_bend, grid, allowed
    )


def choose(
    data: Data, told: Sequence[str], auto: bool, progress: Callable[[str], None]
) -> tuple[list[Refined], Refined]:
    """Refine sets of terms; return the smallest of the best first, then the others; and a first fit without terms.

    A set is kept if its score, over blocks, lies within one standard error or `FLAT` of the best. Terms that a set does
    not show are left out of it. Without `auto`, only the set that was told is refined.
    """
    progress(_words(()))
    start = {"inertia": 0.0, "mu_c": data.torque.std(), "sigma_2": 0.0}
    baseline = refine(data.rows, start, ())
    progress(f"first estimate, {_words(())}: {_level(baseline.values)}; all sets")
    allowed = data.allowed if auto else told
    candidates = search(data.rows, data.grid, told, allowed)
    values = {each.terms: each.values for each in candidates}
    first = candidates[0].terms
    progress(f"best set by sums, {_words(first)}: {_level(values[first])}")
    rough: dict[str, float] = {}
    if "bristles" in first and "stribeck" in allowed:
        terms = tuple(each for each in first if each != "stribeck" or each in told)
        rough = refine(data.rows, values[terms], terms).values
    best = refine(data.rows, _start(data, values[first], rough), first)
    progress(f"second estimate, {_words(first)}: {_level(best.values)}")
    fits = {first: best}

    def refined(terms: tuple[str, ...]) -> Refined:
        if terms not in fits:
            progress(_words(terms))
            start = _start(data, values[terms], rough)
            start |= {
                name: value for name, value in best.values.items() if name in start
            }
            fits[terms] = refine(data.rows, start, terms, best.scatter)
        return fits[terms]

    most = FAR * candidates[0].score
    near = [
        each.terms
        for each in candidates
        if len({*each.terms} ^ {*first}) == 1 and each.score < most
    ]
    good: dict[tuple[str, ...], Refined] = {}
    for terms in dict.fromkeys(
        [*(each.terms for each in candidates[:REFINED]), *near, tuple(told)]
    ):
        fit = refined(terms)
        while auto and (shown := seen(data, fit, told)) != fit.terms:
            fit = refined(shown)
        good[fit.terms] = fit
    ranked = sorted(good.values(), key=lambda each: each.score)
    close = []
    for each in ranked:
        excess = each.scores - ranked[0].scores
        error = excess.std(ddof=1) * np.sqrt(len(excess)) if len(excess) > 1 else 0.0
        if excess.sum() <= max(error, FLAT * ranked[0].score):
            close.append(each)
    smallest = min(close, key=lambda each: (len(each.terms), each.score))
    return [smallest, *(each for each in ranked if each is not smallest)], baseline


def _start(data: Data, start: dict[str, float], rough: Values) -> dict[str, float]:
    """Return the numbers from which a set of terms is refined.

    Bristles lag by the level itself, which the sums do not know: with them, a fall of friction is searched once more
    by the model, around the `rough` numbers of a fit without it.
    """
    if not ("rise" in start and rough):
        return start
    # a delay that ended at its bound without a fall of friction would stay there
    known = start | {
        name: value
        for name, value in rough.items()
        if name in start and name != "delay"
    }
    falls = [
        known | {"rise": rise * known["mu_c"], "v_s": speed}
        for rise in RISES
        for speed in data.grid.v_s.tolist()
    ]
    return min(
        [start, *falls], key=lambda values: np.abs(errors(data.rows, values)).mean()
    )


def _level(values: Values) -> str:
    return ", ".join(f"{name} = {values[name]:.3g}" for name in ("mu_c", "sigma_2"))


def _words(terms: Sequence[str]) -> str:
    return " and ".join(terms) or "Coulomb and viscous friction"


def seen(data: Data, fit: Refined, told: Sequence[str]) -> tuple[str, ...]:
    """Return the terms that a fit shows: of their sign, within the range of the logs, clear of zero, and not small."""
    return tuple(
        term for term in fit.terms if term in told or not doubt(data, fit, term)
    )


def doubt(data: Data, fit: Refined, term: str) -> str:
    """Return the reason for which the logs do not show a term, or an empty text."""
    values = fit.values
    spread = fit.spread
    level = values["mu_c"] + max(values.get("rise", 0.0), 0.0)
    factor = next((name for name in TERMS[term] if PARAMETERS[name].logarithmic), "")
    if (
        term == "bristles"
        and (bend := level / values["sigma_0"]) <= 0.5 * data.least_bend
    ):
        return f"its bend of {bend:.2g} rad is below the {data.least_bend:.2g} rad that these logs show"
    if (
        term == "stribeck"
        and not 0.5 * data.slowest_fall < values["v_s"] < 1.5 * data.fastest
    ):
        reach = f"{data.slowest_fall:.2g} to {data.fastest:.2g} rad/s"
        return f"its speed of {values['v_s']:.2g} rad/s lies outside of those that these logs show, {reach}"
    if factor and spread[factor] >= SURE_FACTOR:
        return f"{factor} is only known within a factor of {np.exp(min(2.0 * spread[factor], 700.0)):.2g}"
    if term == "stribeck" and values["rise"] > MOST_RISE * values["mu_c"]:
        slow = np.linspace(
            min(data.limits.slow, values["v_s"]), values["v_s"], BANDS + 1
        )
        if np.histogram(np.abs(data.speed), slow)[0].min() < LEAST_ROWS:
            ratio = 1.0 + values["rise"] / values["mu_c"]
            return f"mu_s would be {ratio:.2g} mu_c, and too few samples are slow enough to show it"
    if term == "load" and values["load"] >= PARAMETERS["load"].high - 0.01:
        return "the level would grow with all of the torque"
    if term == "bristles":
        return ""
    # the level of an asymmetry may as well be an offset of the torque
    names = [name for name in TERMS[term] if name not in (factor, "asymmetry")]
    size = np.hypot.reduce([values[name] for name in names])
    least = MATTERS * {"load": 1.0, "asymmetry": level / data.fastest}.get(term, level)
    clear = (
        max(abs(values[name]) / max(spread[name], 1e-300) for name in names) > SURE
        and size > least
    )
    against = term in ("stribeck", "load") and values[names[0]] < 0.0
    return (
        ""
        if clear and not against
        else f"{names[0]} = {size:.2g} is not clear of zero, or does not matter"
    )


def finish(
    data: Data,
    ranked: list[Refined],
    told: Sequence[str],
    auto: bool,
    progress: Callable[[str], None],
) -> Refined:
    """Return the final fit: a low pass of the torque if it explains more than a delay, and spreads of all causes.

    A term that these wider spreads hide is left out, unless the fit without it is much worse.
    """
    fits = {each.terms: each for each in ranked}
    fit = ranked[0]
    while True:
        progress(f"{_words(fit.terms)}: intervals")
        fit = _widened(data, _lagging(data, fit))
        terms = seen(data, fit, told) if auto else fit.terms
        if terms == fit.terms:
            return fit
        if terms not in fits:
            fits[terms] = refine(data.rows, fit.values, terms, ranked[0].scatter)
        if fits[terms].score > 1.2 * fits.get(fit.terms, fit).score:
            return fit
        fit = fits[terms]


def _lagging(data: Data, fit: Refined) -> Refined:
    """Refine a fit once more, and with a low pass in place of its delay where that explains more."""
    fit = refine(data.rows, fit.values, fit.terms)
    delay = fit.values["delay"]
    if delay <= max(LATEST, SURE * fit.spread["delay"]):
        return fit
    low = refine(
        data.rows, fit.values | {"low_pass": delay}, fit.terms, None, "low_pass"
    )
    # behind a low pass too, which removes as much of the angle's noise
    squares = 0.0
    for rows, torque in zip(data.rows, predict(data.rows, fit.values), strict=True):
        late = np.interp(rows.time + delay, rows.even.time, rows.torque)
        squares += np.square(rows.low_passed(torque - late, delay)[rows.fitted]).sum()
    return low if np.square(low.error).sum() < squares else fit


def _widened(data: Data, fit: Refined) -> Refined:
    """Add to the spreads what another kernel and even weights move: a term that reversals alone support moves then."""
    late = "low_pass" if "low_pass" in fit.values else "delay"
    even = np.full(2, fit.scatter.max())
    limits = data.limits._replace(width=WIDER * data.limits.width)
    wider = [rows_of(each.even, limits) for each in data.rows]
    others = [
        refine(data.rows, fit.values, fit.terms, even, late).values,
        refine(wider, fit.values, fit.terms, None, late).values,
    ]
    spread = {}
    for name, error in fit.spread.items():
        value = fit.values[name]
        if PARAMETERS[name].logarithmic:
            moves = [EXACT, *(np.log(each[name] / value) for each in others)]
        else:
            moves = [EXACT * value, *(each[name] - value for each in others)]
        spread[name] = float(np.linalg.norm([error, *moves]))
    return fit._replace(spread=spread)


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
    noise = max(np.sqrt(np.mean(variances)), 1e-12)
    torques = predict(
        data.rows, {name: fit.values[name] for name in ("mu_c", "sigma_2")}
    )
    friction = np.concatenate(
        [torque[each.fitted] for torque, each in zip(torques, data.rows, strict=True)]
    )
    square = np.square(fit.error).mean()
    share = np.sqrt(
        max(square - noise**2, 0.0) / max(np.square(friction).mean(), 1e-24)
    )
    return Rest(np.sqrt(square) / noise, share, fit.scatter[0] / noise)


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
            f"{text}: backlash, heat, place or another load; intervals need not contain the true values",
        )
    # gravity and inertia as they show in the torque, beside those that are known
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
            "torque_offset", False, f"{text} directions, which no log distinguishes"
        )
    used = [each.name for each in found.series]
    if still := [log.name for log in found.logs if log.name not in used]:
        yield Verdict("fit", False, f"{', '.join(still)}: hardly moves, left out")
    for log in found.logs:
        if log.turns:
            yield Verdict(
                "q",
                True,
                f"{log.name}: {log.turns} jumps by a full rotation were removed",
            )
    yield from lags(found.logs)


def fit_torques(
    logs: tuple[JointLog, ...],
    plant: Plant,
    chosen: tuple[str, ...],
    auto: bool,
    progress: Callable[[str], None],
) -> JointFit:
    """Fit the torques of logs with the `chosen` terms, or with those that they ask for.

    Raises InvalidValueError for logs that no model of friction explains.
    """
    data = prepare(logs)
    ranked, baseline = choose(data, chosen, auto, progress)
    fit = finish(data, ranked, chosen, auto, progress)
    rest = rest_of(data, fit)
    values = dict(fit.values)
    spread = dict(fit.spread)
    for name, value in values.items():
        if PARAMETERS[name].logarithmic:
            spread[name] *= value
    # gravity is given by its size and the angle at which it vanishes
    if "gravity" in fit.terms:
        sine, cosine = (values.pop(name) for name in TERMS["gravity"])
        values["gravity"] = float(np.hypot(sine, cosine))
        values["offset"] = float(np.arctan2(-cosine, sine))
        of_both = [spread.pop(name) for name in TERMS["gravity"]]
        spread["gravity"] = float(np.hypot.reduce(of_both))
        spread["offset"] = spread["gravity"] / max(values["gravity"], 1e-300)
    scores = {each.terms: each.score for each in ranked}
    gains = {}
    for term in fit.terms:
        less = tuple(each for each in fit.terms if each != term)
        if less in scores:
            gains[term] = scores[less] / fit.score
    doubts = {term: doubt(data, fit, term) for term in fit.terms}
    unclear = {term: why for term, why in doubts.items() if why and not auto}
    delay = fit.values.get("delay", 0.0)
    torques = (predict(data.rows, each.values) for each in (fit, baseline))
    series = tuple(
        Series(
            each.even.log.name,
            each.time[each.fitted],
            each.measured(delay),
            one[each.fitted],
            other[each.fitted],
        )
        for each, one, other in zip(data.rows, *torques, strict=True)
    )
    errors = [np.abs(each.fitted - each.measured).mean() for each in series]
    plain = [np.abs(each.baseline - each.measured).mean() for each in series]
    names = tuple(each.name for each in series)
    # the inertia less that of a known pendulum; without a mass, the offset is 0 already
    settled = replace(plant, arm_mass=plant.arm_mass or 0.0)
    if plant.inertia is None:
        inertia = max(values["inertia"] - plant.pendulum_inertia, 0.0)
        settled = replace(settled, inertia=inertia)
    if plant.offset is None:
        settled = replace(settled, offset=values.get("offset", 0.0))
    found = JointFit(
        logs, settled, None, fit.terms, values, spread, fit.freedom,
        names, np.array(errors), np.array(plain), series, unclear, (),
    )  # fmt: skip
    refuse(data, fit, rest, found.intervals)
    verdicts = judge(data, found, rest, plant, gains)
    return replace(found, verdicts=(*verdicts, *not_shown(unclear)))
