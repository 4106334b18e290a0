"""Pressure laws: profiles, load-dependent shapes, moments."""

import dataclasses
import math

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES, LinearGradient
from tests.support.contacts import CELL
from tests.support.contacts import published_finger as soft

ROUNDING = 1e-13
"""Relative: sums of some hundred terms of the same sign, each rounded at 1e-16."""


def test_linear_gradient_moves_the_centre_of_pressure():
    # p = 1 + gx x + gy y on a centred shape: CoP = (gx <x^2>, gy <y^2>).
    gx = 30.0
    gy = -50.0
    (a, b) = (0.03, 0.02)
    patch = pf.ContactPatch.rectangle(a, b, (30, 20), pressure=LinearGradient((gx, gy)))
    second_x = a**2 / 12 * (1 - 1 / 900)
    second_y = b**2 / 12 * (1 - 1 / 400)
    assert patch.centre_of_pressure() == pytest.approx(
        (gx * second_x, gy * second_y), rel=1e-12
    )
    assert not patch.depends_on_load
    # A cut cell's centroid carries the mean of a linear pressure: the total is that of the true disc.
    disc = pf.ContactPatch.disc(0.01, 9, pressure=LinearGradient((gx, gy)))
    at_the_centre = (1.0 / disc.area()) * np.ones(disc.cells)
    p = 1 + disc.positions @ (gx, gy)
    assert disc.pressure_values(1.0) == pytest.approx(at_the_centre * p, rel=1e-12)


def test_a_steep_gradient_errs_by_the_moment_within_cells():
    """The continuous pressure `1 + g x` has its centre at `g w^2/12`, cells of one pressure at `g (w^2 - h^2)/12`."""
    width = 0.02
    steep = 1.9 / 0.02  # 1 to 39
    for cells, parts in ((21, 1), (21, 2), (5, 3)):
        patch = pf.ContactPatch.rectangle(
            width, cells=cells, pressure=LinearGradient((steep, 0.0))
        ).refined(parts)
        short = steep * width**2 / 12.0 - patch.centre_of_pressure()[0]
        assert short == pytest.approx(
            steep * (width / cells / parts) ** 2 / 12.0, rel=1e-9
        )
    steps = np.tile(np.arange(1.0, 40.0, 1.9), (21, 1))
    mapped = pf.ContactPatch.from_pressure(steps, width=width)
    assert mapped.refined(4).centre_of_pressure() == pytest.approx(
        mapped.centre_of_pressure(), rel=1e-12
    )


def test_any_function_of_two_numbers_is_a_pressure():
    def one_sided(x, y):
        return math.exp(x / 0.01) if y > 0 else 0.0

    patch = pf.ContactPatch.rectangle(0.02, cells=10, pressure=one_sided)
    assert patch.cells == 50 and (patch.positions[:, 1] > 0).all()
    x = patch.positions[:, 0]
    assert patch.weights() == pytest.approx(
        np.exp(x / 0.01) / np.exp(x / 0.01).sum(), rel=1e-14
    )


def test_fixed_soft_finger_drops_what_it_never_loads():
    patch = pf.ContactPatch.rectangle(
        0.02, cells=21, pressure=pf.SoftFinger(c=0.005, k=2.0)
    )
    assert not patch.depends_on_load
    distance = np.hypot(*patch.positions.T)
    assert (distance < 0.005).all()
    profile = np.sqrt(1 - (distance / 0.005) ** 2)
    # Through logarithms: one more rounding in a number of size 10.
    assert patch.weights() == pytest.approx(profile / profile.sum(), rel=1e-12)
    assert patch.weights(0.0).sum() == pytest.approx(1.0)


def test_the_profile_itself_may_follow_the_load():
    patch = pf.ContactPatch.rectangle(
        0.02, cells=21, pressure=soft(k=None, k_per_newton=2.0)
    )
    load = 1.73
    radius = 6 * CELL * load ** (1 / 3)
    k = 2.0 * load
    distance = np.hypot(*patch.positions.T)
    profile = np.where(
        distance < radius, np.abs(1 - (distance / radius) ** k), 0.0
    ) ** (1 / k)
    assert patch.weights(load) == pytest.approx(profile / profile.sum(), rel=1e-11)
    # At small loads the profile is a needle that underflows: all of it is then on the centre cell.
    assert patch.weights(1e-9).max() == 1.0
    assert patch.weights(1e-9)[patch.cells // 2] == 1.0


@pytest.mark.parametrize(("cells", "sharing"), [(21, 1), (20, 4)])
def test_nearest_cells_share_the_load_of_a_tiny_contact(cells, sharing):
    patch = pf.ContactPatch.rectangle(0.02, cells=cells, pressure=soft())
    weights = patch.weights(1e-9)
    assert np.sort(weights)[-sharing:] == pytest.approx(
        [1 / sharing] * sharing, rel=1e-15
    )
    assert (weights > 0).sum() == sharing


def test_cells_exactly_on_the_rim_share_the_load_if_no_other_is_inside():
    law = pf.SoftFinger(c=0.5, k=2.0)
    patch = dataclasses.replace(
        pf.ContactPatch.points([(0.5, 0.0), (0.0, -0.5), (1.0, 0.0)]), pressure=law
    )
    assert patch.weights().tolist() == [0.5, 0.5]


def test_no_load_has_no_shape():
    patch = pf.ContactPatch.rectangle(0.02, cells=21, pressure=soft())
    assert not patch.weights(0.0).any() and patch.weights(0.0).shape == (349,)
    assert patch.contact_radius(0.0) == 0.0 and patch.area(0.0) == 0.0
    assert not patch.pressure_values(0.0).any()
    # A fixed shape keeps it.
    assert pf.ContactPatch.rectangle(0.02).contact_radius(0.0) > 0.0


def test_area_counts_the_cells_under_load():
    patch = pf.ContactPatch.rectangle(0.02, cells=21, pressure=soft())
    assert patch.area(1e3) == pytest.approx(349 * CELL**2)
    assert patch.area(1e-9) == pytest.approx(CELL**2)
    assert patch.area([1e3, 0.0]) == pytest.approx([349 * CELL**2, 0.0])


def test_normal_forces_lead_the_shape():
    loads = np.array([[0.0, 0.3, 1.0], [2.0, 5.0, 50.0]])
    for patch in (
        pf.ContactPatch.rectangle(
            0.02, cells=21, pressure=soft(k=None, k_per_newton=2.0)
        ),
        pf.ContactPatch.line(0.02, 5, profile=[1, 2, 3, 4, 5]),
    ):
        together = (
            patch.weights(loads),
            patch.centre_of_pressure(loads),
            patch.contact_radius(loads),
            patch.second_moment(loads),
            patch.area(loads),
            patch.moments(3, loads),
            patch.pressure_values(loads),
        )
        for index in np.ndindex(loads.shape):
            load = loads[index]
            alone = (
                patch.weights(load),
                patch.centre_of_pressure(load),
                patch.contact_radius(load),
                patch.second_moment(load),
                patch.area(load),
                patch.moments(3, load),
                patch.pressure_values(load),
            )
            for whole, part in zip(together, alone, strict=True):
                # Not bit for bit: vectorised logarithms may round their last lanes differently.
                assert whole[index] == pytest.approx(part, rel=ROUNDING, abs=1e-25)


def test_moments():
    patch = PUBLISHED_PATCHES["NonConvex2"]()
    central = patch.moments(3)
    raw = patch.moments(3, about=(0.0, 0.0))
    assert central.shape == (4, 4)
    assert central[0, 0] == pytest.approx(1.0) and raw[0, 0] == pytest.approx(1.0)
    assert (raw[1, 0], raw[0, 1]) == pytest.approx(
        tuple(patch.centre_of_pressure()), rel=ROUNDING
    )
    assert (central[1, 0], central[0, 1]) == pytest.approx((0, 0), abs=1e-17)
    assert central[2, 0] + central[0, 2] == pytest.approx(
        patch.second_moment(), rel=ROUNDING
    )
    assert central[2, 0] == pytest.approx(raw[2, 0] - raw[1, 0] ** 2, rel=1e-11)
    assert central[3, 1] == 0.0 and raw[2, 2] == 0.0
