"""The adjoint of the variational equation of `kernels.tangent`, backwards along a computed motion.

With a cost that depends on the state at some instants, `l = dcost/dy` obeys `-l' = J(t)' l` between them and jumps by
the cost's own slope at each. The method is that of `tangent`, in transposed matrices and backwards in time,

    b_i = l + h sum_{j<i} a_ij G_j,   (I/(h gamma) - J_i') S_i = b_i/(h gamma),   G_i = (S_i - b_i)/(h gamma)

What the cost gains per number is the integral of `q = l' df/dp`, with the weights of the method. A signal that is
linear on a piece, in any number of knots, needs no more of it than its two moments `int q dt` and `int q t dt`.

The Jacobian is dense here: contacts of a few states each.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import jit, kernel
from planarfriction.kernels.body import load_of, read, seen_by, times
from planarfriction.kernels.pointers import address, at, call, doubles, integers
from planarfriction.kernels.rosenbrock import error_norm
from planarfriction.kernels.small_matrices import solved
from planarfriction.kernels.tangent import (
    AGAIN,
    ERROR,
    GAMMA,
    LOAD,
    MOST,
    PLACES,
    SHORTEST,
    STAGES,
    START,
    _change,
    _interpolate,
    _partial,
)

_SAFETY, _GROWTH, _SHRINKAGE = 0.85, 2.0, 0.2
"""Step control, as that of the derivatives forwards."""


class Workspace(NamedTuple):
    """Room for the adjoint of n states with U kinds of inputs."""

    jacobian: np.ndarray
    """[n, n]"""
    matrix: np.ndarray
    """[n, n]"""
    stages: np.ndarray
    """`G` of each stage, [5, n]."""
    gain: np.ndarray
    """`l' df/dp` at each stage, [5, U]."""
    forcing: np.ndarray
    """`df/dp`, [n]."""
    new: np.ndarray
    error: np.ndarray
    other: np.ndarray
    before: np.ndarray
    state: np.ndarray
    rate: np.ndarray
    base: np.ndarray
    zero: np.ndarray
    """Vectors [n], as in `tangent.Slopes`."""
    pace: np.ndarray
    """Length of the next step, in steps of the motion, [1]."""


def workspace_for(inputs: int, n: int) -> Workspace:
    """Workspace (made outside compiled code, where an allocation costs compile time)."""
    matrices = np.zeros((n, n)), np.zeros((n, n))
    return Workspace(*matrices, np.zeros((5, n)), np.zeros((5, inputs)), *np.zeros((9, n)), np.ones(1))


@kernel
def _jacobian(own, piece, since, w):
    """Write J at the held state `w.state`, whose rates are in `w.rate` and whose linearisation was made last."""
    n, o, j, rows = w.state.shape[0], own.bristles, w.jacobian, doubles(own.rows)
    y, dy, out = address(w.state, 0), address(w.rate, 0), w.forcing
    inverse_mass = doubles(own.inverse_mass)
    for i in range(n):
        w.base[i] = 0.0
        for k in range(n):
            j[i, k] = 0.0
    for c in range(own.contacts):
        maps = at(own.maps, 27 * c)
        a, g, h = doubles(maps), doubles(at(maps, 9)), doubles(at(maps, 18))
        times(a, doubles(seen_by(own, c, y)), rows)
        for i in range(3):
            rows[3 + i] = doubles(own.wrench)[3 * c + i]
        load = doubles(own.count)[c] * load_of(own, piece, since, c)
        first, states = integers(own.state)[c], integers(own.state)[c + 1] - integers(own.state)[c]
        for m in range(states + 6):
            column = first + m if m < states else o + m - states
            for i in range(3):
                rows[6 + i] = 0.0
                if m >= states + 3:
                    rows[6 + i] = g[3 * i + m - states - 3]
                elif m >= states:
                    rows[6 + i] = a[3 * i + m - states]
            if m < states:
                w.base[column] = 1.0
            _change(own, piece, c, y, dy, address(w.base, 0), LOAD, address(out, 0))
            w.base[column] = 0.0
            for i in range(states):
                j[first + i, column] = out[first + i]
            for i in range(3):
                pull = a[i] * rows[9] + a[3 + i] * rows[10] + a[6 + i] * rows[11]
                if m >= states + 3:
                    pull += h[3 * i + m - states - 3]
                j[o + i, column] += inverse_mass[i] * load * pull
    cos, sin = 1.0, 0.0
    if own.body_axes:
        cos, sin = math.cos(w.state[o + 5]), math.sin(w.state[o + 5])
        j[o + 3, o + 5] = -sin * w.state[o] - cos * w.state[o + 1]
        j[o + 4, o + 5] = cos * w.state[o] - sin * w.state[o + 1]
    j[o + 3, o], j[o + 3, o + 1] = cos, -sin
    j[o + 4, o], j[o + 4, o + 1] = sin, cos
    j[o + 5, o + 2] = 1.0


@kernel
def _node(path, k, first, since):
    """The last node up to k, but from `first` on, that is before `since`."""
    while k > first and path.since[k] >= since:
        k -= 1
    return k


@kernel
def _step(system, path, k, first, since, h, adjoint, inputs, known, w):
    """Carry the adjoint back over `h` seconds into `w.new`, as `tangent` does its slopes forwards."""
    own, piece, n = read(system), path.piece[k], w.state.shape[0]
    shift = 1.0 / (h * GAMMA)
    for i in range(PLACES.shape[0]):
        time = since - h * PLACES[i]
        _interpolate(path, _node(path, k, first, time), time, w.state)
        call(own.rates, (system, piece, time, w.state, w.rate))
        call(own.linearise, (system, piece, w.state))
        _jacobian(own, piece, time, w)
        for m in range(n):
            w.base[m] = adjoint[m]
            for j in range(i):
                w.base[m] += h * STAGES[i, j] * w.stages[j, m]
            w.new[m] = shift * w.base[m]
            for j in range(n):
                w.matrix[m, j] = (shift if m == j else 0.0) - w.jacobian[j, m]
        solved(doubles(address(w.matrix, 0)), w.new, n)
        for m in range(n):
            w.stages[i, m] = shift * (w.new[m] - w.base[m])
        for p in range(inputs.kind.shape[0]):
            _partial(own, piece, time, w, inputs, p, w.forcing)
            w.gain[i, p] = 0.0
            for m in range(n):
                w.gain[i, p] += w.new[m] * w.forcing[m]
    for m in range(n):
        w.error[m], w.other[m] = 0.0, known * h * START * w.before[m]
        for j in range(PLACES.shape[0]):
            w.error[m] += h * ERROR[j] * w.stages[j, m]
            w.other[m] += known * h * AGAIN[j] * w.stages[j, m]


@jit
def propagate_back(system, path, first, last, begin, until, adjoint, inputs, moments, known, rtol, atol, w):
    """Carry `adjoint` [n] from `begin` back to `until` seconds into a piece; add to the `moments` [U, 2] of its inputs.

    The nodes of the piece are `first` to `last` of a path; `known` is 0 where the adjoint has just jumped. Returns how
    many steps that took.
    """
    own, taken, n, k, since = read(system), 0, w.state.shape[0], last - 1, begin
    while since > until:
        k = _node(path, k, first, since)
        local, remaining = path.since[k + 1] - path.since[k], since - until
        wanted = w.pace[0] * local
        reach = xp.minimum(wanted, since - path.since[xp.maximum(k + 1 - MOST, first)])
        h = reach if 2.0 * reach <= remaining else (remaining if reach >= remaining else 0.5 * remaining)
        _step(system, path, k, first, since, h, adjoint, inputs, known, w)
        taken += 1
        old, new, largest = doubles(address(adjoint, 0)), doubles(address(w.new, 0)), 0.0
        for error in (address(w.error, 0), address(w.other, 0)):
            norm = error_norm(own, old, new, doubles(error), rtol, doubles(address(atol, 0)))
            largest = xp.maximum(largest, norm)
        scale = xp.minimum(_GROWTH, xp.maximum(_SHRINKAGE, _SAFETY * xp.maximum(largest, 1e-10) ** -0.25))
        ideal = scale * h / local
        if largest > 1.0 and h > SHORTEST * local:
            w.pace[0] = ideal
            continue
        w.pace[0] = xp.maximum(ideal, w.pace[0] if h < wanted else SHORTEST)
        for i in range(PLACES.shape[0]):
            weight, time = h * (STAGES[4, i] if i < 4 else GAMMA), since - h * PLACES[i]
            for p in range(inputs.kind.shape[0]):
                moments[p, 0] += weight * w.gain[i, p]
                moments[p, 1] += weight * time * w.gain[i, p]
        known = 1.0
        since = until if h == remaining else since - h
        for m in range(n):
            adjoint[m], w.before[m] = w.new[m], w.stages[4, m]
    return taken
