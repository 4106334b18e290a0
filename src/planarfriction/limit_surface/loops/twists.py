"""Twists of wrenches: the least dissipation at a given power, by damped Newton steps, for surfaces known to loops.

The gradient h of the dissipation `Phi` has to be parallel to a unit vector `target`, the wrench in conjugate scaled
coordinates with its sign turned. There `Phi` is least in the plane `target . V = 1`; its slope in that plane over `h .
target` is the tangent of the angle by which the wrench of V misses the wanted one.

`frame` [21] is what scaled coordinates are (`LimitSurface._scaling`): the matrices that make targets of wrenches and
twists of scaled twists, row by row, and what an asymmetry adds to h.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction._engine.codegen.vectors import dot, norm, plus, put_all, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.published.surfaces import (
    POTENTIAL,
    sliding,
    sliding_jacobian,
)
from planarfriction.limit_surface.loops import closed_forms

BAD_WRENCH = -1.0
"""Value in place of an angle: a wrench that is zero or not finite."""


class Limits(NamedTuple):
    """Numbers that end a search."""

    balanced: float
    """Angle [rad] at which a twist is found."""
    good: float
    """Angle [rad] below which a step that does not help ends the search: rounding has the rest."""
    level: float
    """Share of the dissipation by which it may rise where the balance gets better: near the minimum that says more."""
    shortest: float
    """Length at which a step that does not help ends the search, over that of Newton's [-]."""


FINE = Limits(1e-12, 1e-10, 1e-9, 1e-14)
"""Limits where the angle at the end is what rounding leaves of the exact surfaces."""

_ROUGH = FINE._replace(balanced=1e-6)
"""Limits of a first guess."""

_FLATTEST = 1e-12
"""Least curvature that a step of Newton's method trusts, relative to the largest [-]: cells in a line have none."""

NORMAL = 2.3e-308
"""Number whose reciprocal is one too: wrenches below it are scaled by that."""

MOST_TRIALS = 400
"""Evaluations at which the search gives up; a handful are usual."""


class StoredPotential(NamedTuple):
    """A surface of kind `POTENTIAL`."""

    data: np.ndarray
    """Numbers of the surface (see `published.surfaces`)."""
    size: int
    """Segments of a quadrant."""
    duals: np.ndarray
    """Directions over their dissipation, `[3, rows, columns]`: the largest `target . dual` is nearest to the answer."""
    mirror: float
    """-1 if the opposite of a dual is one too, else 1."""


class Search(NamedTuple):
    """A search for the least dissipation in a plane."""

    a: float
    b: float
    """Best place so far."""
    ta: float
    tb: float
    """Place to try next."""
    da: float
    db: float
    """Step from the best place, as Newton's method has it or shorter."""
    downhill: float
    """Fall of the dissipation that the slope promises for the step."""
    length: float
    """Share of the step that is tried next."""
    most: float
    """Longest step that is trusted."""
    power: float
    """Dissipation at the best place."""
    slope: float
    """Slope of the dissipation there."""
    angle: float
    """Angle [rad] by which the wrench there misses the wanted one."""
    last: float
    """Length of the step in the plane."""
    going: bool
    """True until the search has ended."""


class _Exact(NamedTuple):
    elements: closed_forms.Elements
    discs: closed_forms.Discs
    rings: closed_forms.Rings
    block: np.ndarray
    held: np.ndarray


# ---------------------------------------------------------------------- coordinates


@kernel
def target_of(frame, wrench):
    """Return the unit vector that h has to be parallel to; a zero vector for a wrench that is zero or not finite."""
    largest = xp.maximum(xp.maximum(abs(wrench[0]), abs(wrench[1])), abs(wrench[2]))
    sound = (
        xp.is_finite(wrench[0])
        and xp.is_finite(wrench[1])
        and xp.is_finite(wrench[2])
        and largest > 0.0
    )
    per = 1.0 / xp.maximum(largest, NORMAL) if sound else 0.0
    x = wrench[0] * per
    y = wrench[1] * per
    s = wrench[2] * per
    t = (
        frame[0] * x + frame[1] * y + frame[2] * s,
        frame[3] * x + frame[4] * y + frame[5] * s,
        frame[6] * x + frame[7] * y + frame[8] * s,
    )
    return times(1.0 / norm(t), t) if sound else (0.0, 0.0, 0.0)


@kernel
def put_twist(frame, v, power, row):
    """Write the twist of the scaled twist v, which dissipates `power`, at unit dissipation."""
    x, y, s = times(1.0 / power, v)
    for i in range(3):
        row[i] = frame[9 + 3 * i] * x + frame[10 + 3 * i] * y + frame[11 + 3 * i] * s


@kernel
def plane(n):
    """Return two unit vectors that span the plane across a unit vector."""
    sign = -1.0 if n[2] < 0.0 else 1.0
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (
        b,
        sign + n[1] * n[1] * a,
        -n[1],
    )


@kernel
def newton_move(ga, gb, aa, ab, bb):
    """Return Newton's step; downhill also where the surface curves downwards, and long where it hardly curves."""
    det = aa * bb - ab * ab
    trace = aa + bb
    if trace > 0.0 and det > 1e-6 * trace * trace:
        return (ab * gb - bb * ga) / det, (ab * ga - aa * gb) / det
    middle = 0.5 * trace
    half = math.sqrt(0.25 * (aa - bb) * (aa - bb) + ab * ab)
    # The larger one, which loses no digits.
    high = middle + half if middle >= 0.0 else middle - half
    if high == 0.0:
        return 0.0, 0.0
    low = xp.maximum(abs(det / high), _FLATTEST * abs(high))
    # of high: its direction is across (ab, bb - high) and across (aa - high, ab)
    angle = 0.5 * math.atan2(2.0 * ab, aa - bb)
    cos = math.cos(angle)
    sin = math.sin(angle)
    if middle < 0.0:
        cos, sin = -sin, cos
    steep = (cos * ga + sin * gb) / abs(high)
    flat = (cos * gb - sin * ga) / low
    return sin * flat - cos * steep, -sin * steep - cos * flat


# ---------------------------------------------------------------------- surfaces


@kernel
def table_at(table, lean, v, scratch):
    """Return `h` and the second derivatives (xx, xy, xs, yy, ys, ss) of the dissipation of a stored potential."""
    size = norm(v)
    per = 1.0 / size
    h = times(
        per, sliding(POTENTIAL, table.data, 0, table.size, v[0], v[1], v[2], size)
    )
    sliding_jacobian(
        POTENTIAL, table.data, 0, table.size, v[0], v[1], v[2], size, scratch
    )
    n = times(per, v)
    second = (
        per * (scratch[0] - h[0] * n[0]), per * (scratch[1] - h[0] * n[1]), per * (scratch[2] - h[0] * n[2]),
        per * (scratch[4] - h[1] * n[1]), per * (scratch[5] - h[1] * n[2]), per * (scratch[8] - h[2] * n[2]),
    )  # fmt: skip
    return plus(h, 1.0, lean), second


@kernel
def _exact_at(surface, lean, v, scratch):
    """Return `h` and the second derivatives of the dissipation of an integrated surface."""
    per = 1.0 / norm(v)
    n = times(per, v)
    if surface.rings.share.shape[0] > 0:
        closed_forms.ring_sum(surface.rings, n[0], n[1], n[2], scratch)
    elif surface.discs.radii.shape[0] > 0:
        put_all(scratch, closed_forms.disc_sum(surface.discs, n[0], n[1], n[2]))
    else:
        closed_forms.element_sum(
            surface.elements, n[0], n[1], n[2], surface.block, surface.held, scratch
        )
    second = (
        per * scratch[3], per * scratch[4], per * scratch[5],
        per * scratch[6], per * scratch[7], per * scratch[8],
    )  # fmt: skip
    return plus((scratch[0], scratch[1], scratch[2]), 1.0, lean), second


@kernel
def _across(a, second, b):
    """Return `a' H b` of second derivatives."""
    return (
        a[0] * (second[0] * b[0] + second[1] * b[1] + second[2] * b[2])
        + a[1] * (second[1] * b[0] + second[3] * b[1] + second[4] * b[2])
        + a[2] * (second[2] * b[0] + second[4] * b[1] + second[5] * b[2])
    )


@kernel
def begin_search(target, guess):
    """Return the axes of the plane in which twists are searched, and a search that tries the guess first."""
    first, second = plane(target)
    per = 1.0 / dot(target, guess)
    a = per * dot(first, guess)
    b = per * dot(second, guess)
    most = math.inf
    return (target, first, second), Search(
        a, b, a, b, 0.0, 0.0, 0.0, 1.0, most, most, most, most, 0.0, True
    )


@kernel
def place_of(axes, a, b):
    """Return the scaled twist at a place in the plane."""
    return plus(plus(axes[0], a, axes[1]), b, axes[2])


@kernel
def _accepted(axes, v, h, slopes, trial, slope, limits, s):
    """Return a search that has gone where it tried, with Newton's step from there."""
    target, first, second = axes
    ga = dot(h, first)
    gb = dot(h, second)
    angle = math.atan2(slope, dot(h, target))
    da, db = newton_move(
        ga,
        gb,
        _across(first, slopes, first),
        _across(first, slopes, second),
        _across(second, slopes, second),
    )
    move = math.sqrt(da * da + db * db)
    going = (angle > limits.balanced) & (move > 0.0)
    # where the last step had to be shortened, the next one begins as short: the curvature there says little
    most = xp.where(s.length < 1.0, 2.0 * s.length * s.last, 4.0 * s.most)
    length = xp.minimum(
        xp.minimum(most, norm(v)) / xp.where(move > 0.0, move, 1.0), 1.0
    )
    da = da * length
    db = db * length
    downhill = abs(da * ga + db * gb)
    ta = s.ta + da
    tb = s.tb + db
    return Search(
        s.ta,
        s.tb,
        ta,
        tb,
        da,
        db,
        downhill,
        1.0,
        most,
        trial,
        slope,
        angle,
        move * length,
        going,
    )


@kernel
def try_place(evaluate, surface, lean, axes, limits, s, scratch):
    """Evaluate the place that a search tries next, and return the search after that.

    A step is taken if the dissipation falls as it should; near the minimum, where rounding rules, a better balance.
    """
    v = place_of(axes, s.ta, s.tb)
    h, slopes = evaluate(surface, lean, v, scratch)
    trial = dot(h, v)
    ga = dot(h, axes[1])
    gb = dot(h, axes[2])
    slope = math.sqrt(ga * ga + gb * gb)
    gain = s.power - trial
    level = (abs(gain) < limits.level * trial) & (slope < 0.9 * s.slope)
    if level | (gain > 1e-4 * s.length * s.downhill):
        return _accepted(axes, v, h, slopes, trial, slope, limits, s)
    length = 0.5 * s.length
    going = (s.angle >= limits.good) & (length >= limits.shortest)
    ta = s.a + length * s.da
    tb = s.b + length * s.db
    return Search(
        s.a, s.b, ta, tb, s.da, s.db, s.downhill, length, s.most, s.power, s.slope, s.angle, s.last, going
    )  # fmt: skip


@kernel
def _least(evaluate, surface, lean, target, guess, limits, scratch):
    """Return the scaled twist of least dissipation in the plane of `target`, its dissipation, and the angle left."""
    axes, search = begin_search(target, guess)
    for _ in range(MOST_TRIALS):
        if not search.going:
            break
        search = try_place(evaluate, surface, lean, axes, limits, search, scratch)
    return place_of(axes, search.a, search.b), search.power, search.angle


@kernel
def _most(duals, row, target, mirror):
    """Return the largest power of a row of duals, as an integer."""
    x = target[0]
    y = target[1]
    s = target[2]
    most = 0
    for j in range(duals.shape[2]):
        power = x * duals[0, row, j] + y * duals[1, row, j] + s * duals[2, row, j]
        most = max(most, xp.in_order(xp.maximum(power, mirror * power)))
    return most


@kernel
def _nearest(table, target):
    """Return the stored direction of least dissipation per unit of power that `target` would have."""
    duals = table.duals
    mirror = table.mirror
    most = 0
    row = 0
    best = 0.0
    column = 0
    sign = 1.0
    for i in range(duals.shape[1]):
        here = _most(duals, i, target, mirror)
        if here > most:
            most = here
            row = i
    for j in range(duals.shape[2]):
        power = (
            target[0] * duals[0, row, j]
            + target[1] * duals[1, row, j]
            + target[2] * duals[2, row, j]
        )
        size = xp.maximum(power, mirror * power)
        if size > best:
            best = size
            column = j
            sign = 1.0 if size == power else -1.0
    return (
        sign * duals[0, row, column],
        sign * duals[1, row, column],
        sign * duals[2, row, column],
    )


# ---------------------------------------------------------------------- entry points


@kernel
def of_each(find, surface, frame, wrenches, twists):
    """Write twists of unit dissipation of wrenches `[M, 3]` into `twists [M, 3]`.

    `find(surface, target)` returns a scaled twist, its dissipation, and the angle [rad] between its wrench and the
    target. Returns the largest of these angles; `BAD_WRENCH` for a wrench that is none.
    """
    worst = 0.0
    for m in range(wrenches.shape[0]):
        target = target_of(frame, wrenches[m])
        if target[0] == 0.0 and target[1] == 0.0 and target[2] == 0.0:
            return BAD_WRENCH
        v, power, angle = find(surface, target)
        put_twist(frame, v, power, twists[m])
        worst = angle if not angle <= worst else worst
    return worst


@kernel
def lean_of(frame):
    """Return what an asymmetry adds to h."""
    return frame[18], frame[19], frame[20]


@kernel
def _in_table(surface, target):
    table, lean, scratch = surface
    return _least(table_at, table, lean, target, _nearest(table, target), FINE, scratch)


@jit
def table_twists(table, frame, wrenches, twists):
    """Find twists with `of_each` for a stored potential."""
    return of_each(
        _in_table, (table, lean_of(frame), np.empty(9)), frame, wrenches, twists
    )


@kernel
def _in_exact(surface, target):
    exact, table, lean, scratch = surface
    guess, _, _ = _least(
        table_at, table, lean, target, _nearest(table, target), _ROUGH, scratch
    )
    return _least(_exact_at, exact, lean, target, guess, FINE, scratch)


@jit
def exact_twists(elements, discs, rings, table, frame, wrenches, twists):
    """Find twists with `of_each` for elements, or for rings or discs if there are any, from those of their `table`."""
    block = np.empty((elements.points.shape[0], 11, elements.corners.shape[0]))
    exact = _Exact(
        elements, discs, rings, block, np.empty(elements.points.shape[0], np.int64)
    )
    return of_each(
        _in_exact, (exact, table, lean_of(frame), np.empty(9)), frame, wrenches, twists
    )


@kernel
def _in_ellipsoid(lean, target):
    # h = V/|V| + lean is parallel to the target: the target's line meets the shifted unit sphere
    along = dot(target, lean)
    v = plus(
        times(along + math.sqrt(along * along + 1.0 - dot(lean, lean)), target),
        -1.0,
        lean,
    )
    return v, norm(v) + dot(lean, v), 0.0


@jit
def ellipsoid_twists(frame, wrenches, twists):
    """Find twists with `of_each` for the ellipsoid, whose answer is known."""
    return of_each(_in_ellipsoid, lean_of(frame), frame, wrenches, twists)
