"""Angles that jump by whole turns, and logs without torques: mended and said, or refused; never a wrong estimate."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.cli.output import write_solution
from planarfriction.identify import Log, Slide
from planarfriction.identify.checks import Sliding
from planarfriction.identify.logs import is_mean, unwrapped
from planarfriction.identify.problem import FitOptions, LogProblem
from planarfriction.identify.sensor_errors import wrench_noise
from tests.support.identification_logs import (
    LAW,
    LOAD,
    PATCH,
    clean_log,
    excitation,
    fitted,
    noisy,
    truth,
)

TIME = np.arange(400) * 1e-2
KNOWN = {
    name: getattr(LAW, name)
    for name in ("mu_s", "v_s", "gamma", "sigma_0", "sigma_1", "sigma_2")
}
RADIUS = truth()["contact_radius"]
EXACT = 1e-9  # the wrapping itself rounds at 1e-15 rad, its slope over 1e-2 s at 1e-13 rad/s


def wrapped(angle, low=-np.pi):
    """The angle from `low` [rad] to a turn above it, as a tracker gives it."""
    return (angle - low) % (2.0 * np.pi) + low


# ---------------------------------------------------------------------- angles


@given(
    speed=st.floats(-100.0, 100.0),
    swing=st.floats(0.0, 20.0),
    low=st.sampled_from([-np.pi, 0.0, -0.3]),
    noise=st.floats(0.0, 0.1),
)
def test_whole_turns_are_put_back(speed, swing, low, noise):
    """Steps up to 1 rad from the speed, 0.35 rad from the swing: below a quarter of a turn."""
    random = np.random.default_rng(0)
    angle = (
        1.0
        + speed * TIME
        + swing * np.sin(0.5 * np.pi * TIME)
        + noise * random.uniform(-1.0, 1.0, TIME.shape)
    )
    seen = wrapped(angle, low)
    mended, turns = unwrapped(TIME, seen)
    assert np.abs(np.diff(mended) - np.diff(angle)).max() < EXACT
    assert mended[0] == seen[0]
    assert turns == np.count_nonzero(np.abs(np.diff(seen) - np.diff(angle)) > 1.0)
    assert unwrapped(TIME, mended)[1] == 0


def test_an_angle_that_rests_at_the_seam_is_put_together():
    angle = np.pi + 1e-3 * np.random.default_rng(1).standard_normal(TIME.shape)
    mended, turns = unwrapped(TIME, wrapped(angle))
    assert turns > 100
    assert np.ptp(mended) < 0.01


@pytest.mark.parametrize("speed", [0.0, 3.0, 400.0, -700.0])
def test_angles_without_jumps_stay_to_the_bit(speed):
    """Also where they turn by more than half a turn between two samples: they go on, so they are not wrapped."""
    angle = speed * TIME
    mended, turns = unwrapped(TIME, angle)
    assert turns == 0
    assert np.array_equal(mended, angle)


def test_slides_are_unwrapped_too():
    angle = 5.0 * TIME[:200]
    pose = np.stack([TIME[:200], 0.0 * angle, wrapped(angle)], -1)
    slide = Slide(TIME[:200], pose)
    assert np.abs(slide.pose[:, 2] - angle).max() < EXACT
    assert slide.turns == 2


# ---------------------------------------------------------------------- estimates


def identify(log, patch, **options):
    """Identify the model that made the logs, without effects of a rig."""
    return fitted(log, patch, model="reduced-published", nuisance=(), **options)


@pytest.fixture(scope="module")
def spun():
    """A log with a spin that goes on for four turns."""
    time, twist = excitation(duration=1.0)
    twist[:, 2] += 25.0
    return noisy(clean_log(time, twist), 3)


def poses(log):
    """The pose `[T, 3]` of the contact frame in the world, by the trapezoidal rule."""

    def summed(rates):
        steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(log.time)[:, None]
        return np.vstack([np.zeros(rates.shape[1]), np.cumsum(steps, axis=0)])

    angle = summed(log.twist[:, 2:])
    cos = np.cos(angle[:, 0])
    sin = np.sin(angle[:, 0])
    world = np.stack(
        [
            cos * log.twist[:, 0] - sin * log.twist[:, 1],
            sin * log.twist[:, 0] + cos * log.twist[:, 1],
        ],
        -1,
    )
    return np.hstack([summed(world), angle])


def test_a_wrapped_angle_gives_the_same_estimates_and_says_so(spun):
    pose = poses(spun)
    seen = pose.copy()
    seen[:, 2] = wrapped(seen[:, 2])
    logs = [
        Log.from_motion(spun.time, motion, spun.wrench, LOAD) for motion in (pose, seen)
    ]
    assert [log.turns for log in logs] == [0, 4]
    # Slopes of what is 1e-15 rad apart, over 1 ms.
    assert np.abs(logs[1].twist - logs[0].twist).max() < 1e-8 * 25.0
    options = {"parameters": ("mu_c", "contact_radius"), "start": KNOWN, "starts": 1}
    smooth, jumping = (identify(log, PATCH, **options) for log in logs)
    for name in ("mu_c", "contact_radius"):
        assert jumping.estimates[name] == pytest.approx(
            smooth.estimates[name], rel=1e-6
        )
    assert jumping.estimates["mu_c"] == pytest.approx(LAW.mu_c, rel=0.02)
    assert [str(each) for each in jumping.verdicts if "rotation" in str(each)] == [
        "fit: 4 jumps of theta by a full rotation were removed, in log"
    ]
    assert not any("rotation" in str(each) for each in smooth.verdicts)


def without_torque(log):
    return Log(
        log.time, log.twist, log.wrench * [1.0, 1.0, 0.0], log.normal_force, log.name
    )


def test_without_torques_the_force_tells_what_it_can():
    """The force of a contact that spins while it slides tells the friction and, through its loss, the radius."""
    log = noisy(clean_log(*excitation(duration=1.0)), 3)
    options = {"parameters": ("mu_c", "contact_radius"), "start": KNOWN, "starts": 1}
    found = identify(without_torque(log), PATCH, **options)
    full = identify(log, PATCH, **options)
    for name, true in (("mu_c", LAW.mu_c), ("contact_radius", RADIUS)):
        assert found.estimates[name] == pytest.approx(
            true, abs=5.0 * found.errors[name]
        )
        assert full.errors[name] < found.errors[name] < 0.01 * true
        assert found.identifiable(name)
    assert any("tau is 0 throughout" in str(each) for each in found.verdicts)
    assert (
        np.isnan(found.residuals[0][:, 2]).all()
        and np.isfinite(found.residuals[0][:, :2]).all()
    )
    assert found.to_dict()["noise"]["tau"] is None
    found.plot().draw_without_rendering()
    rounding = 1e-19 * np.random.default_rng(0).standard_normal(len(log.time))
    faint = Log(
        log.time,
        log.twist,
        without_torque(log).wrench + np.outer(rounding, [0, 0, 1]),
        log.normal_force,
    )
    assert identify(faint, PATCH, **options).estimates == pytest.approx(
        found.estimates, rel=1e-9
    )


def test_what_would_need_the_torque_is_no_estimate(spun):
    """If spin dominates, the force determines only the ratio of friction and radius."""
    options = {"parameters": ("mu_c", "contact_radius"), "start": KNOWN, "starts": 1}
    found = identify(without_torque(spun), PATCH, **options)
    assert not found.identifiable("mu_c") and not found.identifiable("contact_radius")
    ratio = found.estimates["mu_c"] / found.estimates["contact_radius"]
    assert ratio == pytest.approx(LAW.mu_c / RADIUS, rel=0.02)
    assert sum("without the torque" in str(each) for each in found.verdicts) == 2


def test_what_only_the_torque_tells_is_named():
    """A contact that turns to and fro on the spot, and hardly moves: its force tells no radius."""
    time, twist = excitation(duration=1.0)
    log = noisy(clean_log(time, twist * [1e-4, 1e-4, 5.0]), 3)
    options = {
        "parameters": ("mu_c", "contact_radius"),
        "start": KNOWN,
        "starts": 1,
        "noise": (0.02, 0.02, 1e-4),
    }
    found = identify(without_torque(log), PATCH, **options)
    assert not found.identifiable("contact_radius")
    assert (
        "contact_radius: not identifiable, only the torque depends on it, and tau is 0 throughout"
        in [str(each) for each in found.verdicts]
    )
    assert identify(log, PATCH, **options).identifiable("contact_radius")


def test_one_log_of_several_may_lack_torques(spun):
    options = {"parameters": ("mu_c", "contact_radius"), "start": KNOWN, "starts": 1}
    found = identify([spun, without_torque(spun)], PATCH, **options)
    assert found.estimates["contact_radius"] == pytest.approx(RADIUS, rel=0.01)
    assert not any("tau is 0" in str(each) for each in found.verdicts)


# ---------------------------------------------------------------------- twists that are held


def stepped(tmp_path, hold):
    """A patch that starts, turns, slides and stops, every 10 ms, with a twist that is held or joined: its file."""
    time = np.arange(301) * 1e-2
    speeds = np.interp(time, [0.0, 0.5, 1.5, 2.0], [0.0, 1.0, 1.0, 0.0])[:, None] * [
        0.01,
        0.003,
        1.0,
    ]
    model = pf.DistributedModel(PATCH, LAW)
    scene = pf.scenes.driven(model, twist=pf.Signal(time, speeds, hold), t_end=3.0)
    return write_solution(pf.simulate(scene, save_every=1e-2), tmp_path, "log")[1]


@pytest.mark.parametrize(("hold", "held"), [("previous", True), ("linear", False)])
def test_a_log_knows_if_its_twists_are_means(tmp_path, hold, held):
    """The angle beside them shows it: read otherwise, the law that made the log leaves ten times the squares."""
    log = Log.from_csv(stepped(tmp_path, hold))
    assert log.held == held
    known = np.array([LAW.mu_c, LAW.mu_s])
    left = []
    for each in (log, dataclasses.replace(log, held=not held)):
        problem = LogProblem(
            [each],
            PATCH,
            ("mu_c", "mu_s"),
            LAW,
            FitOptions(nuisance=(), refine=4),
            "distributed",
        )
        left.append(
            np.square(
                problem.residual(known, problem.even_sigma(wrench_noise([log])))
            ).mean()
        )
    assert 10.0 * left[0] < left[1]


def test_a_wrapped_angle_shows_means_too():
    """As a tracker gives it, from -pi to pi: of means, and of spins at the samples' own instants."""
    omega = 5.0 + np.sin(7.0 * TIME)
    assert is_mean(
        TIME, omega, wrapped(np.concatenate([[0.0], np.cumsum(omega[1:] * 1e-2)]))
    )
    assert not is_mean(
        TIME, omega, wrapped(5.0 * TIME + (1.0 - np.cos(7.0 * TIME)) / 7.0)
    )


@pytest.mark.parametrize("cell", ["", "n/a", "inf"])
@pytest.mark.parametrize(
    ("cells", "held"), [(slice(5, 6), True), (slice(1, None), False)]
)
def test_an_angle_that_is_no_number_is_ignored(tmp_path, cell, cells, held):
    """Beside a twist it is a column like any other; what there is of it still shows means."""
    path = stepped(tmp_path, "previous")
    lines = [
        line.split(",")
        for line in path.read_text().splitlines()
        if not line.startswith("#")
    ]
    at = next(i for i, name in enumerate(lines[0]) if name.split(" ")[0] == "theta")
    for line in lines[cells]:
        line[at] = cell
    path.write_text("\n".join(",".join(line) for line in lines))
    assert Log.from_csv(path).held == held


SPIN = np.linspace(1.0, 2.0, 50)
"""Spin of a log [rad/s]."""


def turning(**more):
    """A log that turns ever faster."""
    twist = SPIN[:, None] * [0.0, 0.0, 1.0]
    wrench = np.full((50, 3), -0.1)
    return Log(TIME[:50], twist, wrench, 1.0, **more)


@pytest.mark.parametrize(
    ("held", "angle"), [(True, SPIN[1:].sum() * 1e-2), (False, 1.5 * 0.49)]
)
def test_checks_know_how_far_a_held_log_has_turned(held, angle):
    """The sum of means, or the trapezoid."""
    assert Sliding.of(turning(held=held), PATCH, 0.01).turned[-1] == pytest.approx(
        angle, rel=1e-12
    )
