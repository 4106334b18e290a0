"""Forward sensitivities of a planar body on its contacts: the variational equation along a computed motion.

With the right-hand side `f(t, y, p)` of `kernels.body` and its Jacobian `J`, the derivative `s = dy/dp` obeys the
linear equation `s' = J(t) s + df/dp`. It is solved on the steps of the motion itself by an L-stable method of order 4
with a diagonal of `gamma`: each stage is one `factor` and, for each parameter, one `solve` of `body`,

    b_i = s + h sum_{j<i} a_ij G_j,   (I/(h gamma) - J_i) S_i = b_i/(h gamma) + df/dp,   G_i = (S_i - b_i)/(h gamma)

with `J_i` at the cubic Hermite interpolant of the step. Source of the coefficients: Hairer and Wanner, Solving ODEs II,
table IV.6.5.

Friction and size enter by scaling: with all coefficients `g` times m, a bristle behaves as `z/m` did,
`zdot(z; m) = zdot(z/m; 1)`; a patch `l` times as large sees `l omega` and gives `l tau`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import contacts as ct
from planarfriction.kernels import jit, kernel, reduced
from planarfriction.kernels.body import _load, _times, factor, linearise, rates, solve
from planarfriction.kernels.law import law_of
from planarfriction.kernels.rosenbrock import _error_norm, _forget_unloaded
from planarfriction.kernels.steady import scaled_twist

FRICTION, SIZE, MASS, INERTIA, LOAD = 0, 1, 2, 3, 4
"""Parameters; each is a factor, 1 as the scene is."""

SHORTEST = 2.0**-12
"""Shortest step, as a share of one of the motion."""

GAMMA = 0.25
PLACES = np.array([0.25, 0.75, 0.55, 0.5, 1.0])
"""Stage times, as shares of the step."""
STAGES = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [1.0 / 2.0, 0.0, 0.0, 0.0],
        [17.0 / 50.0, -1.0 / 25.0, 0.0, 0.0],
        [371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0, 0.0],
        [25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0],
    ]
)
"""Stage arguments below the diagonal, `a_ij`."""


@kernel
def _distributed(law, z, v, w, x, y, weights, lin, dz, dv, d_friction, d_size, dzdot, dw):
    n = x.shape[0]
    fx, fy, tau = 0.0, 0.0, d_size * w[2]
    spin = dv[2] + d_size * v[2]
    for i in range(n):
        zx, zy = z[i], z[n + i]
        ux, uy = dv[0] - spin * y[i], dv[1] + spin * x[i]
        ax, ay = dz[i] - d_friction * zx, dz[n + i] - d_friction * zy
        k = lin[1, i] * ax + lin[2, i] * ay + lin[3, i] * ux + lin[4, i] * uy
        dzdot[i] = ux - lin[0, i] * ax - zx * k
        dzdot[n + i] = uy - lin[0, i] * ay - zy * k
        tx = -weights[i] * (law.sigma_0 * dz[i] + law.sigma_1 * dzdot[i] + law.sigma_2 * ux)
        ty = -weights[i] * (law.sigma_0 * dz[n + i] + law.sigma_1 * dzdot[n + i] + law.sigma_2 * uy)
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    dw[0], dw[1], dw[2] = fx, fy, tau


@kernel
def _published(law, shape, v, zdot, w, lin, dz, dv, d_friction, d_size, dzdot, dw):
    cx, cy, r = shape[0], shape[1], shape[2]
    spin = dv[2] + d_size * v[2]
    ux, uy, us = dv[0] - spin * cy, dv[1] + spin * cx, r * spin
    zx, zy, zs = lin[4], lin[5], lin[6]
    ax, ay, a_s = dz[0] - d_friction * zx, dz[1] - d_friction * zy, dz[2] / r - (d_size + d_friction) * zs
    k = lin[1] * ax + lin[2] * ay + lin[3] * a_s
    dzdot[0] = lin[7] * ux + lin[8] * uy + lin[9] * us - lin[0] * ax - zx * k
    dzdot[1] = lin[10] * ux + lin[11] * uy + lin[12] * us - lin[0] * ay - zy * k
    dzdot[2] = r * (lin[13] * ux + lin[14] * uy + lin[15] * us - lin[0] * a_s - zs * k) + d_size * zdot[2]
    dw[0] = -(law.sigma_0 * dz[0] + law.sigma_1 * dzdot[0] + law.sigma_2 * ux)
    dw[1] = -(law.sigma_0 * dz[1] + law.sigma_1 * dzdot[1] + law.sigma_2 * uy)
    tau = -(law.sigma_0 * dz[2] + law.sigma_1 * dzdot[2] + law.sigma_2 * shape[3] * (spin + d_size * v[2]))
    dw[2] = tau + cx * dw[1] - cy * dw[0] + d_size * (cx * w[1] - cy * w[0])


@kernel
def _reduced(law, shape, v, w, lin, z, dz, dv, d_friction, d_size, dzdot, dw):
    vx, vy, omega = dv[0], dv[1], dv[2] + d_size * v[2]
    x, y, s = scaled_twist(shape, vx, vy, omega)
    ax, ay, a_s = dz[0] - d_friction * z[0], dz[1] - d_friction * z[1], dz[2] - d_friction * z[2]
    for i in range(3):
        a, b = 1 + 3 * i, 10 + 3 * i
        dzdot[i] = lin[a] * ax + lin[a + 1] * ay + lin[a + 2] * a_s + lin[b] * x + lin[b + 1] * y + lin[b + 2] * s
    gx = -(law.sigma_0 * dz[0] + law.sigma_1 * dzdot[0] + law.sigma_2 * x)
    gy = -(law.sigma_0 * dz[1] + law.sigma_1 * dzdot[1] + law.sigma_2 * y)
    gs = -(law.sigma_0 * dz[2] + law.sigma_1 * dzdot[2] + law.sigma_2 * s)
    dw[0], dw[1], tau = reduced.to_origin(shape, gx, gy, gs)
    dw[2] = tau + d_size * w[2]


@kernel
def _change(contacts, motion, piece, c, y, dy, dz, dv, parameter, dzdot, dw, work):
    """Change of the bristle rates and of the wrench per unit load of contact c with bristles, twist and parameter.

    `y`, `dy`, `dz` and `dzdot` hold all states; the twist of the contact is in `work.twist`, and `y` was linearised.
    """
    first, last, row = contacts.state[c], contacts.state[c + 1], motion.row[piece, c]
    lin, law = work.linear[contacts.linear[c] : contacts.linear[c + 1]], law_of(contacts.law[c])
    d_friction = 1.0 if parameter == FRICTION else 0.0
    d_size = 1.0 if parameter == SIZE else 0.0
    if contacts.kind[c] == ct.DISTRIBUTED:
        x, y_cells, weights = ct._cells(contacts, c, row)
        _distributed(
            law, y[first:last], work.twist, work.wrench[c], x, y_cells, weights, lin.reshape(7, x.shape[0]),
            dz[first:last], dv, d_friction, d_size, dzdot[first:last], dw,
        )  # fmt: skip
    elif contacts.kind[c] == ct.REDUCED:
        _reduced(
            law, contacts.shape[row], work.twist, work.wrench[c], lin, y[first:last], dz[first:last], dv,
            d_friction, d_size, dzdot[first:last], dw,
        )  # fmt: skip
    else:
        _published(
            law, contacts.shape[row], work.twist, dy[first:last], work.wrench[c], lin, dz[first:last], dv,
            d_friction, d_size, dzdot[first:last], dw,
        )  # fmt: skip


@kernel
def _partial(contacts, motion, piece, since, w, parameter, out, work):
    """`df/dp` at the held state `w.state`, whose rates are in `w.rate` and whose linearisation was made last."""
    y, dy = w.state, w.rate
    o = y.shape[0] - 6
    total, dw = work.body, work.stiffness[0]
    for i in range(y.shape[0]):
        out[i] = 0.0
    if parameter in (MASS, INERTIA):
        for i in range(3):
            if (i == 2) == (parameter == INERTIA) and motion.inverse_mass[i] > 0.0:
                out[o + i] = motion.acceleration[piece, i] - dy[o + i]
        return
    for i in range(3):
        total[i] = 0.0
    for c in range(contacts.kind.shape[0]):
        a = work.maps[c, 0]
        if parameter == LOAD:
            dw[0], dw[1], dw[2] = work.wrench[c, 0], work.wrench[c, 1], work.wrench[c, 2]
        else:
            _times(a, y[o : o + 3], work.twist)
            _change(contacts, motion, piece, c, y, dy, w.zero, w.zero[:3], parameter, out, dw, work)
        load = _load(contacts, motion, piece, since, c)
        for i in range(3):
            for p in range(3):
                total[i] += load * a[p, i] * dw[p]
    for i in range(3):
        out[o + i] = motion.inverse_mass[i] * total[i]


class Path(NamedTuple):
    """T accepted steps of a motion, and the derivatives that are carried along it."""

    piece: np.ndarray
    """Piece between breaks that each step lies in, int [T]."""
    since: np.ndarray
    """Seconds into it at the start, [T]."""
    step: np.ndarray
    """Length [s], [T]."""
    start: np.ndarray
    """States at the start, [T, n]."""
    end: np.ndarray
    """States at the end, before a contact whose load ends forgets its bristles, [T, n]."""
    parameters: np.ndarray
    """int [P]"""


class Slopes(NamedTuple):
    """Workspace for P derivatives of n states."""

    forcing: np.ndarray
    """`df/dp`, [P, n]."""
    stages: np.ndarray
    """`G` of each stage, [P, 5, n]."""
    coarse: np.ndarray
    """Derivatives after one step, [P, n]."""
    fine: np.ndarray
    """After two of half the length, [P, n]."""
    start_rate: np.ndarray
    """Rates at the start of a step of the motion, [n]."""
    end_rate: np.ndarray
    """Rates at its end, [n]."""
    state: np.ndarray
    """[n]"""
    rate: np.ndarray
    """[n]"""
    base: np.ndarray
    """[n]"""
    right: np.ndarray
    """[n]"""
    zero: np.ndarray
    """Zeros, [n]."""


def slopes_for(count: int, n: int) -> Slopes:
    """Workspace for `count` derivatives of n states (made outside compiled code)."""
    return Slopes(
        np.zeros((count, n)),
        np.zeros((count, len(PLACES), n)),
        np.zeros((count, n)),
        np.zeros((count, n)),
        *np.zeros((7, n)),
    )


@kernel
def _hermite(path, t, share, w):
    """State at a share of step t into `w.state`."""
    left, right, h = 1.0 - share, share, path.step[t]
    start, end = path.start[t], path.end[t]
    for m in range(start.shape[0]):
        bend = (left - right) * (end[m] - start[m]) + h * (right * w.end_rate[m] - left * w.start_rate[m])
        w.state[m] = left * start[m] + right * end[m] - left * right * bend


@kernel
def _step(contacts, motion, path, t, place, share, slope, out, w, work):
    """Carry `slope` over a share of step t that begins at `place`, both as parts of 1; `out` may be `slope`."""
    piece, n = path.piece[t], w.state.shape[0]
    h = share * path.step[t]
    shift = 1.0 / (h * GAMMA)
    for i in range(PLACES.shape[0]):
        at = place + share * PLACES[i]
        since = path.since[t] + at * path.step[t]
        _hermite(path, t, at, w)
        rates(contacts, motion, piece, since, w.state, w.rate, work)
        linearise(contacts, motion, piece, w.state, work)
        for p in range(path.parameters.shape[0]):
            _partial(contacts, motion, piece, since, w, path.parameters[p], w.forcing[p], work)
        factor(contacts, motion, piece, since, w.state, shift, work)
        last = i == PLACES.shape[0] - 1
        for p in range(path.parameters.shape[0]):
            for m in range(n):
                w.base[m] = slope[p, m]
                for j in range(i):
                    w.base[m] += h * STAGES[i, j] * w.stages[p, j, m]
                w.right[m] = shift * w.base[m] + w.forcing[p, m]
            new = w.stages[p, i]
            solve(contacts, motion, piece, since, w.state, shift, w.right, new, work)
            for m in range(n):
                if last:
                    out[p, m] = new[m]
                else:
                    new[m] = shift * (new[m] - w.base[m])


@jit
def propagate(contacts, motion, path, first, last, slope, rtol, atol, w, work):
    """Carry `slope` [P, n] through the steps `first` to `last` of a motion; return how many steps that took.

    A step is halved, down to `SHORTEST` of a step of the motion, until one and two half ones agree to `rtol`, `atol`
    [n]: the Jacobian may jump within it. A contact that had no load forgets its slopes.
    """
    taken = 0
    for t in range(first, last):
        rates(contacts, motion, path.piece[t], path.since[t], path.start[t], w.start_rate, work)
        rates(contacts, motion, path.piece[t], path.since[t] + path.step[t], path.end[t], w.end_rate, work)
        place, share = 0.0, 1.0
        while place < 1.0:
            _step(contacts, motion, path, t, place, share, slope, w.coarse, w, work)
            _step(contacts, motion, path, t, place, 0.5 * share, slope, w.fine, w, work)
            _step(contacts, motion, path, t, place + 0.5 * share, 0.5 * share, w.fine, w.fine, w, work)
            taken += 1
            largest = 0.0
            for p in range(path.parameters.shape[0]):
                for m in range(w.right.shape[0]):
                    w.right[m] = w.fine[p, m] - w.coarse[p, m]
                error = _error_norm(contacts, slope[p], w.fine[p], w.right, rtol, atol)
                largest = xp.maximum(largest, error)
            if largest > 1.0 and share > SHORTEST:
                share *= 0.5
                continue
            place += share
            for p in range(path.parameters.shape[0]):
                for m in range(w.right.shape[0]):
                    slope[p, m] = w.fine[p, m]
            # places are multiples of the share, so that powers of two add up to one exactly
            if largest < 0.05 and place < 1.0 and place % (2.0 * share) == 0.0:
                share *= 2.0
        if t + 1 < path.piece.shape[0] and path.piece[t + 1] != path.piece[t]:
            for p in range(path.parameters.shape[0]):
                _forget_unloaded(contacts, motion, path.piece[t], slope[p])
    return taken


@jit
def wrench_slopes(contacts, motion, piece, since, y, parameters, slope, wrench, out, w, work):
    """Wrenches [C, 3] of one of the identical contacts, and from the slopes [P, n] of y theirs `out` [C, 3, P]."""
    o = y.shape[0] - 6
    rates(contacts, motion, piece, since, y, w.rate, work)
    linearise(contacts, motion, piece, y, work)
    dv, dw = work.stiffness[0], work.stiffness[1]
    for c in range(contacts.kind.shape[0]):
        load = motion.load[piece, 0, c] + since * motion.load[piece, 1, c]
        a, g = work.maps[c, 0], work.maps[c, 1]
        for i in range(3):
            wrench[c, i] = load * work.wrench[c, i]
        for p in range(parameters.shape[0]):
            _times(a, y[o : o + 3], work.twist)
            for i in range(3):
                dv[i] = 0.0
                for j in range(3):
                    dv[i] += a[i, j] * slope[p, o + j] + g[i, j] * slope[p, o + 3 + j]
            _change(contacts, motion, piece, c, y, w.rate, slope[p], dv, parameters[p], w.base, dw, work)
            for i in range(3):
                out[c, i, p] = load * dw[i]
                if parameters[p] == LOAD:
                    out[c, i, p] += load * work.wrench[c, i]
