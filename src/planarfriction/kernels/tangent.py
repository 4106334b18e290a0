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
from planarfriction.kernels import jit, kernel
from planarfriction.kernels.body import load_of, read, record_of, times
from planarfriction.kernels.contacts import CHANGE
from planarfriction.kernels.pointers import address, at, call, doubles, integers
from planarfriction.kernels.rosenbrock import error_norm, forget_unloaded

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
def _change(own, piece, c, y, dy, dz, parameter, dzdot):
    """Change of the bristle rates and of the wrench per unit load of contact c with its bristles, twist and parameter.

    Addresses of all states, `y` linearised; `own.rows` holds V, W and dV and takes dW.
    """
    first, lin = integers(own.state)[c], at(own.workspace, integers(own.linear)[c])
    d_friction = 1.0 if parameter == FRICTION else 0.0
    d_size = 1.0 if parameter == SIZE else 0.0
    function, record = integers(own.calls)[6 * c + CHANGE], record_of(own, piece, c)
    bristles = at(y, first), at(dy, first), lin, at(dz, first), at(dzdot, first)
    call(function, (record, *bristles, own.rows, d_friction, d_size))


@kernel
def _partial(own, piece, since, w, parameter, out):
    """`df/dp` at the held state `w.state`, whose rates are in `w.rate` and whose linearisation was made last."""
    o, dy, rows, total = own.bristles, w.rate, doubles(own.rows), doubles(own.body)
    for i in range(out.shape[0]):
        out[i] = 0.0
    inverse_mass, acceleration = doubles(own.inverse_mass), doubles(own.acceleration)
    if parameter in (MASS, INERTIA):
        for i in range(3):
            if (i == 2) == (parameter == INERTIA) and inverse_mass[i] > 0.0:
                out[o + i] = acceleration[3 * piece + i] - dy[o + i]
        return
    for i in range(3):
        total[i] = 0.0
    for c in range(own.contacts):
        a, wrench = doubles(at(own.maps, 27 * c)), doubles(at(own.wrench, 3 * c))
        for i in range(3):
            rows[3 + i], rows[6 + i], rows[9 + i] = wrench[i], 0.0, wrench[i]
        if parameter != LOAD:
            times(a, doubles(address(w.state, o)), rows)
            _change(own, piece, c, address(w.state, 0), address(dy, 0), address(w.zero, 0), parameter, address(out, 0))
        load = doubles(own.count)[c] * load_of(own, piece, since, c)
        for i in range(3):
            total[i] += load * (a[i] * rows[9] + a[3 + i] * rows[10] + a[6 + i] * rows[11])
    for i in range(3):
        out[o + i] = inverse_mass[i] * total[i]


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
def _step(system, path, t, begin, share, slope, out, w):
    """Carry `slope` over a share of step t from `begin` on, both as parts of 1; `out` may be `slope`."""
    own, piece, n = read(system), path.piece[t], w.state.shape[0]
    h = share * path.step[t]
    shift = 1.0 / (h * GAMMA)
    for i in range(PLACES.shape[0]):
        here = begin + share * PLACES[i]
        since = path.since[t] + here * path.step[t]
        _hermite(path, t, here, w)
        call(own.rates, (system, piece, since, w.state, w.rate))
        call(own.linearise, (system, piece, w.state))
        for p in range(path.parameters.shape[0]):
            _partial(own, piece, since, w, path.parameters[p], w.forcing[p])
        call(own.factor, (system, piece, since, w.state, shift))
        last = i == PLACES.shape[0] - 1
        for p in range(path.parameters.shape[0]):
            for m in range(n):
                w.base[m] = slope[p, m]
                for j in range(i):
                    w.base[m] += h * STAGES[i, j] * w.stages[p, j, m]
                w.right[m] = shift * w.base[m] + w.forcing[p, m]
            new = w.stages[p, i]
            call(own.solve, (system, piece, since, w.state, shift, w.right, new))
            for m in range(n):
                if last:
                    out[p, m] = new[m]
                else:
                    new[m] = shift * (new[m] - w.base[m])


@jit
def propagate(system, path, first, last, slope, rtol, atol, w):
    """Carry `slope` [P, n] through the steps `first` to `last` of a motion; return how many steps that took.

    A step is halved, down to `SHORTEST` of a step of the motion, until one and two half ones agree to `rtol`, `atol`
    [n]: the Jacobian may jump within it. A contact that had no load forgets its slopes.
    """
    own, taken, n = read(system), 0, w.right.shape[0]
    for t in range(first, last):
        call(own.rates, (system, path.piece[t], path.since[t], path.start[t], w.start_rate))
        call(own.rates, (system, path.piece[t], path.since[t] + path.step[t], path.end[t], w.end_rate))
        begin, share = 0.0, 1.0
        while begin < 1.0:
            for part in range(3):  # once the whole way, then in two halves
                whole, second = part == 0, part == 2
                from_here, how_far = begin + (0.5 * share if second else 0.0), share if whole else 0.5 * share
                source, target = w.fine if second else slope, w.coarse if whole else w.fine
                _step(system, path, t, from_here, how_far, source, target, w)
            taken += 1
            largest = 0.0
            for p in range(path.parameters.shape[0]):
                for m in range(n):
                    w.right[m] = w.fine[p, m] - w.coarse[p, m]
                old, new = doubles(address(slope, p * n)), doubles(address(w.fine, p * n))
                error = error_norm(own, old, new, doubles(address(w.right, 0)), rtol, doubles(address(atol, 0)))
                largest = xp.maximum(largest, error)
            if largest > 1.0 and share > SHORTEST:
                share *= 0.5
                continue
            begin += share
            for p in range(path.parameters.shape[0]):
                for m in range(n):
                    slope[p, m] = w.fine[p, m]
            # places are multiples of the share, so that powers of two add up to one exactly
            if largest < 0.05 and begin < 1.0 and begin % (2.0 * share) == 0.0:
                share *= 2.0
        if t + 1 < path.piece.shape[0] and path.piece[t + 1] != path.piece[t]:
            for p in range(path.parameters.shape[0]):
                forget_unloaded(own, path.piece[t], slope[p])
    return taken


@jit
def wrench_slopes(system, piece, since, y, parameters, slope, wrench, out, scratch):
    """Wrenches [C, 3] of one of the identical contacts, and from the slopes [P, n] of y theirs `out` [C, 3, P].

    `scratch` [2, n] needs no values.
    """
    own, rate, change = read(system), address(scratch, 0), address(scratch, y.shape[0])
    o, rows = own.bristles, doubles(own.rows)
    call(own.rates, (system, piece, since, y, rate))
    call(own.linearise, (system, piece, y))
    for c in range(own.contacts):
        load = load_of(own, piece, since, c)
        a, g, unit = doubles(at(own.maps, 27 * c)), doubles(at(own.maps, 27 * c + 9)), doubles(at(own.wrench, 3 * c))
        times(a, doubles(address(y, o)), rows)
        for i in range(3):
            wrench[c, i] = load * unit[i]
            rows[3 + i] = unit[i]
        for p in range(parameters.shape[0]):
            for i in range(3):
                rows[6 + i] = 0.0
                for j in range(3):
                    rows[6 + i] += a[3 * i + j] * slope[p, o + j] + g[3 * i + j] * slope[p, o + 3 + j]
            states = address(y, 0), rate, address(slope, p * y.shape[0])
            _change(own, piece, c, *states, parameters[p], change)
            for i in range(3):
                out[c, i, p] = load * rows[9 + i]
                if parameters[p] == LOAD:
                    out[c, i, p] += load * unit[i]
