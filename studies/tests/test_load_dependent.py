"""The experiment with a pressure that follows the load: references, closed forms, and what each variant does."""

import numpy as np
import pytest

from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import Work
from planarfriction_studies.experiments.in_hand.runs import compare_with_converged
from planarfriction_studies.experiments.load_dependent.run import (
    DISTRIBUTED,
    KEPT,
    KEPT_LARGEST,
    LARGEST_CONTACT,
    REBUILT,
    RESCALED,
    VARIANTS,
    finger,
    profile_moment,
    round_moments,
    run,
    soft_patch,
    soft_scene,
)
from planarfriction_studies.experiments.runs import simulated


@pytest.fixture(scope="module")
def result():
    return run(Work(quick=True))


def test_all_comparisons_hold_and_cover_the_references(result):
    assert [row.quantity for row in result.comparisons if not row.holds] == []
    solutions = {
        name.rpartition("/")[0]
        for name in facts._converged()
        if name.startswith("load_dependent/")
    }
    converged = [row for row in result.comparisons if row.reference == "converged"]
    assert len(converged) == (6 + 3) * len(solutions)


def test_profiles_in_closed_form():
    # Hertz: r = 3 pi R/16, <rho^2> = 2 R^2/5; a cone (k = 1): r = R/2; a flat profile (k large): 2 R/3
    loads = np.array([1.0, 2.0])
    r, second = round_moments(1, loads)
    np.testing.assert_allclose(
        r, 3.0 * np.pi / 16.0 * finger(1).radius(loads), rtol=1e-12
    )
    np.testing.assert_allclose(second, 0.4 * finger(1).radius(loads) ** 2, rtol=1e-12)
    assert profile_moment(1.0, 2) / profile_moment(1.0, 1) == pytest.approx(
        0.5, rel=1e-12
    )
    assert profile_moment(1e4, 2) / profile_moment(1e4, 1) == pytest.approx(
        2.0 / 3.0, rel=1e-3
    )


def test_the_published_table_is_made_at_the_largest_contact():
    # 349 loaded cells and <rho^2> = 4.016835e-5 m^2: the profile that the paper's one table is made from
    patch = soft_patch(1)
    assert int((patch.weights(LARGEST_CONTACT) > 0.0).sum()) == 349
    assert float(patch.second_moment(LARGEST_CONTACT)) == pytest.approx(
        4.016835e-5, rel=1e-6
    )


def test_what_follows_the_load_decides_how_close_it_comes(result):
    variants = result.numbers["pressure laws"]["k = 2"]["variants"]
    gap = {name: each["distance at the end [m]"] for name, each in variants.items()}
    assert gap[DISTRIBUTED] == 0.0
    # the profile keeps its form: a rescaled table is as good as a new one, up to the staircase of the grid
    assert gap[RESCALED] == pytest.approx(gap[REBUILT], rel=0.1)
    assert gap[KEPT] > 1.5 * gap[RESCALED] and gap[KEPT_LARGEST] > 1.5 * gap[KEPT]


def test_a_table_that_does_not_follow_breaks_the_comparison():
    found = simulated(soft_scene(1, KEPT))
    rows = compare_with_converged(found, "load_dependent/r1", "", default=True)
    assert not any(row.holds for row in rows)


def test_what_is_drawn_and_stored(result):
    assert [picture.name for picture in result.pictures] == [
        "profiles",
        "motion",
        "distance",
    ]
    data = result.data["in_hand"]
    assert dict(data.sizes) == {"pressure": 1, "variant": len(VARIANTS), "time": 201}
    assert all("units" in data[name].attrs for name in data.data_vars)
    (table,) = result.tables
    assert all(len(row) == len(table.headings) for row in table.rows)
