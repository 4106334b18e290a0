"""Cells that are small discs in PyTorch and JAX: the numbers and slopes of NumPy's models, also where they have kinks.

Points and discs with a friction metric and with asymmetric friction too, whose bristles are the same source.
"""

import functools

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

LAWS = {
    "plain": pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7),
    "elasto-plastic": pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7, elasto_plastic=0.9),
}
METRIC, ASYMMETRY = [[2.0, 0.3], [0.3, 1.0]], (0.1, 0.2)
PRESSURE = np.random.default_rng(4).uniform(0.0, 1.0, (5, 6))
DT = 1e-4


@functools.cache
def patch(kind):
    found = pf.ContactPatch.from_pressure(PRESSURE, 0.002)
    if "turned" in kind:
        found = found.with_friction_metric(METRIC)
    if "leaning" in kind:
        found = found.with_friction_metric(METRIC, asymmetry=ASYMMETRY)
    return found.discs(7) if "discs" in kind else found


KINDS = ("discs", "turned discs", "leaning discs", "leaning points")


def samples(shape, seed=0):
    """States in stick and slip, twists of all speeds, loads; the first ones at rest, without slide, without spin."""
    rng = np.random.default_rng(seed)
    z = (
        rng.normal(size=(40, *shape))
        * 1e-6
        * 10.0 ** rng.uniform(-2, 0.3, (40, *(1 for _ in shape)))
    )
    v = (
        rng.normal(size=(40, 3))
        * [1e-3, 1e-3, 0.2]
        * 10.0 ** rng.uniform(-2, 2, (40, 1))
    )
    f = rng.uniform(0.2, 3.0, 40)
    z[:4] = 0.0
    v[3:6] = 0.0
    f[6] = 0.0
    v[7, :2] = 0.0
    v[8, 2] = 0.0
    v[1, 2] = 0.0
    v[2, :2] = 0.0
    for i, decade in enumerate((-6, -7, -8, -9, -10, -12, -20, -80, -120)):
        v[10 + i] = rng.normal(size=3) * 10.0**decade
    return z, v, f


def assert_close(found, wanted, tolerance):
    assert found.shape == wanted.shape
    assert np.abs(found - wanted).max() <= tolerance * np.abs(wanted).max()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", KINDS)
def test_values_are_those_of_numpy(front, kind, law):
    model = pf.DistributedModel(patch(kind), LAWS[law])
    ours = front.model(patch(kind), LAWS[law])
    assert (
        ours.state_shape
        == model.state_shape
        == (3 if "discs" in kind else 2, patch(kind).cells)
    )
    inputs = samples(model.state_shape)
    at = front.arrays(*inputs)
    found = ours.rate(*at), ours.wrench(*at), *ours.step(*at, DT)
    wanted = model.rate(*inputs), model.wrench(*inputs), *model.step(*inputs, DT)
    for got, want in zip(found, wanted, strict=True):
        assert_close(front.plain(got), want, 1e-13)


@pytest.mark.parametrize(
    "kind", ["discs", pytest.param("leaning discs", marks=pytest.mark.slow)]
)
def test_slopes_are_those_of_numpy_and_finite_everywhere(front, kind):
    law = LAWS["elasto-plastic"]
    model = pf.DistributedModel(patch(kind), law)
    ours = front.model(patch(kind), law)
    inputs = samples(model.state_shape)
    new, wrench = front.slopes(
        lambda z, v, f: ours.step(z, v, f, DT), *front.arrays(*inputs)
    )
    found = [front.plain(each) for each in (*new, *wrench)]
    loaded = inputs[2] > 0.0
    # A bristle depends on its own start alone.
    found[0] = np.einsum("tanbn->tabn", found[0])
    for got, want in zip(found, model.step_jacobians(*inputs, DT), strict=True):
        assert np.isfinite(got).all() and np.isfinite(want).all()
        # Rounding, through steep slopes of the slip fraction.
        assert_close(got[loaded], want[loaded], 1e-11)


@pytest.mark.parametrize(
    "kind", ["discs", pytest.param("turned discs", marks=pytest.mark.slow)]
)
def test_single_precision_has_values_and_slopes_at_any_speed(front, kind):
    law = LAWS["elasto-plastic"]
    model = pf.DistributedModel(patch(kind), law)
    ours = front.model(patch(kind), law, single=True)
    inputs = samples(model.state_shape)
    at = front.arrays(*inputs, single=True)
    new, wrench = ours.step(*at, DT)
    assert "float32" in str(new.dtype) and "float32" in str(wrench.dtype)
    for got, want in zip((new, wrench), model.step(*inputs, DT), strict=True):
        assert_close(front.plain(got), want, 1e-5)
    for block in front.slopes(lambda z, v, f: ours.step(z, v, f, DT), *at):
        assert all(np.isfinite(front.plain(each)).all() for each in block)


def test_a_patch_that_is_turned_turns_its_friction(front):
    law = LAWS["elasto-plastic"]
    angle = 0.7
    inputs = samples((3, 7), 1)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    whole = np.eye(3)
    whole[:2, :2] = turn
    given = patch("discs")
    turned = pf.ContactPatch(
        given.positions @ turn.T,
        given.areas,
        given.weights() / given.areas,
        radii=given.radii,
    )
    z, v, f = inputs
    new, wrench = front.model(given, law).step(*front.arrays(z, v, f), DT)
    there = front.model(turned, law).step(
        *front.arrays(np.einsum("ij,bjn->bin", whole, z), v @ whole.T, f), DT
    )
    assert_close(
        front.plain(there[0]), np.einsum("ij,bjn->bin", whole, front.plain(new)), 1e-10
    )
    assert_close(front.plain(there[1]), front.plain(wrench) @ whole.T, 1e-10)


@pytest.mark.parametrize(
    "kind", ["discs", "turned discs", "leaning points", "leaning discs"]
)
def test_compiled_and_recorded_rollouts_agree(front, kind):
    law = LAWS["elasto-plastic"]
    ours = front.model(patch(kind), law)
    _, v, f = samples((3, 7), 2)
    twists, loads = front.arrays(v, f)
    compiled, recorded = (
        front.models.rollout(ours, None, twists, loads, DT, method=m)
        for m in ("adjoint", "eager")
    )
    for got, want in zip(compiled, recorded, strict=True):
        assert_close(front.plain(got), front.plain(want), 1e-9)


def test_a_patch_that_depends_on_its_load_keeps_the_discs_of_one(front):
    soft = pf.ContactPatch.disc(
        0.01, cells=9, pressure=pf.SoftFinger(c=0.005, n=1 / 3, k=2.0)
    )
    model = pf.ReducedModel(soft, LAWS["plain"], cells=12)
    ours = front.model(soft, LAWS["plain"], "ReducedModel", normal_force=2.0, cells=12)
    z, v, _ = samples(model.state_shape)
    found = ours.step(*front.arrays(z[20], v[20], 2.0), DT)
    for got, want in zip(found, model.step(z[20], v[20], 2.0, DT), strict=True):
        assert_close(front.plain(got), want, 1e-12)
    with refused("normal_force must be", pf.FrictionError):
        front.model(soft, LAWS["plain"], "ReducedModel")
