"""Closed forms of `Phi(V) = int |v|` over segments, triangles, rectangles and rings: gradient and second derivatives.

Derived in docs/physics.md, "Exact limit surfaces".

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

import numpy as np

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import jit, kernel
from planarfriction.kernels.vectors import accumulate

POINTS, SEGMENTS, QUADS = 1, 2, 4
"""Kinds of elements by their number of corners; a triangle is a quad with two corners in one place."""

# Distance of the centre of rotation from a segment, relative to its length, below which the distance is rounding: the
# second derivatives grow with its logarithm.
_ON_SEGMENT = 1e-15

# Stands for a distance of zero in a denominator whose numerator is zero.
_TINY = 1e-150

# As in `kernels.surfaces`: a point slower than this share of the twist stands in the centre of rotation.
_AT_REST = 1e-14


@kernel
def _segment(ax, ay, bx, by):
    """Height h of the origin over the line from a to b (> 0 to the left), and f, G, M of the segment.

    `d = h n + t tau`: with `S = |a| + |b|` and length L, `int 1/|d| = log((S + L)/(S - L))`; differences between the
    two ends are written without cancellation.
    """
    ex, ey = bx - ax, by - ay
    length = math.sqrt(ex * ex + ey * ey)
    per_length = 1.0 / xp.maximum(length, _TINY)
    tx, ty = ex * per_length, ey * per_length
    h = ax * ty - ay * tx
    t1, t2 = ax * tx + ay * ty, bx * tx + by * ty
    d1, d2 = math.sqrt(h * h + t1 * t1), math.sqrt(h * h + t2 * t2)
    per_d1, per_d2 = 1.0 / xp.maximum(d1, _TINY), 1.0 / xp.maximum(d2, _TINY)
    total = xp.maximum(d1 + d2, _TINY)
    both, product = t1 + t2, t1 * t2
    if product > 0.0:  # the foot of the height is outside the segment
        half_gap = d1 * d2 + product + h * h
        turn = h * h * length * both / (t2 * d1 + t1 * d2) * per_d1 * per_d2
    else:
        half_gap = h * h * (1.0 + (t1 * t1 + t2 * t2 + h * h) / xp.maximum(d1 * d2 - product, _TINY * _TINY))
        turn = t2 * per_d2 - t1 * per_d1
    half_gap = xp.maximum(half_gap, (_ON_SEGMENT * length) ** 2 + _TINY)
    inverse = math.log1p(length * (total + length) / half_gap)
    rise = length * both / total
    f = 0.25 * length * (total + both * both / total) + 0.5 * h * h * inverse
    gx, gy = ty * h * inverse + tx * rise, -tx * h * inverse + ty * rise
    side = h * rise * per_d1 * per_d2
    along = inverse - turn
    mxx = ty * ty * turn + 2.0 * tx * ty * side + tx * tx * along
    mxy = -tx * ty * turn + (ty * ty - tx * tx) * side + tx * ty * along
    myy = tx * tx * turn - 2.0 * tx * ty * side + ty * ty * along
    return h, f, gx, gy, mxx, mxy, myy


@kernel
def _to_twist(density, s, cx, cy, f, gx, gy, mxx, mxy, myy):
    """Gradient (3) and second derivatives (xx, xy, xs, yy, ys, ss) with respect to the twist, from f, G and M."""
    signed = xp.where(s < 0.0, -density, density)
    per = density / abs(s)
    x, y = mxy * cx - mxx * cy, myy * cx - mxy * cy
    return (
        -signed * gy, signed * gx, signed * (f + cx * gx + cy * gy),
        per * mxx, per * mxy, per * x, per * myy, per * y, per * (y * cx - x * cy),
    )  # fmt: skip


@kernel
def _near(corners, i, count, density, s, cx, cy):
    """Closed form of element i: a segment, or a signed sum over the sides of a quad."""
    if count == SEGMENTS:
        _, f, gx, gy, mxx, mxy, myy = _segment(
            corners[i, 0, 0] - cx, corners[i, 0, 1] - cy, corners[i, 1, 0] - cx, corners[i, 1, 1] - cy
        )
        return _to_twist(density, s, cx, cy, f, gx, gy, mxx, mxy, myy)
    f, gx, gy, mxx, mxy, myy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(4):
        n = (k + 1) % 4
        h, sf, sgx, sgy, sxx, sxy, syy = _segment(
            corners[i, k, 0] - cx, corners[i, k, 1] - cy, corners[i, n, 0] - cx, corners[i, n, 1] - cy
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
    """Gauss rule `tier` on the first `count` elements of its block, `p = P + xi A + eta B + xi eta C`.

    The elements run innermost, so that the loop vectorises.
    """
    hx, hy, hs, xx, xy, xs, yy, ys, ss = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(points):
        xi, eta, weight = rules[tier, 0, k], rules[tier, 1, k], rules[tier, 2, k]
        both = xi * eta
        for n in range(count):
            qx = block[tier, 0, n] + xi * block[tier, 2, n] + eta * block[tier, 4, n] + both * block[tier, 6, n]
            qy = block[tier, 1, n] + xi * block[tier, 3, n] + eta * block[tier, 5, n] + both * block[tier, 7, n]
            ux, uy = x - s * qy, y + s * qx
            per = 1.0 / math.sqrt(ux * ux + uy * uy)
            w = weight * (block[tier, 8, n] + xi * block[tier, 9, n] + eta * block[tier, 10, n])
            ex, ey = ux * per, uy * per
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
    """Which Gauss rule serves an element; -1 for the closed form."""
    tier = -1
    while tier + 1 < reach.shape[0] and speed >= reach[tier + 1] * size:
        tier += 1
    return tier


@jit
def element_sums(corners, shape, rules, points, reach, twist, sums):
    """Gradient and second derivatives of `Phi` at unit twists `[M, 3]` into `sums [M, 9]`.

    Elements: `corners [N, count, 2]`, and `shape [N, 13]`: the coefficients P, A, B, C of `_far`, those of its Jacobian
    determinant times the weight per length or area, the radius about P, and that weight itself. Gauss rules
    `rules [J, 3, K]` (xi, eta, weight), of which rule j has `points[j]` points and is used from the distance `reach[j]`
    radii on.
    """
    number, count = corners.shape[0], corners.shape[1]
    tiers = points.shape[0]
    block = np.empty((tiers, 11, number))
    held = np.zeros(tiers, np.int64)
    for m in range(twist.shape[0]):
        x, y, s = twist[m, 0], twist[m, 1], twist[m, 2]
        sums[m] = 0.0
        held[:] = 0
        for i in range(number):
            ux, uy = x - s * shape[i, 1], y + s * shape[i, 0]
            speed = math.sqrt(ux * ux + uy * uy)
            if count == POINTS:
                tier = 0
                if speed <= _AT_REST:
                    continue
            else:
                tier = _tier(reach, speed, abs(s) * shape[i, 11])
            if tier < 0:
                accumulate(sums[m], 0, 1, _near(corners, i, count, shape[i, 12], s, -y / s, x / s))
            else:
                for k in range(11):
                    block[tier, k, held[tier]] = shape[i, k]
                held[tier] += 1
        for tier in range(tiers):
            accumulate(sums[m], 0, 1, _far(block, tier, held[tier], rules, points[tier], x, y, s))


@kernel
def _elliptic(complement):
    """Complete elliptic integrals `B = int cos^2/Delta` and `D = int sin^2/Delta`, `Delta^2 = 1 - m sin^2`.

    `complement = 1 - m > 0`. By the arithmetic-geometric mean: `K = pi/(2 agm)`, `D = K (1/2 + sum 2^(n-1) c_n^2/m)`.
    """
    a, b = 1.0, math.sqrt(complement)
    # c_1^2/m, without cancellation where m is small
    c = 0.5 * (1.0 - complement) / (1.0 + b)
    total, power = 0.5, 1.0
    per_m = 0.25 * (1.0 - complement) / ((1.0 + b) * (1.0 + b))
    total += power * per_m
    a, b = 0.5 * (a + b), math.sqrt(b)
    while abs(c) > 1e-9 * a:
        # c_(n+1) = c_n^2/(4 a_(n+1)), and so is its square over m
        nxt = 0.5 * (a + b)
        b = math.sqrt(a * b)
        a = nxt
        ratio = c / (4.0 * a)
        per_m *= ratio * ratio
        c *= ratio
        power *= 2.0
        total += power * per_m
    first = 0.5 * math.pi / a
    return first * (1.0 - total), first * total


@jit
def ring_sums(radius, weight, twist, sums):
    """As `element_sums` for rings about the centre of pressure, `radius` and `weight` `[M, K]` at unit twists `[M, 3]`.

    A ring whose rim runs at q and slides at v: `Phi = 2/pi (v + q) E(4 v q/(v + q)^2)`, in its derivatives with
    `k = min(v, q)/max(v, q)`: `2/pi E(k^2)` by the larger of v and q, `2/pi k B` by the smaller.
    """
    for m in range(twist.shape[0]):
        x, y, s = twist[m, 0], twist[m, 1], twist[m, 2]
        v = math.sqrt(x * x + y * y)
        spin, along, across, cross, twirl = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(radius.shape[1]):
            rho = radius[m, k]
            q = abs(s) * rho
            large, small = xp.maximum(v, q), xp.minimum(v, q)
            if not large > 0.0:
                continue
            gap = abs(v - q) / large
            ratio = small / large
            complement = xp.maximum(gap * (1.0 + ratio), 1e-32)
            b, d = _elliptic(complement)
            e = b + complement * d
            w = weight[m, k] * 2.0 / (math.pi * large)
            by_slide, by_spin = (e, b) if v >= q else (b, e)
            across += w * by_slide
            spin += w * by_spin * rho * rho
            curve = w * d / (large * large)
            along += curve * q * q
            cross -= curve * rho * rho
            twirl += curve * rho * rho
        per = 1.0 / v if v > 0.0 else 0.0
        ex, ey = x * per, y * per
        sums[m, 0], sums[m, 1], sums[m, 2] = across * x, across * y, spin * s
        sums[m, 3] = across + (along - across) * ex * ex
        sums[m, 4] = (along - across) * ex * ey
        sums[m, 5] = cross * x * s
        sums[m, 6] = across + (along - across) * ey * ey
        sums[m, 7] = cross * y * s
        sums[m, 8] = twirl * v * v
