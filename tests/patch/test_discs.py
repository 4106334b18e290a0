"""Patches as a few discs: sums that they keep, symmetry, kinds of friction, and shapes that depend on the load."""

import dataclasses
import itertools
import json

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from tests.support.refusals import refused

DISC = pf.ContactPatch.disc(0.01)
L_SHAPE = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]) * 0.01
FINGER = pf.ContactPatch.rectangle(
    0.02,
    cells=21,
    pressure=pf.SoftFinger(c=6 * 0.02 / 21, n=1 / 3, k_per_newton=2.0, radius_max=0.01),
)
SHAPES = {
    "disc": DISC,
    "square": pf.ContactPatch.rectangle(0.02),
    "slanted": pf.ContactPatch.polygon([(0.0, 0.0), (0.03, 0.01), (0.02, 0.03)]),
    "L": pf.ContactPatch.polygon(L_SHAPE),
    "line": pf.ContactPatch.line(0.02, 40, profile=lambda y: 1.0 + 60.0 * y),
    "T": PUBLISHED_PATCHES["NonConvex2"](),
    "peak": pf.ContactPatch.disc(
        0.01, pressure=lambda x, y: np.exp(-((x - 0.008) ** 2 + y**2) / 1.8e-5)
    ),
    "bar": pf.ContactPatch.rectangle(0.03, 0.001, cells=(61, 3)),
    "points": pf.ContactPatch.points(
        np.random.default_rng(2).normal(size=(60, 2)) * 0.01
    ),
    "parallelogram": pf.ContactPatch.polygon(
        np.array([(0, 0), (2, 0), (2.6, 1), (0.6, 1)]) * 0.01
    ),
}
EXACT = 1e-13
"""Rounding of sums over a few hundred cells."""


def own(patch):
    """Second moments of the cells about themselves."""
    return (patch.cell_extents() ** 2).sum(axis=1) / 12.0


def kept(discs, patch):
    """Load, centre and second moment of the areas of cells are those of the discs."""
    w = patch.tile_weights()
    centre = w @ patch.positions
    second = w @ (((patch.positions - centre) ** 2).sum(axis=1) + own(patch))
    size = np.sqrt(second)
    assert (
        discs.weights().sum() == pytest.approx(1.0, abs=EXACT)
        and (discs.weights() > 0.0).all()
    )
    assert discs.centre_of_pressure() == pytest.approx(
        centre, abs=EXACT * max(size, np.abs(patch.positions).max())
    )
    assert discs.second_moment() == pytest.approx(second, rel=EXACT)
    assert discs.areas.sum() == pytest.approx(patch.areas.sum(), rel=EXACT)


def rows(patch):
    """Positions, shares and radii, sorted, in micrometres and parts of a million."""
    numbers = 1e6 * np.column_stack([patch.positions, patch.weights(), patch.radii])
    return numbers[np.lexsort(np.round(numbers[:, :2], 3).T)]


def wrench_error(discs, patch, load=None):
    """Largest error of the force over `mu f_N` while both slide about the same points of the patch."""
    rng = np.random.default_rng(0)
    centres = patch.positions[rng.integers(patch.cells, size=300)] + 1e-4 * rng.normal(
        size=(300, 2)
    )
    twists = np.column_stack([centres[:, 1], -centres[:, 0], np.ones(300)])
    one, other = (
        pf.LimitSurfaceCells(each, normal_force=load).wrench(twists)
        for each in (discs, patch)
    )
    return float(np.sqrt(((one - other)[:, :2] ** 2).sum(axis=1).mean()))


# ---------------------------------------------------------------------- what is kept


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("n", [1, 2, 5, 24, 90, 10**6])
def test_discs_keep_load_centre_and_second_moment(name, n):
    patch = SHAPES[name]
    discs = patch.discs(n)
    assert discs.cells <= max(n, 1) and discs.name == patch.name
    kept(discs, patch)


def test_shapes_by_name_keep_the_second_moment_of_their_points():
    """Points have shares with which their second moments are those of the areas, and so have discs."""
    for name in ("disc", "square", "L", "slanted"):
        assert SHAPES[name].discs(24).second_moment() == pytest.approx(
            SHAPES[name].second_moment(), rel=EXACT
        )


def test_each_cell_is_the_disc_of_its_own_second_moment():
    square = SHAPES["square"].discs()
    line = SHAPES["line"].discs()
    # A^2/2 = h^2/6.
    assert square.radii == pytest.approx(0.02 / 21 / np.sqrt(3.0), rel=1e-14)
    # A^2/2 = h^2/12.
    assert line.radii == pytest.approx(0.02 / 40 / np.sqrt(6.0), rel=1e-14)
    assert SHAPES["points"].discs() is SHAPES["points"]
    cut = DISC.discs()
    assert cut.radii == pytest.approx(np.sqrt(DISC.areas / 3.0), rel=1e-14)
    assert cut.weights() == pytest.approx(DISC.tile_weights(), rel=EXACT)
    assert DISC.discs(DISC.cells) == cut and cut.discs() is cut


def test_one_disc_of_a_disc_is_that_disc():
    one = pf.ContactPatch.disc(0.01, 41).discs(1)
    assert one.cells == 1 and one.radii[0] == pytest.approx(0.01, rel=1e-4)
    assert one.contact_radius() == pytest.approx(2 / 3 * 0.01, rel=1e-4)


def test_discs_of_discs_are_discs():
    few = DISC.discs(60).discs(12)
    assert few.cells <= 12
    assert few.second_moment() == pytest.approx(DISC.second_moment(), rel=EXACT)


# ---------------------------------------------------------------------- symmetry


@pytest.mark.parametrize("n", [2, 5, 7, 12, 24, 31])
def test_discs_of_a_symmetric_patch_are_symmetric(n):
    for patch, flips in (
        (DISC, [(1, -1), (-1, 1)]),
        (SHAPES["bar"], [(1, -1), (-1, 1)]),
        (SHAPES["peak"], [(1, -1)]),
        (SHAPES["parallelogram"], [(-1, -1)]),
    ):
        discs = patch.discs(n)
        offset = discs.positions - discs.centre_of_pressure()
        for flip in flips:
            image = np.hypot(
                *(offset[:, None] * flip - offset).transpose(2, 0, 1)
            ).argmin(axis=1)
            assert offset[image] == pytest.approx(offset * flip, abs=1e-12)
            assert discs.weights()[image] == pytest.approx(discs.weights(), rel=EXACT)
            assert discs.radii[image] == pytest.approx(discs.radii, rel=EXACT)


APART = np.array([0.01, 0.003])


def test_two_equal_pads_pull_in_one_line():
    pad = pf.ContactPatch.rectangle(0.004, cells=9).positions
    pads = pf.ContactPatch.points(np.concatenate([pad - APART, pad + APART]))
    wrench = pf.LimitSurfaceCells(pads.discs(10)).wrench((1.0, 0.0, 0.0))
    assert wrench == pytest.approx([-1.0, 0.0, 0.0], abs=1e-15)
    assert (pads.discs(10).positions[:, 0] > 0.0).sum() == 5


def test_the_order_of_cells_does_not_matter():
    for name, patch in SHAPES.items():
        order = np.random.default_rng(1).permutation(patch.cells)
        pressure = patch.tile_weights() / patch.areas
        mixed, same = (
            pf.ContactPatch(
                patch.positions[each],
                patch.areas[each],
                pressure[each],
                None,
                cell_size=patch.cell_size,
            )
            for each in (order, slice(None))
        )
        assert rows(mixed.discs(17)) == pytest.approx(rows(same.discs(17)), abs=1e-5), (
            name
        )


@pytest.mark.parametrize("name", ["slanted", "L", "line", "T", "points"])
@pytest.mark.parametrize("angle", [0.4, 0.5 * np.pi, 3.0])
def test_discs_move_turn_and_grow_with_the_patch(name, angle):
    """The principal axes of these shapes are determined; cells keep their second moments as they turn."""
    patch = SHAPES[name].discs()
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = pf.ContactPatch(
        2.0 * patch.positions @ turn.T + [0.05, -0.02], 4.0 * patch.areas, patch.weights() / patch.areas,
        radii=2.0 * patch.radii,
    )  # fmt: skip
    few = patch.discs(16)
    other = moved.discs(16)
    back = dataclasses.replace(
        other,
        positions=0.5 * (other.positions - [0.05, -0.02]) @ turn,
        radii=0.5 * other.radii,
    )
    assert rows(back) == pytest.approx(rows(few), abs=1e-4)


# ---------------------------------------------------------------------- friction


@pytest.mark.parametrize("name", ["disc", "square", "L", "line"])
def test_errors_of_friction_fall_with_the_number_of_discs(name):
    fine = SHAPES[name].refined(3)
    errors = [wrench_error(SHAPES[name].discs(n), fine) for n in (8, 16, 32, 128)]
    assert errors[-1] < 0.3 * errors[0]
    for less, more in itertools.pairwise(errors):
        assert more < 1.2 * less


def test_kinds_of_friction_never_share_a_disc():
    left = DISC.positions[:, 0] < 0.0
    metric = np.where(
        left[:, None, None],
        pf.friction_metric(0.0, 1.0, 0.5),
        pf.friction_metric(0.3, 0.7, 1.0),
    )
    patch = DISC.with_friction_metric(metric)
    for n in (1, 2, 9, 20):
        few = patch.discs(n)
        assert few.cells <= max(n, 2)
        at = few.metric[:, 0, 0] == metric[left][0, 0, 0]
        for side, cells in ((at, left), (~at, ~left)):
            share = DISC.tile_weights()[cells].sum()
            assert few.weights()[side].sum() == pytest.approx(share, rel=EXACT)
            centre = DISC.tile_weights()[cells] @ DISC.positions[cells]
            assert few.weights()[side] @ few.positions[side] == pytest.approx(
                centre, abs=EXACT * 0.01
            )
        assert few.second_moment() == pytest.approx(
            patch.discs().second_moment(), rel=EXACT
        )
    leaning = DISC.with_friction_metric(
        None, np.where(left[:, None], 0.1, -0.1) * np.ones(2)
    )
    assert set(map(tuple, leaning.discs(1).asymmetry.tolist())) == {
        (0.1, 0.1),
        (-0.1, -0.1),
    }


def test_one_metric_for_all_cells_stays_one():
    metric = pf.friction_metric(0.4, 2.0, 0.5)
    few = DISC.with_friction_metric(metric, (0.1, 0.0)).discs(10)
    assert few.metric == pytest.approx(metric) and few.asymmetry.tolist() == [0.1, 0.0]
    assert few.second_moment() == pytest.approx(
        DISC.discs().with_friction_metric(metric).second_moment(), rel=EXACT
    )


# ---------------------------------------------------------------------- loads and moments


@pytest.mark.parametrize("load", [0.0, 0.3, 0.77, 1.0, 2.4, 8.0, 100.0])
def test_shares_follow_the_load(load):
    few = FINGER.discs(24)
    whole = FINGER.discs()
    shares = few.weights(load)
    weights = FINGER.weights(load)
    assert few.cells <= 48 and (shares >= 0.0).all()
    assert shares.sum() == pytest.approx(weights.sum(), rel=EXACT)
    assert few.weights([load, 1.0])[0] == pytest.approx(shares, rel=EXACT)
    if load >= 1.0:  # discs are large for the smallest contacts
        assert few.centre_of_pressure(load) == pytest.approx(
            FINGER.centre_of_pressure(load), abs=1e-9 * 0.01
        )
        assert few.second_moment(load) == pytest.approx(
            whole.second_moment(load), rel=1e-9
        )
        assert few.contact_radius(load) == pytest.approx(
            whole.contact_radius(load), rel=1e-9
        )


def test_a_patch_that_depends_on_its_load_keeps_its_discs_in_files():
    few = FINGER.discs(24)
    again = pf.ContactPatch.from_dict(json.loads(json.dumps(few.to_dict())))
    assert again == few
    np.testing.assert_array_equal(again.weights([0.5, 3.0]), few.weights([0.5, 3.0]))


def test_shares_change_without_jumps():
    few = FINGER.discs(24)
    loads = np.linspace(0.8, 1.2, 4001)
    whole, moved = (
        np.abs(np.diff(patch.weights(loads), axis=0)).sum(axis=1)
        for patch in (FINGER, few)
    )
    # A cell that comes in moves its whole share at once in both.
    assert moved.max() < 3.0 * whole.max()


@pytest.mark.parametrize("loads", [(1.0, 2.0), (1e7, 2e7)])
def test_maps_at_several_loads(loads):
    values = np.random.default_rng(0).random((12, 12))
    patch = pf.ContactPatch.from_pressure(
        {load: values**k for k, load in enumerate(loads, 1)}, 1e-3
    )
    few = patch.discs(20)
    assert few.cells <= 40
    for load in loads:
        whole = patch.discs()
        assert few.centre_of_pressure(load) == pytest.approx(
            whole.centre_of_pressure(load), abs=1e-9 * 0.01
        )
        assert few.second_moment(load) == pytest.approx(
            whole.second_moment(load), rel=1e-9
        )
        assert few.contact_radius(load) == pytest.approx(
            whole.contact_radius(load), rel=1e-9
        )


def test_pressure_that_follows_moments_tilts_the_shares_of_discs():
    few = SHAPES["square"].discs(24)
    weights = few.weights(2.0, moments=(0.002, -0.001))
    assert weights @ few.positions == pytest.approx([0.0005, 0.001], abs=1e-9)


# ---------------------------------------------------------------------- choice and errors


def test_discs_are_chosen_once_for_equal_patches_and_anew_for_others():
    few = DISC.discs(24)
    again = pf.ContactPatch.disc(0.01)
    assert again.discs(24) is few
    others = [
        pf.ContactPatch.disc(np.nextafter(0.01, 1.0)),
        pf.ContactPatch.disc(0.01, name="another disc"),
        pf.ContactPatch.disc(0.01, pressure=pf.LinearGradient((1e-6, 0.0))),
        DISC.with_friction_metric(np.diag([1.0, 2.0])),
    ]
    for other in others:
        assert other.discs(24) != few and other.discs(24).name == other.name


def test_cells_in_one_place_are_one_disc():
    patch = pf.ContactPatch.points([[0.0, 0.0]] * 3 + [[0.01, 0.0]])
    few = patch.discs(3)
    assert few.cells == 2 and sorted(few.weights()) == pytest.approx([0.25, 0.75])
    kept(few, patch)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: DISC.discs(0), "n must be an integer >= 1, got 0"),
        (lambda: DISC.discs(2.5), "n must be an integer >= 1, got 2.5"),
    ],
)
def test_wrong_calls_are_one_line(call, message):
    with refused(message):
        call()
