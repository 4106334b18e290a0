"""All sets of terms of a joint's torque balance, judged by the errors of logs that were left out.

At each point of a grid of Stribeck speeds and bends of the bristles, the balance is linear in all else. Its sums of
squares are formed once for each log; a fit without one log is then a solution of a few equations.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planarfriction.joints.balance import TERMS, blocks_of, names_of, predict
from planarfriction.joints.loops.balance import follow_path
from planarfriction.joints.numbers import PARAMETERS, Values
from planarfriction.joints.smoothing import DELAYS, Rows

COLUMNS = (
    *(
        "inertia",
        "torque_offset",
        "sigma_2",
        "viscous_asymmetry",
        "gravity_sin",
        "gravity_cos",
    ),
    *("load", "mu_c", "rise"),
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
    ]
    sets = [each for each in sets if {*told} <= {*each, "load"}]
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
        tables = (
            np.hstack([linear, *columns, torques])
            for columns in zip(load, falling, strict=True)
        )
        sums = np.array(
            [
                [table[folds == i].T @ table[folds == i] for i in np.unique(folds)]
                for table in tables
            ]
        )
        return sorted(
            (_best(each, sums, grid, weak) for each in sets),
            key=lambda each: each.score,
        )

    found = scored(
        np.zeros_like(falling[..., :1]), [each for each in sets if "load" not in each]
    )
    if "load" in allowed:
        loads = [_through(each, found[0].values) for each in rows]
        found += scored(
            _bent(rows, loads, grid), [each for each in sets if "load" in each]
        )
    return sorted(
        (each for each in found if {*told} <= {*each.terms}),
        key=lambda each: each.score,
    )


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
        "v_s": float(grid.v_s[speed]),
        "load": min(max(values.get("load", 0.0), 0.0), PARAMETERS["load"].high - 0.05),
        "sigma_0": max(values["mu_c"], 1e-9) / float(grid.bends[bend]),
        "sigma_1": 0.0,
        "delay": float(DELAYS[delay]),
    }
    return Candidate(
        terms, float(score), {name: (values | more)[name] for name in names_of(terms)}
    )


def _through(rows: Rows, values: Values) -> np.ndarray:
    """Compute the size of the torque of the motor less that of all else, of a rigid model, `[R, 1]` [N m]."""
    rigid = {name: values[name] for name in RIGID if name in values}
    gravity = [
        values.get("gravity_sin", 0.0),
        values.get("gravity_cos", 0.0),
    ] @ rows.linear[2:]
    return np.abs(predict([rows], rigid)[0] + gravity - 2.0 * rows.external)[:, None]
