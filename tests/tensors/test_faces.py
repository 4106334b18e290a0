"""Pads with a common compliance in PyTorch and JAX: values and slopes of NumPy's models, whose steps find the face."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.tensors import faces
from tests.support.refusals import refused
from tests.tensors.test_discs import assert_close

RADIUS, DT = 0.01, 1e-3
ROUND = pf.ContactPatch.disc(
    RADIUS, cells=7, pressure=lambda x, y: max(RADIUS**2 - x * x - y * y, 0.0) ** 0.5
)
LAW = pf.LuGre(mu_s=1.2, mu_c=0.8, sigma_1=0.0, sigma_2=0.3, elasto_plastic=0.9)
PLAIN = pf.LuGre(mu_s=1.2, sigma_1=0.0, gamma=1.7)
SOFT = pf.Pad.measured(8e3, common=0.6)
CASES = {
    "half-space, discs": ("ReducedModel", LAW, pf.Pad.half_space(0.2e6, 0.49)),
    "measured, points": ("DistributedModel", PLAIN, SOFT),
}


def pair(front, case, single=False):
    """The same model in NumPy and in a front end."""
    kind, law, pad = CASES[case]
    few = {"cells": 8} if kind == "ReducedModel" else {}
    model = getattr(pf, kind)(ROUND, law, pad=pad, **few).reduction
    return model, front.model(ROUND, law, kind, single=single, pad=pad, **few)


def samples(model, count=40):
    """States on the way to slip, twists that go from far before it to far beyond, loads; some rest."""
    rng = np.random.default_rng(0)
    load = 10.0 ** rng.uniform(-2.0, 1.0, count)
    full = 2.0 * load / model.pad.pieces(model.patch, model.law).sum() / DT
    speeds = full[:, None] * [1.0, 1.0, 100.0]
    state = np.zeros((count, *model.state_shape))
    for _ in range(3):
        twist = (
            speeds
            * rng.normal(size=(count, 3))
            * 10.0 ** rng.uniform(-2.0, 1.0, (count, 1))
        )
        state, _ = model.step(state, twist, load * rng.uniform(0.5, 1.5, count), DT)
    twist = (
        speeds
        * rng.normal(size=(count, 3))
        * 10.0 ** rng.uniform(-2.0, 1.5, (count, 1))
    )
    state[:3] = twist[2:5] = load[5] = twist[6, :2] = twist[7, 2] = 0.0
    return state, twist, load


@pytest.mark.parametrize("case", CASES)
def test_values_are_those_of_numpy(front, case):
    model, ours = pair(front, case)
    assert ours.state_shape == model.state_shape
    z, v, f = samples(model)
    at = front.arrays(z, v, f)
    times = 10.0 ** np.random.default_rng(1).uniform(-6.0, -1.0, len(f))
    found = ours.wrench(*at), ours.rate(*at), *ours.step(*at, *front.arrays(times))
    wanted = model.wrench(z, v, f), model.rate(z, v, f), *model.step(z, v, f, times)
    for got, want in zip(found, wanted, strict=True):
        assert_close(front.plain(got), want, 1e-9)
    m = np.random.default_rng(3).uniform(-2e-3, 2e-3, (len(f), 2)) * f[:, None]
    found = ours.step(*at, DT, moments=front.array(m))
    for got, want in zip(found, model.step(z, v, f, DT, moments=m), strict=True):
        assert_close(front.plain(got), want, 1e-9)


@pytest.mark.parametrize("case", CASES)
def test_slopes_are_those_of_numpy(front, case):
    model, ours = pair(front, case)
    inputs = samples(model)
    step = lambda z, v, f: ours.step(z, v, f, DT)
    new, wrench = front.slopes(step, *front.arrays(*inputs))
    loaded = inputs[2] > 0.0
    wanted = model.step_jacobians(*inputs, DT)
    for got, want in zip((*new, *wrench), wanted, strict=True):
        got = front.plain(got)
        assert np.isfinite(got).all()
        assert_close(got[loaded], want[loaded], 1e-9)


@pytest.mark.slow
def test_second_derivatives_are_differences_of_the_first(front):
    model, ours = pair(front, "half-space, discs")
    z, v, f = (each[20] for each in samples(model))
    v = 0.3 * v / np.abs(v[:2]).max() * np.array([1.0, 1.0, 0.1]) * f * 1e-1
    state, load, weight = front.arrays(z, f, [1.0, 1.0, 200.0])
    power = lambda v: (ours.step(state, v, load, DT)[1] * weight).sum()
    grad = front.grad(power)
    along = np.array([1.0, -0.5, 30.0])
    direction = front.array(along)
    twice = front.grad(lambda v: (front.grad(power)(v) * direction).sum())
    step = 1e-6 * np.abs(v).max() / np.abs(along[:2]).max()
    more, less = (
        front.plain(grad(front.array(v + side * step * along))) for side in (0.5, -0.5)
    )
    wanted = (more - less) / step
    assert_close(front.plain(twice(front.array(v))), wanted, 1e-5)


def test_single_precision_is_within_that_of_the_load(front):
    model, ours = pair(front, "half-space, discs", single=True)
    z, v, f = samples(model)
    at = front.arrays(z, v, f, single=True)
    new, wrench = ours.step(*at, DT)
    wanted, pull = model.step(z, v, f, DT)
    assert "float32" in str(new.dtype) and "float32" in str(wrench.dtype)
    assert_close(front.plain(new), wanted, 1e-5)
    limit = np.maximum(f, 1e-9)[:, None] * [1.0, 1.0, RADIUS]
    assert (np.abs(front.plain(wrench) - pull) <= 1e-5 * limit).all()


def test_rollouts_are_steps_whose_slopes_are_differences(front):
    model, ours = pair(front, "half-space, discs")
    rng = np.random.default_rng(5)
    z, v, f = (each[20:28] for each in samples(model))
    z, v = z[0], 0.3 * v
    f = rng.uniform(0.5, 1.5, 8) * f[0]
    bars = rng.normal(size=(8, 3)) * [1.0, 1.0, 200.0]
    weight = front.array(bars)

    def power(z, v, f, p=None):
        run = front.models.rollout(ours, z, v, f, DT, parameters=p)
        return (run.wrenches * weight).sum()

    def numpy(z, v, f, law=LAW):
        run = pf.rollout(model.with_law(law), z, v, f, DT)
        return (run.wrenches * bars).sum()

    at = front.arrays(z, v, f)
    assert abs(front.plain(power(*at)) / numpy(z, v, f) - 1.0) < 1e-9
    values = LAW.numbers._asdict()
    vector = front.array([values[name] for name in ours.names])
    slopes = front.slopes(power, *(each[None] for each in (*at, vector)))
    for i, (slope, value) in enumerate(zip(slopes[:3], (z, v, f), strict=True)):
        step = 1e-6 * rng.normal(size=value.shape) * np.abs(value).max()
        both = [
            [each + side * step if j == i else each for j, each in enumerate((z, v, f))]
            for side in (0.5, -0.5)
        ]
        more, less = (numpy(*each) for each in both)
        assert abs((front.plain(slope)[0] * step).sum() / (more - less) - 1.0) < 1e-6
    by = dict(zip(ours.names, front.plain(slopes[3])[0], strict=True))
    ends = [
        numpy(
            z,
            v,
            f,
            pf.LuGre(
                mu_s=1.2 * side, mu_c=0.8, sigma_1=0.0, sigma_2=0.3, elasto_plastic=0.9
            ),
        )
        for side in (1.0 + 1e-6, 1.0 - 1e-6)
    ]
    assert by["mu_s"] * 2.4e-6 == pytest.approx(ends[0] - ends[1], rel=1e-6)
    assert abs(by["sigma_0"] * values["sigma_0"]) < 1e-9 * abs(by["mu_s"])
    assert by["sigma_1"] == 0.0
    with refused("method must be 'eager' for a pad with a common compliance"):
        front.models.rollout(ours, *at, DT, method="adjoint")


def test_a_face_that_is_not_found_leaves_numbers(front, monkeypatch):
    model, ours = pair(front, "half-space, discs")
    z, v, f = samples(model)
    monkeypatch.setattr(faces, "TRIES", 1)
    front.forget()
    new, wrench = (front.plain(each) for each in ours.step(*front.arrays(z, v, f), DT))
    front.forget()
    wanted, _ = model.step(z, v, f, DT)
    assert (
        np.isfinite(wrench).all()
        and np.isfinite(new).all()
        and not np.allclose(new, wanted, rtol=1e-6)
    )


def test_fields_of_a_contact_are_those_of_numpy(front):
    model, ours = pair(front, "half-space, discs")
    z, v, f = samples(model)
    at = front.arrays(z, v, f)
    markers = pf.tactile.markers(model, [[0.0, 0.0], [0.02, 0.0]])
    for name in ("forces", "slip_ratio"):
        field = getattr(pf.tactile, name)
        assert_close(front.plain(field(ours, *at)), field(model, z, v, f), 1e-12)
    moved = pf.tactile.displacement(ours, at[0], markers)
    assert_close(front.plain(moved), pf.tactile.displacement(model, z, markers), 1e-12)


def test_the_compliance_is_part_of_the_model(front):
    _, ours = pair(front, "measured, points")
    hard = front.model(ROUND, PLAIN, pad=pf.Pad.measured(2e4))
    if front.name == "torch":
        with pytest.raises(RuntimeError, match="compliance"):
            hard.load_state_dict(ours.state_dict())
        return
    # Softer by some thousandths, as by the slope by the compliance.
    step = lambda c: ours.replace(compliance=c).step(
        ours.rest(), np.array([1e-3, 0.0, 0.1]), 1.0, DT
    )[1][0]
    soft = ours.compliance
    slope = float((front.grad(step)(soft) * soft).sum())
    more, less = (float(step((1.0 + side) * soft)) for side in (1e-5, -1e-5))
    assert slope == pytest.approx((more - less) / 2e-5, rel=1e-6)


def test_steps_of_pytorch_go_through_its_transformations():
    torch = pytest.importorskip("torch")
    from planarfriction.torch import DistributedModel

    _, law, pad = CASES["measured, points"]
    few = pf.ContactPatch.disc(RADIUS, cells=3)
    model = DistributedModel(few, law, pad=pad, dtype=torch.float64)
    numpy = pf.DistributedModel(few, law, pad=pad)
    given = [torch.tensor(each) for each in samples(numpy, 12)]
    step = lambda *at: model.step(*at, DT)
    wanted = step(*given)
    compiled = torch.compile(step, backend="eager", fullgraph=True)
    with torch.inference_mode():
        inferred = step(*(each.clone() for each in given))
    for found in (compiled(*given), torch.func.vmap(step)(*given), inferred):
        for got, want in zip(found, wanted, strict=True):
            torch.testing.assert_close(got, want, rtol=1e-11, atol=1e-14)
    backwards = torch.func.vmap(torch.func.jacrev(step, 1))(*given)[1]
    forwards = torch.func.vmap(torch.func.jacfwd(step, 1))(*given)[1]
    torch.testing.assert_close(forwards, backwards, rtol=1e-10, atol=1e-10)
    from torch.autograd import forward_ad

    with forward_ad.dual_level():
        dual = forward_ad.make_dual(given[1], torch.ones_like(given[1]))
        change = forward_ad.unpack_dual(step(given[0], dual, given[2])[1]).tangent
    torch.testing.assert_close(change, backwards.sum(-1), rtol=1e-10, atol=1e-10)
    step(*given)[1].square().sum().backward()
    assert all(raw.grad.isfinite() for raw in model.parameters())


def test_jax_compiles_nothing_in_a_second_call(caplog):
    """Also outside of `jit`, where a loop that is made anew in each call would be compiled in each."""
    jax = pytest.importorskip("jax")
    import planarfriction.jax as pj

    few = pf.ContactPatch.disc(RADIUS, cells=2)
    plain = pj.DistributedModel(few, PLAIN)
    soft = pj.DistributedModel(few, PLAIN, pad=SOFT)
    v = np.ones(3)
    calls = [
        lambda: soft.step(soft.rest(), v, 1.0, DT),
        lambda: plain.step(plain.rest(), v, 1.0, DT, moments=np.zeros(2)),
        lambda: pj.rollout(plain, None, v[None], 1.0, DT, method="eager"),
    ]
    for call in calls:
        call()
    with jax.log_compiles():
        for call in calls:
            call()
        assert "Compiling" not in caplog.text
        jax.jit(lambda: 1.0)()
    assert "Compiling" in caplog.text


def test_loops_of_jax_keep_their_conditions():
    """Side by side, a loop whose condition is rounded differently inside and outside of its body never ends."""
    jax = pytest.importorskip("jax")
    import planarfriction.jax as pj
    from tests.tensors.test_jax import conditions

    model = pj.DistributedModel(ROUND, PLAIN, pad=SOFT)
    at = model.rest(3), np.ones((3, 3)), np.ones(3), DT
    found = jax.make_jaxpr(jax.vmap(model.step, (0, 0, 0, None)))(*at)
    loops = list(conditions(found.jaxpr))
    assert len(loops) == 1
    exact = {"and", "or", "not", "lt", "gt", "reduce_or", "convert_element_type"}
    assert not set().union(*loops) - exact
