"""Implicit steps of a body in C, against `SlidingBody`, whose search is translated."""

import ctypes
import shutil

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.export.pieces import ladder_of
from tests.support.c_libraries import HUNG, library, samples

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

NAMES = "few", "distributed", "table", "ellipsoid", "soft", "discs at a load", *HUNG
NOT_CONVERGED = 4
BLOCK = 0.2, 1e-5, 0.0, 0.0, 0.0
"""Mass and inertia of a block above the middle of its patch."""


def step(made, body, state, twist, load, dt, push):
    """Return the state, twist and wrench of a step in C, and its result."""
    real = ctypes.c_double if made.kind is np.float64 else ctypes.c_float
    given = body, state, twist, load, push, np.full(3, 7.0)
    arrays = [np.array(each, made.kind, order="C").ravel() for each in given]
    body, state, twist, load, push, wrench = (
        ctypes.c_void_p(each.ctypes.data) for each in arrays
    )
    params = (real * 7).in_dll(made.functions, "friction_default")
    given = ctypes.byref(params), body, state, twist, load, real(dt), push, wrench
    return arrays[1], arrays[2], arrays[5], made.functions.friction_body_step(*given)


def problems(made, count, hard, patches=1):
    """Draw bodies (mass, inertia, places), and steps from rest to slip under pushes up to several times the load."""
    state, twist, load, dt = samples(made.model, made.kind, count * patches)
    rng = np.random.default_rng(1)
    if made.model.depends_on_load:
        rungs = ladder_of(made.model.reduction.patch).rungs
        load = rng.choice(rungs[(rungs > 1e-2) & (rungs < 100.0)], count * patches)
    load = load.reshape(count, patches)
    twist = twist[::patches]
    dt = dt[::patches]
    mass = 10.0 ** rng.uniform(-2.0 if hard else -1.0, 0.5, (count, 1))
    inertia = mass * 10.0 ** rng.uniform(
        -5.0 if hard and patches == 1 else -4.0, -3.0, (count, 1)
    )
    push = (
        rng.normal(size=(count, 3))
        * np.minimum(load.sum(1), 100.0 if hard else 5.0)[:, None]
        * [1.0, 1.0, 0.01]
    )
    places = np.dstack(
        [0.02 * rng.normal(size=(count, patches, 2)), rng.normal(size=(count, patches))]
    )
    places[..., 2] *= patches > 1
    bodies = np.hstack([mass, inertia, places.reshape(count, -1)])
    given = bodies, state.reshape(count, -1), twist, load, dt, push
    return [np.asarray(each, made.kind).astype(float) for each in given]


@pytest.mark.parametrize(
    ("name", "precision", "patches"),
    [
        *((name, "double", 1) for name in NAMES),
        *((name, "float", 1) for name in ("few", "table")),
        *(
            (name, "double", 3)
            for name in ("few", "distributed", "soft", "discs at a load", "half-space")
        ),
        ("few", "float", 3),
        ("measured", "float", 3),
    ],
)
def test_steps(name, precision, patches):
    """Twists within 1e-9 m/s, nine in ten wrenches within 1e-12 of the load, and all within 1e-7, which 1e-9 m/s may be
    in a short step; 1e-4 in single precision."""
    made = library(name, precision, patches=patches)
    hard = precision == "double"
    off = []
    for body, state, twist, load, dt, push in zip(
        *problems(made, 400 // patches, hard, patches), strict=True
    ):
        places = body[2:].reshape(patches, 3)
        own = pf.SlidingBody(
            body[0], body[1], [made.model] * patches, places[:, :2], places[:, 2]
        )
        wanted = own.step(state, twist, load, dt, push)
        found, moved, wrench, code = step(made, body, state, twist, load, dt, push)
        arm = np.array([1.0, 1.0, 0.01])
        largest = np.abs(twist) + dt * np.abs(push) / body[[0, 0, 1]]
        scale = 1e-9 if hard else 1e-4 * (arm * largest).max()
        assert code == 0
        assert (np.abs(moved - wanted.twist) * arm).max() < max(scale, 1e-9)
        assert np.abs(found - wanted.state).max() < (
            1e-13 if hard else dt * scale + 1e-10
        )
        off.append(
            (np.abs(wrench - wanted.wrench) / arm).max() / max(load.sum(), 1e-300)
        )
        assert load.any() or (not found.any() and not wrench.any())
    assert not hard or (max(off) <= 1e-7 and np.quantile(off, 0.9) < 1e-12)


@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize("dt", [1e-4, 1e-3, 1e-2])
def test_a_pushed_block_stays(dt, precision):
    made = library("few", precision)
    body = BLOCK
    state = made.model.rest()
    twist = np.zeros(3)
    x = 0.0
    for _ in range(round(0.5 / dt)):
        state, twist, wrench, code = step(
            made, body, state, twist, 2.0, dt, (1.5, 0.0, 0.0)
        )
        x += dt * twist[0]
        assert code == 0
    assert x == pytest.approx(
        1.5 / (made.model.law.sigma_0 * 2.0),
        abs=1e-6 if precision == "double" else 3e-6,
    )
    assert wrench == pytest.approx((-1.5, 0.0, 0.0), abs=1e-4)


def test_a_block_on_a_turntable_keeps_its_place():
    """The caller takes the chord of the support off the twist; along tangents 0.02 m would grow by 1.5 mm in 0.35 s."""
    made = library("few")
    spin = 10.0
    dt = 4e-3
    radius = 0.02
    state = made.model.rest()
    pose = np.array([radius, 0.0, 0.0])
    twist = np.array([0.0, spin * radius, spin])
    for _ in range(88):
        chord = pf.geometry.chord((-spin * pose[1], spin * pose[0], spin), dt)
        angle = pose[2] + 0.5 * dt * spin
        own = twist - chord
        own[:2] = pf.geometry.rotate(own[:2], -angle)
        state, own, _, code = step(
            made, BLOCK, state, own, 0.2 * 9.81, dt, (0.0, 0.0, 0.0)
        )
        assert code == 0
        twist = np.append(pf.geometry.rotate(own[:2], angle), own[2]) + chord
        pose += dt * twist
    deflection = spin**2 * radius / (9.81 * made.model.law.sigma_0)
    assert np.hypot(*pose[:2]) == pytest.approx(radius, abs=2.0 * deflection + 1e-9)
    assert pose[2] == pytest.approx(88 * dt * spin, abs=1e-7)


@pytest.mark.parametrize(
    "change",
    [
        {"body": (0.0, *BLOCK[1:])},
        {"body": (0.2, np.nan, *BLOCK[2:])},
        {"push": (np.inf, 0.0, 0.0)},
        {"load": -1.0},
    ],
)
def test_bad_numbers(change):
    made = library("few")
    given = {
        "body": BLOCK,
        "state": made.model.rest(),
        "twist": (0.1, 0.0, 0.0),
        "load": 1.0,
    }
    state, twist, wrench, code = step(
        made, **given | {"dt": 1e-3, "push": (0.0, 0.0, 0.0)} | change
    )
    assert code == 2 and not state.any() and twist[0] == 0.1 and np.all(wrench == 7.0)


def test_a_step_that_does_not_converge_says_so():
    """Single precision ends below the speed of a body of 1e-35 kg under 1e6 N."""
    made = library("few", "float")
    state, twist, wrench, code = step(
        made,
        (1e-35, 1e-35, 0.0, 0.0, 0.0),
        made.model.rest(),
        (0.1, 0.0, 0.0),
        1e6,
        1.0,
        (1e6, 2.0, 3.0),
    )
    assert (
        code == NOT_CONVERGED
        and not state.any()
        and twist[0] == np.float32(0.1)
        and np.all(wrench == 7.0)
    )
