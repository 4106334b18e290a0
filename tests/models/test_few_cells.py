"""ReducedModel on a few cells: sums of the patch that they keep, breakaway, and shapes that follow the load."""

from __future__ import annotations

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from planarfriction.models.reduced import few_cells
from planarfriction.patch import PUBLISHED_PATCHES

LAW = pf.LuGre(mu_c=1.0, mu_s=1.2, v_s=1e-3, sigma_0=1e6, sigma_1=8e2, sigma_2=0.2, elasto_plastic=0.9)
DISC = pf.ContactPatch.disc(0.01)
FINGER = pf.ContactPatch.rectangle(
    0.02, cells=21, pressure=pf.SoftFinger(c=6 * 0.02 / 21, n=1 / 3, k_per_newton=2.0, radius_max=0.01)
)
SHAPES = {
    "disc": DISC,
    "T": PUBLISHED_PATCHES["NonConvex2"](),
    "peak": pf.ContactPatch.disc(0.01, pressure=lambda x, y: np.exp(-((x - 0.008) ** 2 + y**2) / 1.8e-5)),
    "bar": pf.ContactPatch.rectangle(0.03, 0.001, cells=(61, 3)),
}
ROUNDING = 1e-9
"""Sums of the few cells against those of all: what their fit leaves."""


def kept(few: pf.ContactPatch, patch: pf.ContactPatch, load: float | None = None) -> None:
    """Centre, second moment and the wrench of a spin are those of the whole patch."""
    size = patch.contact_radius(load)
    assert few.centre_of_pressure(load) == pytest.approx(patch.centre_of_pressure(load), abs=ROUNDING * size)
    assert few.contact_radius(load) == pytest.approx(size, rel=ROUNDING)
    assert few.second_moment(load) == pytest.approx(patch.second_moment(load), rel=ROUNDING)


# ---------------------------------------------------------------------- what is kept


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("cells", [12, 40])
def test_few_cells_keep_the_moments_of_the_pressure(name, cells):
    patch = SHAPES[name]
    few = few_cells(patch, cells)
    # 4 sums are left of a patch that two reflections leave alike, each of a cell and its 3 images
    assert few.cells <= max(cells, 16) and (few.weights() > 0.0).all()
    kept(few, patch)


@pytest.mark.parametrize("load", [0.3, 0.77, 1.0, 2.4, 8.0, 100.0])
def test_few_cells_follow_the_load(load):
    few = few_cells(FINGER, 40)
    assert few.cells <= 80 and (few.weights(load) >= 0.0).all()
    kept(few, FINGER, load)


def test_shares_follow_the_load_without_jumps():
    few, loads = few_cells(FINGER, 40), np.linspace(0.8, 1.2, 4001)
    whole, moved = (np.abs(np.diff(patch.weights(loads), axis=0)).sum(axis=1) for patch in (FINGER, few))
    assert moved.max() < 3.0 * whole.max()  # a cell that comes in moves its whole share at once in both


def test_each_kind_of_friction_keeps_its_cells():
    halves = [
        pf.friction_metric(0.0, 1.0, 0.5) if x < 0.0 else pf.friction_metric(0.3, 0.7, 1.0) for x, _ in DISC.positions
    ]
    patch = DISC.with_friction_metric(np.array(halves))
    few = few_cells(patch, 20)
    assert few.cells <= 40
    for axis in range(2):
        at = few.metric[:, 0, 0] == halves[0][0, 0], patch.metric[:, 0, 0] == halves[0][0, 0]
        sums = [each.weights()[side] @ each.positions[side, axis] for each, side in zip((few, patch), at, strict=True)]
        assert sums[0] == pytest.approx(sums[1], abs=ROUNDING * 0.01)


def test_a_patch_of_few_cells_is_itself():
    patch = pf.ContactPatch.points([[0.01, 0.0], [-0.005, 0.008], [-0.005, -0.008]])
    model = pf.ReducedModel(patch, LAW)
    assert model.reduction.patch is patch and model.state_shape == (2, 3)


def test_cells_are_chosen_once_for_equal_patches_and_anew_for_others():
    few, again = few_cells(DISC, 40), pf.ContactPatch.disc(0.01)
    assert few_cells(again, 40) is few and pf.ReducedModel(again, LAW, cells=40).reduction.patch is few
    others = [
        pf.ContactPatch.disc(np.nextafter(0.01, 1.0)),
        pf.ContactPatch.disc(0.01, name="another disc"),
        pf.ContactPatch.disc(0.01, pressure=pf.LinearGradient((1e-6, 0.0))),
        DISC.with_friction_metric(np.diag([1.0, 2.0])),
    ]
    for other in others:
        assert few_cells(other, 40) != few and few_cells(other, 40).name == other.name
    assert few_cells(DISC, 41) is not few


# ---------------------------------------------------------------------- the model


def test_pre_sliding_and_translation_are_those_of_all_cells():
    few, whole = pf.ReducedModel(SHAPES["T"], LAW), pf.DistributedModel(SHAPES["T"], LAW)
    for twist, dt in (((1e-6, -2e-6, 2e-4), 1e-3), ((0.02, 0.01, 0.0), 1e-2)):
        one, other = (model.step(model.rest(), twist, 2.0, dt)[1] for model in (few, whole))
        assert one == pytest.approx(other, rel=1e-8, abs=1e-12)


def test_steady_sliding_is_close_and_closer_with_more_cells():
    """Centres of rotation all over the patch, the worst place for a few points."""
    rng = np.random.default_rng(0)
    centres = (
        0.01
        * np.sqrt(rng.uniform(size=300))[:, None]
        * np.stack([np.cos(a := 7 * rng.uniform(size=300)), np.sin(a)], 1)
    )
    twists = 50.0 * np.stack([centres[:, 1], -centres[:, 0], np.ones(300)], 1)

    def forces(model):
        return np.array([model.step(model.rest(), twist, 1.0, 10.0)[1][:2] for twist in twists])

    wanted = forces(pf.DistributedModel(DISC, LAW))
    rms = [np.sqrt(((forces(pf.ReducedModel(DISC, LAW, cells=n)) - wanted) ** 2).sum(-1).mean()) for n in (20, 40, 80)]
    assert rms[0] > rms[1] > rms[2] and rms[1] < 0.02


@pytest.mark.parametrize("name", ["NonConvex1", "Circle"])
def test_a_grip_that_falls_at_once_lets_go_as_with_all_cells(name):
    """Grip of 1.38 times the least that holds, then a little more than that: cells that break first weaken others."""
    patch = PUBLISHED_PATCHES[name]()
    lever, weight = 0.025, 0.981
    centre = patch.centre_of_pressure() + np.array([lever, 0.0])
    least = pf.planning.holding_load((0.0, -weight, -weight * centre[0]), patch, 1.2)
    for share in (1.005, 1.08):
        grip = pf.Signal.sampled([0.0, 0.1, 0.25], [1.38 * least, share * least, 1.38 * least])
        slid = []
        for model in (pf.DistributedModel(patch, LAW), pf.ReducedModel(patch, LAW)):
            data = pf.simulate(
                pf.scenes.in_hand(model, centre_of_mass=tuple(centre), normal_force=grip, t_end=0.4)
            ).data
            slid.append(float(np.hypot(data.x[-1] - data.x[0], data.y[-1] - data.y[0])))
        assert (slid[0] > 1e-3) == (share < 1.01)
        assert slid[1] == pytest.approx(slid[0], rel=0.1, abs=2e-6)  # 0.3 % of friction: 0.1 % moves them by 3 %


def test_a_start_that_carries_the_load_has_the_wrench_of_all_bristles():
    few, whole = pf.ReducedModel(DISC, LAW), pf.DistributedModel(DISC, LAW)
    bent = 3e-7 * np.random.default_rng(1).normal(size=(2, DISC.cells))
    still = np.zeros(3)
    assert few.wrench(few.state_of(bent, 2.0), still, 2.0) == pytest.approx(
        whole.wrench(bent, still, 2.0), rel=1e-9, abs=1e-15
    )


def test_every_law_and_friction_is_taken():
    creeping = pf.CoulombStribeck(mu_c=0.3, mu_s=0.4)
    for patch, law in ((DISC, creeping), (DISC.with_friction_metric(None, (0.2, 0.1)), LAW), (FINGER, creeping)):
        model = pf.ReducedModel(patch, law)
        state, wrench = model.step(model.rest(), (0.01, 0.0, 0.5), 1.0, 1e-2)
        assert state.shape == model.state_shape and np.isfinite(wrench).all() and wrench[0] < 0.0


def test_wrong_settings_are_one_line():
    for options, message in (
        ({"cells": 8}, "cells must be an integer >= 9, got 8"),
        ({"cells": 4.5}, "cells must be an integer >= 9, got 4.5"),
        ({"parts": 4}, "parts must be left out: write cells=, the number of cells that have bristles, got 4"),
        ({"load_error": 0.0}, "load_error must be left out: write cells="),
    ):
        with pytest.raises(InvalidValueError, match=message):
            pf.ReducedModel(DISC, LAW, **options)


def test_few_cells_of_a_symmetric_patch_are_symmetric():
    """Sliding along the axis of symmetry while it spins about its middle, no force pulls the disc aside."""
    few = few_cells(DISC, 40)
    places = {tuple(np.round(1e6 * each)): weight for each, weight in zip(few.positions, few.weights(), strict=True)}
    for (x, y), weight in places.items():
        assert places[-x + 0.0, y] == pytest.approx(weight, rel=1e-9)
        assert places[x, -y + 0.0] == pytest.approx(weight, rel=1e-9)
    model = pf.ReducedModel(DISC, LAW)
    wrench = model.step(model.rest(), (0.01, 0.0, 1.0), 1.0, 1e-2)[1]
    assert abs(wrench[1]) < 1e-9 * abs(wrench[0])


@pytest.mark.parametrize("loads", [(1.0, 2.0), (1e7, 2e7)])
def test_maps_that_stay_or_change_beyond_all_loads_have_few_cells(loads):
    values = np.random.default_rng(0).random((12, 12))
    patch = pf.ContactPatch.from_pressure({load: values**k for k, load in enumerate(loads, 1)}, 1e-3)
    few = few_cells(patch, 20)
    assert few.cells <= 40
    kept(few, patch, 1.5)
