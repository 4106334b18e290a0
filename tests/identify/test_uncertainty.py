"""Uncertainty of a fit: the sums behind it in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from planarfriction.identify.uncertainty import (
    FOLDS,
    LONGEST,
    Uncertainty,
    _held_out,
    _over_time,
    covariance,
    uncertainty_over_slides,
)


def test_votes_at_lags_count_with_weights_that_fall_linearly():
    """As the sum over lags (Newey and West 1987), for votes of two values at 60 samples."""
    slopes = np.random.default_rng(0).normal(size=(180, 2))
    residual = np.random.default_rng(1).normal(size=180)
    fit = SimpleNamespace(
        problem=SimpleNamespace(by_log=lambda rows: [rows.reshape(60, 3, 2)])
    )
    votes = (slopes * residual[:, None]).reshape(60, 3, 2).sum(axis=1)
    votes -= votes.mean(axis=0)
    expected = votes.T @ votes
    lags = int(LONGEST * 60)
    for lag in range(1, lags + 1):
        both = votes[lag:].T @ votes[:-lag]
        expected += (1.0 - lag / (lags + 1.0)) * (both + both.T)
    found = _over_time(fit, residual, slopes, np.zeros((1, 2)), 0.9, np.eye(2))
    assert found == pytest.approx(np.diag(expected), rel=1e-12)


@pytest.mark.parametrize(
    ("chi2", "strain", "held_out", "rejected"),
    [
        (1.0, 2.9, 1.9, False),
        (1.6, 0.0, 1.0, True),
        (1.0, 3.1, 1.0, True),
        (1.0, 0.0, 2.1, True),
    ],
)
def test_what_rejects_a_fit(chi2, strain, held_out, rejected):
    """More than noise, a disturbance that no rig has, or parts that it misses where it did not see them."""
    empty = np.zeros((0, 0))
    strains = [(strain, "load_drift 0.2")]
    tests = Uncertainty(
        empty, empty, empty, chi2, 1.5, strains, 0.0, np.full(5, held_out), np.zeros(0)
    )
    assert tests.rejected == rejected


def test_held_out_errors_count_by_what_noise_explains():
    """A value that only the first samples show is lost without them: errors are large, but noise is all there is."""
    random = np.random.default_rng(0)
    samples = 400
    slopes = random.normal(size=(samples, 3, 2))
    slopes[:, :, 1] = 0.0
    slopes[:3, :, 1] = 100.0
    slopes[150, :, 1] = 1.0
    slopes = slopes.reshape(-1, 2)
    noise = random.normal(size=3 * samples)
    residual = noise - slopes @ np.linalg.lstsq(slopes, noise, rcond=None)[0]
    problem = SimpleNamespace(
        by_log=lambda rows: [rows.reshape(-1, 3, 1)],
        channels=np.full((samples, 3), True),
        used=np.full(samples, True),
    )
    fit = SimpleNamespace(problem=problem, values=np.zeros(2))
    found, unseen = _held_out(fit, residual, slopes, np.zeros((2, 2)))
    assert np.sqrt(np.mean(unseen**2)) > 3.0
    # Four standard deviations of chance.
    assert found == pytest.approx(np.ones(FOLDS), abs=0.2)
    assert (_held_out(fit, 3.0 * residual, slopes, np.zeros((2, 2)))[0] > 2.4).all()


def test_slides_vote_as_one_observation_each():
    """`H^-1 (sum g g') H^-1 n/(n - 1)` of four slides with two samples each; from one alone H^-1."""
    random = np.random.default_rng(0)
    slopes = random.normal(size=(24, 2))
    residual = random.normal(size=24)
    votes = (slopes * residual[:, None]).reshape(4, 6, 2).sum(axis=1)
    bread = np.linalg.inv(slopes.T @ slopes)
    fit = SimpleNamespace(
        problem=SimpleNamespace(
            linearised=lambda values, sigma: (residual, slopes), by_log=lambda rows: rows.reshape(4, 2, 3, 2)
        ),
        coordinates=SimpleNamespace(slopes=lambda x: np.eye(2)), x=np.zeros(2), values=np.zeros(2),
        at_bound=np.zeros(2, dtype=bool), noise=np.ones((4, 3)), sigma=np.ones((8, 3)),
    )  # fmt: skip
    found, moved, _ = uncertainty_over_slides(fit)
    np.testing.assert_allclose(
        found, bread @ (votes.T @ votes) @ bread * 4.0 / 3.0, rtol=1e-9
    )
    np.testing.assert_allclose(moved, votes @ bread, rtol=1e-9)
    fit.noise[1:] = np.inf
    np.testing.assert_allclose(uncertainty_over_slides(fit)[0], bread, rtol=1e-9)


@pytest.mark.parametrize("small", [0.0, 1e-310, 1e-160, 1e-155])
def test_a_value_that_moves_next_to_nothing_has_an_infinite_variance(small):
    rows = np.array([[1.0, small], [2.0, 0.0], [0.5, small]])
    found = covariance(rows, np.full(2, True))
    np.testing.assert_allclose(found, [[1.0 / 5.25, 0.0], [0.0, np.inf]], rtol=1e-12)
