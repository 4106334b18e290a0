"""C libraries against the compiled steps that they are traced from, and their derivatives."""

import ctypes
import dataclasses
import re
import shutil
import subprocess

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import parameter_names, parameters_of, rollout_vjp
from tests.support.c_libraries import (
    DISC,
    KINDS,
    LAW,
    MODELS,
    PADS,
    STRICT,
    VECTOR,
    library,
    run,
    run_steady,
    samples,
)
from tests.support.rate_laws import BoucWen
from tests.support.refusals import refused

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


SLOW = [pytest.param(each, marks=pytest.mark.slow) for each in ("plain",)]
NAMES = [*(each for each in MODELS if each not in ("plain",)), *SLOW]
"""Models that compile quickly, and others."""


def misfit(name, precision, count, seed=0):
    """Return the errors of states, in largest deflections, and of wrenches, in the largest per load [count]."""
    made = library(name, precision)
    inputs = samples(made.model, made.kind, count, seed)
    new, wrench = made.model.step(*inputs)
    found, pressed = run(made, inputs)
    # damping alone gives 100 f_N at 0.3 m/s: so the errors stand beside the largest wrench of all samples
    lever = np.array([1.0, 1.0, made.model.patch.contact_radius()])
    load = inputs[2]
    per_load = 1.0 / lever / np.maximum(load, 1e-9)[:, None]
    off = np.abs(pressed - wrench) * per_load / np.abs(wrench * per_load).max()
    assert np.all(found[load == 0.0] == 0.0) and np.all(pressed[load == 0.0] == 0.0)
    return np.abs(found - new).max() / LAW.largest_deflection, off.max(axis=1)


@pytest.mark.parametrize("precision", KINDS)
@pytest.mark.parametrize("name", [*NAMES, *PADS])
def test_steps(name, precision):
    of_states, of_wrenches = misfit(name, precision, 3000)
    assert of_states < (1e-11 if precision == "double" else 1e-3)
    assert of_wrenches.max() < (1e-12 if precision == "double" else 1e-3)
    assert np.quantile(of_wrenches, 0.999) < (1e-12 if precision == "double" else 1e-5)


@pytest.mark.parametrize("precision", KINDS)
@pytest.mark.parametrize("name", ["discs", "turned discs", "discs at a load"])
def test_all_speeds(name, precision):
    """Steps from rest, and from deflections as faint, are numbers at any speed, and those of the model."""
    made = library(name, precision)
    rng = np.random.default_rng(2)
    speed = 10.0 ** np.repeat(np.arange(-30.0, 4.0), 12)
    twist = speed[:, None] * rng.normal(size=(len(speed), 3)) * [1.0, 1.0, 150.0]
    twist[::4, 2] = 0.0
    twist[1::4, :2] = 0.0
    state = np.minimum(speed, 1e-6)[:, None, None] * rng.normal(
        size=(len(speed), *made.model.state_shape)
    )
    state[::3] = 0.0
    inputs = [
        each.astype(made.kind).astype(float)
        for each in (state, twist, np.ones_like(speed), speed * 0.0 + 1e-4)
    ]
    found, pressed, slopes = run(made, inputs, slopes=True)
    new, wrench = made.model.step(*inputs)
    assert all(np.isfinite(slopes[field]).all() for field in slopes.dtype.names)
    off = np.abs(pressed - wrench) * [1.0, 1.0, 100.0]
    scale = np.abs(wrench * [1.0, 1.0, 100.0])
    assert np.all(
        off.max(axis=1)
        <= (1e-11 if precision == "double" else 1e-3) * scale.max(axis=1)
    )
    assert (
        np.abs(found - new).max()
        < (1e-11 if precision == "double" else 1e-4) * LAW.largest_deflection
    )


@pytest.mark.slow
@pytest.mark.parametrize("precision", KINDS)
@pytest.mark.parametrize("name", MODELS)
def test_a_million_steps(name, precision):
    errors = [misfit(name, precision, 10_000, seed) for seed in range(100)]
    of_wrenches = np.concatenate([each for _, each in errors])
    print(
        f"\n{name} {precision}: {max(each for each, _ in errors):.1e} {of_wrenches.max():.1e}",
        end=" ",
    )
    print(f"{np.quantile(of_wrenches, 0.999):.1e}")
    assert of_wrenches.max() < (1e-12 if precision == "double" else 1e-3)
    assert np.quantile(of_wrenches, 0.999) < (1e-12 if precision == "double" else 1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_steady_sliding(name):
    """Steps of an hour each lead there, but for rounding that damping multiplies by a hundred."""
    made = library(name)
    _, twist, load, _ = samples(made.model, made.kind, 300)
    state = np.zeros((300, *made.model.state_shape))
    for _ in range(3):
        state, wrench = made.model.step(state, twist, load, 3600.0)
    found = run_steady(made, twist, load)
    moves = twist.any(axis=1)
    assert np.all(found[~moves] == 0.0)
    off = (
        np.abs(found - wrench)[moves]
        / np.maximum(load, 1e-9)[moves, None]
        / [1.0, 1.0, 0.01]
    )
    assert off.max() < 1e-9


# ---------------------------------------------------------------------- derivatives


def by_cell(name, derivative, shape):
    """Return derivatives of the library [..., 2, 2, N] or [..., P, 3, 3] as those of C are laid out."""
    if name == "state_state" and derivative.shape[-1] != 3:
        derivative = np.swapaxes(derivative, -1, -2)
    return derivative.reshape(shape)


@pytest.mark.parametrize("name", [*NAMES, *PADS])
def test_slopes(name):
    """Off the bound of slip, where derivatives are one-sided; to 1e-9 of the largest per load."""
    made = library(name)
    inputs = [each[1::2] for each in samples(made.model, made.kind, 600)]
    inputs[2][::25] = 0.0
    found, pressed, slopes = run(made, inputs, slopes=True)
    for one, other in zip((found, pressed), run(made, inputs), strict=True):
        np.testing.assert_allclose(
            one, other, rtol=1e-12, atol=1e-12 * np.abs(other).max()
        )
    exact = made.model.step_jacobians(*inputs)
    per_load = 1.0 / np.maximum(inputs[2], 1e-9)
    for field in exact._fields:
        if field == "state_load" and name not in PADS:  # zero, and not exported
            continue
        own = slopes[field]
        scale = (
            per_load
            if field.startswith("wrench") and field != "wrench_load"
            else np.ones(len(per_load))
        )
        scale = scale.reshape(-1, *[1] * (own.ndim - 1))
        wanted = by_cell(field, getattr(exact, field), own.shape) * scale
        # Python has differences there.
        near = 1e-6 if name in PADS and field.endswith("_load") else 1e-9
        assert np.abs(own * scale - wanted).max() < near * np.abs(wanted).max(), field


@pytest.mark.parametrize("name", NAMES)
def test_slopes_by_parameters(name):
    made = library(name)
    rng = np.random.default_rng(1)
    count = 40
    inputs = [each[1::2] for each in samples(made.model, made.kind, 2 * count)]
    *_, slopes = run(made, inputs, slopes=True)
    bars = (
        rng.normal(size=(count, 3)) * [1.0, 1.0, 100.0],
        rng.normal(size=inputs[0].shape),
    )
    given = parameters_of(made.model)
    wanted = np.array([
        rollout_vjp(made.model, z, v[None], load[None], dt[None], w_bar[None], z_bar, parameters=given).parameters
        for z, v, load, dt, w_bar, z_bar in zip(*inputs, *bars, strict=True)
    ])  # fmt: skip
    names = re.findall(
        r"friction_real (\w+); /\*", (made.folder / "friction.h").read_text()
    )
    wanted = wanted[:, [parameter_names(made.model).index(each) for each in names]]
    own = np.einsum("bi,bip->bp", bars[0], slopes["wrench_params"])
    own += np.einsum("bi,bip->bp", bars[1].reshape(count, -1), slopes["state_params"])
    assert len(names) == own.shape[1] >= 6
    assert np.all(np.abs(own - wanted).max(axis=0) < 1e-9 * np.abs(wanted).max(axis=0))


# ---------------------------------------------------------------------- what is refused


@pytest.mark.parametrize("options", [(), VECTOR], ids=["", "vectors"])
@pytest.mark.parametrize("slopes", [False, True])
@pytest.mark.parametrize(
    "place, value",
    [("twist", np.nan), ("state", np.inf), ("load", -1.0), ("dt", np.nan)],
)
def test_bad_numbers(place, value, slopes, options):
    made = library("few", "double", *options)
    given = {
        "state": made.model.rest()[None], "twist": np.array([[0.01, 0.0, 1.0]]), "load": np.ones(1),
        "dt": np.full(1, 1e-3),
    }  # fmt: skip
    given[place].flat[0] = value
    before = given["state"].copy()
    wrench = np.full(3, 7.0)
    room = np.empty(10_000)
    pointers = [
        each.ctypes.data_as(ctypes.c_void_p) for each in (*given.values(), wrench, room)
    ]
    assert made.functions.run(1, *pointers[:5], pointers[5] if slopes else None) == 2
    assert np.array_equal(given["state"], before, equal_nan=True) and np.all(
        wrench == 7.0
    )


@pytest.mark.parametrize(
    "options, words",
    [
        (
            {"name": "2d"},
            "name must be a letter, then letters, digits and _, 40 in all",
        ),
        ({"name": "_"}, "name must be a letter"),
        (
            {"name": "n" * 41},
            "name must be a letter, then letters, digits and _, 40 in all",
        ),
        ({"name": "math"}, "name must not be that of a header of C, got math"),
        ({"name": "stdDef"}, "name must not be that of a header of C"),
        ({"precision": "half"}, "precision must be one of double, float"),
        ({"patches": 0}, "patches must be"),
        ({"patches": 65}, "patches must be"),
    ],
)
def test_bad_options(options, words, tmp_path):
    with refused(words, pf.FrictionError):
        pf.export_c(MODELS["few"](), tmp_path, **options)
    assert not list(tmp_path.iterdir())


def test_models_without_source(tmp_path):
    soft = pf.ReducedModelPublished(
        pf.ContactPatch.disc(0.01, pressure=pf.SoftFinger(k=2.0, c=0.009, n=1.0 / 3.0)),
        LAW,
    )
    with refused(
        "model must have a patch whose shape does not depend on the load",
        pf.FrictionError,
    ):
        pf.export_c(soft, tmp_path)
    with refused("model must be one of DistributedModel", pf.FrictionError):
        pf.export_c(object(), tmp_path)
    for kind in (pf.DistributedModel, pf.ReducedModel):
        with refused(
            r"with a law of LuGre bristles, got \w+, BoucWen", pf.FrictionError
        ):
            pf.export_c(kind(DISC, BoucWen()), tmp_path)
    assert not list(tmp_path.iterdir())


def test_names(tmp_path):
    """A library has any name, also that of the loops in it, and words of the user's write no C."""
    patch = dataclasses.replace(DISC, name="/* a */ int pad; é")
    pf.export_c(
        pf.ReducedModel(patch, LAW, cells=9), tmp_path, name="tilt", casadi=True
    )
    for each in ("tilt.c", "tilt_test.c", "tilt_casadi.c"):
        subprocess.run(
            ["gcc", *STRICT, "-c", each, "-o", "one.o"], cwd=tmp_path, check=True
        )
    assert "of / * a * / int pad; \\xe9," in (tmp_path / "tilt.h").read_text()
