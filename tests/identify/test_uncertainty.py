"""Uncertainty of a fit: the sums behind it in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from planarfriction.identify.uncertainty import LONGEST, _over_time


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
