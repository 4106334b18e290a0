"""Uncertainty of a fit: the sums behind it in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from planarfriction.identify.uncertainty import LONGEST, Uncertainty, _over_time


def test_votes_at_lags_count_with_weights_that_fall_linearly():
    """As the sum over lags (Newey and West 1987), for votes of two values at 60 samples."""
    slopes, residual = np.random.default_rng(0).normal(size=(180, 2)), np.random.default_rng(1).normal(size=180)
    fit = SimpleNamespace(problem=SimpleNamespace(by_log=lambda rows: [rows.reshape(60, 3, 2)]))
    votes = (slopes * residual[:, None]).reshape(60, 3, 2).sum(axis=1)
    votes -= votes.mean(axis=0)
    expected, lags = votes.T @ votes, int(LONGEST * 60)
    for lag in range(1, lags + 1):
        both = votes[lag:].T @ votes[:-lag]
        expected += (1.0 - lag / (lags + 1.0)) * (both + both.T)
    found = _over_time(fit, residual, slopes, np.zeros((1, 2)), 0.9, np.eye(2))
    assert found == pytest.approx(np.diag(expected), rel=1e-12)


@pytest.mark.parametrize(
    ("chi2", "strain", "held_out", "rejected"),
    [(1.0, 2.9, 2.9, False), (1.6, 0.0, 1.0, True), (1.0, 3.1, 1.0, True), (1.0, 0.0, 25.0, True)],
)
def test_what_rejects_a_fit(chi2, strain, held_out, rejected):
    """More than noise, a disturbance that no rig has, or parts that it misses where it did not see them."""
    empty, strains = np.zeros((0, 0)), [(strain, "load_drift 0.2")]
    tests = Uncertainty(empty, empty, empty, chi2, 1.5, strains, 0.0, np.full(5, held_out), np.zeros(0))
    assert tests.rejected == rejected
