"""Pressure that follows the moments of the load: weights times a plane, cut off where it would pull.

`w_i -> w_i max(0, c + a x_i + b y_i)`, with c, a and b such that the total stays and the centre of pressure is the one
asked for. Of all weights that do, these are closest to the given ones: `sum (w'_i - w_i)^2/w_i` is least. The dual of
this convex problem is solved for the plane by Newton's method. Each of its steps has the plane of the cells that press
now in closed form: about their own centre the total gives the height, and a matrix [2, 2] the slopes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction._engine.codegen.vectors import Vector, copy
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.compiler.memory import Doubles

SOFTNESS = 1e-9
"""Compliance of the centre of pressure [-]: it may miss the one asked for by so many radii of gyration, times the slope
of the plane. It makes the plane finite where the centre lies beyond all cells."""

FARTHEST = 100.0
"""Distance of the centre asked for, in radii of gyration, beyond which it is brought back: it lies outside."""

STEPS = 60
"""Newton steps at most: they end after a few."""

SHORTENINGS = 30
"""Times at most that a Newton step is shortened."""

NARROW = 1e-8
"""Square of the ratio of width to length below which cells count as a line, across which a plane does not tilt them."""

OVERSHOT = 0.5
"""Slope along a Newton step up to which it may end, as a share of the slope at its start."""

REACH = 1e15
"""Distance [m] at which a centre of pressure may be asked for; a load of nearly nothing has one beyond. Its square
is a number in single precision too, and its fifth power times a large twist one in double precision."""


class Plane(NamedTuple):
    """A plane over scaled coordinates."""

    height: float
    x: float
    y: float


class Scaled(NamedTuple):
    """Scaled coordinates `(x - x0)/L` about the centre of pressure, and the centre asked for in them."""

    x0: float
    y0: float
    per_length: float
    """1/L, one over the radius of gyration [1/m]; 0 of a point."""
    x: float
    y: float
    narrow: float
    """1 of cells along a line, else 0."""


@kernel
def centre(mx: float, my: float, load: float) -> Vector:
    """Return the centre of pressure `(-m_y, m_x)/f_N` of a load > 0."""
    return xp.minimum(xp.maximum(-my / load, -REACH), REACH), xp.minimum(
        xp.maximum(mx / load, -REACH), REACH
    )


@kernel
def _scaled(
    x: Doubles, y: Doubles, w: Doubles, n: int, total: float, cx: float, cy: float
) -> Scaled:
    x0 = 0.0
    y0 = 0.0
    xx = 0.0
    xy = 0.0
    yy = 0.0
    for i in range(n):
        x0 = x0 + w[i] * x[i]
        y0 = y0 + w[i] * y[i]
    x0 = x0 / total
    y0 = y0 / total
    for i in range(n):
        u = x[i] - x0
        v = y[i] - y0
        xx = xx + w[i] * u * u
        xy = xy + w[i] * u * v
        yy = yy + w[i] * v * v
    per_length = math.sqrt(total / (xx + yy)) if xx + yy > 0.0 else 0.0
    narrow = 0.0 if xx * yy - xy * xy > NARROW * (xx + yy) ** 2 else 1.0
    u = (cx - x0) * per_length
    v = (cy - y0) * per_length
    far = math.sqrt(u * u + v * v)
    back = FARTHEST / far if far > FARTHEST else 1.0
    return Scaled(x0, y0, per_length, back * u, back * v, narrow)


@kernel
def _at(plane: Plane, s: Scaled, x: float, y: float) -> float:
    return plane.height + (plane.x * (x - s.x0) + plane.y * (y - s.y0)) * s.per_length


@kernel
def _fitted(
    x: Doubles,
    y: Doubles,
    w: Doubles,
    n: int,
    total: float,
    s: Scaled,
    plane: Plane,
    soft: float,
) -> Plane:
    """Return the plane that has total and centre with the cells that press under another one."""
    pressing = 0.0
    mx = 0.0
    my = 0.0
    xx = 0.0
    xy = 0.0
    yy = 0.0
    for i in range(n):
        if _at(plane, s, x[i], y[i]) > 0.0:
            u = (x[i] - s.x0) * s.per_length
            v = (y[i] - s.y0) * s.per_length
            pressing = pressing + w[i]
            mx = mx + w[i] * u
            my = my + w[i] * v
    if not pressing > 0.0:
        return plane
    mx = mx / pressing
    my = my / pressing
    for i in range(n):
        if _at(plane, s, x[i], y[i]) > 0.0:
            u = (x[i] - s.x0) * s.per_length - mx
            v = (y[i] - s.y0) * s.per_length - my
            xx = xx + w[i] * u * u
            xy = xy + w[i] * u * v
            yy = yy + w[i] * v * v
    xx = xx / total + soft
    xy = xy / total
    yy = yy / total + soft
    right = s.x - mx
    up = s.y - my
    one = xx * yy - xy * xy
    a = (yy * right - xy * up) / one
    b = (xx * up - xy * right) / one
    return Plane(total / pressing - a * mx - b * my, a, b)


@kernel
def _slope(
    x: Doubles,
    y: Doubles,
    w: Doubles,
    n: int,
    total: float,
    s: Scaled,
    plane: Plane,
    step: Plane,
) -> float:
    """Return the slope of the dual along a step at a plane."""
    slope = (
        SOFTNESS * (plane.x * step.x + plane.y * step.y)
        - step.height
        - step.x * s.x
        - step.y * s.y
    )
    for i in range(n):
        level = _at(plane, s, x[i], y[i])
        carried = w[i] / total * _at(step, s, x[i], y[i])
        slope = slope + (carried * level if level > 0.0 else 0.0)
    return slope


@kernel
def _same(x: Doubles, y: Doubles, n: int, s: Scaled, one: Plane, other: Plane) -> bool:
    same = True
    for i in range(n):
        same = same and (_at(one, s, x[i], y[i]) > 0.0) == (
            _at(other, s, x[i], y[i]) > 0.0
        )
    return same


@kernel
def _stepped(plane: Plane, far: float, step: Plane) -> Plane:
    return Plane(
        plane.height + far * step.height, plane.x + far * step.x, plane.y + far * step.y
    )


@kernel
def _share_of(
    x: Doubles,
    y: Doubles,
    w: Doubles,
    n: int,
    total: float,
    s: Scaled,
    plane: Plane,
    step: Plane,
) -> float:
    """Return the share of a step to go: all, or so little that the dual hardly rises there."""
    far = 1.0
    first = 0.0
    for i in range(SHORTENINGS):
        slope = _slope(x, y, w, n, total, s, _stepped(plane, far, step), step)
        if i == 0 and slope > 0.0:
            first = abs(_slope(x, y, w, n, total, s, plane, step))
        if not slope > OVERSHOT * first:
            break
        far *= 0.5
    return far


@kernel
def _plane(
    x: Doubles, y: Doubles, w: Doubles, n: int, total: float, s: Scaled
) -> Plane:
    """Return the plane."""
    plane = Plane(1.0, 0.0, 0.0)
    for i in range(STEPS):
        whole = _fitted(
            x, y, w, n, total, s, plane, SOFTNESS if i > 0 or s.narrow > 0.0 else 0.0
        )
        if _same(x, y, n, s, plane, whole):
            return whole
        step = Plane(whole.height - plane.height, whole.x - plane.x, whole.y - plane.y)
        plane = _stepped(plane, _share_of(x, y, w, n, total, s, plane, step), step)
    return plane


@kernel
def tilt(
    x: Doubles, y: Doubles, w: Doubles, n: int, cx: float, cy: float, out: Doubles
) -> None:
    """Write the weights of n cells at x, y, of weights w, with their centre of pressure at (cx, cy) if cells reach it.

    A centre beyond all cells comes to the nearest point that they reach: the load goes to an edge, or to one cell. The
    total stays. Cells without weight get none. `out` may be w.
    """
    total = 0.0
    pressed = 0.0
    for i in range(n):
        total += w[i]
    if not total > 0.0:
        copy(w, out, n)
        return
    s = _scaled(x, y, w, n, total, cx, cy)
    plane = _plane(x, y, w, n, total, s)
    for i in range(n):
        out[i] = w[i] * xp.maximum(_at(plane, s, x[i], y[i]), 0.0)
        pressed += out[i]
    for i in range(n):
        out[i] *= total / pressed


@jit
def tilt_many(
    x: np.ndarray,
    y: np.ndarray,
    weights: np.ndarray,
    centres: np.ndarray,
    out: np.ndarray,
) -> None:
    """Tilt the rows of weights `[B, N]` to the centres `[B, 2]`; x, y are `[N]` or rows of their own, as `[B, N]`."""
    for b in range(weights.shape[0]):
        row = b if x.shape[0] > 1 else 0
        tilt(
            x[row],
            y[row],
            weights[b],
            weights.shape[1],
            centres[b, 0],
            centres[b, 1],
            out[b],
        )


def tilted(
    positions: np.ndarray, weights: np.ndarray, centre: np.ndarray
) -> np.ndarray:
    """Return weights `[B, N]` of cells at `positions` `[N, 2]` times planes that bring their centres to `[B, 2]`."""
    # Writable, all of them: compiled once.
    x, y = (np.array(each)[None] for each in positions.T)
    out = np.empty(weights.shape)
    tilt_many(x, y, np.array(weights, order="C"), np.array(centre, order="C"), out)
    return out
