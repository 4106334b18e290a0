"""Fits of joints from goals: terms, verdicts, intervals, and what is refused."""

import dataclasses

import numpy as np
import pytest

from planarfriction.joints import Drive, JointLog, Plant, identify_joint
from planarfriction.joints.goal_fit import (
    Trial,
    improves,
    result_of,
    speed_lag,
    standing,
)
from planarfriction.joints.problem import JointFitProblem, interval
from tests.support.refusals import refused

SERVO = {
    "inertia": 2e-3,
    "offset": 0.01,
    "torque_gain": 0.1,
    "back_emf": 0.03,
    "mu_c": 0.02,
    "sigma_2": 0.005,
}
PENDULUM = Plant(mass=0.4, length=0.1)


def servo_logs(values, count=4, off=True):
    """Return logs of a servo that follows waves and steps, as an encoder of 4096 steps sees it."""
    rng = np.random.default_rng(1)
    logs = []
    for i in range(count):
        t = np.cumsum(np.r_[0.0, rng.uniform(0.0045, 0.006, 500)])
        wave = (
            1.2 * np.sin((3.0 + i) * t)
            if i % 2
            else np.where((t // 0.9) % 2 > 0, 1.3, -0.8) + 0.2 * np.sin(3.0 * t)
        )
        on = np.where((t > 1.2) & (t < 2.2) & off & (i % 2 == 0), 0.0, 1.0)
        drive = Drive(float([100, 400, 200, 800][i % 4]), 7.3, 0.0029, 0.25)
        log = JointLog(
            t, np.zeros(len(t)), goal=wave, enabled=on, drive=drive, name=f"log {i}"
        )
        q = JointFitProblem(
            (log,), PENDULUM, None, ("load",) if "load" in values else ()
        ).simulated(values, [log])[0][:, 0]
        logs.append(
            dataclasses.replace(
                log, q=np.round(q * 4096 / (2.0 * np.pi)) * 2.0 * np.pi / 4096
            )
        )
    return logs


def words(fit):
    return "\n".join(map(str, fit.verdicts))


@pytest.mark.parametrize("load", [0.0, 0.2])
def test_a_load_is_claimed_where_there_is_one(load, monkeypatch):
    monkeypatch.setattr("planarfriction.joints.goal_fit.TERMS", {"load": ("load",)})
    truth = SERVO | ({"load": load} if load else {})
    fit = identify_joint(servo_logs(truth), PENDULUM)
    assert fit.terms == (("load",) if load else ())
    assert fit.error < 2e-3 and fit.errors.mean() <= fit.baseline_errors.mean()
    for name in ("inertia", "torque_gain", "back_emf"):
        assert fit.values[name] == pytest.approx(truth[name], rel=0.05)
    text = words(fit)
    assert ("not load-dependent" in text) == (load == 0.0) and "b = " in text
    assert "with the drive off: kt = " in text and "arm without mass" in text
    low, high = fit.interval("torque_gain")
    assert low < fit.torque_gain < high and "Coulomb + viscous" in fit.table()


def test_without_a_drive_off_only_the_ratio_is_known():
    fit = identify_joint(servo_logs(SERVO, off=False), PENDULUM, terms=())
    assert "only kt/R = 0.1" in words(fit) and "cannot be told apart" in words(fit)
    assert "back_emf" not in fit.values
    # Viscous friction and back-EMF.
    assert fit.values["sigma_2"] == pytest.approx(0.035, rel=0.05)


def test_a_log_that_stands_at_full_duty_is_named():
    logs = servo_logs(SERVO)
    t = logs[0].time
    stuck = dataclasses.replace(
        logs[0],
        q=np.where(t < 1.0, logs[0].q, 0.05),
        goal=np.full(len(t), 2.5),
        enabled=None,
    )
    stuck = dataclasses.replace(stuck, drive=Drive(800.0, 7.3, 0.0029), name="stuck")
    assert standing(stuck).sum() > 100 and not standing(logs[1]).any()
    fit = identify_joint([*logs, stuck], PENDULUM, terms=())
    assert "stuck: saturated and standing for" in words(
        fit
    ) and "contradicts the others" in words(fit)


@pytest.mark.parametrize("seconds, stands", [(0.05, False), (0.3, True)])
def test_a_joint_stands_from_a_tenth_of_a_second_on(seconds, stands):
    t = 0.005 * np.arange(400)
    q = np.clip(t, 0.0, 1.0) + np.clip(t - 1.0 - seconds, 0.0, None)
    assert (
        standing(
            JointLog(t, q, goal=np.full(400, 99.0), drive=Drive(800.0, 7.3, 0.0029))
        ).any()
        == stands
    )


def test_a_late_speed_is_measured():
    log = servo_logs(SERVO)[1]
    late = np.interp(log.time - 0.019, log.time, log.speed)
    assert speed_lag(dataclasses.replace(log, dq=late)) == pytest.approx(
        0.019, abs=1e-3
    )


def test_a_term_must_gain_more_than_its_scatter():
    def trial(errors, first=None):
        errors = np.array(errors)
        return Trial(
            None,
            {},
            (),
            {},
            errors,
            errors,
            (errors[:2] if first is None else np.array(first), errors[2:]),
        )

    base = trial([1.0, 2.0, 1.0, 3.0])
    assert improves(trial([0.8, 1.7, 0.8, 2.4]), base)
    assert not improves(trial([0.5, 2.4, 0.6, 3.3]), base)  # two better, two worse
    # Evenly, but as little as a wrong term may.
    assert not improves(trial([0.9, 1.8, 0.9, 2.7]), base)
    # Little where the last two were fitted.
    assert not improves(trial([0.8, 1.7, 0.8, 2.4], first=[0.9, 1.9]), base)


def test_spreads_intervals_and_words_have_their_numbers(monkeypatch):
    # A joint that hardly moves.
    monkeypatch.setattr("planarfriction.joints.goal_fit.UNRELATED", np.inf)
    t = 0.01 * np.arange(400)
    values = SERVO | {"sigma_0": 100.0, "sigma_1": 3.0}
    log = JointLog(
        t, 0.1 * np.sin(3.0 * t), dq=0.3 * np.cos(3.0 * (t - 0.02)), voltage=0.0 * t
    )
    rigid = JointFitProblem((log,), PENDULUM, None, ())
    moved = rigid.simulated(SERVO, [log])[0][:, 0]
    log = dataclasses.replace(
        log,
        q=moved + 1e-3 * np.sin(3.0 * t),
        dq=np.interp(t - 0.02, t, np.gradient(moved, t)),
    )
    folds = [
        values | {"mu_c": each, "sigma_0": 5e3 * each, "sigma_1": 2.0 + 50.0 * each}
        for each in (0.01, 0.02, 0.03)
    ]
    errors = np.array([1.0, 1.0, 1.0])
    less = np.exp([0.2, 0.3, 0.4])
    # The same but for one, that is shifted by 0.001.
    again = values | {"sigma_2": 0.006}
    kept = Trial(
        JointFitProblem((log,), PENDULUM, None, ("bristles",)),
        values,
        tuple(folds),
        again,
        errors,
        errors,
        (),
    )
    # jackknife: sqrt((n - 1)/n sum of squares); 4.30265 and 2.91999 are quantiles 0.975 and 0.95 of Student's t
    assert kept.jackknife["mu_c"] == pytest.approx(0.02 / np.sqrt(3.0), rel=1e-12)
    far = 4.30265 * 0.02 / np.sqrt(3.0)
    gain, scatter, halves = kept.gains(Trial(None, {}, (), {}, less, less, ()))
    assert (gain, scatter) == pytest.approx(
        (0.3, 2.91999 * 0.1 / np.sqrt(3.0)), rel=1e-5
    ) and halves == []
    wide = dataclasses.replace(
        kept,
        problem=kept.problem.with_terms(["load", "bristles"]),
        values=values | {"mu_c": 0.05, "load": 0.1},
    )
    halves = errors, errors
    pair = (
        dataclasses.replace(wide, halves=halves),
        dataclasses.replace(kept, halves=halves),
    )
    fit = result_of(kept, kept, {"load": pair})
    assert fit.spread["sigma_2"] == pytest.approx(0.001, rel=1e-9)
    # the load was rejected: the other level that it goes with says nothing about this one
    assert fit.spread["mu_c"] == pytest.approx(0.02 / np.sqrt(3.0), rel=1e-12)
    # Not below the least value.
    assert fit.interval("mu_c") == pytest.approx((1e-9, 0.02 + far), rel=1e-5)
    assert fit.interval("sigma_0") == pytest.approx(
        100.0 * np.exp([-50.0 * far, 50.0 * far]), rel=1e-4
    )
    assert fit.interval("sigma_2") == pytest.approx(
        (0.005 - 4.30265e-3, 0.005 + 4.30265e-3), abs=0.0, rel=1e-4
    )
    said = words(fit)
    # 0.03/0.1 and 0.03/0.1^2.
    assert "kt/R = 0.1 N m/V; with the drive off: kt = 0.3 N m/A, R = 3 Ohm" in said
    assert "all torques grow by 1.2 % for each 10 g" in said  # half of 10 g over 400 g
    # 0.58 of its value is too much for sigma_0: its term is not shown, and reaches no law
    assert (
        "bristles: not identifiable, not shown by these logs: sigma_0 = 1e+02, spread 58"
        in said
    )
    with refused("terms of the fit must be without bristles"):
        _ = fit.friction
    (text,) = [each.get_text() for each in fit.plot().axes[2].texts]
    assert text == "not shown by these logs:\nbristles"


@pytest.mark.parametrize(
    "name, bound",
    [("load", 0.95), ("offset", -2.0 * np.pi), ("sigma_0", 1e9), ("v_s", 1e-4)],
)
def test_an_estimate_at_the_bound_of_its_search_has_no_interval(name, bound):
    assert interval(name, bound, 0.1) is None
    assert interval(name, 0.9 * bound if bound != 1e-4 else 2e-4, 1e-5) is not None


OTHER_WAYS = {
    "goal in degrees": (
        lambda log: {"goal": np.degrees(log.goal)},
        "is one of them in degrees",
    ),
    "goal of the other sign": (
        lambda log: {"goal": -log.goal},
        "flip the sign of one of them",
    ),
    "times in ms": (lambda log: {"time": 1e3 * log.time}, "is it in ms"),
    "angle in degrees": (
        lambda log: {"q": np.degrees(log.q), "goal": np.degrees(log.goal)},
        "is it in degrees",
    ),
}


@pytest.mark.parametrize("name", OTHER_WAYS)
def test_goals_of_other_units_or_signs_are_refused_in_one_line(name):
    change, message = OTHER_WAYS[name]
    logs = [dataclasses.replace(log, **change(log)) for log in servo_logs(SERVO)]
    with refused(message):
        identify_joint(logs, PENDULUM)


def test_logs_that_no_run_from_their_goals_resembles_are_refused():
    logs = servo_logs(SERVO)
    mixed = [
        dataclasses.replace(one, q=other.q)
        for one, other in zip(logs, logs[1:] + logs[:1], strict=True)
    ]
    with refused(r"q of .* must follow|flip the sign"):
        identify_joint(mixed, PENDULUM, terms=())


def with_gains(gains):
    return [
        dataclasses.replace(log, drive=dataclasses.replace(log.drive, kp=kp))
        for log, kp in zip(servo_logs(SERVO), gains, strict=True)
    ]


@pytest.mark.parametrize("gain, named", [(100.0, False), (800.0, True)])
def test_a_log_with_a_wrong_gain_is_named(gain, named):
    """The run of log 0 misses by its whole swing then, and by 0.003 of it with the right gain."""
    said = words(
        identify_joint(with_gains([gain, 400.0, 200.0, 800.0]), PENDULUM, terms=())
    )
    assert ("this log contradicts the others; check its gains" in said) == named
    assert ("fit: log 0: 0." in said) == named


def test_logs_with_too_small_gains_are_refused():
    with refused("check units, signs, gains"):
        identify_joint(with_gains([800.0, 10.0, 800.0, 20.0]), PENDULUM, terms=())


@pytest.mark.parametrize("offset", [1.5, -2.5])
def test_a_pendulum_may_hang_at_any_angle(offset):
    fit = identify_joint(servo_logs(SERVO | {"offset": offset}), PENDULUM, terms=())
    low, high = fit.intervals["offset"]
    assert low <= offset <= high
    # Friction holds the joint within some degrees.
    assert fit.values["offset"] == pytest.approx(offset, abs=0.1)


REFUSED = {
    "no inertia": (lambda: identify_joint(servo_logs(SERVO, 1), Plant()), "plant must have a mass or an inertia"),
    "term alone": (
        lambda: identify_joint(servo_logs(SERVO, 1), PENDULUM, terms=("directional",)), "have load with directional",
    ),
    "term of torques": (
        lambda: identify_joint(servo_logs(SERVO, 1), PENDULUM, terms=("gravity",)), "for logs of a goal or voltage",
    ),
    "no logs": (lambda: identify_joint([], PENDULUM), "logs must be a JointLog or a list of them"),
    "progress": (lambda: identify_joint(servo_logs(SERVO, 1), PENDULUM, progress=3), "progress must be a function"),
    "no length": (lambda: Plant(mass=1.0), "length must be positive with a mass"),
    "sag": (lambda: Drive(1.0, 5.0, sag=5.0), "sag must be below supply"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_bad_input_is_refused_in_one_line(name):
    call, message = REFUSED[name]
    with refused(message):
        call()


def test_steps_are_told_and_may_end_a_fit():
    told = []

    def progress(words):
        told.append(words)
        if len(told) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        identify_joint(servo_logs(SERVO), PENDULUM, progress=progress)
    assert told[-1] == "Coulomb and viscous friction; left out: log 2"


def test_voltages_are_read_as_duty_and_supply_or_those_of_a_servo(tmp_path):
    file = tmp_path / "arm.csv"
    rows = "\n".join(
        f"{0.01 * i},{np.sin(0.1 * i)},{0.1 * i},0.5,7.0,1" for i in range(20)
    )
    file.write_text(f"Time [s],position [rad],goal [rad],duty,supply,enabled\n{rows}\n")
    np.testing.assert_allclose(JointLog.from_csv(file).volts, 3.5)
    servo = JointLog.from_csv(file, drive=Drive(2.0, 8.0, 0.5, 1.0))
    duty = np.clip(servo.goal - servo.q, -1.0, 1.0)
    np.testing.assert_allclose(servo.volts, duty * (8.0 - np.abs(duty)))
