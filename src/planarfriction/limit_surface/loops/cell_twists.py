"""Sums over cells, and their twists of wrenches: the least dissipation, whose minimum often lies on a kink.

A cell sees `u = C V` of a scaled twist: in the plane `target . V = 1` `u = c + a d + b e` at the place `(a, b)`. Cells
that are discs have a third row in C, and no kink.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.bristles.discs import sliding
from planarfriction._engine.codegen.derivatives import derive
from planarfriction._engine.codegen.vectors import dot, norm, plus, times
from planarfriction._engine.compiler import jit, kernel
from planarfriction.limit_surface.loops.twists import (
    lean_of,
    newton_move,
    of_each,
    plane,
)

_BALANCED = 1e-13
"""Slope of the dissipation at which a rounded minimum is found, per `mu f_N` [-]."""

_ROUGH = 1e-3
"""Slope at which the minima of earlier, coarser roundings are found, per `mu f_N` [-]."""

_PLACED = 1e-15
"""Rounding of a place in the plane [-]: a step so short is none."""

_UPHILL = 0.3
"""Slope at the end of an accepted step, relative to that at its start [-]."""

_LAST = 1e-10
"""Speed, relative to the scaled twist, at which the kinks of `|u_i|` are rounded off in the end [-]."""

_RESTS = 1e-6
"""Speed, relative to the scaled twist, below which a cell may be one that rests [-]: it stands on a kink."""

_FULL = 1.0 + 1e-6
"""Most of its friction that a resting cell may bear [-], with what rounding off a kink leaves of it."""

_AT_REST = 1e-14
"""Speed, relative to the scaled twist, below which a cell stands in the centre of rotation and adds nothing [-]."""

_MOST_STEPS = 60
"""Newton steps for each rounding; a handful are usual."""


@kernel
def _pull(u):
    """Return the friction `W/S` of a disc; without a spin that of a point, `u/|u|`."""
    _, _, _, speed, pull = sliding(u)
    return times(1.0 / speed, pull)


_PULL = derive(_pull, ("u",), {"u": 3})
_FORTH = _PULL.forth
_BACK = _PULL.back


@kernel
def _seen_along(levers, spins, i, axis):
    """Return what cell i sees of a unit of one component of the scaled twist."""
    return levers[0, axis, i], levers[1, axis, i], spins[i] if axis == 2 else 0.0


@jit
def cell_sums(levers, spins, weights, units, h, slopes):
    """Write h `[M, 3]` and `dh/dV_S` `[M, 3, 3]` at unit scaled twists `[M, 3]`; cells are those of `cell_twists`."""
    h[:] = 0.0
    slopes[:] = 0.0
    for m in range(units.shape[0]):
        for i in range(weights.shape[0]):
            by_x = _seen_along(levers, spins, i, 0)
            by_y = _seen_along(levers, spins, i, 1)
            along = by_x, by_y, _seen_along(levers, spins, i, 2)
            u = plus(
                plus(times(units[m, 0], by_x), units[m, 1], by_y), units[m, 2], along[2]
            )
            if norm(u) <= _AT_REST:
                continue
            pull, tape = _FORTH(u)
            for j in range(3):
                h[m, j] += weights[i] * dot(pull, along[j])
                (bend,) = _BACK(tape, along[j])
                for k in range(3):
                    slopes[m, j, k] += weights[i] * dot(bend, along[k])


@kernel
def _of_disc(seen, i, a, b):
    """Return slope and Hessian of the mean speed of a disc at a place, and that speed."""
    along_a = (seen[2, i], seen[3, i], seen[7, i])
    along_b = (seen[4, i], seen[5, i], seen[8, i])
    u = plus(plus((seen[0, i], seen[1, i], seen[6, i]), a, along_a), b, along_b)
    pull, tape = _FORTH(u)
    (by_a,) = _BACK(tape, along_a)
    (by_b,) = _BACK(tape, along_b)
    slopes = dot(pull, along_a), dot(pull, along_b)
    return (
        slopes,
        (dot(by_a, along_a), dot(by_a, along_b), dot(by_b, along_b)),
        dot(pull, u),
    )


@kernel
def _is_disc(seen, i):
    return seen[6, i] != 0.0 or seen[7, i] != 0.0 or seen[8, i] != 0.0


@kernel
def _rounded(seen, weights, by_lean, a, b, rounding):
    """Return slope and Hessian of `sum w_i sqrt(|u_i|^2 + rounding^2)`, with the share of the asymmetry, at a place."""
    ga = by_lean[0]
    gb = by_lean[1]
    aa = 0.0
    ab = 0.0
    bb = 0.0
    for i in range(weights.shape[0]):
        ax = seen[2, i]
        ay = seen[3, i]
        bx = seen[4, i]
        by = seen[5, i]
        if _is_disc(seen, i):
            slope, bend, _ = _of_disc(seen, i, a, b)
            ga = ga + weights[i] * slope[0]
            gb = gb + weights[i] * slope[1]
            aa = aa + weights[i] * bend[0]
            ab = ab + weights[i] * bend[1]
            bb = bb + weights[i] * bend[2]
            continue
        ux = seen[0, i] + a * ax + b * bx
        uy = seen[1, i] + a * ay + b * by
        square = ux * ux + uy * uy + rounding * rounding
        pull = weights[i] / math.sqrt(square)
        along_a = ux * ax + uy * ay
        along_b = ux * bx + uy * by
        less = pull / square
        ga += pull * along_a
        gb += pull * along_b
        aa += pull * (ax * ax + ay * ay) - less * along_a * along_a
        ab += pull * (ax * bx + ay * by) - less * along_a * along_b
        bb += pull * (bx * bx + by * by) - less * along_b * along_b
    return ga, gb, aa, ab, bb


@kernel
def _descend(seen, weights, by_lean, a, b, rounding, balanced):
    """Return the place of the rounded minimum, from the place `(a, b)`, and the slope there."""
    ga, gb, aa, ab, bb = _rounded(seen, weights, by_lean, a, b, rounding)
    for _ in range(_MOST_STEPS):
        if math.sqrt(ga * ga + gb * gb) <= balanced:
            break
        da, db = newton_move(ga, gb, aa, ab, bb)
        downhill = da * ga + db * gb
        length = 1.0
        while length > 1e-12:
            ta = a + length * da
            tb = b + length * db
            ga, gb, aa, ab, bb = _rounded(seen, weights, by_lean, ta, tb, rounding)
            # convex along the step: it is short enough while the slope at its end is not steeply uphill
            if da * ga + db * gb <= -_UPHILL * downhill:
                break
            length *= 0.5
        a = ta
        b = tb
        # at a kink the slope stays above the wanted one: a place is only so exact
        if length * math.sqrt(da * da + db * db) <= _PLACED * (1.0 + abs(a) + abs(b)):
            break
    return a, b, ga, gb


@kernel
def _unborne(seen, weights, a, b, ga, gb):
    """Return what is left of a slope after the slowest cell, if it rests, has taken its share; and the dissipation."""
    slowest = math.inf
    rests = 0
    power = 0.0
    for i in range(weights.shape[0]):
        if _is_disc(seen, i):
            power += weights[i] * _of_disc(seen, i, a, b)[2]
            continue
        ux = seen[0, i] + a * seen[2, i] + b * seen[4, i]
        uy = seen[1, i] + a * seen[3, i] + b * seen[5, i]
        speed = math.sqrt(ux * ux + uy * uy)
        power += weights[i] * speed
        if speed < slowest:
            slowest = speed
            rests = i
    left = math.sqrt(ga * ga + gb * gb)
    i = rests
    ax = seen[2, i]
    ay = seen[3, i]
    bx = seen[4, i]
    by = seen[5, i]
    turn = ax * by - ay * bx
    if slowest < _RESTS and turn != 0.0:
        ux = seen[0, i] + a * ax + b * bx
        uy = seen[1, i] + a * ay + b * by
        pull = weights[i] / math.sqrt(ux * ux + uy * uy + _LAST * _LAST)
        fx = pull * ux - (ga * by - gb * ay) / turn
        fy = pull * uy - (gb * ax - ga * bx) / turn
        if math.sqrt(fx * fx + fy * fy) <= _FULL * weights[i]:
            left = 0.0
    return left, power


@kernel
def _in_cells(surface, target):
    levers, spins, weights, lean, seen = surface
    first, second = plane(target)
    for i in range(weights.shape[0]):
        for k in range(2):
            c = (levers[k, 0, i], levers[k, 1, i], levers[k, 2, i])
            seen[k, i], seen[2 + k, i], seen[4 + k, i] = (
                dot(c, target),
                dot(c, first),
                dot(c, second),
            )
        spin = spins[i]
        seen[6, i] = spin * target[2]
        seen[7, i] = spin * first[2]
        seen[8, i] = spin * second[2]
    by_lean = (dot(lean, first), dot(lean, second))
    a = 0.0
    b = 0.0
    ga = 0.0
    gb = 0.0
    rounding = 1.0
    while rounding > 2.0 * _LAST:
        rounding *= 0.1
        balanced = _ROUGH if rounding > 2.0 * _LAST else _BALANCED
        a, b, ga, gb = _descend(seen, weights, by_lean, a, b, rounding, balanced)
    left, power = _unborne(seen, weights, a, b, ga, gb)
    v = plus(plus(target, a, first), b, second)
    power += dot(lean, v)
    return v, power, math.atan2(left, power)


@jit
def cell_twists(levers, spins, weights, frame, wrenches, twists):
    """Find twists with `of_each` for cells, whose C are `levers [2, 3, n]`, and of discs `(0, 0, spins [n])`.

    The kinks are rounded off by a speed that shrinks to nothing, where plain Newton steps would stall on them. A cell
    that rests bears any force up to its friction: a wrench is reached if one such force makes up for what is missing.
    """
    surface = levers, spins, weights, lean_of(frame), np.empty((9, weights.shape[0]))
    return of_each(_in_cells, surface, frame, wrenches, twists)
