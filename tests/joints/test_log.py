"""Logs of joints: files of other tools, angles that were wrapped, switches, and what a message names."""

import numpy as np
import pytest

from planarfriction.errors import FileError
from planarfriction.joints import JointLog
from tests.support.refusals import refused

T = 0.01 * np.arange(200)


def read(tmp_path, heading, *columns, separator=","):
    file = tmp_path / "arm.csv"
    rows = zip(*columns, strict=True)
    file.write_text(
        "\n".join([heading, *(separator.join(map(str, row)) for row in rows)]) + "\n"
    )
    return JointLog.from_csv(file)


@pytest.mark.parametrize(
    "heading",
    [
        "t,q,torque",
        "__time,position,effort",
        "time_s,angle,tau",
        "Time [s],theta [rad],torque [N m]",
    ],
)
def test_columns_of_other_tools_are_read(heading, tmp_path):
    log = read(tmp_path, heading, T, np.sin(T), np.cos(T))
    np.testing.assert_allclose(log.torque, np.cos(T))


REFUSED = {
    "speed alone": (
        "t,dq,torque",
        ",",
        "no column q; found t, dq, torque; needed t, q, and torque",
    ),
    "spaces": ("t q torque", " ", "cells must be separated by commas"),
    "two angles": (
        "t,position,angle,torque",
        ",",
        "columns 'position' and 'angle' are both q: keep one of them",
    ),
    "degrees": ("t,q [deg],torque", ",", "q must be in rad"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_message_names_what_was_found(name, tmp_path):
    heading, separator, message = REFUSED[name]
    columns = [T] * len(heading.split(separator))
    with refused(message, FileError):
        read(tmp_path, heading, *columns, separator=separator)


def test_switches_may_be_true_or_false(tmp_path):
    on = T < 1.0
    log = read(
        tmp_path,
        "t,q,torque,enabled",
        T,
        np.sin(T),
        np.cos(T),
        np.where(on, "true", "False"),
    )
    np.testing.assert_array_equal(log.on, on)
    np.testing.assert_array_equal(JointLog(T, T, torque=np.cos(T), enabled=on).on, on)


def test_a_wrapped_angle_is_unwrapped_and_counted():
    q = 5.0 * np.sin(2.0 * T)
    log = JointLog(T, (q + np.pi) % (2.0 * np.pi) - np.pi, torque=np.cos(T))
    np.testing.assert_allclose(log.q, q, atol=1e-12)
    assert log.turns == 3  # it passes pi there and back, then -pi


def test_a_wrapped_angle_beside_a_goal_is_refused():
    q = 5.0 * np.sin(2.0 * T)
    with refused("q of joint must be unwrapped beside a goal"):
        JointLog(T, (q + np.pi) % (2.0 * np.pi) - np.pi, goal=q, voltage=0.0 * T)
