"""The price of gradients: steps of the adjoint against those of the motion, in easy and in hard scenes."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import path, scene_gradient, scene_sensitivities
from planarfriction.errors import SolverError
from planarfriction.scenes import SolverOptions
from tests.support.refusals import refused

LOAD, MASS = 2.94, 0.3


def last_x(time, motion):
    """Return the derivative of the last x by the motion."""
    return np.pad([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]], ((len(motion) - 1, 0), (0, 0)))


def block(sigma_0, sigma_1, velocity=(0.0, 0.0, 0.0), force=None):
    law = pf.LuGre(
        mu_c=0.62, sigma_0=sigma_0, sigma_1=sigma_1, sigma_2=0.0, elasto_plastic=0.9
    )
    model = pf.ReducedModel(pf.ContactPatch.rectangle(0.03, 0.02), law)
    body = pf.Body(MASS, 1e-4, velocity=velocity, gravity=(0.0, 0.0))
    return pf.Scene(
        body, [pf.Contact(model, LOAD, mounted_on="body")], 1.0, force=force
    )


@pytest.fixture
def steps(monkeypatch):
    """Return a function that tells the steps of the adjoint since it was asked last."""
    taken = [0]
    propagate_back = path.adjoint.propagate_back

    def counted(*arguments):
        taken[0] += (done := propagate_back(*arguments))
        return done

    def since():
        count = taken[0]
        taken[0] = 0
        return count

    monkeypatch.setattr(path.adjoint, "propagate_back", counted)
    return since


def trials(scene):
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
    with refused("raise rtol, or use scene_sensitivities", SolverError):
        scene_gradient(
            scene,
            lambda _, motion: motion,
            ("mu",),
            options=SolverOptions(save_every=1e-3),
        )
