"""The reduced model for arrays of PyTorch and JAX: `kernels.steady` and `kernels.reduced` as `f(xp, ...)`.

`xp` is the namespace of the formulas with `stack`, `root` (square root, slope 0 at 0), `whole` (integer part within
bounds) and `epsilon` (rounding error). Vectors are `[..., 3]`, scalars and the law's parameters `[..., 1]` or plain
numbers. Derivatives are finite everywhere and those of `kernels.reduced_step`: at rest the step is that of a
vanishing twist, `z + u dt`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.steady import HEADER, QUARTIC
from planarfriction.models.bristle_arrays import back_onto

_SQUARES = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
_FOURTHS = [list(each) for each in zip(*((i, j) for i in range(3) for j in range(i, 6)), strict=True)]
"""Factors of the products of two and of four components in the order of `quartic`."""


class MapSizes(NamedTuple):
    """How many numbers a map has, as `kernels.steady` names them."""

    faces: int
    segments: int
    coarse: int
    levels: int

    @property
    def count(self) -> int:
        """Numbers of the map."""
        nodes, own = 2 * self.segments + 1, 2 * self.coarse + 1
        return HEADER + self.faces * 12 * (nodes * nodes + own * own * self.levels)


class ReducedNumbers(NamedTuple):
    """What `models.reduced_map.ReducedShape` holds, as arrays."""

    factor: Any
    """F `[3, 3]`, upper triangular."""
    quartic: Any
    """Coefficients of `<u^4>` `[15]` (see `kernels.steady`)."""
    scale: Any
    """Knee, least dissipation, stretch and gamma `[4]`."""
    flat: Any
    """`h_0` over the nodes of the cube, `[faces, 2 n + 1, 2 n + 1, 3, 4]`."""
    rest: Any
    """The Stribeck part with its levels, `[faces, 2 m + 1, 2 m + 1, levels, 3, 4]`."""


class Held(NamedTuple):
    """What a step holds: a twist and its steady state (any that move, where the patch is at rest)."""

    u: Any
    """`V_G` [m/s], also at rest."""
    q: Any
    """`z_ss` [m]."""
    m: Any
    """`V_G - lambda z_ss` [m/s]."""
    decay: Any
    """`lambda = |V_G|^2/(V_G . z_ss)` [1/s]."""
    slow: Any
    """`mu = V_G . z_ss/|z_ss|^2` [1/s]."""
    per_q2: Any
    moves: Any


def sizes_of(data: np.ndarray) -> MapSizes:
    """The sizes of a map, from the numbers that compiled loops read."""
    return MapSizes(*(int(value) for value in data[:4]))


def starts_of(sizes: Sequence[MapSizes]) -> list[int]:
    """Where maps begin that lie one behind the other."""
    ends = itertools.accumulate(size.count for size in sizes)
    return [0, *ends][: len(sizes)]


def parts_of(factors, data, sizes: Sequence[MapSizes]) -> list[ReducedNumbers]:
    """`numbers_of` parts, from their F `[P, 3, 3]` and their maps, one behind the other."""
    places = zip(starts_of(sizes), sizes, strict=True)
    return [numbers_of(factors[k], data[at : at + size.count], size) for k, (at, size) in enumerate(places)]


def numbers_of(factor, data, sizes: MapSizes) -> ReducedNumbers:
    """The parts of F and the numbers of a map, arrays of any kind, of which they are views."""
    faces, n, m, levels = sizes
    middle = HEADER + faces * (2 * n + 1) ** 2 * 12
    return ReducedNumbers(
        factor,
        data[QUARTIC:HEADER],
        data[4:8],
        data[HEADER:middle].reshape(faces, 2 * n + 1, 2 * n + 1, 3, 4),
        data[middle:].reshape(faces, 2 * m + 1, 2 * m + 1, levels, 3, 4),
    )


def dot(a, b):
    """`a . b`, which keeps its axis."""
    return (a * b).sum(-1)[..., None]


# ---------------------------------------------------------------------- the map


def _spot(xp, direction, stretch, faces: int):
    """Face, place on it and sign of what is read there (see `kernels.cube.locate`) for unit vectors, `[...]`."""
    x, y, s = direction[..., 0], direction[..., 1], stretch * direction[..., 2]
    ax, ay, a_s = abs(x), abs(y), abs(s)
    on_x, on_y = (ax >= ay) & (ax >= a_s), ay >= a_s
    largest = xp.where(on_x, x, xp.where(on_y, y, s))
    first, second = xp.where(on_x, y, xp.where(on_y, s, x)), xp.where(on_x, s, xp.where(on_y, x, y))
    face, sign = xp.where(on_x, 0, xp.where(on_y, 1, 2)), xp.where(largest < 0.0, -1.0, 1.0)
    if faces == 3:
        return face, first / largest, second / largest, sign
    return face + xp.where(largest < 0.0, 3, 0), first / abs(largest), second / abs(largest), abs(sign)


def _interval(xp, a, nodes: int):
    """Both ends of the interval that holds `a`, `[..., 2]`, and their weights of value and slope, `[..., 2, 2]`."""
    n = (nodes - 1) // 2
    t = (a + 1.0) * n
    i = xp.whole(t, 2 * n - 1)
    t = t - i
    v = 1.0 - t
    low = xp.stack([v * v * (1.0 + 2.0 * t), t * v * v], -1)
    high = xp.stack([t * t * (3.0 - 2.0 * t), -t * t * v], -1)
    return xp.stack([i, i + 1], -1), xp.stack([low, high], -2)


def _square(xp, a, b, nodes: int):
    """Rows and columns of the four nodes around a place, and the weights of their four numbers, `[..., 2, 2, 4]`."""
    i, by_a = _interval(xp, a, nodes)
    j, by_b = _interval(xp, b, nodes)
    weights = by_a[..., :, None, None, :] * by_b[..., None, :, :, None]
    return i[..., :, None], j[..., None, :], weights.reshape(*weights.shape[:-2], 4)


def _levels(xp, t, count: int):
    """The four levels around t in [0, 1], `[..., 4]`, and their weights: a uniform cubic B-spline."""
    u = t * (count - 3)
    i = xp.whole(u, count - 4)
    u = u - i
    v = 1.0 - u
    weights = [v * v * v, 4.0 + u * u * (3.0 * u - 6.0), 4.0 + v * v * (3.0 * v - 6.0), u * u * u]
    return xp.stack([i, i + 1, i + 2, i + 3], -1), xp.stack(weights, -1) * (1.0 / 6.0)


def _sliding(xp, law: LawNumbers, shape: ReducedNumbers, n, t):
    """`sigma_0 z_ss` of unit vectors n at `t` `[..., 1]`."""
    face, a, b, sign = _spot(xp, n, shape.scale[2], shape.flat.shape[0])
    face = face[..., None, None]
    i, j, w = _square(xp, a, b, shape.flat.shape[1])
    flat = (w[..., None, :] * shape.flat[face, i, j]).sum((-4, -3, -1))
    i, j, w = _square(xp, a, b, shape.rest.shape[1])
    level, w_t = _levels(xp, t[..., 0], shape.rest.shape[3])
    numbers = shape.rest[face[..., None], i[..., None], j[..., None], level[..., None, None, :]]
    rest = ((w[..., None, None, :] * numbers).sum((-5, -4, -1)) * w_t[..., None]).sum(-2)
    drop = law.mu_s - law.mu_c
    return sign[..., None] * ((law.mu_s - drop * t) * flat + drop * rest)


def _evenness(xp, shape: ReducedNumbers, z):
    """`formulas.evenness` of states; 1 without deflection. Their size goes first, whose fourth power float32 lacks."""
    bent = dot(z, z) > 0.0
    safe = xp.where(bent, z, 1.0)
    n = safe / xp.root(dot(safe, safe))
    m = n[..., _SQUARES[0]] * n[..., _SQUARES[1]]
    products = m[..., _FOURTHS[0]] * m[..., _FOURTHS[1]]  # not one by one, of which XLA makes ten times the code
    return xp.where(bent, formulas.evenness(dot(n, n), dot(shape.quartic, products)), 1.0)


# ---------------------------------------------------------------------- a twist


def held(xp, law: LawNumbers, shape: ReducedNumbers, twist) -> Held:
    """The scaled twist, its steady state and what follows from both."""
    f = shape.factor
    vx, vy, omega = twist[..., 0], twist[..., 1], twist[..., 2]
    scaled = [f[0, 0] * vx + f[0, 1] * vy + f[0, 2] * omega, f[1, 1] * vy + f[1, 2] * omega, f[2, 2] * omega]
    u = xp.stack(scaled, -1)
    moves = dot(u, u) > 0.0
    safe = xp.where(moves, u, 1.0)
    v = xp.root(dot(safe, safe))
    n = safe / v
    knee, least, _, gamma = shape.scale
    q = _sliding(xp, law, shape, n, formulas.stribeck_place(xp, v, law.v_s, gamma, knee))
    power = dot(q, n)
    q = (q + (formulas.floored(xp, power, law.mu_c * least) - power) * n) / law.sigma_0
    power, per_q2 = dot(q, n), 1.0 / dot(q, q)
    decay = v / power
    return Held(u, q, safe - decay * q, decay, v * power * per_q2, per_q2, moves)


def _closure(xp, law: LawNumbers, shape: ReducedNumbers, z, deflection, share):
    """`beta` of a state z, which may be given times any factor (see `kernels.reduced.closure`)."""
    even = _evenness(xp, shape, z) if law.elasto_plastic else 1.0
    deflected = deflection > 0.0
    cosine = xp.where(deflected, share / xp.where(deflected, deflection, 1.0), 0.0)
    return formulas.slip_share(xp, deflection, cosine, even, law)


def _place(xp, z, by: Held):
    """`|z|/|z_ss|` and `s = z . z_ss/|z_ss|^2`."""
    return xp.root(dot(z, z) * by.per_q2), dot(z, by.q) * by.per_q2


def rate(xp, law: LawNumbers, shape: ReducedNumbers, z, by: Held):
    """`zdot = V_G - beta (lambda z + s m)`."""
    deflection, share = _place(xp, z, by)
    beta = _closure(xp, law, shape, z, deflection, share)
    return by.u - xp.where(by.moves, beta * (by.decay * z + share * by.m), 0.0)


def wrench(xp, law: LawNumbers, shape: ReducedNumbers, z, zdot, by: Held):
    """Wrench about the origin per unit load, `F' g`."""
    g = formulas.traction(z, zdot, by.u, law)
    f, x, y, s = shape.factor, g[..., 0], g[..., 1], g[..., 2]
    return xp.stack([f[0, 0] * x, f[0, 1] * x + f[1, 1] * y, f[0, 2] * x + f[1, 2] * y + f[2, 2] * s], -1)


def advance(xp, law: LawNumbers, shape: ReducedNumbers, z, by: Held, dt):
    """Moments and their rates after `dt` of a held twist (see `kernels.reduced_step`)."""
    size, share = _place(xp, z, by)
    start = end = _closure(xp, law, shape, z, size, share)
    if law.elasto_plastic:
        ahead = (share + by.slow * dt) / (1.0 + start * by.slow * dt)
        predicted = z + dt * by.u - (dt * start * ahead) * by.m
        reached = xp.root(dot(predicted, predicted) * by.per_q2) / (1.0 + start * by.decay * dt)
        end = _closure(xp, law, shape, predicted, reached, ahead)
    beta = formulas.mean_decay(start, end, by.decay * dt)
    slow_rate, rate_dt = beta * by.slow * dt, beta * by.decay * dt
    left_slow, _ = formulas.relaxation(xp, slow_rate)
    _, mean_gap = formulas.relaxation(xp, xp.maximum(rate_dt - slow_rate, 0.0))  # by rounding less
    left, mean = formulas.relaxation(xp, rate_dt)
    across = (1.0 - beta * share) * dt * left_slow * mean_gap
    new = left * z + (mean * by.decay * dt) * by.q + across * by.m
    if law.elasto_plastic:
        new = new * back_onto(xp, xp.root(dot(new, new) * by.per_q2), formulas.reachable_deflection(xp, size, law))
    new = xp.where(by.moves, new, z + dt * by.u)
    return new, rate(xp, law, shape, new, by)
