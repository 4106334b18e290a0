"""Models used by many threads at once give what they give alone, to the last bit."""

import copy
import pickle
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import planarfriction as pf

THREADS = 8
LAW = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
PLAIN = pf.LuGre(mu_s=1.2)
FINGER = pf.SoftFinger(c=6 * 0.02 / 9, n=1 / 3, k_per_newton=2.0, radius_max=0.01)
SOFT = pf.ContactPatch.rectangle(0.02, cells=9, pressure=FINGER)
FIXED = pf.ContactPatch.disc(0.01, cells=7)
LOADS = np.geomspace(0.7, 6.0, 160)

MODELS = {
    "distributed": lambda: pf.DistributedModel(FIXED, LAW),
    "distributed soft": lambda: pf.DistributedModel(SOFT, LAW),
    "reduced": lambda: pf.ReducedModel(FIXED, PLAIN, cells=12),
    "reduced soft": lambda: pf.ReducedModel(SOFT, LAW, cells=12),
    "published": lambda: pf.ReducedModelPublished(FIXED, LAW),
    "published soft": lambda: pf.ReducedModelPublished(
        SOFT, LAW, pf.LimitSurfaceTablePublished(SOFT, segments=4)
    ),
    "published soft, smooth": lambda: pf.ReducedModelPublished(
        SOFT, LAW, pf.LimitSurfaceTable(SOFT, segments=3)
    ),
    "published soft, rescaled": lambda: pf.ReducedModelPublished(
        SOFT,
        LAW,
        pf.LimitSurfaceTablePublished(SOFT, 4, normal_force=2.0),
        on_load_change="rescale",
    ),
}


def numbers(results):
    """All arrays in a result."""
    if isinstance(results, tuple):
        return [array for each in results for array in numbers(each)]
    return [np.array(results)]


def of_a_scene(model, load):
    """A short run whose load changes."""
    ramp = pf.Signal.sampled([0.0, 0.01], [load, 1.1 * load], hold="linear")
    data = pf.simulate(
        pf.Scene(pf.Body(0.2, 1e-4), [pf.Contact(model, ramp)], 0.01, save_every=5e-3)
    ).histories
    return tuple(data[name].values for name in ("x", "y", "theta", "fx", "fy", "tau"))


def of_a_batch(model, load):
    loads = np.array([load, 0.0, 1.3 * load])
    return model.step(
        np.zeros((3, *model.state_shape)), np.full((3, 3), 0.01), loads, 1e-3
    )


def of_one(what):
    def calculate(model, load):
        generator = np.random.default_rng(int(1e6 * load))
        state = 4e-7 * generator.normal(size=model.state_shape)
        twist = generator.normal(size=3) * [1e-3, 1e-3, 0.1]
        more = (1e-4,) if what.startswith("step") else ()
        return getattr(model, what)(state, twist, load, *more)

    return calculate


CALLS = {
    **{
        what: of_one(what)
        for what in ("step", "rate", "wrench", "jacobians", "step_jacobians")
    },
    "batch": of_a_batch,
    "simulate": of_a_scene,
    "pickle": lambda model, load: pickle.loads(pickle.dumps(model)).step(
        model.rest(), (0.01, 0.0, 0.0), load, 1e-3
    ),
    "copy": lambda model, load: copy.copy(model).step(
        model.rest(), (0.01, 0.0, 0.0), load, 1e-3
    ),
}


def at_once(work):
    """`work(i)` of `THREADS` threads, which begin together and take turns every microsecond."""
    start = threading.Barrier(THREADS)
    interval = sys.getswitchinterval()

    def begin(i):
        start.wait()
        return work(i)

    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(THREADS) as pool:
            return list(pool.map(begin, range(THREADS)))
    finally:
        sys.setswitchinterval(interval)


def compare(name, rounds, seed):
    """`rounds` random calls, shared by the threads, of one new model against those of another one used alone."""
    generator = np.random.default_rng(seed)
    chances = np.array(
        [1.0 if call not in ("simulate", "pickle", "copy") else 0.2 for call in CALLS]
    )
    calls = generator.choice(list(CALLS), size=rounds, p=chances / chances.sum())
    loads = generator.choice(LOADS, size=rounds)
    alone = MODELS[name]()
    together = MODELS[name]()

    def run(i):
        return [
            numbers(CALLS[call](together, load))
            for call, load in zip(calls[i::THREADS], loads[i::THREADS], strict=True)
        ]

    found = at_once(run)
    for i, thread in enumerate(found):
        for call, load, given in zip(
            calls[i::THREADS], loads[i::THREADS], thread, strict=True
        ):
            for array, true in zip(
                given, numbers(CALLS[call](alone, load)), strict=True
            ):
                np.testing.assert_array_equal(
                    array, true, err_msg=f"{call} at {load} N"
                )
    for load in LOADS[::40]:  # and it is sound afterwards
        for array, true in zip(
            numbers(CALLS["step"](together, load)),
            numbers(CALLS["step"](alone, load)),
            strict=True,
        ):
            np.testing.assert_array_equal(array, true)


@pytest.mark.parametrize("name", MODELS)
def test_threads_get_what_one_gets(name):
    compare(name, 80, seed=0)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_threads_get_what_one_gets_in_a_thousand_rounds(name):
    compare(name, 1000, seed=1)


SURFACES = {
    "cells": lambda patch: pf.LimitSurfaceCells(patch),
    "exact": lambda patch: pf.LimitSurfaceExact(patch),
    "table": lambda patch: pf.LimitSurfaceTable(patch, 5),
    "published table": lambda patch: pf.LimitSurfaceTablePublished(patch, 5),
    "ellipsoid": lambda patch: pf.LimitSurfaceEllipsoid(patch),
}


@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_is_built_by_many_threads_as_by_one(name):
    """All eight come first: what a surface makes on first use is made by all of them at once."""
    twist = np.random.default_rng(2).normal(size=(20, 3)) * [1.0, 1.0, 100.0]
    for grain in (None, pf.patch.friction_metric(0.3, 1.0, 0.6)):
        patch = FIXED.with_friction_metric(grain)
        if grain is not None and name == "published table":
            continue
        true = (
            SURFACES[name](patch).wrench(twist),
            SURFACES[name](patch).jacobian(twist),
        )
        for _ in range(4):
            surface = SURFACES[name](patch)
            found = at_once(
                lambda i, of=surface: (
                    of.wrench(twist),
                    of.jacobian(twist),
                    pickle.dumps(of),
                )[:2]
            )
            for thread in found:
                np.testing.assert_array_equal(thread[0], true[0])
                np.testing.assert_array_equal(thread[1], true[1])


@pytest.mark.torch
def test_torch_models_share_nothing_that_changes():
    torch = pytest.importorskip("torch")
    import planarfriction.torch as pft

    twist = torch.tensor([[0.01, 0.002, 0.3]]).expand(20, 3)

    def work(model):
        rolled = pft.rollout(model, None, twist, 1.3, 1e-3)
        stepped = model.step(model.rest(), twist[0], 1.3, 1e-3)
        gradients = torch.autograd.grad(
            rolled.wrenches.sum() + stepped[1].sum(), list(model.parameters())
        )
        return [tensor.detach().numpy() for tensor in (*rolled, *stepped, *gradients)]

    for make in (pft.ReducedModel, pft.ReducedModelPublished, pft.DistributedModel):
        alone = make(FIXED, LAW)
        together = make(FIXED, LAW)
        for found in at_once(lambda i, model=together: work(model)):
            for array, true in zip(found, work(alone), strict=True):
                np.testing.assert_array_equal(array, true)


def test_threads_that_ask_for_a_load_at_once_share_its_shape(monkeypatch):
    shapes = MODELS["published soft"]().shapes
    together = threading.Barrier(THREADS)
    built = []
    at = type(shapes._surface).at

    def build_slowly(surface, load):
        built.append(load)
        time.sleep(0.05)  # the other threads ask meanwhile
        return at(surface, load)

    def shape_at(_):
        together.wait()
        return shapes.shape_at(2.0)

    monkeypatch.setattr(type(shapes._surface), "at", build_slowly)
    with ThreadPoolExecutor(THREADS) as pool:
        first, *others = pool.map(shape_at, range(THREADS))
    assert built == [2.0] and all(other is first for other in others)
