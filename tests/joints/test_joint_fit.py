"""Fits of joints: six parameters from a noisy torque, terms and verdicts from goals, and what is refused."""

import dataclasses

import numpy as np
import pytest

from planarfriction.joints import Drive, JointFit, JointFriction, JointLog, Plant, identify_joint
from planarfriction.joints.fit import improves
from planarfriction.joints.loops.runs import run_measured
from planarfriction.joints.problem import Problem
from planarfriction.joints.result import Trial, judge, speed_lag, standing

LUGRE = JointFriction(0.8, 0.3, 0.0, 0.0, 1.2, 0.05, 400.0, 2.0)
SERVO = {"inertia": 2e-3, "offset": 0.01, "torque_gain": 0.1, "back_emf": 0.03, "mu_c": 0.02, "sigma_2": 0.005}
PENDULUM = Plant(mass=0.4, length=0.1)


def torque_log(noise=0.01, seed=0):
    """Return a log of a slow wave with ripples, then fast, with noise on its torque."""
    t = 1e-3 * np.arange(12_000)
    q = 0.08 * np.sin(1.57 * t) + 0.006 * np.sin(14.5 * t) + 0.8 * np.sin(3.14 * t) * np.clip((t - 8.0) / 2.0, 0.0, 1.0)
    log, taken = JointLog(t, q, torque=np.zeros(len(t))), np.empty(len(t))
    run_measured(LUGRE.numbers, t, log.speed, np.zeros(len(t)), np.zeros(len(t)), taken)
    torque = 0.05 * log.acceleration + taken
    torque += noise * np.sqrt(np.mean(torque**2)) * np.random.default_rng(seed).normal(size=len(t))
    return JointLog(t, q, torque=torque)


def servo_logs(values, count=4, off=True):
    """Return logs of a servo that follows waves and steps, as an encoder of 4096 steps sees it."""
    rng, logs = np.random.default_rng(1), []
    for i in range(count):
        t = np.cumsum(np.r_[0.0, rng.uniform(0.0045, 0.006, 500)])
        wave = 1.2 * np.sin((3.0 + i) * t) if i % 2 else np.where((t // 0.9) % 2 > 0, 1.3, -0.8) + 0.2 * np.sin(3.0 * t)
        on = np.where((t > 1.2) & (t < 2.2) & off & (i % 2 == 0), 0.0, 1.0)
        drive = Drive(float([100, 400, 200, 800][i % 4]), 7.3, 0.0029, 0.25)
        log = JointLog(t, np.zeros(len(t)), goal=wave, enabled=on, drive=drive, name=f"log {i}")
        q = Problem((log,), PENDULUM, None, ("load",) if "load" in values else ()).simulated(values, [log])[0][:, 0]
        logs.append(dataclasses.replace(log, q=np.round(q * 4096 / (2.0 * np.pi)) * 2.0 * np.pi / 4096))
    return logs


def words(fit):
    return "\n".join(map(str, fit.verdicts))


def test_six_parameters_come_back_from_a_noisy_torque():
    fit = identify_joint(torque_log(), Plant(inertia=0.05), terms=("stribeck", "bristles"))
    names = ("mu_c", "mu_s", "v_s", "sigma_0", "sigma_1", "sigma_2")
    assert {n: getattr(fit.friction, n) for n in names} == pytest.approx(
        {n: getattr(LUGRE, n) for n in names}, rel=0.01
    )
    assert fit.unit == "N m" and fit.error < 0.01
    (log,), friction = fit.problem.logs, fit.friction
    upper, lower, side = (axes.get_lines() for axes in fit.plot().axes)
    np.testing.assert_allclose(upper[0].get_ydata(), log.torque)
    np.testing.assert_allclose(upper[2].get_ydata(), fit.torque(log))
    np.testing.assert_allclose(lower[1].get_ydata(), fit.torque(log) - log.torque)
    speed, level = side[0].get_xydata().T
    fall = (friction.mu_s - friction.mu_c) * np.exp(-((speed / friction.v_s) ** 2))
    np.testing.assert_allclose(level, friction.mu_c + fall + friction.sigma_2 * speed)
    assert speed[-1] == pytest.approx(np.abs(log.speed).max())


@pytest.mark.parametrize("load", [0.0, 0.2])
def test_a_load_is_claimed_where_there_is_one(load, monkeypatch):
    monkeypatch.setattr("planarfriction.joints.fit.TERMS", {"load": ("load",)})
    truth = SERVO | ({"load": load} if load else {})
    fit = identify_joint(servo_logs(truth), PENDULUM)
    assert fit.terms == (("load",) if load else ())
    assert fit.error < 2e-3 and fit.errors.mean() <= fit.baseline.errors.mean()
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
    assert fit.values["sigma_2"] == pytest.approx(0.035, rel=0.05)  # viscous friction and back-EMF


def test_a_log_that_stands_at_full_duty_is_named():
    logs = servo_logs(SERVO)
    t = logs[0].time
    stuck = dataclasses.replace(logs[0], q=np.where(t < 1.0, logs[0].q, 0.05), goal=np.full(len(t), 2.5), enabled=None)
    stuck = dataclasses.replace(stuck, drive=Drive(800.0, 7.3, 0.0029), name="stuck")
    assert standing(stuck).sum() > 100 and not standing(logs[1]).any()
    fit = identify_joint([*logs, stuck], PENDULUM, terms=())
    assert "stuck: saturated and standing for" in words(fit) and "contradicts the others" in words(fit)


@pytest.mark.parametrize("seconds, stands", [(0.05, False), (0.3, True)])
def test_a_joint_stands_from_a_tenth_of_a_second_on(seconds, stands):
    t = 0.005 * np.arange(400)
    q = np.clip(t, 0.0, 1.0) + np.clip(t - 1.0 - seconds, 0.0, None)
    assert standing(JointLog(t, q, goal=np.full(400, 99.0), drive=Drive(800.0, 7.3, 0.0029))).any() == stands


def test_a_late_speed_is_measured():
    log = servo_logs(SERVO)[1]
    late = np.interp(log.time - 0.019, log.time, log.speed)
    assert speed_lag(dataclasses.replace(log, dq=late)) == pytest.approx(0.019, abs=1e-3)


def test_a_term_must_gain_more_than_its_scatter():
    def trial(errors, first=None):
        errors = np.array(errors)
        return Trial(None, {}, (), {}, errors, errors, (errors[:2] if first is None else np.array(first), errors[2:]))

    base = trial([1.0, 2.0, 1.0, 3.0])
    assert improves(trial([0.8, 1.7, 0.8, 2.4]), base)
    assert not improves(trial([0.5, 2.4, 0.6, 3.3]), base)  # two better, two worse
    assert not improves(trial([0.9, 1.8, 0.9, 2.7]), base)  # evenly, but as little as a wrong term may
    assert not improves(trial([0.8, 1.7, 0.8, 2.4], first=[0.9, 1.9]), base)  # little where the last two were fitted


def test_spreads_intervals_and_words_have_their_numbers():
    t, values = 0.01 * np.arange(400), SERVO | {"sigma_0": 100.0, "sigma_1": 3.0}
    log = JointLog(t, np.sin(3.0 * t), dq=3.0 * np.cos(3.0 * (t - 0.02)), voltage=np.zeros(len(t)))
    folds = [
        values | {"mu_c": each, "sigma_0": 5e3 * each, "sigma_1": 2.0 + 50.0 * each} for each in (0.01, 0.02, 0.03)
    ]
    errors, less = np.array([1.0, 1.0, 1.0]), np.exp([0.2, 0.3, 0.4])
    again = values | {"sigma_2": 0.006}  # the same but for one, that is shifted by 0.001
    kept = Trial(Problem((log,), PENDULUM, None, ()), values, tuple(folds), again, errors, errors, ())
    # jackknife: sqrt((n - 1)/n sum of squares); 4.30265 and 2.91999 are quantiles 0.975 and 0.95 of Student's t
    assert kept.spread["mu_c"] == pytest.approx(0.02 / np.sqrt(3.0), rel=1e-12)
    assert kept.spread["sigma_2"] == pytest.approx(0.001, rel=1e-9)
    far = 4.30265 * 0.02 / np.sqrt(3.0)
    assert kept.interval("mu_c") == pytest.approx((1e-9, 0.02 + far), rel=1e-5)  # not below the least value
    assert kept.interval("sigma_0") == pytest.approx(100.0 * np.exp([-50.0 * far, 50.0 * far]), rel=1e-4)
    gain, scatter, halves = kept.gains(Trial(None, {}, (), {}, less, less, ()))
    assert (gain, scatter) == pytest.approx((0.3, 2.91999 * 0.1 / np.sqrt(3.0)), rel=1e-5) and halves == []
    wide = dataclasses.replace(kept, problem=kept.problem.with_terms(["load"]), values=values | {"mu_c": 0.05})
    fit = JointFit(**vars(kept), baseline=kept, trials={}, verdicts=())
    shifted = dataclasses.replace(fit, trials={"load": (wide, kept)}).spread  # by a fit with one term more
    assert shifted["mu_c"] == pytest.approx(np.hypot(0.02 / np.sqrt(3.0), 0.03), rel=1e-12)
    said = words(dataclasses.replace(fit, verdicts=judge(fit)))
    assert "kt/R = 0.1 N m/V; with the drive off: kt = 0.3 N m/A, R = 3 Ohm" in said  # 0.03/0.1 and 0.03/0.1^2
    assert "all torques grow by 1.2 % for each 10 g" in said  # half of 10 g over 400 g
    assert "lags by 20 ms (20 to 20)" in said
    assert "spread 58 of 1e+02" in said and "sigma_1" not in said  # 0.58 is more than half of sigma_0, less than of 3


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
    rows = "\n".join(f"{0.01 * i},{np.sin(0.1 * i)},{0.1 * i},0.5,7.0,1" for i in range(20))
    file.write_text(f"Time [s],position [rad],goal [rad],duty,supply,enabled\n{rows}\n")
    np.testing.assert_allclose(JointLog.from_csv(file).volts, 3.5)
    servo = JointLog.from_csv(file, drive=Drive(2.0, 8.0, 0.5, 1.0))
    duty = np.clip(servo.goal - servo.q, -1.0, 1.0)
    np.testing.assert_allclose(servo.volts, duty * (8.0 - np.abs(duty)))
