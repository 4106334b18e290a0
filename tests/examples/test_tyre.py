"""The example of a rolling tyre: the brush model's closed forms, the step of the library, its stated numbers."""

import re

import numpy as np
import pytest

import planarfriction as pf
from tests.support.repository import script


@pytest.fixture(scope="module")
def tyre():
    return script("examples/tyre.py")


def test_the_closed_form_is_the_integral_over_the_patch(tyre):
    """Bristles bent in proportion to the way from the front, as far as `mu p` lets them."""
    a = tyre.HALF_LENGTH
    x = np.linspace(-tyre.HALF_LENGTH, tyre.HALF_LENGTH, 20001)
    limit = tyre.MU * tyre.LOAD * 0.75 / a * (1.0 - (x / a) ** 2)
    for slope in (0.01, 0.06, 0.12, 0.2):
        line = np.minimum(tyre.STIFFNESS * slope * (a - x), limit)
        expected = [np.trapezoid(line, x), -np.trapezoid(line * x, x)]
        # Trapezoids of 6 um.
        assert tyre.brush(np.array(slope)) == pytest.approx(
            expected, rel=1e-6, abs=1e-4
        )


def test_its_docstring_states_what_it_prints(tyre, tmp_path, capsys):
    tyre.main(["--out", str(tmp_path)])
    printed = capsys.readouterr().out.splitlines()
    assert (tmp_path / "tyre.png").stat().st_size > 10_000
    stated = re.findall(r"^    ((?:largest|if) .*)$", tyre.__doc__, re.MULTILINE)
    assert stated == printed[:2]
    force, torque = map(float, re.findall(r"([\d.]+) %", printed[0]))
    assert force < 1.0 and torque < 1.0


def test_a_step_of_the_bristles_is_that_of_the_distributed_model(tyre):
    """Both give one result if all cells have the same law."""
    patch = pf.ContactPatch.rectangle(0.12, 0.14, (6, 2))
    law = pf.LuGre(
        mu_c=0.9, sigma_0=300.0, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9
    )
    twist = np.array([0.1, 0.2, 1.0])
    z = np.zeros((2, patch.cells))
    x, y = patch.positions.T
    velocity = np.array([twist[0] - twist[2] * y, twist[1] + twist[2] * x])
    state = z
    for dt in (1e-3, 5e-3, 2e-2, 0.1):
        z = tyre.bend(
            z, velocity, np.full(patch.cells, dt), tyre.LawNumbers(*law.numbers)
        )
        state, _ = pf.DistributedModel(patch, law).step(state, twist, 1.0, dt)
        # Rounding, of a few operations.
        assert np.abs(z - state).max() < 1e-14 * np.abs(state).max() * 100.0


def test_the_force_builds_up_over_the_length_of_the_patch(tyre):
    """While nothing slides: `c tan(alpha)(2 a s - s^2/2)` after the way s."""
    rolling = tyre.roll(tyre.sideways(np.array([1e-4])))
    way = (np.arange(tyre.COLUMNS) + 1.0) * 2.0 * tyre.HALF_LENGTH / tyre.COLUMNS
    expected = (
        tyre.STIFFNESS * np.tan(1e-4) * (2.0 * tyre.HALF_LENGTH * way - 0.5 * way**2)
    )
    # A column, and the edge of the rear slides.
    assert -rolling.wrenches[:, 0, 1] == pytest.approx(expected, rel=0.02)


def test_a_tyre_that_brakes_holds_as_one_that_slips_sideways(tyre):
    slopes = np.array([0.02, 0.1, 0.3])
    none = np.zeros(3)
    sideways = tyre.roll(np.stack([none, slopes, none], -1)).wrenches[-1]
    braking = tyre.roll(np.stack([slopes, none, none], -1)).wrenches[-1]
    assert braking[:, 0] == pytest.approx(sideways[:, 1], rel=1e-12)  # the same sums
    assert np.abs(braking[:, 2]).max() < 1e-9
