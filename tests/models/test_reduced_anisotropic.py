"""The reduced model with friction that depends on the direction: against the cells, and without it to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.models.reduced_map import slip_factor
from planarfriction.models.steady_sums import ScaledCells
from planarfriction.patch import PUBLISHED_PATCHES

LAW = pf.LuGre(mu_s=1.2)
PLAIN = PUBLISHED_PATCHES["NonConvex2"](cells=11)
GRAIN = pf.friction_metric(0.4, 1.3, 0.6)
_RANDOM = np.random.default_rng(1)
GRAINS = np.array([pf.friction_metric(angle, 1.2, 0.7) for angle in _RANDOM.uniform(-3.0, 3.0, PLAIN.cells)])
LEAN, LEANS = np.array([0.3, -0.2]), _RANDOM.uniform(-0.4, 0.4, (PLAIN.cells, 2))
PATCHES = {
    "metric": PLAIN.with_friction_metric(GRAIN),
    "metrics": PLAIN.with_friction_metric(GRAINS),
    "asymmetry": PLAIN.with_friction_metric(None, LEAN),
    "metric and asymmetry": PLAIN.with_friction_metric(GRAIN, LEAN),
    "metrics and asymmetries": PLAIN.with_friction_metric(GRAINS, LEANS),
}
every_patch = pytest.mark.parametrize("name", PATCHES)


@pytest.fixture(scope="module")
def models() -> dict[str, pf.models.MomentModel]:
    return {name: pf.models.MomentModel(patch, LAW, parts=1) for name, patch in PATCHES.items()}


def spread(count: int, seed: int = 2) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return generator.normal(size=(count, 3)) * [1.0, 1.0, 150.0] * 10.0 ** generator.uniform(-5, -1, (count, 1))


@every_patch
def test_the_factor_holds_the_second_moments_of_slip(name):
    patch = PATCHES[name]
    levers = patch.levers()
    factor = slip_factor(patch)
    wanted = np.einsum("n,nia,nib->ab", patch.weights(), levers, levers)
    np.testing.assert_allclose(factor.T @ factor, wanted, rtol=1e-12, atol=1e-18)
    assert not np.tril(factor, -1).any()


@every_patch
def test_steady_sliding_is_the_sum_over_the_cells(name, models):
    model, cells = models[name], pf.DistributedModel(PATCHES[name].refined(5), LAW)
    errors = []
    for twist in spread(40):
        wrenches = [m.step(m.rest(), twist, 1.0, 1e6)[1] for m in (model, cells)]
        errors.append(np.abs((wrenches[0] - wrenches[1]) / [1.0, 1.0, 0.01]).max())
    assert np.median(errors) < 3e-4  # of the 5 x 5 points in each cell; without a metric 1e-4
    assert max(errors) < 1.5e-2


def test_one_metric_for_all_is_the_same_as_one_each():
    """Parallelograms cut near the centre of rotation beside Gauss points, which are not."""
    single, each = PATCHES["metric"], PLAIN.with_friction_metric(np.tile(GRAIN, (PLAIN.cells, 1, 1)) + 0.0)
    other = PLAIN.with_friction_metric(np.where(np.arange(PLAIN.cells)[:, None, None] == 0, GRAIN * (1 + 1e-13), GRAIN))
    directions, factor = np.random.default_rng(0).normal(size=(300, 3)), slip_factor(single)
    directions[:, 2] *= 0.1  # centres of rotation outside
    sums = [ScaledCells(p, None, factor).sums(directions, np.array([0.3, 2.0]), 2.0) for p in (single, each, other)]
    np.testing.assert_allclose(sums[1], sums[0], rtol=0.0, atol=1e-12)
    assert np.median(np.abs(sums[2] - sums[0])) < 1e-5
    assert np.abs(sums[2] - sums[0]).max() < 2e-2


def test_before_sliding_a_metric_has_the_stiffness_of_the_cells(models):
    for name in ("metric", "metrics"):
        distributed = pf.DistributedModel(PATCHES[name], LAW)
        for twist in np.eye(3) * [1e-9, 1e-9, 1e-7]:
            ours, theirs = (m.step(m.rest(), twist, 2.0, 1e-3)[1] for m in (models[name], distributed))
            np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-5 * np.abs(theirs).max())


@pytest.mark.parametrize("shape", [(), (PLAIN.cells,)])
def test_metrics_of_ones_change_no_bit(shape):
    ones = np.broadcast_to(np.eye(2), (*shape, 2, 2))
    same = PLAIN.with_friction_metric(ones, np.zeros((*shape, 2)))
    small = {"segments": 8, "speeds": 6}
    one, other = (pf.models.MomentModel(patch, LAW, **small).shape_at(None) for patch in (PLAIN, same))
    np.testing.assert_array_equal(one.factor, other.factor)
    np.testing.assert_array_equal(one.data, other.data)


@every_patch
def test_sliding_dissipates_and_jacobians_are_derivatives(name, models):
    model, twist = models[name], spread(60, 5)
    state = model.step(np.zeros((60, 3)), twist, 1.0, 1e6)[0]
    scaled = twist @ model.shape_at(None).factor.T
    assert (np.einsum("bi,bi->b", state, scaled) > 0.0).all()
    found = model.jacobians(0.3 * state, twist, 2.0).wrench_twist
    sizes = 1e-6 * np.abs(twist).max(axis=1, keepdims=True) * [0.02, 0.02, 1.0]
    for k in range(3):
        move = np.zeros_like(twist)
        move[:, k] = sizes[:, k]
        slope = model.wrench(0.3 * state, twist + move, 2.0) - model.wrench(0.3 * state, twist - move, 2.0)
        error = np.abs(found[..., k] - slope / (2.0 * sizes[:, k, None])).max(axis=1)
        assert np.median(error / np.abs(found[..., k]).max(axis=1)) < 1e-4


def test_a_block_slides_as_the_cells_do(models):
    """Asymmetric friction: forth and back along x with a spin, wrenches beside those of the cells."""
    wave = pf.Signal.sampled(
        [0.0, 0.1, 0.2, 0.3], [[0, 0, 0], [0.02, 0, 2.0], [-0.02, 0.01, 2.0], [0, 0, 0]], hold="linear"
    )
    for name in PATCHES:
        distributed = pf.DistributedModel(PATCHES[name].refined(3), LAW)
        runs = [
            pf.simulate(pf.scenes.driven(m, twist=wave, t_end=0.3), rtol=1e-4, atol=1e-4).data
            for m in (models[name], distributed)
        ]
        assert np.median(np.hypot(runs[0].fx - runs[1].fx, runs[0].fy - runs[1].fy)) < 5e-3
