"""What compressed patches keep, as rows over the cells: moments, dissipations, mirror images."""

from __future__ import annotations

import math

import numpy as np

SAME_PLACE = 1e-6
"""Share of the patch's size by which mirrored cells may be off (rounding: 1e-16, cells: 1e-3)."""

SAME_WEIGHT = 1e-9
"""Relative difference of the weights of mirrored cells."""

INDEPENDENT = 1e-10
"""Relative singular value below which moments count as dependent on the others (on a line, or on few points)."""

MOST_CANDIDATES = 600
"""Cells (mirrored ones counted once) that a compression starts from; of larger patches, one in each box of a grid."""

ROWS_AT_ONCE = 4096
"""Cells whose dissipation is summed at once: bounds the memory."""

MIRRORS = ((-1, 1), (1, -1), (-1, -1))
"""Signs of (x, y) in the mirror images that are kept."""

SCORE_DIGITS = 5
"""Digits of what decides between cells: mirrored cells tie, and rounding must not decide."""


def scaled_positions(positions: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Positions about the centre of pressure in contact radii, `[N, 2]`."""
    offset = positions - weights @ positions
    radius = float(weights @ np.hypot(*offset.T))
    return offset / (radius or 1.0)


def directions(count: int) -> np.ndarray:
    """Directions of `(vx, vy, omega r)` spread evenly over half the sphere, on a Fibonacci spiral, `[count, 3]`."""
    step = np.arange(count) + 0.5
    z, turn = step / count, math.pi * (1.0 + math.sqrt(5.0)) * step
    level = np.sqrt(1.0 - z**2)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=-1)


def speeds(scaled: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Speed of each cell at each twist, `[K, N]`."""
    vx, vy, spin = twists.T[:, :, None]
    return np.hypot(vx - spin * scaled[:, 1], vy + spin * scaled[:, 0])


def dissipation(scaled: np.ndarray, weights: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """`Phi = sum w |v|` at each twist, `[K]`."""
    parts = range(0, len(scaled), ROWS_AT_ONCE)
    return sum(
        (speeds(scaled[i : i + ROWS_AT_ONCE], twists) @ weights[i : i + ROWS_AT_ONCE] for i in parts),
        start=np.zeros(len(twists)),
    )


def polynomials(scaled: np.ndarray, degree: int) -> np.ndarray:
    """Chebyshev products `T_i(x) T_j(y)`, `i + j <= degree`, over the box around the cells, `[M, N]`."""
    low, high = scaled.min(axis=0), scaled.max(axis=0)
    half = (high - low) / 2
    unit = (scaled - (low + high) / 2) / np.where(half > 0.0, half, 1.0)
    x, y = (np.polynomial.chebyshev.chebvander(column, degree).T for column in unit.T)
    return np.array([x[i] * y[j] for i in range(degree + 1) for j in range(degree + 1 - i)])


def summed(rows: np.ndarray, group: np.ndarray, groups: int) -> np.ndarray:
    """Sums of the columns of `rows` `[M, N]` over the groups, `[M, G]`."""
    result = np.zeros((groups, len(rows)))
    np.add.at(result, group, rows.T)
    return np.ascontiguousarray(result.T)


def independent(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal rows that span those of `rows` `[M, G]`, and the matrix that makes them from it."""
    left, values, right = np.linalg.svd(rows, full_matrices=False)
    rank = int((values > INDEPENDENT * values[0]).sum())
    return right[:rank], left[:, :rank].T / values[:rank, None]


def mirrored_groups(scaled: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Number of the group of each cell `[N]`: cells that mirror each other, where the whole patch does."""
    places = np.rint(scaled / (SAME_PLACE * np.abs(scaled).max())).astype(np.int64)
    keys, names = _key(places), np.arange(len(scaled))
    order = np.argsort(keys, kind="stable")
    for signs in MIRRORS:
        wanted = _key(places * signs)
        found = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)]
        if (keys[found] == wanted).all() and np.allclose(weights[found], weights, rtol=SAME_WEIGHT, atol=0.0):
            names = np.minimum(names, names[found])
    return np.unique(names, return_inverse=True)[1]


def _key(places: np.ndarray) -> np.ndarray:
    """One number for each place `[N, 2]` of the fine grid."""
    return places[:, 0] * 2**31 + places[:, 1]


def thinned(scaled: np.ndarray, group: np.ndarray) -> np.ndarray:
    """The groups with at most about `MOST_CANDIDATES` of them left, the others -1: one in each box of a grid."""
    first = np.unique(group, return_index=True)[1]
    if len(first) <= MOST_CANDIDATES:
        return group
    place = scaled[first]
    extent = np.ptp(place, axis=0)
    thin = extent < 1e-9 * extent.max()
    side = extent.max() / MOST_CANDIDATES if thin.any() else math.sqrt(extent.prod() / MOST_CANDIDATES)
    box = np.floor((place - place.min(axis=0)) / side)
    middle = np.abs((place - place.min(axis=0)) / side - box - 0.5).max(axis=1)
    order = np.lexsort([np.arange(len(place)), np.round(middle, SCORE_DIGITS), *box.T])
    new_box = np.r_[True, (np.diff(box[order], axis=0) != 0).any(axis=1)]
    chosen = np.full(len(first), -1)
    chosen[np.sort(order[new_box])] = np.arange(int(new_box.sum()))
    return chosen[group]
