"""Derivatives of rollouts on patches whose shape follows the load: closed forms, and the end of the range."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from tests.support.contacts import HEAVY, TIP

METRIC = pf.friction_metric(0.6, along=0.5, across=1.0)

ELASTIC = pf.LuGre(mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.3))
LOADS = np.linspace(1.031, 3.063, 12)
DT, T, SIZES = 1e-4, len(LOADS), np.array([1.0, 1.0, 250.0])


def drive(model, seed=0):
    """A state, and twists that start, slide, spin and turn back."""
    random = np.random.default_rng(seed)
    return random.normal(size=model.state_shape) * 3e-7, np.cumsum(
        random.normal(size=(T, 3)), axis=0
    ) * 3e-3 * SIZES


def test_the_torque_of_a_slide_follows_the_centre_of_pressure():
    """`W = -mu f (1, 0, -y(f))` of a slide along x; y is linear in the load between two measured ones."""
    x, y = np.array([[0.01, -0.01, 0.0], [0.0, 0.002, 0.012]])
    shares = np.array([[0.6, 0.3, 0.1], [0.1, 0.3, 0.6]])
    feet = pf.ContactPatch.points(np.stack([x, y], 1))
    patch = pf.ContactPatch(
        feet.positions, feet.areas, pf.PressureMaps((1.0, 3.0), shares)
    )
    model = pf.DistributedModel(patch, pf.LuGre(mu_c=0.8, mu_s=0.8, sigma_2=0.0))
    load = 1.6
    bar = np.array([[0.0, 0.0, 1.0]])
    found = derivatives.rollout_vjp(model, None, [[0.01, 0.0, 0.0]], load, 1e6, bar)
    low, high = shares @ y
    centre = low + (load - 1.0) * (high - low) / 2.0
    slope = (high - low) / 2.0
    # slopes of the weights err by 1e-10
    assert float(found.normal_force) == pytest.approx(
        0.8 * (centre + load * slope), rel=1e-9
    )


@pytest.mark.parametrize("metric", [None, METRIC], ids=["isotropic", "grain"])
def test_a_shape_that_stays_as_it_is_has_the_gradient_of_a_fixed_patch(metric):
    measured = pf.ContactPatch.from_pressure(
        {0.5: HEAVY, 4.0: 2.0 * HEAVY}, cell_size=1e-3
    )
    fixed = pf.ContactPatch.from_pressure(HEAVY, cell_size=1e-3)
    if metric is not None:
        measured, fixed = (
            patch.with_friction_metric(metric) for patch in (measured, fixed)
        )
    changing, single = (
        pf.DistributedModel(patch, ELASTIC) for patch in (measured, fixed)
    )
    (state, twists) = drive(changing)
    random = np.random.default_rng(1)
    bars = (
        random.normal(size=(T, 3)) * SIZES,
        random.normal(size=changing.state_shape) * 1e6,
    )
    loads = LOADS.copy()
    loads[4] = 0.0
    found, wanted = (
        derivatives.rollout_vjp(m, state, twists, loads, DT, *bars)
        for m in (changing, single)
    )
    for got, want in zip(found, wanted, strict=True):
        # weights at another load differ by rounding, and so do their slopes: 1e-16 over the step of 1e-5
        assert got == pytest.approx(want, rel=1e-8, abs=1e-9 * np.abs(want).max())


def test_without_load_the_slope_is_the_wrench_per_newton_of_a_small_one():
    model = pf.DistributedModel(TIP, ELASTIC)
    state, twists = drive(model, 7)
    loads = LOADS.copy()
    loads[4] = 0.0
    bar = np.ones((T, 3)) * (np.arange(T) == 4)[:, None]
    found = derivatives.rollout_vjp(model, state, twists, loads, DT, bar)
    before = derivatives.rollout_states(model, state, twists, loads, DT).states[4]
    small = model.step(before, twists[4], 1e-6, DT)[1].sum() / 1e-6
    assert found.normal_force[4] == pytest.approx(small, rel=1e-9)
    assert not found.twist.any() and not found.normal_force[:4].any()
    alone = derivatives.rollout_vjp(model, before, twists[4:5], 0.0, DT, bar[4:5])
    assert float(alone.normal_force) == pytest.approx(small, rel=1e-9)


@pytest.mark.parametrize("loads", [(1.1, 2.1, 3.1), (2.1, 3.1, 1.1), (3.1, 1.1, 2.1)])
def test_a_rollout_can_begin_and_end_at_any_of_its_loads(loads):
    """The first and the last step are those of rollouts of one step, whose only load is theirs."""
    model = pf.DistributedModel(TIP, ELASTIC)
    state, twists = drive(model, 3)
    path = derivatives.rollout_states(model, state, twists[:3], loads, DT)
    first = derivatives.rollout(model, state, twists[:1], loads[0], DT)
    assert path.wrenches[0] == pytest.approx(first.wrenches[0], rel=1e-12)

    forward = derivatives.rollout_jacobian(model, state, twists[:3], loads, DT)
    alone = derivatives.rollout_jacobian(model, state, twists[:1], loads[0], DT)
    assert forward.d_wrenches[0] == pytest.approx(alone.d_wrenches[0], rel=1e-12)

    bar = np.zeros((3, 3))
    bar[2] = 1.0 / SIZES
    found = derivatives.rollout_vjp(model, state, twists[:3], loads, DT, bar)
    last = derivatives.rollout_vjp(
        model, path.states[2], twists[2:3], loads[2], DT, bar[2:]
    )
    assert found.twist[2] == pytest.approx(last.twist[0], rel=1e-12)
