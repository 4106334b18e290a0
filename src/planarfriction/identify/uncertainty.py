"""How sure a fit is: whether it leaves more than noise, how far off values may be, how it predicts what is held out.

The noise is estimated from the jitter of the signals, not from what a fit leaves; so a fit can be rejected. Where
residuals are correlated in time, intervals follow that (Newey and West 1987), and are never narrower than without.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planarfriction.identify.least_squares import covariance
from planarfriction.identify.search import Fit

EXCESS = 1.25
"""Mean square of the residuals over that of the noise that is still put down to the noise's own estimate."""

CHANCE = 4.0
"""Standard deviations of that mean square, for independent residuals, that are put down to chance; and of the scale of
the load cell."""

BLOCKS, FOLDS = 20, 5
"""Blocks that each log is cut into, every fifth of which is held out in turn."""

LONGEST = 0.1
"""Longest lag that residuals are correlated over, as a share of the log."""

DRAWS = 24
"""Errors of the twists that are drawn."""

ALLOWANCE = 1.1
"""Factor on all standard errors for what linear ones leave out: curvature, steps, and the error of the noise itself."""

HUGE = 1e200
"""Variance that stands for an infinite one while it is turned into other coordinates."""

RIDGE = 1e-10
"""Share of the largest curvature that keeps what no sample depends on where it is."""


@dataclass(frozen=True)
class Uncertainty:
    """What is left of a fit, and what follows."""

    covariance: np.ndarray
    """Of the values of contact and rig, `[F + K, F + K]`."""
    jacobian: np.ndarray
    """Derivatives of the scaled residuals `[M, F + K]`."""
    excess: float
    """Mean square of the residuals over that of the noise [-]."""
    limit: float
    """Above which excess the fit is rejected."""
    strain: float
    """How many times its width the scale of the load cell was moved [-]."""
    neighbours: float
    """Correlation of residuals one sample apart [-]."""
    held_out: np.ndarray
    """Root mean square over the noise of what a fit without it leaves of each fold [-], `[FOLDS]`."""
    unseen: np.ndarray
    """Scaled residuals `[M]` of each sample where a fit without its fold predicts it."""

    @property
    def rejected(self) -> bool:
        """Whether the fit leaves more than the noise, or only a load cell that nobody has would make it do so."""
        return bool(self.excess > self.limit or self.strain > CHANCE)

    @property
    def score(self) -> float:
        """Root mean square over the noise of what was held out [-]."""
        return float(np.sqrt(np.mean(self.held_out**2)))


def uncertainty(fit: Fit) -> Uncertainty:
    """The uncertainty of a fit."""
    problem, count = fit.problem, len(fit.problem.names)
    off, jacobian = problem.linearised(fit.values, fit.spread)
    pull = _pull(fit)
    # What rests on zero is as uncertain as its neighbours let it be; other bounds are no estimates.
    low = fit.coordinates.bounds()[0] == 0.0
    free = ~fit.at_bound
    free[:count] |= low & (fit.values[:count] <= 1e-9 + np.abs(fit.coordinates.scale) * 1e-9)
    excess, neighbours = _left(fit, off)
    measured = sum(
        int(log.channels.sum()) * len(log.time[used]) for log, used in zip(problem.logs, problem.used, strict=True)
    )
    plain = _covariance(fit, np.concatenate([jacobian, pull]), free) * max(excess, 1.0)
    widths = _over_time(fit, off, jacobian, pull, neighbours, free)
    factor = np.sqrt(np.maximum(widths / np.diag(plain), 1.0))
    factor = np.where(np.isfinite(factor), factor, 1.0)
    spread = plain * np.outer(factor, factor) + _of_twists(fit, jacobian, pull, free)
    return Uncertainty(
        spread * ALLOWANCE**2,
        jacobian,
        excess,
        EXCESS + CHANCE * np.sqrt(2.0 / measured),
        problem.rig.strain(fit.values[count:]),
        neighbours,
        *_held_out(fit, off, jacobian, pull),
    )


def _pull(fit: Fit) -> np.ndarray:
    """Derivatives `[F + K, F + K]` of what pulls contact and rig to their starts."""
    count, widths = len(fit.problem.names), fit.problem.rig.with_drift(fit.values[len(fit.problem.names) :])
    result = np.zeros((count + len(widths),) * 2)
    slopes = fit.coordinates.slopes(fit.x[:count])
    result[:count, :count] = fit.coordinates.prior(fit.x[:count])[1] @ np.linalg.pinv(slopes)
    result[count:, count:] = np.diag(1.0 / widths)
    return result


def _covariance(fit: Fit, rows: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Covariance of the values, with what is `free` of the coordinates; infinite where the data say nothing."""
    count = len(fit.problem.names)
    slopes = np.eye(len(fit.values))
    slopes[:count, :count] = fit.coordinates.slopes(fit.x[:count])
    inner = np.minimum(covariance(rows @ slopes, free), HUGE)
    result = slopes @ inner @ slopes.T
    diagonal = np.diag(result)
    result[np.diag_indices(len(result))] = np.where(diagonal >= 1e-50 * HUGE, np.inf, diagonal)
    return result


def _left(fit: Fit, off: np.ndarray) -> tuple[float, float]:
    """Mean square of the scaled residuals, and their correlation one sample apart."""
    squares = products = pairs = 0.0
    samples = 0
    for rows, log in _by_log(fit, off[:, None]):
        each = rows[:, log.channels, 0]
        samples += each.size
        squares += float((each**2).sum())
        products += float((each[1:] * each[:-1]).sum())
        pairs += 0.5 * float((each[1:] ** 2 + each[:-1] ** 2).sum())
    return squares / max(samples, 1), products / pairs if pairs > 0.0 else 0.0


def _by_log(fit: Fit, rows: np.ndarray):
    """Rows `[T, 3, C]` of each log out of flat ones `[M, C]`."""
    at = 0
    for log, used in zip(fit.problem.logs, fit.problem.used, strict=True):
        size = 3 * len(log.time[used])
        yield rows[at : at + size].reshape(-1, 3, rows.shape[1]), log
        at += size


def _over_time(fit: Fit, off, jacobian, pull, neighbours: float, free: np.ndarray) -> np.ndarray:
    """Variances `[F + K]` with the covariance that the votes `J' r` of the samples have over time.

    Weights fall linearly with the lag; the longest is three times the memory of the residuals, `(1 + c)/(1 - c)`
    samples of their correlation c, and at least the cube root of the number of samples.
    """
    bread = _covariance(fit, np.concatenate([jacobian, pull]), free)
    bread = np.where(np.isfinite(bread), bread, 0.0)
    filling = pull.T @ pull
    for votes, _ in _by_log(fit, jacobian * off[:, None]):
        vote = votes.sum(axis=1)
        vote = vote - vote.mean(axis=0)
        near = min(max(neighbours, 0.0), 0.999)
        lags = int(max(np.cbrt(len(vote)), 3.0 * (1.0 + near) / (1.0 - near)))
        lags = max(min(lags, int(LONGEST * len(vote))), 1)
        filling = filling + vote.T @ vote
        for lag in range(1, lags + 1):
            both = vote[lag:].T @ vote[:-lag]
            filling = filling + (1.0 - lag / (lags + 1.0)) * (both + both.T)
    return np.maximum(np.einsum("ij,jk,ik->i", bread, filling, bread), 0.0)


def _of_twists(fit: Fit, jacobian: np.ndarray, pull: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Covariance of the values from the errors that the twists still have: how far errors drawn as theirs move them."""
    moved = fit.problem.shaken(fit.values, fit.spread, DRAWS)
    if moved is None:
        return np.zeros((len(fit.values),) * 2)
    bread = _covariance(fit, np.concatenate([jacobian, pull]), free)
    shifts = moved @ jacobian @ np.where(np.isfinite(bread), bread, 0.0)
    return shifts.T @ shifts / len(shifts)


def _held_out(fit: Fit, off, jacobian, pull) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of each fold where the others alone were fitted, to first order: root mean squares, and all `[M]`."""
    count = len(fit.values)
    fold, seen = [], []
    for rows, log in _by_log(fit, off[:, None]):
        place = np.arange(len(rows)) * BLOCKS // len(rows) % FOLDS
        fold.append(np.repeat(place, 3))
        seen.append(np.tile(log.channels, len(rows)))
    fold, seen = np.concatenate(fold), np.concatenate(seen)
    size = np.maximum(np.linalg.norm(np.concatenate([jacobian, pull]), axis=0), np.finfo(float).tiny)
    slopes, base = jacobian / size, pull / size
    whole = slopes.T @ slopes + base.T @ base + RIDGE * np.eye(count)
    result, unseen = [], np.empty_like(off)
    for k in range(FOLDS):
        out = fold == k
        kept = whole - slopes[out].T @ slopes[out]
        move = np.linalg.lstsq(kept, slopes[out].T @ off[out], rcond=None)[0]
        unseen[out] = off[out] + slopes[out] @ move
        result.append(np.sqrt(np.mean(unseen[out & seen] ** 2)))
    return np.array(result), unseen
