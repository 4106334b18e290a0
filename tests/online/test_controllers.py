"""Controllers in the rig: parts are held with less grip than by the published rule, and slip as far as they shall."""

import dataclasses

import numpy as np
import pytest

from planarfriction.online import (
    FrictionObserver,
    Hinge,
    Hold,
    Measurement,
    SlideBy,
    TurnBy,
)
from planarfriction.online.loops import friction_filter, grips
from planarfriction_studies.rig import Gripper
from planarfriction_studies.rig.trials import known_model, random_parts, trial

COUNT = 4


def few(**changes):
    return dataclasses.replace(random_parts(COUNT, 3, 1), **changes)


def test_parts_are_held_with_less_grip_than_by_the_rule():
    ours, rule = (
        trial("hold", few(), 0.0, 1.0, ours=own, seed=0) for own in (True, False)
    )
    assert ours["grip"].sum() < 0.9 * rule["grip"].sum()
    assert np.hypot(*ours["later"][:, :2].T).max() < 1e-3  # taps and a tilt
    assert np.abs(ours["slip"][:, 2]).max() < np.radians(15.0)  # the exploration
    assert np.isfinite(ours["first"]).all()
    # Errors of the logs of mu_c, mu_s and radius.
    assert np.abs(ours["first"][:, :, 0]).max() < 0.3
    assert (ours["late"] <= 0.02).all()


@pytest.mark.parametrize(
    "changes",
    [{"mu_ratio": 1.15, "delay": 0.035}, {"mass": (0.105,) * COUNT, "delay": 0.03}],
)
def test_parts_slide_as_far_as_they_shall(changes):
    """Parts that jump 4 mm and more when they break loose, and light ones, whose load seems to fall with the grip."""
    parts = few(
        centre=((0.0, -0.01),) * COUNT, tap=(0.0, 0.0, 0.0), tilt=0.0, **changes
    )
    slip = trial("slide", parts, -0.02, 1.0, ours=True, seed=0)["slip"]
    assert slip[:, 1] == pytest.approx(-0.02, abs=1e-3)


def test_a_part_turns_as_far_as_it_shall():
    parts = few(
        centre=((0.025, 0.0),) * COUNT, tap=(0.0, 0.0, 0.0), tilt=0.0, mu_ratio=1.0
    )
    slip = trial("turn", parts, np.radians(-45.0), 1.0, ours=True, seed=0)["slip"]
    assert np.median(np.abs(slip[:, 2] - np.radians(-45.0))) < np.radians(2.0)


def test_a_hinge_lets_the_part_hang():
    parts = few(
        centre=((0.0, -0.05),) * COUNT,
        tap=(0.0, 0.0, 0.0),
        tilt=1.2,
        tilt_time=0.3,
        tilt_duration=1.0,
    )
    gripper = Gripper(parts, 20.0)
    hinge = Hinge(FrictionObserver(known_model(), batch=COUNT))
    sample = gripper.measurement
    for _ in range(1800):
        sample = gripper.step(hinge.update(sample))
    assert (
        gripper.slip[:, 2] < -0.6
    ).all()  # half of the turn and more: friction holds the rest
    assert np.hypot(*gripper.slip[:, :2].T).max() < 0.05


@pytest.mark.parametrize("load", [0.0, 0.2])
@pytest.mark.parametrize(
    "kind, options",
    [(Hold, {}), (Hinge, {}), (SlideBy, {"goal": -0.02}), (TurnBy, {"goal": -0.5})],
)
def test_a_controller_begins_when_the_hand_grips(kind, options, load):
    """Samples of a hand that the observer calls empty, which show the bias, change nothing but that."""
    grips = []
    for each in (lambda own: own.observer, lambda own: own):
        gripper = Gripper(few(delay=0.005), 20.0, seed=1)
        own = kind(
            FrictionObserver(known_model(), batch=COUNT, least_load=0.1 + 1.5 * load),
            **options,
        )
        for sample in gripper.empty_hand():
            each(own).update(sample._replace(normal_force=sample.normal_force + load))
        sample = gripper.measurement
        for _ in range(300):
            sample = gripper.step(own.update(sample))
        grips.append(gripper.normal_force)
    assert grips[0] == pytest.approx(grips[1], rel=1e-9)


def watch(control, gripper, change, steps):
    """Let a controller see an empty hand, then hold parts, with samples that are changed."""
    for sample in gripper.empty_hand():
        control.observer.update(sample)
    sample = gripper.measurement
    for k in range(steps):
        sample = gripper.step(control.update(change(k, sample)))


def held(make, change=lambda k, sample: sample, steps=1800):
    """Controller and gripper after parts hung still from hands whose samples are changed."""
    gripper = Gripper(few(tap=(0.0, 0.0, 0.0), tilt=0.0), 20.0, seed=1)
    control = make(FrictionObserver(known_model(), batch=COUNT))
    watch(control, gripper, change, steps)
    return control, gripper


KINDS = {
    "hold": Hold,
    "slide": lambda own: SlideBy(own, -0.02),
    "turn": lambda own: TurnBy(own, -0.5),
    "hinge": Hinge,
}
DEAD = {"stuck": 0.0, "silent": np.nan}


@pytest.mark.parametrize("make", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("velocity", DEAD.values(), ids=DEAD)
def test_a_dead_slip_sensor_drops_nothing(make, velocity):
    control, gripper = held(
        make, lambda k, s: s._replace(slip_velocity=s.slip_velocity * 0.0 + velocity)
    )
    assert np.hypot(*gripper.slip[:, :2].T).max() < 5e-3
    assert control.blind.all()
    assert (
        gripper.normal_force > 1.5 * control.state["load"] / 0.52
    ).all()  # by the least friction of the prior


@pytest.mark.parametrize(
    "kind, goal, centre", [(SlideBy, -0.02, (0.0, -0.01)), (TurnBy, -0.8, (0.025, 0.0))]
)
def test_a_slip_sensor_that_dies_in_a_slip_drops_nothing(kind, goal, centre):
    """It says 0 from a share of the way on, another of each part."""
    gripper = Gripper(
        few(centre=(centre,) * COUNT, tap=(0.0, 0.0, 0.0), tilt=0.0), 20.0, seed=1
    )
    control = kind(FrictionObserver(known_model(), batch=COUNT), goal)
    dead = np.zeros(COUNT, bool)

    def dies(_, sample):
        dead[gripper.slip[:, kind.axis] / goal > np.linspace(0.1, 0.8, COUNT)] = True
        sample.slip_velocity[dead] *= 0.0
        return sample

    watch(control, gripper, dies, 3000)
    assert (dead & control.blind).all()
    assert np.hypot(*gripper.slip[:, :2].T).max() < (0.025 if kind is SlideBy else 5e-3)
    assert np.abs(gripper.slip[:, 2]).max() < 0.9
    assert (gripper.normal_force > 1.5 * control.state["load"] / 0.52).all()


@pytest.mark.parametrize("fault", ["dies", "tap"])
def test_a_hinge_whose_slip_sensor_dies_drops_nothing(fault):
    """It says 0 from a share of the turn on, another of each part; a tap is no such fault."""
    taps = (
        {"tap": (0.3, 0.3, 2e-3), "tap_time": 2.2}
        if fault == "tap"
        else {"tap": (0.0, 0.0, 0.0)}
    )
    parts = few(
        centre=((0.0, -0.045),) * COUNT,
        tilt=1.3,
        tilt_time=0.5,
        tilt_duration=2.0,
        **taps,
    )
    gripper = Gripper(parts, 30.0, seed=1)
    control = Hinge(FrictionObserver(known_model(), batch=COUNT))
    dead = np.zeros(COUNT, bool)

    def dies(_, sample):
        far = gripper.slip[:, 2] / -1.3 > np.linspace(0.1, 0.7, COUNT)
        dead[far] = fault == "dies"
        sample.slip_velocity[dead] *= 0.0
        return sample

    watch(control, gripper, dies, 3500)
    assert dead.all() == control.blind.all() == (fault == "dies")
    assert np.hypot(*gripper.slip[:, :2].T).max() < 0.03
    assert np.abs(gripper.slip[:, 2]).max() < 1.5
    assert np.abs(gripper.twist).max() < 1e-2  # creep of bristles near the limit


@pytest.mark.parametrize("make", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("wrong", [0.0, 300.0])
def test_one_wrong_load_is_not_the_grip(make, wrong):
    """The last sample before the filters have settled."""
    right, _ = held(make, steps=40)
    control, _ = held(
        make,
        lambda k, s: (
            s._replace(normal_force=s.normal_force * 0.0 + wrong) if k == 29 else s
        ),
        40,
    )
    assert control.state["grip"] == pytest.approx(right.state["grip"], rel=0.02)


def test_a_wrong_sign_holds_by_the_least_friction():
    control, gripper = held(Hold, lambda k, s: s._replace(wrench=-s.wrench))
    assert (control.estimate.flags == 16).any()
    assert np.hypot(*gripper.slip[:, :2].T).max() < 5e-3


def test_the_trapezoid_is_the_integral_of_its_speed():
    time = np.linspace(-0.5, 3.0, 3501)
    place, speed, push = grips.trapezoid.py_func(np, time, 0.03, 2.0)
    assert place[-1] == pytest.approx(0.03)
    assert np.abs(np.gradient(place, time) - speed).max() < 1e-4
    assert np.cumsum(push)[-1] * 1e-3 == pytest.approx(0.0, abs=1e-4)
    assert speed.max() == pytest.approx(0.02)


def test_bad_samples_keep_the_grip_finite():
    hold = Hold(FrictionObserver(known_model()), explore=0.0, most=20.0)
    for k in range(100):
        bad = k % 10 == 9
        sample = Measurement(
            1e-3 * k, (0.0, np.nan if bad else 1.0, 0.0), np.nan if bad else 5.0
        )
        force = float(hold.update(sample))
        assert np.isfinite(force)
    assert 1.0 / 0.52 < force < 20.0


@pytest.mark.parametrize("load", [0.0, 0.05, np.nan])
@pytest.mark.parametrize(
    "start, most, grip", [(20.0, 60.0, 20.0), (8.0, 60.0, 8.0), (20.0, 15.0, 15.0)]
)
def test_an_empty_hand_is_asked_for_the_starting_grip(
    observer, load, start, most, grip
):
    hold = Hold(observer, start=start, most=most)
    for k in range(3):
        assert hold.update(
            Measurement([1e-3 * k], [(0.0, 0.0, 0.0)], [load])
        ).tolist() == [grip]


def test_a_clock_that_is_set_back_does_not_stop_a_grip(observer):
    hold = Hold(observer)
    for now in (np.inf, *(1e-3 * np.arange(300)), *(-5.0 + 1e-3 * np.arange(100))):
        hold.update(Measurement([now], [(0.0, 1.0, 0.0)], [5.0]))
    assert hold.state["age"] == pytest.approx(0.388, abs=2e-3)  # all but ten samples


def found(count=1, **changes):
    """Estimate of a part that slips under 1 N, a millisecond after the sample before."""
    one = np.zeros(count, friction_filter.ESTIMATE)
    given = {
        "mu_c": 0.5,
        "radius": 5e-3,
        "slip": 1.0,
        "gauge": 0.25,
        "dt": 1e-3,
        "normal_force": 4.0,
        "seen": 1,
    }
    for name, value in (
        given | {"wrench": (0.0, 1.0, 0.0), "velocity": np.nan} | changes
    ).items():
        one[name] = value
    return one


def gripped(controller, changes, **state):
    """The next grip of one part in a state whose filters have settled."""
    for name, value in (
        {"age": 1.0, "span": 0.0, "start": 50.0, "grip": 10.0} | state
    ).items():
        controller.state[name] = value
    controller._grip(controller.state, found(**changes), *controller._settings)
    return float(controller.state["grip"][0])


LEAST_MU = 0.52 * np.exp(-3.0902 * 0.32)
"""Friction of the model less 3.1 standard deviations."""


@pytest.mark.parametrize("make", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize(
    "absent", ["wrench", "load", "frozen load", "frozen slip", "weight"]
)
def test_an_absent_measurement_keeps_the_load_and_raises_the_grip(
    observer, make, absent
):
    """What is not there; a load that does not follow the grip, a frozen velocity, a wrench below half of the weight."""
    control = make(observer)
    wrench = {"wrench": (0.0, np.nan, 0.0), "weight": (0.0, 0.45, 0.0)}.get(
        absent, (0.0, 1.0, 0.0)
    )
    velocity = (0.0, -2e-3 * (absent == "frozen slip"), 0.0)
    sample = {
        "seen": int(absent not in ("wrench", "load")),
        "slip": 0.0,
        "velocity": velocity,
        "wrench": wrench,
    }
    known = {
        "load": 2.0,
        "lately": 2.0,
        "weight": 2.0,
        "pressed": 8.0,
        "weighed": 1.0,
        "pulls": 1.0,
        "grip": 8.0,
    }
    known |= {
        "usual": 2.0,
        "felt": 4.0,
        "sent": 8.0 if absent != "frozen load" else 12.0,
        "still": 0.2,
    }
    gripped(control, sample, **known)
    for _ in range(120):
        control._grip(control.state, found(**sample), *control._settings)
    assert control.state["grip"] == pytest.approx(1.2 * 2.0 / LEAST_MU, rel=1e-3)
    assert control.blind.all()


def test_the_grip_does_not_fall_while_a_measurement_is_absent(observer):
    hold = Hold(observer)  # it would fall by a thousandth in a step
    assert (
        gripped(hold, {"seen": 0, "slip": 0.0}, load=2.0, lately=2.0, weight=2.0)
        == 10.0
    )
    assert gripped(
        hold, {"slip": 0.0}, load=2.0, lately=2.0, weight=2.0
    ) == pytest.approx(10.0 * np.exp(-1e-3))


@pytest.mark.parametrize(
    "spin, usual, absent", [(0.1, 2.0, True), (3.0, 2.0, False), (0.1, 1.4, False)]
)
def test_a_part_that_loses_a_third_of_its_load_slips_fast_or_a_sensor_is_wrong(
    observer, spin, usual, absent
):
    """1 N on a part that slips at 0.5 or 15 mm/s, and needs a half or two thirds of the grip that it needed of late."""
    turn = TurnBy(observer, -0.8)
    gripped(
        turn,
        {"slip": 0.0},
        velocity=(0.0, 0.0, -spin),
        usual=usual,
        pressed=4.0,
        lately=2.0,
    )
    assert (turn.state["mute"] > 0.0).tolist() == [absent]


@pytest.mark.parametrize("span, overdue", [(0.018, False), (0.022, True)])
def test_the_grip_does_not_fall_while_a_slip_velocity_is_overdue(
    observer, span, overdue
):
    """Two and a half periods of the 120 Hz at which they come are 21 ms."""
    slide = SlideBy(observer, -0.02)
    grip = gripped(slide, {}, balance=4.0, began=0.5, span=span)
    assert grip == 10.0 if overdue else grip < 10.0
    assert slide.blind.tolist() == [overdue]


@pytest.mark.parametrize("speed, moves", [(1e-3, True), (1e-5, False)])
def test_a_hinge_moves_if_its_slip_sensor_counts(observer, speed, moves):
    hinge = Hinge(observer)
    gripped(hinge, {}, found=1.0, velocity=(0.0, -speed, 0.0), since=0.0)
    assert (hinge.state["since"] == 0.0).tolist() == [moves]


@pytest.mark.parametrize(
    "name, velocity, sticks",
    [
        ("right", lambda k: (0.0, -2e-3 - 1e-4 * (k % 2), 0.0), False),
        ("frozen", lambda k: (0.0, -2e-3, 0.0), True),
        ("a thousandth", lambda k: (0.0, -2e-5 - 1e-6 * (k % 2), 0.0), True),
        (
            "blind along the load",
            lambda k: (2e-3 + 1e-4 * (k % 2), 0.0, 0.3 + 0.1 * (k % 2)),
            True,
        ),
        ("sign", lambda k: (0.0, 2e-3 + 1e-4 * (k % 2), 0.0), True),
    ],
)
def test_a_slip_velocity_counts_along_the_wrench_and_if_it_changes(
    observer, name, velocity, sticks
):
    slide = SlideBy(observer, -0.02)
    for k in range(20):
        gripped(slide, {"velocity": velocity(k), "wrench": (0.0, 1.0, 0.0)})
    assert (slide.state["quiet"] > 0.01).all() == sticks


@pytest.fixture(scope="module")
def observer():
    return FrictionObserver(known_model(), batch=1)


@pytest.mark.parametrize("speed, place", [(0.0, 0.0), (0.02, 0.004), (0.005, 0.006)])
def test_the_grip_of_a_slip_is_what_balances_less_what_accelerates(
    observer, speed, place
):
    slide = SlideBy(observer, -0.02)
    delay = 0.02
    top = 9.81
    wished, wished_speed, push = grips.trapezoid.py_func(np, 0.5 + delay, 0.02, 2.0)
    a = push + 8.0 * (wished_speed - speed) + 16.0 * (wished - place - speed * delay)
    assert abs(a) < 0.25 * top
    state = {
        "balance": 4.0,
        "began": 0.499,
        "slid": (0.0, -place, 0.0),
        "velocity": (0.0, -speed, 0.0),
    }
    assert gripped(slide, {}, **state) == pytest.approx(4.0 * (1.0 - a / top))
    follows = (
        20.0 * (speed - wished_speed - 2.0 * (wished - place - speed * delay)) * 1e-3
    )
    assert np.log(slide.state["balance"][0] / 4.0) == pytest.approx(follows)


@pytest.mark.parametrize(
    "kind, goal, near, dips",
    [
        (SlideBy, 0.02, 5e-4, False),
        (SlideBy, 0.02, 2e-3, True),
        (TurnBy, 0.8, 0.015, False),
        (TurnBy, 0.8, 0.05, True),
    ],
)
def test_a_part_that_sticks_near_its_goal_is_left_or_dips(
    observer, kind, goal, near, dips
):
    slips = kind(observer, -goal)
    slid = np.zeros(3)
    slid[kind.axis] = near - goal
    gripped(
        slips,
        {"slip": 0.0},
        balance=4.0,
        began=0.5,
        since=0.2,
        caught=1.0,
        slid=tuple(slid),
    )
    assert (slips.state["dipped"] == 0.0).tolist() == [dips]


@pytest.mark.parametrize("torque, falls", [(0.02, True), (2e-4, False)])
def test_a_hinge_releases_what_does_not_hang_yet(observer, torque, falls):
    hinge = Hinge(observer)
    sample = {"slip": 0.0, "velocity": 0.0, "wrench": (0.0, 1.0, torque)}
    first = gripped(hinge, sample, found=1.0, force=1.0, torque=torque, since=0.2)
    for _ in range(100):
        hinge._grip(hinge.state, found(**sample), *hinge._settings)
    # Or one sample of 100 later.
    assert hinge.state["grip"] / first == pytest.approx(
        np.exp(-0.1) if falls else 1.0, rel=2e-3
    )


def test_a_slip_velocity_is_the_mean_since_the_one_before(observer):
    slide = SlideBy(observer, -0.02)
    gripped(slide, {"velocity": (0.0, -0.01, 2.0)}, span=0.007)
    assert slide.state["slid"][0] == pytest.approx((0.0, -0.01 * 0.008, 2.0 * 0.008))
