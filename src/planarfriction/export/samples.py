"""Numbers with which the test of an exported library compares."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.export.c_source import Writer
from planarfriction.export.slip import Slip

KINDS = {"": np.float64, "f": np.float32}

TOLERANCES = {"": 1e-9, "f": 1e-3}
"""Differences that pass, of the largest wrench per load: of rounding that slip multiplies."""

MU = 0.5


class Samples(NamedTuple):
    """Numbers as source."""

    steps: list[list[str]]
    """Twist, normal force and period of each step."""
    wrenches: list[list[str]]
    loads: list[list[str]]
    """Loads, and the least normal forces that hold them."""
    mu: str
    lever: str
    tolerance: str


def samples_of(model: Any, slip: Slip | None, writer: Writer, rungs: Any = None, count: int = 32) -> Samples:
    """Step a model from rest through random twists, loads and periods, from sticking to sliding.

    Loads are the `rungs` between which shapes are interpolated, if there are any.
    """
    rng, kind = np.random.default_rng(0), KINDS[writer.suffix]
    lever = 1.0 if slip is None else slip.surface.contact_radius
    speeds = model.law.numbers.v_s * 10.0 ** rng.uniform(-3.0, 2.0, (count, 1))
    rows = np.hstack([
        rng.normal(size=(count, 3)) * speeds / [1.0, 1.0, lever],
        10.0 ** rng.uniform([-1.0, -5.0], [1.0, -2.0], (count, 2)),
    ]).astype(kind).astype(float)  # fmt: skip
    if rungs is not None:
        rows[:, 3] = rng.choice(rungs[np.clip(np.searchsorted(rungs, [0.1, 10.0]), 0, len(rungs) - 1)], count)
    state, wrenches = model.rest(), []
    for row in rows:
        state, wrench = model.step(state, row[:3], row[3], row[4])
        wrenches.append(wrench)
    loads = (rng.normal(size=(count, 3)) * [1.0, 1.0, lever]).astype(kind).astype(float)
    if slip is not None:
        needed = np.einsum("ni,ni->n", slip.surface.twist(-loads), loads) / MU
        loads = np.column_stack([loads, needed])
    steps, after, held = (
        [[writer.constant(float(x)) for x in row] for row in table] for table in (rows, wrenches, loads)
    )
    mu, arm, tolerance = map(writer.constant, (MU, float(lever), TOLERANCES[writer.suffix]))
    return Samples(steps, after, held, mu, arm, tolerance)
