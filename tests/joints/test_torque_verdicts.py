"""Logs of torques that are wrong in one way each: they are refused in one line with the remedy, or the fit says so."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from planarfriction.joints import JointLog, Plant, identify_joint
from tests.support.refusals import refused
from tests.support.torque_joints import Numbers, Sensors, recorded

PENDULUM = Plant(inertia=0.05, mass=0.5, length=0.4, arm_mass=0.0)
"""Gravity of 1.962 N m."""


@functools.cache
def measured(kind="sines", numbers=Numbers(), sensors=Sensors(), count=3):  # noqa: B008
    return tuple(
        recorded(numbers, kind, sensors, np.random.default_rng(seed))
        for seed in range(count)
    )


def logs(change=lambda t, q, torque: (t, q, torque), **given):
    changed = [change(*each) for each in measured(**given)]
    return [
        JointLog(t, q, torque=torque, name=f"log {i}")
        for i, (t, q, torque) in enumerate(changed)
    ]


def frozen(t, values):
    """Stop a sensor in mid-motion, at its fastest, for a second."""
    first = int(np.argmax(np.abs(np.gradient(values))[: len(t) // 2]))
    return np.where((t >= t[first]) & (t < t[first] + 1.0), values[first], values)


HANGS = Numbers(inertia=0.13, gravity=1.962)

REFUSED = {
    "torque of the other sign": (
        lambda: logs(lambda t, q, torque: (t, q, -torque)), Plant(), "flip the sign of torque or angle",
    ),
    "angle of the other sign": (
        lambda: logs(lambda t, q, torque: (t, -q, torque)), Plant(), "flip the sign of torque or angle",
    ),
    "noise as torque": (
        lambda: logs(lambda t, q, torque: (t, q, np.random.default_rng(3).normal(0.0, 0.5, len(t)))), Plant(),
        "check that columns, times and joint belong together",
    ),
    "torque of another log": (
        lambda: [
            JointLog(one[0], one[1], torque=other[2])
            for one, other in zip(measured(), measured()[1:] + measured()[:1], strict=True)
        ],
        Plant(), "check that columns, times and joint belong together",
    ),
    "times in ms": (lambda: logs(lambda t, q, torque: (1e3 * t, q, torque)), Plant(), "is it in ms"),
    "angle in degrees": (lambda: logs(lambda t, q, torque: (t, np.degrees(q), torque)), Plant(), "it is in degrees"),
    "pendulum in degrees": (
        lambda: logs(lambda t, q, torque: (t, np.degrees(q), torque), numbers=HANGS), PENDULUM, "in degrees",
    ),
    "one direction": (lambda: logs(kind="one way"), Plant(), "move in both directions"),
    "a torque that never changes": (
        lambda: logs(lambda t, q, torque: (t, q, 0.0 * torque + 0.3)), Plant(), "torque of log 0 must vary, got 0.3",
    ),
    "a torque that freezes": (
        lambda: logs(lambda t, q, torque: (t, q, frozen(t, torque))), Plant(), "change while the joint moves",
    ),
    "an angle that freezes": (
        lambda: logs(lambda t, q, torque: (t, frozen(t, q), torque)), Plant(), "come to rest gradually",
    ),
    "a joint that stands": (lambda: logs(lambda t, q, torque: (t, 0.0 * q, torque)), Plant(), "must move"),
    "a torque far too late": (
        lambda: logs(lambda t, q, torque: (t, q, np.roll(torque, 250))), Plant(),
        "torque of the logs must be less than 40 ms late",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_wrong_logs_are_refused_in_one_line(name):
    given, plant, words = REFUSED[name]
    with refused(words):
        identify_joint(given(), plant)


def said(fit):
    return "\n".join(str(each) for each in fit.verdicts)


def test_a_late_torque_is_estimated_and_said():
    fit = identify_joint(logs(sensors=Sensors(late=0.03)), Plant())
    assert fit.values["delay"] == pytest.approx(
        0.03, abs=1e-3
    ) and "late by 30" in said(fit)
    assert fit.values["mu_c"] == pytest.approx(0.6, rel=0.02)


def test_gravity_that_was_not_told_is_found_and_said():
    fit = identify_joint(logs(numbers=HANGS), Plant())
    low, high = fit.intervals["gravity"]
    assert (
        "gravity" in fit.terms and low <= 1.962 <= high and "none was told" in said(fit)
    )


def test_gravity_that_is_not_there_is_said():
    fit = identify_joint(logs(), PENDULUM)
    assert "1.96 N m of gravity were told, and do not show" in said(fit)


@pytest.mark.parametrize("gain", [1.0, 1.2])
def test_a_wrong_scale_of_the_torque_shows_beside_known_gravity(gain):
    fit = identify_joint(logs(numbers=HANGS, sensors=Sensors(gain=gain)), PENDULUM)
    assert ("a wrong torque constant or unit" in said(fit)) == (gain != 1.0)
    low, high = fit.intervals["gravity"]
    assert low <= gain * 1.962 <= high


def test_an_angle_at_which_the_joint_hangs_has_no_bound():
    fit = identify_joint(logs(numbers=HANGS._replace(hangs=1.571)), PENDULUM)
    low, high = fit.intervals["offset"]
    assert low <= 1.571 <= high


def test_wrapped_angles_are_unwrapped_and_said():
    wrapped = logs(
        lambda t, q, torque: (t, (6.0 * q + np.pi) % (2.0 * np.pi) - np.pi, torque)
    )
    fit = identify_joint(wrapped, Plant())
    assert "jumps by a full rotation were removed" in said(fit)
    assert fit.values["mu_c"] == pytest.approx(0.6, rel=0.03)
    assert fit.values["inertia"] == pytest.approx(0.05 / 6.0, rel=0.03)


def test_friction_that_differs_between_the_directions_is_a_term():
    uneven = Numbers(mu_c=0.55, sigma_2=0.5, uneven=-0.15, uneven_viscous=0.1)
    fit = identify_joint(logs(numbers=uneven), Plant())
    assert "asymmetry" in fit.terms
    for name, truth in {
        "asymmetry": -0.15,
        "viscous_asymmetry": 0.1,
        "mu_c": 0.55,
        "sigma_2": 0.5,
    }.items():
        low, high = fit.intervals[name]
        assert low <= truth <= high, (name, low, high)
    assert fit.friction.asymmetry == fit.values["asymmetry"]
