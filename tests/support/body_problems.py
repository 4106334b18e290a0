"""Random steps of bodies on patches: 1 mg to 1000 t, 10 us to 1 s, one to six patches of all kinds, stuck or slipping.

Loads are a hundredth to ten thousand times the weight, pushes up to some tens of times the load.
"""

from __future__ import annotations

import functools
from collections.abc import Generator
from typing import NamedTuple

import numpy as np

import planarfriction as pf
from planarfriction.errors import SolverError
from planarfriction.sliding_body import BodyStep
from tests.support.coupling_problems import SHAPES, random_law

_METRIC = pf.ContactPatch.rectangle(0.02, 0.01, cells=7).with_friction_metric(
    [[1.0, 0.2], [0.2, 1.5]]
)
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
    law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
    return [
        *(pf.ReducedModel(SHAPES[i % 3], laws[i]) for i in range(3)),
        pf.ReducedModel(pf.ContactPatch.disc(radius=0.003), pf.LuGre(0.3, 0.4)),
        pf.DistributedModel(_POINTS, laws[3]),
        pf.DistributedModel(_METRIC, laws[4]),
        pf.ReducedModelPublished(SHAPES[0], laws[5]),
        pf.ReducedModelPublished(_FEW, laws[2], pf.LimitSurfaceEllipsoid(_FEW)),
        pf.ReducedModel(SHAPES[0], law, pad=pf.Pad.at_load(2.0)),
    ]


def random_body(
    generator: np.random.Generator, kinds: list[pf.models.FrictionModel], patches: int
) -> pf.SlidingBody:
    """Draw a body of 1 mg to 1000 t whose patches lie within 1 mm to 1 m; one at its centre, or about it."""
    mass = 10.0 ** generator.uniform(-6.0, 6.0)
    size = 10.0 ** generator.uniform(-3.0, 0.0)
    k = patches
    chosen = [kinds[i] for i in generator.choice(len(kinds), k)]
    if generator.uniform() < 0.5:
        chosen = [chosen[0]] * k
    places = (
        size
        * generator.uniform(-1.0, 1.0, (k, 2))
        * (k > 1 or generator.uniform() < 0.5)
    )
    inertia = mass * max(size, 0.003) ** 2 * generator.uniform(0.1, 1.0)
    return pf.SlidingBody(
        mass, inertia, chosen, places, generator.uniform(-3.0, 3.0, k)
    )


def random_steps(
    generator: np.random.Generator, body: pf.SlidingBody, count: int, steps: int
) -> Generator:
    """Yield steps of `count` bodies from rest: kicked, pushed, loaded and let go. Send back what each came to."""
    k = len(body.patches.models)
    size = max(np.abs(body.positions).max(), 0.003)
    unit = np.array([1.0, 1.0, 1.0 / size])
    wide = generator.uniform(size=count) < 0.5
    pressed = generator.uniform(-2.0, 4.0, count)
    weight = (
        9.81
        * body.mass
        * 10.0 ** np.where(wide, pressed, generator.uniform(-1.0, 1.0, count))
    )
    share = 10.0 ** generator.uniform(-1.0, 0.0, (count, k))
    load = weight[:, None] * share / share.sum(axis=1, keepdims=True)
    dt = 10.0 ** generator.uniform(-5.0, 0.0, count)
    angle = generator.uniform(-3.0, 3.0, count)
    fast = 10.0 ** generator.uniform(-4.0, 1.0, (count, 1))
    state = body.rest(count)
    twist = np.zeros((count, 3))
    push = np.zeros((count, 3))

    for i in range(steps):
        kicked = generator.uniform(size=(count, 1)) < (0.5 if i == 0 else 0.1)
        twist = twist + kicked * fast * unit * generator.normal(size=(count, 3))
        pushed = generator.uniform(size=(count, 1)) < (0.7 if i == 0 else 0.2)
        strength = (
            generator.choice([0.0, 0.1, 0.3, 1.0, 2.0, 10.0], (count, 1))
            * weight[:, None]
        )
        push = np.where(
            pushed, strength * generator.normal(size=(count, 3)) / unit, push
        )
        jump = generator.uniform(size=(count, 1)) < 0.1
        loads = load * np.where(
            jump, 10.0 ** generator.uniform(-2.0, 0.5, (count, k)), 1.0
        )
        loads = loads * (generator.uniform(size=(count, k)) > 0.01)
        end = yield Steps(state, twist, loads, dt, push, angle)
        state = end.state
        twist = end.twist


def solved(body: pf.SlidingBody, given: Steps) -> tuple[BodyStep, np.ndarray]:
    """Return the steps, and True for those that did not converge."""
    try:
        end = body.step(*given)
    except SolverError as error:
        return error.step, ~error.converged
    return end, np.zeros(len(given.dt), bool)


def failures(seed: int, total: int, count: int = 250, steps: int = 8) -> np.ndarray:
    """Return steps and failures of Python by the decades of mass and time step, `[12, 5, 2]`."""
    generator = np.random.default_rng(seed)
    table = np.zeros((12, 5, 2), int)
    while table[..., 0].sum() < total:
        body = random_body(
            generator,
            models(int(generator.integers(20))),
            int(generator.integers(1, 7)),
        )
        run = random_steps(generator, body, count, steps)
        end = None
        for _ in range(steps):
            given = run.send(end)
            end, lost = solved(body, given)
            assert all(np.isfinite(each).all() for each in end)
            tally(table, body.mass, given.dt, lost)
    return table


def tally(table: np.ndarray, mass: float, dt: np.ndarray, lost: np.ndarray) -> None:
    """Add steps and failures of bodies of one mass to a table `[12, 5, 2]` by decades."""
    row = int(np.floor(np.log10(mass))) + 6
    columns = np.clip(np.floor(np.log10(dt)).astype(int) + 5, 0, 4)
    np.add.at(table[row, :, 0], columns, 1)
    np.add.at(table[row, :, 1], columns, lost)


def shown(table: np.ndarray) -> str:
    """Return a table as text: a line for each decade of mass, failures of all steps by decades of the time step."""
    lines = [" " * 12 + "".join(f"{f'1e{d} s':>16}" for d in range(-5, 0))]
    for m, row in enumerate(table):
        lines.append(
            f"1e{m - 6:<3} kg    "
            + "".join(f"{f'{lost} of {count}':>16}" for count, lost in row)
        )
    return "\n".join(lines)
