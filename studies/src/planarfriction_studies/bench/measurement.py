"""One line of `planarfriction bench`, how times are taken for it, and workloads of several benchmarks."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch


@dataclass(frozen=True)
class Measurement:
    """One line of the benchmark; without numbers where what it needs is not installed, as `baseline` then says."""

    name: str
    """Name of the benchmark."""
    value: float | None
    """Median; of what runs on one thread the least processor time, on which other programs tell least."""
    unit: str
    baseline: str
    """Baseline that the value is compared with, in words."""
    baseline_value: float | None
    """The same of the baseline, in the same unit."""
    ratio: float | None
    """Ratio of baseline over value, above 1 where the baseline is dearer, unless `baseline` says otherwise."""
    ratios: tuple[float, ...] = ()
    """Ratios of all rounds, if there was more than one; the others are those of the round in the middle."""


def line(
    value: float,
    unit: str,
    baseline: str,
    baseline_value: float,
    ratio: float | None = None,
) -> Measurement:
    """Make a measurement that has no name yet; `ratio` is that of the two values unless it is given."""
    return Measurement(
        "",
        value,
        unit,
        baseline,
        baseline_value,
        baseline_value / value if ratio is None else ratio,
    )


def median(action: Callable[[], Any], repeats: int, inner: int = 1) -> float:
    """Measure the median time of `action` [s] over `repeats` rounds of `inner` calls, after one more call."""
    action()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        for _ in range(inner):
            action()
        times.append((time.perf_counter() - begin) / inner)
    return statistics.median(times)


def least(*actions: Callable[[], Any], repeats: int = 9, inner: int = 1) -> list[float]:
    """Measure the least processor time of each action [s], in turns of `inner` calls, after one more call of each."""
    for action in actions:
        action()
    times = [
        [_of_processor(action, inner) for action in actions] for _ in range(repeats)
    ]
    return [min(column) for column in zip(*times, strict=True)]


def _of_processor(action: Callable[[], Any], inner: int) -> float:
    begin = time.process_time()
    for _ in range(inner):
        action()
    return (time.process_time() - begin) / inner


def once(action: Callable[[], Any]) -> float:
    """Measure the time of `action` [s]."""
    begin = time.perf_counter()
    action()
    return time.perf_counter() - begin


AGAINST_PUBLISHED = "the same of ReducedModelPublished"
"""The baseline of what `ReducedModel` is measured with, in words."""


def law() -> LuGre:
    """Return the published friction parameters."""
    return LuGre(mu_s=1.2, elasto_plastic=ElastoPlastic(0.9))


def disc(cells: int = 21) -> ContactPatch:
    """Return the published disc."""
    return PUBLISHED_PATCHES["Circle"](cells=cells)


def mixed_twists(count: int) -> np.ndarray:
    """Return twists that slide and spin at all speeds around the Stribeck speed, in random directions."""
    generator = np.random.default_rng(7)
    directions = generator.normal(size=(count, 3)) * [1.0, 1.0, 150.0]
    return directions * 10.0 ** generator.uniform(-4.0, -1.5, size=(count, 1))
