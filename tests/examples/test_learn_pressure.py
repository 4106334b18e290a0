"""The example that learns a pressure distribution: its numbers, its picture, and what it says about ambiguity."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.repository import script

torch = pytest.importorskip(
    "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
)

pytestmark = pytest.mark.torch


@pytest.fixture(scope="module")
def example():
    return script("examples/learn_pressure.py")


@pytest.fixture(scope="module")
def fits(example):
    return example.run(steps=120, motions=80)


def test_turns_about_many_points_find_the_map(example, fits):
    truth, rich, _ = fits
    errors = example.summary(truth, rich.weights)
    assert example.moved_load(truth, np.full(64, 1 / 64)) > 0.3  # where it starts
    assert errors["moved load"] < 0.2
    assert (
        errors["centre"] < 2e-4
        and errors["radius"] < 0.01
        and errors["second moment"] < 0.02
    )


def test_one_spin_fits_its_wrenches_with_a_wrong_map(example, fits):
    truth, _, poor = fits
    assert (
        np.sqrt(poor.losses[-1]) < 2.0 * np.sqrt(3) * example.NOISE * example.LAW.mu_c
    )
    assert example.moved_load(truth, poor.weights) > 0.3


def test_torques_about_a_line_do_not_distinguish_mirror_images(example):
    truth = example.true_patch()
    mirrored = pf.ContactPatch.points(truth.positions * [1.0, -1.0], truth.weights())
    for c in np.linspace(-0.02, 0.02, 7):
        wrenches = [
            pf.LimitSurfaceCells(patch).wrench((0.0, -3.0 * c, 3.0))
            for patch in (truth, mirrored)
        ]
        about_c = [wrench[2] - c * wrench[1] for wrench in wrenches]
        assert about_c[0] == pytest.approx(about_c[1], rel=1e-12)
        # The force across the line does.
        assert abs(wrenches[0][0] + wrenches[1][0]) < 1e-12 < abs(wrenches[0][0])


def test_it_draws(example, tmp_path, capsys):
    example.main(["--out", str(tmp_path), "--steps", "2"])
    assert (tmp_path / "learn_pressure.png").stat().st_size > 10_000
    assert "centre of pressure off by" in capsys.readouterr().out
