"""Random walks of steps with anything that is legal, over many decades: nothing that is not finite, no free energy."""

from __future__ import annotations

import functools
import random

import numpy as np
import pytest
from attack import attack
from judge import Broken, finite, judge

import planarfriction as pf

ROUNDING = 1e-9
"""Share of a bound that the rounding of a walk may take: 1e3 steps of exponentials of 1e-15 and sums over the cells."""

FAR = 1e12
"""A way [m] after which every bristle slides."""


def spread(draw: random.Random, low: float, high: float) -> float:
    """A number whose logarithm is spread evenly between the bounds' decades."""
    return 10.0 ** draw.uniform(low, high)


def some_law(draw: random.Random) -> pf.laws.FrictionLaw:
    mu_c = spread(draw, -4, 2)
    kind = draw.randrange(4)
    if kind == 0:
        return pf.Dahl(mu_c, spread(draw, 0, 9))
    if kind == 1:
        return pf.CoulombStribeck(mu_c, mu_c * (1.0 + spread(draw, -4, 1)), spread(draw, -7, 1), draw.uniform(0.3, 4.0))
    return pf.LuGre(
        mu_c,
        mu_c * draw.choice([1.0, 1.0 + spread(draw, -4, 1)]),
        v_s=spread(draw, -7, 1),
        sigma_0=spread(draw, 0, 9),
        sigma_1=draw.choice([0.0, spread(draw, -3, 6)]),
        sigma_2=draw.choice([0.0, spread(draw, -4, 3)]),
        gamma=draw.uniform(0.3, 4.0),
        elasto_plastic=draw.choice([None, 0.9, draw.uniform(0.01, 0.99)]),
    )


def some_patch(draw: random.Random) -> pf.ContactPatch:
    size = spread(draw, -5, 0)
    kind = draw.randrange(6)
    if kind == 0:
        return pf.ContactPatch.disc(size, draw.randint(2, 7))
    if kind == 1:
        return pf.ContactPatch.rectangle(size, size * spread(draw, -3, 3), cells=(draw.randint(1, 5), draw.randint(2, 5)))
    if kind == 2:
        return pf.ContactPatch.line(size, draw.randint(2, 9), direction=draw.choice("xy"))
    if kind == 3:
        count = draw.randint(2, 6)
        positions = [(size * draw.uniform(-1, 1), size * draw.uniform(-1, 1)) for _ in range(count)]
        return pf.ContactPatch.points(positions, [spread(draw, -3, 1) for _ in range(count)])
    if kind == 4:
        gradient = (draw.uniform(-0.9, 0.9) / size, 0.0)
        return pf.ContactPatch.rectangle(size, cells=5, pressure=pf.LinearGradient(gradient))
    values = np.array([[draw.choice([0.0, spread(draw, -2, 2)]) for _ in range(4)] for _ in range(4)])
    values[0, 0] = values[-1, -1] = 1.0
    return pf.ContactPatch.from_pressure(values, size / 4)


def some_twist(draw: random.Random, size: float) -> np.ndarray:
    """Speeds of all decades, and now and then none along an axis."""
    speed = spread(draw, -12, 2) if draw.random() < 0.9 else spread(draw, -300, -12)
    direction = np.array([draw.gauss(0, 1), draw.gauss(0, 1), draw.gauss(0, 1) / size])
    direction *= [draw.random() > 0.2, draw.random() > 0.2, draw.random() > 0.3]
    return speed * direction


@functools.cache
def small_models() -> dict[str, type]:
    """Models with maps that are quick to make."""
    return {
        "distributed": pf.DistributedModel,
        "reduced": functools.partial(pf.ReducedModel, segments=8, speeds=6),
        "published": pf.ReducedModelPublished,
    }


def check_bounds(model, state: np.ndarray) -> None:
    """No bristle is deflected by more than the law holds; a mean over bristles neither."""
    law = model.law.numbers
    largest, lengths = max(law.mu_s, law.mu_c) / law.sigma_0, np.hypot(state[0], state[1])
    if (lengths > largest * (1.0 + ROUNDING)).any():
        raise Broken(f"a bristle is deflected by {lengths.max()} m, the law holds {largest} m")


def walk(draw: random.Random, name: str) -> None:
    kind = f"steps: {name}"
    model = judge(kind, lambda: small_models()[name](some_patch(draw), some_law(draw)), compiles=True)
    if model is None:
        return
    size, state = float(np.abs(model.patch.positions).max()) or 1.0, model.rest()
    twist, load, dt = some_twist(draw, size), spread(draw, -6, 4), spread(draw, -9, 1)
    for _ in range(40):
        if draw.random() < 0.4:
            twist = some_twist(draw, size)
        load = draw.choice([load, load, spread(draw, -6, 4), 0.0])
        dt = draw.choice([dt, spread(draw, -9, 2), 0.0])
        state, wrench = judge(kind, lambda: model.step(state, twist, load, dt), compiles=True)
        finite((state, wrench), "a step")
        check_bounds(model, state)
        if load == 0.0 and (state.any() or wrench.any()):
            raise Broken("a contact without load keeps its bristles or a wrench")
    slip = some_twist(draw, size)
    slip *= spread(draw, -12, 2) / (np.abs(slip) @ [1.0, 1.0, size] or 1.0)
    steady = judge(kind, lambda: model.step(state, slip, load or 1.0, FAR / 1e-12))[1]
    if steady @ slip > ROUNDING * np.abs(steady * slip).sum():
        raise Broken(f"steady sliding with {slip} gives power: {steady}")
    for slopes in (model.jacobians(state, twist, load), model.step_jacobians(state, twist, load, dt)):
        finite(tuple(slopes), "a Jacobian")


@attack("steps", 150)
def test_distributed_walks(draw: random.Random) -> None:
    walk(draw, "distributed")


@attack("steps", 150)
def test_published_walks(draw: random.Random) -> None:
    walk(draw, "published")


@attack("steps", 60)
def test_reduced_walks(draw: random.Random) -> None:
    walk(draw, "reduced")
