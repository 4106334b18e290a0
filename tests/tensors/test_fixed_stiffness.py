"""Stiffness that does not grow with the load in PyTorch and JAX: values of NumPy's models, slopes by differences."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused
from tests.tensors.test_discs import DT, assert_close, patch, samples

REFERENCE = 1.5
LAWS = {
    "plain": pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7, reference_load=REFERENCE),
    "elasto-plastic": pf.LuGre(
        mu_s=1.2, sigma_1=30.0, elasto_plastic=0.9, reference_load=REFERENCE
    ),
    "dahl": pf.Dahl(mu_c=0.8, reference_load=REFERENCE),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    "kind",
    [
        "points",
        "turned points",
        "leaning points",
        "discs",
        "turned discs",
        "leaning discs",
    ],
)
def test_values_are_those_of_numpy(front, kind, law):
    model = pf.DistributedModel(patch(kind), LAWS[law])
    ours = front.model(patch(kind), LAWS[law])
    z, v, f = samples(model.state_shape)
    f[30:35] = 1e-3  # bristles far beyond their limit
    at = front.arrays(z, v, f)
    found = ours.rate(*at), ours.wrench(*at), *ours.step(*at, DT)
    wanted = model.rate(z, v, f), model.wrench(z, v, f), *model.step(z, v, f, DT)
    for got, want in zip(found, wanted, strict=True):
        assert_close(front.plain(got), want, 1e-12)


@pytest.mark.parametrize(
    ("kind", "method"),
    [("points", "eager"), ("leaning discs", "adjoint")],
)
def test_rollouts_are_steps_of_numpy_whose_slopes_are_differences(front, kind, method):
    law = LAWS["elasto-plastic"]
    model = pf.DistributedModel(patch(kind), law)
    ours = front.model(patch(kind), law)
    rng = np.random.default_rng(5)
    z = 3e-7 * rng.normal(size=model.state_shape)
    bars = rng.normal(size=(8, 3)) * [1.0, 1.0, 300.0]
    v = rng.normal(size=(8, 3)) * [1e-3, 1e-3, 0.2]
    f = rng.uniform(0.4, 3.0, 8)

    def numpy(z, v, f):
        total = 0.0
        for twist, load, bar in zip(v, f, bars, strict=True):
            z, wrench = model.step(z, twist, load, DT)
            total += wrench @ bar
        return total

    weight, *_ = front.arrays(bars)

    def power(z, v, f):
        return (
            front.models.rollout(ours, z, v, f, DT, method=method).wrenches * weight
        ).sum()

    at = front.arrays(z, v, f)
    assert abs(front.plain(power(*at)) / numpy(z, v, f) - 1.0) < 1e-12
    slopes = front.slopes(power, *(each[None] for each in at))
    for i, (slope, value) in enumerate(zip(slopes, (z, v, f), strict=True)):
        step = 1e-6 * rng.normal(size=value.shape) * np.abs(value).max()
        ends = (
            [each if j != i else each + side * step for j, each in enumerate((z, v, f))]
            for side in (0.5, -0.5)
        )
        more, less = (numpy(*end) for end in ends)
        # kinks apart, differences over 1e-6 of the inputs have errors of about 1e-9
        assert abs((front.plain(slope)[0] * step).sum() / (more - less) - 1.0) < 1e-6


@pytest.mark.parametrize("single", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_without_load_slopes_are_zero_and_at_rest_they_are_finite(front, single):
    model = front.model(patch("discs"), LAWS["elasto-plastic"], single=single)
    z, v, f = samples(model.state_shape)
    f[:20:2] = 0.0
    at = front.arrays(z, v, f, single=single)
    new, wrench = front.slopes(lambda z, v, f: model.step(z, v, f, DT), *at)
    found = [front.plain(each) for each in (*new, *wrench)]
    assert all(np.isfinite(each).all() for each in found)
    assert not any(each[f == 0.0].any() for each in found[:5])


def test_a_fixed_stiffness_is_part_of_the_model(front):
    law = LAWS["elasto-plastic"]
    model = front.model(patch("points"), law)
    (z, v, f) = samples((2, 30))
    at = front.arrays(z, v, f)
    with refused("moments must be None for a law with a reference_load"):
        model.step(*at, DT, moments=front.arrays(v[:, :2])[0])
    with refused("law must have no reference_load for ReducedModelPublished"):
        front.model(patch("points"), law, "ReducedModelPublished")
    if front.name == "torch":
        assert model.law().reference_load == REFERENCE
        published = front.model(patch("points"), pf.LuGre(elasto_plastic=0.9))
        with pytest.raises(RuntimeError, match="reference_load"):
            published.load_state_dict(model.state_dict())
        return
    leaves, structure = front.library.tree.flatten(model)
    again = front.library.tree.unflatten(structure, leaves)
    assert again.reference_load == REFERENCE
