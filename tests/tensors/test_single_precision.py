"""Pressure that follows moments in single precision, in PyTorch and JAX: what double precision gives, to 1e-4."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support import single_precision as single

PATCH = pf.ContactPatch.from_pressure([[0.0, 3.0, 1.0], [2.0, 5.0, 1.0]], 0.005)
GRAINED = PATCH.with_friction_metric(pf.friction_metric(0.4, 1.0, 1.6))
LAW = pf.LuGre(
    mu_c=0.8, mu_s=1.1, v_s=2e-3, sigma_1=300.0, sigma_2=0.3, elasto_plastic=0.7
)

LIMIT, BENDING = 1e-4, 1e-3
"""Largest error of wrenches in the load; of derivatives in the largest of a contact, or a tenth of that of all."""

EACH = [
    pytest.param(name, marks=() if name == "feet on a line" else pytest.mark.slow)
    for name in single.PATCHES
]


def in_torch(patch, precision):
    """Return a function of numbers: derivatives of wrenches by twist, load and moments, and the wrenches."""
    torch = pytest.importorskip("torch", reason="needs the extra [torch]")
    from planarfriction.torch import DistributedModel

    dtype = getattr(torch, precision)
    step = pulled_by(DistributedModel(patch, single.LAW, dtype=dtype))
    slopes = torch.func.vmap(torch.func.jacrev(step, argnums=(1, 2, 4), has_aux=True))

    def of_numbers(*inputs):
        found, wrenches = slopes(*(torch.tensor(each, dtype=dtype) for each in inputs))
        return [each.detach().numpy() for each in found], wrenches.detach().numpy()

    return of_numbers


def in_jax(patch, precision):
    """Return a function of numbers: derivatives of wrenches by twist, load and moments, and the wrenches."""
    jax = pytest.importorskip("jax", reason="needs the extra [jax]")
    from planarfriction.jax import DistributedModel

    with jax.enable_x64(precision == "float64"):
        step = pulled_by(DistributedModel(patch, single.LAW))
        slopes = jax.jit(jax.vmap(jax.jacrev(step, argnums=(1, 2, 4), has_aux=True)))

    def of_numbers(*inputs):
        with jax.enable_x64(precision == "float64"):
            return jax.tree.map(
                np.asarray, slopes(*(each.astype(precision) for each in inputs))
            )

    return of_numbers


def pulled_by(model):
    """Return a function of one contact: the wrench of a step, twice."""

    def pulled(state, twist, load, dt, moments):
        wrench = model.step(state, twist, load, dt, moments=moments)[1]
        return wrench, wrench

    return pulled


def compare(front, name, count, seed):
    """Return the largest errors of wrenches and of derivatives of a patch in single precision.

    Wrenches less what the damping `sigma_1 v` makes of the rounding of a velocity. Derivatives beside those of double
    precision at a twist and at one 1e-4 slower or faster, the nearest: those of a law jump where a bristle reaches its
    limit.
    """
    patch = single.PATCHES[name]
    model = pf.DistributedModel(patch, single.LAW)
    inputs = single.drawn(model, count, seed)
    slopes, wrenches = front(patch, "float32")(*inputs)
    assert wrenches.dtype == np.float32
    settled = single.settled(model, inputs)
    assert settled.mean() > 0.3
    in_double = front(patch, "float64")
    bent = np.inf
    for pace in (1.0, 1.0 - 1e-4, 1.0 + 1e-4):
        state, twist, *others = inputs
        errors = []
        for got, wanted in zip(
            slopes, in_double(state, pace * twist, *others)[0], strict=True
        ):
            assert got.dtype == np.float32 and np.isfinite(got).all()
            rows = (
                (got - wanted)[settled].reshape(settled.sum(), -1),
                wanted[settled].reshape(settled.sum(), -1),
            )
            off, size = (np.abs(each).max(1) for each in rows)
            errors.append(off / np.maximum(size, 0.1 * size.max()))
        bent = np.minimum(bent, np.max(errors, 0))
    rounding = (
        np.finfo(np.float32).eps * single.LAW.sigma_1 * single.fastest(model, inputs)
    )
    return single.error(model, inputs, wrenches, beside=rounding), bent.max()


@pytest.mark.torch
@pytest.mark.parametrize("name", single.PATCHES)
def test_steps_of_torch(name):
    wrench, slope = compare(in_torch, name, 200, seed=1)
    assert wrench < LIMIT and slope < BENDING


@pytest.mark.torch
@pytest.mark.parametrize("method", ["eager", "adjoint"])
@pytest.mark.parametrize("name", ["few discs", "table"])
def test_rollouts_and_gradients_of_torch(name, method):
    """Slip to and fro of two contacts, one lifted for a step; gradients have steep slopes of stiff bristles."""
    torch = pytest.importorskip("torch", reason="needs the extra [torch]")
    import planarfriction.torch as pt

    t = np.arange(6)
    twist = np.stack(
        [
            4e-3 * np.sin(0.9 * t + 0.2),
            3e-3 * np.cos(0.7 * t),
            0.8 * np.sin(1.1 * t + 0.3),
        ],
        -1,
    )
    load = np.stack([2.0 + np.cos(t), 0.5 + 0.3 * np.sin(t)])
    load[0, 3] = 0.0

    def rolled(dtype):
        if name == "table":
            model = pt.ReducedPlanarLuGre(
                radius=0.004, surface=pf.LimitSurfaceTable(GRAINED), dtype=dtype
            )
        else:
            model = pt.ReducedModel(PATCH, LAW, cells=4, dtype=dtype)
        given = [
            torch.tensor(x, dtype=dtype, requires_grad=True)
            for x in (np.stack([twist, -0.2 * twist]), load)
        ]
        run = pt.rollout(model, None, *given, 5e-4, method=method)
        loss = run.wrenches.square().mean() + 1e6 * run.state.square().sum()
        return [*run, *torch.autograd.grad(loss, [*model.parameters(), *given])]

    limits = [LIMIT, LIMIT] + 99 * [BENDING]
    for got, wanted, limit in zip(
        rolled(torch.float32), rolled(torch.float64), limits, strict=False
    ):
        assert got.dtype == torch.float32
        assert abs(got - wanted).max() < limit * max(abs(wanted).max(), 1e-12)


@pytest.mark.jax
@pytest.mark.parametrize("name", EACH)
def test_steps_of_jax(name):
    wrench, slope = compare(in_jax, name, 200, seed=2)
    assert wrench < LIMIT and slope < BENDING


@pytest.mark.jax
def test_rollouts_of_jax_side_by_side():
    """`jax.vmap` traces rollouts again, out of the context in which a step was traced in double precision."""
    jax = pytest.importorskip("jax", reason="needs the extra [jax]")
    from planarfriction.jax import DistributedModel

    patch = single.PATCHES["feet on a line"]
    inputs = single.drawn(pf.DistributedModel(patch, single.LAW), 200, 3)

    def rollout(state, twist, load, dt, moments):
        return jax.lax.scan(
            lambda z, _: model.step(z, twist, load, dt, moments=moments),
            state,
            None,
            length=1,
        )[1][0]

    with jax.enable_x64(False):  # other tests may have left it on
        model = DistributedModel(patch, single.LAW)
        wrenches = np.asarray(
            jax.jit(jax.vmap(rollout))(*(each.astype(np.float32) for each in inputs))
        )
    assert wrenches.dtype == np.float32
    assert (
        single.error(pf.DistributedModel(patch, single.LAW), inputs, wrenches) < LIMIT
    )


FRONTS = [
    pytest.param(in_torch, marks=pytest.mark.torch),
    pytest.param(in_jax, marks=pytest.mark.jax),
]


@pytest.mark.slow
@pytest.mark.parametrize("name", single.PATCHES)
@pytest.mark.parametrize("front", FRONTS)
def test_many_steps(front, name):
    worst = np.max([compare(front, name, 2000, seed) for seed in range(3, 6)], 0)
    print(
        f"\n{front.__name__} {name}: wrenches {worst[0]:.1e}, derivatives {worst[1]:.1e}"
    )
    assert worst[0] < LIMIT and worst[1] < BENDING
