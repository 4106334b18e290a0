"""C libraries of models whose shape follows the load."""

import shutil
import subprocess

import numpy as np
import pytest

from planarfriction.export import pieces
from tests.support.c_libraries import library, run, run_steady, samples
from tests.support.refusals import refused

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


def ladder(made):
    return pieces.ladder_of(getattr(made.model, "reduction", made.model).patch)


def inputs(made, load):
    state, twist, _, dt = samples(made.model, made.kind, len(load))
    return [state, twist, load.astype(made.kind).astype(float), dt]


def misfit(made, given):
    """Return errors of wrenches [count] in the largest per load."""
    _, wrench = made.model.step(*given)
    per_load = 1.0 / np.array([1.0, 1.0, 0.01]) / given[2][:, None]
    return (np.abs(run(made, given)[1] - wrench) * per_load).max(axis=1) / np.abs(
        wrench * per_load
    ).max()


@pytest.mark.parametrize(
    ("name", "precision"),
    [("soft", "double"), ("soft", "float"), ("soft layer", "double")],
)
def test_steps(name, precision):
    """On rungs, steps are those of the model; between them, shapes are interpolated."""
    made = library(name, precision)
    rng = np.random.default_rng(0)
    rungs = ladder(made).rungs
    rungs = rungs[(rungs > 1e-2) & (rungs < 100.0)]
    exact = misfit(made, inputs(made, rng.choice(rungs, 200)))
    assert exact.max() < (1e-12 if precision == "double" else 1e-3)
    between = misfit(made, inputs(made, rng.uniform(rungs[0], rungs[-1], 300)))
    print(f"\nbetween rungs: {between.max():.1e}")
    assert 1e-7 < between.max() < 2.0 * pieces.ERROR


def test_measured_maps():
    """Rungs hold the loads of the measurements, between which shapes are exact; beyond, the last shape stays."""
    made = library("maps")
    assert {0.5, 1.0, 3.0} <= set(ladder(made).rungs)
    assert (
        misfit(
            made, inputs(made, np.random.default_rng(1).uniform(0.5, 3.0, 300))
        ).max()
        < 1e-12
    )
    twist = np.array([[0.01, 0.02, 1.0]])
    for inside, outside in ((3.0, 9.0), (0.5, 0.1)):
        wrenches = [
            run_steady(made, twist, np.array([load])) / load
            for load in (inside, outside)
        ]
        np.testing.assert_allclose(*wrenches, rtol=1e-9)


@pytest.mark.parametrize("name", ["soft", "soft layer"])
def test_slopes_by_the_load(name):
    made = library(name)
    given = inputs(made, np.random.default_rng(2).uniform(0.5, 5.0, 200))
    *_, slopes = run(made, given, slopes=True)
    step = 1e-6
    wrenches = [
        run(made, [*given[:2], given[2] + sign * step, given[3]])[1]
        for sign in (1.0, -1.0)
    ]
    wanted = (wrenches[0] - wrenches[1]) / (2.0 * step)
    off = np.abs(slopes["wrench_load"] - wanted).max(axis=1) / np.abs(wanted).max()
    assert np.quantile(off, 0.98) < 1e-7  # the others are beside rungs
    assert (
        np.abs(run(made, given)[1] / given[2][:, None] - wanted).max()
        > 1e-2 * np.abs(wanted).max()
    )


def test_the_test_that_is_written():
    folder = library("soft").folder
    subprocess.run(
        ["gcc", "-O1", "friction.c", "friction_test.c", "-o", "tested", "-lm"],
        cwd=folder,
        check=True,
    )
    subprocess.run(["./tested"], cwd=folder, check=True)
    assert "friction_twist" not in (folder / "friction.h").read_text()


def test_too_many_rungs(monkeypatch):
    monkeypatch.setattr(pieces, "MOST_RUNGS", 20)
    with refused("model must have a patch whose shape 20 loads describe"):
        ladder(library("soft"))
