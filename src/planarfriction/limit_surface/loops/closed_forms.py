"""Closed forms of `Phi(V) = int |v|` over segments, triangles, rectangles and rings: gradient and second derivatives.

Derived in docs/exact-surfaces.md, "Limit surfaces in closed form".

`V = (x, y, s)` at the centre of pressure in any scale of lengths; the velocity of a place p is
`v = (x - s py, y + s px) = s J d`, `d = p - c`, with the centre of rotation `c = (-y, x)/s` and J a quarter turn. So
three integrals suffice,

    f = int |d|,   G = int d/|d|,   M = int d d'/|d|^3,
    dPhi/d(x, y) = sign(s) J G,   dPhi/ds = sign(s) (f + c . G),   d2Phi/dV2 = T' M T/|s|,   T = [1 0 -cy; 0 1 cx],

each homogeneous in d: over the triangle between c and a segment at height h they are h/3, h/2 and h times those along
the segment, and any polygon is a signed sum of such triangles.

Far from the centre of rotation that sum loses digits (about distance/size of them times 1e-16) and c runs away; there a
Gauss rule on the velocities takes over, and it has no trouble with s = 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction._engine.codegen.vectors import accumulate, clear, plus, put_all
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel

POINTS = 1
"""Kind of an element: a point, with one corner."""

SEGMENTS = 2
"""Kind of an element: a segment, with two corners."""

QUADS = 4
"""Kind of an element: a quad; a triangle is a quad with two corners in one place."""


class Elements(NamedTuple):
    """Points, segments or quads."""

    corners: np.ndarray
    """Corners `[N, count, 2]`."""
    shape: np.ndarray
    """Coefficients P, A, B, C of `_far`, of its Jacobian determinant times a weight, radius, weight, `[N, 13]`."""
    rules: np.ndarray
    """Gauss rules `[J, 3, K]` (xi, eta, weight)."""
    points: np.ndarray
    """Number of points of each rule, `[J]`."""
    reach: np.ndarray
    """The distance in radii from which on each rule is used, `[J]`."""


class Discs(NamedTuple):
    """Evenly loaded discs; a hole has a negative load."""

    radii: np.ndarray
    """`[K]`."""
    places: np.ndarray
    """Middles of the discs `[2, K]`."""
    loads: np.ndarray
    """Shares of the load of the discs, `[K]`."""


class Rings(NamedTuple):
    """A disc or ring about the centre of pressure under the pressure of a soft fingertip."""

    share: np.ndarray
    """Nodes of a rule on (0, 1), `[K]`."""
    weight: np.ndarray
    """Weights of the nodes, `[K]`."""
    inner: float
    outer: float
    """Radii between which there is load."""
    radius: float
    """Radius at which the pressure ends."""
    exponent: float
    """Exponent of the profile."""


# Distance of the centre of rotation from a segment, relative to its length, below which the distance is rounding: the
# second derivatives grow with its logarithm.
_ON_SEGMENT = 1e-15

# Stands for a distance of zero in a denominator whose numerator is zero.
_TINY = 1e-150

# As in `published.surfaces`: a point slower than this share of the twist stands in the centre of rotation.
_AT_REST = 1e-14


@kernel
def _segment(ax, ay, bx, by):
    """Compute the height h of the origin over the line from a to b (> 0 to the left), and f, G, M of the segment.

    `d = h n + t tau`: with `S = |a| + |b|` and length L, `int 1/|d| = log((S + L)/(S - L))`; differences between the
    two ends are written without cancellation.
    """
    ex = bx - ax
    ey = by - ay
    length = math.sqrt(ex * ex + ey * ey)
    per_length = 1.0 / xp.maximum(length, _TINY)
    tx = ex * per_length
    ty = ey * per_length
    h = ax * ty - ay * tx
    t1 = ax * tx + ay * ty
    t2 = bx * tx + by * ty
    d1 = math.sqrt(h * h + t1 * t1)
    d2 = math.sqrt(h * h + t2 * t2)
    per_d1 = 1.0 / xp.maximum(d1, _TINY)
    per_d2 = 1.0 / xp.maximum(d2, _TINY)
    total = xp.maximum(d1 + d2, _TINY)
    both = t1 + t2
    product = t1 * t2
    if product > 0.0:  # the foot of the height is outside the segment
        half_gap = d1 * d2 + product + h * h
        turn = h * h * length * both / (t2 * d1 + t1 * d2) * per_d1 * per_d2
    else:
        half_gap = (
            h
            * h
            * (
                1.0
                + (t1 * t1 + t2 * t2 + h * h)
                / xp.maximum(d1 * d2 - product, _TINY * _TINY)
            )
        )
        turn = t2 * per_d2 - t1 * per_d1
    half_gap = xp.maximum(half_gap, (_ON_SEGMENT * length) ** 2 + _TINY)
    inverse = math.log1p(length * (total + length) / half_gap)
    rise = length * both / total
    f = 0.25 * length * (total + both * both / total) + 0.5 * h * h * inverse
    gx = ty * h * inverse + tx * rise
    gy = -tx * h * inverse + ty * rise
    side = h * rise * per_d1 * per_d2
    along = inverse - turn
    mxx = ty * ty * turn + 2.0 * tx * ty * side + tx * tx * along
    mxy = -tx * ty * turn + (ty * ty - tx * tx) * side + tx * ty * along
    myy = tx * tx * turn - 2.0 * tx * ty * side + ty * ty * along
    return h, f, gx, gy, mxx, mxy, myy


@kernel
def _to_twist(density, s, cx, cy, f, gx, gy, mxx, mxy, myy):
    """Return the gradient (3) and second derivatives (xx, xy, xs, yy, ys, ss) by the twist, from f, G and M."""
    signed = xp.where(s < 0.0, -density, density)
    per = density / abs(s)
    x = mxy * cx - mxx * cy
    y = myy * cx - mxy * cy
    return (
        -signed * gy, signed * gx, signed * (f + cx * gx + cy * gy),
        per * mxx, per * mxy, per * x, per * myy, per * y, per * (y * cx - x * cy),
    )  # fmt: skip


@kernel
def _near(corners, i, count, density, s, cx, cy):
    """Return the closed form of element i: a segment, or a signed sum over the sides of a quad."""
    if count == SEGMENTS:
        _, f, gx, gy, mxx, mxy, myy = _segment(
            corners[i, 0, 0] - cx,
            corners[i, 0, 1] - cy,
            corners[i, 1, 0] - cx,
            corners[i, 1, 1] - cy,
        )
        return _to_twist(density, s, cx, cy, f, gx, gy, mxx, mxy, myy)
    f = 0.0
    gx = 0.0
    gy = 0.0
    mxx = 0.0
    mxy = 0.0
    myy = 0.0
    for k in range(4):
        n = (k + 1) % 4
        h, sf, sgx, sgy, sxx, sxy, syy = _segment(
            corners[i, k, 0] - cx,
            corners[i, k, 1] - cy,
            corners[i, n, 0] - cx,
            corners[i, n, 1] - cy,
        )
        f += h * sf * (1.0 / 3.0)
        gx += 0.5 * h * sgx
        gy += 0.5 * h * sgy
        mxx += h * sxx
        mxy += h * sxy
        myy += h * syy
    return _to_twist(density, s, cx, cy, f, gx, gy, mxx, mxy, myy)


@kernel
def _far(block, tier, count, rules, points, x, y, s):
    """Apply Gauss rule `tier` to the first `count` elements of its block, `p = P + xi A + eta B + xi eta C`.

    The elements run innermost, so that the loop vectorises.
    """
    hx = 0.0
    hy = 0.0
    hs = 0.0
    xx = 0.0
    xy = 0.0
    xs = 0.0
    yy = 0.0
    ys = 0.0
    ss = 0.0
    for k in range(points):
        xi = rules[tier, 0, k]
        eta = rules[tier, 1, k]
        weight = rules[tier, 2, k]
        both = xi * eta
        for n in range(count):
            qx = (
                block[tier, 0, n]
                + xi * block[tier, 2, n]
                + eta * block[tier, 4, n]
                + both * block[tier, 6, n]
            )
            qy = (
                block[tier, 1, n]
                + xi * block[tier, 3, n]
                + eta * block[tier, 5, n]
                + both * block[tier, 7, n]
            )
            ux = x - s * qy
            uy = y + s * qx
            per = 1.0 / math.sqrt(ux * ux + uy * uy)
            w = weight * (
                block[tier, 8, n] + xi * block[tier, 9, n] + eta * block[tier, 10, n]
            )
            ex = ux * per
            ey = uy * per
            lever = qx * ex + qy * ey
            hx += w * ex
            hy += w * ey
            hs += w * (qx * ey - qy * ex)
            turn = w * per
            xx += turn * ey * ey
            xy -= turn * ey * ex
            xs -= turn * ey * lever
            yy += turn * ex * ex
            ys += turn * ex * lever
            ss += turn * lever * lever
    return hx, hy, hs, xx, xy, xs, yy, ys, ss


@kernel
def _tier(reach, speed, size):
    """Return the index of the Gauss rule for an element; -1 for the closed form."""
    tier = -1
    while tier + 1 < reach.shape[0] and speed >= reach[tier + 1] * size:
        tier += 1
    return tier


@kernel
def element_sum(elements, x, y, s, block, held, sums):
    """Compute gradient and second derivatives of `Phi` at a unit twist into the row `sums` [9].

    `block` [J, 11, N] and `held` [J] are scratch.
    """
    corners = elements.corners
    shape = elements.shape
    tiers = elements.points.shape[0]
    number = corners.shape[0]
    count = corners.shape[1]
    for tier in range(tiers):
        held[tier] = 0
    clear(sums, 9)
    for i in range(number):
        ux = x - s * shape[i, 1]
        uy = y + s * shape[i, 0]
        speed = math.sqrt(ux * ux + uy * uy)
        if count == POINTS:
            tier = 0
            if speed <= _AT_REST:
                continue
        else:
            tier = _tier(elements.reach, speed, abs(s) * shape[i, 11])
        if tier < 0:
            accumulate(
                sums, 0, 1, _near(corners, i, count, shape[i, 12], s, -y / s, x / s)
            )
        else:
            for k in range(11):
                block[tier, k, held[tier]] = shape[i, k]
            held[tier] += 1
    for tier in range(tiers):
        accumulate(
            sums,
            0,
            1,
            _far(
                block, tier, held[tier], elements.rules, elements.points[tier], x, y, s
            ),
        )


@jit
def element_sums(elements, twist, sums):
    """Compute `element_sum` at unit twists `[M, 3]` into `sums [M, 9]`."""
    block = np.empty((elements.points.shape[0], 11, elements.corners.shape[0]))
    held = np.empty(elements.points.shape[0], np.int64)
    for m in range(twist.shape[0]):
        element_sum(
            elements, twist[m, 0], twist[m, 1], twist[m, 2], block, held, sums[m]
        )


@kernel
def _elliptic(complement):
    """Compute the complete elliptic integrals `B = int cos^2/Delta`, `D = int sin^2/Delta` and `C = (D - B)/m`.

    `Delta^2 = 1 - m sin^2`, `complement = 1 - m > 0`. By the arithmetic-geometric mean: `K = pi/(2 agm)`,
    `D = K (1/2 + m S)`, `B = K (1/2 - m S)`, `S = sum 2^(n-1) c_n^2/m^2`.
    """
    b = math.sqrt(complement)
    m = 1.0 - complement
    c = 0.5 * m / (1.0 + b)  # c_1, without cancellation where m is small
    first = 0.25 / ((1.0 + b) * (1.0 + b))
    means = (0.5 * (1.0 + b), math.sqrt(b), c, first, first)
    # from 1 - m = 1e-32 on, these are enough; a loop that stops by itself does not vectorise
    means = _means(_means(_means(means, 2.0), 4.0), 8.0)
    means = _means(_means(_means(_means(means, 16.0), 32.0), 64.0), 128.0)
    size = 0.5 * math.pi / means[0]
    total = means[4]
    return size * (0.5 - m * total), size * (0.5 + m * total), 2.0 * size * total


@kernel
def _means(means, power):
    """Return the next arithmetic and geometric mean, c_n, its square over m^2, and their sum weighted with `power`."""
    a, b, c, square, total = means
    mean = 0.5 * (a + b)
    # C_(n+1) = c_n^2/(4 a_(n+1)), and so is its square over m^2.
    ratio = c / (4.0 * mean)
    square *= ratio * ratio
    return mean, math.sqrt(a * b), c * ratio, square, total + power * square


@kernel
def _axial(x, y, s, v, across, spin, along, twirl):
    """Return gradient and second derivatives of a function of the slide speed v and the spin alone."""
    per = 1.0 / v if v > 0.0 else 0.0
    ex = x * per
    ey = y * per
    more = along - across
    return (
        across * x, across * y, spin * s,
        across + more * ex * ex, more * ex * ey, -twirl * x * s, across + more * ey * ey, -twirl * y * s, twirl * v * v,
    )  # fmt: skip


@kernel
def _ratio(v, q):
    """Return the larger of two speeds, the smaller over it, and `1 - m` of `m = ratio^2`, never zero."""
    large = xp.maximum(xp.maximum(v, q), _TINY)
    ratio = xp.minimum(v, q) / large
    return large, ratio, xp.maximum(abs(v - q) / large * (1.0 + ratio), 1e-32)


@kernel
def disc_sum(discs, x, y, s):
    """Compute as `element_sum` for evenly loaded discs, in closed form (docs/exact-surfaces.md, "Uniform disc")."""
    total = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(discs.radii.shape[0]):
        radius = discs.radii[k]
        px = discs.places[0, k]
        py = discs.places[1, k]
        ux = x - s * py
        uy = y + s * px
        v = math.sqrt(ux * ux + uy * uy)
        q = abs(s) * radius
        large, ratio, complement = _ratio(v, q)
        b, d, c = _elliptic(complement)
        e = complement * d
        w = discs.loads[k] * 4.0 / (math.pi * large)
        if v < q:
            by_spin = b * (3.0 - ratio * ratio) + e * (3.0 - 2.0 * ratio * ratio)
            curve = b + 2.0 * e
        else:
            by_spin = 3.0 * b + c - d
            curve = d - c
        curve *= w / (3.0 * large * large)
        across = w * (2.0 * b + e) * (1.0 / 3.0)
        spin = w * by_spin * radius * radius * (1.0 / 9.0)
        own = _axial(ux, uy, s, v, across, spin, curve * q * q, curve * radius * radius)
        total = plus(total, 1.0, _about_origin(own, px, py))
    return total


@kernel
def _about_origin(sums, px, py):
    """Return gradient and second derivatives by the twist at the origin, from those by the twist at (px, py)."""
    fx, fy, fs, xx, xy, xs, yy, ys, ss = sums
    x_turn = px * xy - py * xx + xs
    y_turn = px * yy - py * xy + ys
    return (
        fx,
        fy,
        fs + px * fy - py * fx,
        xx,
        xy,
        x_turn,
        yy,
        y_turn,
        px * (y_turn + ys) - py * (x_turn + xs) + ss,
    )


@jit
def disc_sums(discs, twist, sums):
    """Compute `disc_sum` at unit twists `[M, 3]` into `sums [M, 9]`."""
    for m in range(twist.shape[0]):
        put_all(sums[m], disc_sum(discs, twist[m, 0], twist[m, 1], twist[m, 2]))


@kernel
def _rings(rings, start, end, s, v, sums):
    """Add the rings between two radii to `sums`: the load, then the arguments of `_axial`."""
    load = 0.0
    spin = 0.0
    along = 0.0
    across = 0.0
    twirl = 0.0
    for n in range(rings.share.shape[0]):
        rho = start + (end - start) * rings.share[n]
        q = abs(s) * rho
        large, _, complement = _ratio(v, q)
        b, d, _ = _elliptic(complement)
        e = b + complement * d
        inside = xp.minimum(rho / rings.radius, 1.0)
        pressure = xp.exp(
            formulas.soft_finger(xp, inside, rings.exponent) / rings.exponent
        )
        part = (end - start) * rings.weight[n] * rho * pressure
        w = part * 2.0 / (math.pi * large)
        curve = w * d / (large * large)
        load += part
        across += w * xp.where(v >= q, e, b)
        spin += w * xp.where(v >= q, b, e) * rho * rho
        along += curve * q * q
        twirl += curve * rho * rho
    sums[0] += load
    sums[1] += across
    sums[2] += spin
    sums[3] += along
    sums[4] += twirl


@kernel
def ring_sum(rings, x, y, s, sums):
    """Compute as `element_sum` for rings.

    A ring whose rim runs at q and slides at v: `Phi = 2/pi (v + q) E(4 v q/(v + q)^2)`, in its derivatives with
    `k = min(v, q)/max(v, q)`: `2/pi E(k^2)` by the larger of v and q, `2/pi k B` by the smaller.
    """
    v = math.sqrt(x * x + y * y)
    # where the rim runs as fast as the ring slides, the sum over the radii has a kink
    kink = (
        rings.outer
        if v >= abs(s) * rings.outer
        else xp.maximum(v / abs(s), rings.inner)
    )
    clear(sums, 5)
    _rings(rings, rings.inner, kink, s, v, sums)
    _rings(rings, kink, rings.outer, s, v, sums)
    per = 1.0 / sums[0]
    across = per * sums[1]
    spin = per * sums[2]
    along = per * sums[3]
    twirl = per * sums[4]
    put_all(sums, _axial(x, y, s, v, across, spin, along, twirl))


@jit
def ring_sums(rings, twist, sums):
    """Compute `ring_sum` at unit twists `[M, 3]` into `sums [M, 9]`."""
    for m in range(twist.shape[0]):
        ring_sum(rings, twist[m, 0], twist[m, 1], twist[m, 2], sums[m])
