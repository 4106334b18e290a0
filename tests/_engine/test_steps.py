"""Derivatives of steps of bristles, cells and the published model against 60 digits, also where the cap is met."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from planarfriction._engine.bristles import asymmetric_cells, bristle_step, points
from planarfriction._engine.codegen.derivatives import derive
from planarfriction._engine.published import published_step
from planarfriction._engine.published.published_contact import PublishedPatch
from planarfriction.formulas import LawNumbers
from tests.support.referee import exact, misfit

LAW = LawNumbers(1e5, 300.0, 0.4, 0.5, 0.8, 1e-3, 1.7, 1.0, 0.3, 0.0)
LAWS = {
    "elasto-plastic": LAW,
    "plain": LAW._replace(elasto_plastic=0.0, creep_speed=1e-4),
}
laws = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)

GRIP = LAW.sigma_0 / 0.6
"""One over the largest deflection [1/m] at some speed."""

BRISTLE = derive(
    bristle_step.step,
    ("z", "u", "v", "per_h", "q", "law.breakaway_ratio"),
    {"z": 2, "u": 2},
)
CELL = derive(points.step, ("z", "u"), {"z": 2, "u": 2})
LEANING = derive(asymmetric_cells.step, ("z", "u"), {"lean.a": 2, "z": 2, "u": 2})

TURNS = 0.0, 1e-8, 1e-4, 0.5, 1.0, 0.5 * math.pi, 3.0, math.pi - 1e-8
"""Angles between a bristle and its velocity [rad]."""


def _turned(size: float, direction: float) -> tuple[float, float]:
    return size * math.cos(direction), size * math.sin(direction)


def _worst(draw: Callable[[np.random.Generator], float], count: int = 60) -> float:
    """Return the largest of many misfits, with repeatable draws."""
    rng = np.random.default_rng(0)
    return max(draw(rng) for _ in range(count))


def _far(rng: np.random.Generator) -> float:
    """Draw the length of a step in largest deflections."""
    return float(10.0 ** rng.uniform(-8.0, 4.0))


def _deflection(rng: np.random.Generator) -> float:
    """Draw a deflection in largest ones: tiny, before breakaway, slipping, or beyond the cap; never on a kink."""
    return float(
        rng.choice(
            [
                10.0 ** rng.uniform(-6.0, -1.0),
                0.29,
                0.31,
                0.9,
                0.999,
                1.001,
                rng.uniform(1.1, 4.0),
            ]
        )
    )


@laws
def test_derivatives_of_a_bristle(law):
    def draw(rng):
        v = 10.0 ** rng.uniform(-6.0, 1.0)
        h = rng.uniform(0.1, 1.0)
        direction = rng.uniform(0.0, 2.0 * math.pi)
        z = _turned(_deflection(rng) / GRIP * h, direction)
        u = _turned(v * h, direction + rng.choice(TURNS))
        along = (z[0] * u[0] + z[1] * u[1]) / max(math.hypot(*z), 1e-300)
        if v * h + along < 1e-12 * v * h:
            return 0.0  # exactly against each other: rounding decides on which side of its bound the decay lies
        return misfit(BRISTLE, (law, z, u, v, 1.0 / h, GRIP, _far(rng) / (v * GRIP)))

    # Digits that `z . u` loses where the two are nearly at right angles, in long steps.
    assert _worst(draw) < 1e-8


@laws
def test_derivatives_of_a_cell(law):
    def draw(rng):
        v = 10.0 ** rng.uniform(-6.0, 1.0)
        direction = rng.uniform(0.0, 2.0 * math.pi)
        z = _turned(_deflection(rng) / GRIP, direction)
        u = _turned(v, direction + rng.choice(TURNS))
        return max(
            misfit(CELL, (law, z, u, dt := _far(rng) / (v * GRIP))),
            misfit(LEANING, (asymmetric_cells.Leaning(law, (0.2, 0.1)), z, u, dt)),
        )

    assert _worst(draw) < 1e-8


@pytest.mark.parametrize("over", [0.0, 2.3e-16, 1e-14])
def test_what_rounding_lifts_over_the_cap_counts_as_not_capped(over):
    """Steady sliding sits on the cap to the last bit: its slope is that of the step without a cap."""
    v = 0.01
    size = (1.0 + over) / GRIP
    arguments = LAW, (size, 0.0), (v, 0.0), v, 1.0, GRIP, 10.0 / (v * GRIP)
    assert (
        misfit(
            BRISTLE,
            arguments,
            exact(bristle_step.step, {bristle_step.cap: lambda *_: 1}),
        )
        < 1e-8
    )


@laws
def test_derivatives_of_the_published_step(law):
    shape = PublishedPatch(1e-3, 2e-3, 0.01, 1e-4)

    def draw(rng):
        v = 10.0 ** rng.uniform(-5.0, 0.0)
        u = rng.uniform(-1.0, 1.0, 3)
        z = rng.normal(size=3)
        z *= _deflection(rng) / np.linalg.norm(z) / GRIP
        twist = v * (u + np.array([0.3, 0.0, 0.1]))
        state = (float(z[0]), float(z[1]), float(z[2] * shape.contact_radius))
        arguments = (
            law,
            shape,
            tuple(twist.tolist()),
            3.0 * v,
            tuple((v * u).tolist()),
            state,
        )
        return misfit(published_step.DERIVATIVE, (*arguments, _far(rng) / (v * GRIP)))

    assert _worst(draw, 40) < 1e-8
