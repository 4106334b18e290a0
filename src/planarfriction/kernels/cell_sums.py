"""Steady sliding summed over the cells of a patch, for many directions of the twist at once.

A cell is a parallelogram (or a segment, or a point) of uniform pressure. One near the centre of rotation, where the
sliding direction turns within it, is halved both ways until its parts are far from it or `DEPTH` times halved; every
part is then a 2 x 2 Gauss rule.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel

DEPTH = 6
"""Number of times that a cell at the centre of rotation is halved: its last parts hold 1/4096 of its load
(those of a segment 1/64)."""

NEAR = 1.5
"""Distance from the centre of rotation, in longer edges, below which a cell is cut; Gauss errs by 1e-4 of it there."""

_BLOCK = 512
_GAUSS = 0.5 / math.sqrt(3.0)
_GONE = 40.0
"""`exp(-40)` is nothing beside 1."""


@kernel
def _flush(count, points, exponents, gamma, out):
    """Add `count` points (rows of `points`: x, y, weight, u, and one of scratch) to the sums of a direction."""
    x, y, w, ux, uy, power = points[0], points[1], points[2], points[3], points[4], points[5]
    ox, oy, o_s, least = 0.0, 0.0, 0.0, 1e300
    for i in range(count):
        square = ux[i] * ux[i] + uy[i] * uy[i]
        scale = w[i] / math.sqrt(square) if square > 0.0 else 0.0
        fx, fy = scale * ux[i], scale * uy[i]
        ux[i], uy[i] = fx, fy
        ox += fx
        oy += fy
        o_s += x[i] * fy - y[i] * fx
        power[i] = square
        least = min(least, square)
    out[0, 0] += ox
    out[0, 1] += oy
    out[0, 2] += o_s
    if gamma != 2.0:
        least = least ** (0.5 * gamma)
        for i in range(count):
            power[i] = xp.power(power[i], 0.5 * gamma)
    for k in range(exponents.shape[0]):
        if least * exponents[k] > _GONE:
            break
        ox, oy, o_s = 0.0, 0.0, 0.0
        for i in range(count):
            e = xp.exp(-power[i] * exponents[k])
            fx, fy = e * ux[i], e * uy[i]
            ox += fx
            oy += fy
            o_s += x[i] * fy - y[i] * fx
        out[k + 1, 0] += ox
        out[k + 1, 1] += oy
        out[k + 1, 2] += o_s


@kernel
def _cut(stack, top, x, y, ax, ay, bx, by, weight, level, parts):
    """Replace a cell by its halves: four of a parallelogram, two of a segment."""
    for p in range(parts):
        along = 0.25 if p & 1 else -0.25
        across = (0.25 if p & 2 else -0.25) if parts == 4 else along
        stack[top, 0], stack[top, 1] = x + along * ax + across * bx, y + along * ay + across * by
        stack[top, 2], stack[top, 3], stack[top, 4], stack[top, 5] = 0.5 * ax, 0.5 * ay, 0.5 * bx, 0.5 * by
        stack[top, 6], stack[top, 7] = weight / parts, level + 1.0
        top += 1
    return top


@kernel
def _sum(vx, vy, spin, cells, exponents, gamma, stack, points, out):
    count, top, next_cell = np.int64(0), 0, 0  # a literal 0 would have what it is passed to compiled once more
    while True:
        done = top == 0 and next_cell == cells.shape[0]
        if done or count + 4 > _BLOCK:
            _flush(count, points, exponents, gamma, out)
            count = 0
        if done:
            return
        if top == 0:
            for i in range(7):
                stack[0, i] = cells[next_cell, i]
            stack[0, 7] = 0.0
            top, next_cell = 1, next_cell + 1
        top -= 1
        x, y, weight, level = stack[top, 0], stack[top, 1], stack[top, 6], stack[top, 7]
        ax, ay, bx, by = stack[top, 2], stack[top, 3], stack[top, 4], stack[top, 5]
        a, b = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
        reach = NEAR * spin * max(a, b)
        sx, sy = vx - spin * y, vy + spin * x
        if sx * sx + sy * sy < reach * reach and level < DEPTH:
            top = _cut(stack, top, x, y, ax, ay, bx, by, weight, level, 4 if a > 0.0 and b > 0.0 else 2)
            continue
        # a Gauss rule: two points along each edge that has a length
        gx, gy, hx, hy = _GAUSS * ax, _GAUSS * ay, _GAUSS * bx, _GAUSS * by
        across = 2 if a > 0.0 and b > 0.0 else 1
        if across == 1:
            gx, gy, hx, hy = gx + hx, gy + hy, 0.0, 0.0
        along = 2 if a > 0.0 or b > 0.0 else 1
        for i in range(along):
            for j in range(across):
                u, v = 2.0 * i - 1.0, 2.0 * j - 1.0
                px, py = x + u * gx + v * hx, y + u * gy + v * hy
                points[0, count], points[1, count], points[2, count] = px, py, weight / (along * across)
                points[3, count], points[4, count] = vx - spin * py, vy + spin * px
                count += 1


@jit
def steady_sums(directions, cells, exponents, gamma, out):
    """Write `sum w e u/|u|` and its moment for M scaled twists to `out` [M, 1 + E, 3].

    `directions` [M, 3] need not be unit vectors; `cells` [N, 7]: centre (x, y) and the two edges (x, y, x, y) over the
    radius of gyration, and the weight. `e` is 1 in row 0 and `exp(-exponents[k] |u|^gamma)` of the unit direction in
    row 1 + k; `exponents` [E] ascend.
    """
    stack, points = np.empty((4 * DEPTH + 4, 8)), np.empty((6, _BLOCK))
    for m in range(directions.shape[0]):
        d = directions[m]
        per = 1.0 / math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        out[m] = 0.0
        _sum(d[0] * per, d[1] * per, d[2] * per, cells, exponents, gamma, stack, points, out[m])
