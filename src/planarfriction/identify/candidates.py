"""Motions for an experiment: a small family that loads, reverses, slides and spins a contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.identify.logs import Log
from planarfriction.laws import LuGre
from planarfriction.patch import ContactPatch

SAMPLES = 100, 100_000
"""Fewest samples that show a motion, and most that a plan is made for."""

LOADS = 20
"""Most loads of a plan."""

SINES = (2.3, 1.7, 3.1)
"""Frequencies of vx, vy and omega [Hz]: no two periods meet again soon."""

SLOWEST = 1e-3
"""Speed that a slide begins with, over its largest."""

STROKE = 3.0
"""Amplitude of reversals over the way at which bristles break away, `mu_s/sigma_0`."""

SLOW = 1.0
"""Frequency of slow reversals [Hz]."""

PER_PERIOD = 25.0
"""Samples of a period of the quickest reversals."""


def candidate_motions(
    patch: ContactPatch,
    law: LuGre,
    *,
    normal_force: float | Sequence[float] = 1.0,
    speed: float = 0.05,
    spin: float | None = None,
    duration: float = 2.0,
    rate: float = 1000.0,
) -> tuple[Log, ...]:
    """Motions to choose from for an experiment: six for each load, starting at rest, as logs whose wrenches are zero.

    They are: growing sines of slide and spin, a slide that becomes faster, slow and quick reversals over three times
    the distance at which bristles break away, spin alone, and spin during a slide.

    Parameters
    ----------
    patch, law
        The contact, as far as it is known.
    normal_force
        One load or several [N].
    speed, spin
        The largest that the rig can produce [m/s, rad/s]; None for `spin` moves the rim of the contact as fast as
        `speed`.
    duration, rate
        Length of each motion [s] and samples per second [Hz].

    Raises
    ------
    InvalidValueError
        A number that is not > 0, more than 20 loads, or fewer than 100 or more than 100000 samples.
    """
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    validation.instance("law", law, LuGre, "a LuGre law")
    given = validation.numbers("normal_force", normal_force)
    if given.ndim > 1 or not 1 <= given.size <= LOADS:
        raise InvalidValueError("normal_force", f"be one load or a list of up to {LOADS}", f"shape {given.shape}")
    loads = [validation.positive("normal_force", each) for each in given.reshape(-1)]
    speed, duration, rate = (
        validation.positive(name, value) for name, value in (("speed", speed), ("duration", duration), ("rate", rate))
    )
    samples = duration * rate
    if not SAMPLES[0] <= samples <= SAMPLES[1]:
        raise InvalidValueError("duration * rate", f"be between {SAMPLES[0]} and {SAMPLES[1]} samples", f"{samples:g}")
    time = np.arange(round(samples)) / rate
    result = []
    for load in loads:
        turn = speed / float(patch.contact_radius(load)) if spin is None else validation.positive("spin", spin)
        for name, twist in _twists(time, speed, turn, law.mu_s / law.sigma_0, rate).items():
            called = f"{name}, {load:g} N" if len(loads) > 1 else name
            result.append(Log(time, twist, np.zeros_like(twist), np.full_like(time, load), called))
    return tuple(result)


def _twists(time: np.ndarray, speed: float, spin: float, breakaway: float, rate: float) -> dict[str, np.ndarray]:
    """Twists `[T, 3]` by name."""
    share, zero = time / time[-1], np.zeros_like(time)
    grown = SLOWEST ** (1.0 - share) - SLOWEST * (1.0 - share)  # from 0, soon by the same factor in the same time
    sines = [np.sin(2.0 * np.pi * hertz * time) for hertz in SINES]
    swept = (0.03 + 0.97 * share**2) * np.array(sines)

    def reversals(hertz: float) -> np.ndarray:
        hertz = min(hertz, speed / (2.0 * np.pi * STROKE * breakaway))
        pace = 2.0 * np.pi * hertz
        return STROKE * breakaway * pace * np.sin(pace * time)

    columns: dict[str, tuple[Any, Any, Any]] = {
        "grown sines": (speed * swept[0], 0.7 * speed * swept[1], spin * swept[2]),
        "slide from slow to fast": (speed * grown, zero, zero),
        "slow reversals": (reversals(SLOW), zero, zero),
        "quick reversals": (reversals(rate / PER_PERIOD), zero, zero),
        "spin": (zero, zero, spin * swept[2]),
        "spin during a slide": (speed * grown, zero, spin * grown * sines[2]),
    }
    return {name: np.stack(column, -1) for name, column in columns.items()}
