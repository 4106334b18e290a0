"""Steps in C whose pressure follows the moments of the load, or given loads, against those of the library."""

import ctypes
import shutil

import numpy as np
import pytest

from planarfriction.export.pieces import ladder_of
from tests.support.c_libraries import TURNED, library, samples

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

NAMES = "few", "distributed", "ellipsoid", "soft", "soft layer"
QUICK = "few", "feet on a line"
COUNT = 200


def inputs(made):
    """Draw steps whose centres of pressure lie on the patch and beside it."""
    state, twist, load, dt = samples(made.model, made.kind, COUNT)
    rng = np.random.default_rng(3)
    if made.model.depends_on_load:
        rungs = ladder_of(made.model.reduction.patch).rungs
        load = rng.choice(rungs[(rungs > 1e-2) & (rungs < 100.0)], COUNT)
    angle = rng.uniform(-np.pi, np.pi, COUNT)
    far = made.model.patch.contact_radius(1.0) * rng.uniform(0.0, 3.0, COUNT)
    moments = (
        load[:, None] * far[:, None] * np.column_stack([np.sin(angle), -np.cos(angle)])
    )
    return [
        np.asarray(each, made.kind).astype(float)
        for each in (state, twist, load, dt, moments)
    ]


def run(made, state, twist, load, dt, moments):
    """Return the new state and the wrench of one step in C, and its result."""
    real = ctypes.c_double if made.kind is np.float64 else ctypes.c_float
    state = np.array(state, made.kind, order="C")
    wrench = np.full(3, 7.0, made.kind)
    step = made.functions.friction_step_moments
    params = (real * 7).in_dll(made.functions, "friction_default")
    twist = np.array(twist, made.kind)
    moments = np.array(moments, made.kind)
    pointers = [
        each.ctypes.data_as(ctypes.c_void_p) for each in (state, twist, moments, wrench)
    ]
    code = step(
        ctypes.byref(params),
        *pointers[:2],
        real(load),
        pointers[2],
        real(dt),
        pointers[3],
    )
    return state, wrench, code


@pytest.mark.parametrize(
    ("name", "precision"),
    [(name, "double") for name in NAMES]
    + [
        pytest.param(name, "float", marks=[] if name in QUICK else pytest.mark.slow)
        for name in (*NAMES, *TURNED)
    ],
)
def test_steps(name, precision):
    made = library(name, precision)
    given = inputs(made)
    wanted, wrench = made.model.step(*given[:4], moments=given[4])
    assert (
        np.abs(wrench - made.model.step(*given[:4])[1]).max()
        > 1e-2 * np.abs(wrench).max()
    )
    found = [run(made, *each) for each in zip(*given, strict=True)]
    assert not any(code for *_, code in found)
    lever = np.array([1.0, 1.0, 0.01])
    load = np.maximum(given[2], 1e-9)[:, None]
    off = [
        np.abs(np.array([each[0] for each in found]) - wanted) / np.abs(wanted).max()
    ]
    off += [
        np.abs(np.array([each[1] for each in found]) - wrench)
        / load
        / lever
        / np.abs(wrench / load).max()
    ]
    worst = np.maximum(*(each.reshape(COUNT, -1).max(axis=1) for each in off))
    # rounding is multiplied where no three cells have the centre between them: by a compliance of 1e-9
    assert worst.max() < (1e-6 if precision == "double" else 1e-4)
    assert np.quantile(worst, 0.5) < (1e-12 if precision == "double" else 1e-5)


@pytest.mark.parametrize("moments", [(np.nan, 0.0), (0.0, np.inf)])
def test_bad_moments(moments):
    made = library("few")
    before = made.model.rest() + 1e-9
    (_, twist, load, dt, _) = (each[1] for each in inputs(made))
    state, wrench, code = run(made, before, twist, load, dt, moments)
    assert code == 2 and np.array_equal(state, before) and np.all(wrench == 7.0)


GIVEN = "few", "distributed", "soft", "layer of points", "half-space"


@pytest.mark.parametrize(
    ("name", "precision"), [*((name, "double") for name in GIVEN), ("few", "float")]
)
def test_steps_under_given_loads(name, precision):
    """Loads of discs or cells change at each step, and some are without; they come back without deflection."""
    made = library(name, precision)
    discs = made.model.reduction.patch.cells
    rng = np.random.default_rng(8)
    pushes = rng.exponential(2.0 / discs, (60, discs)) * (rng.random((60, discs)) > 0.3)
    pushes[30] = 0.0
    real = np.ctypeslib.as_ctypes_type(made.kind)
    params = ctypes.c_char.in_dll(made.functions, "friction_default")
    state = made.model.rest()
    own = np.array(state, made.kind)
    wrench = np.zeros(3, made.kind)
    before = pushes[0]
    found, wanted = [], []
    for now in pushes:
        twist = rng.normal(size=3) * [0.02, 0.02, 2.0]
        given = (np.array(each, made.kind) for each in (twist, now))
        pointers = [each.ctypes for each in (own, *given, wrench)]
        state, force = made.model.step(state, twist, None, 1e-3, loads=(before, now))
        code = made.functions.friction_step_loads(
            ctypes.byref(params), *pointers[:3], real(1e-3), pointers[3]
        )
        assert code == 0
        found.append(wrench / [1.0, 1.0, 0.01])
        wanted.append(force / [1.0, 1.0, 0.01])
        before = now
    close = 1e-10 if precision == "double" else 1e-4
    np.testing.assert_allclose(found, wanted, atol=close * np.abs(wanted).max())
    np.testing.assert_allclose(own, state, atol=close * np.abs(state).max())


@pytest.mark.parametrize("wrong", [-1.0, np.nan, np.inf])
def test_bad_loads(wrong):
    made = library("few")
    state = made.model.rest() + 1e-9
    loads = np.ones(made.model.reduction.patch.cells)
    loads[3] = wrong
    given = [state.copy(), np.zeros(3), loads, np.full(3, 7.0)]
    params = ctypes.c_char.in_dll(made.functions, "friction_default")
    pointers = [each.ctypes for each in given]
    code = made.functions.friction_step_loads(
        ctypes.byref(params), *pointers[:3], ctypes.c_double(1e-3), pointers[3]
    )
    assert code == 2 and np.array_equal(given[0], state) and np.all(given[3] == 7.0)
