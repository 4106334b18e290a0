"""Slides that friction cannot explain, their weights and their influence, on made motions in closed form."""

import numpy as np
import pytest

from planarfriction.identify import MassProperties, Slide
from planarfriction.identify.slides import (
    contradictions,
    speeds,
    verdicts_on_influence,
    verdicts_on_weights,
    weights,
    window_twists,
)

BODY = MassProperties(0.5, 0.5 * 0.03**2)
TIME = np.arange(48) / 100.0


def slide(speed, name="slide", noise=0.0):
    """Motion along (0.6, 0.8) at `speed(t)` [m/s], with a spin that makes as much again of the energy."""
    way = np.concatenate(
        [[0.0], np.cumsum(0.5 * (speed(TIME[1:]) + speed(TIME[:-1])) / 100.0)]
    )
    pose = np.stack([0.6 * way, 0.8 * way, way / 0.03], -1)
    pose += (
        noise * np.random.default_rng(0).standard_normal(pose.shape) / [1.0, 1.0, 0.03]
    )
    return Slide(TIME, pose, name=name)


def braked(t):
    return 1.0 - 1.5 * t


def test_twists_of_windows_are_slopes_in_their_middle():
    times, twists, left = window_twists(slide(braked))
    assert times == pytest.approx(0.035 + 0.08 * np.arange(6))
    assert twists == pytest.approx(braked(times)[:, None] * [0.6, 0.8, 1.0 / 0.03])
    assert left == pytest.approx(np.zeros((48, 3)), abs=1e-12)


def test_speeds_count_the_spin_and_know_their_noise():
    times, speed, noise = speeds(slide(braked), BODY)
    assert speed == pytest.approx(np.sqrt(2.0) * braked(times))
    assert noise < 1e-9
    # a parabola takes 3 of 8 from the noise that is left; the slope of 8 samples over 80 ms has sqrt(12/8)/80 ms of it
    noise = speeds(slide(braked, noise=1e-4), BODY)[2]
    assert noise == pytest.approx(
        1e-4 * np.sqrt(5.0 / 8.0) * np.sqrt(12.0 / 8.0) / 0.08, rel=0.15
    )


def test_pushed_and_flying_slides_are_named_and_others_are_not():
    pushed = slide(
        lambda t: np.where(t < 0.24, braked(t), 0.64 + 1.0 * (t - 0.24)), "pushed"
    )
    flies = slide(
        lambda t: np.where(t < 0.2, 1.0 - 0.1 * t, 0.98 - 1.5 * (t - 0.2)), "flies"
    )
    found = contradictions(
        [slide(braked), pushed, slide(braked), flies, slide(braked)], BODY
    )
    assert set(found) == {1, 3}
    lowest = speeds(pushed, BODY)[1].min()
    highest = speeds(pushed, BODY)[1][-1]
    assert (
        found[1]
        == f"its speed grows from {lowest:.2g} to {highest:.2g} m/s: it was pushed"
    )
    assert (
        found[3] == "its speed hardly falls for 160 ms: it lost contact, or was pushed"
    )
    assert contradictions([pushed, slide(braked)], BODY) == {}  # half of them


def test_weights_fall_from_two_and_a_half_medians_and_end_at_six():
    errors = 2.0 * np.array([1.0, 0.5, 1.0, 2.5, 5.0, 5.9, 6.1, 1.0, 1.0])
    expected = [1.0, 1.0, 1.0, 1.0, 0.25, (2.5 / 5.9) ** 2, 0.0, 1.0, 1.0]
    assert weights(errors) == pytest.approx(np.array(expected))
    assert weights(np.zeros(3)) == pytest.approx(np.ones(3))
    each = [slide(braked, f"slide {i}") for i in range(3)]
    out, less = verdicts_on_weights(
        each, np.array([0.0, 1.0, 0.5]), np.array([7.25, 1.0, 3.0])
    )
    assert (
        "slide 0 is left out: its residuals are 7.2 times those of the median slide"
        in str(out)
    )
    assert "slide 2 have less weight" in str(less)


def test_the_slide_that_moves_an_estimate_most_is_named():
    each = [slide(braked, f"slide {i}") for i in range(3)]
    moved = np.array([[0.001, 0.5], [-0.016, 0.1], [0.002, -0.2]])
    (said,) = verdicts_on_influence(
        each, moved, ["mu_c", "sigma_1"], np.array([0.02, 1.0])
    )
    assert "without slide 1, mu_c would change by -0.016 (0.8 standard errors)" in str(
        said
    )
    assert (
        verdicts_on_influence(
            each, 0.8 * moved, ["mu_c", "sigma_1"], np.array([0.02, 1.0])
        )
        == []
    )
    assert (
        verdicts_on_influence(
            each[:2], moved[:2], ["mu_c", "sigma_1"], np.array([0.02, 1.0])
        )
        == []
    )
    (said,) = verdicts_on_influence(
        each, moved, ["mu_c", "sigma_1"], np.array([np.inf, 0.5])
    )
    assert "without slide 0, sigma_1 would change by +0.5 (1.0 standard errors)" in str(
        said
    )
