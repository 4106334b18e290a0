"""Measured pushes followed from their start, the example of a plan, and what a push costs."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.planning import Pusher, Slider, push
from planarfriction_studies.bench import workflows
from planarfriction_studies.measured import replayed_pushes
from tests.support.repository import script


def test_measured_pushes_end_nearer_on_feet_than_on_an_ellipsoid():
    measured = replayed_pushes.pushes_in_time()
    assert len(measured) == 51
    named = [each for each in measured if "3out" in each.name]
    still = np.array([each.error(each.start) for each in named])
    feet, ellipsoid = (
        replayed_pushes.errors(named, make)
        for make in (pf.LimitSurfaceExact, pf.LimitSurfaceEllipsoid)
    )
    # nothing fitted: means over 18 pushes, 1.1 mm and 1.0 deg on the feet, 1.1 mm and 1.7 deg on the ellipsoid
    assert feet[:, 0].mean() < 0.15 * still[:, 0].mean()
    assert feet[:, 1].mean() < 0.8 * ellipsoid[:, 1].mean() < 0.5 * still[:, 1].mean()


def test_single_pushes_begin_outside_and_end_near():
    measured = [
        each for each in replayed_pushes.single_pushes() if each.board == "hardboard"
    ][::10]
    assert len(measured) == 10
    errors = replayed_pushes.errors(measured, pf.LimitSurfaceExact)
    still = np.array([each.error(each.start) for each in measured])
    assert errors[:, 0].mean() < 0.3 * still[:, 0].mean() and np.median(
        errors[:, 1]
    ) < 0.2 * np.median(still[:, 1])


def test_a_push_is_that_of_least_power_in_small_steps():
    # Peshkin and Sanderson 1989: a pusher that sticks moves the object with the least power
    surface = pf.LimitSurfaceExact(pf.ContactPatch.rectangle(0.09))
    slider = Slider(surface, 0.045 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]))
    path = pf.Signal.sampled([0.0, 1.0], [workflows.BEGIN, workflows.END], "linear")
    end = push(slider, Pusher(20.0), path, samples=2).end
    # Euler steps of half a millimetre: 1e-4 m, 3e-3 rad
    np.testing.assert_allclose(workflows.least_power(surface), end, rtol=0.0, atol=4e-3)


def test_the_example_reaches_its_pose():
    example = script("examples/push_to_a_pose.py")
    found = example.plan()
    assert found.push.end == pytest.approx(example.GOAL, abs=1e-4)
    assert found.report.sticks


def test_a_push_at_the_edge_of_its_motion_cone_goes_on():
    # on three feet one of these pushes would change its mode without end
    measured = [
        each
        for each in replayed_pushes.single_pushes()
        if each.name.startswith("wood_30_63_43")
    ]
    assert np.isfinite(replayed_pushes.errors(measured, pf.LimitSurfaceExact)).all()
