"""Steps of the PyTorch and the JAX models: as in NumPy for anything that is legal, and refused where they are not."""

from __future__ import annotations

import functools
import importlib
import random

import nasty
import numpy as np
import pytest
import some
from attack import attack
from judge import Broken, finite, judge

import planarfriction as pf

PATCHES = (
    pf.ContactPatch.disc(0.01, 4),
    pf.ContactPatch.points([(0.0, 0.0), (0.01, 0.005)], [1.0, 3.0]),
)
MODELS = ("DistributedModel", "ReducedModel", "ReducedModelPublished")
CLOSE = 1e-7
"""Share of the largest number by which two ways of summing and of taking exponentials may differ after four steps."""

ROUNDING = 1e-13
"""Share of the terms that cancel in a sum."""

ARGUMENTS = ("state", "twist", "normal_force", "dt")
NUMBERS = [
    name for name in nasty.ODD if not name.startswith("many") and "huge map" not in name
]


@functools.cache
def front_end(name: str):
    """The module of a front end, in double precision."""
    package = pytest.importorskip(name, reason=f"needs the extra [{name}]")
    if name == "jax":
        package.config.update("jax_enable_x64", True)
    return importlib.import_module(f"planarfriction.{name}")


def arrays(name: str, *values):
    """The values as tensors of a front end."""
    if name == "jax":
        import jax.numpy as jnp

        return [jnp.asarray(value) for value in values]
    import torch

    return [torch.tensor(np.asarray(value, float)) for value in values]


def plain(values) -> list[np.ndarray]:
    return [
        np.asarray(value.detach() if hasattr(value, "detach") else value)
        for value in values
    ]


def pair(name: str, draw: random.Random):
    """The same model in NumPy and in the front end, or None where it knows no such law."""
    kind = draw.choice(MODELS)
    patch = draw.choice(PATCHES)
    law = some.law(draw)
    options = {"cells": 8} if kind == "ReducedModel" else {}
    make = getattr(front_end(name), kind)
    front_end(name), arrays(name, 0.0)  # a front end takes its memory when it is loaded
    double = (
        {"dtype": importlib.import_module("torch").float64} if name == "torch" else {}
    )
    other = judge(
        f"steps: {name}", lambda: make(patch, law, **options, **double), compiles=True
    )
    return None if other is None else (getattr(pf, kind)(patch, law, **options), other)


def walk(name: str, draw: random.Random) -> None:
    models = pair(name, draw)
    if models is None:
        return
    ours, other = models
    state = ours.rest()
    tensor = arrays(name, ours.rest())[0]
    for _ in range(4):
        twist = some.twist(draw, 0.01)
        load = some.spread(draw, -6, 4)
        dt = some.spread(draw, -9, 1)
        if np.abs(twist).max() < 1e-100:
            twist *= 0.0  # tensors have squares of speeds, which are none below that
        state, wrench = ours.step(state, twist, load, dt)
        step = functools.partial(other.step, tensor, *arrays(name, twist, load, dt))
        tensor, force = judge(f"steps: {name}", step, compiles=True)
        got = plain((tensor, force))
        finite(tuple(got), f"a step of {name}")
        # The rate is a difference of speeds.
        damped = ours.law.numbers.sigma_1 * load * np.abs(twist).max()
        for mine, its, small in zip(
            (state, wrench), got, (1e-30, ROUNDING * damped), strict=True
        ):
            if np.abs(mine - its).max() > CLOSE * np.abs(mine).max() + small:
                raise Broken(
                    f"{type(ours).__name__} steps to {mine}, that of {name} to {its}"
                )
        tensor = arrays(name, state)[0]


def refuse(name: str, draw: random.Random) -> None:
    """A step with one argument that is wrong; what is not refused is right, and finite."""
    models = pair(name, draw)
    if models is None:
        return
    legal = dict(
        zip(
            ARGUMENTS,
            [models[0].rest(), np.array([0.01, 0.0, 1.0]), 2.0, 1e-3],
            strict=True,
        )
    )
    given = {key: arrays(name, value)[0] for key, value in legal.items()}
    changed = draw.choice(ARGUMENTS)
    kind = draw.choice(sorted({*nasty.WRONG, *NUMBERS}))
    given[changed] = nasty.NASTY[kind]()
    try:
        result = judge(
            f"steps: {name}, refused",
            lambda: models[1].step(**given),
            names=ARGUMENTS,
            compiles=True,
        )
        if result is not None:
            finite(tuple(plain(result)), f"a step of {name}")
            if kind in nasty.WRONG:
                raise Broken("is taken for numbers")
    except Broken as broken:
        raise Broken(
            f"{type(models[1]).__name__} of {name}, {changed} = {kind}: {broken}"
        ) from broken


@pytest.mark.torch
@attack("steps", 60)
def test_torch_walks(draw: random.Random) -> None:
    walk("torch", draw)


@pytest.mark.torch
@attack("steps", 60)
def test_torch_arguments(draw: random.Random) -> None:
    refuse("torch", draw)


@pytest.mark.jax
@attack("steps", 6)
def test_jax_walks(draw: random.Random) -> None:
    walk("jax", draw)


@pytest.mark.jax
@attack("steps", 8)
def test_jax_arguments(draw: random.Random) -> None:
    refuse("jax", draw)
