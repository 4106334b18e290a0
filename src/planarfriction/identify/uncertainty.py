"""Uncertainty of a fit: covariance of its values, a test for more than noise, and the prediction of held-out parts.

The noise is estimated from the jitter of the signals, not from what a fit leaves; so a fit can be rejected. Where
residuals are correlated in time, intervals follow that (Newey and West 1987), and are never narrower than without. Of
slides, each counts as one observation. A score test says how far the residuals would move parameters that a fit held:
for each, one Gauss-Newton step of it together with all that was fitted, from where the fit ended.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.identify.parameters import ALL, LAW, Coordinates, fitted_law
from planarfriction.identify.sensor_errors import TINY

EXCESS = 1.25
"""Largest reduced chi-square that is still put down to the estimate of the noise."""

CHANCE = 4.0
"""Standard deviations of the reduced chi-square, for independent residuals, that are put down to chance."""

STRAIN = 3.0
"""Standard deviations a priori of a sensor error above which a fit is
rejected."""

HELD_OUT = 2.0
"""Errors on held-out parts, over those that the noise explains, above which a fit is
rejected."""

BLOCKS = 20
"""Number of blocks that each log is cut into."""

FOLDS = 5
"""Number of parts of a log, each of which is held out in turn: every fifth block."""

LONGEST = 0.1
"""Longest lag over which residuals may be correlated, as a share of the log."""

DRAWS = 24
"""Number of drawn errors of the twists."""

ALLOWANCE = 1.1
"""Factor on all standard errors for what linear ones leave out: curvature, steps, and the error of the noise itself."""

HUGE = 1e200
"""Variance that stands for an infinite one during a change of coordinates."""

RIDGE = 1e-10
"""Share of the largest curvature that holds parameters on which no sample depends."""

NEAR = 4.0
"""Mean square of the residuals over that of the noise up to which a rough fit is near the data: steps are coarse."""


class Fit(NamedTuple):
    """Problem with its best values."""

    problem: Any
    """`LeastSquaresProblem` that was solved."""
    coordinates: Coordinates
    x: np.ndarray
    """Coordinates `[F + K]`."""
    values: np.ndarray
    """Values `[F + K]`."""
    at_bound: np.ndarray
    """Mask of the coordinates that lie on a bound, `[F + K]`."""
    noise: np.ndarray
    """Noise of each channel, `[3]`, or of the channels of each slide, `[S, 3]`."""
    sigma: np.ndarray
    """Standard deviation of each residual, `[T, 3]` of all logs or slides one after the other."""
    starts: tuple[int, int]
    """Number of starting points that led to this minimum, and number of all."""
    cost: float
    """Half the sum of the squared residuals."""

    @property
    def near(self) -> bool:
        """True if hardly more than noise is left."""
        return 2.0 * self.cost <= NEAR * self.problem.numbers


class Uncertainty(NamedTuple):
    """Covariance and residuals of a fit of logs, with its tests."""

    covariance: np.ndarray
    """Covariance of the values of contact and rig, `[F + K, F + K]`."""
    jacobian: np.ndarray
    """Derivatives of the scaled residuals with respect to the values, `[M, F + K]`."""
    pull: np.ndarray
    """Derivatives of the pulls to the starts with respect to the values, `[F + K, F + K]`."""
    reduced_chi2: float
    """Mean square of the residuals over that of the noise [-]."""
    limit: float
    """Largest reduced chi-square for which the fit is not rejected."""
    strains: list[tuple[float, str]]
    """Disturbances of the rig over their standard deviations a priori [-], and in words; the largest first."""
    neighbours: float
    """Correlation of residuals one sample apart [-]."""
    held_out: np.ndarray
    """Errors on each fold of a fit without it, over those that the noise explains [-], `[FOLDS]`."""
    unseen: np.ndarray
    """Scaled residuals `[M]` of each sample for a fit without its fold."""

    @property
    def rejected(self) -> bool:
        """True if the fit leaves more than the noise, here or in held-out parts, or asks for a rig that nobody has."""
        return bool(
            self.reduced_chi2 > self.limit
            or self.score > HELD_OUT
            or self.strain > STRAIN
        )

    @property
    def strain(self) -> float:
        """Largest sensor error over its standard deviation a priori [-]."""
        return self.strains[0][0] if self.strains else 0.0

    @property
    def score(self) -> float:
        """Errors on held-out parts over those that the noise explains [-]."""
        return float(np.sqrt(np.mean(self.held_out**2)))


def uncertainty(fit: Fit) -> Uncertainty:
    """Compute the uncertainty of a fit of logs."""
    problem = fit.problem
    count = len(problem.names)
    residual, jacobian = problem.linearised(fit.values, fit.sigma)
    coordinates = fit.coordinates
    # the pull of contact and rig to their starts
    pull = np.linalg.solve(coordinates.slopes(fit.x).T, coordinates.prior(fit.x)[1]).T
    pull[count:, count:] = np.diag(1.0 / problem.rig.with_drift(fit.values[count:]))
    # A value that rests on zero is as uncertain as its neighbours let it be; other bounds are no estimates.
    low = coordinates.bounds()[0] == 0.0
    free = ~fit.at_bound | (low & (fit.values <= 1e-9 + coordinates.scale * 1e-9))
    measured = problem.channels[problem.used].sum()
    reduced_chi2 = float(residual @ residual / max(measured, 1))
    rows = list(problem.by_log(residual[:, None]))
    now = np.concatenate([each[1:].ravel() for each in rows])
    before = np.concatenate([each[:-1].ravel() for each in rows])
    pairs = 0.5 * (now @ now + before @ before)
    neighbours = float(now @ before / pairs) if pairs > 0.0 else 0.0
    inverse = covariance_of(fit, np.concatenate([jacobian, pull]), free)
    plain = inverse * max(reduced_chi2, 1.0)
    bread = finite(inverse)
    correlated = _over_time(fit, residual, jacobian, pull, neighbours, bread)
    # no variance over an infinite one: a factor of 1
    factor = np.sqrt(np.maximum(correlated / np.diag(plain), 1.0))
    moved = problem.twist_residuals(fit.values, fit.sigma, DRAWS)
    shifts = moved @ jacobian @ bread
    whole = plain * np.outer(factor, factor) + shifts.T @ shifts / len(shifts)
    return Uncertainty(
        whole * ALLOWANCE**2,
        jacobian,
        pull,
        reduced_chi2,
        EXCESS + CHANCE * np.sqrt(2.0 / measured),
        problem.rig.strains(fit.values[count:]),
        neighbours,
        *_held_out(fit, residual, jacobian, pull),
    )


def uncertainty_over_slides(fit: Fit) -> tuple[np.ndarray, ...]:
    """Compute the covariance `[F, F]` of a fit of slides from the spread over them.

    Each slide votes as one observation: `H^-1 (sum g g') H^-1 n/(n - 1)` with its vote `g = J' r`. Also returns the
    change `[S, F]` of the values without each slide, and the derivatives `[M, F]` of the scaled residuals.
    """
    residual, jacobian = fit.problem.linearised(fit.values, fit.sigma)
    rows = fit.problem.by_log(jacobian * residual[:, None])
    votes = np.array([each.sum(axis=(0, 1)) for each in rows])
    bread = covariance_of(fit, jacobian, ~fit.at_bound)
    if not np.isfinite(bread).all():
        return bread, np.zeros_like(votes), jacobian
    moved = votes @ bread
    if np.isfinite(fit.noise).all(axis=-1).sum() < 2:
        return bread, moved, jacobian
    return moved.T @ moved * len(votes) / (len(votes) - 1), moved, jacobian


def covariance_of(fit: Fit, rows: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Compute the covariance of the values with the `free` coordinates; infinite where the data say nothing."""
    slopes = fit.coordinates.slopes(fit.x)
    inner = np.minimum(covariance(rows @ slopes, free), HUGE)
    result = slopes @ inner @ slopes.T
    unknown = np.diag(np.diag(result) >= 1e-50 * HUGE)
    return np.where(unknown, np.inf, result)


def _over_time(
    fit: Fit, residual, jacobian, pull, neighbours: float, bread: np.ndarray
) -> np.ndarray:
    """Compute variances `[F + K]` with the covariance that the votes `J' r` of the samples have over time.

    Weights fall linearly with the lag; the longest is three times the memory of the residuals, `(1 + c)/(1 - c)`
    samples of their correlation c, and at least the cube root of the number of samples.
    """
    filling = pull.T @ pull
    for votes in fit.problem.by_log(jacobian * residual[:, None]):
        vote = votes.sum(axis=1)
        vote = vote - vote.mean(axis=0)
        near = min(max(neighbours, 0.0), 0.999)
        lags = int(max(np.cbrt(len(vote)), 3.0 * (1.0 + near) / (1.0 - near)))
        lags = max(min(lags, int(LONGEST * len(vote))), 1)
        # weights that fall linearly are those of sums over a window that slides over the samples
        zeros = np.zeros((lags + 1, vote.shape[1]))
        upto = np.cumsum(np.concatenate([zeros, vote, zeros[1:]]), axis=0)
        sums = upto[lags + 1 :] - upto[: -lags - 1]
        filling = filling + sums.T @ sums / (lags + 1.0)
    return np.maximum(np.einsum("ij,jk,ik->i", bread, filling, bread), 0.0)


def _held_out(fit: Fit, residual, jacobian, pull) -> tuple[np.ndarray, np.ndarray]:
    """Compute the errors on each fold of a fit of the others, to first order, and all residuals `[M]` of such fits.

    Noise leaves residuals `r` of covariance `I - H` in a fold of M, and `e = (I - H)^-1 r` if it is held out, so that
    `r' e/M` is 1 in the mean: also if little but this fold shows a parameter, and `e` is large.
    """
    problem = fit.problem
    counts = [len(each) for each in problem.by_log(residual[:, None])]
    places = [np.arange(count) * BLOCKS // count % FOLDS for count in counts]
    fold = np.repeat(np.concatenate(places), 3)
    seen = problem.channels[problem.used].ravel()
    rows, size = _of_unit_columns(np.concatenate([jacobian, pull]))
    slopes = rows[: len(jacobian)]
    whole = rows.T @ rows + RIDGE * np.eye(len(size))
    result = []
    unseen = np.zeros_like(residual)
    for k in range(FOLDS):
        out = fold == k
        kept = whole - slopes[out].T @ slopes[out]
        move = np.linalg.lstsq(kept, slopes[out].T @ residual[out], rcond=None)[0]
        unseen[out] = residual[out] + slopes[out] @ move
        result.append(np.sqrt(max(np.mean((residual * unseen)[out & seen]), 0.0)))
    return np.array(result), unseen


def _of_unit_columns(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Divide the columns of rows `[M, F]` by their lengths; returns them and the lengths `[F]`."""
    size = np.maximum(np.linalg.norm(rows, axis=0), TINY)
    return rows / size, size


# ---------------------------------------------------------------------- covariance of least squares


def finite(matrix: np.ndarray) -> np.ndarray:
    """Return the matrix with zeros in place of infinite numbers."""
    return np.where(np.isfinite(matrix), matrix, 0.0)


def covariance(jacobian: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Compute the covariance `(J' J)^-1`, `[F, F]`, of least squares whose residuals have unit variance.

    Parameters that are not `free` (`[F]` of bool: on a bound) have the variance of a fit of that parameter alone, and
    no part in the others. One that moves no residual has an infinite variance; a combination that moves none
    has a huge one, so that all in it show it.
    """
    jacobian = np.asarray(np.linalg.qr(jacobian, mode="r"))
    size = np.linalg.norm(jacobian, axis=0)
    moves = size**2 * HUGE > 1.0
    seen = free & moves
    result = np.diag(np.where(moves, 1.0 / np.where(moves, size, 1.0) ** 2, np.inf))
    if seen.any():
        unit = jacobian[:, seen] / size[seen]
        _, strengths, axes = np.linalg.svd(unit, full_matrices=False)
        strengths = np.maximum(strengths, 1e-12 * strengths[0])
        inner = (axes.T / strengths**2) @ axes
        result[np.ix_(seen, seen)] = inner / np.outer(size[seen], size[seen])
    return result


def correlations(covariance: np.ndarray) -> np.ndarray:
    """Return the correlation matrix `[F, F]`; zero with a parameter that has no finite variance."""
    errors = np.sqrt(np.diag(covariance))
    usable = np.isfinite(errors) & (errors > 0.0)
    # infinite where nothing is known: the quotient is zero there
    safe = np.where(usable, errors, np.inf)
    result = finite(covariance) / np.outer(safe, safe)
    result[np.diag_indices(len(errors))] = 1.0
    return np.clip(result, -1.0, 1.0)


DENIED = 4.0
"""Standard errors by which the residuals must move a held value to deny it."""


class Pull(NamedTuple):
    """Parameter that was held, and the step that the residuals ask of it."""

    name: str
    value: float
    """Value at which it was held [SI]."""
    step: float
    """Step [SI]."""
    error: float
    """Standard error of the step [SI]."""
    moves: np.ndarray
    """Steps of the estimates along with it [SI], `[F]`."""

    @property
    def agrees(self) -> bool:
        """True if the residuals agree with the value."""
        return abs(self.step) <= DENIED * self.error

    def __str__(self) -> str:
        unit = ALL[self.name].unit.replace("-", "")
        text = f"{self.name} is fixed at {self.value:.3g} {unit}".rstrip()
        if not self.error < abs(self.value):
            return f"{text}; the data do not show it"
        to = self.value + self.step
        low = ALL[self.name].low
        free = f"{to:.3g} +/- {self.error:.2g}" if to > low else f"below {low:g}"
        return f"{text}; the residuals {'agree' if self.agrees else 'contradict it'}: {free} if it were free"


def pulls_of_held(fit: Fit, u: Uncertainty) -> list[Pull]:
    """Return the parameters of the law that a fit of logs held, with the steps that its residuals ask of them."""
    problem = fit.problem
    count = len(problem.names)
    held = [name for name in LAW if name not in (*problem.names, "breakaway_ratio")]
    if not held:
        return []
    law = fitted_law(problem.law, problem.by_name(fit.values))
    values = [getattr(law, name) for name in held]
    residual, slopes = problem.slopes_of(held, np.array(values), fit.values, fit.sigma)
    # values of the rig that lie on a bound count all the same
    free = ~fit.at_bound | (np.arange(len(fit.values)) >= count)
    rows = np.concatenate([u.jacobian, u.pull]) * free
    below = np.zeros(len(u.pull))
    result = []
    for i, (name, value) in enumerate(zip(held, values, strict=True)):
        if not slopes[:, i].any():
            result.append(Pull(name, value, 0.0, np.inf, np.zeros(count)))
            continue
        column = np.append(slopes[:, i], below)
        both, size = _of_unit_columns(np.column_stack([rows, column]))
        curvature = np.linalg.inv(both.T @ both + RIDGE * np.eye(len(size)))
        # at the minimum, what was fitted has no slope left; its remainder is the pull's
        score = slopes[:, i] @ residual / size[-1]
        step = -score * curvature[:, -1] / size
        error = np.sqrt(curvature[-1, -1] * max(u.reduced_chi2, 1.0)) / size[-1]
        result.append(Pull(name, value, step[-1], error, step[:count]))
    return result
