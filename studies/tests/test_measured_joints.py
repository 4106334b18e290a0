"""Friction of a servo from its eight logs: the numbers of the page, and the command."""

import numpy as np
import pytest

from planarfriction.cli import main
from planarfriction.joints import identify_joint
from planarfriction.joints.goal_fit import speed_lag
from planarfriction_studies.measured.joints import PENDULUM, read_logs
from planarfriction_studies.measured.synthetic_joints import ENCODER, synthetic_joint


@pytest.fixture(scope="module")
def logs():
    return read_logs()


def test_logs_are_those_of_the_notice(logs):
    assert [len(log.time) for log in logs] == [
        1124,
        1116,
        1513,
        1110,
        1125,
        1123,
        1509,
        1110,
    ]
    assert [log.drive.kp for log in logs] == [100, 100, 200, 200, 400, 400, 800, 800]
    lags = [speed_lag(log) for log in logs]
    assert min(lags) >= 0.017 and max(lags) <= 0.024  # the servo reports its speed late
    assert [bool((log.on == 0.0).any()) for log in logs] == [
        False,
        False,
        True,
        False,
        False,
        False,
        True,
        False,
    ]


@pytest.mark.slow
def test_a_load_explains_the_logs(logs):
    """0.045 rad without, below 0.031 with a load, when all eight are fitted."""
    plain, loaded = (
        identify_joint(logs, PENDULUM, terms=terms) for terms in ((), ("load",))
    )
    assert plain.error == pytest.approx(0.0447, abs=1e-3) and loaded.error < 0.031
    assert loaded.errors.mean() < 0.8 * plain.errors.mean()
    assert np.isclose(loaded.values["load"], 0.19, atol=0.03)


def test_synthetic_joints_move_as_the_recorded_one(logs):
    joint = synthetic_joint(3, logs)
    again = synthetic_joint(3, logs)
    assert [len(log.time) for log in joint.logs] == [len(log.time) for log in logs]
    steps = joint.logs[0].q / ENCODER
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    np.testing.assert_array_equal(joint.logs[0].q, again.logs[0].q)
    rms = [
        float(np.sqrt(np.mean((one.q - real.q) ** 2)))
        for one, real in zip(joint.logs, logs, strict=True)
    ]
    assert 0.01 < np.mean(rms) < 0.5
    assert {term for seed in range(20) for term in synthetic_joint(seed, logs[:1]).terms} == {
        "load", "stribeck", "bristles", "directional"
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 206))
def test_no_term_is_claimed_that_a_joint_has_not(logs, seed):
    joint = synthetic_joint(seed, logs)
    fit = identify_joint(joint.logs, PENDULUM)
    assert set(fit.terms) <= set(joint.terms)
    assert ("load" in fit.terms) == ("load" in joint.terms)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            "--task nope",
            "--task must be one of slides, pushes, series, onsets, joints, got 'nope'",
        ),
        (
            "--task slides --task joints",
            "--task must be joints alone, or other tasks, got slides, joints",
        ),
    ],
)
def test_tasks_that_are_not_there_or_run_alone_are_one_line(arguments, message, capsys):
    assert main(["measured", *arguments.split()]) == 2
    assert capsys.readouterr().err == f"error: {message}\n"
