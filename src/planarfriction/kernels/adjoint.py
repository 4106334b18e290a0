"""The adjoint of the variational equation of `kernels.tangent`, backwards along a computed motion.

With a cost that depends on motion and wrenches at some instants, `l = dcost/dy` obeys `-l' = J(t)' l` between them and
jumps by the cost's own slope at each. The method is that of `tangent`, in transposed matrices and backwards in time,

    b_i = l + h sum_{j<i} a_ij G_j,   (I/(h gamma) - J_i') S_i = b_i/(h gamma),   G_i = (S_i - b_i)/(h gamma)

What the cost gains per number is the integral of `q = l' df/dp`, with the weights of the method. A signal that is
linear on a piece, in any number of knots, needs no more of it than its two moments `int q dt` and `int q t dt`.

The equations of a stage are solved as those of the motion are, contact by contact: what the bristles pull back to the
body, 3 x 3 for the velocity with the inverse that `factor` made, what the body sends to the bristles.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.kernels.body import load_of, read, record_of, seen_by, times
from planarfriction.kernels.contacts import CALLS, PULL_BACK, SOLVE_TRANSPOSED
from planarfriction.kernels.pointers import address, at, call, doubles, integers
from planarfriction.kernels.sdirk import AGAIN, ERROR, GAMMA, PLACES, STAGES, START, excess_of, pace_after, stage_base
from planarfriction.kernels.tangent import (
    FRICTION,
    LOAD,
    MOST,
    NORMAL_FORCE,
    SHORTEST,
    SIZE,
    _change,
    _interpolate,
    _partial,
)


class Workspace(NamedTuple):
    """Room for the adjoint of n states with U kinds of inputs."""

    stages: np.ndarray
    """`G` of each stage, [5, n]."""
    gain: np.ndarray
    """`l' df/dp` at each stage, [5, U]."""
    gain_before: np.ndarray
    """The same at the end of the step before, [U]."""
    most: np.ndarray
    """Largest gain on a piece so far, [U]."""
    level: np.ndarray
    """Largest adjoint so far, [n]."""
    forcing: np.ndarray
    """`df/dp`, [n]."""
    new: np.ndarray
    before: np.ndarray
    state: np.ndarray
    rate: np.ndarray
    base: np.ndarray
    right: np.ndarray
    zero: np.ndarray
    """Vectors [n], as in `tangent.Slopes`."""
    pace: np.ndarray
    """Length of the next step, in steps of the motion, [1]."""


def workspace_for(inputs: int, n: int) -> Workspace:
    """Workspace (made outside compiled code, where an allocation costs compile time)."""
    gains = np.zeros((5, inputs)), *np.zeros((2, inputs))
    return Workspace(np.zeros((5, n)), *gains, *np.zeros((9, n)), np.ones(1))


@kernel
def _pulled(own, piece, c, y, given, w):
    """Pull back `given` of the bristle rates and `own.rows[3]` of the wrench per unit load of contact c.

    Addresses of all states; that by the bristles goes to `w.forcing`, that by the twist to `own.rows[2]`.
    """
    first, lin = integers(own.state)[c], at(own.workspace, integers(own.linear)[c])
    states = at(y, first), lin, at(given, first), own.rows, address(w.forcing, first)
    call(integers(own.calls)[CALLS * c + PULL_BACK], (record_of(own, piece, c), *states))


@kernel
def _to_body(own, c, velocity, pose):
    """Add what the twist of contact c pulls back, `own.rows[2]`, to that of the body's velocity and pose."""
    a, g, rows = doubles(at(own.maps, 27 * c)), doubles(at(own.maps, 27 * c + 9)), doubles(own.rows)
    for i in range(3):
        velocity[i] += a[i] * rows[6] + a[3 + i] * rows[7] + a[6 + i] * rows[8]
        pose[i] += g[i] * rows[6] + g[3 + i] * rows[7] + g[6 + i] * rows[8]


@kernel
def _solve(own, piece, since, shift, b, w, out):
    """Solve `(shift I - J') out = b` (addresses) with the matrix that `factor` prepared at the state `w.state`.

    With the wrench `e = (d z'/dV)' D^-T b_z` and S = dW/dV of each contact, its load `f` and the mass matrix M,

        shift u = b_u + sum A' (e + S' f A M^-1 u) + (d pose'/du)' pose
        shift pose = b_pose + sum (G' (e + S' f A M^-1 u) + f H' M^-1 u),      D' z = b_z + (dW/dz)' f A M^-1 u

    whose second for a free body holds the transpose of what `factor` kept as `to_pose`.
    """
    o, y, rows = own.bristles, address(w.state, 0), doubles(own.rows)
    velocity, pose = doubles(own.body), doubles(own.twist)
    for i in range(3):
        velocity[i], pose[i] = doubles(b)[o + i], doubles(b)[o + 3 + i]
    for c in range(own.contacts):
        first, lin = integers(own.state)[c], at(own.workspace, integers(own.linear)[c])
        states = at(y, first), at(b, first), lin, at(out, first)
        call(integers(own.calls)[CALLS * c + SOLVE_TRANSPOSED], (record_of(own, piece, c), *states))
        rows[9], rows[10], rows[11] = 0.0, 0.0, 0.0
        _pulled(own, piece, c, y, out, w)
        _to_body(own, c, velocity, pose)
    u, p = doubles(at(out, o)), doubles(at(out, o + 3))
    inverse, to_pose, inverse_mass = doubles(own.inverse), doubles(own.to_pose), doubles(own.inverse_mass)
    per_shift, cos, sin = 1.0 / shift, 1.0, 0.0
    if own.body_axes:
        cos, sin = math.cos(w.state[o + 5]), math.sin(w.state[o + 5])
        pose[2] -= per_shift * (sin * w.state[o] + cos * w.state[o + 1]) * pose[0]
        pose[2] += per_shift * (cos * w.state[o] - sin * w.state[o + 1]) * pose[1]
    velocity[0] += per_shift * (cos * pose[0] + sin * pose[1])
    velocity[1] += per_shift * (cos * pose[1] - sin * pose[0])
    velocity[2] += per_shift * pose[2]
    for i in range(3):
        u[i] = inverse[i] * velocity[0] + inverse[3 + i] * velocity[1] + inverse[6 + i] * velocity[2]
    for i in range(3):
        p[i] = per_shift * pose[i] + to_pose[i] * u[0] + to_pose[3 + i] * u[1] + to_pose[6 + i] * u[2]
    if own.body_axes:  # the wrench does not move the body
        return
    for c in range(own.contacts):
        first, last, a = integers(own.state)[c], integers(own.state)[c + 1], doubles(at(own.maps, 27 * c))
        load = doubles(own.count)[c] * load_of(own, piece, since, c)
        for i in range(3):
            pull = a[3 * i] * inverse_mass[0] * u[0] + a[3 * i + 1] * inverse_mass[1] * u[1]
            rows[9 + i] = load * (pull + a[3 * i + 2] * inverse_mass[2] * u[2])
        _pulled(own, piece, c, y, address(w.zero, 0), w)
        for m in range(first, last):
            w.forcing[m] += doubles(b)[m]
        states = at(y, first), address(w.forcing, first), at(own.workspace, integers(own.linear)[c]), at(out, first)
        call(integers(own.calls)[CALLS * c + SOLVE_TRANSPOSED], (record_of(own, piece, c), *states))


@kernel
def _node(path, k, first, since):
    """The last node up to k, but from `first` on, that is before `since`."""
    while k > first and path.since[k] >= since:
        k -= 1
    return k


@kernel
def _step(system, path, k, first, since, h, adjoint, drives, w):
    """Carry the adjoint back over `h` seconds into `w.new`, as `tangent` does its slopes forwards."""
    own, piece, n = read(system), path.piece[k], w.state.shape[0]
    shift = 1.0 / (h * GAMMA)
    for i in range(PLACES.shape[0]):
        time = since - h * PLACES[i]
        _interpolate(path, _node(path, k, first, time), time, w.state)
        call(own.rates, (system, piece, time, w.state, w.rate))
        call(own.linearise, (system, piece, w.state))
        call(own.factor, (system, piece, time, w.state, shift))
        stage_base(i, h, n, address(adjoint, 0), address(w.stages, 0), address(w.base, 0))
        for m in range(n):
            w.right[m] = shift * w.base[m]
        _solve(own, piece, time, shift, address(w.right, 0), w, address(w.new, 0))
        for m in range(n):
            w.stages[i, m] = shift * (w.new[m] - w.base[m])
        for u in range(drives.input_kind.shape[0]):
            _partial(own, piece, time, w, drives.input_kind[u], drives.input_place[u], w.forcing)
            gain = 0.0
            for m in range(n):
                gain += w.new[m] * w.forcing[m]
            w.gain[i, u] = gain


@kernel
def _gained(u, h, w):
    """What the cost gains by input u in a step."""
    total = GAMMA * w.gain[4, u]
    for i in range(4):
        total += STAGES[4, i] * w.gain[i, u]
    return h * total


@kernel
def _excess_of_gains(h, known, rtol, w):
    """The larger error estimate of what the cost gains in a step, in units of what is allowed."""
    largest = 0.0
    for u in range(w.gain.shape[1]):
        one, other = 0.0, START * w.gain_before[u]
        for i in range(PLACES.shape[0]):
            one += ERROR[i] * w.gain[i, u]
            other += AGAIN[i] * w.gain[i, u]
        error, size = h * xp.maximum(abs(one), known * abs(other)), xp.maximum(w.most[u], abs(_gained(u, h, w)))
        if not xp.is_finite(error + size):
            return math.inf
        largest = xp.maximum(largest, error / (rtol * xp.where(size > 0.0, size, 1.0)))
    return largest


@jit
def propagate_back(system, path, first, last, begin, until, adjoint, drives, moments, known, rtol, atol, w):
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
        _step(system, path, k, first, since, h, adjoint, drives, w)
        taken += 1
        both, others = (address(adjoint, 0), address(w.new, 0)), (address(w.level, 0), address(w.before, 0))
        places = both[0], both[1], others[0], others[1], address(w.stages, 0), address(atol, 0)
        largest = xp.maximum(excess_of(own, n, places, h, known, rtol), _excess_of_gains(h, known, rtol, w))
        ideal = pace_after(largest) * h / local
        if largest > 1.0 and h > SHORTEST * local:
            w.pace[0] = ideal
            continue
        w.pace[0] = xp.maximum(ideal, w.pace[0] if h < wanted else SHORTEST)
        for u in range(w.gain.shape[1]):
            w.gain_before[u] = w.gain[4, u]
            for i in range(PLACES.shape[0]):
                gain = h * (STAGES[4, i] if i < 4 else GAMMA) * w.gain[i, u]
                moments[u, 0] += gain
                moments[u, 1] += gain * (since - h * PLACES[i])
            w.most[u] = xp.maximum(w.most[u], abs(moments[u, 0]))
        known = 1.0
        since = until if h == remaining else since - h
        for m in range(n):
            adjoint[m], w.before[m] = w.new[m], w.stages[4, m]
            w.level[m] = xp.maximum(w.level[m], abs(w.new[m]))
    return taken


@jit
def jump(system, piece, since, seeds, adjoint, drives, moments, w):
    """The jump of `adjoint` [n], and of the `moments` [U, 2], where a cost sees wrenches: `seeds` [C, 3] are its slope.

    The held state is in `w.state`.
    """
    own, y, dy = read(system), address(w.state, 0), address(w.rate, 0)
    o, rows = own.bristles, doubles(own.rows)
    call(own.rates, (system, piece, since, w.state, w.rate))
    call(own.linearise, (system, piece, w.state))
    for c in range(own.contacts):
        load, unit = load_of(own, piece, since, c), doubles(at(own.wrench, 3 * c))
        times(doubles(at(own.maps, 27 * c)), doubles(seen_by(own, c, y)), rows)
        for u in range(moments.shape[0]):
            kind, gain = drives.input_kind[u], 0.0
            for i in range(3):
                rows[3 + i], rows[6 + i], rows[9 + i] = unit[i], 0.0, 0.0
            if kind in (FRICTION, SIZE):
                _change(own, piece, c, y, dy, address(w.zero, 0), kind, address(w.forcing, 0))
            for i in range(3):
                slope = load * (unit[i] if kind == LOAD else rows[9 + i])
                if kind == NORMAL_FORCE and drives.input_place[u] == c:
                    slope = unit[i]
                gain += seeds[c, i] * slope
            moments[u, 0] += gain
            moments[u, 1] += gain * since
        for i in range(3):
            rows[9 + i] = load * seeds[c, i]
        _pulled(own, piece, c, y, address(w.zero, 0), w)
        for m in range(integers(own.state)[c], integers(own.state)[c + 1]):
            adjoint[m] += w.forcing[m]
        _to_body(own, c, doubles(address(adjoint, o)), doubles(address(adjoint, o + 3)))
