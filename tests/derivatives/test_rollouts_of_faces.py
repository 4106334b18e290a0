"""Rollouts of pads with a common compliance, and their derivatives against differences."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import (
    RolloutTangent,
    parameter_names,
    rollout,
    rollout_jacobian,
    rollout_jvp,
    rollout_states,
    rollout_vjp,
)
from tests.support.refusals import refused

LAW = pf.LuGre(mu_c=0.8, mu_s=1.0, sigma_1=0.0, v_s=2e-2, elasto_plastic=0.9)
PATCH = pf.ContactPatch.rectangle(0.02, cells=7)
PAD = pf.Pad.measured(4e3, 0.4)
DT = 5e-3
STEPS = 7
LEVER = np.array([1.0, 1.0, 0.01])


@pytest.fixture(scope="module")
def model():
    return pf.ReducedModel(PATCH, LAW, cells=9, pad=PAD)


@pytest.fixture(scope="module")
def inputs(model):
    """A state in which some pieces slip, twists and loads of two contacts."""
    rng = np.random.default_rng(7)
    state = model.rest(2)
    for twist in rng.normal(size=(4, 2, 3)):
        state, _ = model.step(state, 8e-2 * twist / LEVER, 3.0, DT)
    twists = 5e-2 * rng.normal(size=(2, STEPS, 3)) / LEVER
    return state, twists, rng.uniform(2.0, 4.0, (2, STEPS))


def test_a_rollout_is_its_steps(model, inputs):
    state, twists, loads = inputs
    found = rollout_states(model, *inputs, DT)
    for t in range(STEPS):
        np.testing.assert_array_equal(found.states[:, t], state)
        state, wrench = model.step(state, twists[:, t], loads[:, t], DT)
        np.testing.assert_array_equal(found.wrenches[:, t], wrench)
    np.testing.assert_array_equal(found.state, state)
    np.testing.assert_array_equal(rollout(model, *inputs, DT).wrenches, found.wrenches)


def _change(model, inputs, tangent, size):
    """Return the change of a rollout along a tangent by central differences."""
    names = parameter_names(model)

    def at(far):
        numbers = dict(zip(names, far * tangent.parameters, strict=True))
        ratio = LAW.numbers.breakaway_ratio + numbers.pop("breakaway_ratio")
        law = dataclasses.replace(
            LAW,
            elasto_plastic=ratio,
            **{name: getattr(LAW, name) + by for name, by in numbers.items()},
        )
        moved = [a + far * b for a, b in zip(inputs, tangent, strict=False)]
        end = rollout(model.with_law(law), *moved, DT)
        return np.concatenate([end.state.ravel(), end.wrenches.ravel()])

    return (at(size) - at(-size)) / (2.0 * size)


@pytest.fixture(scope="module")
def tangent(model, inputs):
    """Changes of all inputs and numbers of the law but sigma_1, which is 0."""
    rng = np.random.default_rng(8)
    sizes = np.array([getattr(LAW.numbers, name) for name in parameter_names(model)])
    return RolloutTangent(
        1e-6 * rng.normal(size=inputs[0].shape),
        1e-2 * rng.normal(size=inputs[1].shape) / LEVER,
        rng.normal(size=inputs[2].shape),
        0.1 * sizes * rng.normal(size=len(sizes)),
    )


def test_changes_are_differences(model, inputs, tangent):
    found = rollout_jvp(model, *inputs, DT, tangent)
    got = np.concatenate([found.state_dot.ravel(), found.wrenches_dot.ravel()])
    wanted = _change(model, inputs, tangent, 1e-5)
    n = found.state_dot.size
    for part in (slice(n), slice(n, None)):
        size = np.abs(wanted[part]).max()
        np.testing.assert_allclose(got[part], wanted[part], rtol=0.0, atol=1e-6 * size)


def test_gradients_are_those_changes(model, inputs, tangent):
    rng = np.random.default_rng(9)
    changed = rollout_jvp(model, *inputs, DT, tangent)
    bars = rng.normal(size=changed.wrenches.shape)
    state_bar = 1e4 * rng.normal(size=changed.state.shape)
    found = rollout_vjp(model, *inputs, DT, bars, state_bar)
    along = sum((a * b).sum() for a, b in zip(found, tangent, strict=True))
    wanted = (bars * changed.wrenches_dot).sum() + (state_bar * changed.state_dot).sum()
    assert along == pytest.approx(wanted, rel=1e-9)


def test_jacobians_are_the_columns_of_changes(model, inputs):
    names = "mu_c", "sigma_0", "v_s"
    found = rollout_jacobian(model, *inputs, DT, names).d_wrenches
    assert not found[..., 1].any()
    for k in (0, 2):
        unit = np.eye(8)[parameter_names(model).index(names[k])]
        wanted = rollout_jvp(model, *inputs, DT, RolloutTangent(parameters=unit))
        np.testing.assert_allclose(found[..., k], wanted.wrenches_dot, rtol=1e-12)


def test_without_load_a_step_forgets(model, inputs):
    state, twists, loads = inputs
    loads = loads.copy()
    loads[:, 2] = 0.0
    bars = np.ones((2, STEPS, 3))
    found = rollout_vjp(model, state, twists, loads, DT, bars)
    before = rollout_vjp(model, state, twists[:, :2], loads[:, :2], DT, bars[:, :2])
    np.testing.assert_allclose(found.state, before.state, rtol=1e-12)
    assert np.isfinite(found.normal_force).all() and not found.twist[:, 2].any()


def test_other_parameters_are_refused(model, inputs):
    with refused("parameters must be None for a pad with a common compliance"):
        rollout(model, *inputs, DT, parameters=np.ones(8))
