"""The step in contact space along the curve from no friction to all of it, where Newton's method alone fails.

With a share t of the friction the equation is `W = w(V_0 + t A W, N_0 + t B W)`. It has one solution at t = 0, and those
of the step at t = 1. A curve of solutions begins at the first; as friction is bounded it does not run away, so it ends at
one of the others. It turns back where friction falls with speed, so t does not measure it: its arc length does, with
wrenches in units of the load. Its tangent has `M (dW, dt) = 0`, and Newton steps back to the curve have `M (dW, dt) = s`
across the tangent, with `M = [I - t C, -C W]`, `C = P A + u B`; which way it goes is known from the sign of a
determinant, which stays along the curve, at kinks too.
"""

from __future__ import annotations

import math

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels.coupling_rows import Patches, Problem
from planarfriction.kernels.coupling_steps import follow_host, misfit_of, row_applied, step_all, write_load_slopes
from planarfriction.kernels.small_matrices import solved
from planarfriction.kernels.vectors import clear, copy

STEPS = 1000
"""Largest number of steps along the curve."""

LONGEST = 0.5
"""Longest step along the curve, of which the share of friction takes 1."""

CORRECTIONS = 8
"""Largest number of Newton steps back to the curve, after which the step along it is shortened."""

HALVINGS = 40
"""Largest number of times that a step along the curve is halved."""

NEAR = 1e-7
"""Distance from the curve at which the next step begins, in loads."""

LAST = 50
"""Largest number of Newton steps with all of the friction."""


@kernel
def _per_wrench(patches: Patches, p: Problem, i: int) -> float:
    """Return what turns the square of element i of the wrenches into that of a length along the curve."""
    force = 0.0
    for k in range(patches.count):
        force += p.load_0[k]
    force *= patches.radius[i // 3] if i % 3 == 2 else 1.0
    return 1.0 / (force * force) if force > 0.0 else 0.0


@kernel
def _write_system(patches: Patches, p: Problem, share: float, last: bool) -> None:
    """Write the matrix M, and as its last row that of the tangent or, for the `last` step, that of the share."""
    n, a = 3 * patches.count, p.response
    write_load_slopes(patches, p)
    for one in range(n):
        k, load, along = one // 3, p.load[one // 3], 0.0
        x, y, spin = load * p.unit_slopes[3 * one], load * p.unit_slopes[3 * one + 1], load * p.unit_slopes[3 * one + 2]
        loaded = p.unit_loaded[one] if load > 0.0 else 0.0
        for j in range(n):
            caused = x * a[n * 3 * k + j] + y * a[n * (3 * k + 1) + j] + spin * a[n * (3 * k + 2) + j]
            caused += loaded * p.load_response[n * k + j]
            p.matrix[(n + 1) * one + j] = (1.0 if j == one else 0.0) - share * caused
            along += caused * p.wrench[j]
        p.matrix[(n + 1) * one + n] = -along
    for j in range(n):
        p.matrix[(n + 1) * n + j] = 0.0 if last else _per_wrench(patches, p, j) * p.tangent[j]
    p.matrix[(n + 1) * n + n] = 1.0 if last else p.tangent[n]


@kernel
def _go(patches: Patches, p: Problem, share: float) -> float:
    """Go along the change from a share of friction, step all patches there, and return the share."""
    n = 3 * patches.count
    new = share + p.change[n]
    for i in range(n):
        moved = new * row_applied(p.response, i, n, p.change, 0.0)
        p.twist[i] += moved + p.change[n] * row_applied(p.response, i, n, p.wrench, 0.0)
    for i in range(n):
        p.wrench[i] += p.change[i]
    for k in range(patches.count):
        p.load[k] = xp.maximum(p.load_0[k] + new * row_applied(p.load_response, k, n, p.wrench, 0.0), 0.0)
    step_all(patches, p, patches.slopes)
    return new


@kernel
def _turn(patches: Patches, p: Problem, share: float) -> None:
    """Write the tangent of the curve, of length 1, in the direction in which it is followed."""
    n, square = 3 * patches.count, 0.0
    _write_system(patches, p, share, False)
    clear(p.change, n)
    p.change[n] = 1.0
    sign = solved(p.matrix, p.change, n + 1)
    for j in range(n):
        square += _per_wrench(patches, p, j) * p.change[j] * p.change[j]
    per = (1.0 if sign > 0.0 else -1.0) / math.sqrt(square + p.change[n] * p.change[n])
    for j in range(n + 1):
        p.tangent[j] = per * p.change[j]


@kernel
def _distance(patches: Patches, p: Problem) -> float:
    """Write what the wrenches lack of those of the models into `change`; return its length in loads."""
    n, square = 3 * patches.count, 0.0
    for i in range(n):
        p.change[i] = p.load[i // 3] * p.unit[i] - p.wrench[i]
        square += _per_wrench(patches, p, i) * p.change[i] * p.change[i]
    p.change[n] = 0.0
    return math.sqrt(square)


@kernel
def _return(patches: Patches, p: Problem, share: float, last: bool) -> tuple[float, bool]:
    """Return to the curve, across the tangent, or at the same share if it is the `last` step; True where that ends."""
    near, before = False, math.inf
    for _ in range(CORRECTIONS):
        distance = _distance(patches, p)
        near = distance < NEAR
        if near or not distance < 4.0 * before:
            break
        before = distance
        _write_system(patches, p, share, last)
        solved(p.matrix, p.change, 3 * patches.count + 1)
        share = _go(patches, p, share)
    return share, near


@kernel
def trace(patches: Patches, p: Problem, tolerance: float) -> float:
    """Follow the curve from no friction to all of it; return the misfit there."""
    n, share, length, near, last = 3 * patches.count, 0.0, LONGEST, True, False
    clear(p.wrench, n)
    follow_host(patches, p)
    step_all(patches, p, patches.slopes)
    _distance(patches, p)
    copy(p.change, p.wrench, n)
    clear(p.tangent, n)
    p.tangent[n] = 1.0
    for _ in range(STEPS):
        _turn(patches, p, share)
        copy(p.wrench, p.start, n)
        copy(p.twist, p.kept_twist, n)
        begin = share
        for _ in range(HALVINGS):
            last = length * p.tangent[n] >= 1.0 - begin
            far = (1.0 - begin) / p.tangent[n] if last else length
            for j in range(n + 1):
                p.change[j] = far * p.tangent[j]
            share = _go(patches, p, begin)
            share, near = _return(patches, p, share, last)
            if near:
                break
            copy(p.start, p.wrench, n)
            copy(p.kept_twist, p.twist, n)
            length *= 0.5
        if last or not near:
            break
        length = xp.minimum(2.0 * length, LONGEST)
    found = misfit_of(patches, p)
    for _ in range(LAST):
        if found <= tolerance or not last:
            break
        _distance(patches, p)
        _write_system(patches, p, 1.0, True)
        solved(p.matrix, p.change, n + 1)
        share = _go(patches, p, 1.0)
        found = misfit_of(patches, p)
    return found
