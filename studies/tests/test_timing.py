"""The timing experiment: its numbers, not its speeds."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.scenes import in_hand
from planarfriction_studies.bench.baselines import LSODA, Window
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import Work
from planarfriction_studies.experiments.runs import published_model
from planarfriction_studies.experiments.timing import run as timing
from planarfriction_studies.experiments.timing import runs


@pytest.fixture(scope="module")
def result():
    return timing.run(Work(quick=True))


def reduced_scene():
    return in_hand(published_model("r", "Circle"))


def test_all_comparisons_hold(result):
    failed = [
        (c.quantity, c.difference, c.tolerance)
        for c in result.comparisons
        if not c.holds
    ]
    assert not failed


def test_solvers_agree_on_both_models(result):
    agreements = [c for c in result.comparisons if "beside" in c.quantity]
    assert {c.quantity.split(",")[0] for c in agreements} == {"reduced", "distributed"}
    assert {c.quantity.split()[-1] for c in agreements} == {"LSODA", "Radau"}


def test_table_holds_the_published_times(result):
    table = result.tables[0]
    published = facts.published_table("timing")
    assert [row[0] for row in table.rows] == list(published)
    for row in table.rows:
        assert tuple(row[4:7]) == tuple(published[row[0]].values())
        assert all(float(value.split()[0]) > 0.0 for value in row[1:4])


def test_a_quick_look_quotes_no_ratio(result):
    assert "LSODA" not in result.verdict and "ms" in result.verdict


def test_machine_is_stated(result):
    assert {"cpus", "platform", "numpy", "scipy", "numba"} <= result.numbers[
        "machine"
    ].keys()


def test_window_continues_the_run():
    # Begun in the middle of the run, a window ends where the run that was not cut ends.
    whole = Window.of(reduced_scene(), 0.0, 0.45)
    part = Window.of(reduced_scene(), 0.4, 0.45)
    expected, _ = whole.ours(rtol=1e-8, atol=1e-7)
    found, _ = part.ours(rtol=1e-8, atol=1e-7)
    np.testing.assert_allclose(
        found.poses, expected.poses[-len(part.ends) :], rtol=0.0, atol=1e-9
    )
    assert abs(found.poses[-1, 1] - found.poses[0, 1]) > 1e-3  # it slips


def test_window_is_what_simulate_does():
    scene = reduced_scene()
    found, statistics = Window.of(scene, 0.0, 0.4).ours(
        rtol=scene.rtol, atol=scene.atol
    )
    solution = pf.simulate(scene, t_end=0.4)
    np.testing.assert_allclose(
        found.poses[-1, :2],
        [solution.data.x[-1], solution.data.y[-1]],
        rtol=0.0,
        atol=1e-12,
    )
    assert statistics.steps == solution.statistics.steps


def test_published_baseline_finds_the_same_motion():
    window = Window.of(reduced_scene(), *runs.BREAKAWAY)
    general = window.general(**LSODA)
    reference = window.ours(rtol=1e-9, atol=1e-8)[0]
    # its absolute tolerance of 1e-8 m is a percent of a bristle
    assert runs.position_error(general.poses, reference.poses) < 1e-6
    assert general.evaluations > 0


def test_errors_fall_with_the_tolerance():
    problem = runs.problems(Work(quick=True))[0]
    reference = runs.reference(problem, Work())
    errors = [
        runs.position_error(runs.solve(problem, "RODAS4", t).poses, reference)
        for t in (1e-3, 1e-5, 1e-7)
    ]
    assert errors[0] > errors[1] > errors[2]


def test_cheapest():
    points = [(1e-3, [0.1]), (1e-6, [2.0]), (1e-7, [1.5])]
    assert runs.cheapest(points, 1e-5) == [1.5]
    assert runs.cheapest(points, 1e-8) is None
