"""Steady sliding of a patch from a stored map, in scaled coordinates `V_G = F V` (docs/physics.md, "Reduced model").

A map is eight numbers (faces, n, n of the Stribeck part, its levels, knee, least dissipation, stretch, gamma), the 15
coefficients of `<u^4>`, u the cells' speeds at V_G or their bristles in a state, then two maps of `kernels.cube`:
`h_0`, steady sliding at `g = 1`, and the rest r of that at `g = e`, with `e = exp(-|v/v_s|^gamma)`, all of them in
single precision, so that it stays in the processor's cache,

    sigma_0 z_ss = (mu_s - (mu_s - mu_c) t) h_0 + (mu_s - mu_c) r(t),   t = p/(p + knee),   p = |V_G/v_s|^gamma

The maps are over the directions of `(x, y, stretch s)`: where nearly all of the load is on one point, all that happens
lies close to the spin, and is drawn apart. The coefficients are those of `m_i m_j`, i <= 3 and j >= i row by row, with
`m = (x^2, y^2, s^2, x y, x s, y s)`: every product of four components is once among them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels import cube
from planarfriction.kernels.vectors import applied_back, dot, plus, times

QUARTIC = 8
"""Offset of the coefficients of `<u^4>`."""

STILL = 1e-100
"""Scaled speed [m/s] up to which a patch is at rest: squares of what is slower leave the range of doubles."""

FAR = 1e30
"""Steady state [m] of a patch at rest, where it has none: no bristle comes near it, so that nothing decays."""

FAINT = 1e-15
"""Square of a deflection, in the bristles' largest, from which on and up to whose inverse a state has an evenness: the
squares of others leave the range of single precision, and the closure is 0 or 1 there, to the last digits of doubles,
whatever it is."""

HEADER = QUARTIC + 15
"""Numbers in front of a map."""


@kernel
def scaled_twist(shape, vx, vy, omega):
    """Return `V_G = F V`."""
    return shape[0] * vx + shape[1] * vy + shape[2] * omega, shape[3] * vy + shape[4] * omega, shape[5] * omega


@kernel
def number(data, i):
    """Return the number i of a map, in double precision."""
    return np.float64(data[i])


class Steady(NamedTuple):
    """Steady sliding, and its slopes, which the compiler drops where nobody asks for them."""

    q: tuple
    """z_ss; in a single map `sigma_0 z_ss`."""
    by_u: tuple
    """Slopes by the scaled twist, [3, 3] row by row."""
    by_mu_c: tuple
    by_mu_s: tuple
    by_v_s: tuple
    least: float
    """Least dissipation."""


class Head(NamedTuple):
    """The numbers in front of a map, as doubles."""

    faces: float
    n: float
    coarse: float
    """n of the Stribeck part."""
    levels: float
    knee: float
    least: float
    stretch: float
    gamma: float


@kernel
def head_of(data, start):
    """Return `Head` of the map that begins at `start`."""
    return Head(
        number(data, start), number(data, start + 1), number(data, start + 2), number(data, start + 3),
        number(data, start + 4), number(data, start + 5), number(data, start + 6), number(data, start + 7),
    )  # fmt: skip


class Readings(NamedTuple):
    """Both parts of a map at one place, three components each, with their slopes by the place on a face and by t."""

    flat: tuple
    flat_a: tuple
    flat_b: tuple
    rest: tuple
    rest_a: tuple
    rest_b: tuple
    rest_t: tuple


class MapSquares(NamedTuple):
    """Place at which a map is read: both parts, of which each `at` counts all data, and t with what belongs to it."""

    flat: cube.Square
    rest: cube.Square
    t: float
    weights: tuple
    slopes: tuple


@kernel
def located(law, head, start, u, v):
    """Return `Spot` and `MapSquares` of a scaled twist that moves at v, in the map that begins at `start`."""
    spot = cube.locate(u[0], u[1], head.stretch * u[2], head.faces)
    t = formulas.stribeck_place(xp, v, law.v_s, head.gamma, head.knee)
    flat, rest = cube.square(spot, head.n), cube.square(spot, head.coarse)
    level, weights, slopes = cube.levels(t, head.levels)
    side, first = 2.0 * head.n + 1.0, start + HEADER
    second = first + head.faces * side * side * cube.NODE
    flat = cube.Square(first + cube.NODE * flat.at, flat.u, flat.v)
    rest = cube.Square(second + cube.NODE * (head.levels * rest.at + level), rest.u, rest.v)
    return spot, MapSquares(flat, rest, t, weights, slopes)


@kernel
def readings(data, head, places):
    """Return `Readings` of a map."""
    value, by_a, by_b = cube.read(data, head.n, places.flat)
    rest, rest_a, rest_b, rest_t = cube.read_level(
        data, head.coarse, head.levels, places.rest, places.weights, places.slopes
    )
    return Readings(value, by_a, by_b, rest, rest_a, rest_b, rest_t)


@kernel
def _drawn(slope, stretch):
    """Return a slope by `(x, y, stretch s)` as one by (x, y, s)."""
    return slope[0], slope[1], stretch * slope[2]


@kernel
def combined(law, head, u, v, spot, t, read):
    """Return `Steady` of one map from its `Readings`, in front of the floor of the dissipation."""
    drop = law.mu_s - law.mu_c
    flat, rest = times(spot.sign, read.flat), times(spot.sign, read.rest)
    by_t = times(drop, plus(times(spot.sign, read.rest_t), -1.0, flat))
    outer = law.mu_s - drop * t
    a_x, a_y, a_s = plus(times(outer, read.flat_a), drop, read.rest_a)
    b_x, b_y, b_s = plus(times(outer, read.flat_b), drop, read.rest_b)
    v_x, v_y, v_s = by_log_v = times(head.gamma * t * (1.0 - t), by_t)
    along = times((1.0 / v) * (1.0 / v), u)
    by_x = plus(_drawn(cube.gradient(spot, a_x, b_x), head.stretch), v_x, along)
    by_y = plus(_drawn(cube.gradient(spot, a_y, b_y), head.stretch), v_y, along)
    by_s = plus(_drawn(cube.gradient(spot, a_s, b_s), head.stretch), v_s, along)
    by_u = by_x[0], by_x[1], by_x[2], by_y[0], by_y[1], by_y[2], by_s[0], by_s[1], by_s[2]
    by_mu_c, by_mu_s = plus(times(t, flat), -1.0, rest), plus(rest, 1.0 - t, flat)
    q = plus(times(outer, flat), drop, rest)
    return Steady(q, by_u, by_mu_c, by_mu_s, times(-1.0 / law.v_s, by_log_v), head.least)


@kernel
def _map(law, data, start, u, v):
    """Return `Steady` of one map, in front of the floor of the dissipation."""
    head = head_of(data, start)
    spot, places = located(law, head, float(start), u, v)
    return combined(law, head, u, v, spot, places.t, readings(data, head, places))


@kernel
def _mixed(one, other, share):
    return Steady(
        plus(times(1.0 - share, one.q), share, other.q),
        plus(times(1.0 - share, one.by_u), share, other.by_u),
        plus(times(1.0 - share, one.by_mu_c), share, other.by_mu_c),
        plus(times(1.0 - share, one.by_mu_s), share, other.by_mu_s),
        plus(times(1.0 - share, one.by_v_s), share, other.by_v_s),
        (1.0 - share) * one.least + share * other.least,
    )


@kernel
def steady(law, shape, surface, data, u, v):
    """Return `Steady` at the scaled twist, which moves at `v > STILL`; its dissipation is never below the least."""
    # Read in a loop over the maps it would be compiled once, but a step of a fixed shape would take a tenth longer.
    found = _map(law, data, surface[0], u, v)
    if shape[6] > 0.0:
        found = _mixed(found, _map(law, data, surface[1], u, v), shape[6])
    return floored(law, u, v, found)


@kernel
def floored(law, u, v, found):
    """Return `Steady` with a dissipation that is never below the least, and divided by sigma_0."""
    per_v, per, least = 1.0 / v, 1.0 / law.sigma_0, found.least
    n = times(per_v, u)
    power = dot(found.q, n)
    raised = formulas.floored(xp, power, law.mu_c * least) - power
    stays = 1.0 - formulas.floored_slope(xp, power, law.mu_c * least)
    # of the power by V_G; each row i of the slopes gains raised (e_i - n_i n)/v - stays n_i of it
    j = found.by_u
    by_power = plus(plus(applied_back(j, n), per_v, found.q), -power * per_v, n)
    lost = plus(times(raised * per_v, n), stays, by_power)
    x, y, s = plus((j[0], j[1], j[2]), -n[0], lost), plus((j[3], j[4], j[5]), -n[1], lost), (j[6], j[7], j[8])
    s, one = plus(s, -n[2], lost), raised * per_v
    by_u = x[0] + one, x[1], x[2], y[0], y[1] + one, y[2], s[0], s[1], s[2] + one
    by_least = formulas.floored_by_least(xp, power, law.mu_c * least) * least
    by_mu_c = plus(found.by_mu_c, by_least - stays * dot(found.by_mu_c, n), n)
    by_mu_s = plus(found.by_mu_s, -stays * dot(found.by_mu_s, n), n)
    by_v_s = plus(found.by_v_s, -stays * dot(found.by_v_s, n), n)
    return Steady(
        times(per, plus(found.q, raised, n)), times(per, by_u),
        times(per, by_mu_c), times(per, by_mu_s), times(per, by_v_s), least,
    )  # fmt: skip


@kernel
def blended(law, shape, surface, data, u, v):
    """Return `steady`, and the slope of z_ss by the blend, also where that is 0."""
    one = found = _map(law, data, surface[0], u, v)
    change, per = (0.0, 0.0, 0.0), 1.0 / law.sigma_0
    if surface[1] != surface[0]:
        other, n = _map(law, data, surface[1], u, v), times(1.0 / v, u)
        found, change = _mixed(one, other, shape[6]), plus(other.q, -1.0, one.q)
        power, least = dot(found.q, n), law.mu_c * found.least
        stays = 1.0 - formulas.floored_slope(xp, power, least)
        raised = formulas.floored_by_least(xp, power, least) * law.mu_c * (other.least - one.least)
        change = times(per, plus(change, raised - stays * dot(change, n), n))
    return floored(law, u, v, found), change


@kernel
def _fourth(data, k):
    """Return the coefficients of `<u^4>`, row by row."""
    return (
        (
            number(data, k),
            number(data, k + 1),
            number(data, k + 2),
            number(data, k + 3),
            number(data, k + 4),
            number(data, k + 5),
        ),
        (number(data, k + 6), number(data, k + 7), number(data, k + 8), number(data, k + 9), number(data, k + 10)),
        (number(data, k + 11), number(data, k + 12), number(data, k + 13), number(data, k + 14)),
    )


@kernel
def _mixed_fourth(one, other, share):
    return (
        plus(times(1.0 - share, one[0]), share, other[0]),
        plus(times(1.0 - share, one[1]), share, other[1]),
        plus(times(1.0 - share, one[2]), share, other[2]),
    )


@kernel
def fourth_moments(shape, surface, data):
    """Return the coefficients of `<u^4>` of a shape, row by row."""
    rows = _fourth(data, surface[0] + QUARTIC)
    if shape[6] > 0.0:
        rows = _mixed_fourth(rows, _fourth(data, surface[1] + QUARTIC), shape[6])
    return rows


@kernel
def fourth_change(surface, data):
    """Return the slopes of `fourth_moments` by the blend."""
    one, other = _fourth(data, surface[0] + QUARTIC), _fourth(data, surface[1] + QUARTIC)
    return plus(other[0], -1.0, one[0]), plus(other[1], -1.0, one[1]), plus(other[2], -1.0, one[2])


@kernel
def uneven(law, fourth, change, z):
    """Return the slope of the logarithm of `evenness` where its `fourth` moments change."""
    grip = law.sigma_0 / law.mu_s
    x, y, s = p = times(grip, z)
    square = dot(p, p)
    if law.elasto_plastic > 0.0 and square > FAINT and square * FAINT < 1.0:
        m = (x * x, y * y, s * s, x * y, x * s, y * s)
        return -_quartic(change, m) / _quartic(fourth, m)
    return 0.0


@kernel
def _quartic(rows, m):
    """Return `<u^4>` from the products of two components each."""
    m0, m1, m2, m3, m4, m5 = m
    return m0 * dot(rows[0], m) + m1 * dot(rows[1], (m1, m2, m3, m4, m5)) + m2 * dot(rows[2], (m2, m3, m4, m5))


@kernel
def evenness(law, fourth, z):
    """Return `formulas.evenness` of a state, and its slopes by z; 1 for plain bristles. `fourth`: `fourth_moments`."""
    grip = law.sigma_0 / law.mu_s
    x, y, s = z
    px, py, ps = p = times(grip * grip, z)
    square = dot(p, z)
    if law.elasto_plastic > 0.0 and square > FAINT and square * FAINT < 1.0:
        m = (px * x, py * y, ps * s, px * y, px * s, py * s)
        (a0, a1, a2, a3, a4, a5), (b1, b2, b3, b4, b5), (c2, c3, c4, c5) = rows = fourth
        m0, m1, m2 = m[0], m[1], m[2]
        a, b, c = dot(rows[0], m), dot(rows[1], (m1, m2, m[3], m[4], m[5])), dot(rows[2], (m2, m[3], m[4], m[5]))
        total = m0 * a + m1 * b + m2 * c
        even, per = formulas.evenness(square, total), 4.0 / total
        k_x, k_y, k_s = a + a0 * m0, a1 * m0 + b + b1 * m1, a2 * m0 + b2 * m1 + c + c2 * m2
        k_xy, k_xs, k_ys = a3 * m0 + b3 * m1 + c3 * m2, a4 * m0 + b4 * m1 + c4 * m2, a5 * m0 + b5 * m1 + c5 * m2
        by_x = square * px - even * (0.5 * k_x * px + 0.25 * (k_xy * py + k_xs * ps))
        by_y = square * py - even * (0.5 * k_y * py + 0.25 * (k_xy * px + k_ys * ps))
        by_s = square * ps - even * (0.5 * k_s * ps + 0.25 * (k_xs * px + k_ys * py))
        return even, (per * by_x, per * by_y, per * by_s)
    return 1.0, (0.0, 0.0, 0.0)


@kernel
def sliding(law, vx, vy, omega, shape, surface, data):
    """Return the scaled twist, its norm and its steady state (any where the patch is at rest)."""
    x, y, s = scaled_twist(shape, vx, vy, omega)
    v = math.sqrt(x * x + y * y + s * s)
    if v > STILL:
        qx, qy, qs = steady(law, shape, surface, data, (x, y, s), v).q
        return x, y, s, v, qx, qy, qs
    return 0.0, 0.0, 0.0, 0.0, FAR, 0.0, 0.0
