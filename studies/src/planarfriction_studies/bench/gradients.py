"""Costs of derivatives of rollouts and scenes."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction import derivatives
from planarfriction.models import ReducedModel, ReducedModelPublished
from planarfriction.scenes import Scene, Signal, SolverOptions, in_hand, simulate
from planarfriction_studies.bench.measurement import (
    AGAINST_PUBLISHED,
    Measurement,
    disc,
    law,
    least,
    line,
    median,
    mixed_twists,
)

STEPS = 2000
"""Steps of the single rollout."""

TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-9}
OPTIONS = SolverOptions(**TIGHT)
"""Tolerances of the scenes."""

KNOTS = np.linspace(0.0, 0.5, 20)
"""Times of the grip that derivatives are taken to [s]."""

SIGNALS = {"fingers.normal_force": KNOTS}


def reduced(full: bool) -> Measurement:
    """Measure a rollout with its gradient, as `gradient.published`."""
    models = ReducedModel(disc(), law()), ReducedModelPublished(disc(), law())
    ours, theirs = least(*(_both(model, (STEPS,)) for model in models))
    return line(ours, "s", AGAINST_PUBLISHED, theirs)


def short(full: bool) -> Measurement:
    """Measure a rollout of 20 steps with its gradient, beside the rollout alone."""
    model = ReducedModel(disc(), law())
    ours, theirs = least(_both(model, (20,)), _value(model, (20,)), inner=300)
    return line(ours * 1e6, "us", "the same rollout alone", theirs * 1e6)


def _both(
    model: ReducedModel | ReducedModelPublished, shape: tuple[int, ...]
) -> Callable[[], None]:
    """Return half the squared wrenches of rollouts with their gradient to all inputs; steps are the last axis."""
    inputs = model.rest(), *_inputs(shape)

    def value_and_gradient() -> None:
        _, wrenches, states = derivatives.rollout_states(model, *inputs)
        derivatives.rollout_vjp(model, *inputs, wrenches, states=states)

    return value_and_gradient


def _value(
    model: ReducedModel | ReducedModelPublished, shape: tuple[int, ...]
) -> Callable[[], Any]:
    """Return the rollouts alone."""
    inputs = model.rest(), *_inputs(shape)
    return lambda: derivatives.rollout(model, *inputs)


def _inputs(shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, float]:
    """Return twists, loads [N] and time step [s]."""
    return mixed_twists(math.prod(shape)).reshape(*shape, 3), np.full(shape, 2.0), 1e-4


def published(full: bool) -> Measurement:
    """Measure half the squared wrenches of a rollout, with their gradient to parameters, twists, loads and state."""
    model = ReducedModelPublished(disc(), law())
    (value,) = least(_both(model, (STEPS,)), repeats=15)
    try:
        return line(
            value, "s", "PyTorch, eager, the same rollout", _eager_gradient(model, full)
        )
    except ImportError:
        inputs = len(derivatives.PARAMETERS) + 3 + 4 * STEPS
        (once,) = least(_value(model, (STEPS,)), repeats=15)
        words = f"central differences, 2 x {inputs} rollouts of {once * 1e3:.2g} ms (PyTorch is not installed)"
        return line(value, "s", words, 2 * inputs * once)


def _eager_gradient(model: ReducedModelPublished, full: bool) -> float:
    """Measure the time of the same value and gradient, step by step through `planarfriction.torch` and autograd [s]."""
    import torch

    front = importlib.import_module("planarfriction.torch")
    module = front.ReducedModelPublished(model.patch, model.law, dtype=torch.float64)
    twists, loads, dt = _inputs((STEPS,))
    profile, loads = (
        torch.tensor(each, requires_grad=True) for each in (twists, loads)
    )

    def value_and_gradient() -> None:
        start = torch.zeros(3, dtype=torch.float64, requires_grad=True)
        wrenches = front.rollout(
            module, start, profile, loads, dt, method="eager"
        ).wrenches
        (0.5 * wrenches * wrenches).sum().backward()

    return median(value_and_gradient, 3 if full else 1)


def published_batch(full: bool) -> Measurement:
    """Measure a thousand rollouts with their gradient beside the rollouts alone."""
    both, once = _batch(ReducedModelPublished(disc(), law()))
    words = "the rollout alone (the ratio is the share of its speed)"
    return line(both, "million contact-steps/s", words, once, both / once)


def reduced_batch(full: bool) -> Measurement:
    """Measure 1000 rollouts with their gradient, as `gradient.published.batch`; fewer steps of them are kept."""
    models = ReducedModel(disc(), law()), ReducedModelPublished(disc(), law())
    (both, once), (theirs, alone) = (_batch(model, 250) for model in models)
    words = f"{AGAINST_PUBLISHED} (the rollouts alone: {once:.3g} and {alone:.3g})"
    return line(both, "million contact-steps/s", words, theirs, both / theirs)


def reduced_batch_alone(full: bool) -> Measurement:
    """Measure 1000 rollouts."""
    shape = 1000, 250
    models = ReducedModel(disc(), law()), ReducedModelPublished(disc(), law())
    ours, theirs = (
        1e-6 * math.prod(shape) / median(_value(model, shape), 5) for model in models
    )
    return line(
        ours, "million contact-steps/s", AGAINST_PUBLISHED, theirs, ours / theirs
    )


def _batch(
    model: ReducedModel | ReducedModelPublished, count: int = 1000
) -> tuple[float, float]:
    """Return millions of contact-steps per second of a thousand rollouts with their gradient, and of these alone."""
    shape = 1000, count
    steps = 1e-6 * math.prod(shape)
    return steps / median(_both(model, shape), 5), steps / median(
        _value(model, shape), 5
    )


def scene_to_friction(full: bool) -> Measurement:
    """Measure derivatives of the motion of a scene to the friction."""
    return _beside_simulation(
        in_hand(ReducedModel(disc(), law()), t_end=0.5),
        lambda scene: derivatives.scene_sensitivities(scene, ("mu",), options=OPTIONS),
    )


def scene_to_knots(full: bool) -> Measurement:
    """Measure derivatives of the motion of a scene to twenty knots of the grip."""
    return _beside_simulation(
        _gripped(),
        lambda scene: derivatives.scene_sensitivities(
            scene, (), signals=SIGNALS, options=OPTIONS
        ),
    )


def cost_to_knots(full: bool) -> Measurement:
    """Measure derivatives of one cost to twenty knots of the grip."""
    everything = lambda _, motion: np.ones_like(motion)
    gradient = lambda scene: derivatives.scene_gradient(
        scene, everything, signals=SIGNALS, options=OPTIONS
    )
    return _beside_simulation(_gripped(), gradient)


def _gripped() -> Scene:
    """Return the in-hand scene with a grip of twenty knots."""
    grip = Signal(KNOTS, 1.73 - 0.91 * np.sin(4.0 * np.pi * KNOTS), "linear")
    return in_hand(ReducedModel(disc(), law()), normal_force=grip, t_end=0.5)


def _beside_simulation(
    scene: Scene, derivatives: Callable[[Scene], Any]
) -> Measurement:
    alone = median(lambda: simulate(scene, **TIGHT), 3)
    return line(
        median(lambda: derivatives(scene), 3), "s", "the same simulation alone", alone
    )
