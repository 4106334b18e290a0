"""The step in contact space with pads."""

import numpy as np
import pytest

from planarfriction.coupling import CoupledPatches, HostStep
from planarfriction.laws import LuGre
from planarfriction.models import DistributedModel
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch

_GRID = ContactPatch.disc(0.02, cells=4)
DISCS = ContactPatch(
    _GRID.positions, _GRID.areas, _GRID.weights(), radii=np.full(_GRID.cells, 0.005)
)


def _patches(reference, sigma_0=1e6, pad=None):
    """Return two patches on pads with the stiffness at a load, or the second one on another pad."""
    law = LuGre(mu_s=1.2, sigma_0=sigma_0, sigma_1=0.0, elasto_plastic=0.9)
    of_load = reference and Pad.at_load(reference)
    models = [
        DistributedModel(_GRID, law, pad=of_load),
        DistributedModel(DISCS, law, pad=pad or of_load),
    ]
    return CoupledPatches(models)


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
    """Within the tolerance of 1e-9 m/s over the host's response of 0.01 m/(N s)."""
    fixed = _patches(1.0)
    published = _patches(None, 1e6 / load)
    z = fixed.rest()
    y = published.rest()
    for seed in range(10):
        one = fixed.step(z, _host(seed, load), 1e-3)
        other = published.step(y, _host(seed, load), 1e-3)
        np.testing.assert_allclose(one.wrench, other.wrench, rtol=0.0, atol=2e-7)
        assert one.converged and other.converged
        z = one.state
        y = other.state


@pytest.mark.parametrize("pad", [None, Pad.measured(1e6), Pad.measured(1e6, 0.6)])
def test_wrenches_are_those_of_the_models_while_loads_follow_them(pad):
    patches = _patches(1.0, pad=pad)
    z = patches.rest()
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
    assert taken < 250


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


RADIUS, SHEAR_MODULUS = 0.01, 1e6
HERTZ = ContactPatch.disc(
    RADIUS, 21, pressure=lambda x, y: max(1.0 - (x * x + y * y) / RADIUS**2, 0.0) ** 0.5
)


def _held_at_last(pull, least):
    """Return the shifts [m] of a half-space and of a layer of 1 mm whose load is 1 N and falls to `least` at times.

    Those under the least load: what slipped then does not come back (Cattaneo 1938; a layer: `F = 1.5 x - x^3/2`).
    """
    share = pull / least
    half_space = 3.0 * (2.0 - 0.42) * least / (16.0 * SHEAR_MODULUS * RADIUS)
    (x,) = (r.real for r in np.roots([-0.5, 0.0, 1.5, -share]) if 0.0 <= r.real <= 1.0)
    layer = 1.5 * least * 1e-3 / (SHEAR_MODULUS * np.pi * RADIUS**2)
    return half_space * (1.0 - (1.0 - share) ** (2.0 / 3.0)), layer * x


@pytest.mark.parametrize(
    ("pad", "which"),
    [
        (Pad.half_space(SHEAR_MODULUS, 0.42), 0),
        (Pad.layer(SHEAR_MODULUS, 1e-3), 1),
        (Pad.measured(1e5, 0.4), None),
    ],
)
def test_a_pull_under_a_load_that_oscillates_comes_to_rest(pad, which):
    law = LuGre(mu_c=1.0, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
    patches = CoupledPatches([DistributedModel(HERTZ, law, pad=pad)])
    dt = 5e-3
    response = np.diag([dt / 0.1, dt / 0.1, dt / 1e-5])  # of 0.1 kg, 1e-5 kg m^2
    pull = np.array([[0.6, 0.0, 0.0]])
    z = patches.rest()
    twist = np.zeros((1, 3))
    wrench = np.zeros((1, 3))
    place = [0.0]
    for time in dt * np.arange(1, 1201):
        load = np.array([1.0 + 0.3 * np.sin(4.0 * np.pi * time)])
        free = twist + (min(1.0, time / 0.2) * pull + wrench) @ response
        z, wrench, twist, *_ = patches.step(
            z, HostStep(free, load, wrench, response), dt
        )
        place.append(place[-1] + dt * twist[0, 0])
    assert np.ptp(place[800:]) < 1e-15
    if which is not None:
        assert place[-1] == pytest.approx(_held_at_last(0.6, 0.7)[which], rel=0.015)


def test_pressures_follow_moments():
    """The wrenches are those of the models' steps under the same moments."""
    patches = _patches(1.0, pad=Pad.measured(1e6, 0.6))
    z = patches.rest()
    moments = np.array([[2e-3, -1e-3], [-1e-3, 4e-3]])
    for seed in range(5):
        host = _host(seed)._replace(moments=moments)
        done = patches.step(z, host, 1e-3)
        for k, (model, state) in enumerate(
            zip(patches.models, patches.states(z), strict=True)
        ):
            given = done.twist[k], done.normal_force[k], 1e-3
            _, pull = model.step(state, *given, moments=moments[k])
            np.testing.assert_allclose(done.wrench[k], pull, rtol=1e-6, atol=1e-9)
        z = done.state


@pytest.mark.parametrize(
    "pad", [Pad.layer(SHEAR_MODULUS, 1e-3), Pad.measured(1e5, 0.4)]
)
def test_a_pad_that_sticks_is_solved_without_slopes(pad):
    """Where none can be had, steps are the same, in as many iterations: the stiffness of a pad that sticks is known."""
    law = LuGre(mu_c=1.0, sigma_1=0.0, elasto_plastic=0.9)
    patches, without = (
        CoupledPatches([DistributedModel(HERTZ, law, pad=pad)]) for _ in range(2)
    )
    record = without._packed.patches.record
    record.slopes[:] = record.steps
    response = np.diag([0.05, 0.05, 500.0])
    z = patches.rest()
    twist = np.zeros((1, 3))
    for i in range(50):
        pull = 1e-3 * np.array([[np.sin(0.1 * i), 0.3, 1e-3 * np.cos(0.1 * i)]])
        host = HostStep(twist + pull @ response, [3.0], np.zeros((1, 3)), response)
        done = patches.step(z, host, 1e-3)
        blind = without.step(z, host, 1e-3)
        assert done.converged and blind.converged and done.iterations <= 3
        np.testing.assert_array_equal(blind.state, done.state)
        z = done.state
        twist = done.twist
    assert np.abs(z).max() > 1e-9
