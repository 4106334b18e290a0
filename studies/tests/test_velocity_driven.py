"""The velocity-driven experiment: published and converged curves, box plots, and what would not fit them."""

import numpy as np
import pytest

from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import Work
from planarfriction_studies.experiments.velocity_driven import boxes
from planarfriction_studies.experiments.velocity_driven import run as velocity_driven


@pytest.fixture(scope="module")
def result():
    return velocity_driven.run(Work(quick=True))


def wrench(result, shape, model, component):
    return result.data["wrenches"][component].sel(shape=shape, model=model).to_numpy()


def test_everything_holds(result):
    assert [row.quantity for row in result.comparisons if not row.holds] == []


def test_every_published_curve_is_compared_at_all_its_vertices(result):
    names = [
        name for name in facts._published()["curves"] if name.startswith("driven/")
    ]
    expected = sum(len(facts.published_curve(name).time) for name in names)
    rows = [
        row
        for row in result.comparisons
        if row.reference == "published" and row.ours is None
    ]
    assert len(names) == 24
    assert len(rows) == 25  # the torque on the ellipsoid in two parts
    assert sum(row.samples for row in rows) == expected


def test_every_converged_curve_and_box_belongs_to_a_comparison():
    solutions = {
        name.rpartition("/")[0]
        for name in facts._converged()
        if name.startswith("driven/")
    }
    assert solutions == {
        f"driven/{shape}/{kind}" for shape in velocity_driven.CONVERGED for kind in "dr"
    }
    found = {f"{quantity}/{shape}/{model}" for quantity in boxes.UNITS for shape in boxes.PUBLISHED_SHAPES
             for model in boxes.MODELS}  # fmt: skip
    assert found == set(facts.published_table("box"))
    assert {f"box/{name}" for name in found} == {
        name for name in facts._converged() if name.startswith("box/")
    }


def test_box_comparisons_of_two_shapes(result):
    rows = [row for row in result.comparisons if row.quantity.startswith("error of")]
    # Shapes, boxes of each, published and converged columns.
    assert len(rows) == 2 * 4 * (5 + 6)


def test_steady_slide_and_spin(result):
    # mu_c + sigma_2 v in a slide at 6 mm/s; r mu_c + sigma_2 <rho^2> omega in a spin at 1 rad/s
    patches = facts.published_table("patches")
    for shape in ("Circle", "NonConvex1"):
        radius, moment = (
            patches[shape][column]
            for column in ("contact radius, as published [m]", "second moment [m^2]")
        )
        for model in ("reduced", "ellipsoid"):
            assert wrench(result, shape, model, "fy")[420] == pytest.approx(
                -(1.0 + 0.2 * 0.006), abs=2e-8
            )
            tau = wrench(result, shape, model, "tau")[75]
            assert tau == pytest.approx(-(radius + 0.2 * moment), abs=1e-10), (
                shape,
                model,
            )


def test_the_ellipsoid_is_worse_where_the_paper_says_so(result):
    numbers = result.numbers["errors"]["NonConvex1"]["ft"]
    assert (
        numbers["ellipsoid"]["third quartile"]
        > 100.0 * numbers["corrected"]["third quartile"]
    )
    # the whisker of the published plot ends where the largest errors begin
    assert numbers["corrected"]["maximum"] > 40.0 * numbers["corrected"]["whisker high"]


def test_statistics_of_a_box_plot():
    values = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 20.0])
    found = boxes.statistics(values)
    assert found == dict(
        zip(boxes.COLUMNS, (0.0, 1.25, 2.5, 3.75, 4.0, 20.0), strict=True)
    )
    assert boxes.slack(values, 1)["median"] == 1.0
    assert boxes.slack(values, 1)["maximum"] == 16.0


def test_other_conventions_do_not_meet_the_quartiles(result):
    misses = dict(result.numbers["misses_of_other_conventions"])
    assert misses.pop("500 samples, linear") < 1e-9 < 5e-6 < min(misses.values())


def test_the_wrong_contact_radius_or_label_would_be_noticed(result):
    time = result.data["wrenches"]["time"].to_numpy()
    tau = wrench(result, "Circle", "ellipsoid", "tau")
    plain_sum = 6.37994742e-3 / 6.35716049e-3
    for wrong in (plain_sum * tau, np.append(tau[1:], tau[-1])):
        rows = velocity_driven._ellipsoid_comparisons(
            "tau", time, wrong, "driven/Circle/e/tau", "Circle", "N m"
        )
        assert not all(row.holds for row in rows), rows
