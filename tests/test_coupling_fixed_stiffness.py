"""The step in contact space with patches whose stiffness does not grow with the load."""

import dataclasses

import numpy as np
import pytest

from planarfriction.coupling import CoupledPatches, HostStep
from planarfriction.laws import LuGre
from planarfriction.models import DistributedModel
from planarfriction.patch import ContactPatch
from tests.support.refusals import refused

_GRID = ContactPatch.disc(0.02, cells=4)
DISCS = ContactPatch(
    _GRID.positions, _GRID.areas, _GRID.weights(), radii=np.full(_GRID.cells, 0.005)
)
LEANING = dataclasses.replace(DISCS, asymmetry=(0.3, -0.2))


def _patches(reference, sigma_0=1e6, second=DISCS):
    law = LuGre(mu_s=1.2, sigma_0=sigma_0, elasto_plastic=0.9, reference_load=reference)
    return CoupledPatches([DistributedModel(_GRID, law), DistributedModel(second, law)])


def _host(seed, load=None, response=0.0):
    rng = np.random.default_rng(seed)
    twist = rng.normal(size=(2, 3)) * [3e-3, 3e-3, 0.1]
    loads = rng.uniform(0.5, 3.0, 2) if load is None else np.full(2, load)
    by_load = response * rng.normal(size=(2, 6)) * np.tile([1.0, 1.0, 30.0], 2)
    return HostStep(
        twist, loads, np.zeros((2, 3)), np.diag(np.tile([0.01, 0.01, 20.0], 2)), by_load
    )


@pytest.mark.parametrize("load", [1.0, 2.5])
def test_at_a_held_load_it_is_a_law_of_another_sigma_0(load):
    fixed = _patches(1.0)
    published = _patches(None, 1e6 / load)
    z = fixed.rest()
    y = published.rest()
    for seed in range(10):
        one = fixed.step(z, _host(seed, load), 1e-3)
        other = published.step(y, _host(seed, load), 1e-3)
        np.testing.assert_allclose(one.wrench, other.wrench, rtol=1e-7, atol=1e-9)
        assert one.converged and one.iterations == other.iterations
        z = one.state
        y = other.state


@pytest.mark.parametrize("second", [DISCS, LEANING], ids=["discs", "leaning discs"])
def test_wrenches_are_those_of_the_models_while_loads_follow_them(second):
    patches = _patches(1.0, second=second)
    z = _patches(1.0).rest()
    moved = 0.0
    for seed in range(30):
        host = _host(seed, response=0.3)
        done = patches.step(z, host, 1e-3)
        assert done.converged and done.iterations <= 12
        for k, (model, state) in enumerate(
            zip(patches.models, patches.states(z), strict=True)
        ):
            new, pull = model.step(state, done.twist[k], done.normal_force[k], 1e-3)
            # Near a kink the last loads differ by the tolerance.
            rtol = 1e-12 if done.iterations < 8 else 1e-6
            np.testing.assert_allclose(done.wrench[k], pull, rtol=rtol, atol=1e-13)
            np.testing.assert_allclose(
                patches.states(done.state)[k], new, rtol=rtol, atol=1e-6 * rtol
            )
        loads = np.maximum(
            host.normal_force + host.load_response @ done.wrench.ravel(), 0.0
        )
        np.testing.assert_allclose(done.normal_force, loads, rtol=0.0, atol=1e-6)
        moved = max(moved, np.abs(loads - host.normal_force).max())
        z = done.state
    assert moved > 0.1


def test_newton_knows_how_wrenches_follow_their_loads():
    """With the slopes of the published law it takes 268 iterations."""
    patches = _patches(1.0)
    z = _patches(1.0).rest()
    taken = 0
    for seed in range(60):
        done = patches.step(z, _host(seed, response=1.0), 1e-3)
        assert done.converged
        z = done.state
        taken = taken + int(done.iterations)
    assert taken < 230


def test_a_held_body_keeps_its_force_under_a_load_that_oscillates():
    """The published law lets it swing."""
    for reference in (1.0, None):
        patches = _patches(reference)
        z = patches.rest()
        twist = np.zeros((2, 3))
        wrench = np.zeros((2, 3))
        forces = []
        place = [0.0]
        pull = np.tile([0.5, 0.1, 0.0], (2, 1))
        response = np.diag(np.tile([0.01, 0.01, 20.0], 2))
        for i in range(400):
            load = 1.0 + 0.3 * np.sin(0.1 * i)
            free = twist + np.array([0.01, 0.01, 20.0]) * (pull + wrench)
            done = patches.step(
                z, HostStep(free, np.full(2, load), wrench, response), 1e-3
            )
            z = done.state
            twist = done.twist
            wrench = done.wrench
            forces.append(wrench.copy())
            place.append(place[-1] + 1e-3 * twist[0, 0])
        np.testing.assert_allclose(forces[-1], -pull, atol=1e-4 if reference else 1e-1)
        swing = np.ptp(place[200:])
        assert swing < 1e-11 if reference else swing > 1e-7


def test_moments_are_refused():
    host = _host(0)._replace(moments=np.zeros((2, 2)))
    with refused("moments must be None for a law with a reference_load"):
        _patches(1.0).step(_patches(1.0).rest(), host, 1e-3)
