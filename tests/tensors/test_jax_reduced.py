"""The reduced model in JAX: closed forms, agreement with the compiled one and with PyTorch, gradients."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest

import planarfriction as pf

jax = pytest.importorskip("jax", reason="needs the extra [jax]")
import jax.numpy as jnp  # noqa: E402

import planarfriction.jax as pj  # noqa: E402

pytestmark = pytest.mark.jax

PATCH = pf.ContactPatch.from_pressure(np.random.default_rng(4).uniform(0.0, 1.0, (5, 6)), 0.002, name="lopsided")
LAWS = {
    "plain": pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7),
    "elasto-plastic": pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7, elasto_plastic=pf.ElastoPlastic(0.7)),
}
SMALL = {"segments": 8, "speeds": 8}
STATE_SIZE, TWIST_SIZE = 1e-6, np.array([1e-3, 1e-3, 0.2])
WEIGHTS = np.array([1.0, 1.0, 100.0])


@pytest.fixture(autouse=True, scope="module")
def double_precision():
    before = {name: jax.config.read(name) for name in ("jax_enable_x64", "jax_disable_most_optimizations")}
    for name in before:
        jax.config.update(name, True)  # without optimisations compilation is quicker
    pair.cache_clear()
    yield
    for name, value in before.items():
        jax.config.update(name, value)


@functools.cache
def pair(law: str):
    """The same model in NumPy and in JAX."""
    model = pf.models.MomentModel(PATCH, LAWS[law], **SMALL)
    return model, pj.MomentModel(PATCH, LAWS[law], **SMALL)


def samples(model: pf.models.MomentModel, seed: int = 1):
    """States in stick and slip, twists at kinks, on the edges and corners of the cube, and of all speeds; loads."""
    rng = np.random.default_rng(seed)
    directions = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
    count = len(directions) + 60
    state = rng.normal(size=(count, 3)) * STATE_SIZE * 10.0 ** rng.uniform(-2, 0.3, (count, 1))
    twist = rng.normal(size=(count, 3)) * TWIST_SIZE * 10.0 ** rng.uniform(-2, 2, (count, 1))
    load = rng.uniform(0.2, 3.0, count)
    twist[: len(directions)] = 1e-3 * directions @ np.linalg.inv(model.reduction.shape_at(None).factor).T
    state[:5], load[5], load[-3], twist[4], twist[-1], twist[-2] = 0.0, 0.0, 0.0, 0.0, 0.0, [0.0, 0.0, 0.3]
    return state, twist, load


def sway(count: int) -> np.ndarray:
    t = 1e-4 * np.arange(count)
    return np.stack([2e-3 * np.sin(300 * t) + 1e-4, 1e-3 * np.cos(200 * t), 0.3 * np.sin(150 * t)], -1)


def close(actual, expected, tolerance: float = 1e-12):
    """Each component to `tolerance` of its largest value."""
    actual, expected = np.asarray(actual), np.asarray(expected)
    assert actual.shape == expected.shape
    assert (np.abs(actual - expected) <= tolerance * np.abs(expected).max(axis=0)).all()


@functools.cache
def slopes():
    """Derivatives of a step of the elasto-plastic model by state, twist, load and law, for a batch."""

    def step(z, v, f_n, parameters, dt):
        return pj.step(pair("elasto-plastic")[1].replace(parameters=parameters), z, v, f_n, dt)

    return jax.jit(jax.vmap(jax.jacrev(step, (0, 1, 2, 3)), (0, 0, 0, None, None)))


@functools.cache
def loss_and_slopes(method: str = "eager"):
    """Loss of a roll-out of the elasto-plastic model with its derivatives by law and twists, and the roll-out."""

    def loss(parameters, twists):
        model = pair("elasto-plastic")[1]
        run = pj.rollout(model, None, twists, 2.0, 1e-4, parameters=parameters, method=method)
        return jnp.sum(jnp.square(run.wrenches * WEIGHTS)), run

    return jax.jit(jax.value_and_grad(loss, (0, 1), has_aux=True))


# ---------------------------------------------------------------------- closed forms


def test_a_stuck_patch_is_a_spring():
    numpy_model, model = pair("elasto-plastic")
    state, twist, load = samples(numpy_model)
    by_state = slopes()(1e-3 * state, 0.0 * twist, np.full_like(load, 2.0), model.parameters, 1e-3)[1][0]
    exact = np.broadcast_to(-2.0 * 1e6 * numpy_model.reduction.shape_at(None).factor.T, by_state.shape)
    np.testing.assert_allclose(by_state, exact, rtol=1e-13, atol=1e-6)


# ---------------------------------------------------------------------- the compiled model


@pytest.mark.parametrize("law", LAWS)
def test_it_equals_the_compiled_model(law):
    numpy_model, model = pair(law)
    inputs = samples(numpy_model)

    @jax.jit
    def evaluate(z, v, f_n, dt):
        return pj.rate(model, z, v, f_n), pj.wrench(model, z, v, f_n), pj.step(model, z, v, f_n, dt)

    for dt in (1e-6, 1e-4, 1e-2, 1e3):
        rate, wrench, step = evaluate(*inputs, dt)
        close(rate, numpy_model.rate(*inputs))
        close(wrench, numpy_model.wrench(*inputs))
        for got, wanted in zip(step, numpy_model.step(*inputs, dt), strict=True):
            close(got, wanted)


@pytest.mark.slow
def test_a_patch_whose_shape_follows_the_load_keeps_that_of_one_load():
    patch = pf.ContactPatch.disc(0.01, cells=9, pressure=pf.SoftFinger(c=0.005, n=1 / 3, k=2.0))
    state, twist = [1e-7, 1e-7, 2e-7], [1e-3, 2e-4, 0.1]
    model = pj.MomentModel(patch, LAWS["plain"], 0.3, **SMALL)
    wanted = pf.models.MomentModel(patch, LAWS["plain"], **SMALL, load_error=0.0).step(state, twist, 0.3, 1e-4)
    for got, want in zip(model.step(jnp.array(state), jnp.array(twist), 0.3, 1e-4), wanted, strict=True):
        np.testing.assert_allclose(got, want, rtol=1e-12)
    with pytest.raises(pf.FrictionError, match="normal_force must be"):
        pj.MomentModel(patch, LAWS["plain"], parts=1)


def test_gradients_are_the_analytic_jacobians():
    numpy_model, model = pair("elasto-plastic")
    inputs = samples(numpy_model)
    loaded = inputs[2] > 0.0  # without load: to the load alone
    for dt in (1e-6, 1e-4, 1e-2):
        new, wrench = slopes()(*inputs, model.parameters, dt)
        exact = numpy_model.step_jacobians(*inputs, dt)
        for got, wanted in zip((*new[:2], *wrench[:3]), exact, strict=True):
            assert np.abs(got - wanted)[loaded].max() <= 2e-11 * np.abs(wanted).max()


def test_gradients_at_kinks_are_finite():
    numpy_model, model = pair("elasto-plastic")
    z, v, f_n = samples(numpy_model)
    states = [[0, 0, 0], [1e-6, 0, 0], [0, 0, 1e-6], [2e-6, 0, 0]]
    twists = [[0, 0, 0], [0, 0, 0.3], [0, 0, -0.3], [2e-3, 0, 0], [0, -2e-3, 0], [1e-160, 0, 0]]
    kinks = list(itertools.product(states, twists, (0.0, 1.0)))
    z[: len(kinks)], v[: len(kinks)], f_n[: len(kinks)] = zip(*kinks, strict=True)
    for dt in (0.0, 3e-4):
        found = slopes()(z, v, f_n, model.parameters, dt)
        assert all(np.isfinite(slope).all() for slope in jax.tree.leaves(found))


@pytest.mark.slow
def test_a_roll_out_is_that_of_numpy_and_its_gradient_that_of_differences():
    numpy_model, model = pair("elasto-plastic")
    (_, run), (by_law, _) = loss_and_slopes()(model.parameters, sway(40))
    z = numpy_model.rest()
    for twist in sway(40):
        z, wrench = numpy_model.step(z, twist, 2.0, 1e-4)
    np.testing.assert_allclose(run.state, z, rtol=1e-10, atol=1e-18)
    np.testing.assert_allclose(run.wrenches[-1], wrench, rtol=1e-10)
    for name, now in model.parameters._asdict().items():
        ends = [
            loss_and_slopes()(model.parameters._replace(**{name: now * (1.0 + h)}), sway(40))[0][0]
            for h in (1e-6, -1e-6)
        ]
        difference = (ends[0] - ends[1]) / 2e-6
        assert float(getattr(by_law, name) * now) == pytest.approx(float(difference), rel=1e-5, abs=1e-7), name


def test_the_adjoint_is_that_of_numpy():
    numpy_model, model = pair("elasto-plastic")
    (_, run), (by_law, by_twist) = loss_and_slopes("adjoint")(model.parameters, sway(40))
    _, wrenches = pf.rollout(numpy_model, None, sway(40), 2.0, 1e-4)
    exact = pf.derivatives.rollout_vjp(numpy_model, None, sway(40), 2.0, 1e-4, 2.0 * WEIGHTS**2 * wrenches)
    np.testing.assert_allclose(run.wrenches, wrenches, rtol=1e-13)  # the same code
    np.testing.assert_allclose(np.stack(by_law), exact.parameters, rtol=1e-12)
    np.testing.assert_allclose(by_twist, exact.twist, rtol=1e-12)


def test_the_adjoint_goes_through_vmap():
    model, loads, parameters = pair("plain")[1], np.array([1.0, 2.0, 0.0]), pair("plain")[1].parameters

    def slope(load, mu_c):
        changed = parameters._replace(mu_c=mu_c)
        return jax.grad(
            lambda p: pj.rollout(model, None, sway(9), load, 1e-4, parameters=p, method="adjoint").wrenches.sum()
        )(changed).mu_c

    together = jax.vmap(slope)(loads, jnp.array([0.8, 0.9, 1.0]))
    for load, mu_c, value in zip(loads, (0.8, 0.9, 1.0), together, strict=True):
        assert float(value) == pytest.approx(float(slope(load, mu_c)), rel=1e-12)


@pytest.mark.slow
def test_the_adjoint_agrees_with_the_eager_roll_out():
    parameters = pair("elasto-plastic")[1].parameters
    (_, (by_law, by_twist)), (_, (law, twist)) = (
        loss_and_slopes(method)(parameters, sway(40)) for method in ("adjoint", "eager")
    )
    np.testing.assert_allclose(np.stack(by_law), np.stack(law), rtol=1e-8)
    close(by_twist, twist, 1e-8)


def law_of(law: str = "elasto-plastic"):
    return jnp.stack(pair(law)[1].parameters)


def square(method: str | None, steps: int = 20):
    """Loss of the law in a row, and of twists."""

    def loss(parameters, twists):
        run = pj.rollout(pair("elasto-plastic")[1], None, twists, 2.0, 1e-4, parameters=parameters, method=method)
        return jnp.square(run.wrenches * WEIGHTS).sum()

    return loss, (law_of(), jnp.asarray(sway(steps)))


@pytest.mark.slow
@pytest.mark.parametrize("method", [None, "adjoint"])
def test_forward_mode_is_reverse_mode(method):
    loss, at = square(method)
    by_law, by_twist = jax.jit(jax.jacfwd(loss, (0, 1)))(*at)
    law, twist = jax.grad(loss, (0, 1))(*at)
    np.testing.assert_allclose(by_law, law, rtol=1e-9)  # sums in another order
    close(by_twist, twist, 1e-10)


def test_a_roll_out_of_a_batch_has_the_gradients_of_its_members():
    loss, (law, twists) = square(None)
    laws = jnp.stack([law, 1.1 * law])
    together = jax.grad(lambda laws: jax.vmap(loss, (0, None))(laws, twists).sum())(laws)
    by_twist = jax.grad(lambda twists: jax.vmap(loss, (0, None))(laws, twists).sum())(twists)
    each = [jax.grad(loss, (0, 1))(one, twists) for one in laws]
    np.testing.assert_allclose(together, np.stack([slope for slope, _ in each]), rtol=1e-12)
    close(by_twist, each[0][1] + each[1][1], 1e-12)


@pytest.mark.parametrize(
    "twice", [jax.hessian, lambda f: jax.grad(lambda x: jax.grad(f)(x).sum()), lambda f: jax.jacfwd(jax.jacfwd(f))]
)
def test_second_derivatives_by_the_adjoint_are_one_line(twice):
    loss, (law, twists) = square("adjoint")
    with pytest.raises(pf.FrictionError, match="leave method out, or use 'eager', to differentiate twice") as caught:
        twice(lambda law: loss(law, twists))(law)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_without_a_method_jax_does_what_the_adjoint_cannot():
    def derivatives(method):
        loss, (law, twists) = square(method)
        hessian = jax.jit(jax.hessian(lambda law: loss(law, twists)))(law)
        _, product = jax.jit(lambda x: jax.jvp(jax.grad(lambda law: loss(law, twists)), (law,), (x,)))(law)

        def by_step(dt):
            return pj.rollout(pair("elasto-plastic")[1], None, twists, 2.0, dt, method=method).wrenches.sum()

        return law[:, None] * hessian * law, law * product, jax.grad(by_step)(1e-4)

    for found, wanted in zip(derivatives(None), derivatives("eager"), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


# ---------------------------------------------------------------------- PyTorch


@pytest.mark.torch
@pytest.mark.slow
def test_gradients_of_roll_outs_are_those_of_pytorch():
    torch = pytest.importorskip("torch", reason="needs PyTorch: pip install 'planarfriction[torch]'")
    from planarfriction.torch import MomentModel, rollout

    model = MomentModel(PATCH, LAWS["elasto-plastic"], dtype=torch.float64, **SMALL)
    parameters, twists = model.physical().detach().requires_grad_(), torch.tensor(sway(40), requires_grad=True)
    wrenches = rollout(model, None, twists, 2.0, 1e-4, parameters=parameters).wrenches
    theirs = torch.autograd.grad((wrenches * torch.tensor(WEIGHTS)).square().sum(), [parameters, twists])
    _, (by_law, by_twist) = loss_and_slopes()(pair("elasto-plastic")[1].parameters, sway(40))
    np.testing.assert_allclose(np.stack(by_law), theirs[0], rtol=1e-9, atol=0.0)
    close(by_twist, theirs[1], 1e-9)


# ---------------------------------------------------------------------- use


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: pj.MomentModel("disc", LAWS["plain"], parts=1), "patch must be a ContactPatch"),
        (lambda: pair("plain")[1].replace(weights=1.0), "leaf must be one of parameters, shape, got 'weights'"),
        (
            lambda: jax.grad(lambda m: pj.rollout(m, None, sway(4), 1.0, 1e-4, method="adjoint").state.sum())(
                pair("plain")[1]
            ),
            "shape must be held fixed with method='adjoint'",
        ),
    ],
)
def test_wrong_input_is_one_line(make, message):
    with pytest.raises(pf.FrictionError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
