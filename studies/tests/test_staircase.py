"""The staircase of a line contact: published vertices, plateaus, and the rod's closed form against quadrature."""

import dataclasses

import numpy as np
import pytest
from scipy import integrate

from planarfriction.limit_surface import LimitSurfaceCells
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import Work, compare_curve
from planarfriction_studies.experiments.staircase import run as staircase


@pytest.fixture(scope="module")
def result():
    return staircase.run(Work(quick=True))


def test_everything_published_is_compared_and_holds(result):
    assert [row.quantity for row in result.comparisons if not row.holds] == []
    curves = {
        row.quantity: row.samples
        for row in result.comparisons
        if "steady state" in row.quantity
    }
    expected = {
        f"steady state of the line, {words}, {name}": len(
            facts.published_curve(f"staircase/{key}/{name}").time
        )
        for key, words in (("plain", "plain sum"), ("bilinear", "bilinear smoothing"))
        for name in ("fx", "fy", "tau")
    }
    assert curves == expected  # all vertices of all six curves


def test_plateaus(result):
    # the numbers that the paper's figure is remembered by, as printed
    radius = result.numbers["radius"]
    assert radius["plain"] == pytest.approx(4.988662e-3, abs=5e-10)
    assert radius["bilinear"] == pytest.approx(4.949980e-3, abs=5e-10)
    assert radius["rod"] == pytest.approx(5e-3, rel=1e-14)


def test_the_smoothing_is_not_continuous_at_the_edge_of_its_grid(result):
    edge = result.numbers["edge"]
    # vx/omega reaches the half-width at 1.2 s; -vy/omega the half-width and a cell at 3.6713 s
    assert edge["high"]["time"] == pytest.approx(1.2, abs=1.01e-4)
    assert edge["low"]["time"] == pytest.approx(
        3.4 + 0.6 * (1.0 - 0.006 / (0.01 + 0.02 / 21)), abs=1.01e-4
    )
    assert edge["high"]["jump"] > 0.01
    assert edge["low"]["jump"] > 0.001


def test_labels_one_sample_late_do_not_fit(result):
    shifts = result.numbers["miss_if_labels_mean_the_state"]
    assert shifts["at"] < 2e-8 < 1e-4 < min(shifts["before"], shifts["after"])


def test_the_wrong_sum_would_be_noticed(result):
    data = result.data["line"]
    time = staircase.sample_times(5.0, staircase.SAMPLE_TIME)
    twist = dataclasses.replace(staircase.published_velocity(), hold="linear")(time)
    wrong = LimitSurfaceCells(PUBLISHED_PATCHES["Line"](cells=23)).wrench(twist)
    row = compare_curve(
        "tau",
        time,
        wrong[:, 2],
        "staircase/plain/tau",
        allowance=1e-12,
        cause="23 cells",
    )
    assert not row.holds
    assert all(variable.attrs["units"] for variable in data.data_vars.values())


@pytest.mark.parametrize(
    "twist",
    [
        (0.0, 0.0, 1.0),
        (0.004, 0.003, 1.0),
        (-0.02, 1e-3, -0.7),
        (0.005, 0.0, 1.0),
        (0.0, 0.01, 2e-3),
        (0.3, -0.4, 0.0),
    ],
)
def test_rod_against_quadrature(twist):
    vx, vy, omega = twist
    half = 0.01

    def speed(y):
        return np.hypot(vx - omega * y, vy)

    middle = [vx / omega] if omega and abs(vx / omega) < half else None
    parts = [
        integrate.quad(density, -half, half, points=middle, epsabs=1e-13, epsrel=1e-12)[
            0
        ]
        for density in (
            lambda y: -(vx - omega * y) / speed(y),
            lambda y: -vy / speed(y),
            lambda y: y * (vx - omega * y) / speed(y),
        )
    ]
    found = staircase.rod_wrench(np.array(twist), half)
    np.testing.assert_allclose(
        found, np.array(parts) / (2 * half), rtol=1e-9, atol=1e-11
    )


def test_rod_at_rest_and_in_rows():
    twists = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.002, 0.001, 1.0]])
    found = staircase.rod_wrench(twists, 0.01)
    np.testing.assert_array_equal(found[0], 0.0)
    np.testing.assert_allclose(found[1], [-1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_array_equal(found[2], staircase.rod_wrench(twists[2], 0.01))


def test_smoothing_and_plain_sum_agree_outside_the_grid():
    patch = PUBLISHED_PATCHES["Line"]()
    twists = np.array([[0.011, 0.0, 1.0], [0.0, 0.02, 1.0], [0.01, 0.01, 0.0]])
    plain = LimitSurfaceCells(patch).wrench(twists)
    np.testing.assert_allclose(
        staircase.smoothed_wrench(twists, patch), plain, rtol=0.0, atol=1e-15
    )
