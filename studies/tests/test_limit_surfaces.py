"""Limit surfaces: the table of patches, the gradient line's closed forms, and the ellipsoid's errors."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import integrate

from planarfriction.limit_surface import LimitSurfaceCells, LimitSurfaceEllipsoid
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import Work
from planarfriction_studies.experiments.limit_surfaces import run as limit_surfaces
from planarfriction_studies.experiments.limit_surfaces.patches import (
    half_load_cell,
    linear_line,
    patch_comparisons,
)
from planarfriction_studies.experiments.runs import SIX_SHAPES


@pytest.fixture(scope="module")
def result():
    return limit_surfaces.run(Work(quick=True))


def test_all_comparisons_hold(result):
    assert [row.quantity for row in result.comparisons if not row.holds] == []


def test_the_whole_table_of_patches_is_compared(result):
    published = facts.published_table("patches")
    assert set(result.numbers["patches"]) == set(published)
    columns = {
        row.quantity.removeprefix("table of patches, "): row
        for row in result.comparisons
    }
    for column in published["Circle"]:
        row = columns[column.partition(" [")[0]]
        assert (row.reference, row.samples) == ("published", len(published))


def test_a_true_disc_would_not_pass_for_the_mask(result):
    ours = {name: dict(row) for name, row in result.numbers["patches"].items()}
    disc = ContactPatch.disc(0.01, 21)
    ours["Circle"]["contact radius, plain sum [m]"] = disc.contact_radius()
    assert [row.quantity for row in patch_comparisons(ours) if not row.holds] == [
        "table of patches, contact radius, plain sum"
    ]


@pytest.mark.parametrize("floor", [0.0, 0.3])
def test_closed_forms_of_a_linear_line(floor):
    found = linear_line(1.0, floor)
    load = 0.5 + floor

    def mean(function, points=None):
        return integrate.quad(
            lambda s: (s + floor) / load * function(s),
            0.0,
            1.0,
            points=points,
            epsabs=1e-13,
        )[0]

    middle = found["centre of pressure"] + 0.5
    halves = found["equal halves"] + 0.5
    assert mean(lambda s: s) == pytest.approx(middle, rel=1e-12)
    assert mean(lambda s: np.sign(s - halves), [halves]) == pytest.approx(
        0.0, abs=1e-12
    )
    assert mean(lambda s: np.sign(s - middle), [middle]) == pytest.approx(
        found["force"], rel=1e-11
    )
    assert mean(lambda s: abs(s - middle), [middle]) == pytest.approx(
        found["radius"], rel=1e-11
    )
    assert mean(lambda s: abs(s - halves), [halves]) == pytest.approx(
        found["torque"], rel=1e-11
    )


def test_a_gradient_from_zero():
    found = linear_line(1.0)
    assert found["equal halves"] + 0.5 == pytest.approx(math.sqrt(0.5), rel=1e-14)
    assert found["force"] == pytest.approx(1.0 / 9.0, rel=1e-13)
    assert found["radius"] == pytest.approx(16.0 / 81.0, rel=1e-13)
    assert found["torque"] == pytest.approx((2.0 - math.sqrt(2.0)) / 3.0, rel=1e-13)


@pytest.mark.parametrize("cells", [1, 2, 5, 21, 100])
def test_cell_that_holds_the_middle_of_the_load(cells):
    load = np.cumsum(np.arange(1, cells + 1))
    assert half_load_cell(cells) == 1 + np.searchsorted(load, 0.5 * load[-1])


def test_the_spin_without_force_is_not_about_the_centre_of_pressure(result):
    gradient = result.numbers["gradient"]
    cells = gradient["cells"]
    beside = gradient["ellipsoid"]
    assert cells["middle cell"] == pytest.approx(4 * 0.02 / 21, rel=1e-12)
    # Weights 6 to 21 against 1 to 14, of 231.
    assert cells["force"] == pytest.approx(1.0 / 11.0)
    offset = cells["middle cell"] - cells["centre of pressure"]
    radius = cells["radius"]
    assert beside["force at equal halves"] == pytest.approx(
        -offset / math.hypot(offset, radius), rel=1e-6
    )
    assert cells["torque"] < cells["radius"]


def test_ellipsoid_is_farther_point_by_point_than_as_a_surface(result):
    assert tuple(result.numbers["ellipsoid"]) == SIX_SHAPES
    for errors in result.numbers["ellipsoid"].values():
        assert errors["points, mean"] > 3.0 * errors["surfaces, mean"]
        assert errors["points, max"] >= errors["surfaces, max"]


def test_tables_are_measured_against_the_exact_surface(result):
    for errors in result.numbers["tables"].values():
        # nodes on the exact surface: neither the staircase of the sum nor the smoothing of the published table
        for other in ("published", "sum over cells"):
            assert (
                errors["smooth"]["force, mean [N]"]
                < 0.3 * errors[other]["force, mean [N]"]
            )
            assert (
                errors["smooth"]["torque, mean [N m]"]
                < 0.3 * errors[other]["torque, mean [N m]"]
            )
        assert errors["smooth"]["force, max [N]"] < 0.02


def test_points_have_no_staircase():
    # the sum over two points is exact; what is left of a table is its interpolation
    patch = ContactPatch.points([[-0.01, 0.0], [0.01, 0.0]])
    assert (
        limit_surfaces.table_errors(patch, (40, 80))["sum over cells"]["force, max [N]"]
        < 1e-12
    )


def test_an_ellipsoid_has_no_error_against_itself():
    surface = LimitSurfaceEllipsoid(PUBLISHED_PATCHES["Circle"]())
    errors = limit_surfaces.ellipsoid_errors(surface, (10, 20))
    assert max(value for name, value in errors.items() if "angle" not in name) < 1e-14


def test_two_points_have_a_closed_form():
    # two points on the x axis at +-L, r = L: a spin about one of them is (0, 1/2) and r/2 from the other alone, with
    # the second at rest; beyond it the force is 1 and the torque 0, where the ellipsoid says (0, 1, 1)/sqrt(2)
    surface = LimitSurfaceCells(ContactPatch.points([[-0.01, 0.0], [0.01, 0.0]]))
    errors = limit_surfaces.ellipsoid_errors(surface, (60, 120))
    assert errors["points, max"] == pytest.approx(
        math.sqrt(2.0 - math.sqrt(2.0)), abs=1e-6
    )


def test_data_is_complete_and_has_units(result):
    data = result.data["surfaces"]
    assert set(data.data_vars) == {"fx", "fy", "tau"} and set(
        data["shape"].values
    ) == set(SIX_SHAPES)
    assert all(
        variable.attrs["units"]
        for name, variable in data.variables.items()
        if name != "shape"
    )
    # the torque of a negative spin about the centre of pressure is r
    r = result.numbers["patches"]["Square"]["contact radius, plain sum [m]"]
    assert float(data.tau.sel(shape="Square")[-1, 0]) == pytest.approx(r, rel=1e-12)


def test_a_wrong_surface_would_be_noticed(result):
    row = next(
        row
        for row in result.comparisons
        if row.quantity.endswith("corresponding points, line")
    )
    other = limit_surfaces.ellipsoid_errors(
        LimitSurfaceCells(PUBLISHED_PATCHES["Line"](cells=23)), (50, 100)
    )
    broken = dataclasses.replace(row, difference=abs(other["points, max"] - row.theirs))
    assert not broken.holds
