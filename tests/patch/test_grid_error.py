"""`ContactPatch.grid_error`: closed forms on lines, the order of convergence, points."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from tests.support.refusals import refused


@pytest.mark.parametrize("cells", [5, 11])
def test_a_cell_beside_the_centre_of_rotation_pulls_with_all_its_load(cells):
    """At a hundredth of a cell from its middle its continuous friction is 0.02 of its load: the force errs by 0.98."""
    error = PUBLISHED_PATCHES["Line"](cells).grid_error()
    assert error.force == pytest.approx(0.98 / cells, rel=1e-6)
    assert error.cells == cells


@pytest.mark.parametrize("cells", [5, 11])
def test_the_force_on_a_line_errs_by_the_loads_on_both_sides(cells):
    """About a point of the line the force is the difference of the loads on both sides: `-2 y/L` of an even line."""
    line = dataclasses.replace(pf.ContactPatch.line(0.02, cells), radii=None)
    near = line.positions[np.abs(line.positions[:, 1]) < 0.02 / 4, 1]
    turns = np.concatenate([near - 0.01 * 0.02 / cells, near + 0.01 * 0.02 / cells])
    sides = (
        np.sign(line.positions[:, 1] - turns[:, None]) @ line.weights()
        + 2.0 * turns / 0.02
    )
    assert line.grid_error().force == pytest.approx(np.abs(sides).max(), rel=1e-6)


def test_a_spin_of_a_square_shows_what_the_points_miss():
    """The largest error of the torque is no less than that of the spin about the middle: `r_cells/r - 1`."""
    patch = pf.ContactPatch.rectangle(0.02, cells=9)
    missing = abs(
        1.0 - patch.contact_radius() / pf.LimitSurfaceExact(patch).contact_radius
    )
    error = patch.grid_error()
    assert error.torque > 0.9 * missing > 0.0
    spin = np.array([0.0, 0.0, 1.0])
    surfaces = pf.LimitSurfaceExact(patch), pf.LimitSurfaceCells(patch)
    exact, cells = (
        float(spin @ each.twist(-spin) / each.dissipation(each.twist(-spin)))
        for each in surfaces
    )
    # No direction is that of a spin alone.
    assert error.breakaway >= 0.8 * abs(cells / exact - 1.0) > 0.0


@pytest.mark.parametrize(
    "patch",
    [
        pf.ContactPatch.disc(0.01, 9),
        pf.ContactPatch.rectangle(
            0.02, cells=7, pressure=pf.LinearGradient((60.0, 30.0))
        ),
        PUBLISHED_PATCHES["NonConvex1"](),
        pf.ContactPatch.rectangle(0.02, 0.01, 9).with_friction_metric(
            pf.friction_metric(0.3, 0.5, 1.0)
        ),
    ],
    ids=["disc", "gradient", "pads", "brushed"],
)
def test_finer_cells_have_smaller_errors(patch):
    """All fall with the area of a cell, to a ninth; rims and pressure laws leave up to a fifth."""
    coarse = patch.grid_error()
    fine = patch.grid_error(refined=3)
    assert fine.cells == 9 * coarse.cells
    for name in ("force", "torque", "breakaway"):
        assert getattr(fine, name) < 0.2 * getattr(coarse, name)


def test_errors_of_cells_as_discs_stand_beside_those_of_points():
    for patch in (
        pf.ContactPatch.disc(0.01, 9),
        dataclasses.replace(pf.ContactPatch.line(0.02, 9), radii=None),
    ):
        error = patch.grid_error()
        assert (
            error.as_discs == patch.discs().grid_error()
            and error.as_discs.as_discs is None
        )
        for name in ("force", "torque", "breakaway"):
            assert getattr(error.as_discs, name) < 0.9 * getattr(error, name)
        assert str(error).endswith(f"; as discs {error.as_discs}".partition(" (")[0])
    coarse = patch.grid_error()
    fine = patch.grid_error(refined=3)
    assert (
        fine.as_discs.cells == 27 and fine.as_discs.force < 0.5 * coarse.as_discs.force
    )
    assert fine.as_discs.torque == pytest.approx(
        patch.refined(3).discs().grid_error().torque, rel=1e-6
    )


def test_a_shape_that_follows_its_load_is_compared_at_that_load():
    patch = pf.ContactPatch.disc(
        0.01, 15, pressure=pf.SoftFinger(c=0.005, n=1 / 3, k=2.0)
    )
    small = patch.grid_error(1.0)
    large = patch.grid_error(8.0)
    assert small.force > large.force  # fewer cells carry the smaller load
    with refused("normal_force must be given"):
        patch.grid_error()


def test_points_stand_for_themselves():
    feet = pf.ContactPatch.points([(0.0, 0.0), (0.01, 0.0)])
    assert feet.grid_error(refined=3) == pf.patch.GridError(0.0, 0.0, 0.0, 2)
    assert str(feet.grid_error()) == "force 0 %, torque 0 %, breakaway 0 % (2 cells)"


def test_what_cannot_be_compared_is_refused():
    patch = pf.ContactPatch.disc(0.01, 3)
    metrics = np.eye(2) * (1.0 + 0.1 * np.arange(patch.cells))[:, None, None]
    with refused("one friction metric"):
        patch.with_friction_metric(metrics).grid_error()
    with refused("refined must be"):
        patch.grid_error(refined=0)
