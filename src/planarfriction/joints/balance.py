"""Torque balance of a joint along a measured motion: the model, its least squares, and the search for its terms.

`tau = J a + o + gravity + friction`, smoothed as the measured torque is. In sliding, friction is `S(v) level +
asymmetry + sigma_2 v + viscous_asymmetry |v|` with `level = mu_c + rise exp(-(v/v_s)^2) + load |tau_motor -
tau_external|`; the bristles of LuGre are a lag of its first two parts over the path, exactly. A joint without bristles
needs no stiffness: its friction is a sign. An asymmetric level and an offset o of the sensor look alike, so there is
one of them.

All sets of terms are judged by the errors of logs that were left out: at each point of a grid of Stribeck speeds and
bends of the bristles, the balance is linear in all else. Its sums of squares are formed once for each log; a fit
without one log is then a solution of a few equations.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planarfriction.joints.loops.balance import Balance, follow_path, slide
from planarfriction.joints.problem import PARAMETERS, Values, least, slopes
from planarfriction.joints.smoothing import DELAYS, NORMAL, Rows

TERMS: dict[str, tuple[str, ...]] = {
    "gravity": ("gravity_sin", "gravity_cos"),
    "stribeck": ("rise", "v_s"),
    "load": ("load",),
    "bristles": ("sigma_0", "sigma_1"),
    "asymmetry": ("viscous_asymmetry", "asymmetry"),
}
"""Terms beside Coulomb and viscous friction, with their numbers."""

HUBER = 3.0
"""Error, in standard deviations, from which on it counts linearly."""

STEPS = 12
"""Most steps of a search."""


def predict(rows: Sequence[Rows], values: Values) -> list[np.ndarray]:
    """Compute the smoothed torque of each log at all of its rows, `[R]` [N m]."""
    numbers = Balance(**values)
    torques = []
    for each in rows:
        level = np.full_like(each.speed, numbers.mu_c)
        if numbers.rise:
            level += numbers.rise * np.exp(-((each.speed / numbers.v_s) ** 2))
        gravity = [numbers.gravity_sin, numbers.gravity_cos] @ each.linear[2:]
        viscous = [numbers.sigma_2, numbers.viscous_asymmetry] @ each.linear[:2]
        rest = numbers.inertia * each.acceleration + viscous + gravity
        weights = each.weights
        # The damping of bristles is a slope, which their smoothing takes as well.
        if numbers.sigma_0:
            weights = weights - numbers.sigma_1 / numbers.sigma_0 * each.sloping
        # the motor's torque less that of all else
        driving = rest + gravity - 2.0 * each.external
        friction = slide(numbers, weights, each.path, each.direction, level, driving)
        torque = each.low_passed(rest + friction, numbers.low_pass)
        torques.append(numbers.torque_offset + torque)
    return torques


def errors(rows: Sequence[Rows], values: Values) -> np.ndarray:
    """Compute modelled less measured torque at the fitted rows of all logs [N m]."""
    pairs = zip(predict(rows, values), rows, strict=True)
    return np.concatenate(
        [
            torque[log.fitted] - log.measured(values.get("delay", 0.0))
            for torque, log in pairs
        ]
    )


class Refined(NamedTuple):
    """Least squares of the model with one set of terms."""

    terms: tuple[str, ...]
    """Terms beside Coulomb and viscous friction."""
    values: dict[str, float]
    """Estimates by name."""
    spread: dict[str, float]
    """Standard errors by name, of logarithms for those that are searched by them."""
    error: np.ndarray
    """Model less measured torque at the fitted rows of all logs [N m]."""
    freedom: int
    """Degrees of freedom of the spread."""
    scores: np.ndarray
    """Error of each block as if it had been left out, squared and over the scatter."""
    scatter: np.ndarray
    """Scatter of the rows that are far from a reversal, and of those near one [N m]."""

    @property
    def score(self) -> float:
        """Sum of the scores."""
        return self.scores.sum()


def names_of(terms: Sequence[str], late: str = "delay") -> list[str]:
    """Return the names of what is estimated; `late` is "delay" or "low_pass"."""
    offset = [] if "asymmetry" in terms else ["torque_offset"]
    more = [name for term in TERMS if term in terms for name in TERMS[term]]
    return ["inertia", "mu_c", "sigma_2", *offset, late, *more]


RANGES = {
    "load": (-np.inf, PARAMETERS["load"].high),
    "delay": (DELAYS[0], DELAYS[-1]),
}
"""Ranges in which the errors change: beyond, an estimate is at its bound."""


def limited(values: Values) -> dict[str, float]:
    """Return numbers within `RANGES`."""
    inside = {
        name: min(max(values[name], low), high)
        for name, (low, high) in RANGES.items()
        if name in values
    }
    return {**values, **inside}


def refine(
    rows: Sequence[Rows],
    start: Values,
    terms: Sequence[str],
    scatter: np.ndarray | None = None,
    late: str = "delay",
) -> Refined:
    """Minimise the errors of the model, softened by Huber's function, with a delay or a low pass of the torque.

    Rows near reversals and others count by the `scatter` of each, which is estimated unless it is given. Standard
    errors are those of a sandwich over blocks, whose errors may be correlated.
    """
    names = names_of(terms, late)
    # an asymmetric level and an offset of the torque are one number
    offset = start.get("torque_offset", start.get("asymmetry", 0.0))
    defaults = {"torque_offset": offset, "asymmetry": offset, "delay": 0.0}
    known = {**defaults, **start}
    values = {name: known[name] for name in names}
    reversing = np.concatenate([each.reversing for each in rows])
    sizes = np.ones(2) if scatter is None else scatter

    def weighted(values: Values) -> np.ndarray:
        return errors(rows, limited(values)) / sizes[reversing]

    for _ in range(2 if scatter is None else 1):
        if scatter is None:
            size = np.abs(weighted(values) * sizes[reversing])
            least_size = max(0.3 * np.median(size), 1e-12)
            # of rows far from a reversal, and of those near one
            groups = (size[reversing == kind] for kind in (0, 1))
            sizes = np.array(
                [
                    max(NORMAL * np.median(each), least_size)
                    if len(each) > 20
                    else least_size
                    for each in groups
                ]
            )
        settings = {"loss": "huber", "f_scale": HUBER, "max_nfev": STEPS}
        values = limited(least(weighted, values, names, False, **settings))
    error = weighted(values)
    size = np.abs(error)
    pull = np.minimum(1.0, HUBER / np.maximum(size, 1e-9))
    jacobian = slopes(weighted, values, names, error)
    norms = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    jacobian /= norms
    inverse = np.linalg.pinv(jacobian.T @ (pull[:, None] * jacobian), rcond=1e-13)
    begins = np.flatnonzero(np.diff(blocks_of(rows), prepend=-1))
    gradients = np.add.reduceat((pull * error)[:, None] * jacobian, begins)
    spare = len(begins) - len(names)
    covariance = (
        inverse @ (gradients.T @ gradients) @ inverse * (len(begins) / max(spare, 1))
    )
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0)) / norms
    softened = np.where(size < HUBER, size**2, 2.0 * HUBER * size - HUBER**2)
    # to first order, what leaving a block out adds to its error
    leverage = 2.0 * np.einsum("bi,ij,bj->b", gradients, inverse, gradients)
    scores = np.add.reduceat(softened, begins) + leverage
    named = dict(zip(names, spread.tolist(), strict=True))
    return Refined(
        tuple(terms),
        values,
        named,
        error * sizes[reversing],
        max(spare, 2),
        scores,
        sizes,
    )


def blocks_of(rows: Sequence[Rows]) -> np.ndarray:
    """Return the number of the block of each fitted row of all logs."""
    return np.concatenate([each.block + 100_000 * i for i, each in enumerate(rows)])


COLUMNS = (
    "inertia",
    "torque_offset",
    "sigma_2",
    "viscous_asymmetry",
    "gravity_sin",
    "gravity_cos",
    "load",
    "mu_c",
    "rise",
)
"""Linear numbers of the balance, in the order of the columns; there is a column of `rise` for each Stribeck speed."""

RIGID = ("inertia", "mu_c", "sigma_2", "gravity_sin", "gravity_cos", "rise", "v_s")
"""Numbers of which the torque for the load is made: an error in the others would look like a load."""

POSITIVE = ("rise", "load")
"""Numbers that a set of terms must give a positive sign to count."""

RIDGE = 1e-10
"""Share of a normalised sum of squares that is added: columns may vanish."""

LEAST_LOGS = 3
"""Number of logs from which on logs are left out; of fewer logs, `PARTS` parts are."""

PARTS = 6
"""Parts that are left out in turn where there are few logs."""

WEAK = 1e-3
"""Least Coulomb level of a start, over the largest torque."""


class TermGrid(NamedTuple):
    """Numbers that are not linear, and that the search goes through."""

    v_s: np.ndarray
    """Stribeck speeds [rad/s]."""
    bends: np.ndarray
    """Deflections of the bristles at the Coulomb level [rad]."""


class Candidate(NamedTuple):
    """Solution with one set of terms at the best point of the grid."""

    terms: tuple[str, ...]
    """Terms."""
    score: float
    """Sum of squared errors of the rows that were left out."""
    values: dict[str, float]
    """Numbers from which the set is refined, by name."""


def search(
    rows: Sequence[Rows], grid: TermGrid, told: Sequence[str], allowed: Sequence[str]
) -> list[Candidate]:
    """Score all sets of the `allowed` terms that hold those that were `told`, best first.

    The load's column is made of the torques of the best set without it.
    """
    terms = [each for each in TERMS if each in allowed]
    sets = [
        each
        for count in range(len(terms) + 1)
        for each in itertools.combinations(terms, count)
        if {*told} <= {*each, "load"}
    ]
    folds = np.repeat(np.arange(len(rows)), [len(each.fitted) for each in rows])
    if len(rows) < LEAST_LOGS:
        blocks = np.unique(blocks_of(rows), return_inverse=True)[1]
        folds = blocks * PARTS // (blocks[-1] + 1)
    linear = np.concatenate([_linear(each) for each in rows])
    torques = np.concatenate(
        [np.stack([each.measured(delay) for delay in DELAYS], axis=1) for each in rows]
    )
    falls = [
        np.exp(-((each.speed[:, None] / np.append(np.inf, grid.v_s)) ** 2))
        for each in rows
    ]
    falling = _bent(rows, falls, grid)

    weak = WEAK * np.abs(torques).max()

    def scored(load: np.ndarray, sets: Sequence[tuple[str, ...]]) -> list[Candidate]:
        sums = []
        for columns in zip(load, falling, strict=True):
            table = np.hstack([linear, *columns, torques])
            masks = [folds == i for i in np.unique(folds)]
            sums.append([table[each].T @ table[each] for each in masks])
        found = [_best(each, np.array(sums), grid, weak) for each in sets]
        return sorted(found, key=lambda each: each.score)

    none = np.zeros_like(falling[..., :1])
    found = scored(none, [each for each in sets if "load" not in each])
    if "load" in allowed:
        loads = [_through(each, found[0].values) for each in rows]
        with_load = [each for each in sets if "load" in each]
        found += scored(_bent(rows, loads, grid), with_load)
    wanted = [each for each in found if {*told} <= {*each.terms}]
    return sorted(wanted, key=lambda each: each.score)


def _linear(rows: Rows) -> np.ndarray:
    """Compute the columns of one log that do not slide, at its fitted rows."""
    return np.column_stack(
        [rows.acceleration, np.ones_like(rows.speed), rows.linear.T]
    )[rows.fitted]


def _bent(
    rows: Sequence[Rows], levels: Sequence[np.ndarray], grid: TermGrid
) -> np.ndarray:
    """Compute the friction of levels `[R, L]` at the fitted rows, rigid and with each bend, `[1 + B, F, L]`."""
    found = []
    for each, level in zip(rows, levels, strict=True):
        sliding = each.direction[:, None] * level
        lagged = [
            sliding,
            *(follow_path(sliding, each.path / bend) for bend in grid.bends),
        ]
        found.append([each.smoothed(one)[each.fitted] for one in lagged])
    return np.concatenate(found, axis=1)


def _best(
    terms: tuple[str, ...], sums: np.ndarray, grid: TermGrid, least: float
) -> Candidate:
    """Fit a set of terms with each fold left out, and as a whole, at all points of the grid and with all delays.

    `sums` are the products of all columns, and of the torques with each delay, `[1 + B, folds, K, K]`.
    `least` is the least Coulomb level of a start [N m].
    """
    names = [
        name
        for name in COLUMNS
        if name in {*COLUMNS[:3], "mu_c", *(n for term in terms for n in TERMS[term])}
    ]
    speeds = len(grid.v_s) if "stribeck" in terms else 1
    columns = np.array([COLUMNS.index(name) for name in names]) + np.outer(
        range(speeds), np.array(names) == "rise"
    )
    left = sums[1:] if "bristles" in terms else sums[:1]
    whole = left.sum(axis=1, keepdims=True)
    # At last, nothing is left out.
    left = np.concatenate([left, np.zeros_like(whole)], axis=1)
    kept = whole - left
    delays = slice(-len(DELAYS), None)
    among = kept[:, :, columns[:, :, None], columns[:, None]]
    across = kept[:, :, columns, delays]
    size = np.sqrt(np.maximum(np.diagonal(among, axis1=-2, axis2=-1), 1e-300))[
        ..., None
    ]
    among = among / size / size.swapaxes(-2, -1) + RIDGE * np.eye(len(names))
    numbers = np.linalg.solve(among, across / size) / size
    costs = np.diagonal(kept, axis1=2, axis2=3)[:, :, None, delays] - (
        numbers * across
    ).sum(axis=-2)
    for row in (names.index(name) for name in POSITIVE if name in names):
        costs = np.where(numbers[..., row, :] > 0.0, costs, np.inf)
    score = 0.0
    for fold in range(costs.shape[1]):
        bend, speed, delay = np.unravel_index(
            np.argmin(costs[:, fold]), costs[:, fold].shape
        )
        # error of the solution on what was left out
        found = np.append(numbers[bend, fold, speed, :, delay], -1.0)
        places = np.append(columns[speed], delay - len(DELAYS))
        score += found @ left[bend, fold][np.ix_(places, places)] @ found
        score = score if np.isfinite(costs[bend, fold, speed, delay]) else np.inf
    values = dict(zip(names, found.tolist(), strict=False))
    more = {
        "asymmetry": values["torque_offset"],
        "mu_c": max(values["mu_c"], least),
        "rise": max(values.get("rise", 0.0), 1e-3 * least),
        "v_s": grid.v_s[speed],
        "load": min(max(values.get("load", 0.0), 0.0), PARAMETERS["load"].high - 0.05),
        "sigma_0": max(values["mu_c"], 1e-9) / grid.bends[bend],
        "sigma_1": 0.0,
        "delay": DELAYS[delay],
    }
    return Candidate(
        terms, score, {name: (values | more)[name] for name in names_of(terms)}
    )


def _through(rows: Rows, values: Values) -> np.ndarray:
    """Compute the size of the torque of the motor less that of all else, of a rigid model, `[R, 1]` [N m]."""
    rigid = {name: values[name] for name in RIGID if name in values}
    gravity = [
        values.get("gravity_sin", 0.0),
        values.get("gravity_cos", 0.0),
    ] @ rows.linear[2:]
    return np.abs(predict([rows], rigid)[0] + gravity - 2.0 * rows.external)[:, None]
