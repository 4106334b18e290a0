"""Small batches of steps and derivatives of single ones go straight to compiled code, and say what long ways say."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.contacts import lengths
from tests.support.differences import assert_step_jacobians
from tests.support.refusals import refused

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
DISC = pf.ContactPatch.disc(radius=0.01, cells=9)
MODEL = pf.ReducedModelPublished(DISC, LAW)
GENERATOR = np.random.default_rng(3)
TWISTS = GENERATOR.normal(size=(4, 3)) * [0.01, 0.01, 1.0]
LOADS = np.array([1.0, 2.0, 0.0, 0.5])


def _states():
    draw = GENERATOR.uniform(-0.6, 0.6, (4, 3))
    return draw * LAW.largest_deflection * [1.0, 1.0, 0.01]


@pytest.mark.parametrize(
    "load", [LOADS, 2.0, 2], ids=["loads", "one load", "whole number"]
)
def test_batches_step_as_their_members_do(load):
    states = _states()
    new, wrenches = MODEL.step(states, TWISTS, load, 1e-3)
    assert MODEL.compiled.step_batch(states, TWISTS, load, 1e-3) is not None
    for b in range(4):
        own = float(np.broadcast_to(load, 4)[b])
        one, wrench = MODEL.step(states[b], TWISTS[b].tolist(), own, 1e-3)
        assert np.array_equal(new[b], one)
        assert np.array_equal(wrenches[b], wrench)


@pytest.mark.parametrize("load", [2.0, 0.0])
def test_derivatives_are_differences_of_steps(load):
    state = _states()[0]
    twist = TWISTS[0]
    dt = 1e-4
    assert MODEL.compiled.jacobians_one(state, twist, load, dt) is not None
    by_state = 1e-5 * LAW.largest_deflection * lengths(MODEL)
    by_twist = np.array([1e-8, 1e-8, 1e-6])
    assert_step_jacobians(MODEL, state, twist, load, dt, by_state, by_twist, 1e-5)
    found = MODEL.step_jacobians(state, twist, load, dt)
    small = MODEL.step(state, twist, 1e-9, dt)[1] * 1e9
    np.testing.assert_allclose(found.wrench_load, small, rtol=1e-9)


WRONG = {
    "NaN in a state": ({"state": np.full((4, 3), np.nan)}, "state must be finite"),
    "a twist beyond all range": (
        {"twist": np.full((4, 3), 1e60)},
        "twist must be between -1e",
    ),
    "a negative load": ({"normal_force": -LOADS}, "normal_force must be >= 0"),
    "an infinite load": ({"normal_force": float("inf")}, "normal_force must be finite"),
    "a negative step": ({"dt": -1.0}, "dt must be >= 0"),
    "loads for three": ({"normal_force": np.ones(3)}, "batch axes must broadcast"),
    "a truth value": (
        {"normal_force": True},
        "normal_force must be an array of numbers and no truth value",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_not_in_order_is_refused(name):
    wrong, message = WRONG[name]
    given = {
        "state": np.zeros((4, 3)),
        "twist": TWISTS,
        "normal_force": LOADS,
        "dt": 1e-3,
        **wrong,
    }
    with refused(message):
        MODEL.step(**given)
    one = {
        key: value[0] if isinstance(value, np.ndarray) else value
        for key, value in given.items()
    }
    if name != "loads for three":
        with refused(message):
            MODEL.step_jacobians(**{**one, "normal_force": _plain(one["normal_force"])})


@pytest.mark.parametrize("twist", [np.array(0.0), np.zeros((1, 3, 1))])
def test_twists_of_other_axes_are_one_clear_line(twist):
    with refused(r"^twist must have shape \[..., 3\]"):
        MODEL.step(np.zeros((1, 3)), twist, 1.0, 1e-3)


def _plain(value):
    return value if isinstance(value, bool) else float(value)
