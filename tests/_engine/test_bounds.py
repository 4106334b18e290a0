"""Compiled loops stay within their arrays: `make test-bounds` checks each index, these tests what it cannot."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

import planarfriction as pf
from planarfriction import derivatives
from planarfriction._engine.coupled import coupling
from planarfriction.derivatives.inputs import checked

PATCH, LAW = pf.ContactPatch.disc(radius=0.01, cells=9), pf.LuGre()


@pytest.mark.parametrize("kind", [pf.ReducedModelPublished, pf.DistributedModel])
def test_rollouts_of_all_models_add_to_what_comes_in(kind):
    model = kind(PATCH, LAW)
    twist = np.tile([1e-3, 0.0, 0.1], (2, 4, 1))
    inputs = checked(model, None, twist, [1.0, 1.0, 0.0, 1.0], 1e-3, None)
    family = inputs.model.family
    compiled = inputs.compiled()
    found = []
    for start in (0.0, 5.0):
        wrenches = np.full(twist.shape, start)
        family.rollout(
            compiled,
            (0, 2),
            inputs.state.copy(),
            wrenches,
            np.empty((2, 0, inputs.state.shape[1])),
        )
        found.append(wrenches - start)
    np.testing.assert_allclose(found[1], found[0], atol=1e-14)  # rounding of 5 N
    assert np.abs(found[0]).max() > 0.1
    wrenches = derivatives.rollout_jacobian(
        model, None, twist, 1.0, 1e-3
    ).wrenches  # one pass a parameter
    np.testing.assert_allclose(
        wrenches,
        derivatives.rollout(model, None, twist, 1.0, 1e-3).wrenches,
        atol=1e-12,
    )


def test_a_slope_that_does_not_rise_at_its_start_shortens_no_displacement():
    @njit
    def asked(first, here):
        return coupling.too_far(first, here), coupling.shortening_of(first, here)

    assert asked(1.0, -0.6)[0]
    assert not any(asked(*each)[0] for each in [(1.0, -0.4), (0.0, -1.0), (-1.0, -1.0)])
    assert asked(1.0, -1.0)[1] == 0.5 and asked(1.0, -1e9)[1] == 0.1
