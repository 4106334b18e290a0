"""The classics: the numbers of the LuGre paper's experiments, by two methods."""

import pytest

from planarfriction_studies.experiments import runs
from planarfriction_studies.experiments.classics import run as classics
from planarfriction_studies.experiments.classics import scenes
from planarfriction_studies.experiments.experiment import Work


@pytest.fixture(scope="module")
def result():
    return classics.run(Work(quick=True))


def test_all_comparisons_hold(result):
    assert [
        (row.quantity, row.ours, row.theirs)
        for row in result.comparisons
        if not row.holds
    ] == []
    assert len(result.comparisons) == 2 + 2 + 4 + 3 + 2


def test_numbers_of_presliding_break_away_and_lag(result):
    found = result.numbers["found"]
    loop = "presliding, x at {} s [m]"
    assert found[loop.format(15)] == pytest.approx(45.3119e-6, abs=6e-11)
    assert found[loop.format(40)] == pytest.approx(-10.0174e-6, abs=6e-11)
    away = [
        found[f"break-away, {rate} N/s, largest friction [N]"]
        for rate in (1, 5, 10, 50)
    ]
    assert away == pytest.approx([1.43242, 1.31321, 1.21995, 1.00747], abs=6e-6)
    lag = [
        found[f"lag, {frequency} rad/s, largest friction [N]"]
        for frequency in (1, 10, 25)
    ]
    assert lag == pytest.approx([1.38945, 1.37791, 1.34427], abs=6e-6)


def test_numbers_of_hunting(result):
    found, converged = (result.numbers[name] for name in ("found", "converged"))
    for numbers, share in ((converged, 1e-4), (found, 1e-3)):
        assert numbers["hunting, period [s]"] == pytest.approx(24.3708, rel=share)
        assert numbers["hunting, largest error after 30 s [m]"] == pytest.approx(
            74.136e-3, rel=share
        )


def test_numbers_of_stick_slip():
    run = runs.simulated(scenes.stick_slip(), rtol=1e-9, atol=1e-8, save_every=1e-3)
    assert run["x"][-1] == pytest.approx(2.5451019, abs=6e-8)
    assert run["vx"].max() == pytest.approx(0.369816, abs=6e-7)
