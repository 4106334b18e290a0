"""The reduced model in PyTorch and JAX: the numbers of NumPy's, and one line for the options that it had."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

import planarfriction as pf

FRONTS = [pytest.param(name, marks=getattr(pytest.mark, name)) for name in ("jax", "torch")]
LAW = pf.LuGre(mu_c=0.3, mu_s=0.4, elasto_plastic=0.9)


@pytest.fixture(params=FRONTS)
def front(request):
    pytest.importorskip(request.param)
    return importlib.import_module(f"planarfriction.{request.param}")


@pytest.mark.parametrize("cells", [12, 30])
def test_it_is_that_of_numpy(front, cells):
    patch = pf.ContactPatch.rectangle(0.04, 0.02, 9)
    model, ours = (end.ReducedModel(patch, LAW, cells=cells) for end in (pf, front))
    assert ours.state_shape == model.state_shape
    state, twist = 1e-7 * np.random.default_rng(0).normal(size=model.state_shape), [2e-3, -1e-3, 0.3]
    for found, expected in zip(ours.step(state, twist, 2.0, 1e-3), model.step(state, twist, 2.0, 1e-3), strict=True):
        # in single precision, which is what both libraries take of themselves
        np.testing.assert_allclose(np.asarray(found.tolist()), expected, rtol=2e-5, atol=2e-5 * np.abs(expected).max())


@pytest.mark.parametrize("option", ["parts", "segments", "speeds", "load_error"])
def test_an_option_that_it_had_says_what_to_write_instead(front, option):
    with pytest.raises(pf.FrictionError, match=f"^{option} must be left out: write cells=") as caught:
        front.ReducedModel(pf.ContactPatch.disc(0.02), LAW, **{option: 1})
    assert "\n" not in str(caught.value)
