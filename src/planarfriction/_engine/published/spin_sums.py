"""Nodes of the published table: sums over the cells at many centres of rotation.

The published table, to the letter, since published numbers depend on it: nodes lie at 20 polar x 80 azimuth segments of
the half sphere of `V_S`; between them `h` is bilinear in the two angles and not normalised again. Where the centre of
rotation lies in the grid, the sums at the four corners of its cell are blended bilinearly. The cell index is truncated
toward zero: up to one cell outside the low edges the blend of cell 0 extrapolates; further outside, the plain sum is
taken. The contact radius is blended in the same way (6.357 mm instead of 6.380 mm for `ContactPatch.disc_published`).
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.codegen.vectors import Vector
from planarfriction._engine.compiler import jit


@jit
def spin_sum(
    x: np.ndarray, y: np.ndarray, w: np.ndarray, cx: float, cy: float
) -> Vector:
    """Return `sum w v/|v|` and `sum w rho x v/|v|` of a unit spin about `(cx, cy)`; a cell there adds nothing."""
    hx = 0.0
    hy = 0.0
    ht = 0.0
    for i in range(x.shape[0]):
        dx = x[i] - cx
        dy = y[i] - cy
        square = dx * dx + dy * dy
        c = w[i] / math.sqrt(square if square > 0.0 else math.inf)
        hx -= c * dy
        hy += c * dx
        ht += c * (x[i] * dx + y[i] * dy)
    return hx, hy, ht


@jit
def smoothed_spin_sum(
    corners: np.ndarray,
    grid: Vector,
    x: np.ndarray,
    y: np.ndarray,
    w: np.ndarray,
    cx: float,
    cy: float,
) -> Vector:
    """Return `spin_sum` blended bilinearly over the corners of the grid cell that holds the centre of rotation.

    As published: the cell index is truncated toward zero, so up to one cell outside the low edges the first cell is
    used and its weights extrapolate; further outside the grid the plain sum is taken. `grid` is `(x_min, y_min,
    width, height)` of its cells relative to the centre of pressure; `corners` `[columns + 1, rows + 1, 3]` caches the
    sums (NaN: not yet).
    """
    columns = corners.shape[0] - 1
    rows = corners.shape[1] - 1
    a = (cx - grid[0]) / grid[2]
    b = (cy - grid[1]) / grid[3]
    if not (-1.0 < a < columns and -1.0 < b < rows):
        return spin_sum(x, y, w, cx, cy)
    i = int(a)
    j = int(b)
    a = a - i
    b = b - j
    for p in range(i, i + 2):
        for q in range(j, j + 2):
            if math.isnan(corners[p, q, 0]):
                corner = spin_sum(x, y, w, grid[0] + p * grid[2], grid[1] + q * grid[3])
                corners[p, q, 0], corners[p, q, 1], corners[p, q, 2] = corner
    w00 = (1.0 - a) * (1.0 - b)
    w10 = a * (1.0 - b)
    w01 = (1.0 - a) * b
    w11 = a * b
    c = corners
    return (
        w00 * c[i, j, 0]
        + w10 * c[i + 1, j, 0]
        + w01 * c[i, j + 1, 0]
        + w11 * c[i + 1, j + 1, 0],
        w00 * c[i, j, 1]
        + w10 * c[i + 1, j, 1]
        + w01 * c[i, j + 1, 1]
        + w11 * c[i + 1, j + 1, 1],
        w00 * c[i, j, 2]
        + w10 * c[i + 1, j, 2]
        + w01 * c[i, j + 1, 2]
        + w11 * c[i + 1, j + 1, 2],
    )


@jit
def smoothed_nodes(
    corners: np.ndarray, grid: Vector, x: np.ndarray, y: np.ndarray, w: np.ndarray, radius: float, size: int,
    nodes: np.ndarray,
) -> None:  # fmt: skip
    """Write `h` at `[size + 1, 4 size + 1]` directions of the scaled twist from smoothed sums; torque over `radius`."""
    segment = 0.5 * math.pi / size
    for i in range(size + 1):
        for j in range(4 * size):
            if i == size:  # pure sliding: the centre of rotation is at infinity
                hx = math.cos(j * segment)
                hy = math.sin(j * segment)
                ht = 0.0
                for m in range(x.shape[0]):
                    ht += w[m] * (x[m] * hy - y[m] * hx)
            else:
                distance = radius * math.tan(i * segment)
                cx = -distance * math.sin(j * segment)
                cy = distance * math.cos(j * segment)
                hx, hy, ht = smoothed_spin_sum(corners, grid, x, y, w, cx, cy)
            nodes[i, j, 0] = hx
            nodes[i, j, 1] = hy
            nodes[i, j, 2] = ht / radius
        # One by one: an assignment of arrays takes six times as long to compile.
        for c in range(3):
            nodes[i, 4 * size, c] = nodes[i, 0, c]
