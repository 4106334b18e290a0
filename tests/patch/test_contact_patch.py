"""Contact patches: the published table, shares of the load, plain data."""

import dataclasses
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES, Grid, LinearGradient
from tests.support.contacts import CELL
from tests.support.contacts import published_finger as soft

ROUNDING = 1e-13
"""Relative: sums of some hundred terms of the same sign, each rounded at 1e-16."""


@pytest.mark.parametrize(
    ("name", "cells", "centre", "radius", "second_moment"),
    [
        ("Square", 441, (0.0, 0.0), 7.64479985, 6.651550e-5),
        ("Circle", 317, (0.0, 0.0), 6.37994742, 4.581500e-5),
        ("Line", 21, (0.0, 0.0), 4.98866213, 3.325775e-5),
        ("LineGrad", 21, (0.0, 3.174603), 4.04040404, 2.317964e-5),
        ("LineGradX", 21, (-3.174603, 0.0), 4.04040404, 2.317964e-5),
        ("NonConvex1", 18, (0.0, 0.0), 8.60688222, 7.467876e-5),
        ("NonConvex2", 84, (2.619048, -0.238095), 6.57142057, 5.083144e-5),
    ],
)
def test_published_patches_to_every_printed_digit(
    name, cells, centre, radius, second_moment
):
    patch = PUBLISHED_PATCHES[name]()
    assert patch.name == name and patch.cells == cells
    # Half a unit of the last printed digit.
    assert patch.centre_of_pressure() * 1e3 == pytest.approx(centre, abs=0.5e-6)
    assert patch.contact_radius() * 1e3 == pytest.approx(radius, abs=0.5e-8)
    assert patch.second_moment() == pytest.approx(second_moment, abs=0.5e-11)
    assert patch.grid == Grid.around_origin(0.02, 0.02, 21, 21)


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
def test_published_patches_scale_with_the_width(name):
    small = PUBLISHED_PATCHES[name]()
    large = PUBLISHED_PATCHES[name](width=0.05)
    assert large.contact_radius() == pytest.approx(
        2.5 * small.contact_radius(), rel=ROUNDING
    )
    assert large.area() == pytest.approx(6.25 * small.area(), rel=ROUNDING)


@pytest.mark.parametrize("name", ["Square", "NonConvex1", "NonConvex2"])
def test_published_blocks_keep_their_shape_on_a_finer_grid(name):
    coarse = PUBLISHED_PATCHES[name]()
    fine = PUBLISHED_PATCHES[name](cells=63)
    assert fine.cells == 9 * coarse.cells
    assert fine.centre_of_pressure() == pytest.approx(
        coarse.centre_of_pressure(), abs=1e-16
    )
    # Nine point masses at distance 0 and cell/3 about a cell's centre: mean square 2 (2/3) (cell/3)^2.
    gain = 4 / 3 * (CELL / 3) ** 2
    assert fine.second_moment() == pytest.approx(
        coarse.second_moment() + gain, rel=ROUNDING
    )


def test_published_soft_finger():
    patch = pf.ContactPatch.rectangle(0.02, cells=21, pressure=soft())
    assert patch.depends_on_load
    assert patch.cells == 349
    assert (patch.weights(100.0) > 0.0).sum() == 349
    assert patch.second_moment(100.0) == pytest.approx(4.016835e-5, abs=0.5e-11)
    # R = 6 cells at 1 N: the cells whose centres lie within 6 cells, less the four on the circle itself.
    lattice = sum(i * i + j * j < 36 for i in range(-6, 7) for j in range(-6, 7))
    assert (patch.weights(1.0) > 0.0).sum() == lattice


PATCHES = {
    **PUBLISHED_PATCHES,
    "disc": lambda: pf.ContactPatch.disc(
        0.01, 7, pressure=LinearGradient((20.0, -30.0))
    ),
    "soft": lambda: pf.ContactPatch.rectangle(0.02, cells=9, pressure=soft()),
    "soft, k of the load": lambda: pf.ContactPatch.disc(
        0.01, 8, pressure=soft(k=None, k_per_newton=2.0)
    ),
    "points": lambda: pf.ContactPatch.points([(0, 0.1), (0.3, 1 / 3)], [0.1, 0.7]),
}


@pytest.mark.parametrize("make", PATCHES.values(), ids=PATCHES.keys())
def test_weights_are_shares(make):
    patch = make()

    @settings(deadline=None, max_examples=25)
    @given(st.floats(1e-12, 1e12))
    def check(load):
        weights = patch.weights(load)
        assert (weights >= 0.0).all()
        assert weights.sum() == pytest.approx(1.0, rel=ROUNDING)
        assert (patch.pressure_values(load) * patch.areas).sum() == pytest.approx(
            load, rel=ROUNDING
        )
        # r is a mean distance, <rho^2> a mean square one.
        assert patch.contact_radius(load) ** 2 <= patch.second_moment(load) * (
            1 + ROUNDING
        )

    check()


@pytest.mark.filterwarnings("ignore:patch 'points' is .* m wide")
@settings(deadline=None, max_examples=25)
@given(
    st.lists(
        st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.1, 10)),
        min_size=1,
        max_size=12,
    ),
    st.floats(-math.pi, math.pi),
    st.floats(-3, 3),
)
def test_moving_the_points_moves_the_centre_and_nothing_else(points, angle, shift):
    points = np.array(points)
    turn = np.array(
        [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    )
    patch = pf.ContactPatch.points(points[:, :2], points[:, 2])
    moved = pf.ContactPatch.points(points[:, :2] @ turn.T + shift, points[:, 2])
    # Rounding of coordinates of size 5, squared in <rho^2>.
    assert moved.centre_of_pressure() == pytest.approx(
        turn @ patch.centre_of_pressure() + shift, abs=1e-14
    )
    assert moved.contact_radius() == pytest.approx(patch.contact_radius(), abs=1e-14)
    assert moved.second_moment() == pytest.approx(patch.second_moment(), abs=1e-14)


def test_patches_are_frozen():
    patch = pf.ContactPatch.disc(0.01, 5)
    with pytest.raises(dataclasses.FrozenInstanceError):
        patch.name = "other"
    for array in (patch.positions, patch.areas, patch.weights(), patch.weights(1.0)):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    assert patch.weights() is patch.weights()


def test_arrays_of_the_caller_are_copied():
    positions = np.array([[0.0, 0.0], [1.0, 0.0]])
    patch = pf.ContactPatch.points(positions)
    positions[0] = 7.0
    assert patch.positions[0].tolist() == [0.0, 0.0]


def test_replace_and_pickle():
    patch = dataclasses.replace(
        pf.ContactPatch.rectangle(0.02), pressure=soft(), name="finger"
    )
    assert (patch.name, patch.cells, patch.depends_on_load) == ("finger", 349, True)
    assert np.array_equal(
        pickle.loads(pickle.dumps(patch)).weights(1.0), patch.weights(1.0)
    )
    assert (
        repr(patch)
        == "ContactPatch('finger', 349 cells of 21 x 21, SoftFinger pressure)"
    )


def test_refined_patches_keep_their_load_and_come_closer_to_the_continuum():
    square = pf.ContactPatch.rectangle(0.02, cells=7)
    line = pf.ContactPatch.line(0.02, 7)
    exact = {"square": 0.02**2 / 6, "line": 0.02**2 / 12}
    for name, patch in {"square": square, "line": line}.items():
        fine = patch.refined(3)
        assert fine.cells == patch.cells * (9 if name == "square" else 3)
        assert fine.area() == pytest.approx(patch.area(), rel=1e-12)
        error = [
            exact[name] - p.tile_weights() @ (p.positions**2).sum(1)
            for p in (patch, fine)
        ]
        # The midpoint rule is of second order.
        assert error[0] / error[1] == pytest.approx(9.0, rel=1e-6)
        assert fine.second_moment() == pytest.approx(exact[name], rel=1e-12)
    assert (line.refined(3).positions[:, 0] == 0.0).all()


def test_refined_maps_repeat_their_pressures_and_points_stay_points():
    patch = pf.ContactPatch.from_pressure([[1.0, 0.0], [2.0, 5.0]], 1e-3)
    fine = patch.refined(2)
    np.testing.assert_allclose(
        fine.weights().reshape(3, 4).sum(axis=1), patch.weights(), rtol=1e-14
    )
    np.testing.assert_allclose(
        fine.centre_of_pressure(), patch.centre_of_pressure(), atol=1e-18
    )
    feet = pf.ContactPatch.points([[0.0, 0.0], [0.1, 0.0]])
    assert feet.refined(4) is feet
