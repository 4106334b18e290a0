"""Compact parts of a patch, and parts as patches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch, SoftFinger
from planarfriction.patch.parts import automatic, kurtosis, labels_of, part_of, split

PLAIN = pf.LuGre(mu_s=1.2)
T = PUBLISHED_PATCHES["NonConvex2"](11)
SMALL = {"segments": 8, "speeds": 8}

PATCHES = {name: make() for name, make in PUBLISHED_PATCHES.items()} | {
    "L": ContactPatch.polygon([(0, 0), (0.02, 0), (0.02, 0.006), (0.006, 0.006), (0.006, 0.02), (0, 0.02)], 15),
    "ring": ContactPatch.ring(0.005, 0.01, 15),
    "off centre": ContactPatch.disc(0.01, 15, pressure=lambda x, y: np.exp(-((x - 0.003) ** 2 + y**2) / 5e-5)),
    "pads": ContactPatch.points([(0.01 * i, 0.01 * j) for i in range(3) for j in range(3)]),
    "octagon": ContactPatch.points(0.01 * np.exp(1j * np.pi / 4 * np.arange(8))[:, None].view(float)),
}


# ---------------------------------------------------------------------- the split


@pytest.mark.parametrize("name", PATCHES)
@settings(max_examples=8, deadline=None)
@given(
    st.floats(0.0, 2.0 * np.pi), st.booleans(), st.floats(-2.0, 2.0), st.floats(-0.1, 0.1), st.integers(0, 2**32 - 1)
)
def test_parts_turn_mirror_scale_and_move_with_the_cells(name, angle, mirrored, scale, shift, seed):
    positions, weights = PATCHES[name].positions, PATCHES[name].weights()
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = 10.0**scale * positions @ (turn @ np.diag([1.0, -1.0 if mirrored else 1.0])).T + shift * np.ptp(positions)
    rounding = np.random.default_rng(seed)
    moved *= 1.0 + 1e-14 * rounding.normal(size=moved.shape)
    heavier = 3.0 * weights * (1.0 + 1e-15 * rounding.normal(size=weights.shape))
    for parts in (2, 3, 4, 5, 6, 8):
        np.testing.assert_array_equal(split(moved, heavier, parts), split(positions, weights, parts))
    assert automatic(moved, heavier) == automatic(positions, weights)


@pytest.mark.parametrize("middles", [[0, 6], [0, 8, 3 + 6j], [0, 7, 7j, 7 + 7j], [0, 5, 12, 8 + 3j]])
def test_separate_pads_come_out_whole(middles):
    places = [(m.real + i, m.imag + j) for m in map(complex, middles) for i in range(3) for j in range(3)]
    labels = split(np.array(places), np.ones(len(places)), len(middles))
    pads = labels.reshape(len(middles), 9)
    assert (pads == pads[:, :1]).all()
    assert len(set(labels)) == len(middles)


def test_even_patches_fall_into_equal_parts():
    assert (np.bincount(labels_of(ContactPatch.line(0.02, 24), 4)) == 6).all()
    disc = ContactPatch.disc(0.01, 20)
    shares = np.bincount(labels_of(disc, 4), disc.weights())
    np.testing.assert_allclose(shares, 0.25, rtol=1e-12)


def test_auto_gives_more_parts_to_slender_and_separate_shapes():
    chosen = {name: automatic(patch.positions, patch.weights()) for name, patch in PATCHES.items()}
    assert {name for name, parts in chosen.items() if parts == 4} == {"Circle", "Square"}
    assert {name for name, parts in chosen.items() if parts == 8} == {"off centre"}  # a peak on a disc
    assert set(chosen.values()) == {4, 6, 8}


def test_auto_gives_most_parts_where_the_pressure_peaks():
    def cone(x, y):
        return max(0.0, 1.0 - np.hypot(x - 0.002, y) / 0.007)

    even, peaked = ContactPatch.rectangle(0.02), ContactPatch.rectangle(0.02, pressure=cone)
    assert [automatic(patch.positions, patch.weights()) for patch in (even, peaked)] == [4, 8]
    # 100 cells across: sums are within 1e-3 of integrals, the rim of the disc, in steps, within 5e-3
    square, disc = ContactPatch.rectangle(0.02, cells=100), ContactPatch.disc(0.01, cells=100)
    for patch, expected, within in ((square, 5.6, 1e-3), (disc, 16.0 / 3.0, 5e-3)):
        leaning = patch.positions @ [[1.0, 0.3], [0.0, 0.5]]
        assert kurtosis(leaning, patch.weights()) == pytest.approx(expected, rel=within)


def test_few_cells_are_all_parts():
    assert [automatic(np.eye(n, 2), np.ones(n)) for n in (1, 2, 3, 4, 5)] == [1, 2, 3, 4, 4]


def test_thousands_of_cells_are_split_in_a_moment():
    positions = np.random.default_rng(0).normal(size=(200_000, 2))
    labels = split(positions, np.ones(len(positions)), 6)  # all pairs of cells would take 40 GB
    assert (np.bincount(labels) > 20_000).all()
    assert len(split(np.zeros((5, 2)), np.ones(5), 3)) == 5  # at one place: any cells will do


def test_a_grain_is_split_as_the_scaled_places_are():
    disc = ContactPatch.disc(0.01, 15)
    rough = disc.with_friction_metric(pf.friction_metric(0.0, along=1.0, across=3.0))
    # a spin moves cells along y across the grain: it sees them further apart along x
    labels = labels_of(rough, 4)
    spans = [np.ptp(disc.positions[labels == k], axis=0) for k in range(4)]
    assert all(x < y for x, y in spans)


# ---------------------------------------------------------------------- parts of a patch


def test_parts_add_up_to_the_patch():
    soft = ContactPatch.disc(0.01, 15, pressure=SoftFinger(c=0.006, n=1 / 3, k=2.0))
    loads = np.array([0.01, 0.5, 3.0])
    for patch, at in ((T, 1.0), (soft, loads)):
        labels = labels_of(patch, 6)
        parts = [part_of(patch, labels == k) for k in range(6)]
        shares = np.stack([patch.weights(at)[..., labels == k].sum(-1) for k in range(6)])
        for k, part in enumerate(parts):
            weights = part.weights(at) * shares[k][..., None]
            np.testing.assert_allclose(weights, patch.weights(at)[..., labels == k], rtol=1e-12, atol=1e-300)
            np.testing.assert_allclose(part.weights(at).sum(-1), 1.0, rtol=1e-14)
        model = pf.models.MomentModel(patch, PLAIN, parts=6, **SMALL)
        for load in np.atleast_1d(at):
            found = model.parts_at(load)
            np.testing.assert_allclose(sum(part.share for part in found), 1.0, rtol=1e-14)
            # second moments of slip add up
            squares = sum(part.share * part.shape.factor.T @ part.shape.factor for part in found)
            whole = pf.models.MomentModel(patch, PLAIN, **SMALL).shape_at(load).factor
            np.testing.assert_allclose(squares, whole.T @ whole, rtol=1e-12, atol=1e-18)


def second_moments(positions, weights, extents):
    """Second moments `[2, 2]` about the origin of tiles with the width and height `extents` `[N, 2]`."""
    return np.einsum("n,ni,nj->ij", weights, positions, positions) + np.diag(weights @ extents**2) / 12.0


@pytest.mark.parametrize("count", [2, 4, 7])
def test_points_of_parts_have_the_moments_of_their_areas(count):
    for patch in (ContactPatch.disc(0.01), ContactPatch.rectangle(0.03, 0.02), PATCHES["L"], PATCHES["ring"]):
        size, points, whole = patch.second_moment(), np.zeros((2, 2)), np.zeros((2, 2))
        for k in range(count):
            mine = labels_of(patch, count) == k
            part, tiles = part_of(patch, mine), patch.tile_weights()[mine]
            share = tiles.sum()
            np.testing.assert_allclose(part.tile_weights(), tiles / share, rtol=1e-12)
            np.testing.assert_allclose(part.weights() @ part.positions, tiles @ part.positions / share, atol=1e-16)
            points += share * second_moments(part.positions, part.weights(), np.zeros((part.cells, 2)))
            whole += second_moments(part.positions, tiles, part.cell_extents())
            np.testing.assert_allclose(points, whole, atol=1e-12 * size)
        of_patch = second_moments(patch.positions, patch.weights(), np.zeros((patch.cells, 2)))
        np.testing.assert_allclose(points, of_patch, atol=1e-12 * size)


def test_parts_too_small_for_factors_keep_their_areas():
    patch = ContactPatch.rectangle(0.02, cells=4)
    parts = [part_of(patch, labels_of(patch, 16) == k) for k in range(16)]
    assert all(part.point_shares is None and part.weights() == [1.0] for part in parts)
    model = pf.models.MomentModel(patch, PLAIN, parts=16, **SMALL)
    assert [part.share for part in model.parts_at(None)] == pytest.approx([1 / 16] * 16, rel=1e-14)


@pytest.mark.parametrize("parts", [True, 0, -1, 2.5, "six", None, [2], float("nan"), 85, 2000])
def test_other_parts_are_refused_in_one_line(parts):
    with pytest.raises(InvalidValueError, match="parts must be") as error:
        pf.models.MomentModel(PUBLISHED_PATCHES["NonConvex2"](), PLAIN, parts=parts, **SMALL)
    assert "\n" not in str(error.value)
