"""Nodes of stored limit surfaces: sums over the cells at many centres of rotation."""

from __future__ import annotations

import math

from planarfriction.kernels import jit, kernel


@jit
def spin_sum(x, y, w, cx, cy):
    """`sum w v/|v|` and `sum w rho x v/|v|` of a unit spin about the point `(cx, cy)`; a cell there adds nothing."""
    hx, hy, ht = 0.0, 0.0, 0.0
    for i in range(x.shape[0]):
        dx, dy = x[i] - cx, y[i] - cy
        square = dx * dx + dy * dy
        c = w[i] / math.sqrt(square if square > 0.0 else math.inf)
        hx -= c * dy
        hy += c * dx
        ht += c * (x[i] * dx + y[i] * dy)
    return hx, hy, ht


@jit
def smoothed_spin_sum(corners, grid, x, y, w, cx, cy):
    """`spin_sum` blended bilinearly over the corners of the grid cell that holds the centre of rotation.

    As published: the cell index is truncated toward zero, so up to one cell outside the low edges the first cell is
    used and its weights extrapolate; further outside the grid the plain sum is taken. `grid` is `(x_min, y_min,
    width, height)` of its cells relative to the centre of pressure; `corners` `[columns + 1, rows + 1, 3]` caches the
    sums (NaN: not yet).
    """
    columns, rows = corners.shape[0] - 1, corners.shape[1] - 1
    a, b = (cx - grid[0]) / grid[2], (cy - grid[1]) / grid[3]
    if not (-1.0 < a < columns and -1.0 < b < rows):
        return spin_sum(x, y, w, cx, cy)
    i, j = int(a), int(b)
    a, b = a - i, b - j
    for p in range(i, i + 2):
        for q in range(j, j + 2):
            if math.isnan(corners[p, q, 0]):
                corner = spin_sum(x, y, w, grid[0] + p * grid[2], grid[1] + q * grid[3])
                corners[p, q, 0], corners[p, q, 1], corners[p, q, 2] = corner
    w00, w10, w01, w11 = (1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b
    c = corners
    return (
        w00 * c[i, j, 0] + w10 * c[i + 1, j, 0] + w01 * c[i, j + 1, 0] + w11 * c[i + 1, j + 1, 0],
        w00 * c[i, j, 1] + w10 * c[i + 1, j, 1] + w01 * c[i, j + 1, 1] + w11 * c[i + 1, j + 1, 1],
        w00 * c[i, j, 2] + w10 * c[i + 1, j, 2] + w01 * c[i, j + 1, 2] + w11 * c[i + 1, j + 1, 2],
    )


@jit
def smoothed_nodes(corners, grid, x, y, w, radius, size, nodes):
    """`h` at `[size + 1, 4 size + 1]` directions of the scaled twist, from the smoothed sums; torque over `radius`."""
    segment = 0.5 * math.pi / size
    for i in range(size + 1):
        for j in range(4 * size):
            if i == size:  # pure sliding: the centre of rotation is at infinity
                hx, hy, ht = math.cos(j * segment), math.sin(j * segment), 0.0
                for m in range(x.shape[0]):
                    ht += w[m] * (x[m] * hy - y[m] * hx)
            else:
                distance = radius * math.tan(i * segment)
                cx, cy = -distance * math.sin(j * segment), distance * math.cos(j * segment)
                hx, hy, ht = smoothed_spin_sum(corners, grid, x, y, w, cx, cy)
            nodes[i, j, 0], nodes[i, j, 1], nodes[i, j, 2] = hx, hy, ht / radius
        nodes[i, 4 * size] = nodes[i, 0]


@kernel
def _tilt_slope(polar):
    """How the tilt of `kernels.surfaces` grows with the polar angle, `sin cos^2`, and its derivative."""
    sin_p, cos_p = math.sin(polar), math.cos(polar)
    return sin_p * cos_p * cos_p, cos_p * (cos_p * cos_p - 2.0 * sin_p * sin_p)


@jit
def potential_nodes(x, y, w, radius, size, nodes):
    """`phi`, its two derivatives and the mixed one at `[size + 1, 4 size + 1]` directions, from the plain sums.

    Less the tilt, whose two numbers `(ax, ay)` are returned: the force in a pure spin.
    """
    segment = 0.5 * math.pi / size
    ax, ay, _ = spin_sum(x, y, w, 0.0, 0.0)
    for i in range(size + 1):
        sin_p, cos_p = math.sin(i * segment), math.cos(i * segment)
        distance = radius * math.tan(i * segment)
        tilt, tilt_slope = _tilt_slope(i * segment)
        for j in range(4 * size):
            cos_a, sin_a = math.cos(j * segment), math.sin(j * segment)
            if i == size:
                hx, hy, ht = cos_a, sin_a, 0.0
                for m in range(x.shape[0]):
                    ht += w[m] * (x[m] * hy - y[m] * hx)
            else:
                hx, hy, ht = spin_sum(x, y, w, -distance * sin_a, distance * cos_a)
            along, across, hs = hx * cos_a + hy * sin_a, hy * cos_a - hx * sin_a, ht / radius
            lean, lean_slope = ax * cos_a + ay * sin_a, ay * cos_a - ax * sin_a
            nodes[i, j, 0] = along * sin_p + hs * cos_p - tilt * lean
            nodes[i, j, 1] = along * cos_p - hs * sin_p - tilt_slope * lean
            nodes[i, j, 2] = across * sin_p - tilt * lean_slope
            nodes[i, j, 3] = 0.0  # at the axis, where only the tilt had a slope
    for i in range(1, size + 1):
        for j in range(4 * size):
            if i < size:
                above = nodes[i + 1, j, 2]
            else:
                # beyond the equator the surface is mirrored: phi(pi - polar, azimuth + pi) = phi(polar, azimuth); the
                # tilt there has the other sign
                lean_slope = ay * math.cos(j * segment) - ax * math.sin(j * segment)
                above = nodes[size - 1, (j + 2 * size) % (4 * size), 2]
                above -= 2.0 * _tilt_slope(0.5 * math.pi - segment)[0] * lean_slope
            nodes[i, j, 3] = (above - nodes[i - 1, j, 2]) / (2.0 * segment)
    for i in range(size + 1):
        nodes[i, 4 * size] = nodes[i, 0]
    return ax, ay
