"""Controllers in the rig: parts are held with less grip than by the published rule, and slip as far as they shall."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from planarfriction.online import FrictionObserver, Gripper, Hinge, Hold, Measurement, Parts, SlideBy, TurnBy
from planarfriction.online.controllers import trapezoid
from planarfriction.online.trials import known_model, random_parts, trial

COUNT = 4


def few(**changes) -> Parts:
    return dataclasses.replace(random_parts(COUNT, 3, 1), **changes)


def test_parts_are_held_with_less_grip_than_by_the_rule():
    ours, rule = (trial("hold", few(), 0.0, 1.0, ours=own, seed=0) for own in (True, False))
    assert ours["grip"].sum() < 0.9 * rule["grip"].sum()
    assert np.hypot(*ours["later"][:, :2].T).max() < 1e-3  # taps and a tilt
    assert np.abs(ours["slip"][:, 2]).max() < np.radians(15.0)  # the exploration
    assert np.isfinite(ours["first"][:, 0]).all()
    assert np.abs(ours["first"][:, 0]).max() < 0.25
    assert (ours["late"] <= 0.02).all()


def test_parts_slide_as_far_as_they_shall():
    parts = few(centre=((0.0, -0.01),) * COUNT, tap=(0.0, 0.0, 0.0), tilt=0.0)
    slip = trial("slide", parts, -0.02, 1.0, ours=True, seed=0)["slip"]
    assert slip[:, 1] == pytest.approx(-0.02, abs=1.5e-3)


def test_a_part_turns_as_far_as_it_shall():
    parts = few(centre=((0.025, 0.0),) * COUNT, tap=(0.0, 0.0, 0.0), tilt=0.0, mu_ratio=1.0)
    slip = trial("turn", parts, np.radians(-45.0), 1.0, ours=True, seed=0)["slip"]
    assert np.median(np.abs(slip[:, 2] - np.radians(-45.0))) < np.radians(2.0)


def test_a_hinge_lets_the_part_hang():
    parts = few(centre=((0.0, -0.05),) * COUNT, tap=(0.0, 0.0, 0.0), tilt=1.2, tilt_time=0.3, tilt_duration=1.0)
    gripper = Gripper(parts, 20.0)
    hinge, sample = Hinge(FrictionObserver(known_model(), batch=COUNT)), gripper.measurement
    for _ in range(1800):
        sample = gripper.step(hinge.update(sample))
    assert (gripper.slip[:, 2] < -0.6).all()  # half of the turn and more: friction holds the rest
    assert np.hypot(*gripper.slip[:, :2].T).max() < 0.05


def test_the_trapezoid_is_the_integral_of_its_speed():
    time = np.linspace(-0.5, 3.0, 3501)
    place, speed, push = trapezoid(time, 0.03, 2.0)
    assert place[-1] == pytest.approx(0.03)
    assert np.abs(np.gradient(place, time) - speed).max() < 1e-4
    assert np.cumsum(push)[-1] * 1e-3 == pytest.approx(0.0, abs=1e-4)
    assert speed.max() == pytest.approx(0.02)


def test_bad_samples_keep_the_grip_finite():
    hold = Hold(FrictionObserver(known_model()), explore=0.0)
    for k in range(100):
        bad = k % 10 == 9
        sample = Measurement(1e-3 * k, (0.0, np.nan if bad else 1.0, 0.0), np.nan if bad else 5.0)
        force = float(hold.update(sample))
        assert np.isfinite(force)
    assert 1.0 / 0.52 < force < hold.most


def test_wrong_settings_are_refused():
    observer = FrictionObserver(pf.ReducedModel(pf.ContactPatch.disc(0.005, 9), pf.LuGre()))
    with pytest.raises(InvalidValueError, match="observer must be a FrictionObserver"):
        Hold(None)
    with pytest.raises(InvalidValueError, match=r"probability must be between 0 and 0\.5"):
        Hold(observer, probability=0.7)
    with pytest.raises(InvalidValueError, match="goal must be finite and not zero"):
        SlideBy(observer, 0.0)
    with pytest.raises(InvalidValueError, match=r"goal must have shape \[\], got shape \[0\]"):
        TurnBy(observer, [])
    with pytest.raises(InvalidValueError, match=r"measurement must be a Measurement, got 5\.0"):
        Hinge(observer).update(5.0)
    with pytest.raises(InvalidValueError, match="duration must be"):
        TurnBy(observer, 1.0, duration=-1.0)
    with pytest.raises(InvalidValueError, match="reserve must be"):
        Hinge(observer, reserve=0.0)


@pytest.mark.parametrize("speed, place", [(0.0, 0.0), (0.02, 0.004), (0.005, 0.006)])
def test_the_grip_of_a_slip_is_what_balances_less_what_accelerates(speed, place):
    observer = FrictionObserver(known_model(), batch=1)
    slide = SlideBy(observer, -0.02)
    sample = Measurement([1.0], [[0.0, 1.0, 0.0]], [4.0], [[0.0, -speed, 0.0]])
    slide.estimate = observer.update(sample)._replace(slip=np.ones(1))
    slide.balance[:], slide._began[:], slide._time[:] = 4.0, 0.5, 1.0
    slide.velocity, slide.slid = np.array([[0.0, -speed, 0.0]]), np.array([[0.0, -place, 0.0]])
    wished, wished_speed, push = trapezoid(1.0 + slide.delay - 0.5, 0.02, 2.0)
    a = push + 8.0 * (wished_speed - speed) + 16.0 * (wished - place - speed * slide.delay)
    assert abs(a) < 0.25 * slide.acceleration
    assert slide._grip(np.ones(1), np.zeros(1)) == pytest.approx(4.0 * (1.0 - a / slide.acceleration))


def observed(controller, *, slips, wrench=(0.0, 1.0, 0.0)):
    """The controller after a sample of one part that slips or sticks; its clock has run for a second."""
    sample = Measurement([1.0], [wrench], [4.0])
    controller.estimate = controller.observer.update(sample)._replace(slip=np.full(1, float(slips)))
    controller.wrench, controller._time, controller._age = np.array([wrench]), np.ones(1), np.ones(1)
    return controller


@pytest.mark.parametrize("place, caught", [(0.0195, True), (0.018, False)])
def test_a_part_that_sticks_near_its_goal_is_left_there(place, caught):
    slide = observed(SlideBy(FrictionObserver(known_model(), batch=1), -0.02), slips=False)
    slide.balance[:], slide._began[:], slide._since[:] = 4.0, 0.5, 0.2
    slide.slid = np.array([[0.0, -place, 0.0]])
    slide._grip(np.ones(1), np.full(1, 1e-3))
    assert slide.caught.tolist() == [caught]


@pytest.mark.parametrize("torque, falls", [(0.02, True), (2e-4, False)])
def test_a_hinge_releases_what_does_not_hang_yet(torque, falls):
    hinge = observed(Hinge(FrictionObserver(known_model(), batch=1)), slips=False, wrench=(0.0, 1.0, torque))
    hinge._found[:], hinge._force[:], hinge._torque[:], hinge._since[:] = True, 1.0, torque, 0.2
    first = hinge._grip(np.ones(1), np.full(1, 1e-3))
    for _ in range(100):
        last = hinge._grip(np.ones(1), np.full(1, 1e-3))
    assert last / first == pytest.approx(np.exp(-0.1) if falls else 1.0, rel=1e-6)
