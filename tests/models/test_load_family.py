"""Load families: how close blended maps are, where their rungs stand, and what a run makes of it."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.models import load_family
from planarfriction.models.reduced_map import slip_factor
from planarfriction.scenes.packing import pack

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
SMALL = {"segments": 8, "speeds": 6}
PUBLISHED = pf.SoftFinger(c=6 * 0.02 / 21, n=1 / 3, k_per_newton=2.0, radius_max=0.01)
SOFT = pf.ContactPatch.rectangle(0.02, cells=21, pressure=PUBLISHED)
SCALED = pf.ContactPatch.points([(0.01, 0.0), (-0.01, 0.002), (0.0, 0.012)])
"""Three feet."""


def model(patch: pf.ContactPatch = SOFT, **options) -> pf.models.MomentModel:
    return pf.models.MomentModel(patch, LAW, **{**SMALL, **options})


def feet(*weights, loads=(1.0, 2.0)) -> pf.ContactPatch:
    """Three feet that share the load as measured."""
    pressure = pf.PressureMaps(loads, weights)
    return pf.ContactPatch(SCALED.positions, SCALED.areas, pressure)


def steady(model: pf.models.MomentModel, twist: np.ndarray, load: float) -> np.ndarray:
    """`z_ss` [m] in scaled coordinates."""
    return model.step(np.zeros_like(twist), twist, load, 1e6)[0]


def spread(count: int, seed: int = 0) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return generator.normal(size=(count, 3)) * [1.0, 1.0, 150.0] * 10.0 ** generator.uniform(-4, -1, (count, 1))


# ---------------------------------------------------------------------- closed forms


def test_the_slip_factor_is_that_of_the_very_load():
    loads = np.array([0.3, 1.1, 1.7, 40.0])
    together = slip_factor(SOFT, loads)
    for load, shape, factor in zip(loads, model(load_error=0.1).shapes_at(loads), together, strict=True):
        np.testing.assert_allclose(factor, slip_factor(SOFT, load), rtol=1e-13, atol=1e-18)
        np.testing.assert_array_equal(shape.factor, factor)
        assert shape.contact_radius**2 == pytest.approx(SOFT.second_moment(load), rel=1e-13)


def test_a_copy_begins_without_maps_and_builds_the_same():
    loads, twist, whole = np.geomspace(0.7, 3.0, 9), spread(5), model()
    found = [steady(whole, twist, load) for load in loads]
    copy = pickle.loads(pickle.dumps(whole))
    assert copy.load_rungs == [] and len(whole.load_rungs) > 2
    np.testing.assert_array_equal([steady(copy, twist, load) for load in loads], found)
    assert copy.load_rungs == whole.load_rungs


def test_a_shape_that_stays_needs_one_map_an_octave():
    still = feet([1, 2, 3], [10, 20, 30])
    family, fixed = model(still), model(pf.ContactPatch.points(SCALED.positions, [1, 2, 3]))
    twist = spread(50)
    for load in (1.0, 1.3, 1.9):
        np.testing.assert_allclose(steady(family, twist, load), steady(fixed, twist, load), rtol=0, atol=1e-13)
    assert family.load_rungs == [1.0]


def test_a_contact_that_only_grows_is_followed_without_further_maps():
    """Without a grid a growing soft finger keeps its form; rings of points stand in for that here."""
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = pf.ContactPatch.points(0.01 * np.stack([np.cos(angles), np.sin(angles)], 1))
    family = model(pf.ContactPatch(ring.positions, ring.areas, pf.SoftFinger(c=0.02, n=0.5, k=2.0)))
    family.shapes_at(np.linspace(1.01, 7.9, 40))
    assert family.load_rungs == [1.0, 2.0, 4.0]


def test_rungs_stand_where_the_error_asks_for_them():
    """From one foot to another: half the load is not half of z_ss, as the map is in coordinates that shift."""
    moving = feet([1, 1, 0.02], [0.02, 1, 1])
    counts = []
    for error in (0.3, 0.03, 0.003):
        family = model(moving, load_error=error)
        family.shapes_at(np.linspace(1.0, 2.0, 50))
        counts.append(len(family.load_rungs))
        assert all(load * 2**load_family.HALVINGS % 1.0 == 0.0 for load in family.load_rungs)
    assert counts[0] < counts[1] < counts[2] <= 2**load_family.HALVINGS + 1


# ---------------------------------------------------------------------- the stated error


@pytest.mark.parametrize("error", [2e-2, 4e-3])
def test_blended_steady_sliding_is_as_close_as_stated(error):
    family, exact, twist = model(load_error=error), model(load_error=0.0), spread(100)
    worst = []
    for load in (0.9, 1.3, 2.2, 2.6):
        ours, theirs = steady(family, twist, load), steady(exact, twist, load)
        worst.append((np.linalg.norm(ours - theirs, axis=1) / np.linalg.norm(theirs, axis=1)).max())
    assert max(worst) < error
    assert max(worst) > 1e-5  # or this compares nothing


@settings(max_examples=15, deadline=None)
@given(st.floats(1e-3, 1e4))
def test_any_load_has_a_shape_that_dissipates(load):
    soft = pf.ContactPatch.disc(0.01, 5, pressure=pf.SoftFinger(k=2.0, c=0.0055, n=1.0 / 3.0))
    chosen = model(soft, segments=4, speeds=5, load_error=0.05)
    twist = spread(20)
    if (soft.weights(load) > 0.0).sum() < 2:
        twist[:, 2] = 0.0  # a point does not resist a spin
    power = np.einsum("bi,bi->b", steady(chosen, twist, load), twist @ chosen.shape_at(load).factor.T)
    assert (power > 0.0).all()


def test_where_a_rung_is_a_single_point_the_other_is_taken_alone():
    pair = pf.ContactPatch.points([(0.0, 0.0), (0.011, 0.0)])
    patch = pf.ContactPatch(pair.positions, pair.areas, pf.SoftFinger(c=0.01, n=1.0, k=2.0))
    family, built = model(patch), model(patch, load_error=0.0)
    assert family.shape_at(1.099).contact_radius == 0.0
    assert family.load_rungs == []
    # the second point gets its first load at 1.1 N, between the last possible rungs at 1.09375 and 1.109375
    shape = family.shape_at(1.105)
    np.testing.assert_array_equal(shape.data, built.shape_at(1.109375).data)
    np.testing.assert_array_equal(shape.factor, built.shape_at(1.105).factor)
    assert family.load_rungs == [1.109375]


def test_one_load_and_many_give_the_same():
    family, other, twist = model(), model(), spread(3)
    loads = np.array([0.7, 1.9, 0.0])
    states, wrenches = family.step(np.zeros((3, 3)), twist, loads, 1e-3)
    assert not wrenches[2].any()
    for i in (1, 0):
        new, wrench = other.step(np.zeros(3), twist[i], loads[i], 1e-3)
        np.testing.assert_allclose(new, states[i], rtol=1e-12, atol=1e-20)
        np.testing.assert_allclose(wrench, wrenches[i], rtol=1e-12)


def test_jacobians_of_a_blend_are_its_derivatives():
    family, twist = model(load_error=0.5), spread(30, 3)
    load, state = 1.5, 3e-7 * np.random.default_rng(3).normal(size=(30, 3))
    assert family.shape_at(load).other is not None or family.shape_at(load).blend == 0.0
    found = family.jacobians(state, twist, load).wrench_twist
    for k, size in enumerate(1e-6 * np.abs(twist).max(axis=0)):
        move = size * np.eye(3)[k]
        slope = (family.wrench(state, twist + move, load) - family.wrench(state, twist - move, load)) / (2.0 * size)
        error = np.abs(found[..., k] - slope).max(axis=1) / np.abs(found[..., k]).max(axis=1)
        assert np.median(error) < 1e-5


# ---------------------------------------------------------------------- scenes


@pytest.mark.slow
def test_a_run_is_that_of_shapes_rebuilt_at_every_load():
    scenes = [pf.scenes.in_hand(model(load_error=error), t_end=0.45) for error in (2e-3, 0.0)]
    ours, theirs = (pf.simulate(scene, rtol=1e-6, atol=1e-5).data for scene in scenes)
    assert np.hypot(ours.x - theirs.x, ours.y - theirs.y).max() < 2e-7
    assert np.abs(ours.theta - theirs.theta).max() < 2e-5
    assert abs(float(ours.y[-1])) > 1e-4


def test_scenes_share_the_maps_without_a_copy():
    """A scene's record refers to the very map of the model at its load."""
    one, two = model(), model()
    contacts = [
        pf.Contact(one, pf.Signal.constant(1.2), name="a"),
        pf.Contact(two, pf.Signal.constant(1.3), name="b"),
    ]
    packed = pack(pf.Scene(pf.Body(1.0, 1.0), contacts, 0.1), 0.1)
    for of, load, there in zip((one, two), (1.2, 1.3), packed.models, strict=True):
        data = of.shape_at(load).data
        assert data is there.keepalive[0]
        assert data.ctypes.data == there.records.view(np.int64)[0, -2]


def test_a_family_forgets_before_it_takes_more_than_the_stated_memory(monkeypatch):
    """Shapes in use keep their maps, and what is built again is what it was."""
    lavish, loads, twist = model(), np.geomspace(0.3, 9.0, 40), spread(5)
    expected = [steady(lavish, twist, load) for load in loads]
    size = lavish.shape_at(1.2).data.nbytes
    monkeypatch.setattr(load_family, "MEMORY", 4 * size)
    family = model()
    shapes = family.shapes_at(loads)
    assert len(lavish.load_rungs) > 6
    for load, shape, there in zip(loads, shapes, lavish.shapes_at(loads), strict=True):
        assert len(family.load_rungs) <= 4
        np.testing.assert_array_equal(shape.data, there.data)
        np.testing.assert_array_equal(steady(family, twist, load), expected[loads.tolist().index(load)])


def test_a_family_forgets_shapes_too(monkeypatch):
    monkeypatch.setattr(load_family, "REMEMBERED", 5)
    family = model()
    shapes = family.shapes_at(np.linspace(1.0, 2.0, 23))
    assert len(family.shapes.each[0].family._shapes) <= 5
    assert [shape.factor.tobytes() for shape in shapes] == [
        shape.factor.tobytes() for shape in model().shapes_at(np.linspace(1.0, 2.0, 23))
    ]


def test_files_keep_the_stated_error(tmp_path):
    scene = pf.scenes.in_hand(pf.ReducedModel(SOFT, LAW, parts=1, load_error=0.01, **SMALL))
    scene.to_file(tmp_path / "scene.toml")
    assert pf.Scene.from_file(tmp_path / "scene.toml").contacts[0].model.load_error == 0.01
    with pytest.raises(pf.FrictionError, match="load_error must be >= 0"):
        model(load_error=-1.0)


def test_a_blend_is_nearer_to_the_nearer_rung():
    family, loads = model(), np.linspace(0.9, 2.7, 37).tolist()
    shapes = family.shapes_at(loads)
    rungs = np.array(family.load_rungs)
    blends = [(load, shape.blend) for load, shape in zip(loads, shapes, strict=True) if shape.other is not None]
    assert blends
    for load, blend in blends:
        low, high = rungs[rungs <= load].max(), rungs[rungs > load].min()
        assert blend == pytest.approx((load - low) / (high - low), abs=1e-12)
