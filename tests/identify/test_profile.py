"""Standard errors on curved ridges of the cost, in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from planarfriction.identify.parameters import Coordinates
from planarfriction.identify.search import stretches


def stretch(residual, slope, width):
    """The factor on the standard error of a Stribeck speed of 1 mm/s, whose residual is that of its logarithm."""
    coordinates = Coordinates(("v_s",), np.array([1e-3]), 0.5)
    told = []
    problem = SimpleNamespace(
        names=("v_s",),
        residuals=lambda *_: lambda x: (residual(x), np.array([slope(x)])),
        report=told.append,
        forget=lambda: None,
    )
    values = {
        "coordinates": coordinates,
        "values": np.array([1e-3]),
        "x": np.zeros(1),
        "at_bound": np.array([False]),
    }
    fit = SimpleNamespace(problem=problem, sigma=[], cost=0.0, **values)
    found = stretches(
        fit, SimpleNamespace(jacobian=np.array([[1e3 / width]]), pull=np.zeros((1, 1)))
    )
    return float(found[0]), told


def test_a_cost_that_flattens_widens_the_interval():
    """The cost `0.5 (2.5 tanh(2.5 x))^2` rises by 2 at 2.75 of the errors of its curvature, not at 2."""
    found, told = stretch(
        lambda x: 2.5 * np.tanh(x / 0.4), lambda x: 6.25 / np.cosh(x / 0.4) ** 2, 0.16
    )
    assert found == pytest.approx(np.arctanh(0.8) * 2.5 / 2.0, rel=0.1)
    assert told == ["interval of v_s"]


def test_a_parabola_keeps_its_interval():
    found, told = stretch(lambda x: x / 0.16, lambda x: np.full(1, 1.0 / 0.16), 0.16)
    assert found == pytest.approx(1.0, abs=1e-3) and told


def test_precise_and_unknown_values_are_left_alone():
    for width in (0.01, 0.5):
        assert stretch(np.tanh, lambda x: np.cosh(x) ** -2, width) == (1.0, [])
