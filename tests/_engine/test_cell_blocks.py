"""Cells in blocks: how they are divided, and that no cell minds where it lies."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction._engine.cells.cell_blocks import LANES, VECTOR, divided
from planarfriction.derivatives import rollout, rollout_vjp

LAW = pf.LuGre(mu_c=0.8, mu_s=1.1, elasto_plastic=0.9)
COUNTS = [
    1,
    VECTOR - 1,
    VECTOR,
    VECTOR + 1,
    LANES - 1,
    LANES,
    LANES + 1,
    2 * LANES + 1,
    3 * LANES - 7,
]
"""Numbers of cells around those that fill a vector and a block."""


@given(st.integers(1, 20_000))
def test_cells_are_spread_evenly_in_whole_vectors(count):
    blocks, lanes = divided.py_func(count)
    assert (
        (blocks - 1) * LANES < count <= blocks * lanes
        and lanes <= LANES
        and lanes % VECTOR == 0
    )
    assert blocks * lanes - count < blocks * VECTOR
    # That of what is filled up.
    assert divided.py_func(blocks * lanes) == (
        blocks,
        lanes,
    )


def patch_of(positions: np.ndarray, weights: np.ndarray) -> pf.ContactPatch:
    return pf.ContactPatch(positions, np.full(len(positions), 1e-6), weights)


@pytest.mark.parametrize("count", COUNTS)
def test_a_step_of_many_cells_is_that_of_each_alone(count):
    """To rounding: sums of tractions are ordered otherwise."""
    draw = np.random.default_rng(count)
    positions = draw.normal(scale=5e-3, size=(count, 2))
    weights = draw.uniform(0.5, 1.0, count)
    state = draw.normal(scale=5e-7, size=(2, count))
    twist = np.array([0.002, -0.001, 0.4])
    new, wrench = pf.DistributedModel(patch_of(positions, weights), LAW).step(
        state, twist, 2.0, 1e-4
    )
    total = np.zeros(3)
    for i, share in enumerate(2.0 * weights / weights.sum()):
        alone = pf.DistributedModel(patch_of(positions[i : i + 1], np.ones(1)), LAW)
        one, pull = alone.step(state[:, i : i + 1], twist, share, 1e-4)
        np.testing.assert_allclose(new[:, i], one[:, 0], rtol=1e-12, atol=1e-20)
        total += pull
    np.testing.assert_allclose(wrench, total, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize("count", COUNTS)
def test_rollouts_of_many_cells_take_the_steps_of_the_model(count):
    """So do the states and gradients that are read from blocks: those of a sum do not depend on the order of cells."""
    draw = np.random.default_rng(count)
    positions = draw.normal(scale=5e-3, size=(count, 2))
    weights = draw.uniform(0.5, 1.0, count)
    twists = draw.normal(scale=(2e-3, 2e-3, 0.3), size=(6, 3))
    order = draw.permutation(count)
    model = pf.DistributedModel(patch_of(positions, weights), LAW)
    state = model.rest()
    wrenches = []
    for twist in twists:
        state, wrench = model.step(state, twist, 2.0, 1e-4)
        wrenches.append(wrench)
    found = rollout(model, None, twists, 2.0, 1e-4).wrenches
    np.testing.assert_allclose(found, wrenches, rtol=1e-9, atol=1e-12)
    turned = pf.DistributedModel(patch_of(positions[order], weights[order]), LAW)
    given = None, twists, 2.0, 1e-4, np.ones((6, 3))
    slopes, others = (rollout_vjp(each, *given) for each in (model, turned))
    np.testing.assert_allclose(slopes.twist, others.twist, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(
        slopes.state[:, order], others.state, rtol=1e-7, atol=1e-9
    )
