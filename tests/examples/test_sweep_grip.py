"""The example of the page on sweeps: what holds and what does not, by the limit surface, and its picture."""

import numpy as np
import pytest

from tests.support.repository import script


@pytest.fixture(scope="module")
def example():
    return script("examples/sweep_grip.py")


def test_the_limit_surface_says_what_holds(example):
    """With a tenth less grip than it takes the plate turns; with a fifth more it holds, though let go all at once."""
    limit = float(example.holding_grip(np.array(example.RATIO)))
    for grip, holds in ((0.9 * limit, False), (1.2 * limit, True)):
        angle = example.end(example.pf.simulate(example.plate(grip, 1.0)))["angle"]
        assert (abs(angle) < example.HELD) == holds


def test_it_sweeps_draws_and_goes_on(example, tmp_path, capsys):
    for found in ("", "(4 found)"):
        example.main(["--out", str(tmp_path), "--points", "2"])
        printed = capsys.readouterr().out
        assert "of 4 runs\n" in printed and found in printed
    assert (tmp_path / "sweep_grip.png").stat().st_size > 10_000
