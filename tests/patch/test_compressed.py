"""Compressed patches: a few cells that keep the moments of many and nearly their limit surface."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from planarfriction.patch import PUBLISHED_PATCHES, surface_error
from planarfriction.patch.compressed import number_of_moments
from planarfriction.scenes.ready import in_hand, in_hand_load
from planarfriction_studies.experiments.in_hand.runs import CENTRES_OF_MASS, TIGHT, Case, distance
from planarfriction_studies.experiments.runs import LAW, simulated

SQUARE = pf.ContactPatch.rectangle(0.02)
SOFT = pf.ContactPatch.disc(0.01, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k_per_newton=2.0, radius_max=0.01))


def scaled_moments(patch, degree, size=0.01, normal_force=None):
    """Raw moments with lengths in units of `size`: all of order 1."""
    power = np.add.outer(np.arange(degree + 1), np.arange(degree + 1))
    return patch.moments(degree, normal_force, about=(0.0, 0.0)) / size**power


@pytest.mark.parametrize("shape", ["Square", "Circle", "NonConvex2"])
@pytest.mark.parametrize("degree", [1, 3, 5, 8])
def test_moments_are_kept_to_rounding_by_few_positive_weights(shape, degree):
    patch = PUBLISHED_PATCHES[shape]()
    few = patch.compressed(degree)
    assert few.cells <= number_of_moments(degree + 3) and few.cells < patch.cells
    assert (few.weights() > 0.0).all()
    np.testing.assert_allclose(scaled_moments(few, degree), scaled_moments(patch, degree), atol=1e-13)
    places = {tuple(place) for place in patch.positions.tolist()}
    assert {tuple(place) for place in few.positions.tolist()} <= places


def test_as_many_cells_as_sums_kept_suffice():
    few = SQUARE.compressed(6, cells=31)  # 28 moments, and three for the wrench of a spin
    assert few.cells <= 31
    np.testing.assert_allclose(scaled_moments(few, 6), scaled_moments(SQUARE, 6), atol=1e-13)
    assert np.abs(scaled_moments(few, 10) - scaled_moments(SQUARE, 10)).max() > 1e-6  # nobody asked for these


@pytest.mark.parametrize("shape", ["Square", "Circle", "NonConvex2"])
def test_a_spin_about_the_centre_of_pressure_has_the_same_wrench(shape):
    patch = PUBLISHED_PATCHES[shape]()
    x, y = patch.centre_of_pressure()
    spin = (y, -x, 1.0)
    few, whole = (pf.LimitSurfaceCells(each).wrench(spin) for each in (patch.compressed(), patch))
    np.testing.assert_allclose(few, whole, atol=1e-12, rtol=1e-12)  # of a symmetric patch: no force
    assert patch.compressed().contact_radius() == pytest.approx(patch.contact_radius(), rel=1e-13)


def test_surplus_cells_serve_the_limit_surface():
    lean, rich = SQUARE.compressed(4, cells=18), SQUARE.compressed(4, cells=45)
    assert surface_error(SQUARE, rich) < 0.5 * surface_error(SQUARE, lean)
    assert surface_error(SQUARE, rich) < 0.008  # 0.0065 measured, 0.020 without surplus
    assert surface_error(SQUARE, SQUARE) < 1e-14


@pytest.mark.parametrize("wanted", [1e-2, pytest.param(3e-3, marks=pytest.mark.slow)])
def test_error_raises_the_degree_until_it_is_met(wanted):
    few = SQUARE.compressed(3, error=wanted)
    assert surface_error(SQUARE, few) <= wanted
    assert few.cells < 100


@settings(max_examples=25, deadline=None)
@given(st.integers(3, 14), st.integers(3, 14), st.integers(1, 5), st.integers(0, 2**31), st.floats(0.0, 0.8))
def test_random_pressure_maps(rows, columns_, degree, seed, empty):
    random = np.random.default_rng(seed)
    values = random.random((rows, columns_)) * (random.random((rows, columns_)) > empty)
    values[rows // 2, columns_ // 2] = 1.0
    patch = pf.ContactPatch.from_pressure(values, 1e-3)
    few = patch.compressed(degree)
    assert few.cells <= min(patch.cells, number_of_moments(degree + 3))
    assert (few.weights() > 0.0).all()
    np.testing.assert_allclose(scaled_moments(few, degree), scaled_moments(patch, degree), atol=1e-12)


@pytest.mark.parametrize("parts", [1, 7])
def test_lines_have_moments_in_one_direction_only(parts):
    line = PUBLISHED_PATCHES["LineGradX"]().refined(parts)
    few = line.compressed(5, cells=21)
    assert few.cells <= 21
    assert (few is line) == (parts == 1)
    np.testing.assert_allclose(scaled_moments(few, 5), scaled_moments(line, 5), atol=1e-13)


def test_small_patches_are_returned_as_they_are():
    feet = pf.ContactPatch.points([(0.0, 0.0), (0.1, 0.0), (0.0, 0.2)])
    assert feet.compressed() is feet


def test_a_fine_grid_is_thinned_first():
    fine = pf.ContactPatch.disc(0.01, 101)
    few = fine.compressed()
    assert few.cells <= 45
    np.testing.assert_allclose(scaled_moments(few, 5), scaled_moments(fine, 5), atol=1e-12)
    assert surface_error(fine, few) < 0.01  # 0.005 measured


def test_the_same_call_gives_the_same_patch():
    first, second = SQUARE.compressed(), pf.ContactPatch.rectangle(0.02).compressed()
    assert (first.positions == second.positions).all() and (first.weights() == second.weights()).all()


def test_weights_follow_the_load():
    few = SOFT.compressed(3, loads=(1.0, 2.0))
    assert few.depends_on_load and few.cells < 110
    for load in few.pressure.loads[::5]:
        wanted = scaled_moments(SOFT, 3, normal_force=load)
        np.testing.assert_allclose(scaled_moments(few, 3, normal_force=load), wanted, atol=1e-12)
    between = np.geomspace(1.0, 2.0, 50)  # the grid's own <rho^2> moves in steps, as cells come in
    np.testing.assert_allclose(few.second_moment(between), SOFT.second_moment(between), rtol=0.03)
    np.testing.assert_allclose(few.centre_of_pressure(between), 0.0, atol=1e-9)
    assert (few.weights(0.0) == 0.0).all()


@pytest.mark.parametrize("patch", [SQUARE.compressed(2), SOFT.compressed(2, loads=(1.0, 1.2))])
def test_files_restore_it(patch):
    again = pf.ContactPatch.from_dict(json.loads(json.dumps(patch.to_dict())))
    assert (again.positions == patch.positions).all()
    assert (again.weights(1.1) == patch.weights(1.1)).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"degree": 0}, "degree must be an integer >= 1, got 0"),
        ({"cells": 5}, "cells must be at least 24, the number of sums that are kept, got 5"),
        ({"cells": 2.5}, "cells must be an integer >= 1"),
        ({"error": -1.0}, "error must be > 0"),
        ({"error": 0.1, "cells": 30}, "compressed must have only one of cells and error"),
        ({"loads": (1.0, 2.0)}, "loads must be left out"),
    ],
)
def test_bad_input(arguments, words):
    with pytest.raises(InvalidValueError, match=words):
        SQUARE.compressed(**arguments)


@pytest.mark.parametrize("loads", [None, (2.0, 1.0), (0.0, 1.0), (1.0, 2.0, 3.0)])
def test_bad_loads(loads):
    with pytest.raises(InvalidValueError, match="loads must"):
        SOFT.compressed(loads=loads)


def end_error(case):
    """Largest distance of the centre of mass from the full model's [m]."""
    patch = PUBLISHED_PATCHES[case.shape]()
    load = in_hand_load(case.load, placement=case.placement)
    runs = [
        simulated(
            in_hand(pf.DistributedModel(each, LAW), normal_force=load, centre_of_mass=CENTRES_OF_MASS[case.placement]),
            **TIGHT,
        )
        for each in (patch, patch.compressed())
    ]
    return float(distance(*runs).max())


def test_in_hand_position():
    assert end_error(Case("Circle", 1)) < 1e-4  # measured 0.04 mm; the published reduced model: 1.05 mm


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        *(Case(shape, load) for shape in PUBLISHED_PATCHES for load in (1, 2)),
        *(Case("Circle", load, 2) for load in (1, 2)),
    ],
    ids=lambda case: case.words,
)
def test_in_hand_positions_of_every_shape(case):
    assert PUBLISHED_PATCHES[case.shape]().compressed().cells <= 45
    assert end_error(case) < 1e-4  # at most 0.051 mm measured


def test_a_friction_metric_is_kept():
    patch = pf.ContactPatch.rectangle(0.02).with_friction_metric(pf.friction_metric(0.3, 1.0, 0.5), [0.1, 0.2])
    few = patch.compressed()
    assert few.cells < patch.cells
    np.testing.assert_array_equal(few.metric, patch.metric)
    np.testing.assert_array_equal(few.asymmetry, patch.asymmetry)
