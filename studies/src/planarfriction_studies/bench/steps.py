"""Costs of a step: compiled, called from Python, of coupled contacts; and of limit surfaces."""

from __future__ import annotations

import importlib
import logging
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction.coupling import CoupledPatches, CoupledStep, HostStep
from planarfriction.derivatives import rollout
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch
from planarfriction.sliding_body import SlidingBody
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

FEET = ((0.05, 0.03), (0.05, -0.03), (-0.05, 0.03), (-0.05, -0.03))
"""Positions of the feet of a box [m]."""

SETTLING = 50
"""Steps after which a block is held."""

AT_ONCE = 150
"""Bodies of a batch that is stepped on one thread."""


def _loop(model: Any, twists: np.ndarray) -> Callable[[], Any]:
    """Return the steps of a model through `twists`, compiled."""
    return lambda: rollout(model, None, twists, 1.0, 1e-4)


def published_loop(full: bool) -> Measurement:
    """Measure a step of the published reduced model, in a compiled loop."""
    return _loop_beside_calls(ReducedModelPublished(disc(), law()), 20_000, 1000)


def distributed_loop(full: bool) -> Measurement:
    """Measure a step of the distributed model, in a compiled loop."""
    return _loop_beside_calls(DistributedModel(disc(), law()), 1000, 100)


def _loop_beside_calls(model: Any, steps: int, inner: int) -> Measurement:
    (loop,) = least(_loop(model, mixed_twists(steps)))
    call = _python_step(model, inner)
    return line(
        loop / steps * 1e6, "us", "one Python call of the same step", call * 1e6
    )


def _python_step(model: Any, inner: int) -> float:
    return least(_call(model), inner=inner)[0]


def _call(model: Any) -> Callable[[], Any]:
    """Return one Python call of a step."""
    state = model.rest()
    twist = (0.01, 0.0, 1.0)
    return lambda: model.step(state, twist, 1.0, 1e-3)


def published_call(full: bool) -> Measurement:
    """Measure a step of the published reduced model, from Python."""
    model = ReducedModelPublished(disc(), law())
    state = model.rest()
    twist = np.array([0.01, 0.0, 1.0])
    call, rate = least(_call(model), lambda: model.rate(state, twist, 1.0), inner=300)
    return line(call * 1e6, "us", "one Python call of rate", rate * 1e6)


def reduced_loop(full: bool, cells: int = ReducedModel.cells) -> Measurement:
    """Measure a step of `ReducedModel` in a compiled loop."""
    twists = mixed_twists(20_000)
    models = (
        ReducedModel(disc(), law(), cells=cells),
        ReducedModelPublished(disc(), law()),
    )
    ours, theirs = least(*(_loop(model, twists) for model in models))
    return line(
        ours / len(twists) * 1e6, "us", AGAINST_PUBLISHED, theirs / len(twists) * 1e6
    )


def reduced_call(full: bool) -> Measurement:
    """Measure a step of `ReducedModel`, from Python."""
    models = ReducedModel(disc(), law()), ReducedModelPublished(disc(), law())
    ours, theirs = least(*map(_call, models), inner=2000)
    return line(ours * 1e6, "us", AGAINST_PUBLISHED, theirs * 1e6)


def reduced_slopes(full: bool) -> Measurement:
    """Measure the derivatives of a step of `ReducedModel`, in one Python call."""
    model = ReducedModel(disc(), law())
    return _beside_a_step(
        model, lambda: model.step_jacobians(model.rest(), (0.01, 0.0, 1.0), 1.0, 1e-3)
    )


def reduced_four(full: bool) -> Measurement:
    """Measure the steps of four contacts, in one Python call."""
    model = ReducedModel(disc(), law())
    states = np.stack([model.rest()] * 4)
    twists = np.tile((0.01, 0.0, 1.0), (4, 1))
    loads = np.ones(4)
    return _beside_a_step(model, lambda: model.step(states, twists, loads, 1e-3))


def _beside_a_step(
    model: ReducedModel, action: Callable[[], Any], inner: int = 2000
) -> Measurement:
    ours, theirs = least(action, _call(model), inner=inner)
    return line(ours * 1e6, "us", "one Python call of step", theirs * 1e6)


def _block(slides: bool = False) -> tuple[SlidingBody, tuple[Any, ...]]:
    """Return a block that is held, or one that begins to slide and turn, with the inputs of its next step of 1 ms."""
    block = SlidingBody(0.2, 1e-5, ReducedModel(disc(), law()))
    twist = (0.1, 0.0, 3.0) if slides else (0.0, 0.0, 0.0)
    push = (2.3, 0.0, 1e-3) if slides else (1.5, 0.0, 0.0)
    end = block.step(block.rest(), twist, 2.0, 1e-3, push)
    for _ in range(0 if slides else SETTLING):
        end = block.step(end.state, end.twist, 2.0, 1e-3, push)
    return block, (end.state, end.twist, 2.0, 1e-3, push)


def body(full: bool, slides: bool = False) -> Measurement:
    """Measure an implicit step of 1 ms of a block that is held, or slides, in one Python call."""
    block, given = _block(slides)
    model: Any = block.models
    return _beside_a_step(model, lambda: block.step(*given), 500)


def body_overhead(full: bool) -> Measurement:
    """Measure what Python adds to a step of a block that is held, beside the step itself in a batch on one thread."""
    block, (state, *given) = _block()
    states = np.tile(state, (AT_ONCE, 1))
    whole, batch = least(
        lambda: block.step(state, *given), lambda: block.step(states, *given), inner=100
    )
    alone = batch / AT_ONCE
    words = f"the step itself, of one of {AT_ONCE} in a call"
    return line((whole - alone) * 1e6, "us", words, alone * 1e6)


def body_feet(full: bool, feet: int) -> Measurement:
    """Measure an implicit step of 1 ms of a body that slides and turns on feet, in one Python call."""
    model = ReducedModel(disc(), law())
    around = np.linspace(0.0, 2.0 * np.pi, feet, endpoint=False)
    places = 0.05 * np.stack([np.cos(around), np.sin(around)], axis=-1)
    box = SlidingBody(0.2, 1e-4, [model] * feet, places)
    loads = np.full(feet, 2.0 / feet)
    end = box.step(box.rest(), (0.05, 0.0, 1.0), loads, 1e-3)
    push = (0.3, 0.0, 0.0)
    return _beside_a_step(
        model, lambda: box.step(end.state, end.twist, loads, 1e-3, push), 100
    )


def short_rollout(full: bool) -> Measurement:
    """Measure a rollout of 20 steps in one Python call, as planners and filters make many of, beside 20 of step."""
    model = ReducedModel(disc(), law())
    ours, theirs = least(_loop(model, mixed_twists(20)), _call(model), inner=500)
    return line(ours * 1e6, "us", "20 Python calls of step", 20.0 * theirs * 1e6)


def coupled(full: bool, environments: int = 1) -> Measurement:
    """Measure an implicit step of a box that slides and turns on four feet, in one Python call for all environments."""
    model = ReducedModel(disc(), law())
    step = _four_feet(model, environments)
    value = median(step, 9, 1 + 500 // environments) / environments
    rounds = float(step().iterations.mean())
    words = f"one Python call of a model's step (four patches, {rounds:.1f} rounds)"
    return line(value * 1e6, "us per step", words, _python_step(model, 2000) * 1e6)


def _boxes(environments: int, dt: float) -> HostStep:
    """Return a step of boxes of 0.2 kg on four feet with random velocities, one per environment."""
    rows = np.concatenate(
        [[[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]] for x, y in FEET]
    )
    response = dt * rows @ np.diag([5.0, 5.0, 5e3]) @ rows.T
    velocity = np.random.default_rng(7).normal(size=(environments, 3)) * [
        0.05,
        0.05,
        0.5,
    ]
    return HostStep(
        (velocity @ rows.T).reshape(-1, 4, 3),
        np.full(4, 0.5),
        np.zeros((4, 3)),
        response,
    )


def _four_feet(
    model: ReducedModel, environments: int, dt: float = 1e-3
) -> Callable[[], CoupledStep]:
    """Return an implicit step of `_boxes` from bristles at rest."""
    patches = CoupledPatches([model] * 4)
    host = _boxes(environments, dt)
    return lambda: patches.step(patches.rest(), host, dt)


def table_build(full: bool) -> Measurement:
    """Measure the construction of the published table of 20 segments."""
    patch = disc()
    value = median(lambda: LimitSurfaceTablePublished(patch).numbers, 31)
    return line(
        value,
        "s",
        "the same nodes by NumPy, node by node",
        median(lambda: numpy_table(patch), 3),
    )


def twist(
    full: bool, kind: type[LimitSurface], count: int | None = None
) -> Measurement:
    """Measure the twist of a wrench, of an L that is a polygon: one a call, or `count` in a call."""
    corners = [
        (0.0, 0.0),
        (0.03, 0.0),
        (0.03, 0.005),
        (0.005, 0.005),
        (0.005, 0.02),
        (0.0, 0.02),
    ]
    surface = kind(ContactPatch.polygon(corners, 21))
    wrenches = np.random.default_rng(7).normal(size=(count or 1, 3)) * [1.0, 1.0, 0.01]
    asked = wrenches[0] if count is None else wrenches
    value = median(lambda: surface.twist(asked), 15, 1 if count else 500) / len(
        wrenches
    )
    theirs = median(lambda: scipy_twist(surface, wrenches[0]), 5)
    words = "SciPy (trust-exact) on the dissipation over the plane of unit power, one wrench"
    return line(value * 1e6, "us per wrench", words, theirs * 1e6)


def scipy_twist(surface: LimitSurface, wrench: np.ndarray) -> np.ndarray:
    """Compute `surface.twist(wrench)` as one would write it with the surface's dissipation, wrench and Jacobian."""
    from scipy import optimize

    scale = np.array([1.0, 1.0, surface.contact_radius])
    target = -wrench / scale
    start = target / (target @ target) / scale  # of unit power
    basis = np.linalg.svd(target[None])[2][1:] / scale
    solution = optimize.minimize(
        lambda place: float(surface.dissipation(start + place @ basis)),
        np.zeros(2),
        jac=lambda place: -basis @ surface.wrench(start + place @ basis),
        hess=lambda place: -basis @ surface.jacobian(start + place @ basis) @ basis.T,
        method="trust-exact",
        options={"gtol": 1e-10},
    )
    twist = start + solution.x @ basis
    return twist / surface.dissipation(twist)


def numpy_table(patch: ContactPatch, segments: int = 20) -> np.ndarray:
    """Return the smoothed nodes of the published table as one would write them: four sums over the cells at each."""
    grid = patch.grid
    radius = patch.contact_radius()
    weights = patch.weights()
    assert grid is not None
    x, y = (patch.positions - patch.centre_of_pressure()).T
    nodes = np.zeros((segments + 1, 4 * segments, 3))
    for i in range(segments):
        for j in range(4 * segments):
            azimuth = 0.5 * np.pi * j / segments
            distance = radius * np.tan(0.5 * np.pi * i / segments)
            centre = np.array([-distance * np.sin(azimuth), distance * np.cos(azimuth)])
            a, b = (centre - (grid.x_min, grid.y_min)) / (
                grid.cell_width,
                grid.cell_height,
            )
            for corner in range(4):
                p = int(a) + corner % 2
                q = int(b) + corner // 2
                share = (1.0 - abs(a - p)) * (1.0 - abs(b - q))
                dx = x - (grid.x_min + p * grid.cell_width)
                dy = y - (grid.y_min + q * grid.cell_height)
                scale = share * weights / np.hypot(dx, dy)
                nodes[i, j] += (
                    -(scale @ dy),
                    scale @ dx,
                    scale @ (x * dx + y * dy) / radius,
                )
    return nodes


def warp_step(
    full: bool, kind: type[ReducedModel] | type[ReducedModelPublished]
) -> Measurement:
    """Measure a step of 1000 contacts in a kernel of Warp, single precision, on Warp's CPU device.

    Raises MissingExtraError without Warp.
    """
    front: Any = importlib.import_module("planarfriction.warp")
    import warp as wp

    wp.config.log_level = logging.ERROR  # it reports what it compiles
    count = 1000
    model = kind(disc(), law())
    friction = front.Model(model, contacts=count, device="cpu")
    twists = mixed_twists(count)
    states = friction.rest()
    new = friction.rest()
    wrench = wp.zeros((count, 3), device="cpu")
    given = (
        wp.array(twists, dtype=wp.float32, device="cpu"),
        wp.full(count, 1.0, dtype=wp.float32, device="cpu"),
    )
    ours = median(lambda: friction.step(states, *given, 1e-3, new, wrench), 9, 10)
    rest = np.zeros((count, *model.state_shape))
    theirs = median(lambda: model.step(rest, twists, 1.0, 1e-3), 9, 10)
    words = "the same in one call of the compiled step, on all processors"
    return line(ours / count * 1e6, "us", words, theirs / count * 1e6)


def warp_coupled(full: bool) -> Measurement:
    """Measure an implicit step of 1000 boxes on four feet in a kernel of Warp, single precision, on its CPU device.

    Raises MissingExtraError without Warp.
    """
    front: Any = importlib.import_module("planarfriction.warp")
    import warp as wp

    wp.config.log_level = logging.ERROR  # it reports what it compiles
    count = 1000
    dt = 1e-3
    model = ReducedModel(disc(), law())
    friction = front.CoupledPatches([model] * 4, worlds=count, device="cpu")
    shapes = (count, 4, 3), (count, 4), (count, 4, 3), (count, 12, 12)
    given = zip(_boxes(count, dt)[:4], shapes, strict=True)
    arrays = [
        wp.array(np.broadcast_to(each, shape), dtype=wp.float32, device="cpu")
        for each, shape in given
    ]
    state = friction.rest()
    results = friction.results()
    host = HostStep(*arrays)
    ours = median(lambda: friction.step(state, host, dt, results), 9) / count
    theirs = median(_four_feet(model, count), 9) / count
    return line(
        ours * 1e6,
        "us",
        "the same in one call of the compiled step, on all processors",
        theirs * 1e6,
    )
