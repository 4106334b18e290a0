"""Pressure that follows the moments of the load: closed forms on a rectangle, edges, hulls, continuity."""

import dataclasses

import numpy as np
import pytest
import shapely

import planarfriction as pf
from tests.support.contacts import SOFT
from tests.support.refusals import refused

LOAD = 3.0
RECTANGLE = pf.ContactPatch.rectangle(0.1, 0.06)
X, Y = RECTANGLE.positions.T


def follow(patch, centre):
    """Return the weights with the centre of pressure asked for."""
    x, y = np.moveaxis(np.asarray(centre), -1, 0)
    return patch.weights(LOAD, moments=LOAD * np.stack([y, -x], -1))


def centre(patch, weights):
    return weights @ patch.positions


def test_within_the_kern_the_pressure_is_a_plane():
    """`p = p_0 (1 + x_c x / <x^2> + y_c y / <y^2>)` as long as that is positive: textbook bending of a pillar."""
    w = RECTANGLE.weights(None)
    plane = w * (1.0 + 0.012 * X / (w @ X**2) - 0.002 * Y / (w @ Y**2))
    assert plane.min() > 0.0
    np.testing.assert_allclose(
        follow(RECTANGLE, (0.012, -0.002)), plane, rtol=1e-11, atol=0.0
    )


def test_beyond_the_kern_an_edge_lifts():
    """Without tension, a strip whose load is d from its edge presses along 3 d of it, as a triangle."""
    fine = pf.ContactPatch.rectangle(0.1, 0.06, 200)
    x_c = 0.03
    weights = follow(fine, (x_c, 0.0))
    edge = 0.05
    size = 0.1 / 200
    pressing = weights > 0.0
    assert fine.positions[pressing, 0].min() == pytest.approx(
        edge - 3.0 * (edge - x_c), abs=size
    )
    peak = weights.max() / weights[pressing].mean()
    # Of a triangle; the last cell's middle is half a cell from the edge.
    assert peak == pytest.approx(2.0, rel=2e-2)


@pytest.mark.parametrize(
    "asked", [(0.012, 0.0), (0.03, -0.01), (-0.045, 0.02), (0.0, 0.027)]
)
def test_total_and_moments_come_out(asked):
    """They do to 1e-7 of the patch, also close to its edge: the compliance of the rule times the steepness there."""
    weights = follow(RECTANGLE, asked)
    assert weights.min() >= 0.0
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(centre(RECTANGLE, weights), asked, atol=1e-7 * 0.1)


def test_a_load_beyond_an_edge_lies_on_it():
    edge = np.where(X.max() == X, RECTANGLE.weights(), 0.0)
    np.testing.assert_allclose(
        follow(RECTANGLE, (0.2, 0.0)), edge / edge.sum(), atol=1e-7
    )
    corner = (X.min() == X) & (Y.max() == Y)
    np.testing.assert_array_equal(follow(RECTANGLE, (-0.3, 0.5)) > 0.0, corner)


def test_the_nearest_point_of_the_hull_carries_what_lies_beyond():
    rng = np.random.default_rng(3)
    for _ in range(20):
        patch = pf.ContactPatch.points(0.01 * rng.normal(size=(rng.integers(3, 12), 2)))
        hull = shapely.MultiPoint(patch.positions).convex_hull
        asked = 0.02 * rng.normal(size=(200, 2))
        nearest = [
            shapely.get_coordinates(shapely.shortest_line(hull, shapely.Point(p)))[0]
            for p in asked
        ]
        np.testing.assert_allclose(
            centre(patch, follow(patch, asked)), nearest, atol=1e-7
        )


def test_weights_are_continuous_where_cells_lift_and_beyond_the_edge():
    """A centre that moves by 1e-5 of the patch moves less than 1e-3 of the load, within the patch and off it."""
    along = np.linspace(0.0, 0.08, 80_001)[:, None] * (1.0, 0.3)
    weights = follow(pf.ContactPatch.rectangle(0.1, 0.06, 9), along)
    assert abs(np.diff(weights, axis=0)).sum(axis=1).max() < 1e-3


def test_the_own_centre_and_no_load_change_nothing():
    for patch in (RECTANGLE, SOFT):
        x, y = patch.centre_of_pressure(LOAD)
        np.testing.assert_allclose(
            patch.weights(LOAD, (LOAD * y, -LOAD * x)), patch.weights(LOAD), atol=1e-15
        )
        np.testing.assert_array_equal(
            patch.weights(0.0, (0.1, 0.1)), patch.weights(0.0)
        )


def test_a_line_tilts_along_itself_and_a_point_does_not():
    line = pf.ContactPatch.line(0.02, direction="x")
    weights = follow(line, (0.002, 0.005))
    np.testing.assert_allclose(centre(line, weights), (0.002, 0.0), atol=1e-9)
    point = pf.ContactPatch.points([(0.01, 0.02)])
    np.testing.assert_array_equal(follow(point, (0.5, 0.5)), [1.0])


@pytest.mark.parametrize(
    "patch", [RECTANGLE, pf.ContactPatch.line(0.02, direction="y")]
)
def test_a_patch_beside_its_origin_presses_as_one_at_it(patch):
    aside = np.array([0.3, -0.2])
    moved = dataclasses.replace(patch, positions=patch.positions + aside)
    asked = np.array([[0.0, 0.003], [0.03, 0.009], [-0.2, 0.1]])
    np.testing.assert_allclose(
        follow(moved, aside + asked), follow(patch, asked), atol=1e-7
    )


def test_batches_broadcast_and_are_those_of_each():
    loads = np.array([[1.0], [2.0]])
    moments = 0.01 * np.random.default_rng(0).normal(size=(3, 2))
    weights = RECTANGLE.weights(loads, moments)
    assert weights.shape == (2, 3, RECTANGLE.cells)
    np.testing.assert_array_equal(weights[1, 2], RECTANGLE.weights(2.0, moments[2]))


@pytest.mark.parametrize(
    "load, moments",
    [
        (None, (0.0, 0.0)),
        (1.0, (0.0,)),
        (1.0, (np.nan, 0.0)),
        ([1.0, 2.0, 3.0], [(0, 0), (0, 0)]),
    ],
)
def test_bad_moments_say_so(load, moments):
    with refused(r"moments|normal_force"):
        RECTANGLE.weights(load, moments)
