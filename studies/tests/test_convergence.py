"""The convergence experiment: the published errors are met, and what it measures is what it says."""

import dataclasses

import numpy as np
import pytest

from planarfriction.scenes import Signal
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.convergence import run as convergence
from planarfriction_studies.experiments.convergence import runs
from planarfriction_studies.experiments.experiment import Work


@pytest.fixture(scope="module")
def result():
    return convergence.run(Work(quick=True))


def test_all_comparisons_hold(result):
    failed = [
        (c.quantity, c.difference, c.tolerance)
        for c in result.comparisons
        if not c.holds
    ]
    assert not failed


def test_comparisons_cover_the_figures(result):
    published = [c for c in result.comparisons if c.reference == "published"]
    # the velocity profile, and for the one patch of a quick look four figures x two parameters x two quantities
    assert len(published) == 3 + 4 * 2 * 2
    assert len(facts.published_curve("convergence/segments/Square/p1/tau").time) == len(
        runs.COUNTS
    )


def test_relative_errors_by_hand():
    base = np.array([[3.0, 4.0, -2.0], [0.0, 0.0, 1.0]])
    wrench = base + np.array([[0.5, 0.0, 0.2], [0.0, 0.5, 0.0]])
    np.testing.assert_allclose(
        runs.relative_errors(wrench, base), [0.1, 0.1 / np.sqrt(2.0)], rtol=1e-12
    )


def test_profile_is_the_published_one_but_continuous():
    held = runs.published_velocity()
    profile = runs.profile()
    np.testing.assert_allclose(profile(held.times), held.values, rtol=0.0, atol=1e-14)
    assert profile.hold == "linear" and len(profile.breaks) <= len(profile.times)
    assert profile(0.005)[2] == pytest.approx(0.005 / 0.6)


def test_velocity_is_that_of_the_finest_grids_centre_of_pressure():
    # A coarse line has its centre of pressure elsewhere; its contact frame must sit where the finest grid's puts it.
    coarse = runs.contact("cells_distributed", 7, ("LineGrad", "p0"))
    finest = runs.patch("LineGrad", runs.BASE_CELLS).centre_of_pressure()
    np.testing.assert_allclose(
        coarse.position, -np.asarray(finest), rtol=0.0, atol=1e-15
    )
    assert np.hypot(*(finest - coarse.model.patch.centre_of_pressure())) > 1e-5


def test_line_converges_at_first_order(result):
    # Its cells are points of a staircase: first order, not second.
    slopes = result.numbers["slopes"]["cells_distributed"]["LineGrad/p0"]
    assert -1.4 < slopes["ft"] < -0.8
    assert -1.4 < slopes["tau"] < -0.8


def test_disc_mask_changes_size_and_the_cut_disc_does_not(result):
    radii = result.numbers["disc_radius_errors"]
    assert abs(radii["mask"][-1]) > 10.0 * abs(radii["cut"][-1])
    assert result.numbers["base_disc_radius_error"] == pytest.approx(
        100.0 / 101.0 - 1.0, abs=2e-3
    )


def test_a_wrong_law_would_be_noticed(monkeypatch):
    case = ("LineGrad", "p0")
    law = dataclasses.replace(runs.LAWS["p0"], sigma_0=1.1e6)
    monkeypatch.setitem(runs.LAWS, "p0", law)
    errors = runs.solve([case], [5], Work())
    curve = facts.published_curve("convergence/cells_distributed/LineGrad/p0/ft")
    assert (
        abs(errors[case]["cells_distributed"][0, 0] / curve.values[0] - 1.0)
        > convergence.TOLERANCE[1e-4]
    )


def test_euler_steps_follow_the_structured_solver(monkeypatch):
    # Speeding up from rest: 0.05 s of the published method, in two parts as when it is resumed, beside ours.
    monkeypatch.setattr(runs, "T_END", 0.05)
    monkeypatch.setattr(runs, "_EULER_PARTS", 2)
    ramp = Signal.sampled(
        [0.0, 0.05], [[0.0, 0.0, 0.0], [0.01, 0.0, 1.0]], hold="linear"
    )
    monkeypatch.setattr(runs, "profile", lambda: ramp)
    case = ("LineGrad", "p1")
    ours, euler = (
        solve([case], [5, 7], Work())[case]
        for solve in (runs.solve, runs.solve_by_euler)
    )
    for family in runs.FAMILIES:
        # ours has one sample more, at the end, and Euler an error of first order; a table node answers exactly
        np.testing.assert_allclose(
            euler[family], ours[family], rtol=2e-2, atol=1e-12, err_msg=family
        )


def test_data_and_numbers_say_the_same(result):
    data = result.data["errors"]
    listed = result.numbers["errors"]["segments"]["LineGrad/p1"]["tau"]
    found = data.segments_tau.sel(shape="LineGrad", parameters="p1").to_numpy()
    np.testing.assert_array_equal(found, listed)
    assert all("units" in variable.attrs for variable in data.data_vars.values())
