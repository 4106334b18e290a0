"""Friction of a joint from measured torques: the set of terms, its numbers with their intervals, and doubts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.joints import subsets
from planarfriction.joints.balance import (
    FACTORS,
    MOST_LOAD,
    TERMS,
    Refined,
    miss,
    predict,
    refine,
)
from planarfriction.joints.log import JointLog
from planarfriction.joints.smoothing import (
    EvenLog,
    Rows,
    Scales,
    evenly,
    kernel_width,
    rows_of,
    scales,
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
"""Factor on the width of the kernel by which estimates are tried again."""

MOST_RISE = 2.0
"""Rise of the level towards rest, over the Coulomb level, above which `BANDS` bands of speed must show it."""

BANDS = 3
"""Number of equal bands of speed below the Stribeck speed, each with `LEAST_ROWS` rows, that show a large rise."""

GRID = 9
"""Number of Stribeck speeds, and of bends, that are searched."""


@dataclass(frozen=True)
class Data:
    """Logs of torques, smoothed by one kernel, with what they can show."""

    evens: tuple[EvenLog, ...]
    """Logs that move."""
    limits: Scales
    """Width of the kernel, and least speed."""
    rows: tuple[Rows, ...]
    """Rows of each log."""

    @cached_property
    def speed(self) -> np.ndarray:
        """Speed at all fitted rows [rad/s]."""
        return np.concatenate([each.speed[each.fitted] for each in self.rows])

    @cached_property
    def torque(self) -> np.ndarray:
        """Measured torque at all fitted rows [N m]."""
        return np.concatenate([each.measured(0.0) for each in self.rows])

    @cached_property
    def fastest(self) -> float:
        """Speed that 1 % of the rows exceed [rad/s]."""
        return float(np.percentile(np.abs(self.speed), 99))

    @cached_property
    def turning(self) -> np.ndarray:
        """Acceleration at each reversal [rad/s^2]."""
        return np.concatenate(
            [np.abs(each.acceleration[each.reversals]) for each in self.rows]
        )

    @cached_property
    def slowest_fall(self) -> float:
        """Stribeck speed below which the logs show none [rad/s]."""
        slow = np.sort(np.abs(self.speed))
        crossed = (
            0.5 * self.limits.width * np.percentile(self.turning, 20)
            if len(self.turning)
            else 0.0
        )
        return float(max(1.5 * self.limits.slow, slow[min(40, len(slow) - 1)], crossed))

    @cached_property
    def least_bend(self) -> float:
        """Deflection of bristles below which the logs show none [rad]."""
        turned = (
            0.5 * self.limits.width**2 * np.percentile(self.turning, 20)
            if len(self.turning)
            else 1.0
        )
        return float(max(max(each.resolution for each in self.evens), turned, 1e-6))

    @property
    def grid(self) -> subsets.Grid:
        """Stribeck speeds and bends that the logs can show."""
        swing = np.ptp(np.concatenate([each.angle for each in self.rows]))
        highest = 0.5 * self.fastest
        speeds = (
            np.geomspace(self.slowest_fall, highest, GRID)
            if self.shows_fall
            else np.array([highest])
        )
        return subsets.Grid(
            speeds,
            np.geomspace(
                self.least_bend, max(0.1 * swing, 4.0 * self.least_bend), GRID
            ),
        )

    @property
    def shows_fall(self) -> bool:
        """True if the speeds are spread enough to show a fall of friction with speed."""
        return 0.5 * self.fastest > 1.3 * self.slowest_fall

    @property
    def allowed(self) -> list[str]:
        """Terms that the logs can show."""
        blind = {
            "stribeck": not self.shows_fall,
            "bristles": len(self.turning) < REVERSALS,
        }
        return [term for term in TERMS if not blind.get(term)]

    def wider(self) -> tuple[Rows, ...]:
        """Smooth the logs by a wider kernel."""
        limits = self.limits._replace(width=WIDER * self.limits.width)
        return tuple(rows_of(each, limits) for each in self.evens)


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
        rule = "move: friction of a joint that stands is only known to be at least its torque"
        raise InvalidValueError(
            f"q of {logs[0].name}", rule, f"a swing of {np.ptp(logs[0].q):.2g} rad"
        )
    limits = scales(moving, kernel_width(moving))
    kept = [
        (each, rows)
        for each in moving
        if len((rows := rows_of(each, limits)).fitted) >= LEAST_ROWS
    ]
    if not kept:
        raise InvalidValueError(
            "logs", "move for longer than a second", "too few samples in motion"
        )
    data = Data(
        tuple(even for even, _ in kept), limits, tuple(rows for _, rows in kept)
    )
    forth = np.mean(data.speed > 2.0 * limits.slow)
    back = np.mean(data.speed < -2.0 * limits.slow)
    if min(forth, back) < MATTERS:
        rule = "move in both directions: Coulomb friction and an offset of the torque look alike in one"
        raise InvalidValueError(
            "logs", rule, f"{forth:.0%} of the samples forwards, {back:.0%} backwards"
        )
    return data


def choose(
    data: Data, told: Sequence[str], auto: bool, progress: Callable[[str], None]
) -> list[Refined]:
    """Refine sets of terms; return the smallest of the best first, then the others.

    A set is kept if its score, over blocks, lies within one standard error or `FLAT` of the best. Terms that a set does
    not show are left out of it. Without `auto`, only the set that was told is refined.
    """
    progress("Coulomb and viscous friction")
    start = {
        "inertia": 0.0,
        "mu_c": float(data.torque.std()),
        "sigma_2": 0.0,
        "torque_offset": 0.0,
        "delay": 0.0,
    }
    progress(
        f"first estimate, Coulomb and viscous friction: {_level(refine(data.rows, start, ()).values)}; all sets"
    )
    grid = data.grid
    largest = float(np.abs(data.torque).max())
    allowed = data.allowed if auto else told
    candidates = subsets.search(data.rows, grid, told, allowed)
    first = candidates[0]
    progress(f"best set by sums, {_words(first.terms)}: {_level(first.values)}")
    rough: dict[str, float] = {}
    if "bristles" in first.terms and "stribeck" in allowed:
        terms = (
            first.terms
            if "stribeck" in told
            else tuple(each for each in first.terms if each != "stribeck")
        )
        rough = refine(
            data.rows, subsets.started(_named(candidates, terms), largest), terms
        ).values
    best = refine(data.rows, _start(data, first, rough, largest), first.terms)
    progress(f"second estimate, {_words(best.terms)}: {_level(best.values)}")
    fits = {best.terms: best}

    def refined(terms: tuple[str, ...]) -> Refined:
        if terms not in fits:
            progress(_words(terms))
            start = _start(data, _named(candidates, terms), rough, largest)
            known = {
                name: value for name, value in best.values.items() if name in start
            }
            fits[terms] = refine(data.rows, start | known, terms, best.scatter)
        return fits[terms]

    near = [
        each.terms for each in candidates if len({*each.terms} ^ {*first.terms}) == 1
    ]
    near = [each for each in near if _named(candidates, each).score < FAR * first.score]
    good: dict[tuple[str, ...], Refined] = {}
    for terms in dict.fromkeys(
        [*(each.terms for each in candidates[:REFINED]), *near, tuple(told)]
    ):
        fit = refined(terms)
        while auto and (shown := seen(data, fit, told)) != fit.terms:
            fit = refined(shown)
        good[fit.terms] = fit
    ranked = sorted(good.values(), key=lambda each: each.score)
    close = [each for each in ranked if _as_good(each, ranked[0])]
    smallest = min(close, key=lambda each: (len(each.terms), each.score))
    return [smallest, *(each for each in ranked if each is not smallest)]


def _start(
    data: Data, candidate: subsets.Candidate, rough: Mapping[str, float], largest: float
) -> dict[str, float]:
    """Return the numbers from which a set of terms is refined.

    Bristles lag by the level itself, which the sums do not know: with them, a fall of friction is searched once more
    by the model, around the `rough` numbers of a fit without it.
    """
    start = subsets.started(candidate, largest)
    if not ("stribeck" in candidate.terms and rough):
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
        [start, *falls], key=lambda values: miss(data.rows, values, candidate.terms)
    )


def _named(
    candidates: Sequence[subsets.Candidate], terms: tuple[str, ...]
) -> subsets.Candidate:
    """Return the candidate with some terms."""
    return next(each for each in candidates if each.terms == terms)


def _level(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {values[name]:.3g}" for name in ("mu_c", "sigma_2"))


def _words(terms: Sequence[str]) -> str:
    return " and ".join(terms) or "Coulomb and viscous friction"


def _as_good(fit: Refined, best: Refined) -> bool:
    """Return True if a score exceeds the best by less than its standard error, or by little."""
    excess = fit.scores - best.scores
    error = excess.std(ddof=1) * np.sqrt(len(excess)) if len(excess) > 1 else 0.0
    return bool(excess.sum() <= max(error, FLAT * best.score))


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
    if term == "stribeck":
        return _doubt_of_fall(data, values, spread, level)
    if term == "bristles":
        bend = level / values["sigma_0"]
        if bend <= 0.5 * data.least_bend:
            return f"its bend of {bend:.2g} rad is below the {data.least_bend:.2g} rad that these logs show"
        vague = spread["sigma_0"] >= SURE_FACTOR
        return (
            f"sigma_0 is only known within a factor of {np.exp(min(2.0 * spread['sigma_0'], 700.0)):.2g}"
            if vague
            else ""
        )
    least = {
        "gravity": MATTERS * level,
        "load": MATTERS,
        "asymmetry": MATTERS * level / data.fastest,
    }[term]
    names = TERMS[term]
    size = (
        float(np.hypot(*(values[name] for name in names)))
        if term == "gravity"
        else values[names[0]]
    )
    # Its level may as well be an offset of the torque.
    tested = names[:1] if term == "asymmetry" else names
    clear = max(abs(values[name]) / max(spread[name], 1e-300) for name in tested)
    if term == "load" and size >= MOST_LOAD - 0.01:
        return "the level would grow with all of the torque"
    size = size if term == "load" else abs(size)
    return (
        ""
        if clear > SURE and size > least
        else f"{names[0]} = {size:.2g} is not clear of zero, or does not matter"
    )


def _doubt_of_fall(
    data: Data, values: dict[str, float], spread: dict[str, float], level: float
) -> str:
    speed = values["v_s"]
    rise = values["rise"]
    if not 0.5 * data.slowest_fall < speed < 1.5 * data.fastest:
        reach = f"{data.slowest_fall:.2g} to {data.fastest:.2g} rad/s"
        return f"its speed of {speed:.2g} rad/s lies outside of those that these logs show, {reach}"
    if spread["v_s"] >= SURE_FACTOR:
        return f"v_s is only known within a factor of {np.exp(min(2.0 * spread['v_s'], 700.0)):.2g}"
    bands = np.histogram(
        np.abs(data.speed), np.linspace(min(data.limits.slow, speed), speed, BANDS + 1)
    )[0]
    if rise > MOST_RISE * values["mu_c"] and bands.min() < LEAST_ROWS:
        return f"mu_s would be {1.0 + rise / values['mu_c']:.2g} mu_c, and too few samples are slow enough to show it"
    clear = rise > max(SURE * spread["rise"], MATTERS * level)
    return (
        ""
        if clear
        else f"mu_s exceeds mu_c by {rise:.2g} N m, which is not clear of zero, or does not matter"
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
            start = {
                name: value for name, value in fit.values.items() if name not in FACTORS
            }
            fits[terms] = refine(
                data.rows,
                {"delay": 0.0} | start | _factors(fit),
                terms,
                ranked[0].scatter,
            )
        if fits[terms].score > 1.2 * fits.get(fit.terms, fit).score:
            return fit
        fit = fits[terms]


def _factors(fit: Refined) -> dict[str, float]:
    return {name: fit.values[name] for name in FACTORS if name in fit.values}


def _lagging(data: Data, fit: Refined) -> Refined:
    """Refine a fit once more, and with a low pass in place of its delay where that explains more."""
    fit = refine(data.rows, {"delay": 0.0} | fit.values, fit.terms)
    delay = fit.values["delay"]
    if delay <= max(LATEST, SURE * fit.spread["delay"]):
        return fit
    low = refine(
        data.rows,
        fit.values | {"low_pass": delay, "delay": 0.0},
        fit.terms,
        None,
        "low_pass",
    )
    return (
        low
        if np.square(low.error).sum()
        < np.square(_low_passed_error(data, fit, delay)).sum()
        else fit
    )


def _low_passed_error(data: Data, fit: Refined, time_constant: float) -> np.ndarray:
    """Compute the error of a fit with a delay behind a low pass, which removes as much of the angle's noise."""
    found = predict(data.rows, fit.values, fit.terms)
    return np.concatenate(
        [
            rows.low_passed(
                torque
                - np.interp(
                    rows.time + fit.values["delay"], rows.even.time, rows.torque
                ),
                time_constant,
            )[rows.fitted]
            for torque, rows in zip(found, data.rows, strict=True)
        ]
    )


def _widened(data: Data, fit: Refined) -> Refined:
    """Add to the spreads what another kernel and even weights move: a term that reversals alone support moves then."""
    late = "low_pass" if "low_pass" in fit.values else "delay"
    even = np.full(2, fit.scatter.max())
    others = [
        refine(data.rows, fit.values, fit.terms, even, late).values,
        refine(data.wider(), fit.values, fit.terms, None, late).values,
    ]
    spread = {}
    for name, error in fit.spread.items():
        value = fit.values[name]
        if name in FACTORS:
            moves = [np.log(each[name] / value) for each in others]
            least = EXACT
        else:
            moves = [each[name] - value for each in others]
            least = EXACT * abs(value)
        spread[name] = float(np.sqrt(error**2 + np.sum(np.square(moves)) + least**2))
    return fit._replace(spread=spread)
