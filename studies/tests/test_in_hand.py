"""The in-hand experiment: every reference is met, and the numbers it reports are those of the physics."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import Work
from planarfriction_studies.experiments.in_hand.run import (
    CASES,
    KINDS,
    LESS,
    MORE,
    REDUCED,
    run,
)
from planarfriction_studies.experiments.in_hand.runs import (
    Case,
    compare_with_converged,
    compare_with_published,
    with_friction,
)
from planarfriction_studies.experiments.runs import LAW, simulated


@pytest.fixture(scope="module")
def result():
    return run(Work(quick=True))


def test_all_comparisons_hold(result):
    assert [row.quantity for row in result.comparisons if not row.holds] == []


def test_every_reference_of_the_disc_is_compared(result):
    published = [
        name
        for name in facts._published()["curves"]
        if name.startswith("in_hand/") and "Square" not in name
    ]
    found = [row for row in result.comparisons if row.reference == "published"]
    assert len(found) == len(published)
    assert sum(row.samples for row in found) == sum(
        len(facts.published_curve(name).time) for name in published
    )
    # six columns at tight tolerances and the motion at the default ones, for two models and two loads
    assert (
        sum(row.reference == "converged" for row in result.comparisons) == (6 + 3) * 4
    )


def test_the_full_run_covers_every_case_with_references():
    keys = {case.key(kind) for case in CASES if case.has_references for kind in KINDS}
    of_facts = {
        name.rpartition("/")[0]
        for name in facts._published()["curves"]
        if name.startswith("in_hand/")
    }
    assert keys == {name for name in of_facts if name != "in_hand/load"}


def test_models_are_farther_apart_than_solvers_and_friction_explains_it(result):
    for each in result.numbers["cases"].values():
        shifts = each["shift of the end [m]"]
        assert shifts["default tolerances"] < 1e-2 * shifts[REDUCED]
        assert 0.5 < shifts[MORE] / shifts[LESS] < 2.0
        share = each["distance between the models as friction"]
        assert share == pytest.approx(
            1e-3 * shifts[REDUCED] / (0.5 * (shifts[MORE] + shifts[LESS]))
        )


def test_holding_load():
    # Under the pads nothing turns: weight m g/2 = mu_s f_N. Beside them it takes more, ever more.
    case = Case("Circle", 1)
    assert case.holding_load(0.0) == pytest.approx(
        0.5 * 0.2 * 9.81 / LAW.mu_s, rel=1e-9
    )
    loads = [case.holding_load(x) for x in (0.0, 0.002, 0.01, 0.025)]
    assert (np.diff(loads) > 0.0).all()
    # far away only the torque counts: f_N = m g x/(2 mu_s r), less than 1 % from there at ten radii
    x = 0.0638
    assert case.holding_load(x) == pytest.approx(
        0.981 * x / (LAW.mu_s * 6.37994742e-3), rel=1e-2
    )


def test_a_held_plate_does_not_move():
    case = Case("Circle", 2)
    scene = case.scene("d")
    load = case.holding_load(0.002)
    moved = []
    for factor in (1.02, 0.97):
        contact = dataclasses.replace(scene.contacts[0], normal_force=factor * load)
        found = simulated(dataclasses.replace(scene, contacts=[contact], t_end=0.5))
        moved.append(abs(found["y"][-1]))
    assert moved[0] < 1e-5 and moved[1] > 1e-4


def test_a_percent_of_friction_breaks_the_comparisons():
    found = simulated(Case("Circle", 2).scene("r", with_friction(0.01)))
    rows = compare_with_published(
        found, "in_hand/Circle/r2", ""
    ) + compare_with_converged(found, "in_hand/Circle/r2", "")
    assert not any(row.holds for row in rows if row.unit in ("m", "rad"))


def test_what_is_drawn_and_stored(result):
    names = [picture.name for picture in result.pictures]
    assert (
        names[0] == "motion"
        and "Circle_placement_1_motion" in names
        and "distance" in names
    )
    data = result.data["Circle_placement_1"]
    assert dict(data.sizes) == {"model": 2, "load": 2, "time": 201}
    assert all("units" in data[name].attrs for name in data.data_vars)
    for table in result.tables:
        assert all(len(row) == len(table.headings) for row in table.rows)
    page = Path(__file__).parents[2] / "docs" / "benchmarks.md"
    if page.is_file():  # which shows the last of them
        assert f"<!-- table: {result.tables[-1].title} -->" in page.read_text("utf-8")
    assert len(result.findings) <= 5 and not any(
        "nan" in finding for finding in result.findings
    )
