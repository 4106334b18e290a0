"""Smoothing of logs: exact moments, the encoder's step, white noise, and the chosen kernel."""

import numpy as np
import pytest

from planarfriction.joints import JointLog
from planarfriction.joints.log import runs
from planarfriction.joints.smoothing import (
    derivatives,
    encoder_step,
    evenly,
    kernel_width,
    rows_of,
    scales,
    smoothed_noise,
    white_noise,
)


def even(q, rate=1000.0):
    t = np.arange(len(q)) / rate
    return evenly(JointLog(t, q, torque=np.sin(t)))


@pytest.mark.parametrize("rate", [200.0, 2000.0])
def test_a_parabola_far_from_zero_keeps_its_derivatives(rate):
    """`q = 3000 + 2 t + 0.7 t^2`: a kernel cut at five widths adds 3e-7 q/dt^2, 3.6e3 rad/s^2 at 2 kHz."""
    t = np.arange(int(rate)) / rate
    log = even(3000.0 + 2.0 * t + 0.7 * t**2, rate)
    angle, speed, acceleration = derivatives(log, 0.01)
    inner = slice(int(0.1 * rate), -int(0.1 * rate))
    # the angle gains 0.7 times the kernel's variance, which its grid changes by less than 1e-3
    np.testing.assert_allclose(angle[inner], (log.angle + 0.7e-4)[inner], atol=1e-7)
    np.testing.assert_allclose(speed[inner], (2.0 + 1.4 * t)[inner], rtol=1e-6)
    # 3000 rad over 1e-16, twice over 5e-4 s.
    np.testing.assert_allclose(acceleration[inner], 1.4, rtol=1e-3)


def test_variances_of_smoothed_noise_are_those_of_the_formulas():
    q = np.random.default_rng(0).normal(0.0, 1e-3, 200_000)
    log = even(q)
    width = 5e-3
    _, speed, acceleration = derivatives(log, width)
    power = 1e-6 * log.dt
    # 2 % by chance.
    assert speed.var() == pytest.approx(smoothed_noise(power, width, 1), rel=0.03)
    assert acceleration.var() == pytest.approx(
        smoothed_noise(power, width, 2), rel=0.03
    )


@pytest.mark.parametrize("bits", [10, 14, 17])
def test_the_step_of_an_encoder_is_found(bits):
    step = 2.0 * np.pi / 2**bits
    q = np.sin(np.arange(4000) * 3e-3)
    assert encoder_step(np.round(q / step) * step) == pytest.approx(step, rel=1e-6)


def test_an_angle_without_steps_has_no_encoder():
    assert encoder_step(np.sin(np.arange(4000) * 3e-3)) == 0.0
    assert encoder_step(np.zeros(100)) == 0.0


def test_white_noise_is_told_from_motion():
    t = 1e-3 * np.arange(20_000)
    noise = np.random.default_rng(1).normal(0.0, 0.02, len(t))
    assert white_noise(np.sin(5.0 * t) + noise) == pytest.approx(0.02, rel=0.03)


def test_a_coarse_encoder_gets_a_wider_kernel():
    t = 1e-3 * np.arange(8000)
    q = 0.5 * np.sin(3.0 * t) + 0.1 * np.sin(11.0 * t)
    widths = [
        kernel_width([even(np.round(q / step) * step)])
        for step in 2.0 * np.pi / 2.0 ** np.array([10, 13, 16])
    ]
    assert widths[0] > widths[1] > widths[2]
    # at 16 bits, noise makes at most a thousandth of the mean square of the acceleration, a half of 4.5^2 and 12.1^2
    power = 1e-3 * (2.0 * np.pi / 2.0**16) ** 2 / 12.0
    assert smoothed_noise(power, widths[2], 2) < 1e-3 * 0.5 * (4.5**2 + 12.1**2)


def test_slow_motion_is_smoothed_longer_and_turns_round_at_the_same_time():
    """Behind 11 bits, the direction of a slow part is right far below the noise of the kernel for all motion."""
    t = 1e-3 * np.arange(16_000)
    fast = np.maximum(t - 12.0, 0.0)
    step = 2.0 * np.pi / 2**11
    speed = 0.05 * np.cos(0.7 * t) + 0.6 * np.sin(3.0 * fast)
    log = even(
        np.round(
            (0.05 / 0.7 * np.sin(0.7 * t) + 0.2 * (1.0 - np.cos(3.0 * fast))) / step
        )
        * step
    )
    limits = scales([log], 0.012)
    assert 3.0 * limits.width < limits.slow_width <= 4.0 * limits.width
    assert limits.slow < 0.4 * limits.noisy
    rows = rows_of(log, limits)
    inner = rows.fitted
    true = np.interp(rows.time, t, speed)
    sure = inner[np.abs(true[inner]) > limits.slow]
    # What the first kernel alone would not know.
    assert np.mean(np.abs(true[sure]) < limits.noisy) > 0.6
    assert np.mean(np.sign(rows.speed[sure]) == np.sign(true[sure])) > 0.99


def test_runs_are_given_by_their_ends():
    mask = np.array([True, True, False, True, False, False, True])
    assert runs(mask).tolist() == [[0, 2], [3, 4], [6, 7]]
