"""The price of gradients: steps of the adjoint against those of the motion, in easy and in hard scenes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import path, scene_gradient, scene_sensitivities
from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.errors import SolverError
from planarfriction.scenes import SolverOptions
from tests.derivatives.random_scenes import Example, example
from tests.derivatives.test_scene import MOTION

LOAD, MASS = 2.94, 0.3
STEP = 3.0
"""Price of a step of the adjoint in trials of the motion, which have six stages for five: 1.5 to 3 were measured."""


def last_x(time: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return the derivative of the last x by the motion."""
    return np.pad([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]], ((len(motion) - 1, 0), (0, 0)))


def block(
    sigma_0: float, sigma_1: float, velocity=(0.0, 0.0, 0.0), force=None
) -> pf.Scene:
    law = pf.LuGre(
        mu_c=0.62, sigma_0=sigma_0, sigma_1=sigma_1, sigma_2=0.0, elasto_plastic=0.9
    )
    model = pf.ReducedModel(pf.ContactPatch.rectangle(0.03, 0.02), law)
    body = pf.Body(MASS, 1e-4, velocity=velocity, gravity=(0.0, 0.0))
    return pf.Scene(
        body, [pf.Contact(model, LOAD, mounted_on="body")], 1.0, force=force
    )


@pytest.fixture
def steps(monkeypatch) -> Callable[[], int]:
    """Return a function that tells the steps of the adjoint since it was asked last."""
    taken = [0]
    propagate_back = path.adjoint.propagate_back

    def counted(*arguments):
        taken[0] += (done := propagate_back(*arguments))
        return done

    def since() -> int:
        count = taken[0]
        taken[0] = 0
        return count

    monkeypatch.setattr(path.adjoint, "propagate_back", counted)
    return since


def trials(scene: pf.Scene) -> int:
    """Return the trials of the motion at the tolerances of its derivatives."""
    statistics = pf.simulate(scene, rtol=path.RTOL, atol=path.RTOL).statistics
    return statistics.steps + statistics.rejections


def test_a_block_that_sticks_at_the_end_costs_no_steps_there(steps):
    """Where nothing depends on friction, the gain of the cost is rounding, which no step can resolve.

    Two million steps were taken here for six thousand of the motion.
    """
    t = np.linspace(0.0, 1.0, 101)
    push = np.stack(
        [1.4 * np.sin(6.0 * t) + 1.8 * t, 0.0 * t, 0.004 * np.cos(5.0 * t)], axis=1
    )
    scene = block(5e3, 50.0, force=pf.Signal(t, push, "linear"))
    found = scene_gradient(scene, last_x, ("mu",))
    assert steps() < trials(scene)
    assert found.gradient[0] == pytest.approx(
        scene_sensitivities(scene, ("mu",)).d_motion[-1, 3, 0], rel=1e-6
    )


def test_stiff_bristles_under_a_fast_body_cost_no_steps(steps):
    """`x(T) = v T - mu N T^2/(2 m)`, but for the spin, whose rim is 70 times slower: 1e-4 less friction.

    Ten steps were taken here for each of the motion.
    """
    scene = block(1e6, 0.0, velocity=(20.0, 0.0, 20.0))
    found = scene_gradient(scene, last_x, ("mu",))
    assert steps() < trials(scene)
    assert found.gradient[0] == pytest.approx(-0.62 * LOAD / (2.0 * MASS), rel=3e-4)


def test_a_gradient_that_needs_far_more_steps_than_its_motion_says_so(monkeypatch):
    """A cost that sees a thousand instants of a short motion, and an allowance for none of them."""
    monkeypatch.setattr(path, "ALLOWANCE", 1)
    monkeypatch.setattr(path, "PER_JUMP", 0)
    scene = block(5e3, 50.0, velocity=(8.0, 0.1, 1.0))
    with pytest.raises(SolverError, match="raise rtol, or use scene_sensitivities"):
        scene_gradient(
            scene,
            lambda _, motion: motion,
            ("mu",),
            options=SolverOptions(save_every=1e-3),
        )


class Measured(NamedTuple):
    """Price and errors of a gradient of a random scene."""

    told: str
    instants: int
    """Number of instants that the cost sees."""
    trials: int
    """Trials of steps of the motion."""
    steps: int
    """Steps of the adjoint."""
    clock: float
    """Processor time in runs of the scene."""
    forwards: float
    """Error against the product with the derivatives forwards, in shares of the sum of sizes of its terms.

    Sums below a thousandth of the sum for the cost itself count as that.
    """
    differences: float
    """Error of the change of the cost in a random direction against the nearest of central differences of three sizes,
    in the same shares.

    Between sticking and slipping, the cost bends within 1e-5 of its numbers; below 1e-6, some simulations are rough.
    """


def measured(seed: int, steps: Callable[[], int]) -> Measured:
    """Return price and errors of the gradient of a random scene."""
    made = example(seed)
    scene = made.scene
    numbers = made.numbers
    forwards = scene_sensitivities(scene, **numbers)
    motion, wrenches = made.cotangents(forwards.motion, forwards.wrenches)
    seen = int((motion.any(axis=1) | wrenches.any(axis=(1, 2))).sum())
    costs: dict[str, Any] = {
        "cotangent": lambda *_: motion,
        "wrench_cotangent": lambda *_: wrenches,
    }
    steps()
    begin = time.process_time()
    reverse = scene_gradient(scene, **costs, **numbers)
    middle = time.process_time()
    taken = steps()
    run = trials(scene)
    clock = (middle - begin) / (time.process_time() - middle)
    expected = np.einsum("mi,mip->p", motion, forwards.d_motion)
    expected += np.einsum("mci,mcip->p", wrenches, forwards.d_wrenches)
    size = np.einsum("mi,mip->p", np.abs(motion), np.abs(forwards.d_motion))
    size += np.einsum("mci,mcip->p", np.abs(wrenches), np.abs(forwards.d_wrenches))
    missed = np.abs(reverse.gradient - expected)
    least = 1e-3 * (
        np.abs(motion * forwards.motion).sum()
        + np.abs(wrenches * forwards.wrenches).sum()
    )
    error = max(
        missed[here].max() / max(size[here].max(), least)
        for here in reverse.columns.values()
    )

    function, values, way = in_a_direction(made)
    changes = []
    for h in (1e-4, 1e-5, 1e-7):
        moved = [function.run((values + sign * h * way)[None]) for sign in (1.0, -1.0)]
        last, first = (
            float((motion * m[0]).sum() + (wrenches * w[0]).sum()) for m, w in moved
        )
        changes.append((last - first) / (2.0 * h))
    off = np.abs(np.array(changes) - reverse.gradient @ way).min()
    return Measured(
        made.told,
        seen,
        run,
        taken,
        clock,
        error,
        float(off / max(size @ np.abs(way), least)),
    )


def in_a_direction(made: Example) -> tuple[SceneFunction, np.ndarray, np.ndarray]:
    """Return the scene as a function of its numbers, tightly simulated, their values and a random change of them."""
    body = made.scene.body
    load = made.scene.contacts[0].normal_force
    start = dict(zip(MOTION, (*body.velocity, *body.position, body.angle), strict=True))
    parameters = made.numbers["parameters"]
    initial = made.numbers["initial"]
    signals = made.numbers.get("signals", {})
    values = [1.0] * len(parameters) + [start[name] for name in initial]
    scale = [1.0] * len(parameters) + [max(abs(start[name]), 1e-3) for name in initial]
    for name in signals:
        signal = made.scene.force if name == "force" else load
        values += signal.values.ravel().tolist()
        scale += (
            np.broadcast_to(np.abs(signal.values).max(axis=0), signal.values.shape)
            .ravel()
            .tolist()
        )
    function = SceneFunction(
        made.scene, parameters, signals, initial, rtol=1e-10, atol=1e-10
    )
    return (
        function,
        np.array(values),
        np.array(scale) * np.random.default_rng(made.seed).normal(size=len(scale)),
    )


@pytest.mark.slow
def test_gradients_of_random_scenes_cost_few_runs(steps, capsys):
    """200 scenes, soft and stiff, that stick and slip and whose loads are hit: at most eight runs each.

    A jump of the adjoint, at an instant that the cost sees, is followed by a transient of the bristles, which takes up
    to 60 steps more.
    """
    found = [measured(seed, steps) for seed in range(200)]
    shares = {
        "runs, processor time": [each.clock for each in found],
        "runs, by steps": [1.0 + STEP * each.steps / each.trials for each in found],
        "runs, by steps, without transients": [
            1.0 + STEP * max(each.steps - 60 * each.instants, 0) / each.trials
            for each in found
        ],
        "against the derivatives forwards": [each.forwards for each in found],
        "against differences": [each.differences for each in found],
    }
    with capsys.disabled():
        for name, values in shares.items():
            print(
                f"\n{name}:",
                *(f"{q} % {np.percentile(values, q):.2g}," for q in (50, 90, 99, 100)),
                end="",
            )
    assert max(shares["runs, by steps, without transients"]) <= 8.0
    for errors in (
        shares["against the derivatives forwards"],
        shares["against differences"],
    ):
        # A slip that barely happens is more sensitive than differences tell.
        assert np.percentile(errors, 90) < 1e-4
        assert max(errors) < 5e-2
