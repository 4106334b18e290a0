"""Roll-outs of many contacts, or parts, abreast are those of one after the other."""

from __future__ import annotations

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from planarfriction.derivatives.parameters import pack_parts
from planarfriction.kernels.lanes import LANES, SLOTS
from planarfriction.patch import PUBLISHED_PATCHES

PATCH = PUBLISHED_PATCHES["NonConvex2"](cells=9)
ELASTIC = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9), sigma_2=0.3)
SMALL = {"segments": 6, "speeds": 6}
MODELS = {
    "plain": pf.ReducedModel(PATCH, pf.LuGre(mu_s=1.3, gamma=1.5), **SMALL),
    "elasto-plastic": pf.ReducedModel(PATCH, ELASTIC, **SMALL),
    "three parts": pf.ReducedModel(PATCH, ELASTIC, parts=3, **SMALL),
    "published": pf.ReducedModelPublished(PATCH, ELASTIC),
}
CLOSE = 1e-12
"""Largest difference of wrenches of 1 N and of gradients scaled to one: vector code sums in another order."""


@pytest.fixture(params=MODELS)
def model(request):
    return MODELS[request.param]


def runs(contacts: int, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Twists, loads and steps in time; every fifth contact leaves the ground now and then, or rests."""
    generator = np.random.default_rng(contacts + steps)
    twist = generator.normal(size=(contacts, steps, 3)) * [1.0, 1.0, 150.0]
    twist *= 10.0 ** generator.uniform(-5.0, -1.5, (contacts, steps, 1))
    loads = generator.uniform(0.5, 2.0, (contacts, steps))
    loads[::5, 1::3], twist[::5, 2::4] = 0.0, 0.0
    return twist, loads, generator.uniform(1e-5, 1e-3, steps)


def close(ours, theirs) -> None:
    scale = np.abs(theirs).max() or 1.0
    np.testing.assert_allclose(ours / scale, theirs / scale, rtol=CLOSE, atol=CLOSE)


@pytest.mark.parametrize("contacts", [1, LANES - 1, LANES, 2 * LANES + 3])
def test_contacts_abreast_take_the_steps_of_the_model(model, contacts):
    twist, loads, dt = runs(contacts, 30)
    ours, state = derivatives.rollout_states(model, None, twist, loads, dt), np.zeros((contacts, *model.state_shape))
    for t in range(30):
        close(ours.states[:, t], state)
        state, wrench = model.step(state, twist[:, t], loads[:, t], dt[t])
        close(ours.wrenches[:, t], wrench)
    close(ours.state, state)


@pytest.mark.parametrize("steps", [0, 1, SLOTS // LANES, SLOTS - 1, SLOTS, SLOTS + 1])
def test_any_number_of_steps_fills_the_chunks(model, steps):
    twist, loads, dt = runs(2, steps)
    ours = derivatives.rollout(model, None, twist, loads, dt)
    for b in range(2):
        state = model.rest()
        for t in range(steps):
            state, wrench = model.step(state, twist[b, t], loads[b, t], dt[t])
            close(ours.wrenches[b, t], wrench)
        close(ours.state[b], state)


@pytest.mark.parametrize(("contacts", "steps"), [(LANES - 1, 40), (LANES, SLOTS // LANES), (LANES + 1, 40), (3, SLOTS)])
def test_gradients_abreast_are_those_of_each_alone(model, contacts, steps):
    twist, loads, dt = runs(contacts, steps)
    generator = np.random.default_rng(1)
    pulls, last = generator.normal(size=twist.shape), generator.normal(size=(contacts, *model.state_shape))
    start = 1e-7 * generator.normal(size=last.shape)
    own = np.tile(derivatives.parameters_of(model), (contacts, 1)) * generator.uniform(0.9, 1.0, (contacts, 1))
    ours = derivatives.rollout_vjp(model, start, twist, loads, dt, pulls, last, parameters=own)
    for b in range(contacts):
        alone = derivatives.rollout_vjp(model, start[b], twist[b], loads[b], dt, pulls[b], last[b], parameters=own[b])
        # what is left of the first state after all steps may be nothing beside the stiffness that it acts through
        np.testing.assert_allclose(ours.state[b], alone.state, rtol=1e-12, atol=1e-12 * model.law.sigma_0)
        for one, other in zip(ours[1:], alone[1:], strict=True):
            close(one[b], other)


def test_threads_share_contacts_and_parts(model, monkeypatch):
    twist, loads, dt = runs(21, 50)
    whole = derivatives.rollout(model, None, twist, loads, dt)
    gradient = derivatives.rollout_vjp(model, None, twist, loads, dt, whole.wrenches)
    monkeypatch.setattr("planarfriction.derivatives.inputs.WORTH_A_THREAD", 100)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: range(5), raising=False)
    shared = derivatives.rollout(model, None, twist, loads, dt)
    close(shared.wrenches, whole.wrenches)
    for one, other in zip(
        derivatives.rollout_vjp(model, None, twist, loads, dt, whole.wrenches), gradient, strict=True
    ):
        close(one, other)


def test_parts_abreast_are_the_sum_of_models_of_one_part():
    twist, loads, dt = runs(LANES // 2 + 1, 40)
    model = MODELS["three parts"]
    ours = derivatives.rollout_states(model, None, twist, loads, dt)
    total = np.zeros_like(twist)
    for k, part in enumerate(model.reduction.parts_at(None)):
        packed = pack_parts(model.law.numbers, [(1.0, part.shape)])
        one = derivatives.rollout_states(packed, None, twist, loads, dt)
        close(ours.states[..., k, :], one.states)
        total += part.share * one.wrenches
    close(ours.wrenches, total)


@pytest.mark.parametrize("surface", [pf.LimitSurfaceCells, pf.LimitSurfaceTable, pf.LimitSurfaceTablePublished])
def test_twists_whose_squares_leave_the_range_of_numbers_are_rest(surface):
    generator, model = np.random.default_rng(0), pf.ReducedModelPublished(PATCH, ELASTIC, surface=surface(PATCH))
    twist = 10.0 ** generator.uniform(-163.0, -160.0, (1000, 1, 1)) * generator.normal(size=(1000, 1, 3)) * [1, 1, 150]
    start = generator.normal(size=(1000, 3)) * [1e-7, 1e-7, 1e-9]
    ours, still = (derivatives.rollout(model, start, each, 1.0, 1e-3) for each in (twist, 0.0 * twist))
    np.testing.assert_array_equal(ours.wrenches, still.wrenches)
    for each in derivatives.rollout_vjp(model, start, twist, 1.0, 1e-3, np.ones((1, 3))):
        assert np.isfinite(each).all()
