"""What a rig adds to wrenches, in closed form: columns, widths, derivatives, words; and the noise of several logs."""

import numpy as np
import pytest

from planarfriction.identify import Log
from planarfriction.identify.sensor_errors import (
    Rig,
    SmoothTwist,
    _joined,
    jitter,
    least_noise,
    wrench_noise,
)

FORCES = np.array([3.0, -2.0, 0.04])


def log_of(count, share, name):
    """A log whose channels swing up to `share` of `FORCES`, from 1 s to 3 s."""
    time = np.linspace(1.0, 3.0, count)
    wave = np.sin(np.linspace(0.0, 20.0, count))
    wave[-1] = 1.0
    return Log(
        time, np.ones((count, 3)), share * wave[:, None] * FORCES, 2.0, name=name
    )


@pytest.fixture(scope="module")
def rig():
    return Rig([log_of(41, 1.0, "a"), log_of(61, 0.5, "b")], ("delay", "bias", "load"))


def test_columns_have_their_order_and_widths(rig):
    each = [
        "bias_fx",
        "zero_drift_fx",
        "bias_fy",
        "zero_drift_fy",
        "bias_tau",
        "zero_drift_tau",
    ]
    each += ["load_drift", "load_drift_2", "load_drift_3"]
    assert [column.name for column in rig.columns] == [
        "delay",
        "load_scale",
        *each,
        *each,
    ]
    own = [
        width
        for largest in (3.0, 2.0, 0.04)
        for width in (0.1 * largest, 0.05 * largest)
    ]
    drift = [0.05, 0.02, 0.02]
    expected = [0.01, 0.005, *own, *drift, *(0.5 * np.array(own)), *drift]
    assert rig.widths == pytest.approx(np.array(expected), rel=1e-9)
    assert rig.limits[0] == pytest.approx(5.0) and np.isinf(rig.limits[1:]).all()


@pytest.mark.parametrize("i", [0, 1])
def test_sensors_show_factor_and_zeros_of_their_own_log(rig, i):
    random = np.random.default_rng(0)
    values = 0.1 * random.normal(size=len(rig.columns))
    count = len(rig.logs[i].time)
    wrench = random.normal(size=(count, 3))
    later = random.normal(size=(count, 3))
    u = np.linspace(-1.0, 1.0, count)
    shown, factor, slopes = rig.added(i, values, wrench, later)
    own = values[2 + 9 * i : 11 + 9 * i]
    drift = own[6] * u + own[7] * (1.5 * u**2 - 0.5) + own[8] * (2.5 * u**3 - 1.5 * u)
    assert factor == pytest.approx(1.0 + values[1] + drift)
    zeros = np.stack([own[2 * k] + own[2 * k + 1] * u for k in range(3)], -1)
    assert shown == pytest.approx(factor[:, None] * wrench + zeros)
    assert slopes[:, :, 0] == pytest.approx(factor[:, None] * later)
    for j in range(1, len(values)):
        step = 1e-6 * np.eye(len(values))[j]
        high, low = (
            rig.added(i, values + sign * step, wrench, later)[0] for sign in (1.0, -1.0)
        )
        assert slopes[:, :, j] == pytest.approx((high - low) / 2e-6, abs=1e-8), (
            rig.columns[j].name
        )
    assert rig.delay(values) == values[0]


def test_a_scale_is_as_wide_as_the_drift_lets_it_be(rig):
    values = np.zeros(len(rig.columns))
    # Scale, drifts of both logs, and a zero of the first.
    values[[1, 8, 17, 2]] = (
        0.012,
        0.03,
        -0.06,
        -0.6,
    )
    wide = np.hypot(0.005, 0.06 / 1.5)
    assert rig.with_drift(values)[1] == pytest.approx(wide)
    assert np.delete(rig.with_drift(values), 1) == pytest.approx(
        np.delete(rig.widths, 1)
    )
    strains = rig.strains(values)
    assert [words for _, words in strains[:4]] == [
        "bias_fx -0.6 N",
        "load_drift -0.06",
        "load_drift 0.03",
        "load_scale 0.012",
    ]
    assert [size for size, _ in strains[:4]] == pytest.approx(
        [2.0, 1.2, 0.6, 0.012 / wide]
    )
    found = rig.found(values, np.full(len(values), 0.001))
    assert (found[1].log, found[2].log, found[17].log) == ("", "a", "b")
    assert found[17].interval == pytest.approx((-0.06 - 0.00196, -0.06 + 0.00196))


def test_noise_of_several_logs_is_a_mean_square_over_samples():
    random = np.random.default_rng(0)
    logs = []
    for count, spread in ((3000, 0.02), (1000, 0.06)):
        noise = spread * random.normal(size=(count, 3)) * [1.0, 2.0, 0.1]
        logs.append(
            Log(
                np.arange(count) * 1e-3,
                np.ones((count, 3)),
                np.array([1.0, 4.0, 0.3]) + noise,
                2.0,
            )
        )
    squares = [len(log.time) * jitter(log.wrench) ** 2 for log in logs]
    expected = np.sqrt(np.sum(squares, axis=0) / 4000)
    assert wrench_noise(logs) == pytest.approx(expected)
    assert expected == pytest.approx(
        np.sqrt(0.75 * 0.02**2 + 0.25 * 0.06**2) * np.array([1.0, 2.0, 0.1]), rel=0.05
    )
    half = [0.5 * (log.wrench - log.wrench.mean(axis=0)) for log in logs]
    assert wrench_noise(logs, half) == pytest.approx(0.5 * expected, rel=1e-9)
    largest = np.max([np.abs(log.wrench).max(axis=0) for log in logs], axis=0)
    assert least_noise(logs) == pytest.approx(1e-3 * largest[[1, 1, 2]])


def test_parts_of_a_twist_are_joined_by_mean_squares():
    parts = [
        SmoothTwist(
            np.full((count, 3), level),
            np.array([1.0, 2.0, 0.0]) * level,
            np.full(3, level),
            np.full(3, weight),
        )
        for count, level, weight in ((1, 4.0, 1.0), (3, 0.0, 10.0), (4, 2.0, 3.0))
    ]
    joined = _joined(parts)
    assert joined.values[:, 0].tolist() == [4.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0]
    assert joined.left == pytest.approx(np.full(3, np.sqrt((16.0 + 4 * 4.0) / 8)))
    assert joined.noise == pytest.approx(
        np.array([1.0, 2.0, 0.0]) * np.sqrt((16.0 + 4 * 4.0) / 8)
    )
    assert joined.weights == pytest.approx(np.full(3, 3.0))
