"""Angles of a measured motion: whole turns that a tracker removes are restored, other jumps are refused."""

from __future__ import annotations

import numpy as np

from planarfriction.errors import InvalidValueError

TURN = 2.0 * np.pi

QUARTER = 0.25 * TURN
"""Most that an angle may turn, or its step may change, between two samples for its turns to be counted [rad]."""

ROUNDED = 1e-3
"""By how much the range of a wrapped angle may exceed a turn, for rounding [turns]."""

NEIGHBOURS = 3
"""Steps on either side that a step is compared with."""


def unwrapped(time: np.ndarray, angle: np.ndarray, name: str = "theta") -> tuple[np.ndarray, int]:
    """The angle `[T]` [rad] without the jumps by a turn that keep it within one, and how many there were.

    An angle that goes on beyond a turn is as it should be, however fast it turns.

    Raises InvalidValueError for a jump that no whole turn explains, and where a wrapped angle turns by more than a
    quarter of a turn between two samples, so that its direction is unknown.
    """
    if len(angle) < 2:
        return angle, 0
    steps = np.diff(angle)
    turns = np.round(steps / TURN)
    wrapped = bool(turns.any()) and np.ptp(angle) <= (1.0 + ROUNDED) * TURN
    if wrapped:
        steps = steps - TURN * turns
    else:
        turns = np.zeros_like(turns)
    jump = np.abs(steps - _usual(steps)) > QUARTER
    if jump.any():
        raise _refusal(time, np.diff(angle), jump, name, "only jump by whole turns")
    fast = np.abs(steps) > QUARTER
    if wrapped and fast.any():
        raise _refusal(time, steps, fast, name, "turn by less than a quarter turn between samples, or be unwrapped")
    return angle - TURN * np.concatenate([[0.0], np.cumsum(turns)]), int(np.count_nonzero(turns))


def _usual(steps: np.ndarray) -> np.ndarray:
    """Median of each step and its neighbours, `[T - 1]`."""
    padded = np.pad(steps, NEIGHBOURS, mode="reflect" if len(steps) > NEIGHBOURS else "edge")
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBOURS + 1), axis=1)


def _refusal(time: np.ndarray, steps: np.ndarray, where: np.ndarray, name: str, rule: str) -> InvalidValueError:
    i = int(np.argmax(where))
    return InvalidValueError(f"{name} [rad]", rule, f"a step of {steps[i]:.3g} at t = {time[i + 1]:g} s")
