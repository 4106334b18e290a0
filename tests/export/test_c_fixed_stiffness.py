"""C libraries of models whose stiffness does not grow with the load (see `test_c_library` for their steps)."""

import dataclasses
import shutil

import numpy as np
import pytest

from tests.support.c_libraries import FIXED, KINDS, library, run, samples

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

SHARE = 1e-6
"""Relative step of central differences."""


@pytest.mark.parametrize("name", ["fixed discs", "fixed points"])
def test_slopes_by_load_and_parameters_are_differences(name):
    """Slopes that Python does not have: new states by the load, and all by parameters."""
    made = library(name)
    state, twist, load, dt = (
        each[1::2][:20] for each in samples(made.model, made.kind, 40)
    )
    load = np.maximum(load, 0.1)
    *_, slopes = run(made, [state, twist, load, dt], slopes=True)
    above, below = (
        made.model.step(state, twist, load * (1.0 + sign * SHARE), dt)
        for sign in (1.0, -1.0)
    )
    wanted = (above[0] - below[0]).reshape(20, -1) / (2.0 * SHARE * load[:, None])
    np.testing.assert_allclose(
        slopes["state_load"], wanted, atol=1e-6 * np.abs(wanted).max()
    )
    assert np.abs(wanted).max() > 1e-9
    wanted = (above[1] - below[1]) / (2.0 * SHARE * load[:, None])
    np.testing.assert_allclose(
        slopes["wrench_load"], wanted, atol=1e-6 * np.abs(wanted).max()
    )
    for i, parameter in enumerate(("sigma_0", "sigma_1")):
        value = getattr(made.model.law, parameter)
        laws = [
            dataclasses.replace(
                made.model.law, **{parameter: value * (1.0 + s * SHARE)}
            )
            for s in (1.0, -1.0)
        ]
        above, below = (
            made.model.with_law(law).step(state, twist, load, dt) for law in laws
        )
        for own, high, low in zip(
            ("state_params", "wrench_params"), above, below, strict=True
        ):
            wanted = (high - low).reshape(20, -1) / (2.0 * SHARE * value)
            np.testing.assert_allclose(
                slopes[own][..., i], wanted, atol=1e-5 * np.abs(wanted).max()
            )


@pytest.mark.parametrize("precision", KINDS)
@pytest.mark.parametrize("name", FIXED)
def test_no_load_and_hardly_any(name, precision):
    """Without load bristles are forgotten; under 1e-30 N, and from states of metres, steps are those of Python.

    Single precision begins at 1e-6 of the reference load. Reversals are numbers: to which side rounding lets bristles
    go that stretch back in a step without end is open.
    """
    made = library(name, precision)
    rng = np.random.default_rng(1)
    load = np.array(
        [0.0, *([1e-30, 1e-13] if precision == "double" else [1e-5, 1e-4]), 1e-4, 1e-3]
        * 80
    )
    state = rng.normal(size=(400, *made.model.state_shape)) * 10.0 ** rng.uniform(
        -9.0, 0.0, (400, 1, 1)
    )
    twist = rng.normal(size=(400, 3)) * 10.0 ** rng.uniform(-6.0, 2.0, (400, 1))
    # Reversals.
    state[200:] = made.model.step(0.0 * state[200:], -twist[200:], 1.0, 1e-3)[0]
    inputs = [
        each.astype(made.kind).astype(float)
        for each in (state, twist, load, np.full(400, 1e-3))
    ]
    new, wrench = made.model.step(*inputs)
    found, pressed, slopes = run(made, inputs, slopes=True)
    assert all(np.isfinite(slopes[field]).all() for field in slopes.dtype.names)
    assert not found[::5].any() and not pressed[::5].any()
    # As other steps in single precision.
    near = 1e-12 if precision == "double" else 1e-3
    assert np.all(
        np.abs(found - new).max(axis=(1, 2))[:200]
        <= near * np.abs(new).max(axis=(1, 2))[:200]
    )
    assert np.all(
        np.abs(pressed - wrench).max(axis=1)[:200]
        <= near * np.abs(wrench).max(axis=1)[:200]
    )


def test_pressure_does_not_follow_moments():
    """Python refuses moments for such a law, so that the library has no such step."""
    assert (
        "step_moments" not in (library("fixed discs").folder / "friction.h").read_text()
    )


def test_long_steps_back_in_single_precision():
    """Bristles that face their velocity, at small loads: a decay rounded below zero would let them grow by 1e3."""
    made = library("fixed metric", "float")
    rng = np.random.default_rng(1)
    count = 400
    twist = np.zeros((count, 3))
    twist[:, :2] = rng.normal(size=(count, 2)) * 10.0 ** rng.uniform(
        -2.0, 1.0, (count, 1)
    )
    load = 10.0 ** rng.uniform(-3.0, 0.0, count)
    dt = 10.0 ** rng.uniform(-2.0, 0.5, count)
    rest = np.broadcast_to(made.model.rest(), (count, *made.model.state_shape))
    state, _ = made.model.step(rest, -twist, 2.0, 1.0)
    given = [
        np.ascontiguousarray(np.asarray(each, np.float32).astype(float))
        for each in (state, twist, load, dt)
    ]
    wanted, wrench = made.model.step(*given)
    found, pulled = run(made, given)
    size = np.maximum(load, np.abs(wrench).max(1))[:, None]
    assert (
        np.abs(pulled - wrench) / size
    ).max() < 1e-3  # sigma_1 times the rounding of 10 m/s
    assert np.abs(found - wanted).max() < 1e-4 * np.abs(wanted).max()
