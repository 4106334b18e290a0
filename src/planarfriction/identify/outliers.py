"""Slides that cannot be explained by friction: pushed, without contact, or far from the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planarfriction.identify.result import Verdict
from planarfriction.identify.slides import Slide, SlidingBody

WINDOW = 8
"""Samples of a line through the poses that gives a speed."""

GROWS, NOISE = 0.1, 6.0
"""A speed that grows by more than this share of the largest, and this many spreads of its noise, was pushed."""

FREE, LONG = 0.2, 0.25
"""A speed that falls by less than this share of what is usual, for this share of the motion, felt no friction."""

MODEST, FAR = 2.5, 6.0
"""Errors of a slide over that of the median slide: from the first on it counts less, beyond the second not at all."""

STRONG = 0.7
"""Standard errors by which one slide alone must move an estimate to be named: it then makes half of the variance."""


def speeds(slide: Slide, body: SlidingBody) -> tuple[np.ndarray, np.ndarray, float]:
    """Middle times of windows, speeds `sqrt(v^2 + I omega^2/m)` in them, and the spread of the noise of these."""
    count = max(len(slide.time) // WINDOW, 1)
    scale = np.array([1.0, 1.0, np.sqrt(body.inertia / body.mass)])
    times, found, left = [], [], []
    for rows in np.array_split(np.arange(len(slide.time)), count):
        since = slide.time[rows] - slide.time[rows].mean()
        poses = slide.pose[rows] * scale
        fit = np.polynomial.polynomial.polyfit(since, poses, 2 if len(rows) > 4 else 1)
        left.append(poses - np.polynomial.polynomial.polyval(since, fit).T)
        times.append(slide.time[rows].mean())
        found.append(np.linalg.norm(fit[1]))
    length = np.median(np.diff(slide.time)) * WINDOW
    spread = np.std(np.concatenate(left)) * np.sqrt(12.0 / WINDOW) / length
    return np.array(times), np.array(found), float(spread)


def contradictions(slides: Sequence[Slide], body: SlidingBody) -> dict[int, str]:
    """Number of a slide -> why friction alone cannot have made it."""
    seen = [speeds(slide, body) for slide in slides]
    brakes = [brake for time, speed, _ in seen if (brake := _brake(time, speed)) > 0.0]
    usual = float(np.median(brakes)) if brakes else 0.0
    found = {}
    for i, (time, speed, noise) in enumerate(seen):
        grown = speed - np.minimum.accumulate(speed)
        last = int(grown.argmax())
        first = int(speed[: last + 1].argmin())
        free = _free(time, speed, FREE * usual)
        if grown[last] > max(GROWS * speed.max(), NOISE * noise):
            found[i] = f"its speed grows from {speed[first]:.2g} to {speed[last]:.2g} m/s: it was pushed"
        elif len(slides) > 2 and free > max(
            LONG * (time[-1] - time[0]), 1.5 * (time[1] - time[0] if len(time) > 1 else 0)
        ):
            found[i] = f"its speed hardly falls for {1e3 * free:.0f} ms: it lost contact, or was pushed"
    return found


def _brake(time: np.ndarray, speed: np.ndarray) -> float:
    """Mean deceleration until the speed is a tenth of the first [m/s^2]."""
    slow = np.flatnonzero(speed < 0.1 * speed[0])
    last = slow[0] if len(slow) else len(speed) - 1
    return float((speed[0] - speed[last]) / (time[last] - time[0])) if last > 0 else 0.0


def _free(time: np.ndarray, speed: np.ndarray, least: float) -> float:
    """Longest time over which a body that moves decelerates by less than `least`."""
    brakes = -np.diff(speed) / np.diff(time) if len(time) > 1 else np.zeros(0)
    longest = since = 0.0
    for brake, before, after, step in zip(brakes, speed[:-1], speed[1:], np.diff(time), strict=True):
        moves = min(before, after) > 0.25 * speed.max()
        since = since + step if moves and brake < least else 0.0
        longest = max(longest, since)
    return longest


def weights(errors: np.ndarray) -> np.ndarray:
    """Weights `[N]` of slides by the root mean squares of their residuals: 1 near the median, 0 beyond `FAR` of it."""
    middle = float(np.median(errors))
    ratio = errors / middle if middle > 0.0 else np.ones(len(errors))
    return np.where(ratio > FAR, 0.0, np.minimum(1.0, MODEST / np.maximum(ratio, 1e-300)) ** 2)


def verdicts_on_slides(
    left_out: dict[str, str],
    errors: np.ndarray,
    weighed: np.ndarray,
    slides: Sequence[Slide],
    moved: np.ndarray,
    names: Sequence[str],
    spread: np.ndarray,
) -> list[Verdict]:
    """Slides that were left out, those that count less, and the one that moves an estimate most.

    `errors` are the residuals of each slide over those of the median one, `weighed` its weight, `moved` `[N, F]` what
    estimates would change by without it.
    """
    found = [Verdict("fit", True, f"{name} is left out: {why}") for name, why in left_out.items()]
    for i in np.flatnonzero(weighed == 0.0).tolist():
        why = f"its residuals are {errors[i]:.2g} times those of the median slide"
        found.append(Verdict("fit", True, f"{slides[i].name} is left out: {why}"))
    less = [slides[i].name for i in np.flatnonzero((weighed > 0.0) & (weighed < 1.0)).tolist()]
    if less:
        found.append(
            Verdict(
                "fit", True, f"{', '.join(less[:5])}{' ...' if len(less) > 5 else ''} have less weight: large residuals"
            )
        )
    known = np.isfinite(spread) & (spread > 0.0)
    share = np.divide(np.abs(moved), spread, out=np.zeros_like(moved), where=known & np.ones_like(moved, dtype=bool))
    if len(slides) > 2 and share.max() > STRONG:
        i, j = (int(place) for place in np.unravel_index(int(share.argmax()), share.shape))
        change = f"{names[j]} would change by {moved[i, j]:+.2g} ({share[i, j]:.1f} standard errors)"
        found.append(Verdict("fit", True, f"without {slides[i].name}, {change}"))
    return found
