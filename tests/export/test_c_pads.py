"""C libraries of models on elastic pads (see `test_c_library` for their steps)."""

import dataclasses
import re
import shutil

import numpy as np
import pytest

import planarfriction as pf
from tests.support.c_libraries import FEW, KINDS, PADS, library, run, samples

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

SHARE = 1e-6
"""Relative step of central differences."""


@pytest.mark.parametrize("name", ["discs at a load", "layer of points"])
def test_slopes_by_load_and_parameters_are_differences(name):
    """Slopes that Python does not have: new states by the load, and all by parameters."""
    made = library(name)
    state, twist, load, dt = (
        each[1::2][:20] for each in samples(made.model, made.kind, 40)
    )
    load = np.maximum(load, 0.1)
    new, wrench, slopes = run(made, [state, twist, load, dt], slopes=True)
    new = new.reshape(20, -1)
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
    header = (made.folder / "friction.h").read_text()
    names = re.findall(r"friction_real (\w+); /\*", header)
    for parameter in ("sigma_0", "sigma_1"):
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
        for own, start, high, low in zip(
            ("state_params", "wrench_params"), (new, wrench), above, below, strict=True
        ):
            wanted = (high - low).reshape(20, -1) / (2.0 * SHARE * value)
            # It cancels for a pad with a stiffness of its own, which has no such parameter.
            found = 0.0
            if parameter in names:
                found = slopes[own][..., names.index(parameter)]
            scale = max(np.abs(wanted).max(), np.abs(start).max() / value)
            np.testing.assert_allclose(found, wanted, atol=1e-5 * scale)
    assert ("sigma_0" in names) == (name == "discs at a load")


@pytest.mark.parametrize("precision", KINDS)
@pytest.mark.parametrize("name", PADS)
def test_no_load_and_hardly_any(name, precision):
    """Without load bristles are forgotten; under 1e-30 N, and from states of metres, steps are those of Python.

    Single precision begins at 1e-6 of the load at which law and pad are as stiff. Reversals are numbers: to which side
    rounding lets bristles go that stretch back in a step without end is open.
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


def test_common_compliances_are_refused(tmp_path):
    pad = pf.Pad.measured(4e3, common=0.4)
    model = pf.DistributedModel(FEW, pf.LuGre(sigma_1=0.0), pad=pad)
    rule = "pad must have no common compliance for source code, which knows none, got"
    with pytest.raises(pf.FrictionError, match=rule):
        pf.export_c(model, tmp_path)


def test_long_steps_back_in_single_precision():
    """Bristles that face their velocity, at small loads: a decay rounded below zero would let them grow by 1e3."""
    made = library("metric at a load", "float")
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
