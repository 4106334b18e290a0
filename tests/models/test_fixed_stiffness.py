"""Stiffness that does not grow with the load: closed forms, passivity, projection, and derivatives."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planarfriction.derivatives import (
    RolloutTangent,
    parameters_of,
    rollout_jacobian,
    rollout_jvp,
    rollout_vjp,
)
from planarfriction.laws import CoulombStribeck, Dahl, LuGre
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch
from tests.support.refusals import refused

REFERENCE = 2.0
LEAN = (0.3, -0.2)
METRIC = np.array([[1.3, 0.2], [0.2, 0.8]])
_DISC = ContactPatch.disc(0.02, cells=5)


def _patch(radius, metric, asymmetry=None):
    directions = {
        "metric": metric,
        "asymmetry": asymmetry,
        "radii": np.full(_DISC.cells, radius),
    }
    return ContactPatch(_DISC.positions, _DISC.areas, _DISC.weights(), **directions)


PATCHES = {
    "points": _patch(0.0, None), "turned points": _patch(0.0, METRIC),
    "discs": _patch(0.004, None), "turned discs": _patch(0.004, METRIC),
    "leaning points": _patch(0.0, METRIC, LEAN), "leaning discs": _patch(0.004, None, LEAN),
}  # fmt: skip
LAWS = {
    "lugre": (LuGre, {"mu_s": 1.3}),
    "elasto-plastic": (LuGre, {"mu_s": 1.3, "elasto_plastic": 0.9}),
    "dahl": (Dahl, {}),
}  # fmt: skip


def _within_limits(patch, given):
    """Return numbers of a law whose published steps never leave the limit at rest.

    Elasto-plastic bristles that lean do, by up to 0.12 |a| of it when they stop and turn back, where mu_s > mu_c.
    """
    return (
        {**given, "mu_s": 1.0}
        if patch.asymmetric and "elasto_plastic" in given
        else given
    )


every_patch = pytest.mark.parametrize("patch", PATCHES.values(), ids=PATCHES)
every_law = pytest.mark.parametrize(("kind", "given"), LAWS.values(), ids=LAWS)


def _twists(seed, count=40):
    rng = np.random.default_rng(seed)
    return (
        rng.normal(size=(count, 3))
        * 10.0 ** rng.uniform(-5.0, -2.0, (count, 1))
        * [1.0, 1.0, 50.0]
    )


@every_patch
@every_law
@pytest.mark.parametrize("load", [REFERENCE, 3.0, 0.4])
def test_at_a_held_load_it_is_a_law_of_another_sigma_0(patch, kind, given, load):
    """With the reference load the published law itself, to rounding."""
    given = _within_limits(patch, given)
    fixed = DistributedModel(patch, kind(**given, reference_load=REFERENCE))
    published = DistributedModel(patch, kind(**given, sigma_0=1e6 * REFERENCE / load))
    scale = published.law.largest_deflection
    z = fixed.rest()
    y = published.rest()
    for twist in _twists(1):
        for _ in range(4):
            (z, pull) = fixed.step(z, twist, load, 1e-3)
            (y, wanted) = published.step(y, twist, load, 1e-3)
            np.testing.assert_allclose(z, y, rtol=0.0, atol=1e-12 * scale)
            np.testing.assert_allclose(pull, wanted, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(
            fixed.rate(z, twist, load),
            published.rate(y, twist, load),
            rtol=0.0,
            atol=1e-10 * np.abs(twist).max(),
        )
        np.testing.assert_allclose(
            fixed.wrench(z, twist, load),
            published.wrench(y, twist, load),
            rtol=1e-11,
            atol=1e-12,
        )


@every_patch
def test_a_held_contact_keeps_its_force_when_it_is_pressed_harder(patch):
    fixed, published = (
        DistributedModel(patch, LuGre(elasto_plastic=0.9, reference_load=f))
        for f in (REFERENCE, None)
    )
    state, _ = fixed.step(fixed.rest(), [1e-4, 5e-5, 2e-3], REFERENCE, 1e-3)
    still, first = fixed.step(state, np.zeros(3), REFERENCE, 1e-3)
    # Rounding of the middle of the limit.
    tiny = 1e-15 * np.abs(state).max() if patch.asymmetric else 0.0
    np.testing.assert_allclose(still, state, rtol=0.0, atol=tiny)
    harder, pull = fixed.step(state, np.zeros(3), 2.0 * REFERENCE, 1e-3)
    np.testing.assert_allclose(harder, state, rtol=1e-15, atol=tiny)
    np.testing.assert_allclose(pull, first, rtol=1e-13)
    np.testing.assert_allclose(
        fixed.wrench(state, np.zeros(3), 2.0 * REFERENCE), first, rtol=1e-13
    )
    np.testing.assert_allclose(
        published.step(state, np.zeros(3), 2.0 * REFERENCE, 1e-3)[1],
        2.0 * first,
        rtol=1e-13,
    )


@every_patch
def test_a_bristle_beyond_its_limit_returns_when_the_load_falls(patch):
    law = LuGre(mu_c=0.8, mu_s=1.1, elasto_plastic=0.9, reference_load=REFERENCE)
    model = DistributedModel(patch, law)
    bent = np.zeros(model.state_shape)
    bent[0] = np.linspace(0.1, 1.0, patch.cells) * law.mu_s / law.sigma_0
    for load in (REFERENCE, 1.0, 0.1):
        limit = law.mu_s * load / (law.sigma_0 * REFERENCE)
        state, pull = model.step(bent, np.zeros(3), load, 1e-3)
        middle = np.zeros_like(bent)
        middle[:2] = limit * patch.asymmetries().T
        out = bent - middle
        size = np.linalg.norm(out, axis=0)
        np.testing.assert_allclose(
            state, middle + out * np.minimum(limit / size, 1.0), rtol=1e-11, atol=1e-21
        )
        rate = model.rate(bent, np.zeros(3), load)
        np.testing.assert_allclose(rate[:, size <= limit], 0.0, atol=1e-15)
        assert ((rate * out).sum(0)[size > limit] < 0.0).all()
        stiffness = law.sigma_0 * REFERENCE * patch.weights()
        wanted = -np.einsum("n,nij,in->j", stiffness, patch.levers(), state)
        np.testing.assert_allclose(pull, wanted, rtol=1e-11, atol=1e-15)


def test_a_load_from_zero_begins_without_force():
    model = ReducedModel(_DISC, LuGre(reference_load=REFERENCE))
    state, pull = model.step(model.rest() + 1e-7, np.zeros(3), 0.0, 1e-3)
    assert not state.any() and not pull.any()
    for load in (1e-300, 1e-20, 1e-9):
        state, pull = model.step(state, [1e-3, 0.0, 0.0], load, 1e-3)
        assert 0.0 < -pull[0] <= 1.01 * load
    assert np.isfinite(model.rate(model.rest() + 1e-7, [1e-3, 0.0, 0.0], 0.0)).all()


@every_patch
@pytest.mark.parametrize("ratio", [None, 0.9])
def test_stored_energy_never_grows_with_the_load(patch, ratio):
    law = LuGre(sigma_1=0.0, elasto_plastic=ratio, reference_load=REFERENCE)
    model = DistributedModel(patch, law)
    rng = np.random.default_rng(2)
    shares = law.sigma_0 * REFERENCE * patch.weights()
    state = 1e-6 * rng.normal(size=model.state_shape)
    before = 0.5 * (shares * state**2).sum()
    fell = 0
    for load in rng.uniform(0.05, 8.0, 200):
        state, _ = model.step(state, np.zeros(3), load, 1e-2)
        energy = 0.5 * (shares * state**2).sum()
        assert energy <= before * (1.0 + 1e-13)
        fell += energy < 0.99 * before
        before = energy
    assert fell > 1


@every_patch
@pytest.mark.parametrize("ratio", [None, 0.9])
def test_no_work_comes_out_that_was_not_put_in(patch, ratio):
    """Paths of the twist are closed, whatever the loads do meanwhile; the published law gives work out in some."""
    count = 10_000
    steps = 12
    rng = np.random.default_rng(3)
    path = np.cumsum(
        rng.normal(size=(count, steps, 3))
        * [1e-6, 1e-6, 1e-4]
        * 10.0 ** rng.uniform(-2, 0, (count, 1, 1)),
        1,
    )
    path[:, -1] = 0.0
    moves = np.diff(path, axis=1, prepend=0.0)
    loads = 10.0 ** rng.uniform(-1.0, 1.0, (count, steps))
    least = {}
    for reference in (REFERENCE, None):
        model = DistributedModel(
            patch, LuGre(sigma_1=0.0, elasto_plastic=ratio, reference_load=reference)
        )
        state = model.rest(count)
        work = np.zeros(count)
        for move, load in zip(moves.swapaxes(0, 1), loads.T, strict=True):
            state, pull = model.step(state, move / 1e-3, load, 1e-3)
            work -= (pull * move).sum(axis=-1)
        least[reference] = work.min() / np.abs(work).max()
    assert least[REFERENCE] > -1e-12
    assert least[None] < -1e-4


def _differences(function, size, at):
    return [
        (a - b) / (2.0 * size * at)
        for a, b in zip(
            function(at * (1.0 + size)), function(at * (1.0 - size)), strict=True
        )
    ]


@every_patch
@every_law
@pytest.mark.parametrize("load", [REFERENCE, 2.9, 0.7])
def test_derivatives_are_those_of_differences(patch, kind, given, load):
    model = DistributedModel(patch, kind(**given, reference_load=REFERENCE))
    rng = np.random.default_rng(4)
    state = 4e-7 * rng.normal(size=model.state_shape)
    twist = np.array([8e-4, -3e-4, 0.03])
    slopes = model.jacobians(state, twist, load)
    step = model.step_jacobians(state, twist, load, 1e-3)
    rate, wrench = _differences(
        lambda f: (model.rate(state, twist, f), model.wrench(state, twist, f)),
        1e-6,
        load,
    )
    size = np.abs(rate).max()
    np.testing.assert_allclose(slopes.rate_load, rate, rtol=1e-5, atol=1e-6 * size)
    np.testing.assert_allclose(slopes.wrench_load, wrench, rtol=1e-5, atol=1e-8)
    of_new, of_step = _differences(
        lambda f: model.step(state, twist, f, 1e-3), 1e-6, load
    )
    np.testing.assert_allclose(
        step.state_load, of_new, rtol=1e-5, atol=1e-6 * np.abs(of_new).max()
    )
    np.testing.assert_allclose(step.wrench_load, of_step, rtol=1e-5, atol=1e-7)
    by_state = 1e-12 * rng.normal(size=state.shape)
    by_twist = 1e-9 * np.array([1.0, -2.0, 50.0])
    for found, d_state, d_twist in (
        ("state", by_state, 0.0 * by_twist),
        ("twist", 0.0 * by_state, by_twist),
    ):
        above, below = (
            model.step(state + s * d_state, twist + s * d_twist, load, 1e-3)
            for s in (1.0, -1.0)
        )
        rates = [
            model.rate(state + s * d_state, twist + s * d_twist, load)
            for s in (1.0, -1.0)
        ]
        new, pull = (0.5 * (a - b) for a, b in zip(above, below, strict=True))
        if found == "state":
            mine = (
                np.einsum("abn,bn->an", step.state_state, d_state),
                np.einsum("dan,an->d", step.wrench_state, d_state),
            )
            of_rate = np.einsum("abn,bn->an", slopes.rate_state, d_state)
        else:
            mine = (step.state_twist @ d_twist, step.wrench_twist @ d_twist)
            of_rate = slopes.rate_twist @ d_twist
        for one, other in (
            (mine[0], new),
            (mine[1], pull),
            (of_rate, 0.5 * (rates[0] - rates[1])),
        ):
            np.testing.assert_allclose(
                one, other, rtol=1e-4, atol=1e-5 * np.abs(other).max()
            )


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.05, 10.0), st.floats(1e-3, 1e3), st.floats(1.0, 2.0), st.floats(0.0, 0.99),
    st.lists(st.floats(-2e-6, 2e-6), min_size=2, max_size=2),
)  # fmt: skip
def test_a_bristle_at_rest_never_holds_more_than_its_limit(
    load, reference, mu_s, ratio, bent
):
    law = LuGre(mu_s=mu_s, elasto_plastic=ratio, reference_load=reference)
    patch = ContactPatch.points([[-0.01, 0.0], [0.01, 0.0]])
    model = DistributedModel(patch, law)
    _, pull = model.step(
        np.repeat(np.array(bent)[:, None], 2, 1), np.zeros(3), load, 1e-3
    )
    assert math.hypot(*pull[:2]) <= mu_s * load * (1.0 + 1e-12)
    held = law.sigma_0 * reference * math.hypot(*bent)
    np.testing.assert_allclose(
        math.hypot(*pull[:2]), min(held, mu_s * load), rtol=1e-9, atol=1e-300
    )


def test_a_single_bristle_follows_the_same_equations():
    fixed = LuGre(reference_load=REFERENCE)
    published = LuGre(sigma_0=1e6 * REFERENCE / 3.0)
    z = np.array([2e-7, -4e-7])
    v = np.array([1e-3, 2e-3])
    np.testing.assert_allclose(fixed.rate(z, v, 3.0), published.rate(z, v), rtol=1e-14)
    np.testing.assert_allclose(
        fixed.rate(z, v, 3.0, axis=0), published.rate(z, v, axis=0), rtol=1e-14
    )
    np.testing.assert_allclose(
        fixed.force(z, v, 3.0), published.force(z, v, 3.0), rtol=1e-14
    )
    np.testing.assert_allclose(
        fixed.force(1e-7, 0.0, [0.0, 1.0, 4.0]), [0.0, -0.2, -0.2], rtol=1e-14
    )
    np.testing.assert_array_equal(LuGre().stiffness_factor([0.0, 5.0]), [1.0, 1.0])
    with refused("normal_force must be given for a law with a reference_load"):
        fixed.rate(z, v)


@pytest.mark.parametrize(
    "patch",
    [
        pytest.param(patch, marks=pytest.mark.slow if name == "turned discs" else ())
        for name, patch in PATCHES.items()
    ],
    ids=PATCHES,
)
@every_law
def test_at_the_reference_load_derivatives_of_rollouts_are_the_published(
    patch, kind, given
):
    given = _within_limits(patch, given)
    rounding = 1e-12 if patch.asymmetric else 0.0
    fixed, published = (
        DistributedModel(patch, kind(**given, reference_load=f))
        for f in (REFERENCE, None)
    )
    rng = np.random.default_rng(6)
    twists = _twists(5)
    state = 1e-7 * rng.normal(size=fixed.state_shape)
    bars = rng.normal(size=(40, 3))
    found, wanted = (
        rollout_vjp(model, state, twists, REFERENCE, 1e-3, bars)
        for model in (fixed, published)
    )
    assert found.normal_force != wanted.normal_force
    for got, want in (
        (getattr(each, name) for each in (found, wanted))
        for name in ("state", "twist", "parameters")
    ):
        np.testing.assert_allclose(
            got, want, rtol=rounding, atol=rounding * np.abs(want).max()
        )
    slopes = (
        rollout_jacobian(model, state, twists, REFERENCE, 1e-3).d_wrenches
        for model in (fixed, published)
    )
    np.testing.assert_allclose(*slopes, rtol=rounding, atol=rounding)
    turned = RolloutTangent(state, twists, parameters=parameters_of(fixed))
    changes = (
        rollout_jvp(model, state, twists, REFERENCE, 1e-3, turned).wrenches_dot
        for model in (fixed, published)
    )
    np.testing.assert_allclose(*changes, rtol=rounding, atol=rounding)


def test_what_does_not_know_a_fixed_stiffness_says_so():
    law = LuGre(reference_load=REFERENCE)
    with refused("reference_load must be > 0, got 0"):
        LuGre(reference_load=0.0)
    with refused("law must have no reference_load for ReducedModelPublished"):
        ReducedModelPublished(_DISC, law)
    model = DistributedModel(_DISC, law)
    with refused("moments must be None for a law with a reference_load"):
        model.step(model.rest(), np.zeros(3), 1.0, 1e-3, moments=[0.0, 0.0])
    with pytest.raises(TypeError):
        CoulombStribeck(reference_load=1.0)
    assert "reference_load=2" in repr(model)
    assert law != LuGre() and LuGre(reference_load=None) == LuGre()
