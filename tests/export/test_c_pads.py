"""C libraries of models on elastic pads (see `test_c_library` for their steps)."""

import ctypes
import dataclasses
import re
import shutil
import subprocess

import numpy as np
import pytest

from tests.export.test_c_body import step as body_step
from tests.support.c_libraries import HUNG, KINDS, PADS, library, run, samples

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


# ---------------------------------------------------------------------- faces that hang on their backs

LEVER = np.array([1.0, 1.0, 0.01])


def _compare(found, wanted, load, near):
    """Compare states with the largest of a kind, and wrenches with loads."""
    for kind in (slice(None, -3), slice(-3, -1), slice(-1, None)):
        off = np.abs(found[0] - wanted[0])[:, kind].max()
        assert off <= near * np.abs(wanted[0][:, kind]).max() + 1e-30
    off = np.abs(found[1] - wanted[1]) / LEVER
    assert (off <= near * load[:, None] + 1e-30).all()


@pytest.mark.parametrize(
    ("precision", "options"),
    [("double", "-O0"), ("double", "-O2"), ("float", "-O2")],
)
@pytest.mark.parametrize("name", HUNG)
def test_steps_of_faces(name, precision, options):
    made = library(name, precision, options)
    inputs = samples(made.model, made.kind, 2000)
    wanted = made.model.step(*inputs)
    near = 1e-11 if precision == "double" else 1e-4
    _compare(run(made, inputs), wanted, inputs[2], near)
    assert np.abs(wanted[0][:, -3:-1]).max() > 1e-6


def _with(made, name, *changes):
    """Compile a library with changes behind the head of the search for a face."""
    source = (made.folder / "friction.c").read_text()
    head = source.index("static int found_of_face_steps")
    rest = source[head:]
    for old, new in changes:
        assert old in rest
        rest = rest.replace(old, new, 1)
    (made.folder / f"{name}.c").write_text(source[:head] + rest)
    files = f"{name}.c", "driver.c", "-o", f"{name}.so", "-lm"
    subprocess.run(
        ["gcc", "-O1", "-fPIC", "-shared", *files], cwd=made.folder, check=True
    )
    return made._replace(functions=ctypes.CDLL(str(made.folder / f"{name}.so")))


GIVES_UP = "i < 20", "i < 0"
"""Change with which Broyden's method ends before it begins."""


@pytest.mark.parametrize("precision", KINDS)
@pytest.mark.parametrize("name", HUNG)
def test_the_search_finds_faces_that_broyden_does_not(name, precision):
    made = library(name, precision, "-O1")
    inputs = samples(made.model, made.kind, 600)
    found = run(_with(made, "search", GIVES_UP), inputs)
    near = 1e-11 if precision == "double" else 1e-4
    _compare(found, made.model.step(*inputs), inputs[2], near)


def test_a_face_that_nothing_finds_is_an_error():
    """Where neither search may iterate."""
    made = library("measured", "double", "-O1")
    made = _with(made, "nothing", GIVES_UP, (", 100, 1, least", ", 0, 0, least"))
    state = np.full(made.model.state_shape, 1e-6)
    new, wrench, code = _one(made, state, (0.1, 0.02, 3.0), 2.0, 1e-3)
    assert code == 4 and np.array_equal(new, state) and (wrench == 7.0).all()


@pytest.mark.parametrize("name", HUNG)
def test_slopes_of_faces(name):
    """In full, from those at a held face and those of the face; parameters by differences."""
    made = library(name)
    inputs = [each[1::2] for each in samples(made.model, made.kind, 400)]
    inputs[2][::25] = 0.0
    *end, slopes = run(made, inputs, slopes=True)
    _compare(end, made.model.step(*inputs), inputs[2], 1e-11)
    exact = made.model.step_jacobians(*inputs)
    n = made.model.state_shape[0] - 3
    own = slopes["state_state"]
    count = n // own.shape[2]
    whole = slopes["state_face"] @ slopes["face_state"]
    for i in range(n):
        for j in range(own.shape[2]):
            whole[:, i, i % count + count * j] += own[:, i, j]
    for i in range(n, n + 3):
        whole[:, i, i] += own[:, i, 0]
    per_load = 1.0 / np.maximum(inputs[2], 1e-9)
    for field in exact._fields:
        found = whole if field == "state_state" else slopes[field]
        scale = per_load if field.startswith("wrench") and field != "wrench_load" else 1
        scale = np.reshape(scale, (-1, *[1] * (found.ndim - 1)))
        wanted = getattr(exact, field) * scale
        # Python has differences there.
        near = 1e-7 if field.endswith("_load") else 1e-11
        assert np.abs(found * scale - wanted).max() < near * np.abs(wanted).max(), field


@pytest.mark.parametrize("name", HUNG)
def test_slopes_of_faces_by_parameters(name):
    made = library(name)
    inputs = [each[1::2][:40] for each in samples(made.model, made.kind, 80)]
    inputs[2] = np.maximum(inputs[2], 0.1)
    *_, slopes = run(made, inputs, slopes=True)
    header = (made.folder / "friction.h").read_text()
    names = re.findall(r"friction_real (\w+); /\*", header)
    assert "mu_c" in names and not {"sigma_0", "sigma_1"} & set(names)
    for parameter in ("mu_c", "v_s", "sigma_2"):
        value = getattr(made.model.law, parameter)
        step = SHARE * (value or 1.0)
        ends = [
            made.model.with_law(
                dataclasses.replace(made.model.law, **{parameter: value + sign * step})
            ).step(*inputs)
            for sign in ((1.0, -1.0) if value else (1.0, 0.0))
        ]
        for field, high, low in zip(
            ("state_params", "wrench_params"), *ends, strict=True
        ):
            wanted = (high - low) / (step * (2.0 if value else 1.0))
            found = slopes[field][..., names.index(parameter)]
            assert np.abs(found - wanted).max() < 2e-5 * np.abs(wanted).max()


def _one(made, state, twist, load, dt):
    """Step once in C; return the new state, the wrench and the code."""
    rows = [np.array(each, made.kind).ravel() for each in (state, twist, load, dt)]
    wrench = np.full(3, 7.0, made.kind)
    pointers = [each.ctypes.data_as(ctypes.c_void_p) for each in (*rows, wrench)]
    return rows[0], wrench, made.functions.run(1, *pointers, None)


@pytest.mark.parametrize("precision", KINDS)
@pytest.mark.parametrize("name", HUNG)
def test_hostile_numbers_for_faces(name, precision):
    """Steps are numbers, or fail and change nothing."""
    made = library(name, precision)
    rng = np.random.default_rng(3)
    far = 300.0 if precision == "double" else 30.0
    codes = []
    for i in range(600):
        size = 10.0 ** rng.uniform(-far, far if i % 2 else 3.0, 4)
        state = rng.normal(size=made.model.state_shape) * size[0]
        state[-3:] = rng.normal(size=3) * size[1]
        twist = rng.normal(size=3) * size[2]
        load = abs(rng.normal()) * size[3]
        dt = abs(rng.normal()) * 10.0 ** rng.uniform(-9.0, 3.0)
        if i % 20 == 0:
            state[rng.integers(len(state))] = rng.choice([np.nan, np.inf])
        state = state.astype(made.kind)
        new, wrench, code = _one(made, state, twist, load, dt)
        codes.append(code)
        if code == 0:
            assert np.isfinite(new).all() and np.isfinite(wrench).all()
        else:
            assert np.array_equal(new, state, equal_nan=True) and (wrench == 7.0).all()
    assert set(codes) <= {0, 2, 4} and codes.count(0) > 200 and codes.count(2) > 30


@pytest.mark.parametrize("name", HUNG)
def test_a_body_held_by_a_pad_does_not_creep(name):
    """Under a pull of a half of what it holds at least, and a load that oscillates."""
    made = library(name)
    body = (0.2, 1e-5, 0.0, 0.0, 0.0)
    state = made.model.rest()
    twist = np.zeros(3)
    x = [0.0]
    for i in range(3000):
        load = 2.0 * (1.0 + 0.3 * np.sin(0.02 * i))
        push = (0.5 * 1.4 * made.model.law.mu_c, 0.0, 0.0)
        state, twist, wrench, code = body_step(
            made, body, state, twist, load, 1e-3, push
        )
        assert code == 0
        x.append(x[-1] + 1e-3 * twist[0])
    assert x[-1] > 1e-7 and np.ptp(x[-700:]) < 1e-4 * x[-1]
    assert wrench == pytest.approx((-push[0], 0.0, 0.0), abs=1e-3)
