"""Loads of cells that are given anew at each step: against all cells, closed forms and the energy of bristles."""

import functools
import pickle

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.coupling import CoupledPatches, HostStep
from planarfriction.derivatives import (
    RolloutTangent,
    rollout,
    rollout_jacobian,
    rollout_jvp,
    rollout_states,
    rollout_vjp,
)
from planarfriction.models.cell_loads import seen
from tests.support.refusals import refused

LAW = pf.LuGre(mu_c=1.0, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
DAMPED = pf.LuGre(mu_c=0.8, mu_s=1.0, sigma_1=300.0, sigma_2=0.1, elasto_plastic=0.9)
SIDE = 0.02
SHORT = 1e-5
"""Displacement [m] at which the stuck square would carry all of its friction."""

LAYER = pf.Pad.layer(1.0 / SHORT / SIDE**2 * 3e-3, 3e-3)
GRADED = pf.ContactPatch.rectangle(
    SIDE, 0.012, (24, 16), pressure=pf.LinearGradient((30.0, -20.0))
)
GRAINED = GRADED.with_friction_metric(pf.friction_metric(0.4, 1.0, 1.6))
FEET = pf.ContactPatch.points([[0.0, 0.0], [0.01, 0.0], [0.002, 0.008]])

MODELS = {
    "cells": pf.DistributedModel(GRADED, DAMPED),
    "discs": pf.ReducedModel(GRADED, DAMPED),
    "discs with a metric": pf.ReducedModel(GRAINED, DAMPED),
    "discs of a circle": pf.ReducedModel(pf.ContactPatch.disc(0.01, cells=21), DAMPED),
    "discs of a soft finger": pf.ReducedModel(
        pf.ContactPatch.disc(0.01, pressure=pf.SoftFinger(c=0.006, k=0.33)), DAMPED
    ),
    "discs with an asymmetry": pf.ReducedModel(
        GRADED.with_friction_metric(np.eye(2), (0.2, 0.1)), DAMPED
    ),
    "feet": pf.ReducedModel(FEET, DAMPED),
    "cells of a layer": pf.DistributedModel(GRADED, DAMPED, pad=LAYER),
    "discs of a layer": pf.ReducedModel(GRADED, DAMPED, pad=LAYER),
    "stiffness of the law": pf.ReducedModel(GRAINED, DAMPED, pad=pf.Pad.at_load(3.0)),
    "common compliance": pf.ReducedModel(
        GRADED, LAW, pad=pf.Pad.measured(1e5, common=0.3)
    ),
}


def drawn(model, count, rng):
    """Return states, twists, and loads of the cells of contacts."""
    state = 3e-6 * rng.normal(size=(count, *model.state_shape))
    twist = rng.normal(size=(count, 3)) * [0.01, 0.01, 1.0]
    cells = model.patch.cells
    loads = rng.uniform(0.0, 2.0, (count, cells)) * rng.integers(0, 2, (count, cells))
    return state, twist, loads


@pytest.mark.parametrize("name", MODELS)
def test_loads_of_the_pressure_are_the_normal_force(name):
    model = MODELS[name]
    state, twist, _ = drawn(model, 4, np.random.default_rng(1))
    # Shares of cells, which differ from those of points at the rim of a circle.
    patch = (
        model.patch if model.reduction.pad or name == "cells" else model.patch.discs()
    )
    loads = 2.5 * patch.weights(2.5)
    given = model.step(state, twist, None, 1e-3, loads=loads)
    for got, wanted in zip(given, model.step(state, twist, 2.5, 1e-3), strict=True):
        np.testing.assert_allclose(
            got, wanted, rtol=0.0, atol=1e-13 * abs(wanted).max()
        )


@pytest.mark.parametrize("name", ["discs", "discs of a layer", "common compliance"])
def test_loads_of_discs_act_as_those_of_the_model_of_the_discs(name):
    """Discs stay where they are; under shares of the pressure they bear what a normal force does."""
    model = MODELS[name]
    few = model.reduction
    state, twist, _ = drawn(model, 4, np.random.default_rng(11))
    loads = 2.5 * few.patch.weights()
    given = model.step(state, twist, None, 1e-3, loads=loads)
    for got, wanted in zip(given, model.step(state, twist, 2.5, 1e-3), strict=True):
        np.testing.assert_allclose(
            got, wanted, rtol=0.0, atol=1e-12 * abs(wanted).max()
        )
    half = loads * (few.patch.positions[:, 0] > 0.0)
    pairs = {"loads": (loads, half)}
    given = model.step(state, twist, None, 1e-3, **pairs)
    for got, wanted in zip(
        given, few.step(state, twist, None, 1e-3, **pairs), strict=True
    ):
        np.testing.assert_array_equal(got, wanted)


def test_loads_under_moments_are_those_of_the_tilted_pressure():
    model = MODELS["cells"]
    state, twist, _ = drawn(model, 4, np.random.default_rng(2))
    moments = np.array([3e-3, 8e-3])
    loads = 2.5 * model.patch.weights(2.5, moments=moments)
    assert (loads == 0.0).any()
    given = model.step(state, twist, None, 1e-3, loads=loads)
    wanted = model.step(state, twist, 2.5, 1e-3, moments=moments)
    np.testing.assert_allclose(given[1], wanted[1], rtol=1e-12)


@pytest.mark.parametrize("name", ["cells", "discs of a layer"])
def test_covers_of_a_batch_have_one_set_of_loads(name):
    model = MODELS[name]
    rng = np.random.default_rng(3)
    loads = rng.uniform(0.1, 1.0, model.patch.cells)
    state, twist, _ = drawn(model, 3, rng)
    cover = rng.uniform(0.5, 1.0, (3, model.patch.cells))
    all_at_once = model.step(state, twist, None, 1e-3, loads=loads, cover=cover)
    for b in range(3):
        alone = model.step(state[b], twist[b], None, 1e-3, loads=loads, cover=cover[b])
        for got, wanted in zip(all_at_once, alone, strict=True):
            np.testing.assert_allclose(got[b], wanted, rtol=1e-12, atol=1e-18)


def test_what_lifts_takes_its_force_along_and_comes_back_unstressed():
    """Two feet on a pad, of stiffness K/2 each, pulled by d: K d, K d/2 without one, and K d/2 when it is back."""
    feet = pf.ContactPatch.points([[0.0, 0.005], [0.0, -0.005]])
    model = pf.DistributedModel(feet, LAW, pad=pf.Pad.measured(1e5))
    both = np.array([1.0, 1.0])
    one = np.array([1.0, 0.0])
    state, wrench = model.step(model.rest(), [2e-3, 0.0, 0.0], None, 1e-3, loads=both)
    assert wrench[0] == pytest.approx(-0.2)
    still = [0.0, 0.0, 0.0]
    state, wrench = model.step(state, still, None, 1e-3, loads=(both, one))
    assert wrench == pytest.approx([-0.1, 0.0, 0.1 * 0.005])
    state, wrench = model.step(state, still, None, 1e-3, loads=(one, both))
    assert wrench[0] == pytest.approx(-0.1)
    # Half of a foot leaves with half of its force, and with half of its stiffness.
    half = np.array([0.5, 1.0])
    state, wrench = model.step(
        state, still, None, 1e-3, loads=(both, both), cover=(np.ones(2), half)
    )
    assert wrench[0] == pytest.approx(-0.05)


@pytest.mark.parametrize("name", ["cells", "discs", "discs of a layer"])
def test_a_contact_whose_cells_all_lift_forgets_its_state(name):
    model = MODELS[name]
    state, twist, loads = drawn(model, 1, np.random.default_rng(3))
    gone = np.zeros_like(loads[0])
    given = (loads[0], gone) if model.pad else gone
    new, wrench = model.step(state[0], twist[0], None, 1e-3, loads=given)
    assert (new == 0.0).all()
    assert (wrench == 0.0).all()
    slopes = model.step_jacobians(state[0], twist[0], None, 1e-3, loads=given)
    assert (slopes.state_state == 0.0).all()
    assert (slopes.wrench_twist == 0.0).all()


@pytest.mark.parametrize("steps", [30, pytest.param(5000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", [each for each in MODELS if "layer" in each])
def test_no_pressure_makes_energy(name, steps):
    """The energy of the bristles rises by no more than the work at their ends, with pressure and cover of any kind."""
    model = MODELS[name].with_law(LAW)
    cells = model.patch.cells
    rng = np.random.default_rng(4)
    before = np.ones((200, cells))
    state = model.rest(200)
    loads = before
    energy = np.zeros(200)
    for _ in range(steps):
        cover = rng.uniform(0.0, 1.0, before.shape) ** 0.3
        new = rng.exponential(1.0 / cells, before.shape) * rng.integers(0, 2, before.shape)  # fmt: skip
        twist = rng.normal(size=(200, 3)) * [0.01, 0.01, 1.0]
        dt = 10.0 ** rng.uniform(-6.0, -1.0, 200)
        state, wrench = model.step(
            state, twist, None, dt, loads=(loads, new), cover=(before, cover)
        )
        stiff = LAW.sigma_0 * model._cells.under(new, cover).numbers[:, -1]
        after = 0.5 * (stiff * (state**2).sum(axis=1)).sum(axis=1)
        work = -dt * (wrench * twist).sum(axis=1)
        assert (after <= energy + work + 1e-12 * (energy + abs(work))).all()
        energy = after
        before, loads = cover, new


def test_a_disc_is_that_of_the_part_that_is_pressed():
    """One disc of a rectangle whose half is pressed slides as one of the half does."""
    whole, half = (
        pf.ContactPatch.from_pressure(np.ones((15, n)), SIDE / 24) for n in (24, 12)
    )
    left = (whole.positions[:, 0] < 0.0) * 2.5 / 180
    twist = np.array([0.03, -0.01, 4.0])
    one = pf.ReducedModel(whole, DAMPED, cells=1)
    beside = pf.ReducedModel(half, DAMPED, cells=1)
    wrench = one.step(one.rest(), twist, None, 1.0, loads=left)[1]
    middle = pf.geometry.twist_at(twist, [-0.25 * SIDE, 0.0])
    wanted = beside.step(beside.rest(), middle, 2.5, 1.0)[1]
    wanted = pf.geometry.wrench_at(wanted, [0.25 * SIDE, 0.0])
    np.testing.assert_allclose(wrench, wanted, rtol=1e-10)


def along(count, pace):
    """Return the steps `[count, 3]` of a path in stick-slip, or of one that slides."""
    t = np.arange(count + 1) / count
    if pace == "stick-slip":
        y = 0.6 * np.cos(2.0 * np.pi * t) * np.minimum(1.0, 4.0 * t)
        path = np.stack([1.2 * np.sin(2 * np.pi * t), y, np.sin(3 * np.pi * t)], -1)
    else:
        path = np.stack([6.0 * t, 0.5 * t, 2.0 * t], -1)
    return np.diff(path, axis=0) * SHORT * [1.0, 1.0, 2.0 / SIDE]


def pressures(kind, x, y, t):
    """Return pressures and covers of cells at (x, y), in half sides, at times from 0 to 1."""
    x, y, t = x[None], y[None], t[:, None]
    if kind == "plate leaves over an edge":
        half = x.max() - np.sort(np.unique(x))[-2]
        cover = np.clip((1.0 - 1.2 * t - (x - 0.5 * half)) / half, 0.0, 1.0)
        return cover + 0.0 * y, cover + 0.0 * y
    if kind == "part lifts under a moment":
        bends = 1.26 * np.sin(4 * np.pi * t) * x + 0.5 * np.cos(6 * np.pi * t) * y
        press = np.maximum(1.0 + bends, 0.0)
    else:
        away = (x + 0.5 - t) ** 2 + (y - 0.3 * np.sin(2 * np.pi * t)) ** 2
        press = np.sqrt(np.maximum(0.36 - away, 0.0))
    return press, (press > 0.0) + 0.0


EDGE = "plate leaves over an edge"
CASES = {
    (EDGE, "stick-slip"): (0.013, 0.022),
    (EDGE, "sliding"): (0.006, 0.012),
    ("part lifts under a moment", "stick-slip"): (0.015, 0.025),
    ("a round spot rolls across", "stick-slip"): (0.011, 0.014),
    ("a round spot rolls across", "sliding"): (0.040, 0.026),
}
"""Largest errors of force and torque of 24 discs, in the friction and the torque of the whole square."""


@functools.cache
def errors(side=48, count=400):
    """Return errors of force and torque in all cases, one contact each, side by side."""
    square = pf.ContactPatch.rectangle(SIDE, cells=side)
    x, y = square.positions.T / (0.5 * SIDE)
    t = np.arange(count) / count
    every = [pressures(kind, x, y, t) for kind, _ in CASES]
    loads, cover = (np.stack(each, 1) for each in zip(*every, strict=True))
    rocks = 1.0 + 0.3 * np.sin(10.0 * np.pi * t)
    loads = loads * (rocks[:, None] / loads.sum(-1))[..., None]
    steps = np.stack([along(count, pace) for _, pace in CASES], 1)
    wrenches = []
    for model in (
        pf.DistributedModel(square.discs(), LAW, pad=LAYER),
        pf.ReducedModel(square, LAW, pad=LAYER),
    ):
        state = model.rest(len(CASES))
        last = 0
        found = []
        for j, step in enumerate(steps):
            state, wrench = model.step(
                state, step / 1e-3, None, 1e-3,
                loads=(loads[last], loads[j]), cover=(cover[last], cover[j]),
            )  # fmt: skip
            found.append(wrench)
            last = j
        wrenches.append(found)
    off = abs(np.subtract(*wrenches)).max(axis=0)
    arm = np.hypot(*square.positions.T).mean()
    sizes = [(max(fx, fy), torque / arm) for fx, fy, torque in off]
    return dict(zip(CASES, sizes, strict=True))


@pytest.mark.parametrize("case", CASES)
def test_discs_bear_pressures_as_all_cells_do(case):
    """A thin layer under a square, load +-30 %: 24 discs against 48 x 48 cells."""
    assert np.all(np.array(errors()[case]) < CASES[case])


@pytest.mark.parametrize("name", ["cells", "discs of a layer", "common compliance"])
def test_derivatives_are_those_of_the_step(name):
    model = MODELS[name]
    rng = np.random.default_rng(5)
    state, twist, loads = drawn(model, 1, rng)
    state, twist, before = 0.03 * state[0], 0.1 * twist[0], np.roll(loads[0], 1)
    given = {"loads": (before, loads[0])}
    slopes = model.step_jacobians(state, twist, None, 1e-3, **given)
    change = 1e-5 * state * rng.normal(size=state.shape)
    turn = 1e-6 * rng.normal(size=3) * twist
    ends = [
        model.step(state + k * change, twist + k * turn, None, 1e-3, **given)
        for k in (1.0, -1.0)
    ]
    new, wrench = (0.5 * (one - other) for one, other in zip(*ends, strict=True))
    axes = "di,i->d" if state.ndim == 1 else "dan,an->d"
    got = np.einsum(axes, slopes.wrench_state, change) + slopes.wrench_twist @ turn
    np.testing.assert_allclose(got, wrench, atol=1e-6 * abs(wrench).max())
    axes = "ij,j->i" if state.ndim == 1 else "abn,bn->an"
    got = np.einsum(axes, slopes.state_state, change) + slopes.state_twist @ turn
    np.testing.assert_allclose(got, new, atol=1e-6 * abs(new).max())


QUICK = ["cells of a layer", "discs", "discs with a metric", "discs of a layer", "common compliance"]  # fmt: skip


@pytest.mark.parametrize("name", QUICK)
def test_loads_in_order_go_straight_to_compiled_code(name):
    """As one contact, as a batch, and as lists, which are checked in Python, results are the same."""
    model = MODELS[name]
    rng = np.random.default_rng(9)
    state, twist, loads = drawn(model, 3, rng)
    before = np.roll(loads, 1, axis=0)
    shares = rng.uniform(0.1, 1.0, loads.shape)
    covers = np.where(before > 0.0, shares, 0.0), np.where(loads > 0.0, shares, 0.0)
    for given in (
        {"loads": loads},
        {"loads": (before, loads)},
        {"loads": loads, "cover": covers[1]},
        {"loads": (before, loads), "cover": covers},
    ):
        ends = model.step(state, twist, None, 1e-3, **given)
        borne = seen(given["loads"], given.get("cover"))
        cells = model._bearing(loads)
        assert model.compiled.step_borne(cells, state, twist, 1e-3, borne)
        for b in range(3):
            one = {k: _row(each, b) for k, each in given.items()}
            alone = model.step(state[b], twist[b], None, 1e-3, **one)
            listed = {k: _row(each, b, list) for k, each in given.items()}
            checked = model.step(state[b], list(twist[b]), None, 1e-3, **listed)
            for got, *wanted in zip(ends, alone, checked, strict=True):
                for each in wanted:
                    np.testing.assert_array_equal(got[b], each)


def _row(value, b, kind=np.asarray):
    return (
        tuple(kind(each[b]) for each in value)
        if isinstance(value, tuple)
        else kind(value[b])
    )


def test_a_model_with_another_law_and_one_from_a_file_bear_loads():
    model = MODELS["discs of a layer"]
    state, twist, loads = drawn(model, 3, np.random.default_rng(10))
    model.step(state, twist, None, 1e-3, loads=loads)
    other = model.with_law(LAW)
    new = pf.ReducedModel(GRADED, LAW, pad=LAYER)
    for one, wanted in ((pickle.loads(pickle.dumps(model)), model), (other, new)):
        got = one.step(state, twist, None, 1e-3, loads=loads)
        wanted = wanted.step(state, twist, None, 1e-3, loads=loads)
        for each, right in zip(got, wanted, strict=True):
            np.testing.assert_array_equal(each, right)


def test_loads_that_make_no_sense_are_refused():
    model = MODELS["discs of a layer"]
    loads = model.patch.weights()
    inputs = model.rest(), [0.0, 0.0, 0.0]
    for given, words in (
        ({"loads": loads[1:]}, r"loads.*have shape \[..., 384\]"),
        ({"loads": -loads}, "loads.*>= 0"),
        ({"loads": loads * np.nan}, "loads.*finite"),
        ({"loads": (-loads, loads)}, "loads.*>= 0"),
        ({"loads": (-loads, loads), "cover": (loads, loads)}, "loads.*>= 0"),
        ({"loads": loads.astype(str)}, "loads.*numbers"),
        ({"loads": loads, "cover": 2.0 * np.ones(384)}, r"cover.*\[0, 1\]"),
        ({"loads": loads, "cover": -np.ones(384)}, r"cover.*>= 0"),
        ({"loads": loads, "cover": np.ones(24)}, r"cover.*shape"),
        ({"loads": loads, "cover": 0.0 * loads}, "cover.*> 0 if a cell is loaded"),
        ({"loads": loads, "cover": (2.0 + loads, loads)}, r"cover.*\[0, 1\]"),
        ({"loads": [loads, [1.0]]}, "loads.*rows of equal length"),
        ({"cover": loads}, "loads.*be given"),
    ):
        with refused(words):
            model.step(*inputs, None, 1e-3, **given)
    still = np.zeros(3)
    for wrong, words in (
        ((inputs[0], still * np.nan, None, 1e-3), "twist.*finite"),
        ((inputs[0] * np.nan, still, None, 1e-3), "state.*finite"),
        ((inputs[0], still, None, -1e-3), "dt.*>= 0"),
        ((inputs[0], [True, 0.0, 0.0], None, 1e-3), "twist.*truth"),
        ((inputs[0], still[:2], None, 1e-3), "twist.*shape"),
        ((inputs[0][1:], still, None, 1e-3), "state.*shape"),
    ):
        with refused(words):
            model.step(*wrong, loads=loads)
    with refused("normal_force.*None if loads"):
        model.step(*inputs, 1.0, 1e-3, loads=loads)
    with refused("moments.*None if loads"):
        model.step(*inputs, None, 1e-3, moments=[0.0, 0.0], loads=loads)
    one = pf.ReducedModelPublished(GRADED, DAMPED)
    with refused("loads.*without cells"):
        one.step(one.rest(), [0.0, 0.0, 0.0], None, 1e-3, loads=loads)


@pytest.mark.parametrize("name", ["discs", "discs of a layer", "common compliance"])
def test_bodies_and_coupled_patches_step_as_the_model_at_their_new_twist(name):
    model = MODELS[name]
    state, twist, loads = drawn(model, 3, np.random.default_rng(6))
    loads = loads / loads.sum(-1, keepdims=True)
    given = {"loads": (np.roll(loads, 1, axis=0), loads)}
    mass = np.array([0.1, 0.1, 1e-5])
    body = pf.SlidingBody(mass[0], mass[2], model)
    flat = 0.1 * state.reshape(3, -1)
    end = body.step(flat, twist, None, 1e-3, **given)
    new, wrench = model.step(0.1 * state, end.twist, None, 1e-3, **given)
    np.testing.assert_allclose(end.wrench, wrench, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(
        mass * (end.twist - twist), 1e-3 * end.wrench, atol=1e-10
    )
    # Beside a patch with a pressure of its own, which does not touch it.
    patches = CoupledPatches([model, model])
    host = HostStep(
        np.stack([twist, twist], 1),
        np.ones((3, 2)),
        np.zeros((3, 2, 3)),
        np.diag(np.tile(1e-3 / mass, 2)),
        loads=[given["loads"], None],
    )
    found = patches.step(np.concatenate([flat, flat], -1), host, 1e-3)
    assert found.converged.all()
    np.testing.assert_allclose(found.wrench[:, 0], end.wrench, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(found.normal_force[:, 0], loads.sum(-1), rtol=1e-14)
    np.testing.assert_allclose(
        patches.states(found.state)[0], new, atol=1e-6 * abs(new).max()
    )
    with refused("normal_force.*None if loads"):
        body.step(flat, twist, 1.0, 1e-3, **given)
    with refused("loads.*list of 2"):
        patches.step(patches.rest(3), host._replace(loads=loads), 1e-3)


def rolled(model, rng, scale):
    """Return state, twists, and what was pressed before and in each step of two contacts."""
    steps = 5
    cells = model.patch.cells
    state = scale * drawn(model, 2, rng)[0]
    twist = rng.normal(size=(2, steps, 3)) * [0.003, 0.003, 0.3]
    loads = rng.exponential(3.0 / cells, (2, steps, cells))
    loads = loads * (rng.random(loads.shape) > 0.3)
    first = rng.exponential(3.0 / cells, cells)
    cover = np.where(loads > 0.0, rng.uniform(0.2, 1.0, loads.shape), 0.0)
    return state, twist, {"loads": (first, loads), "cover": (np.ones(cells), cover)}


ROLLED = {"discs": 1.0, "discs of a layer": 20.0, "common compliance": 20.0}
"""Models, and sizes of the first state, in 3 um: pads are to slip."""


@pytest.mark.parametrize("name", ROLLED)
def test_a_rollout_under_a_row_of_loads_is_its_steps(name):
    model = MODELS[name]
    state, twist, given = rolled(model, np.random.default_rng(7), ROLLED[name])
    end, wrenches, states = rollout_states(model, state, twist, None, 1e-3, **given)
    (before, loads), (covered, cover) = given.values()
    before, covered = (np.tile(each, (2, 1)) for each in (before, covered))
    for t in range(twist.shape[1]):
        np.testing.assert_allclose(states[:, t], state, rtol=1e-9, atol=1e-15)
        pair = {"loads": (before, loads[:, t]), "cover": (covered, cover[:, t])}
        state, wrench = model.step(state, twist[:, t], None, 1e-3, **pair)
        np.testing.assert_allclose(wrenches[:, t], wrench, rtol=1e-9, atol=1e-12)
        before, covered = loads[:, t], cover[:, t]
    np.testing.assert_allclose(end, state, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("name", ROLLED)
def test_derivatives_by_loads_are_those_of_differences(name):
    """Forwards, backwards, and of one step, along changes of state, twists and loads."""
    model = MODELS[name]
    rng = np.random.default_rng(8)
    state, twist, given = rolled(model, rng, ROLLED[name])
    (first, loads), cover = given.values()
    change = RolloutTangent(
        3e-3 * state * rng.normal(size=state.shape),
        3e-3 * twist * rng.normal(size=twist.shape),
        loads * rng.normal(size=loads.shape),
    )

    def moved(far):
        inputs = state + far * change.state, twist + far * change.twist, None, 1e-3
        pair = first, loads + far * change.normal_force
        return rollout(model, *inputs, loads=pair, cover=cover)

    ends = zip(moved(1e-5), moved(-1e-5), strict=True)
    new, pulls = ((one - other) / 2e-5 for one, other in ends)
    inputs = model, state, twist, None, 1e-3
    found = rollout_jvp(*inputs, change, **given)
    np.testing.assert_allclose(found.wrenches_dot, pulls, atol=1e-6 * abs(pulls).max())
    np.testing.assert_allclose(found.state_dot, new, atol=1e-6 * abs(new).max())
    bars = rng.normal(size=pulls.shape)
    end = rng.normal(size=new.shape) / abs(new).max()
    back = rollout_vjp(*inputs, bars, end, **given)
    pairs = zip(back[:3], change[:3], strict=True)
    total = sum((one * other).sum() for one, other in pairs)
    wanted = (bars * found.wrenches_dot).sum() + (end * found.state_dot).sum()
    assert total == pytest.approx(wanted, rel=1e-9)
    by_law = rollout_jacobian(*inputs, **given).d_wrenches
    wanted = np.einsum("btd,btdp->p", bars, by_law)
    back = rollout_vjp(*inputs, bars, **given).parameters
    np.testing.assert_allclose(back, wanted, atol=1e-9 * abs(wanted).max())
    one = {"loads": (np.tile(first, (2, 1)), loads[:, 0])}
    slopes = model.step_jacobians(state, twist[:, 0], None, 1e-3, **one)
    pressed = RolloutTangent(normal_force=change.normal_force[:, :1])
    pair = {"loads": (first, loads[:, :1])}
    wanted = rollout_jvp(model, state, twist[:, :1], None, 1e-3, pressed, **pair)
    got = np.einsum("bdn,bn->bd", slopes.wrench_load, change.normal_force[:, 0])
    wrench = wanted.wrenches_dot[:, 0]
    np.testing.assert_allclose(got, wrench, atol=1e-9 * abs(wrench).max())
    discs = model._bearing(loads).members.sums(change.normal_force[:, 0])
    axes = "bsn,bn->bs" if state.ndim == 2 else "ban,bn->ban"
    got = np.einsum(axes, slopes.state_load, discs)
    scale = abs(wanted.state_dot).max()
    np.testing.assert_allclose(got, wanted.state_dot, atol=1e-9 * scale)


def test_rows_of_loads_that_make_no_sense_are_refused():
    model = MODELS["discs"]
    loads = np.ones((3, model.patch.cells))
    twist = np.zeros((3, 3))
    for given, words in (
        ({"loads": loads[:2]}, r"loads.*\[..., 3, 384\], the steps of the rollout"),
        ({"loads": loads[:, 1:]}, r"loads.*\[..., 3, 384\]"),
        ({"loads": -loads}, "loads.*>= 0"),
        ({"loads": loads * np.nan}, "loads.*finite"),
        ({"loads": (loads[0, 1:], loads)}, "loads.*"),
        ({"cover": loads}, "loads.*be given"),
    ):
        with refused(words):
            rollout(model, None, twist, None, 1e-3, **given)
    with refused("normal_force.*None if loads"):
        rollout(model, None, twist, 1.0, 1e-3, loads=loads)
    change = RolloutTangent(normal_force=np.ones((3, 7)))
    with refused("tangent.normal_force.*shape"):
        rollout_jvp(model, None, twist, None, 1e-3, change, loads=loads)
