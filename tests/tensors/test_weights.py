"""Gradients of compiled rollouts to the weights of cells in PyTorch and JAX, and patches of trained weights."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused
from tests.tensors.test_discs import DT, LAWS, patch

LAW = LAWS["elasto-plastic"]
CASES = {
    "leaning discs": ("leaning discs", LAW),
    "at a load": ("points", LAW, pf.Pad.at_load(1.5)),
}


def motion():
    rng = np.random.default_rng(8)
    twists = rng.normal(size=(3, 12, 3)) * [1e-3, 1e-3, 0.2]
    loads = rng.uniform(0.4, 3.0, (3, 12))
    loads[1, 4:6] = 0.0
    return twists, loads, rng.normal(size=(3, 12, 3)) * [1.0, 1.0, 300.0]


def power(front, model, twists, loads, bars, method):
    """A function of numbers of the weights: raw ones in PyTorch, weights in JAX."""

    def of(numbers):
        if front.name == "jax":
            now = model.replace(weights=numbers)
            return (
                front.models.rollout(
                    now, None, twists, loads, DT, method=method
                ).wrenches
                * bars
            ).sum()

        class Roll(front.library.nn.Module):
            def __init__(self):
                super().__init__()
                self.model = model

            def forward(self):
                return (
                    front.models.rollout(
                        model, None, twists, loads, DT, method=method
                    ).wrenches
                    * bars
                ).sum()

        return front.library.func.functional_call(
            Roll(), {"model.raw_weights": numbers}, ()
        )

    return of


def weighed(front, kind, law, pad=None):
    options = {"pad": pad}
    if front.name == "torch":
        options["trainable"] = ("mu_c", "mu_s", "weights")
    model = front.model(patch(kind), law, **options)
    return model, (
        model.raw_weights.detach() if front.name == "torch" else model.weights
    )


@pytest.mark.parametrize("case", CASES)
def test_gradients_to_weights_are_those_of_recorded_steps(front, case):
    model, numbers = weighed(front, *CASES[case])
    at = front.arrays(*motion())
    compiled, recorded = (
        front.grad(power(front, model, *at, method))(numbers)
        for method in ("adjoint", "eager")
    )
    wanted = front.plain(recorded)
    np.testing.assert_allclose(
        front.plain(compiled), wanted, rtol=1e-10, atol=1e-11 * np.abs(wanted).max()
    )
    assert np.abs(wanted).max() > 1e-3
    way = np.random.default_rng(4).normal(size=wanted.shape)
    func = front.library.func if front.name == "torch" else front.library
    along = func.jvp(power(front, model, *at, "adjoint"), (numbers,), tuple(front.arrays(way)))[1]  # fmt: skip
    np.testing.assert_allclose(front.plain(along), (wanted * way).sum(), rtol=1e-9)


def test_every_contact_may_have_weights_of_its_own(front):
    model, numbers = weighed(front, "points", LAW)
    func = front.library.func if front.name == "torch" else front.library
    of = power(front, model, *front.arrays(*motion()), "adjoint")
    rows = (
        numbers
        + front.arrays(
            0.01 * np.random.default_rng(2).normal(size=(3, *numbers.shape))
        )[0]
    )
    both = func.vmap(lambda row: (of(row), func.grad(of)(row)))(rows)
    for k, row in enumerate(rows):
        for got, want in zip(both, (of(row), func.grad(of)(row)), strict=True):
            np.testing.assert_allclose(
                front.plain(got[k]), front.plain(want), rtol=1e-11, atol=1e-14
            )
    turned = func.jvp(of, (rows[0],), (rows[1],))[1]
    np.testing.assert_allclose(
        front.plain(turned),
        front.plain((func.grad(of)(rows[0]) * rows[1]).sum()),
        rtol=1e-10,
    )


def test_trained_weights_are_a_patch_again(front):
    whole = pf.ContactPatch.disc(0.01, cells=7)
    (twists, loads, _) = motion()
    for name, options in (("DistributedModel", {}), ("ReducedModel", {"cells": 9})):
        ours = front.model(whole, LAW, name, **options)
        shares = np.random.default_rng(5).uniform(0.5, 1.5, len(ours.weights))
        if front.name == "torch":
            ours.raw_weights[:] = front.arrays(np.log(shares))[0]
            assert (ours.value("weights") == ours.weights).all()
        else:
            ours = ours.replace(weights=front.arrays(shares / shares.sum())[0])
        model = pf.DistributedModel(ours.weighted(whole), LAW)
        np.testing.assert_allclose(
            model.patch.weights(), shares / shares.sum(), rtol=1e-12
        )
        run = front.models.rollout(ours, None, *front.arrays(twists, loads), DT)
        wanted = pf.rollout(model, None, twists, loads, DT).wrenches
        np.testing.assert_allclose(
            front.plain(run.wrenches), wanted, rtol=1e-9, atol=1e-9
        )
    with refused("patch must have the 9 cells of the model, got 4"):
        ours.weighted(pf.ContactPatch.rectangle(0.01, 0.01, (2, 2)))
