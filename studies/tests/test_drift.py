"""The drift experiment: published and converged curves, closed forms, and what would not fit them."""

import numpy as np
import pytest

from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.drift import run as drift
from planarfriction_studies.experiments.experiment import Work, compare_curve


@pytest.fixture(scope="module")
def result():
    return drift.run(Work(quick=True))


def test_everything_holds(result):
    assert [row.quantity for row in result.comparisons if not row.holds] == []


def test_published_and_converged_curves_are_compared_at_all_samples(result):
    published = [
        name for name in facts._published()["curves"] if name.startswith("drift/")
    ]
    rows = [
        row
        for row in result.comparisons
        if row.reference == "published" and row.ours is None
    ]
    assert len(rows) == len(published) == 15
    assert sum(row.samples for row in rows) == sum(
        len(facts.published_curve(name).time) for name in published
    )
    solutions = {
        name.rpartition("/")[0]
        for name in facts._converged()
        if name.startswith("drift/")
    }
    rows = [
        row
        for row in result.comparisons
        if row.reference == "converged" and row.ours is None
    ]
    assert len(rows) == 3 * len(solutions) == 12
    assert {row.samples for row in rows} == {500}


def test_exact_plateaus(result):
    # 1/(sigma_0 9.81) and 0.03/(sigma_0 9.81 <rho^2>), as printed
    true = result.numbers["plateaus"]["measured"]["d_ep"]
    assert true["x"] == pytest.approx(1.019368e-7, rel=1e-6)
    assert true["theta"] == pytest.approx(1.067983e-5, rel=1e-6)


def test_the_reduced_model_is_too_soft_by_what_its_equations_say(result):
    plateaus = result.numbers["plateaus"]
    patch = result.numbers["patch"]
    measured = plateaus["measured"]
    closed = plateaus["closed form"]
    true = measured["d_ep"]
    assert measured["r_ep"]["x"] / true["x"] == pytest.approx(1.24, abs=0.01)
    assert measured["r_ep"]["theta"] / true["theta"] == pytest.approx(1.13, abs=0.01)
    radius = patch["contact radius of the ellipsoid"]
    assert measured["e_ep"]["theta"] / true["theta"] == pytest.approx(
        patch["second moment"] / radius**2, rel=1e-5
    )
    # neither the spring nor the ellipsoid explains the table: the straight path does, the stepped one is 2 % off it
    assert measured["straight"] == pytest.approx(closed["straight"], rel=5e-4)
    assert abs(measured["r_ep"]["x"] / closed["straight"]["x"] - 1.0) > 0.01


def test_only_plain_bristles_drift(result):
    creep = result.numbers["creep"]
    for models in creep.values():
        assert models["d"]["x"] > 1e-8
        assert abs(models["d_ep"]["x"]) < 1e-18
        assert abs(models["d_ep"]["theta"]) < 1e-15
    # under the normal load the table's elasto-plastic model does creep, a thousand times less than the plain one
    table = creep["normal force"]
    assert 1e-4 < abs(table["r_ep"]["x"]) / table["r"]["x"] < 1e-2
    assert abs(table["e_ep"]["x"]) < 1e-18


def test_the_patch_is_as_wide_as_the_article_says_its_radius_is(result):
    assert result.numbers["implied width"] == pytest.approx(0.05, rel=1e-5)


def test_a_sample_late_or_a_wrong_stiffness_would_be_noticed(result):
    data = result.data["tangential"].sel(model="distributed", bristles="elasto-plastic")
    time = data["time"].to_numpy()
    theta = data["theta"].to_numpy()
    allowance = drift.QUICK[2] * float(np.ptp(theta))
    for wrong in (np.append(theta[1:], theta[-1]), 1.001 * theta):
        row = compare_curve(
            "theta", time, wrong, "drift/d_ep/theta", allowance=allowance, cause="wrong"
        )
        assert not row.holds, row


def test_nothing_moves_with_a_fixed_stiffness(result):
    """The deflection of a stiffness that grows with the load is `F/(sigma_0 f_N)`: it follows the normal force."""
    swing = result.numbers["swing"]
    assert swing["grows"]["x"] > 1e-8 and swing["grows"]["theta"] > 1e-6
    assert swing["fixed"]["x"] < 1e-15 and swing["fixed"]["theta"] < 1e-13
