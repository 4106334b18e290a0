"""Random steps of bodies on patches: 1 mg to 1000 t, 10 us to 1 s, one to six patches of all kinds, at rest and in slip."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import planarfriction as pf
from tests.support.coupling_problems import SHAPES, random_law

_METRIC = pf.ContactPatch.rectangle(0.02, 0.01, cells=7).with_friction_metric([[1.0, 0.2], [0.2, 1.5]])
_POINTS = pf.ContactPatch.points([[0.0, 0.0], [0.01, 0.0], [0.002, 0.008]])
_FEW = pf.ContactPatch.disc(radius=0.01, cells=5)


class Steps(NamedTuple):
    """Arguments of `SlidingBody.step` for a batch of E bodies that differ in all but mass and patches."""

    state: np.ndarray
    """`[E, states]`"""
    twist: np.ndarray
    """`[E, 3]`"""
    normal_force: np.ndarray
    """`[E, k]`"""
    dt: np.ndarray
    """`[E]`"""
    wrench: np.ndarray
    """`[E, 3]`"""
    angle: np.ndarray
    """`[E]`"""


@functools.cache
def models(seed: int) -> list[pf.models.FrictionModel]:
    """Return a model of each kind, with laws that are soft and stiff, damped and not, with and without breakaway."""
    generator = np.random.default_rng(seed)
    laws = [random_law(generator) for _ in range(6)]
    fixed = pf.LuGre(mu_s=1.2, elasto_plastic=0.9, reference_load=2.0)
    return [
        *(pf.ReducedModel(SHAPES[i % 3], laws[i]) for i in range(3)),
        pf.ReducedModel(pf.ContactPatch.disc(radius=0.003), pf.LuGre(0.3, 0.4)),
        pf.DistributedModel(_POINTS, laws[3]),
        pf.DistributedModel(_METRIC, laws[4]),
        pf.ReducedModelPublished(SHAPES[0], laws[5]),
        pf.ReducedModelPublished(_FEW, laws[2], pf.LimitSurfaceEllipsoid(_FEW)),
        pf.ReducedModel(SHAPES[0], fixed),
    ]


def random_body(generator: np.random.Generator, kinds: list[pf.models.FrictionModel]) -> pf.SlidingBody:
    """Draw a body of 1 mg to 1000 t whose one to six patches lie within 1 mm to 1 m; one at its centre, or about it."""
    mass, size = 10.0 ** generator.uniform(-6.0, 6.0), 10.0 ** generator.uniform(-3.0, 0.0)
    k = generator.integers(1, 7)
    chosen = [kinds[i] for i in generator.choice(len(kinds), k)]
    if generator.uniform() < 0.5:
        chosen = [chosen[0]] * k
    places = size * generator.uniform(-1.0, 1.0, (k, 2)) * (k > 1 or generator.uniform() < 0.5)
    inertia = mass * max(size, 0.003) ** 2 * generator.uniform(0.1, 1.0)
    return pf.SlidingBody(mass, inertia, chosen, places, generator.uniform(-3.0, 3.0, k))


def random_steps(generator: np.random.Generator, body: pf.SlidingBody, count: int, steps: int) -> Iterator[Steps]:
    """Yield steps of `count` bodies from rest: kicked, pushed, loaded and let go. Send back what each came to."""
    k, size = len(body.patches.models), max(np.abs(body.positions).max(), 0.003)
    unit = np.array([1.0, 1.0, 1.0 / size])
    wide = generator.uniform(size=count) < 0.5
    weight = 9.81 * body.mass * 10.0 ** np.where(wide, generator.uniform(-2.0, 4.0, count), generator.uniform(-1.0, 1.0, count))
    share = 10.0 ** generator.uniform(-1.0, 0.0, (count, k))
    load = weight[:, None] * share / share.sum(axis=1, keepdims=True)
    dt, angle = 10.0 ** generator.uniform(-5.0, 0.0, count), generator.uniform(-3.0, 3.0, count)
    fast = 10.0 ** generator.uniform(-4.0, 1.0, (count, 1))
    state, twist, push = body.rest(count), np.zeros((count, 3)), np.zeros((count, 3))

    for i in range(steps):
        kicked = generator.uniform(size=(count, 1)) < (0.5 if i == 0 else 0.1)
        twist = twist + kicked * fast * unit * generator.normal(size=(count, 3))
        pushed = generator.uniform(size=(count, 1)) < (0.7 if i == 0 else 0.2)
        strength = generator.choice([0.0, 0.1, 0.3, 1.0, 2.0, 10.0], (count, 1)) * weight[:, None]
        push = np.where(pushed, strength * generator.normal(size=(count, 3)) / unit, push)
        jump = generator.uniform(size=(count, 1)) < 0.1
        loads = load * np.where(jump, 10.0 ** generator.uniform(-2.0, 0.5, (count, k)), 1.0)
        loads = loads * (generator.uniform(size=(count, k)) > 0.01)
        end = yield Steps(state, twist, loads, dt, push, angle)
        state, twist = end.state, end.twist
