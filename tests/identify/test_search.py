"""The search for the least sum of squares: where it ends, and what it keeps."""

from types import SimpleNamespace

import numpy as np
import pytest

from planarfriction.identify.search import FAR, Descent, _stiffnesses

SHARE, LEFT = 1e-6, 3.0
ANYWHERE = np.array([-np.inf]), np.array([np.inf])


def descend(promised):
    """Search for the number 1 beside a residual that nothing changes, whose derivative promises a change."""
    tried = []

    def residuals(x):
        tried.append(float(x[0]))
        return np.array([x[0] - 1.0, LEFT]), np.array([[1.0], [promised]])

    descent = Descent(residuals, np.array([5.0]), SHARE)
    descent.run(ANYWHERE)
    return descent, tried


def test_a_search_finds_the_minimum_and_keeps_the_best_point():
    descent, tried = descend(0.0)
    assert descent.x[0] == pytest.approx(1.0, abs=1e-9)
    assert descent.cost == pytest.approx(0.5 * LEFT**2, rel=1e-12)
    assert len(tried) <= 4


@pytest.mark.parametrize("promised", [1e-3, 1e-4])
def test_a_search_ends_where_a_promised_gain_is_not_there(promised):
    descent, tried = descend(promised)
    # Where the promise would be kept.
    assert abs(descent.x[0] - 1.0) <= 2.0 * LEFT * promised
    assert 0.5 * LEFT**2 <= descent.cost <= 0.5 * LEFT**2 * (1.0 + 10.0 * SHARE)
    assert len(tried) <= 4


@pytest.mark.parametrize(
    ("far", "share"), [(np.inf, SHARE), (LEFT**2, SHARE), (0.0, FAR)]
)
def test_a_search_ends_early_only_where_it_ends_far_from_the_data(far, share):
    """Derivatives twice too steep: each try halves the distance. Half of 3^2 is left, and the start is above 3^2."""
    residuals = lambda x: (np.array([x[0] - 1.0, LEFT]), np.array([[2.0], [0.0]]))
    descent = Descent(residuals, np.array([10.0]), SHARE, far)
    descent.run(ANYWHERE)
    # the last try gained three times what is left, and less than the share
    left = descent.cost / (0.5 * LEFT**2) - 1.0
    assert share / 100.0 < left < share / 2.9


def test_bristles_to_try_bend_fully_after_a_tenth_of_a_step_to_a_tenth_of_all():
    """Steps of 1, 2 and 3 mm, and one at rest: 0.2 mm to 0.6 mm; the longer is at least ten times the shorter."""
    log = SimpleNamespace(durations=np.full(4, 0.1))
    speeds = np.array([0.01, 0.02, 0.03, 0.0])
    few = _stiffnesses(SimpleNamespace(logs=[log]), speeds, 0.5)
    assert few[[0, -1]] == pytest.approx([0.5 / 2e-4, 0.5 / 2e-3])
    many = _stiffnesses(SimpleNamespace(logs=[log] * 100), np.tile(speeds, 100), 0.5)
    assert many[[0, -1]] == pytest.approx([0.5 / 2e-4, 0.5 / 0.06])
