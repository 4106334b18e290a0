"""Fields over a contact: they add up to its wrench, and deform as elastic bodies do."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import half_space, tactile
from tests.support.half_space_slip import SlippingHalfSpace
from tests.support.refusals import refused

LAW = pf.LuGre(mu_c=0.8, mu_s=1.0, sigma_1=0.4, sigma_2=0.1, elasto_plastic=0.9)
SPRINGS = pf.LuGre(mu_c=0.8, sigma_1=0.0, elasto_plastic=0.9)
SQUARE = pf.ContactPatch.rectangle(0.02, cells=8)
METRIC = SQUARE.with_friction_metric(pf.friction_metric(0.4, 0.6, 1.0))
ONE_WAY = SQUARE.with_friction_metric(np.eye(2), (0.2, 0.1))
FINGER = pf.ContactPatch.disc(0.01, pressure=pf.SoftFinger(c=0.006, k=0.33))
HALF_SPACE = pf.Pad.half_space(shear_modulus=0.2e6, poisson_ratio=0.49)
LAYER = pf.Pad.layer(shear_modulus=0.2e6, thickness=3e-3)

MODELS = {
    "cells": pf.DistributedModel(SQUARE, LAW),
    "discs": pf.ReducedModel(SQUARE, LAW),
    "metric": pf.ReducedModel(METRIC, LAW),
    "asymmetric": pf.DistributedModel(ONE_WAY, LAW),
    "layer": pf.DistributedModel(SQUARE, LAW, pad=LAYER),
    "soft finger": pf.ReducedModel(FINGER, LAW),
}


def moved(model, seed, batch=3):
    """States, twists and loads of contacts that slid and stuck at random."""
    rng = np.random.default_rng(seed)
    state = model.rest(batch)
    twist = np.zeros((batch, 3))
    load = rng.uniform(1.0, 5.0, batch)
    for _ in range(5):
        twist = rng.normal(size=(batch, 3)) * [0.01, 0.01, 1.0]
        state, _ = model.step(state, twist, load, 10.0 ** rng.uniform(-4, -1, batch))
    return state, twist, load


@pytest.mark.parametrize("name", MODELS)
def test_forces_of_cells_add_up_to_the_wrench(name):
    model = MODELS[name]
    inputs = moved(model, 1)
    patch = model.reduction.patch
    found = tactile.forces(model, *inputs)
    wrench = np.einsum("nia,...in->...a", patch.levers(), found)
    expected = model.wrench(*inputs)
    np.testing.assert_allclose(wrench, expected, rtol=0, atol=1e-12 * 5.0)
    spread = np.einsum(
        "n,nia,...in->...a",
        patch.areas,
        patch.levers(),
        tactile.tractions(model, *inputs),
    )
    np.testing.assert_allclose(spread, expected, rtol=0, atol=1e-12 * 5.0)


@pytest.mark.parametrize("name", MODELS)
def test_slip_ratios_are_0_at_rest_and_1_in_steady_sliding(name):
    model = MODELS[name]
    patch = model.reduction.patch
    twist, load = np.array([0.02, 0.01, 2.0]), np.array([2.0, 0.0])
    if not patch.asymmetric:
        assert not tactile.slip_ratio(model, model.rest(2), np.zeros(3), load).any()
    state = model.rest(2)
    for _ in range(20):
        state, _ = model.step(state, twist, load, 1.0)
    pressed = patch.weights(2.0) > 0.0
    ratio = tactile.slip_ratio(model, state, twist, load)
    np.testing.assert_allclose(ratio[0, pressed], 1.0, rtol=1e-6)
    assert not ratio[0, ~pressed].any() and not ratio[1].any()
    slipping = tactile.slipping_area(model, state, twist, load)
    np.testing.assert_allclose(slipping, [patch.areas[pressed].sum(), 0.0], rtol=1e-12)


@pytest.mark.parametrize(
    "pad",
    [None, LAYER, pf.Pad.measured(4e3, common=0.4)],
    ids=["law", "layer", "common"],
)
def test_a_face_that_sticks_moves_as_a_whole(pad):
    """Displacement `-(d + phi x rho)` for shift d and turn phi far below those of slip, also between the cells."""
    model = pf.DistributedModel(SQUARE, SPRINGS, pad=pad)
    shift = np.array([1e-7, -2e-7, 1e-5])
    state = model.rest()
    for _ in range(200):
        state, _ = model.step(state, shift / 200, 2.0, 1.0)
    points = np.array([[0.0, 0.0], [7e-3, -3e-3], [9e-3, 9e-3]])
    expected = -(shift[:2] + shift[2] * np.stack([-points[:, 1], points[:, 0]], 1))
    found = tactile.displacement(model, state, tactile.markers(model, points))
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-3 * 2e-7)


def errors_of_a_face(patch, model, shift):
    """Return the largest and the mean square error of displacements, over the largest, and that beside the patch."""
    sides = np.median(patch.cell_extents(), axis=0)
    truth = SlippingHalfSpace(patch.positions, sides, 0.2e6, 0.49)
    load = 3.0
    full = 1.5 * 0.8 * load / HALF_SPACE._stuck(patch).stiffness[0, 0]
    path = np.array(shift) * full * [1.0, 1.0, 150.0]
    around = np.array([[0.015, 0.0], [0.0, -0.02]])
    points = np.concatenate([patch.positions, around])
    tractions = truth.tractions(path, 0.8 * load * patch.weights())
    sizes = np.broadcast_to(sides, (patch.cells, 2))
    soft = half_space.compliances(points, patch.positions, sizes, 0.2e6, 0.49)
    expected = -(soft @ tractions.T.ravel()).reshape(2, -1).T
    state = model.rest()
    for _ in range(50):
        state, _ = model.step(state, path, load, 1 / 50)
    for _ in range(5):
        state, _ = model.step(state, np.zeros(3), load, 0.01)
    found = tactile.displacement(model, state, tactile.markers(model, points))
    error = np.hypot(*(found - expected).T) / np.hypot(*expected.T).max()
    return error.max(), np.sqrt((error**2).mean()), error[-2:].max()


@pytest.mark.parametrize("shift", [(0.1, 0, 0), (0.6, 0, 0), (0, 0, 0.5)])
def test_the_face_of_a_half_space_bends_as_the_boundary_element_method_says(shift):
    model = pf.DistributedModel(SQUARE, SPRINGS, pad=HALF_SPACE)
    most, mean, beside = errors_of_a_face(SQUARE, model, shift)
    assert most < 0.1 and mean < 0.04 and beside < 0.03


def test_discs_of_single_cells_bend_a_half_space_as_cells_do():
    """Fewer cells than discs: each has a disc of its own, with a bristle of its spin."""
    patch = pf.ContactPatch.rectangle(0.02, cells=4)
    cells = pf.DistributedModel(patch, SPRINGS, pad=HALF_SPACE)
    few = pf.ReducedModel(patch, SPRINGS, pad=HALF_SPACE)
    assert few.reduction.patch.cells == patch.cells
    z = 1e-6 * np.random.default_rng(3).normal(size=(3, patch.cells))
    face = np.zeros(3)
    points = [[0.0, 0.0], [0.015, 0.002]]
    moved, expected = (
        tactile.displacement(
            model, np.concatenate([z[:d].ravel(), face]), tactile.markers(model, points)
        )
        for model, d in ((few, 3), (cells, 2))
    )
    np.testing.assert_allclose(moved, expected, rtol=1e-12)


def test_a_face_bends_alike_wherever_its_frame_lies():
    """The frame of a patch lies anywhere: forces and torques of discs act about their own centres."""
    points = np.array([[1e-3, 2e-3], [0.015, -0.004]])
    offset = np.array([0.03, -0.02])
    patch = pf.ContactPatch.rectangle(0.02, cells=6)
    away = dataclasses.replace(patch, positions=patch.positions + offset)
    here, there = (
        tactile.markers(
            pf.ReducedModel(each, SPRINGS, cells=4, pad=HALF_SPACE), points + by
        ).response
        for each, by in ((patch, 0.0), (away, offset))
    )
    assert np.abs(here[:, :, 2]).max() > 0.01 * np.abs(here).max()
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-3 * np.abs(here).max())


@pytest.mark.slow
@pytest.mark.parametrize("cells, mean", [(None, 0.04), (64, 0.06), (24, 0.13)])
@pytest.mark.parametrize("name", ["circle, Hertz", "square, uniform"])
def test_the_face_of_a_half_space_bends_with_any_number_of_discs(name, cells, mean):
    """The table of docs/pad-evidence.md."""
    dome = lambda x, y: max(1.0 - 1e4 * (x * x + y * y), 0.0) ** 0.5
    patch = pf.ContactPatch.rectangle(0.02, cells=16)
    if name == "circle, Hertz":
        patch = pf.ContactPatch.disc(0.01, cells=16, pressure=dome)
    model = pf.DistributedModel(patch, SPRINGS, pad=HALF_SPACE)
    if cells:
        model = pf.ReducedModel(patch, SPRINGS, cells=cells, pad=HALF_SPACE)
    paths = (
        (0.1, 0, 0),
        (0.3, 0, 0),
        (0.6, 0, 0),
        (0, 0, 0.15),
        (0, 0, 0.5),
        (0.5, 0, 0.4),
    )
    found = np.array([errors_of_a_face(patch, model, path) for path in paths])
    print(name, cells, "largest", found[:, 0].round(3), "mean", found[:, 1].round(3))
    assert found[:, 1].max() < mean


@pytest.mark.parametrize("pad", [None, LAYER], ids=["law", "layer"])
def test_tensors_have_the_same_fields_and_their_derivatives(front, pad):
    law = dataclasses.replace(LAW, sigma_1=0.0)
    plain = pf.ReducedModel(SQUARE, law, cells=6, pad=pad)
    model = front.model(SQUARE, law, "ReducedModel", cells=6, pad=pad)
    state, twist, load = moved(plain, 2)
    arrays = front.arrays(state, twist, load)
    marks = tactile.markers(plain, [[1e-3, 2e-3], [-4e-3, 0.0]])
    for field in (tactile.forces, tactile.slip_ratio):
        found = front.plain(field(model, *arrays))
        np.testing.assert_allclose(
            found, field(plain, state, twist, load), rtol=1e-9, atol=1e-12
        )
    face = front.plain(tactile.displacement(model, arrays[0], marks))
    np.testing.assert_allclose(
        face, tactile.displacement(plain, state, marks), rtol=1e-9, atol=1e-18
    )
    one = front.arrays(state[0], twist[0], load[0])
    slope = front.plain(
        front.grad(lambda z: tactile.slip_ratio(model, z, *one[1:]).sum())(one[0])
    )
    by = np.zeros_like(state[0])
    for index in np.ndindex(by.shape):
        change = np.zeros_like(by)
        change[index] = 1e-4 * np.abs(state[0]).max()
        ends = [
            tactile.slip_ratio(plain, state[0] + sign * change, twist[0], load[0]).sum()
            for sign in (1.0, -1.0)
        ]
        by[index] = (ends[0] - ends[1]) / (2.0 * change[index])
    np.testing.assert_allclose(slope, by, rtol=0, atol=1e-6 * np.abs(by).max())


def test_a_field_needs_cells():
    published = pf.ReducedModelPublished(SQUARE, LAW)
    with refused("model .* cells or discs"):
        tactile.forces(published, published.rest(), np.zeros(3), 1.0)
    line = pf.DistributedModel(pf.ContactPatch.line(0.02, cells=5), LAW)
    with refused("patch .* one line"):
        tactile.markers(line, [[0.0, 0.0]])
    model = MODELS["cells"]
    other = tactile.markers(MODELS["discs"], [[0.0, 0.0]])
    with refused("markers .* bristles"):
        tactile.displacement(MODELS["cells"], MODELS["cells"].rest(), other)
    with refused("points"):
        tactile.markers(model, [0.0, 0.0, 0.0])
    with refused("above .* between 0 and 1"):
        tactile.slipping_area(model, model.rest(), np.zeros(3), 1.0, above=1.0)


def test_a_solution_is_read_at_all_samples(tmp_path):
    """Forces add up to the recorded wrench, and everything is as the functions return it; also from a file."""
    model = MODELS["layer"]
    plate = pf.scenes.in_hand(model, normal_force=2.0, t_end=0.1)
    run = pf.simulate(plate, bristles="all")
    points = [[0.0, 0.0], [0.004, 0.006]]
    read = tactile.read(run, points=points)
    assert set(read.data) - set(run.data) == {
        f"{name}_fingers" for name in ("slip_ratio", "forces", "displacement")
    }
    data = read.data
    levers = model.patch.levers()
    wrench = np.einsum("nia,tin->ta", levers, data["forces_fingers"].values)
    columns = [run.data[name].values[:, 0] for name in ("fx", "fy", "tau")]
    np.testing.assert_allclose(wrench, np.stack(columns, -1), rtol=0, atol=1e-12)
    state, load = run.data["bristles_fingers"].values, 2.0
    ratio = tactile.slip_ratio(model, state, run.contact_twist(), load)
    np.testing.assert_array_equal(data["slip_ratio_fingers"], ratio)
    moved = tactile.displacement(model, state, tactile.markers(model, points))
    np.testing.assert_array_equal(data["displacement_fingers"], moved)
    assert np.abs(moved).max() > 1e-6
    again = pf.Solution.load(read.save(tmp_path / "read.nc"))
    assert again.data.identical(data)


def test_what_a_reading_needs_is_said_in_one_line():
    run = pf.simulate(pf.scenes.driven(MODELS["cells"], t_end=0.02))
    with refused("bristles must be recorded for fields"):
        tactile.read(run)
    with refused("contact must be one of patch, got 'hand'"):
        tactile.read(run, "hand")
    with refused("solution must be a Solution, got 3"):
        tactile.read(3)
