"""The reduced model over `xp`: `kernels.steady` and `kernels.reduced` for arrays.

Vectors are `[..., 3]`, scalars and the law's parameters `[..., 1]` or plain numbers. Derivatives are finite everywhere
and those of `kernels.reduced_step`: at rest the step is that of a vanishing twist, `z + u dt`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction import formulas, models
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.steady import HEADER, QUARTIC
from planarfriction.laws import FrictionLaw
from planarfriction.models.reduced_map import MapSizes, maps_of, sizes_of
from planarfriction.patch import ContactPatch
from planarfriction.tensors.bristles import back_onto
from planarfriction.tensors.steps import LAW

AXIS = -1
"""Axis of the components of a state, its only axis."""

PARAMETERS = tuple(name for name in LAW if name != "gamma")
"""Physical parameters, in the order of their vector: the law but gamma, for which the map is made."""

_SQUARES = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
_FOURTHS = [list(each) for each in zip(*((i, j) for i in range(3) for j in range(i, 6)), strict=True)]
"""Factors of the products of two and of four components in the order of `quartic`."""


class ReducedNumbers(NamedTuple):
    """A `models.reduced_map.ReducedShape` as arrays."""

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


class Sliding(NamedTuple):
    """A twist and its steady state, which stay the same during a step; at rest, those of some other twist."""

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


class ReducedParts(NamedTuple):
    """The parts of a patch at one load, as NumPy arrays."""

    sizes: tuple[MapSizes, ...]
    share: np.ndarray
    """Share of the load that each part carries, `[P]`."""
    factor: np.ndarray
    """F of each part, `[P, 3, 3]`."""
    map: np.ndarray
    """Steady sliding of the parts, one map behind the other (see `planarfriction.kernels.steady`)."""


def parts_of(patch: ContactPatch, law: FrictionLaw, normal_force: float | None, **options: Any) -> ReducedParts:
    """Return the parts of a patch at a load [N]; `parts`, `segments` and `speeds` as in `ReducedModel`."""
    model = models.MomentModel(patch, law, load_error=0.0, **options)
    shares, shapes = zip(*model.parts_at(normal_force), strict=True)
    data = [shape.data for shape in shapes]
    factor = np.stack([shape.factor for shape in shapes])
    return ReducedParts(tuple(map(sizes_of, data)), np.array(shares), factor, np.concatenate(data))


def numbers_of(parts: Any) -> list[ReducedNumbers]:
    """Return the numbers of each part as views of `parts`, which is like `ReducedParts`, with arrays of any kind."""
    return [
        ReducedNumbers(
            parts.factor[k],
            data[QUARTIC:HEADER],
            data[4:8],
            data[HEADER : size.middle].reshape(size.faces, *(2 * size.segments + 1,) * 2, 3, 4),
            data[size.middle :].reshape(size.faces, *(2 * size.coarse + 1,) * 2, size.levels, 3, 4),
        )
        for k, (data, size) in enumerate(zip(maps_of(parts.map, parts.sizes), parts.sizes, strict=True))
    ]


def dot(a, b):
    """Return `a . b`, which keeps its axis."""
    return (a * b).sum(-1)[..., None]


# ---------------------------------------------------------------------- the map


def centre(shape: ReducedNumbers) -> tuple[Any, Any]:
    """Return the centre of pressure of a part [m], from its F."""
    f = shape.factor
    x = f[..., 1, 2] / f[..., 1, 1]
    return x, (f[..., 0, 1] * x - f[..., 0, 2]) / f[..., 0, 0]


def _spot(xp, direction, stretch, faces: int):
    """Return face, place on it and sign of the value there (see `kernels.cube.locate`) for unit vectors, `[...]`."""
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
    """Return both ends of the interval around `a`, `[..., 2]`, and their weights of value and slope, `[..., 2, 2]`."""
    n = (nodes - 1) // 2
    t = (a + 1.0) * n
    i = xp.whole(t, 2 * n - 1)
    t = t - i
    v = 1.0 - t
    low = xp.stack([v * v * (1.0 + 2.0 * t), t * v * v], -1)
    high = xp.stack([t * t * (3.0 - 2.0 * t), -t * t * v], -1)
    return xp.stack([i, i + 1], -1), xp.stack([low, high], -2)


def _square(xp, a, b, nodes: int):
    """Return rows and columns of the four nodes around a place, and the weights of their numbers, `[..., 2, 2, 4]`."""
    i, by_a = _interval(xp, a, nodes)
    j, by_b = _interval(xp, b, nodes)
    weights = by_a[..., :, None, None, :] * by_b[..., None, :, :, None]
    return i[..., :, None], j[..., None, :], weights.reshape(*weights.shape[:-2], 4)


def _levels(xp, t, count: int):
    """Return the four levels around t in [0, 1], `[..., 4]`, and their weights: a uniform cubic B-spline."""
    u = t * (count - 3)
    i = xp.whole(u, count - 4)
    u = u - i
    v = 1.0 - u
    weights = [v * v * v, 4.0 + u * u * (3.0 * u - 6.0), 4.0 + v * v * (3.0 * v - 6.0), u * u * u]
    return xp.stack([i, i + 1, i + 2, i + 3], -1), xp.stack(weights, -1) * (1.0 / 6.0)


def _sliding(xp, law: LawNumbers, shape: ReducedNumbers, n, t):
    """Return `sigma_0 z_ss` of unit vectors n at `t` `[..., 1]`."""
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
    """Return `formulas.evenness` of states, 1 without deflection.

    States are divided by their size first, whose fourth power leaves the range of float32.
    """
    bent = dot(z, z) > 0.0
    safe = xp.where(bent, z, 1.0)
    n = safe / xp.root(dot(safe, safe))
    m = n[..., _SQUARES[0]] * n[..., _SQUARES[1]]
    products = m[..., _FOURTHS[0]] * m[..., _FOURTHS[1]]  # not one by one, of which XLA makes ten times the code
    return xp.where(bent, formulas.evenness(dot(n, n), dot(shape.quartic, products)), 1.0)


# ---------------------------------------------------------------------- a twist


def drive(xp, law: LawNumbers, shape: ReducedNumbers, twist) -> Sliding:
    """Return the scaled twist, its steady state and the numbers that follow from both."""
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
    return Sliding(u, q, safe - decay * q, decay, v * power * per_q2, per_q2, moves)


def _closure(xp, law: LawNumbers, shape: ReducedNumbers, z, deflection, share):
    """Return `beta` of a state z, which may be given times any factor (see `kernels.reduced.closure`)."""
    even = _evenness(xp, shape, z) if law.elasto_plastic else 1.0
    deflected = deflection > 0.0
    cosine = xp.where(deflected, share / xp.where(deflected, deflection, 1.0), 0.0)
    return formulas.slip_share(xp, deflection, cosine, even, law)


def _place(xp, z, by: Sliding):
    """Return `|z|/|z_ss|` and `s = z . z_ss/|z_ss|^2`."""
    return xp.root(dot(z, z) * by.per_q2), dot(z, by.q) * by.per_q2


def rate(xp, law: LawNumbers, shape: ReducedNumbers, z, by: Sliding):
    """Return `zdot = V_G - beta (lambda z + s m)`."""
    deflection, share = _place(xp, z, by)
    beta = _closure(xp, law, shape, z, deflection, share)
    return by.u - xp.where(by.moves, beta * (by.decay * z + share * by.m), 0.0)


def wrench(xp, law: LawNumbers, shape: ReducedNumbers, z, zdot, by: Sliding):
    """Return the wrench about the origin per unit load, `F' g`."""
    g = formulas.traction(z, zdot, by.u, law)
    f, x, y, s = shape.factor, g[..., 0], g[..., 1], g[..., 2]
    return xp.stack([f[0, 0] * x, f[0, 1] * x + f[1, 1] * y, f[0, 2] * x + f[1, 2] * y + f[2, 2] * s], -1)


def advance(xp, law: LawNumbers, shape: ReducedNumbers, z, by: Sliding, dt):
    """Return the moments after `dt` of a constant twist, and their rates (see `kernels.reduced_step`)."""
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
