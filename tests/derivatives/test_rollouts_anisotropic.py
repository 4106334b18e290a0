"""Rollouts on patches whose friction depends on the direction: PyTorch and JAX have the derivatives of NumPy."""

import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from tests.support.contacts import FOUR as PLAIN

GRAIN = pf.friction_metric(0.6, along=0.5, across=1.0)
LAW = pf.LuGre(mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.6))
PATCHES = {
    "grain": PLAIN.with_friction_metric(GRAIN),
    "of each cell": PLAIN.with_friction_metric(
        [pf.friction_metric(0.3 * i, 0.6, 1.1) for i in range(PLAIN.cells)]
    ),
}
REDUCED = "reduced", "of each cell"
PUBLISHED = "published", "grain"
DT, T = 1e-4, 10


def models(quick, slow):
    """Run one model in each front end, and the other one there in slow tests."""
    return pytest.mark.parametrize(
        "kind, patch", [quick, pytest.param(*slow, marks=pytest.mark.slow)]
    )


@functools.cache
def model_of(kind, patch):
    if kind == "published":
        return pf.ReducedModelPublished(
            PATCHES[patch], LAW, pf.LimitSurfaceTable(PATCHES[patch])
        )
    return pf.ReducedModel(PATCHES[patch], LAW)


def drive(model, seed=0):
    random = np.random.default_rng(seed)
    sizes = np.array([1.0, 1.0, 150.0])
    twists = np.cumsum(random.normal(size=(T, 3)), axis=0) * 3e-3 * sizes
    sizes_of_state = [3e-7, 3e-7, 2e-9] if model.state_shape == (3,) else 3e-7
    state = random.normal(size=model.state_shape) * sizes_of_state
    return state, twists, random.uniform(1.0, 3.0, T)


def bars(model, seed=1):
    random = np.random.default_rng(seed)
    sizes_of_state = [1e6, 1e6, 1e8] if model.state_shape == (3,) else 1e6
    return random.normal(size=(T, 3)) * [1.0, 1.0, 150.0], random.normal(
        size=model.state_shape
    ) * sizes_of_state


@pytest.mark.torch
@models(REDUCED, PUBLISHED)
def test_pytorch_has_the_same_numbers_and_gradients(kind, patch):
    torch = pytest.importorskip(
        "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
    )
    from planarfriction.torch import ReducedModel, ReducedModelPublished, rollout

    model = model_of(kind, patch)
    options = {"dtype": torch.float64}
    if kind == "published":
        module = ReducedModelPublished(PATCHES[patch], LAW, model.surface, **options)
    else:
        module = ReducedModel(PATCHES[patch], LAW, **options)
    state, twists, loads = drive(model)
    got = module(*map(torch.tensor, (state, twists[3], loads[3])))
    assert got[0].detach().numpy() == pytest.approx(
        model.rate(state, twists[3], loads[3]), rel=1e-12, abs=1e-18
    )
    assert got[1].detach().numpy() == pytest.approx(
        model.wrench(state, twists[3], loads[3]), rel=1e-12, abs=1e-15
    )
    bar, end_bar = map(torch.tensor, bars(model))
    wanted = derivatives.rollout_vjp(
        model, state, twists, loads, DT, bar.numpy(), end_bar.numpy()
    )
    for method in ("adjoint", "eager"):
        free = [
            torch.tensor(value, requires_grad=True) for value in (state, twists, loads)
        ]
        free.append(module.physical().detach().requires_grad_())
        run = rollout(module, *free[:3], DT, parameters=free[3], method=method)
        exact = derivatives.rollout(model, state, twists, loads, DT)
        assert run.wrenches.detach().numpy() == pytest.approx(
            exact.wrenches, rel=1e-12, abs=1e-13
        ), method
        slopes = torch.autograd.grad(
            (bar * run.wrenches).sum() + (end_bar * run.state).sum(), free
        )
        for slope, want in zip(slopes, wanted, strict=True):
            # sums in another order; slopes of the stiff steps amplify that
            assert slope.numpy() == pytest.approx(
                want, rel=1e-8, abs=1e-9 * np.abs(want).max()
            ), method


@pytest.mark.jax
@models(PUBLISHED, REDUCED)
def test_jax_has_the_same_numbers_and_gradients(kind, patch):
    jax = pytest.importorskip("jax", reason="needs the extra [jax]")
    import planarfriction.jax as pj

    before = jax.config.read("jax_enable_x64")
    jax.config.update("jax_enable_x64", True)
    try:
        model = model_of(kind, patch)
        if kind == "published":
            pytree = pj.ReducedModelPublished(PATCHES[patch], LAW, model.surface)
        else:
            pytree = pj.ReducedModel(PATCHES[patch], LAW)
        state, twists, loads = drive(model)
        # One program instead of one for each operation.
        step = jax.jit(lambda *given: pytree.step(*given, DT))
        for got, want in zip(
            step(state, twists[3], loads[3]),
            model.step(state, twists[3], loads[3], DT),
            strict=True,
        ):
            assert np.asarray(got) == pytest.approx(want, rel=1e-12, abs=1e-15)
        bar, end_bar = bars(model)

        def value(parameters, state, twists, loads):
            run = pj.rollout(pytree, state, twists, loads, DT, parameters=parameters)
            return (bar * run.wrenches).sum() + (end_bar * run.state).sum()

        gradient = jax.jit(jax.grad(value, (0, 1, 2, 3)))
        by, *slopes = gradient(pytree.parameters, state, twists, loads)
        wanted = derivatives.rollout_vjp(model, state, twists, loads, DT, bar, end_bar)
        for slope, want in zip((*slopes, np.stack(by)), wanted, strict=True):
            assert np.asarray(slope) == pytest.approx(
                want, rel=1e-11, abs=1e-12 * np.abs(want).max()
            )
    finally:
        jax.config.update("jax_enable_x64", before)
