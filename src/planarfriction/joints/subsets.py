"""All sets of terms of a joint's torque balance, judged by the errors of logs that were left out.

At each point of a grid of Stribeck speeds and bends of the bristles, the balance is linear in all else. Its sums of
squares are formed once for each block of time; a fit without some blocks is then a solution of a few equations.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planarfriction.joints.balance import MOST_LOAD, TERMS, blocks_of
from planarfriction.joints.loops.runs import follow_path
from planarfriction.joints.smoothing import DELAYS, Rows

COLUMNS = (
    *("inertia", "torque_offset", "sigma_2", "mu_c"),
    *("gravity_sin", "gravity_cos", "rise", "load", "viscous_asymmetry"),
)
"""Linear numbers of the balance, in the order of the columns."""

POSITIVE = ("rise", "load")
"""Numbers that a set of terms must give a positive sign to count."""

RIDGE = 1e-10
"""Share of a normalised sum of squares that is added: columns may vanish."""

LEAST_LOGS = 3
"""Number of logs from which on logs are left out; of fewer logs, `PARTS` parts are."""

PARTS = 6
"""Parts that are left out in turn where there are few logs."""


class Grid(NamedTuple):
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
    """Numbers by name, those of missing terms being 0."""


class _Solution(NamedTuple):
    cost: float
    delay: int
    numbers: np.ndarray


def search(
    rows: Sequence[Rows], grid: Grid, told: Sequence[str], allowed: Sequence[str]
) -> list[Candidate]:
    """Score all sets of the `allowed` terms that hold those that were `told`, best first.

    The load's column is made of the torques of the best set without it.
    """
    loads = [np.zeros_like(each.speed) for each in rows]
    rest = [each for each in allowed if each != "load"]
    found = _scored(
        rows, grid, loads, _sets(rest, [each for each in told if each != "load"])
    )
    if "load" not in allowed:
        return found
    loads = [_through(each, found[0].values) for each in rows]
    return _scored(rows, grid, loads, _sets(allowed, told))


def _sets(allowed: Sequence[str], told: Sequence[str]) -> list[tuple[str, ...]]:
    """Return all sets of terms, in the order of `TERMS`."""
    terms = [each for each in TERMS if each in allowed]
    sets = (
        each
        for count in range(len(terms) + 1)
        for each in itertools.combinations(terms, count)
    )
    return [each for each in sets if set(told) <= set(each)]


def _scored(
    rows: Sequence[Rows],
    grid: Grid,
    loads: list[np.ndarray],
    sets: Sequence[tuple[str, ...]],
) -> list[Candidate]:
    sums = _sums(rows, grid, loads)
    logs = np.concatenate(
        [np.full(len(np.unique(each.block)), i) for i, each in enumerate(rows)]
    )
    blocks = np.arange(len(logs))
    folds = logs if len(rows) >= LEAST_LOGS else blocks * PARTS // len(blocks)
    return sorted(
        (_best(each, sums, folds, grid) for each in sets), key=lambda each: each.score
    )


def _sums(rows: Sequence[Rows], grid: Grid, loads: list[np.ndarray]) -> np.ndarray:
    """Compute the sums of products of each block, `[1 + bends, speeds, blocks, C + 1, C + D]`.

    Rows are those of `COLUMNS`, columns these and the torques with each delay; the last row holds the squares of the
    torques. The first bend is none.
    """
    tables = [
        _columns(each, grid, load) for each, load in zip(rows, loads, strict=True)
    ]
    linear, sliding, torques = (
        np.concatenate(each, axis=-2) for each in zip(*tables, strict=True)
    )
    parts = [
        slice(each[0], each[-1] + 1) for each in map(np.flatnonzero, blocks_of(rows))
    ]
    speeds = len(grid.v_s)
    count = len(COLUMNS)
    sums = []
    for bent in sliding:
        level = bent[:, :1]
        falls = bent[:, 1 : 1 + speeds]
        load = bent[:, 1 + speeds :]
        for i in range(speeds):
            table = np.column_stack(
                [
                    linear[:, :3],
                    level,
                    linear[:, 3:5],
                    falls[:, i],
                    load,
                    linear[:, 5:],
                    torques,
                ]
            )
            sums.append([table[part, :count].T @ table[part] for part in parts])
    products = np.array(sums).reshape(
        len(sliding), speeds, len(parts), count, count + len(DELAYS)
    )
    squares = np.zeros((*products.shape[:3], 1, products.shape[4]))
    squares[..., 0, count:] = [np.square(torques[part]).sum(axis=0) for part in parts]
    return np.concatenate([products, squares], axis=3)


def _columns(
    rows: Rows, grid: Grid, load: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the columns of one log at its fitted rows: linear ones, friction without and with bends, torques."""
    direction = rows.direction[:, None]
    fitted = rows.fitted
    falls = np.exp(-((rows.speed[:, None] / grid.v_s) ** 2))
    sliding = np.column_stack([direction, falls * direction, load[:, None] * direction])
    bent = [sliding]
    for bend in grid.bends:
        lagged = np.empty_like(sliding)
        follow_path(sliding, rows.path / bend, lagged)
        bent.append(lagged)
    moved = np.column_stack([rows.acceleration, np.ones_like(rows.speed), rows.speed])
    turned = rows.smoothed(
        np.column_stack([np.sin(rows.angle), np.cos(rows.angle), np.abs(rows.speed)])
    )
    linear = np.column_stack([moved, turned])[fitted]
    torques = np.stack([rows.measured(delay) for delay in DELAYS], axis=1)
    return linear, np.stack([rows.smoothed(each)[fitted] for each in bent]), torques


def _best(
    terms: tuple[str, ...], sums: np.ndarray, folds: np.ndarray, grid: Grid
) -> Candidate:
    """Fit a set of terms with each fold left out, and as a whole."""
    names = [name for name in COLUMNS if name in _names(terms)]
    columns = [COLUMNS.index(name) for name in names]
    positive = [names.index(name) for name in POSITIVE if name in names]
    bends = range(1, len(grid.bends) + 1) if "bristles" in terms else range(1)
    speeds = range(len(grid.v_s)) if "stribeck" in terms else range(1)
    points = list(itertools.product(bends, speeds))
    whole = {point: sums[point].sum(axis=0) for point in points}
    score = 0.0
    for fold in np.unique(folds):
        out = folds == fold
        left = {point: sums[point][out].sum(axis=0) for point in points}
        solutions = {
            point: _solve(whole[point] - left[point], columns, positive)
            for point in points
        }
        point = min(points, key=lambda each: solutions[each].cost)
        score += _error(left[point], columns, solutions[point])
    solutions = {point: _solve(whole[point], columns, positive) for point in points}
    bend, speed = min(points, key=lambda each: solutions[each].cost)
    best = solutions[bend, speed]
    values = dict.fromkeys(COLUMNS, 0.0) | dict(
        zip(names, best.numbers.tolist(), strict=True)
    )
    level = max(values["mu_c"], 1e-9)
    values["v_s"] = float(grid.v_s[speed])
    values["sigma_0"] = level / float(grid.bends[max(bend - 1, 0)])
    values["delay"] = float(DELAYS[best.delay])
    return Candidate(terms, score, values)


def _names(terms: Sequence[str]) -> set[str]:
    # An asymmetric level is the offset.
    return {
        *COLUMNS[:4],
        *(name for term in terms for name in TERMS[term]),
    }


def _solve(sums: np.ndarray, columns: list[int], positive: list[int]) -> _Solution:
    """Solve the normal equations for each delay; return the solution of the best."""
    count = len(COLUMNS)
    among = sums[np.ix_(columns, columns)]
    across = sums[columns, count:]
    size = np.sqrt(np.maximum(np.diag(among), 1e-300))
    numbers = np.linalg.solve(
        among / np.outer(size, size) + RIDGE * np.eye(len(size)), across / size[:, None]
    )
    numbers /= size[:, None]
    costs = sums[count, count:] - (numbers * across).sum(axis=0)
    for row in positive:
        costs = np.where(numbers[row] > 0.0, costs, np.inf)
    delay = int(np.argmin(costs))
    return _Solution(float(costs[delay]), delay, numbers[:, delay])


def _error(sums: np.ndarray, columns: list[int], solution: _Solution) -> float:
    """Compute the squared error of a solution on blocks that it was not fitted to."""
    if not np.isfinite(solution.cost):
        return np.inf
    count = len(COLUMNS)
    numbers = solution.numbers
    torque = count + solution.delay
    among = sums[np.ix_(columns, columns)]
    return float(
        sums[count, torque]
        - 2.0 * sums[columns, torque] @ numbers
        + numbers @ among @ numbers
    )


def _through(rows: Rows, values: dict[str, float]) -> np.ndarray:
    """Compute the size of the torque of the motor less that of all else, by the model itself, `[R]` [N m]."""
    gravity = values["gravity_sin"] * np.sin(rows.angle) + values[
        "gravity_cos"
    ] * np.cos(rows.angle)
    level = values["mu_c"] + values["rise"] * np.exp(
        -((rows.speed / values["v_s"]) ** 2)
    )
    friction = rows.smoothed(rows.direction * level + values["sigma_2"] * rows.speed)
    driving = values["inertia"] * rows.acceleration + 2.0 * (gravity - rows.external)
    return np.abs(driving + friction)


def started(candidate: Candidate, largest: float) -> dict[str, float]:
    """Return the numbers from which a candidate is refined; `largest` is the largest torque [N m]."""
    values = candidate.values
    return values | {
        "mu_c": max(values["mu_c"], 1e-3 * largest),
        "rise": max(values["rise"], 1e-6),
        "load": float(np.clip(values["load"], 0.0, MOST_LOAD - 0.05)),
        "sigma_1": 0.0,
        "low_pass": 0.0,
    }
