"""Pressure that follows moments in single precision, in PyTorch and JAX: what double precision gives, to 1e-4."""

from __future__ import annotations

import numpy as np
import pytest

import planarfriction as pf
from tests.support import single_precision as single

LIMIT, BENDING = 1e-4, 1e-3
"""Largest error of wrenches in the load, and of derivatives in the largest of a contact."""

QUICK = "three feet", "feet on a line", "24 discs"
EACH = [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in single.PATCHES]
IN_JAX = [pytest.param(name, marks=() if name in QUICK[1:2] else pytest.mark.slow) for name in single.PATCHES]


def in_torch(patch, precision: str):
    """Return functions of numbers: wrenches of steps, and their derivatives by twist, load and moments."""
    torch = pytest.importorskip("torch", reason="needs the extra [torch]")
    from planarfriction.torch import DistributedModel

    dtype = getattr(torch, precision)
    model = DistributedModel(patch, single.LAW, dtype=dtype)

    def pulled(state, twist, load, dt, moments):
        return model.step(state, twist, load, dt, moments=moments)[1]

    def slopes(*inputs):
        return torch.func.vmap(torch.func.jacrev(pulled, argnums=(1, 2, 4)))(*inputs)

    def of_numbers(function, *inputs):
        found = function(*(torch.tensor(each, dtype=dtype) for each in inputs))
        return [each.detach().numpy() for each in found] if isinstance(found, tuple) else found.detach().numpy()

    return lambda *inputs: of_numbers(pulled, *inputs), lambda *inputs: of_numbers(slopes, *inputs)


def in_jax(patch, precision: str):
    """Return functions of numbers: wrenches of steps, and their derivatives by twist, load and moments."""
    jax = pytest.importorskip("jax", reason="needs the extra [jax]")
    from planarfriction.jax import DistributedModel

    def pulled(state, twist, load, dt, moments):
        return model.step(state, twist, load, dt, moments=moments)[1]

    with jax.enable_x64(precision == "float64"):
        model = DistributedModel(patch, single.LAW)
        step, slopes = jax.jit(pulled), jax.jit(jax.vmap(jax.jacrev(pulled, argnums=(1, 2, 4))))

    def of_numbers(function, *inputs):
        with jax.enable_x64(precision == "float64"):
            return jax.tree.map(np.asarray, function(*(each.astype(precision) for each in inputs)))

    return lambda *inputs: of_numbers(step, *inputs), lambda *inputs: of_numbers(slopes, *inputs)


def compare(front, name: str, count: int, seed: int) -> tuple[float, float]:
    """Return the largest errors of wrenches and of derivatives of a patch in single precision."""
    patch = single.PATCHES[name]
    model = pf.DistributedModel(patch, single.LAW)
    inputs = single.drawn(model, count, seed)
    (step, slopes), (_, exact) = front(patch, "float32"), front(patch, "float64")
    found = step(*inputs)
    assert found.dtype == np.float32
    settled, bent = single.settled(model, inputs), 0.0
    assert settled.mean() > 0.3
    for got, wanted in zip(slopes(*inputs), exact(*inputs), strict=True):
        assert got.dtype == np.float32 and np.isfinite(got).all()
        rows = (got - wanted)[settled].reshape(settled.sum(), -1), wanted[settled].reshape(settled.sum(), -1)
        off, size = (np.abs(each).max(1) for each in rows)
        bent = max(bent, (off / np.maximum(size, 1e-3 * size.max())).max())
    return single.error(model, inputs, found), bent


@pytest.mark.torch
@pytest.mark.parametrize("name", EACH)
def test_steps_of_torch(name):
    wrench, slope = compare(in_torch, name, 200, seed=1)
    assert wrench < LIMIT and slope < BENDING


@pytest.mark.jax
@pytest.mark.parametrize("name", IN_JAX)
def test_steps_of_jax(name):
    wrench, slope = compare(in_jax, name, 200, seed=2)
    assert wrench < LIMIT and slope < BENDING


@pytest.mark.slow
@pytest.mark.parametrize("name", single.PATCHES)
@pytest.mark.parametrize("front", [pytest.param(in_torch, marks=pytest.mark.torch), pytest.param(in_jax, marks=pytest.mark.jax)])
def test_many_steps(front, name):
    worst = np.max([compare(front, name, 2000, seed) for seed in range(3, 6)], 0)
    print(f"\n{front.__name__} {name}: wrenches {worst[0]:.1e}, derivatives {worst[1]:.1e}")
    assert worst[0] < LIMIT and worst[1] < BENDING
