"""Elastic pads in PyTorch and JAX: values of NumPy's models, slopes by differences."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from tests.tensors.test_discs import DT, assert_close, patch, samples

PLAIN = pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7)
LAW = pf.LuGre(mu_s=1.2, sigma_1=30.0, elasto_plastic=0.9)
AT_LOAD, LAYER = pf.Pad.at_load(1.5), pf.Pad.layer(3e6, 2e-3)
"""Pads as stiff as bristles under about 1.5 N and 4 N."""

CASES = {
    "points at a load": ("points", AT_LOAD),
    "turned discs at a load": ("turned discs", AT_LOAD),
    "layer of points": ("points", LAYER),
    "layer of discs": ("discs", LAYER),
}


def moments_of(z, f):
    """Centres of pressure within 3 mm of the origin."""
    centre = np.random.default_rng(3).uniform(-3e-3, 3e-3, (len(z), 2))
    return centre * f[:, None]


@pytest.mark.parametrize("case", CASES)
def test_values_are_those_of_numpy(front, case):
    kind, pad = CASES[case]
    law = PLAIN if case == "layer of points" else LAW
    model = pf.DistributedModel(patch(kind), law, pad=pad)
    ours = front.model(patch(kind), law, pad=pad)
    assert ours.state_shape == model.state_shape
    z, v, f = samples(model.state_shape)
    f[30:35] = 1e-3  # bristles far beyond their limit
    m = moments_of(z, f)
    *at, tilt = front.arrays(z, v, f, m)
    found = ours.rate(*at), ours.wrench(*at), *ours.step(*at, DT)
    wanted = model.rate(z, v, f), model.wrench(z, v, f), *model.step(z, v, f, DT)
    found += ours.step(*at, DT, moments=tilt)
    wanted += model.step(z, v, f, DT, moments=m)
    for got, want in zip(found, wanted, strict=True):
        assert_close(front.plain(got), want, 1e-9)


def test_single_precision_has_values_and_slopes(front):
    soft = pf.Pad.layer(1e4, 2e-3)  # whose numbers without load are the least
    model = pf.DistributedModel(patch("discs"), LAW, pad=soft)
    ours = front.model(patch("discs"), LAW, single=True, pad=soft)
    z, v, f = samples(model.state_shape)
    at = front.arrays(z, v, f, single=True)
    new, wrench = ours.step(*at, DT)
    wanted = model.step(z, v, f, DT)
    assert_close(front.plain(new), wanted[0], 1e-5)
    assert_close(front.plain(wrench), wanted[1], 1e-5)
    slopes = front.slopes(lambda z, v, f: ours.step(z, v, f, DT), *at)
    found = [front.plain(each) for block in slopes for each in block]
    assert all(np.isfinite(each).all() for each in found)
    assert not any(each[f == 0.0].any() for each in found[:5])


@pytest.mark.parametrize("case", ["turned discs at a load", "layer of discs"])
def test_rollouts_are_steps_of_numpy_whose_slopes_are_differences(front, case):
    kind, pad = CASES[case]
    model = pf.DistributedModel(patch(kind), LAW, pad=pad)
    ours = front.model(patch(kind), LAW, pad=pad)
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
        run = front.models.rollout(ours, z, v, f, DT, method="adjoint")
        return (run.wrenches * weight).sum()

    at = front.arrays(z, v, f)
    assert abs(front.plain(power(*at)) / numpy(z, v, f) - 1.0) < 1e-9
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


@pytest.mark.parametrize("method", ["adjoint", "eager"])
def test_the_law_moves_its_own_stiffness_only(front, method):
    """A stiffness of the pad's own does not feel `sigma_0`; one of the law does, and other numbers are felt by both."""
    rng = np.random.default_rng(6)
    v = rng.normal(size=(8, 3)) * [0.03, 0.03, 6.0]
    f = rng.uniform(0.4, 3.0, 8)
    bars = rng.normal(size=(8, 3)) * [1.0, 1.0, 300.0]
    numbers = [getattr(LAW.numbers, name) for name in ("sigma_0", "mu_s")]
    for pad in (AT_LOAD, LAYER):
        ours = front.model(patch("points"), LAW, pad=pad)
        values = [LAW.numbers._asdict()[name] for name in ours.names]
        places = [ours.names.index(name) for name in ("sigma_0", "mu_s")]
        vector, twists, loads, weight = front.arrays(values, v, f, bars)

        def power(p, twists=twists, loads=loads, weight=weight, ours=ours):
            run = front.models.rollout(
                ours, None, twists, loads, DT, parameters=p, method=method
            )
            return (run.wrenches * weight).sum()

        grad = front.library.func.grad if front.name == "torch" else front.library.grad
        found = front.plain(grad(power)(vector))[places] * numbers
        wanted = []
        for name in ("sigma_0", "mu_s"):
            ends = []
            for side in (1.0, -1.0):
                value = getattr(LAW.numbers, name) * (1.0 + 1e-6 * side)
                law = pf.LuGre(
                    **{"mu_s": 1.2, "sigma_1": 30.0, "elasto_plastic": 0.9, name: value}
                )
                model = pf.DistributedModel(patch("points"), law, pad=pad)
                ends.append((pf.rollout(model, None, v, f, DT).wrenches * bars).sum())
            wanted.append((ends[0] - ends[1]) / 2e-6)
        np.testing.assert_allclose(found, wanted, atol=1e-6 * np.abs(wanted).max())
        assert (abs(found[0]) < 1e-9 * abs(found[1])) == (pad is LAYER)
        other = front.arrays([2.0 * x if i == places[0] else x for i, x in enumerate(values)])[0]  # fmt: skip
        assert (abs(front.plain(power(other) / power(vector)) - 1.0) < 1e-9) == (pad is LAYER)  # fmt: skip


def test_few_discs_of_a_pad_are_those_of_numpy(front):
    model = pf.ReducedModel(patch("points"), LAW, cells=9, pad=LAYER)
    ours = front.model(patch("points"), LAW, "ReducedModel", cells=9, pad=LAYER)
    z, v, f = samples(model.state_shape)
    found = ours.step(*front.arrays(z, v, f), DT)
    for got, want in zip(found, model.step(z, v, f, DT), strict=True):
        assert_close(front.plain(got), want, 1e-9)


def test_a_pad_is_part_of_the_model(front):
    soft = pf.Pad.measured(4e3, common=0.4)
    with pytest.raises(InvalidValueError, match="sigma_1 must be 0 for a pad"):
        front.model(patch("points"), LAW, pad=soft)
    model = front.model(patch("points"), LAW, pad=LAYER)
    if front.name == "torch":
        assert model.pad == LAYER
        with pytest.raises(InvalidValueError, match="trainable must not contain weig"):
            front.model(patch("points"), LAW, pad=LAYER, trainable=("weights",))
        for other in (None, AT_LOAD):
            again = front.model(patch("points"), LAW, pad=other)
            with pytest.raises(RuntimeError, match="stiffness"):
                again.load_state_dict(model.state_dict())
        return
    leaves, structure = front.library.tree.flatten(model)
    again = front.library.tree.unflatten(structure, leaves)
    assert (again.stiffness == model.stiffness).all() and again.of_law is False
    run = front.models.rollout
    grad = front.library.grad(
        lambda w, method: run(
            model.replace(weights=w), None, np.ones((2, 3)), 1.0, DT, method=method
        ).wrenches.sum()
    )
    rule = "positions must be held fixed|weights must be held fixed"
    with pytest.raises(InvalidValueError, match=rule):
        grad(model.weights, "adjoint")
    assert np.isfinite(front.plain(grad(model.weights, None))).all()
