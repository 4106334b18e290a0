"""Rows over the cells that compressed patches preserve: moments and dissipations."""

from __future__ import annotations

import math

import numpy as np

NO_DISTANCE = 1e-12
"""Distance from the centre of pressure that is rounding, in contact radii."""

INDEPENDENT = 1e-10
"""Relative singular value below which moments count as dependent on the others (on a line, or on few points)."""

MOST_CANDIDATES = 600
"""Cells that a compression starts from; of larger patches, one in each box of a grid."""

ROWS_AT_ONCE = 4096
"""Cells whose dissipation is summed at once: bounds the memory."""

SCORE_DIGITS = 5
"""Digits of what decides between cells: cells of one pressure tie, and rounding must not decide."""


def scaled_positions(positions: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the positions about the centre of pressure in contact radii, `[N, 2]`."""
    offset = positions - weights @ positions
    radius = float(weights @ np.hypot(*offset.T))
    return offset / (radius or 1.0)


def directions(count: int) -> np.ndarray:
    """Return `(vx, vy, omega r)` spread evenly over half the sphere, on a Fibonacci spiral, `[count, 3]`."""
    step = np.arange(count) + 0.5
    z, turn = step / count, math.pi * (1.0 + math.sqrt(5.0)) * step
    level = np.sqrt(1.0 - z**2)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=-1)


def speeds(scaled: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Return the speed of each cell at each twist, `[K, N]`."""
    vx, vy, spin = twists.T[:, :, None]
    return np.hypot(vx - spin * scaled[:, 1], vy + spin * scaled[:, 0])


def dissipation(scaled: np.ndarray, weights: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Return `Phi = sum w |v|` at each twist, `[K]`."""
    parts = range(0, len(scaled), ROWS_AT_ONCE)
    return sum(
        (speeds(scaled[i : i + ROWS_AT_ONCE], twists) @ weights[i : i + ROWS_AT_ONCE] for i in parts),
        start=np.zeros(len(twists)),
    )


def polynomials(scaled: np.ndarray, degree: int) -> np.ndarray:
    """Return the Chebyshev products `T_i(x) T_j(y)`, `i + j <= degree`, over the box around the cells, `[M, N]`."""
    low, high = scaled.min(axis=0), scaled.max(axis=0)
    half = (high - low) / 2
    unit = (scaled - (low + high) / 2) / np.where(half > 0.0, half, 1.0)
    x, y = (np.polynomial.chebyshev.chebvander(column, degree).T for column in unit.T)
    return np.array([x[i] * y[j] for i in range(degree + 1) for j in range(degree + 1 - i)])


def spin(scaled: np.ndarray) -> np.ndarray:
    """Return a wrench of each cell in a spin about the centre of pressure, `|rho|`, `x/|rho|`, `y/|rho|`, `[3, N]`.

    A cell nearer than rounding to the centre has no direction.
    """
    distance = np.hypot(*scaled.T)
    away = distance > NO_DISTANCE
    return np.stack([distance, *np.where(away, scaled.T / np.where(away, distance, 1.0), 0.0)])


def independent(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the orthonormal rows that span those of `rows` `[M, C]`, and the matrix that makes them from it."""
    left, values, right = np.linalg.svd(rows, full_matrices=False)
    rank = int((values > INDEPENDENT * values[0]).sum())
    return right[:rank], left[:, :rank].T / values[:rank, None]


def thinned(scaled: np.ndarray) -> np.ndarray:
    """Return the indices of at most about `MOST_CANDIDATES` cells: all, or one in each box of a grid."""
    if len(scaled) <= MOST_CANDIDATES:
        return np.arange(len(scaled))
    extent = np.ptp(scaled, axis=0)
    thin = extent < 1e-9 * extent.max()
    side = extent.max() / MOST_CANDIDATES if thin.any() else math.sqrt(extent.prod() / MOST_CANDIDATES)
    place = (scaled - scaled.min(axis=0)) / side
    box = np.floor(place)
    middle = np.abs(place - box - 0.5).max(axis=1)
    order = np.lexsort([np.arange(len(place)), np.round(middle, SCORE_DIGITS), *box.T])
    new_box = np.r_[True, (np.diff(box[order], axis=0) != 0).any(axis=1)]
    return np.sort(order[new_box])
