"""Cells that are small discs: their radii, what they add to sums over the patch, and the levers of their bristles."""

import dataclasses
import math

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

SQUARE = pf.ContactPatch.rectangle(0.02, cells=3)


def with_radii(patch, radii):
    return dataclasses.replace(patch, radii=np.broadcast_to(radii, patch.cells))


def test_one_disc_has_the_contact_radius_and_second_moment_of_a_disc():
    disc = pf.ContactPatch([[0.3, -0.1]], [1e-4], radii=[0.01])
    assert disc.contact_radius() == pytest.approx(2 / 3 * 0.01, rel=1e-14)
    assert disc.second_moment() == pytest.approx(0.5 * 0.01**2, rel=1e-14)


def test_a_disc_far_from_the_centre_adds_its_mean_distance():
    # the mean of |d + x| over a disc of radius a is d (1 + a^2/(8 d^2) + O((a/d)^4))
    d = 0.1
    a = 0.01
    pair = pf.ContactPatch([[d, 0.0], [-d, 0.0]], [1e-4, 1e-4], radii=[a, a])
    assert pair.contact_radius() == pytest.approx(
        d * (1.0 + a**2 / (8.0 * d**2)), rel=5e-6
    )
    assert pair.second_moment() == pytest.approx(d**2 + 0.5 * a**2, rel=1e-14)


def test_radii_of_zero_are_points_to_the_last_bit():
    same = with_radii(SQUARE, 0.0)
    assert (
        same == dataclasses.replace(SQUARE)
        and not same.has_discs
        and "radii" not in same.to_dict()
    )
    assert (
        same.contact_radius() == SQUARE.contact_radius()
        and same.second_moment() == SQUARE.second_moment()
    )
    np.testing.assert_array_equal(same.levers(), SQUARE.levers())


def test_levers_have_a_row_for_spin():
    radii = np.linspace(0.0, 0.004, 9)
    discs = with_radii(SQUARE, radii)
    np.testing.assert_array_equal(discs.levers()[:, :2], SQUARE.levers())
    np.testing.assert_array_equal(discs.levers()[:, 2, :2], 0.0)
    np.testing.assert_allclose(
        discs.levers()[:, 2, 2], math.sqrt(0.5) * radii, rtol=1e-15
    )
    # sum w B'B is the second moment of the load: the elastic stiffness of the patch
    stiffness = np.einsum(
        "n,nia,nib->ab", discs.weights(), discs.levers(), discs.levers()
    )
    assert stiffness[2, 2] == pytest.approx(discs.second_moment(), rel=1e-14)


def test_a_metric_scales_radii_by_the_root_of_half_its_trace():
    metric = pf.friction_metric(0.3, 2.0, 0.5)
    discs = with_radii(SQUARE, 0.002).with_friction_metric(metric)
    np.testing.assert_allclose(
        discs.lever_radii, 0.002 * math.sqrt(0.5 * (2.0**2 + 0.5**2)), rtol=1e-14
    )
    each = np.array([pf.friction_metric(0.1 * i, 1.0 + 0.1 * i, 1.0) for i in range(9)])
    many = with_radii(SQUARE, 0.002).with_friction_metric(each)
    np.testing.assert_allclose(
        many.lever_radii,
        0.002 * np.sqrt(0.5 * np.trace(each, axis1=1, axis2=2)),
        rtol=1e-14,
    )
    assert many.second_moment() == pytest.approx(
        np.einsum("n,nia,nia->a", many.weights(), many.levers(), many.levers())[2],
        rel=1e-12,
    )


def test_cells_without_load_are_dropped_with_their_radii():
    patch = pf.ContactPatch(
        np.eye(3, 2), [1.0, 1.0, 1.0], [1.0, 0.0, 2.0], radii=[0.1, 0.2, 0.3]
    )
    assert patch.radii.tolist() == [0.1, 0.3]
    assert not patch.radii.flags.writeable


def test_equality_repr_and_plain_data():
    discs = with_radii(SQUARE, 0.002)
    assert (
        discs != SQUARE
        and discs == with_radii(SQUARE, 0.002)
        and hash(discs) != hash(SQUARE)
    )
    assert "9 discs" in repr(discs) and "9 cells" in repr(SQUARE)
    assert pf.ContactPatch.from_dict(discs.to_dict()) == discs


def test_parts_of_a_disc_are_as_much_smaller_as_those_of_its_cell():
    discs = with_radii(SQUARE, 0.003).refined(3)
    np.testing.assert_array_equal(discs.radii, 0.001)


@pytest.mark.parametrize(
    ("radii", "message"),
    [
        ([-1.0] * 9, "radii must be >= 0, got -1.0"),
        ([0.1] * 8, r"radii must have shape \[9\], got shape \[8\]"),
        ([math.nan] * 9, "radii must be finite, got nan"),
    ],
)
def test_wrong_radii_are_refused_in_one_line(radii, message):
    with refused(message):
        dataclasses.replace(SQUARE, radii=radii)
