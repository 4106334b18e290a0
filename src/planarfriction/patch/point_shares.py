"""Corrections by which sums over points see the second moments of the areas that the points stand for."""

from __future__ import annotations

import numpy as np

LEAST_SPREAD = 1e-6
"""Variance of a quadratic over its mean square below which it is linear on the cells (one or two rows) [-]."""

LARGEST_CHANGE = 0.8
"""Largest relative change of a weight, which stays positive; few cells across a thin shape would need larger ones."""


def cell_extents(areas: np.ndarray, cell_size: tuple[float, float] | None) -> np.ndarray:
    """Return the width and height `[N, 2]` [m] of cells; a cut one has the proportions of a whole one."""
    if cell_size is None:
        return np.zeros((len(areas), 2))
    width, height = cell_size
    if width == 0.0 or height == 0.0:
        return np.tile([width, height], (len(areas), 1))
    return np.sqrt(areas / (width * height))[:, None] * np.array([width, height])


def point_shares(positions: np.ndarray, areas: np.ndarray, cell_size: tuple[float, float] | None) -> np.ndarray | None:
    """Return factors `q` `[N]` on the areas with which points at the cells have the second moments of the areas.

    `sum(a q p) = sum(a p)` for all polynomials of degree 1, and `sum(a q rho rho') = sum(a (rho rho' + e e'/12))` with
    the width and height `e` of the cells (`cell_extents`) as a diagonal. Of all such factors these have the least
    `sum(a (q - 1)^2)`: `q - 1` is a quadratic polynomial, of the order of the squared cell size over that of the patch.
    Second moments that no factors change (across one or two rows of cells) are left out, and a change beyond
    `LARGEST_CHANGE` is shortened to it. None: there is nothing to correct.
    """
    w = areas / areas.sum()
    rho = positions - w @ positions
    size = np.sqrt(w @ (rho**2).sum(1))
    if not size > 0.0:
        return None
    rho, own = rho / size, cell_extents(areas, cell_size) ** 2 / (12.0 * size**2)
    linear = np.column_stack([np.ones(len(w)), rho])
    square = np.column_stack([rho[:, 0] ** 2, rho[:, 0] * rho[:, 1], rho[:, 1] ** 2])
    scale = np.sqrt(w @ square**2)
    square = square / np.where(scale > 0.0, scale, 1.0)
    root = np.sqrt(w)[:, None]
    free = square - linear @ np.linalg.lstsq(root * linear, root * square, rcond=None)[0]
    variances, axes = np.linalg.eigh((w[:, None] * free).T @ free)
    axes = axes[:, variances > LEAST_SPREAD]
    missing = np.array([w @ own[:, 0], 0.0, w @ own[:, 1]]) / np.where(scale > 0.0, scale, 1.0)
    found = axes @ (axes.T @ missing / variances[variances > LEAST_SPREAD])
    change = free @ found
    largest = np.abs(change).max()
    return 1.0 + change * min(1.0, LARGEST_CHANGE / largest) if largest > 0.0 else None
