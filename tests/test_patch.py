"""Contact patches: closed forms, the published table, convergence orders, properties, errors."""

from __future__ import annotations

import dataclasses
import json
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.errors import FrictionError, InvalidValueError
from planarfriction.patch import PUBLISHED_PATCHES, Grid, LinearGradient, Pressure, Uniform

ROUNDING = 1e-13
"""Relative: sums of some hundred terms of the same sign, each rounded at 1e-16."""

CELL = 0.02 / 21


def soft(**changes) -> pf.SoftFinger:
    """The soft finger of the published runs with changing pressure."""
    return pf.SoftFinger(**{"c": 6 * CELL, "n": 1 / 3, "k": 2.0, "radius_max": 0.01, **changes})


# ---------------------------------------------------------------------- the published table


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
def test_published_patches_to_every_printed_digit(name, cells, centre, radius, second_moment):
    patch = PUBLISHED_PATCHES[name]()
    assert patch.name == name and patch.cells == cells
    # Half a unit of the last printed digit.
    assert patch.centre_of_pressure() * 1e3 == pytest.approx(centre, abs=0.5e-6)
    assert patch.contact_radius() * 1e3 == pytest.approx(radius, abs=0.5e-8)
    assert patch.second_moment() == pytest.approx(second_moment, abs=0.5e-11)
    assert patch.grid == Grid.around_origin(0.02, 0.02, 21, 21)


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
def test_published_patches_scale_with_the_width(name):
    small, large = PUBLISHED_PATCHES[name](), PUBLISHED_PATCHES[name](width=0.05)
    assert large.contact_radius() == pytest.approx(2.5 * small.contact_radius(), rel=ROUNDING)
    assert large.area() == pytest.approx(6.25 * small.area(), rel=ROUNDING)


@pytest.mark.parametrize("name", ["Square", "NonConvex1", "NonConvex2"])
def test_published_blocks_keep_their_shape_on_a_finer_grid(name):
    coarse, fine = PUBLISHED_PATCHES[name](), PUBLISHED_PATCHES[name](cells=63)
    assert fine.cells == 9 * coarse.cells
    assert fine.centre_of_pressure() == pytest.approx(coarse.centre_of_pressure(), abs=1e-16)
    # Nine point masses at distance 0 and cell/3 about a cell's centre: mean square 2 (2/3) (cell/3)^2.
    gain = 4 / 3 * (CELL / 3) ** 2
    assert fine.second_moment() == pytest.approx(coarse.second_moment() + gain, rel=ROUNDING)


def test_published_soft_finger():
    patch = pf.ContactPatch.rectangle(0.02, cells=21, pressure=soft())
    assert patch.depends_on_load
    assert patch.cells == 349
    assert (patch.weights(100.0) > 0.0).sum() == 349
    assert patch.second_moment(100.0) == pytest.approx(4.016835e-5, abs=0.5e-11)
    # R = 6 cells at 1 N: the cells whose centres lie within 6 cells, less the four on the circle itself.
    lattice = sum(i * i + j * j < 36 for i in range(-6, 7) for j in range(-6, 7))
    assert (patch.weights(1.0) > 0.0).sum() == lattice


# ---------------------------------------------------------------------- closed forms and orders


def orders(make, quantity, exact, cells=(20, 40, 80, 160)):
    """Observed orders of convergence of `quantity(make(cells))` to `exact`."""
    errors = np.array([abs(quantity(make(n)) - exact) for n in cells])
    return np.log2(errors[:-1] / errors[1:])


def contact_radius(patch):
    return patch.contact_radius()


def second_moment(patch):
    return patch.second_moment()


@pytest.mark.parametrize("cells", [1, 2, 7, 20, 21, 64])
def test_disc_area_is_exact_on_every_grid(cells):
    patch = pf.ContactPatch.disc(0.01, cells)
    assert patch.area() == pytest.approx(math.pi * 1e-4, rel=1e-12)
    assert patch.centre_of_pressure() == pytest.approx((0, 0), abs=1e-16)


@pytest.mark.parametrize(
    ("quantity", "exact"), [(contact_radius, 2 * 0.01 / 3), (second_moment, 0.01**2 / 2)], ids=["2R/3", "R^2/2"]
)
def test_disc_converges_with_order_two(quantity, exact):
    found = orders(lambda n: pf.ContactPatch.disc(0.01, n), quantity, exact)
    # The rim's cells add a third-order term: the observed order rises to 2 and does not reach it.
    assert (found > 1.95).all() and (found < 2.01).all()
    assert (np.diff(found) > 0).all()


def test_disc_misses_only_the_spread_inside_its_cells():
    # Cells as points miss the spread inside them: h^2/6 in a whole cell, less in a cut one.
    radius, cells = 0.01, 41
    patch = pf.ContactPatch.disc(radius, cells)
    missing = radius**2 / 2 - patch.second_moment()
    whole = np.isclose(patch.areas, patch.grid.cell_area, rtol=1e-9)
    spread = (2 * radius / cells) ** 2 / 6
    assert spread * patch.weights()[whole].sum() < missing < spread


@pytest.mark.parametrize(("k", "ratio", "order"), [(1.0, 1 / 2, 2.0), (2.0, 3 * math.pi / 16, 1.5), (1e9, 2 / 3, 2.0)])
def test_soft_finger_contact_radius(k, ratio, order):
    # r/R = 2 (3/8) Gamma(3/k)^2 / (Gamma(2/k) Gamma(4/k)), with its values at k = 1, 2 and infinity.
    if k < 1e3:
        closed = 2 * (3 / 8) * math.gamma(3 / k) ** 2 / (math.gamma(2 / k) * math.gamma(4 / k))
        assert closed == pytest.approx(ratio, rel=1e-14)
    found = orders(
        lambda n: pf.ContactPatch.disc(0.01, n, pressure=pf.SoftFinger(c=0.01, k=k)), contact_radius, 0.01 * ratio
    )
    # At k = 2 the pressure ends like the square root of the distance to the rim: order 3/2 instead of 2.
    assert found[-1] == pytest.approx(order, abs=0.05)


def test_soft_finger_radius_follows_the_load():
    patch = pf.ContactPatch.disc(0.01, 161, pressure=pf.SoftFinger(c=0.004, n=1 / 3, k=2.0, radius_max=0.01))
    for load in (1.0, 3.0, 8.0, 27.0):
        radius = min(0.004 * load ** (1 / 3), 0.01)
        # Cells are 1.2e-4 m: 3 % of the smallest radius, and the error of order 3/2 above gives 0.5 % there.
        assert patch.contact_radius(load) == pytest.approx(3 * math.pi / 16 * radius, rel=5e-3)
    assert patch.contact_radius(27.0) == patch.contact_radius(1000.0)


@pytest.mark.parametrize("inner", [0.002, 0.005, 0.009])
def test_ring_closed_forms(inner):
    outer = 0.01

    def ring(cells):
        return pf.ContactPatch.ring(inner, outer, cells)

    assert ring(21).area() == pytest.approx(math.pi * (outer**2 - inner**2), rel=1e-12)
    radius = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2)
    # A thin ring's cells are cut in many ways: the order wanders about 2.
    assert orders(ring, contact_radius, radius)[-1] == pytest.approx(2, abs=0.15)
    assert orders(ring, second_moment, (outer**2 + inner**2) / 2)[-1] == pytest.approx(2, abs=0.15)


def test_rectangle_closed_forms():
    a, b, columns, rows = 0.03, 0.01, 12, 5
    patch = pf.ContactPatch.rectangle(a, b, (columns, rows))
    assert patch.cells == columns * rows
    assert patch.area() == pytest.approx(a * b, rel=ROUNDING)
    # n points with spacing h along a line have the mean square h^2 (n^2 - 1)/12.
    exact = (a / columns) ** 2 * (columns**2 - 1) / 12 + (b / rows) ** 2 * (rows**2 - 1) / 12
    assert patch.second_moment() == pytest.approx(exact, rel=ROUNDING)
    # r of a rectangle: four times the rectangle a/2 x b/2 with the centre of rotation at its corner.
    p, q = a / 2, b / 2
    d = math.hypot(p, q)
    corner = (2 * p * q * d + p**3 * math.asinh(q / p) + q**3 * math.asinh(p / q)) / 6
    found = orders(lambda n: pf.ContactPatch.rectangle(a, b, n), contact_radius, 4 * corner / (a * b), (24, 48, 96))
    # Near the origin, where |rho| has a kink, the error is of order 3: a correction of relative size h.
    assert found == pytest.approx([2, 2], abs=0.05)


def test_one_number_of_cells_keeps_the_cells_square():
    assert pf.ContactPatch.rectangle(0.04, 0.01, 20).grid == Grid.around_origin(0.04, 0.01, 20, 5)
    assert pf.ContactPatch.rectangle(0.01, 0.04, 20).grid == Grid.around_origin(0.01, 0.04, 5, 20)
    assert pf.ContactPatch.rectangle(1.0, 0.001, 4).grid.rows == 1


@pytest.mark.parametrize("cells", [1, 4, 5, 21])
@pytest.mark.parametrize("direction", ["x", "y"])
def test_line_closed_forms(cells, direction):
    length = 0.02
    patch = pf.ContactPatch.line(length, cells, direction=direction)
    assert patch.cells == cells
    assert patch.second_moment() == pytest.approx(length**2 / 12 * (1 - 1 / cells**2), rel=ROUNDING, abs=1e-30)
    odd_loss = 1 / cells**2 if cells % 2 else 0.0
    assert patch.contact_radius() == pytest.approx(length / 4 * (1 - odd_loss), rel=ROUNDING, abs=1e-18)
    # The grid has the line in the middle of one of its columns or rows.
    rows, columns = patch.grid.locate(patch.positions)
    across, along = (columns, rows) if direction == "y" else (rows, columns)
    middle = {"y": patch.grid.columns, "x": patch.grid.rows}[direction] // 2
    assert (across == middle).all() and (along == np.arange(cells)).all()
    assert patch.positions == pytest.approx(patch.grid.centres().reshape(patch.grid.rows, -1, 2)[rows, columns])


def test_line_profiles_run_from_the_top_and_from_the_left():
    down = pf.ContactPatch.line(0.02, 3, profile=[3, 2, 1])
    assert down.positions[:, 1] == pytest.approx([0.02 / 3, 0, -0.02 / 3], abs=1e-18)
    assert down.weights() == pytest.approx([1 / 2, 1 / 3, 1 / 6])
    assert down.centre_of_pressure()[1] > 0
    right = pf.ContactPatch.line(0.02, 3, direction="x", profile=[3, 2, 1])
    assert right.positions[:, 0] == pytest.approx([-0.02 / 3, 0, 0.02 / 3], abs=1e-18)
    assert right.centre_of_pressure()[0] < 0
    upward = pf.ContactPatch.line(0.02, 3, profile=lambda y: 1 + 100 * y)
    assert upward.weights() == pytest.approx(np.array([5, 3, 1]) / 9)


def test_polygon_closed_forms():
    # A right triangle: centroid at a third of each side, polar second moment (a^2 + b^2)/18 about it.
    a, b = 0.03, 0.02
    corners = [(0.01, 0.02), (0.01 + a, 0.02), (0.01, 0.02 + b)]
    patch = pf.ContactPatch.polygon(corners, 15)
    assert patch.area() == pytest.approx(a * b / 2, rel=1e-12)
    # Cut cells carry their centroids: the centre of pressure is exact, not approximate.
    assert patch.centre_of_pressure() == pytest.approx((0.01 + a / 3, 0.02 + b / 3), rel=1e-12)
    found = orders(lambda n: pf.ContactPatch.polygon(corners, n), second_moment, (a * a + b * b) / 18)
    assert found == pytest.approx([2] * 3, abs=0.05)


def test_polygon_agrees_with_rectangle_and_takes_concave_outlines():
    w, h = 0.04, 0.02
    box = [(-w / 2, -h / 2), (w / 2, -h / 2), (w / 2, h / 2), (-w / 2, h / 2)]
    cut, whole = pf.ContactPatch.polygon(box, (8, 4)), pf.ContactPatch.rectangle(w, h, (8, 4))
    assert cut.positions == pytest.approx(whole.positions, abs=1e-16)
    assert cut.areas == pytest.approx(whole.areas, rel=1e-12)
    corner = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    assert pf.ContactPatch.polygon(corner, 7).area() == pytest.approx(3.0, rel=1e-12)
    assert pf.ContactPatch.polygon(corner, 7).centre_of_pressure() == pytest.approx((5 / 6, 5 / 6), rel=1e-12)


def test_cells_run_row_by_row_from_the_top_left():
    for patch in (
        pf.ContactPatch.disc(0.01, 8),
        pf.ContactPatch.ring(0.004, 0.01, 9),
        PUBLISHED_PATCHES["NonConvex2"](),
    ):
        rows, columns = patch.grid.locate(patch.positions)
        assert (np.diff(rows * patch.grid.columns + columns) > 0).all()
        assert (rows >= 0).all() and (rows < patch.grid.rows).all()
    first, last = pf.ContactPatch.rectangle(0.02).positions[[0, -1]]
    assert first[0] < 0 < first[1] and last[1] < 0 < last[0]


def test_points_keep_their_order_and_weights():
    legs = [(0.0, 0.1), (0.05, -0.05), (-0.05, -0.05)]
    patch = pf.ContactPatch.points(legs, [2, 1, 1])
    assert patch.grid is None
    assert patch.positions.tolist() == [list(leg) for leg in legs]
    assert patch.weights().tolist() == [0.5, 0.25, 0.25]
    assert patch.centre_of_pressure() == pytest.approx((0, 0.025))
    assert pf.ContactPatch.points(legs).weights() == pytest.approx([1 / 3] * 3)
    assert pf.ContactPatch.points(legs, [1, 0, 1]).cells == 2
    assert pf.ContactPatch.points(legs, area=2e-4).pressure_values(6.0) == pytest.approx([1e4] * 3)
    assert pf.ContactPatch.points([(0.3, 0.4)]).contact_radius() == 0.0


# ---------------------------------------------------------------------- pressure laws


def test_linear_gradient_moves_the_centre_of_pressure():
    # p = 1 + gx x + gy y on a centred shape: CoP = (gx <x^2>, gy <y^2>).
    gx, gy, (a, b) = 30.0, -50.0, (0.03, 0.02)
    patch = pf.ContactPatch.rectangle(a, b, (30, 20), pressure=LinearGradient((gx, gy)))
    second_x, second_y = a**2 / 12 * (1 - 1 / 900), b**2 / 12 * (1 - 1 / 400)
    assert patch.centre_of_pressure() == pytest.approx((gx * second_x, gy * second_y), rel=1e-12)
    assert not patch.depends_on_load
    # A cut cell's centroid carries the mean of a linear pressure: the total is that of the true disc.
    disc = pf.ContactPatch.disc(0.01, 9, pressure=LinearGradient((gx, gy)))
    at_the_centre = (1.0 / disc.area()) * np.ones(disc.cells)
    p = 1 + disc.positions @ (gx, gy)
    assert disc.pressure_values(1.0) == pytest.approx(at_the_centre * p, rel=1e-12)


def test_any_function_of_two_numbers_is_a_pressure():
    def one_sided(x, y):
        return math.exp(x / 0.01) if y > 0 else 0.0

    patch = pf.ContactPatch.rectangle(0.02, cells=10, pressure=one_sided)
    assert patch.cells == 50 and (patch.positions[:, 1] > 0).all()
    x = patch.positions[:, 0]
    assert patch.weights() == pytest.approx(np.exp(x / 0.01) / np.exp(x / 0.01).sum(), rel=1e-14)


def test_fixed_soft_finger_drops_what_it_never_loads():
    patch = pf.ContactPatch.rectangle(0.02, cells=21, pressure=pf.SoftFinger(c=0.005, k=2.0))
    assert not patch.depends_on_load
    distance = np.hypot(*patch.positions.T)
    assert (distance < 0.005).all()
    profile = np.sqrt(1 - (distance / 0.005) ** 2)
    # Through logarithms: one more rounding in a number of size 10.
    assert patch.weights() == pytest.approx(profile / profile.sum(), rel=1e-12)
    assert patch.weights(0.0).sum() == pytest.approx(1.0)


def test_the_profile_itself_may_follow_the_load():
    patch = pf.ContactPatch.rectangle(0.02, cells=21, pressure=soft(k=None, k_per_newton=2.0))
    load = 1.73
    radius, k = 6 * CELL * load ** (1 / 3), 2.0 * load
    distance = np.hypot(*patch.positions.T)
    profile = np.where(distance < radius, np.abs(1 - (distance / radius) ** k), 0.0) ** (1 / k)
    assert patch.weights(load) == pytest.approx(profile / profile.sum(), rel=1e-11)
    # At small loads the profile is a needle that underflows: all of it is then on the centre cell.
    assert patch.weights(1e-9).max() == 1.0
    assert patch.weights(1e-9)[patch.cells // 2] == 1.0


@pytest.mark.parametrize(("cells", "sharing"), [(21, 1), (20, 4)])
def test_nearest_cells_share_the_load_of_a_tiny_contact(cells, sharing):
    patch = pf.ContactPatch.rectangle(0.02, cells=cells, pressure=soft())
    weights = patch.weights(1e-9)
    assert np.sort(weights)[-sharing:] == pytest.approx([1 / sharing] * sharing, rel=1e-15)
    assert (weights > 0).sum() == sharing


def test_cells_exactly_on_the_rim_share_the_load_if_no_other_is_inside():
    law = pf.SoftFinger(c=0.5, k=2.0)
    patch = dataclasses.replace(pf.ContactPatch.points([(0.5, 0.0), (0.0, -0.5), (1.0, 0.0)]), pressure=law)
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
        pf.ContactPatch.rectangle(0.02, cells=21, pressure=soft(k=None, k_per_newton=2.0)),
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
    central, raw = patch.moments(3), patch.moments(3, about=(0.0, 0.0))
    assert central.shape == (4, 4)
    assert central[0, 0] == pytest.approx(1.0) and raw[0, 0] == pytest.approx(1.0)
    assert (raw[1, 0], raw[0, 1]) == pytest.approx(tuple(patch.centre_of_pressure()), rel=ROUNDING)
    assert (central[1, 0], central[0, 1]) == pytest.approx((0, 0), abs=1e-17)
    assert central[2, 0] + central[0, 2] == pytest.approx(patch.second_moment(), rel=ROUNDING)
    assert central[2, 0] == pytest.approx(raw[2, 0] - raw[1, 0] ** 2, rel=1e-11)
    assert central[3, 1] == 0.0 and raw[2, 2] == 0.0


# ---------------------------------------------------------------------- properties

PATCHES = {
    **PUBLISHED_PATCHES,
    "disc": lambda: pf.ContactPatch.disc(0.01, 7, pressure=LinearGradient((20.0, -30.0))),
    "soft": lambda: pf.ContactPatch.rectangle(0.02, cells=9, pressure=soft()),
    "soft, k of the load": lambda: pf.ContactPatch.disc(0.01, 8, pressure=soft(k=None, k_per_newton=2.0)),
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
        assert (patch.pressure_values(load) * patch.areas).sum() == pytest.approx(load, rel=ROUNDING)
        # r is a mean distance, <rho^2> a mean square one.
        assert patch.contact_radius(load) ** 2 <= patch.second_moment(load) * (1 + ROUNDING)

    check()


@pytest.mark.parametrize("make", PATCHES.values(), ids=PATCHES.keys())
def test_plain_data_round_trips_to_the_last_bit(make):
    patch = make()
    again = pf.ContactPatch.from_dict(json.loads(json.dumps(patch.to_dict(), allow_nan=False)))
    assert (again.name, again.grid) == (patch.name, patch.grid)
    assert np.array_equal(again.positions, patch.positions) and np.array_equal(again.areas, patch.areas)
    for load in (0.7, 3.0):
        assert np.array_equal(again.weights(load), patch.weights(load))
    assert again.to_dict() == patch.to_dict()


@settings(deadline=None, max_examples=25)
@given(
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.1, 10)), min_size=1, max_size=12),
    st.floats(-math.pi, math.pi),
    st.floats(-3, 3),
)
def test_moving_the_points_moves_the_centre_and_nothing_else(points, angle, shift):
    points = np.array(points)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    patch = pf.ContactPatch.points(points[:, :2], points[:, 2])
    moved = pf.ContactPatch.points(points[:, :2] @ turn.T + shift, points[:, 2])
    # Rounding of coordinates of size 5, squared in <rho^2>.
    assert moved.centre_of_pressure() == pytest.approx(turn @ patch.centre_of_pressure() + shift, abs=1e-14)
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
    patch = dataclasses.replace(pf.ContactPatch.rectangle(0.02), pressure=soft(), name="finger")
    assert (patch.name, patch.cells, patch.depends_on_load) == ("finger", 349, True)
    assert np.array_equal(pickle.loads(pickle.dumps(patch)).weights(1.0), patch.weights(1.0))
    assert repr(patch) == "ContactPatch('finger', 349 cells of 21 x 21, SoftFinger pressure)"


# ---------------------------------------------------------------------- errors

SQUARE = pf.ContactPatch.rectangle(0.02, cells=3)
FINGER = pf.ContactPatch.rectangle(0.02, cells=21, pressure=soft())
GOOD = SQUARE.to_dict()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pf.ContactPatch.disc(0.0), "radius must be > 0, got 0.0"),
        (lambda: pf.ContactPatch.disc(math.nan), "radius must be finite, got nan"),
        (lambda: pf.ContactPatch.disc(0.01, cells=0), "cells must be an integer >= 1, got 0"),
        (lambda: pf.ContactPatch.disc_published(0.01, 20), "cells must be odd"),
        (lambda: pf.ContactPatch.rectangle(0.02, cells=(3, 2.5)), "rows must be an integer >= 1"),
        (lambda: pf.ContactPatch.rectangle(0.02, cells=(3, 2, 1)), r"cells must have shape \[2\]"),
        (lambda: pf.ContactPatch.ring(0.02, 0.01), "inner_radius must be < outer_radius, got 0.02 and 0.01"),
        (lambda: pf.ContactPatch.line(0.02, direction="z"), "direction must be one of x, y, got 'z'"),
        (lambda: pf.ContactPatch.line(0.02, 3, profile=[1, 2]), r"profile must have shape \[3\], got shape \[2\]"),
        (lambda: pf.ContactPatch.line(0.02, 3, profile=[1, -2, 1]), r"profile must be >= 0, got -2.0 at index \(1,\)"),
        (lambda: pf.ContactPatch.line(0.02, 3, profile=lambda s: s), "pressure must be >= 0, got -0.00666"),
        (lambda: pf.ContactPatch.polygon([(0, 0), (1, 1)]), "vertices must hold at least 3 points"),
        (lambda: pf.ContactPatch.polygon([(0, 0), (1, 0), (2, 0)]), "vertices must enclose an area"),
        (lambda: pf.ContactPatch.polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), "simple polygon, got Self-intersection"),
        (lambda: pf.ContactPatch.points([]), "positions must have shape"),
        (lambda: pf.ContactPatch.points(np.empty((0, 2))), "patch must have at least one cell"),
        (
            lambda: pf.ContactPatch.points([(0, 0), (1, math.inf)]),
            r"positions must be finite, got inf at index \(1, 1\)",
        ),
        (lambda: pf.ContactPatch.points([(0, 0)], [-1]), "weights must be >= 0, got -1.0"),
        (lambda: pf.ContactPatch.points([(0, 0)], [0]), "pressure must load at least one cell"),
        (lambda: pf.ContactPatch.rectangle(0.02, pressure=lambda x, y: math.nan), "pressure must be finite, got nan"),
        (lambda: pf.ContactPatch.rectangle(0.02, pressure=lambda x, y: 0.0), "pressure must load at least one cell"),
        (
            lambda: pf.ContactPatch.rectangle(0.02, cells=3, pressure=LinearGradient((200.0, 0.0))),
            r"pressure must be >= 0, got -0.33\d* at index 0, position \(-0.00666667, 0.00666667\) m",
        ),
        (lambda: pf.ContactPatch(np.zeros((2, 2)), [1.0, 0.0]), "areas must be > 0, got 0.0 at index 1"),
        (lambda: pf.ContactPatch(np.zeros((2, 2)), [1.0]), r"areas must have shape \[2\]"),
        (lambda: LinearGradient((1.0,)), r"gradient must have shape \[2\]"),
        (lambda: pf.SoftFinger(c=0.01), "exactly one of k and k_per_newton, got k=None, k_per_newton=None"),
        (lambda: pf.SoftFinger(c=0.01, k=2, k_per_newton=2), "exactly one of k and k_per_newton"),
        (lambda: pf.SoftFinger(c=0.01, k=0), "k must be > 0"),
        (lambda: pf.SoftFinger(c=-0.01, k=2), "c must be > 0"),
        (lambda: pf.SoftFinger(c=0.01, n=-1, k=2), "n must be >= 0"),
        (lambda: FINGER.weights(), "normal_force must be given"),
        (lambda: FINGER.contact_radius(), "normal_force must be given"),
        (lambda: FINGER.weights(-1.0), "normal_force must be finite and >= 0, got -1.0"),
        (lambda: SQUARE.weights([1.0, math.nan]), "normal_force must be finite and >= 0"),
        (lambda: SQUARE.moments(-1), "degree must be an integer >= 0"),
        (lambda: Grid(0, 0, 1, -1, 3, 3), "cell_height must be > 0"),
        (lambda: pf.ContactPatch.from_dict({**GOOD, "postions": []}), "did you mean 'positions'"),
        (lambda: pf.ContactPatch.from_dict({"areas": [1.0]}), "patch must have the key 'positions', got areas"),
        (lambda: pf.ContactPatch.from_dict({**GOOD, "shape": "disc"}), "patch shape must be one of cells, got 'disc'"),
        (lambda: pf.ContactPatch.from_dict({**GOOD, "grid": {"x_min": 0.0}}), "grid must have the key 'y_min'"),
        (lambda: pf.ContactPatch.from_dict([1, 2]), "patch must be a table of keys and values"),
        (lambda: Pressure.from_dict({"law": "unifrom"}), "did you mean 'uniform'"),
        (lambda: Pressure.from_dict({"law": "linear_gradient"}), "pressure must have the key 'gradient'"),
        (lambda: Pressure.from_dict({"law": "soft_finger", "c": 0.01, "kk": 2.0}), "did you mean 'k'"),
        (lambda: Pressure.from_dict({}), "pressure must be a table with law"),
    ],
)
def test_every_mistake_gets_one_line(call, message):
    with pytest.raises(InvalidValueError, match=message) as caught:
        call()
    assert isinstance(caught.value, FrictionError)
    assert "\n" not in str(caught.value)


def test_a_law_of_ones_own_cannot_make_nan():
    class Vanishing(Uniform):
        @property
        def depends_on_load(self):
            return True

        def relative(self, positions, normal_force=None):
            load = np.asarray(1.0 if normal_force is None else normal_force)[..., None]
            return np.where(load < 2.0, 1.0, 0.0) * np.ones(len(positions))

    patch = pf.ContactPatch.rectangle(0.02, cells=3, pressure=Vanishing())
    assert patch.weights(1.0) == pytest.approx([1 / 9] * 9)
    with pytest.raises(InvalidValueError, match="pressure must load at least one cell at every load"):
        patch.weights(3.0)
