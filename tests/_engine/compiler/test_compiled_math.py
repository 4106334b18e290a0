"""The scalar functions of compiled loops against NumPy, over the domains they state."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from planarfriction._engine.compiler import compiled_math

EPSILON = 2.0**-52
NUMPY = EPSILON
"""NumPy itself is within one unit in the last place of the true value, at most this share of it."""


def looped(function):
    """`function` of compiled loops as a function of an array."""

    @njit(error_model="numpy")
    def loop(x, out):
        for i in range(x.shape[0]):
            out[i] = function(x[i])

    def call(x):
        x = np.asarray(x, dtype=float)
        out = np.empty_like(x)
        loop(x, out)
        return out

    return call


def looped_of_two(function):
    """`function` of two arguments likewise."""

    @njit(error_model="numpy")
    def loop(x, y, out):
        for i in range(x.shape[0]):
            out[i] = function(x[i], y[i])

    def call(x, y):
        x, y = (np.array(a, dtype=float) for a in np.broadcast_arrays(x, y))
        out = np.empty_like(x)
        loop(x, y, out)
        return out

    return call


exp, expm1, log, sin, cos = (
    looped(getattr(compiled_math, name))
    for name in ("exp", "expm1", "log", "sin", "cos")
)
power, atan2 = looped_of_two(compiled_math.power), looped_of_two(compiled_math.atan2)


@pytest.fixture
def random():
    return np.random.default_rng(7)


@pytest.mark.parametrize("reach", [1e-9, 0.4, 40.0, 708.0])
def test_exp(random, reach):
    x = np.concatenate([random.uniform(-reach, reach, 100_000), [-reach, 0.0, reach]])
    assert np.abs(exp(x) / np.exp(x) - 1.0).max() < 6e-16 + NUMPY  # the stated error


def test_exp_at_the_ends_of_its_range():
    assert exp([0.0])[0] == 1.0
    # Limited to +-708 as stated; bristles ask for exp(-infinity) when a step is long.
    assert np.array_equal(
        exp([1e9, math.inf, -1e9, -math.inf]), exp([708.0, 708.0, -708.0, -708.0])
    )
    assert 0.0 < exp([-math.inf])[0] < 1e-300


def test_expm1(random):
    tiny = 10.0 ** random.uniform(-300, 2.8, 100_000)
    x = np.concatenate(
        [random.uniform(-1.0, 1.0, 100_000), tiny, -tiny, [0.4, 700.0, -800.0]]
    )
    # The stated error.
    assert np.abs(expm1(x) / np.expm1(x) - 1.0).max() < 6e-16 + NUMPY
    assert expm1([0.0])[0] == 0.0 and expm1([-math.inf])[0] == -1.0


@pytest.mark.parametrize("decades", [1e-15, 1e-7, 0.1, 1.0, 307.0])
def test_log(random, decades):
    x = 10.0 ** random.uniform(-decades, decades, 100_000)
    x = x[x != 1.0]
    assert np.abs(log(x) / np.log(x) - 1.0).max() < 1e-15 + NUMPY  # the stated error


def test_log_at_special_values():
    assert log([1.0])[0] == 0.0
    # Half the last place: powers of two have no series.
    powers = 2.0 ** np.arange(-1022.0, 1024.0)
    assert log(powers) == pytest.approx(
        np.log(2.0) * np.arange(-1022, 1024), rel=EPSILON
    )
    # Stated: about, not minus infinity.
    assert log([0.0])[0] == pytest.approx(-709.0, abs=1.0)


def test_sin_and_cos(random):
    x = np.concatenate(
        [
            random.uniform(-math.pi / 2, math.pi / 2, 100_000),
            [0.0, math.pi / 2, -math.pi / 2],
        ]
    )
    # The stated absolute error; NumPy's, of values below 1.
    assert np.abs(sin(x) - np.sin(x)).max() < 4e-16 + NUMPY / 2
    assert np.abs(cos(x) - np.cos(x)).max() < 4e-16 + NUMPY / 2
    assert sin([0.0])[0] == 0.0 and cos([0.0])[0] == 1.0


def test_atan2(random):
    angle = random.uniform(-math.pi, math.pi, 100_000)
    length = 10.0 ** random.uniform(-12, 3, angle.size)
    y = length * np.sin(angle)
    x = length * np.cos(angle)
    # The stated error; angles reach pi.
    assert np.abs(atan2(y, x) - np.arctan2(y, x)).max() < 1e-15 + 2 * NUMPY
    small = 10.0 ** random.uniform(-300, -3, 1000)
    # Relative, near the axis.
    assert atan2(small, 1.0) == pytest.approx(np.arctan2(small, 1.0), rel=EPSILON)


def test_atan2_on_the_axes():
    y = np.array([0, 0, 1, -1, 0, 1, -1, 1, -1.0])
    x = np.array([1, -1, 0, 0, 0, 1, 1, -1, -1.0])
    assert atan2(y, x) == pytest.approx(np.arctan2(y, x), abs=EPSILON)


@pytest.mark.parametrize("exponent", [0.3, 0.5, 1.0, 1.5, 3.0, 5.0])
def test_power(random, exponent):
    x = 10.0 ** random.uniform(-6, 3, 100_000)
    # exp(y) carries the rounding of y = exponent log(x), up to 35 here: |y| (1e-15 of log + 1 rounding), and its own.
    allowed = 6e-16 + NUMPY + np.abs(exponent * np.log(x)) * 1.3e-15
    assert (np.abs(power(x, exponent) / x**exponent - 1.0) < allowed).all()


def test_power_is_exact_where_it_can_be(random):
    x = random.uniform(0.0, 1e3, 1000)
    assert np.array_equal(power(x, 2.0), x * x)
    assert np.array_equal(power(1.0, [0.1, 1.0, 2.0, 7.0]), np.ones(4))
    # At rest: no exponent leaves a rest of exp(-709 exponent).
    assert np.array_equal(
        power(0.0, [0.001, 0.1, 0.5, 1.0, 1.5, 2.0, 9.0]), np.zeros(7)
    )


def test_integers_in_order(random):
    x = np.concatenate(
        [[-3.0, -1e-300], np.sort(10.0 ** random.uniform(-300, 300, 1000)), [math.inf]]
    )
    bits = [njit(lambda x: compiled_math.in_order(x))(each) for each in x[::100]]
    assert bits == sorted(bits) and bits[0] < 0 and len(set(bits)) == len(bits)


def test_where_minimum_maximum():
    a = np.array([1.0, -2.0, 3.0, 0.0])
    b = np.array([2.0, -3.0, 3.0, 0.0])
    assert np.array_equal(looped_of_two(compiled_math.minimum)(a, b), np.minimum(a, b))
    assert np.array_equal(looped_of_two(compiled_math.maximum)(a, b), np.maximum(a, b))
    chosen = looped(njit(lambda x: compiled_math.where(x > 0.0, x, 7.0)))
    assert np.array_equal(chosen(a), np.where(a > 0.0, a, 7.0))
