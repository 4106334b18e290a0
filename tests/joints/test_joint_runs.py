"""Runs of a joint: smooth in its numbers, the instant at which they turn round, and that finer steps change little."""

import dataclasses

import numpy as np
import pytest

from planarfriction.joints import Drive, JointLog, Plant
from planarfriction.joints import problem as problems
from planarfriction.joints.problem import JointFitProblem

VALUES = {
    "inertia": 1.8e-3, "offset": -0.02, "torque_gain": 0.107, "back_emf": 0.04, "mu_c": 2.5e-3, "sigma_2": 5e-3,
    "load": 0.2, "rise": 2e-3, "v_s": 0.5, "sigma_0": 9.0, "sigma_1": 0.05, "load_external": 0.05,
}  # fmt: skip


def servo(terms):
    """Return the problem of a pendulum that follows a wave, is let go, and is driven to saturation."""
    t = np.cumsum(np.r_[0.0, np.random.default_rng(0).uniform(0.004, 0.006, 400)])
    goal = 1.3 * np.sin(4.0 * t) + (t > 1.4)
    on = np.where((t > 0.8) & (t < 1.1), 0.0, 1.0)
    log = JointLog(
        t,
        0.9 * np.sin(4.0 * t - 0.3),
        goal=goal,
        enabled=on,
        drive=Drive(400.0, 7.3, 2.9e-3, 0.25),
    )
    return JointFitProblem((log,), Plant(mass=0.49, length=0.1), None, terms)


@pytest.mark.parametrize(
    "terms", [("load",), ("load", "stribeck"), tuple(problems.TERMS)]
)
@pytest.mark.parametrize("span", [0.2, np.inf])
def test_a_run_is_smooth_in_its_numbers(terms, span):
    """Slopes by one-sided differences of 1e-5 are those by two-sided ones of 1e-6, but where a run begins to move."""
    problem = servo(terms)
    values = {name: VALUES[name] for name in problem.names}
    errors = lambda values: problem.errors(values, span)
    slopes = problems.slopes(errors, values, problem.names, errors(values))
    for i, name in enumerate(problem.names):
        step = 1e-6 * abs(values[name])
        more, less = (
            errors({**values, name: values[name] + way}) for way in (step, -step)
        )
        # Those are searched by their logarithm.
        factor = values[name] if name in ("v_s", "sigma_0") else 1.0
        off = np.abs((more - less) / (2.0 * step) * factor - slopes[:, i])
        assert np.mean(off < 1e-3 * np.abs(slopes[:, i]).max()) > 0.97, name


def test_a_log_may_begin_at_any_time():
    """Runs that begin again every 0.2 s do so at the same samples."""
    problem = servo(("load",))
    later = dataclasses.replace(problem.logs[0], time=problem.logs[0].time + 100.0)
    values = {name: VALUES[name] for name in problem.names}
    moved = problem.simulated(values, (later,), 0.2)[0]
    assert moved == pytest.approx(
        problem.simulated(values, problem.logs, 0.2)[0], abs=1e-6
    )


def test_a_joint_turns_round_within_a_step(monkeypatch):
    """Thrown against a constant torque, it stops at I v^2/2 (push + mu_c) and comes back against friction alone."""
    monkeypatch.setattr(problems, "STEP", 1.0)
    t = 0.07 * np.arange(12)
    log = JointLog(t, np.zeros(len(t)), voltage=np.full(len(t), -3.0), drive=None)
    log.motion[:, 1] = 2.0
    problem = JointFitProblem((log,), Plant(inertia=1.0), 1.0, ())
    values = {"mu_c": 1.0, "sigma_2": 0.0}
    q = problem.simulated(values, [log])[0][:, 0]
    stop = 2.0 / 4.0  # at (3 + 1) rad/s^2
    exact = np.where(t < stop, 2.0 * t - 2.0 * t**2, 0.5 - (t - stop) ** 2)
    np.testing.assert_allclose(q, exact, atol=1e-12)


@pytest.mark.parametrize(
    "terms, most", [(("load", "stribeck"), 3e-4), (("load", "bristles"), 1e-3)]
)
def test_finer_steps_change_little(monkeypatch, terms, most):
    problem = servo(terms)
    values = {name: VALUES[name] for name in problem.names}
    coarse = problem.errors(values)
    monkeypatch.setattr(problems, "STEP", 1e-4)
    assert np.abs(problem.errors(values) - coarse).mean() < most
