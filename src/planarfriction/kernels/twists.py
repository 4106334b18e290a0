"""Twists of wrenches: the least dissipation of a sum over cells, whose minimum often lies on a kink."""

from __future__ import annotations

import math

from planarfriction.kernels import jit, kernel

_BALANCED = 1e-13
"""Slope of the dissipation at which a rounded minimum is found, per `mu f_N` [-]."""

_ROUGH = 1e-3
"""The same for the roundings before the last, which only lead there [-]."""

_PLACED = 1e-15
"""Rounding of a place in the plane [-]: over the rounding-off of a kink, the slope that it leaves there."""

_UPHILL = 0.3
"""Slope at the end of an accepted step, relative to that at its start [-]."""

_FLATTEST = 1e-12
"""Least curvature that a step of Newton's method trusts, relative to the largest [-]: cells in a line have none."""

_LAST = 1e-10
"""Speed, relative to the scaled twist, at which the kinks of `|v_i|` are rounded off in the end [-]."""

_MOST_STEPS = 60
"""Newton steps for each rounding; a handful are usual."""


@kernel
def _rounded(x, y, w, target, basis, a, b, rounding):
    """Slope and Hessian of `sum w_i sqrt(|v_i|^2 + rounding^2)` at a place in the plane `target . V = 1`."""
    vx = target[0] + a * basis[0, 0] + b * basis[1, 0]
    vy = target[1] + a * basis[0, 1] + b * basis[1, 1]
    vs = target[2] + a * basis[0, 2] + b * basis[1, 2]
    ga, gb, aa, ab, bb = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(x.shape[0]):
        ux, uy = vx - vs * y[i], vy + vs * x[i]
        pull = w[i] / math.sqrt(ux * ux + uy * uy + rounding * rounding)
        # velocity of the cell per unit of a and of b
        ax, ay = basis[0, 0] - basis[0, 2] * y[i], basis[0, 1] + basis[0, 2] * x[i]
        bx, by = basis[1, 0] - basis[1, 2] * y[i], basis[1, 1] + basis[1, 2] * x[i]
        along_a, along_b = ux * ax + uy * ay, ux * bx + uy * by
        less = pull / (ux * ux + uy * uy + rounding * rounding)
        ga += pull * along_a
        gb += pull * along_b
        aa += pull * (ax * ax + ay * ay) - less * along_a * along_a
        ab += pull * (ax * bx + ay * by) - less * along_a * along_b
        bb += pull * (bx * bx + by * by) - less * along_b * along_b
    return ga, gb, aa, ab, bb


@kernel
def _newton_move(ga, gb, aa, ab, bb):
    """Newton's step; along a direction without curvature, a long one downhill."""
    middle, half = 0.5 * (aa + bb), math.sqrt(0.25 * (aa - bb) * (aa - bb) + ab * ab)
    high = middle + half
    if not high > 0.0:
        return 0.0, 0.0
    low = max((aa * bb - ab * ab) / high, _FLATTEST * high)
    angle = 0.5 * math.atan2(2.0 * ab, aa - bb)
    cos, sin = math.cos(angle), math.sin(angle)
    steep, flat = (cos * ga + sin * gb) / high, (cos * gb - sin * ga) / low
    return sin * flat - cos * steep, -sin * steep - cos * flat


@kernel
def _descend(x, y, w, target, basis, a, b, rounding, balanced):
    """Place of the rounded minimum, from the place `(a, b)`."""
    ga, gb, aa, ab, bb = _rounded(x, y, w, target, basis, a, b, rounding)
    last = math.inf
    for _ in range(_MOST_STEPS):
        size = math.sqrt(ga * ga + gb * gb)
        # at a kink the slope stalls above the wanted one; there it need not halve any more
        if size <= balanced or (size <= _PLACED / rounding and size >= 0.5 * last):
            break
        last = size
        da, db = _newton_move(ga, gb, aa, ab, bb)
        downhill, length = da * ga + db * gb, 1.0
        while length > 1e-12:
            ta, tb = a + length * da, b + length * db
            ga, gb, aa, ab, bb = _rounded(x, y, w, target, basis, ta, tb, rounding)
            # convex along the step: it is short enough while the slope at its end is not steeply uphill
            if da * ga + db * gb <= -_UPHILL * downhill:
                break
            length *= 0.5
        a, b = ta, tb
    return a, b


@jit
def least_dissipation(x, y, w, targets, bases, twists):
    """Scaled twists `[M, 3]` of least `sum w_i |v_i|` in the planes `target . V = 1`; `bases` `[M, 2, 3]` span them.

    The kinks are rounded off by a speed that shrinks to nothing: plain Newton steps stall on them.
    """
    for m in range(targets.shape[0]):
        a, b, rounding = 0.0, 0.0, 1.0
        while rounding > 2.0 * _LAST:
            rounding *= 0.1
            balanced = _ROUGH if rounding > 2.0 * _LAST else _BALANCED
            a, b = _descend(x, y, w, targets[m], bases[m], a, b, rounding, balanced)
        for i in range(3):
            twists[m, i] = targets[m, i] + a * bases[m, 0, i] + b * bases[m, 1, i]
