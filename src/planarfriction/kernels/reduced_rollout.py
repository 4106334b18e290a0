"""Roll-outs of the moment model with their discrete adjoint and their forward derivatives, one contact after another.

`rows` [B or 1, NUMBERS] holds law (`kernels.law`) and shape (7, `kernels.reduced`) of each contact, `twist`
[B or 1, T, 3], `load` [B or 1, T] and `dt` [T] what is held over each step. With cotangents `W'` of the wrench, that of
the scaled traction is `f_N F W'` (see `reduced_adjoint.pull_back`). The steady state depends on the friction
coefficients and v_s, the traction on the stiffness and the dampings too, the closure on the breakaway ratio; gamma and
the shape are held. A step without load forgets its state: it passes on no gradient but that of the load, the wrench per
unit load that the smallest load would have.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, jit, kernel
from planarfriction.kernels.law import LAW, law_of
from planarfriction.kernels.reduced import to_origin
from planarfriction.kernels.reduced_adjoint import linearise, pull_back, rate, tangent
from planarfriction.kernels.reduced_step import advance
from planarfriction.kernels.steady import evenness, scaled_twist, sliding, steady_by_law, steady_slopes

NUMBERS = LAW + 7
"""Numbers of a contact."""

_SCRATCH = 27
"""Slopes of the steady state by the scaled twist (15) and by the law (12)."""


@inlined
def _row_of(b, count):
    return b if count > 1 else 0


@inlined
def _three(a):
    return a[0], a[1], a[2]


@inlined
def _put(out, a):
    out[0], out[1], out[2] = a[0], a[1], a[2]


@inlined
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _traction(law, z, slip, u):
    """Scaled traction per unit load."""
    return (
        -(law.sigma_0 * z[0] + law.sigma_1 * slip[0] + law.sigma_2 * u[0]),
        -(law.sigma_0 * z[1] + law.sigma_1 * slip[1] + law.sigma_2 * u[1]),
        -(law.sigma_0 * z[2] + law.sigma_1 * slip[2] + law.sigma_2 * u[2]),
    )


@jit
def rollout(rows, surface, data, z, twist, load, dt, first, last, wrench, states):
    """Steps of the contacts `first` to `last`: `z` [B, 3] in place, wrenches into `wrench` [B, T, 3].

    The state before each step goes into `states` [B, T, 3], unless that is empty. The
    next twist's steady state is read ahead.
    """
    steps, kept = dt.shape[0], states.shape[1] > 0
    for b in range(first, last if steps > 0 else first):
        row, twists, loads = rows[_row_of(b, len(rows))], twist[_row_of(b, len(twist))], load[_row_of(b, len(load))]
        law, shape, own = law_of(row), row[LAW:], z[b]
        held = sliding(law, twists[0, 0], twists[0, 1], twists[0, 2], shape, surface, data)
        for t in range(steps):
            n = min(t + 1, steps - 1)
            following = sliding(law, twists[n, 0], twists[n, 1], twists[n, 2], shape, surface, data)
            if kept:
                _put(states[b, t], own)
            fx, fy, tau = advance(law, own, held, shape, dt[t], own)
            none, weight = loads[t] == 0.0, loads[t]
            _put(wrench[b, t], (xp.where(none, 0.0, weight * fx), xp.where(none, 0.0, weight * fy), weight * tau))
            if none:
                wrench[b, t, 2] = 0.0
                _put(own, (0.0, 0.0, 0.0))
            held = following


# ---------------------------------------------------------------------- backwards


@kernel
def _back_at_rest(law, shape, dt, load, z, wrench_bar, new, pull, twist_bar, row_bar):
    """One step at rest backwards, `z + u dt`; returns the cotangents of z and load."""
    push = law.sigma_0 * dt + law.sigma_1 + law.sigma_2
    _put(
        twist_bar,
        to_origin(shape, dt * new[0] - push * pull[0], dt * new[1] - push * pull[1], dt * new[2] - push * pull[2]),
    )
    row_bar[0] -= _dot(z, pull)
    unit = to_origin(shape, -law.sigma_0 * z[0], -law.sigma_0 * z[1], -law.sigma_0 * z[2])
    z_bar = (new[0] - law.sigma_0 * pull[0], new[1] - law.sigma_0 * pull[1], new[2] - law.sigma_0 * pull[2])
    return z_bar, _dot(wrench_bar, unit)


@kernel
def _back(law, shape, surface, data, z, twist, load, dt, wrench_bar, new, twist_bar, row_bar, work):
    """One step backwards, from the cotangents of its wrench and new state; returns those of z and of the load.

    That of the twist is written to `twist_bar` [3], those of the law are added to `row_bar`.
    """
    x, y, s = scaled_twist(shape, twist[0], twist[1], twist[2])
    v = math.sqrt(x * x + y * y + s * s)
    loaded = xp.where(load == 0.0, 0.0, 1.0)
    new = (loaded * new[0], loaded * new[1], loaded * new[2])
    px, py, ps = scaled_twist(shape, wrench_bar[0], wrench_bar[1], wrench_bar[2])
    pull = (load * px, load * py, load * ps)
    if not v > 0.0:
        return _back_at_rest(law, shape, dt, load, z, wrench_bar, new, pull, twist_bar, row_bar)
    j, by_law = work[:15], work[15:]
    q = steady_slopes(law, shape, surface, data, x, y, s, v, j)
    even = evenness(shape, surface, data, x, y, s, v)
    step = linearise(law, z, (x, y, s), v, q, even[0], dt)
    slip = rate(step)
    unit = _traction(law, step.end.z, slip, step.u)
    bar = pull_back(law, step, dt, new, pull)
    steady_by_law(law, shape, surface, data, x, y, s, v, by_law)
    row_bar[0] -= _dot(step.end.z, pull) + _dot(q, bar.q) / law.sigma_0
    row_bar[1] -= _dot(slip, pull)
    row_bar[2] -= _dot(step.u, pull)
    for i in range(3):
        row_bar[3 + i] += by_law[3 * i] * bar.q[0] + by_law[3 * i + 1] * bar.q[1] + by_law[3 * i + 2] * bar.q[2]
    row_bar[8] += even[0] * bar.breakaway
    ahead = law.breakaway_ratio * bar.breakaway
    ux = bar.u[0] + j[0] * bar.q[0] + j[3] * bar.q[1] + j[6] * bar.q[2] + ahead * even[1]
    uy = bar.u[1] + j[1] * bar.q[0] + j[4] * bar.q[1] + j[7] * bar.q[2] + ahead * even[2]
    us = bar.u[2] + j[2] * bar.q[0] + j[5] * bar.q[1] + j[8] * bar.q[2] + ahead * even[3]
    _put(twist_bar, to_origin(shape, ux, uy, us))
    return bar.z, _dot(wrench_bar, to_origin(shape, unit[0], unit[1], unit[2]))


@jit
def gradient(
    rows, surface, data, states, twist, load, dt, wrench_bar, first, last, z_bar, twist_bar, load_bar, row_bar
):
    """Adjoint of `rollout` with its `states`; `z_bar` [B, 3] comes in as the cotangent of the state at the end.

    `wrench_bar` [B or 1, T, 3]; `twist_bar` [B, T, 3], `load_bar` [B, T] and `row_bar` [B, NUMBERS] are written.
    """
    work = np.empty(_SCRATCH)
    for b in range(first, last):
        row, twists, loads = rows[_row_of(b, len(rows))], twist[_row_of(b, len(twist))], load[_row_of(b, len(load))]
        bars, before = wrench_bar[_row_of(b, len(wrench_bar))], states[_row_of(b, len(states))]
        law, shape, new, law_bar = law_of(row), row[LAW:], _three(z_bar[b]), row_bar[b]
        for i in range(row_bar.shape[1]):
            law_bar[i] = 0.0
        for t in range(dt.shape[0] - 1, -1, -1):
            new, load_bar[b, t] = _back(
                law, shape, surface, data, _three(before[t]), twists[t], loads[t], dt[t], _three(bars[t]), new,
                twist_bar[b, t], law_bar, work,
            )  # fmt: skip
        _put(z_bar[b], new)


# ---------------------------------------------------------------------- forwards


@kernel
def _forward_at_rest(law, shape, load, z, columns, d_z, d_wrench):
    """One step at rest: the state stays, the wrench follows it; returns the traction."""
    for p in range(len(columns)):
        own = 1.0 if columns[p] == 0 else 0.0
        gx = -load * (law.sigma_0 * d_z[0, p] + own * z[0])
        gy = -load * (law.sigma_0 * d_z[1, p] + own * z[1])
        gs = -load * (law.sigma_0 * d_z[2, p] + own * z[2])
        d_wrench[0, p], d_wrench[1, p], d_wrench[2, p] = to_origin(shape, gx, gy, gs)
    return z, (-law.sigma_0 * z[0], -law.sigma_0 * z[1], -law.sigma_0 * z[2])


@inlined
def _direction(law, column, q, even, by_law):
    """Change of the steady state and of the breakaway with a number of the law."""
    if column == 0:
        per = -1.0 / law.sigma_0
        return (per * q[0], per * q[1], per * q[2]), 0.0
    if 3 <= column <= 5:
        i = 3 * (column - 3)
        return (by_law[i], by_law[i + 1], by_law[i + 2]), 0.0
    return (0.0, 0.0, 0.0), (even if column == 8 else 0.0)


@kernel
def _forward(law, shape, surface, data, z, twist, load, dt, columns, d_z, d_wrench, work):
    """One step with the changes `d_z` [3, P] of the state, in place, and `d_wrench` [3, P] of the wrench.

    Returns the new state and the scaled traction.
    """
    x, y, s = scaled_twist(shape, twist[0], twist[1], twist[2])
    v = math.sqrt(x * x + y * y + s * s)
    if not v > 0.0:
        return _forward_at_rest(law, shape, load, z, columns, d_z, d_wrench)
    q = steady_slopes(law, shape, surface, data, x, y, s, v, work[:15])
    even, by_law = evenness(shape, surface, data, x, y, s, v)[0], work[15:]
    steady_by_law(law, shape, surface, data, x, y, s, v, by_law)
    step = linearise(law, z, (x, y, s), v, q, even, dt)
    slip, end = rate(step), step.end.z
    for p in range(len(columns)):
        column = columns[p]
        dq, d_breakaway = _direction(law, column, q, even, by_law)
        before = (d_z[0, p], d_z[1, p], d_z[2, p])
        new, g = tangent(law, step, dt, before, (0.0, 0.0, 0.0), dq, d_breakaway)
        d_z[0, p], d_z[1, p], d_z[2, p] = new
        own = (1.0 if column == 0 else 0.0, 1.0 if column == 1 else 0.0, 1.0 if column == 2 else 0.0)
        gx = load * (g[0] - own[0] * end[0] - own[1] * slip[0] - own[2] * x)
        gy = load * (g[1] - own[0] * end[1] - own[1] * slip[1] - own[2] * y)
        gs = load * (g[2] - own[0] * end[2] - own[1] * slip[2] - own[2] * s)
        d_wrench[0, p], d_wrench[1, p], d_wrench[2, p] = to_origin(shape, gx, gy, gs)
    return end, _traction(law, end, slip, step.u)


@jit
def sensitivities(rows, surface, data, z, twist, load, dt, columns, first, last, wrenches, d_wrench):
    """Roll-outs with the derivatives of the wrenches to the numbers `columns` [P] into `d_wrench` [B, T, 3, P].

    Arguments as those of `rollout`.
    """
    work, d_z = np.empty(_SCRATCH), np.empty((3, columns.shape[0]))
    for b in range(first, last):
        row, twists, loads = rows[_row_of(b, len(rows))], twist[_row_of(b, len(twist))], load[_row_of(b, len(load))]
        law, shape, own = law_of(row), row[LAW:], _three(z[b])
        d_z[:] = 0.0
        for t in range(dt.shape[0]):
            own, g = _forward(
                law, shape, surface, data, own, twists[t], loads[t], dt[t], columns, d_z, d_wrench[b, t], work
            )
            if loads[t] == 0.0:
                own = (0.0, 0.0, 0.0)
                d_z[:] = 0.0
                d_wrench[b, t] = 0.0
                wrenches[b, t] = 0.0
            else:
                _put(wrenches[b, t], to_origin(shape, loads[t] * g[0], loads[t] * g[1], loads[t] * g[2]))
        _put(z[b], own)
