"""Shapes of contact patches: closed forms and orders of convergence."""

import math

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES, Grid

ROUNDING = 1e-13
"""Relative: sums of some hundred terms of the same sign, each rounded at 1e-16."""


def orders(make, quantity, exact, cells=(20, 40, 80, 160)):
    """Observed orders of convergence of `quantity(make(cells))` to `exact`."""
    errors = np.array([abs(quantity(make(n)) - exact) for n in cells])
    return np.log2(errors[:-1] / errors[1:])


def contact_radius(patch):
    return patch.contact_radius()


def second_moment(patch):
    return patch.second_moment()


def tile_moment(patch):
    """Second moment of the areas at the centres of the cells, which miss the spread inside them."""
    return patch.tile_weights() @ (
        (patch.positions - patch.centre_of_pressure()) ** 2
    ).sum(1)


def tensor(patch):
    """Second moments `[2, 2]` about the centre of pressure."""
    offset = patch.positions - patch.centre_of_pressure()
    return np.einsum("n,ni,nj->ij", patch.weights(), offset, offset)


def polygon_tensor(corners):
    """Second moments `[2, 2]` of a polygon about its centroid: signed sum over triangles from the first vertex."""
    corners = np.array(corners)
    legs = np.stack([corners[1:-1], corners[2:]], 1) - corners[0]
    areas = np.linalg.det(legs) / 2
    total = areas.sum()
    centre = np.einsum("n,nki->i", areas, legs) / 3 / areas.sum()
    sums = legs.sum(1)
    second = np.einsum("n,nki,nkj->ij", areas, legs, legs) + np.einsum(
        "n,ni,nj->ij", areas, sums, sums
    )
    return second / 12 / total - np.outer(centre, centre)


@pytest.mark.parametrize("cells", [1, 2, 7, 20, 21, 64])
def test_disc_area_is_exact_on_every_grid(cells):
    patch = pf.ContactPatch.disc(0.01, cells)
    assert patch.area() == pytest.approx(math.pi * 1e-4, rel=1e-12)
    assert patch.centre_of_pressure() == pytest.approx((0, 0), abs=1e-16)


@pytest.mark.parametrize(
    ("quantity", "exact"),
    [(contact_radius, 2 * 0.01 / 3), (tile_moment, 0.01**2 / 2)],
    ids=["2R/3", "R^2/2"],
)
def test_disc_converges_with_order_two(quantity, exact):
    found = orders(lambda n: pf.ContactPatch.disc(0.01, n), quantity, exact)
    # The rim's cells add a third-order term: the observed order rises to 2 and does not reach it.
    assert (found > 1.95).all() and (found < 2.01).all()
    assert (np.diff(found) > 0).all()


def test_areas_of_a_disc_miss_only_the_spread_inside_its_cells():
    # Areas at points miss the spread inside the cells: h^2/6 in a whole cell, less in a cut one.
    radius = 0.01
    cells = 41
    patch = pf.ContactPatch.disc(radius, cells)
    missing = radius**2 / 2 - tile_moment(patch)
    whole = np.isclose(patch.areas, patch.grid.cell_area, rtol=1e-9)
    spread = (2 * radius / cells) ** 2 / 6
    assert spread * patch.tile_weights()[whole].sum() < missing < spread


# What is left is the shape of cut cells, which are taken for small whole ones: 1.5e-5 (disc) to 1.1e-4 (thin ring).
CUT_CELLS = 2e-4
HOOK = [
    (0.0, 0.0),
    (0.03, 0.004),
    (0.027, 0.012),
    (0.011, 0.009),
    (0.006, 0.02),
    (-0.002, 0.017),
]


@pytest.mark.parametrize(
    ("patch", "exact"),
    [
        (pf.ContactPatch.disc(0.01), 0.01**2 / 4 * np.eye(2)),
        (pf.ContactPatch.ring(0.009, 0.01), (0.01**2 + 0.009**2) / 4 * np.eye(2)),
        (pf.ContactPatch.rectangle(0.03, 0.01), np.diag([0.03**2, 0.01**2]) / 12),
        (pf.ContactPatch.polygon(HOOK), polygon_tensor(HOOK)),
    ],
    ids=["disc", "thin ring", "rectangle", "hook"],
)
def test_second_moments_of_even_shapes_are_those_of_the_area(patch, exact):
    assert np.abs(tensor(patch) - exact).max() < CUT_CELLS * np.trace(exact)
    assert (
        np.abs(
            patch.weights() @ patch.positions - patch.tile_weights() @ patch.positions
        ).max()
        < 1e-16
    )
    assert patch.weights() / patch.tile_weights() == pytest.approx(1.0, abs=0.1)
    assert not np.array_equal(patch.weights(), patch.tile_weights())


def test_one_row_of_cells_is_discs_with_the_second_moment_of_the_area():
    for patch, width, height in (
        (pf.ContactPatch.line(0.02, 9), 0.0, 0.02),
        (pf.ContactPatch.line(0.02, 9, direction="x"), 0.02, 0.0),
        (pf.ContactPatch.rectangle(0.018, 0.002, (9, 1)), 0.018, 0.002),
        (pf.ContactPatch.rectangle(0.002, 0.018, (1, 9)), 0.002, 0.018),
    ):
        assert patch.has_discs and patch.point_shares is None
        assert patch.second_moment() == pytest.approx(
            (width**2 + height**2) / 12.0, rel=1e-14
        )
        assert patch.refined(2).second_moment() == pytest.approx(
            patch.second_moment(), rel=1e-14
        )
    assert (
        not pf.ContactPatch.rectangle(0.02, 0.02, 1).has_discs
        and not pf.ContactPatch.line(0.02, 1).has_discs
    )
    for name in ("Line", "LineGrad", "LineGradX"):
        assert not PUBLISHED_PATCHES[name]().has_discs


def test_weights_of_a_ring_thinner_than_its_cells_stay_positive():
    """A sixth of a cell wide: all of its second moment would take factors of up to 1.96."""
    patch = pf.ContactPatch.ring(0.0097, 0.01, 11)
    assert np.abs(patch.point_shares - 1.0).max() == pytest.approx(0.8, rel=1e-12)
    assert np.abs(patch.centre_of_pressure()).max() < 1e-15
    exact = (0.01**2 + 0.0097**2) / 2
    assert tile_moment(patch) < patch.second_moment() < exact


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (2, 2), (2, 7)])
def test_one_or_two_rows_of_cells_stay_as_they_are(columns, rows):
    """Their squared distances are all the same, so that no weights change the mean."""
    patch = pf.ContactPatch.rectangle(0.002 * columns, 0.002 * rows, (columns, rows))
    along = 0.002**2 / 12 * np.array([columns**2 - 1, rows**2 - (rows < 3)])
    assert np.diagonal(tensor(patch)) == pytest.approx(along, rel=ROUNDING, abs=1e-30)


@pytest.mark.parametrize("name", list(PUBLISHED_PATCHES))
def test_published_masks_and_other_pressures_keep_their_ratios(name):
    patch = PUBLISHED_PATCHES[name]()
    load = patch.pressure.relative(patch.positions)
    load = load / load.max() * patch.areas
    assert np.array_equal(patch.weights(), load / load.sum()) and np.array_equal(
        patch.weights(), patch.tile_weights()
    )
    sloped = pf.ContactPatch.rectangle(
        0.02, cells=5, pressure=pf.LinearGradient((20.0, 0.0))
    )
    assert np.array_equal(sloped.weights(), sloped.tile_weights())


@pytest.mark.parametrize(
    ("k", "ratio", "order"),
    [(1.0, 1 / 2, 2.0), (2.0, 3 * math.pi / 16, 1.5), (1e9, 2 / 3, 2.0)],
)
def test_soft_finger_contact_radius(k, ratio, order):
    # r/R = 2 (3/8) Gamma(3/k)^2 / (Gamma(2/k) Gamma(4/k)), with its values at k = 1, 2 and infinity.
    if k < 1e3:
        closed = (
            2
            * (3 / 8)
            * math.gamma(3 / k) ** 2
            / (math.gamma(2 / k) * math.gamma(4 / k))
        )
        assert closed == pytest.approx(ratio, rel=1e-14)
    found = orders(
        lambda n: pf.ContactPatch.disc(0.01, n, pressure=pf.SoftFinger(c=0.01, k=k)),
        contact_radius,
        0.01 * ratio,
    )
    # At k = 2 the pressure ends like the square root of the distance to the rim: order 3/2 instead of 2.
    assert found[-1] == pytest.approx(order, abs=0.05)


def test_soft_finger_radius_follows_the_load():
    patch = pf.ContactPatch.disc(
        0.01, 161, pressure=pf.SoftFinger(c=0.004, n=1 / 3, k=2.0, radius_max=0.01)
    )
    for load in (1.0, 3.0, 8.0, 27.0):
        radius = min(0.004 * load ** (1 / 3), 0.01)
        # Cells are 1.2e-4 m: 3 % of the smallest radius, and the error of order 3/2 above gives 0.5 % there.
        assert patch.contact_radius(load) == pytest.approx(
            3 * math.pi / 16 * radius, rel=5e-3
        )
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
    # Cells weigh what gives whole cells their own second moment; that of cut ones leaves an order more.
    assert orders(ring, second_moment, (outer**2 + inner**2) / 2)[-1] == pytest.approx(
        3, abs=0.15
    )


def test_rectangle_closed_forms():
    a = 0.03
    b = 0.01
    columns = 12
    rows = 5
    patch = pf.ContactPatch.rectangle(a, b, (columns, rows))
    assert patch.cells == columns * rows
    assert patch.area() == pytest.approx(a * b, rel=ROUNDING)
    # n points with spacing h along a line have the mean square h^2 (n^2 - 1)/12.
    exact = (a / columns) ** 2 * (columns**2 - 1) / 12 + (b / rows) ** 2 * (
        rows**2 - 1
    ) / 12
    assert tile_moment(patch) == pytest.approx(exact, rel=ROUNDING)
    assert patch.second_moment() == pytest.approx((a**2 + b**2) / 12, rel=ROUNDING)
    # r of a rectangle: four times the rectangle a/2 x b/2 with the centre of rotation at its corner.
    p = a / 2
    q = b / 2
    d = math.hypot(p, q)
    corner = (2 * p * q * d + p**3 * math.asinh(q / p) + q**3 * math.asinh(p / q)) / 6
    found = orders(
        lambda n: pf.ContactPatch.rectangle(a, b, n),
        contact_radius,
        4 * corner / (a * b),
        (48, 96, 192),
    )
    # Near the origin, where |rho| has a kink, the error is of order 3: a correction of relative size h, 3.5 % here.
    assert found == pytest.approx([2, 2], abs=0.05)


def test_one_number_of_cells_keeps_the_cells_square():
    assert pf.ContactPatch.rectangle(0.04, 0.01, 20).grid == Grid.around_origin(
        0.04, 0.01, 20, 5
    )
    assert pf.ContactPatch.rectangle(0.01, 0.04, 20).grid == Grid.around_origin(
        0.01, 0.04, 5, 20
    )
    assert pf.ContactPatch.rectangle(1.0, 0.001, 4).grid.rows == 1


@pytest.mark.parametrize("cells", [1, 4, 5, 21])
@pytest.mark.parametrize("direction", ["x", "y"])
def test_line_closed_forms(cells, direction):
    length = 0.02
    patch = pf.ContactPatch.line(length, cells, direction=direction)
    assert patch.cells == cells
    assert tile_moment(patch) == pytest.approx(
        length**2 / 12 * (1 - 1 / cells**2), rel=ROUNDING, abs=1e-30
    )
    assert patch.second_moment() == pytest.approx(
        length**2 / 12 if cells > 1 else 0.0, rel=ROUNDING
    )
    odd_loss = 1 / cells**2 if cells % 2 else 0.0
    tile_radius = patch.tile_weights() @ np.hypot(*patch.positions.T)
    assert tile_radius == pytest.approx(
        length / 4 * (1 - odd_loss), rel=ROUNDING, abs=1e-18
    )
    # The grid has the line in the middle of one of its columns or rows.
    rows, columns = patch.grid.locate(patch.positions)
    across, along = (columns, rows) if direction == "y" else (rows, columns)
    middle = {"y": patch.grid.columns, "x": patch.grid.rows}[direction] // 2
    assert (across == middle).all() and (along == np.arange(cells)).all()
    assert patch.positions == pytest.approx(
        patch.grid.centres().reshape(patch.grid.rows, -1, 2)[rows, columns]
    )


@pytest.mark.parametrize("far", [1e17, 1e50])
def test_a_grid_knows_on_which_side_the_farthest_points_are(far):
    rows, columns = Grid(0.0, 0.0, 1e-3, 1e-3, 2, 2).locate([[far, far], [-far, -far]])
    assert rows[0] < 0 and columns[0] > 1
    assert rows[1] > 1 and columns[1] < 0


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
    a = 0.03
    b = 0.02
    corners = [(0.01, 0.02), (0.01 + a, 0.02), (0.01, 0.02 + b)]
    patch = pf.ContactPatch.polygon(corners, 15)
    assert patch.area() == pytest.approx(a * b / 2, rel=1e-12)
    # Cut cells carry their centroids: the centre of pressure is exact, not approximate.
    assert patch.centre_of_pressure() == pytest.approx(
        (0.01 + a / 3, 0.02 + b / 3), rel=1e-12
    )
    found = orders(
        lambda n: pf.ContactPatch.polygon(corners, n),
        second_moment,
        (a * a + b * b) / 18,
    )
    # The spread of whole cells is in their weights; that of cut ones, of which there are fewer, is not: order 3.
    assert found == pytest.approx([3] * 3, abs=0.05)


def test_polygon_agrees_with_rectangle_and_takes_concave_outlines():
    w = 0.04
    h = 0.02
    box = [(-w / 2, -h / 2), (w / 2, -h / 2), (w / 2, h / 2), (-w / 2, h / 2)]
    cut = pf.ContactPatch.polygon(box, (8, 4))
    whole = pf.ContactPatch.rectangle(w, h, (8, 4))
    assert cut.positions == pytest.approx(whole.positions, abs=1e-16)
    assert cut.areas == pytest.approx(whole.areas, rel=1e-12)
    corner = 0.5 * np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    assert pf.ContactPatch.polygon(corner, 7).area() == pytest.approx(0.75, rel=1e-12)
    assert pf.ContactPatch.polygon(corner, 7).centre_of_pressure() == pytest.approx(
        (5 / 12, 5 / 12), rel=1e-12
    )


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
    assert pf.ContactPatch.points(legs, area=2e-4).pressure_values(
        6.0
    ) == pytest.approx([1e4] * 3)
    assert pf.ContactPatch.points([(0.3, 0.4)]).contact_radius() == 0.0


def test_a_published_patch_in_millimetres_warns_once():
    with pytest.warns(UserWarning, match="are its lengths in metres") as told:
        pf.patch.PUBLISHED_PATCHES["Line"](width=2.0)
    assert len(told) == 1
