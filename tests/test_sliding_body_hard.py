"""Steps of bodies of all sizes, pressed and pushed hard: none is lost, in Python and in C."""

import ctypes
import shutil

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.sliding_body import BodyStep
from tests.support.body_problems import (
    failures,
    random_body,
    random_steps,
    shown,
    tally,
)
from tests.support.c_libraries import library

SHORT = slice(0, 3)
"""Columns of time steps up to 10 ms."""


def check(table):
    """Check that no step of up to 10 ms fails, and one in 100,000 of the others at most."""
    assert (
        table[:, SHORT, 1].sum() == 0
        and table[..., 1].sum() <= 1e-5 * table[..., 0].sum()
    ), shown(table)


def test_a_light_body_that_is_pressed_hard():
    """Residuals of 2e-9 m/s, where the load can cause 80 m/s in the step."""
    model = pf.ReducedModel(pf.ContactPatch.disc(0.003), pf.LuGre(0.3, 0.4))
    body = pf.SlidingBody(0.005, 5e-8, model)
    rng = np.random.default_rng(0)
    push = rng.normal(size=(500, 3)) * [1.0, 1.0, 0.003]
    end = body.step(body.rest(), np.zeros(3), 10.0, 0.1, push)
    held = np.hypot(push[:, 0], push[:, 1]) + np.abs(push[:, 2]) / 0.002 < 0.3 * 10.0
    np.testing.assert_allclose(end.wrench[held], -push[held], atol=1e-6)
    assert held.sum() > 250


def test_random_steps_of_all_sizes():
    check(failures(1, 20_000))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 12))
def test_a_million_random_steps_of_all_sizes(seed):
    check(failures(seed, 100_000))


def failures_in_c(seed, name, patches, total, count=250, steps=8):
    """Return steps and failures by the decades of mass and time step, `[12, 5, 2]`."""
    made = library(name, "double", "-O2", patches=patches)
    generator = np.random.default_rng(seed)
    table = np.zeros((12, 5, 2), int)
    states = patches * int(np.prod(made.model.state_shape))
    while table[..., 0].sum() < total:
        body = random_body(generator, [made.model], patches)
        places = np.hstack([body.positions, body.angles[:, None]])
        numbers = np.array([body.mass, body.inertia, *places.ravel()])
        run = random_steps(generator, body, count, steps)
        end = None
        for _ in range(steps):
            given = run.send(end)
            arrays = [np.array(each, order="C") for each in given[:5]]
            before = [each.copy() for each in arrays[:2]]
            wrench = np.zeros((count, 3))
            codes = np.zeros(count, np.int32)
            pointers = [
                ctypes.c_void_p(each.ctypes.data)
                for each in (numbers, *arrays, wrench, codes)
            ]
            made.functions.run_bodies(count, *pointers)
            lost = codes != 0
            assert np.isin(codes, (0, 4)).all()
            for now, then in zip(arrays, before, strict=False):
                np.testing.assert_array_equal(now[lost], then[lost])
            end = BodyStep(arrays[0].reshape(count, states), arrays[1], wrench)
            tally(table, body.mass, given.dt, lost)
    return table


C_CASES = [("few", 1), ("few", 4), ("distributed", 3), ("table", 6), ("fixed discs", 2)]


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_random_steps_in_c():
    check(failures_in_c(1, "few", 1, 16_000))


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
@pytest.mark.parametrize(("name", "patches"), C_CASES)
def test_a_million_random_steps_in_c(name, patches):
    check(failures_in_c(2, name, patches, 200_000))
