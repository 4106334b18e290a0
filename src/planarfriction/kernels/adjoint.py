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

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.compiler.calls import call, pointer
from planarfriction.compiler.memory import arrays_at, at
from planarfriction.kernels.body import (
    function_of,
    linearisation_of,
    load_of,
    maps_of,
    read,
    record_of,
    total_load,
)
from planarfriction.kernels.contacts import PULL_BACK, ROWS, SOLVE_TRANSPOSED
from planarfriction.kernels.path import hold, node_before
from planarfriction.kernels.sdirk import (
    AGAIN,
    ERROR,
    GAMMA,
    PLACES,
    STAGES,
    START,
    accept,
    error_of,
    keep_stage,
    read_workspace,
    stage_base,
    variation_of,
)
from planarfriction.kernels.small_matrices import applied
from planarfriction.kernels.step_control import judged, length
from planarfriction.kernels.tangent import MOST, partial_of, wrench_by_input
from planarfriction.kernels.vectors import applied_back, dot, plus, put, three, times


@kernel
def _pulled(own, piece, c, y, given, wrench, w):
    """Pull back `given` of the bristle rates and `wrench` of the wrench per unit load of contact c.

    Pointers to all states; that by the bristles goes to `w.forcing`. Returns that by the body's velocity and pose.
    """
    first, rows, (a, g, _) = own.contacts.state[c], arrays_at(ROWS, own.work.rows), maps_of(own, c)
    put(rows.d_wrench, wrench)
    states = at(y, first), linearisation_of(own, c), at(given, first), own.work.rows, at(w.forcing, first)
    call(function_of(own, c, PULL_BACK), (record_of(own, piece, c), *states))
    return applied_back(a, rows.d_twist), applied_back(g, rows.d_twist)


@kernel
def _solve_bristles(own, piece, c, y, b, out):
    first = own.contacts.state[c]
    states = record_of(own, piece, c), at(y, first), at(b, first), linearisation_of(own, c), at(out, first)
    call(function_of(own, c, SOLVE_TRANSPOSED), states)


@kernel
def _body_solved(own, shift, body, velocity, pose, out):
    """Solve the equations of velocity and pose (see `_solve`); return the velocity."""
    (x, y, s), per_shift, cos, sin = pose, 1.0 / shift, 1.0, 0.0
    if own.motion.body_axes:
        cos, sin = math.cos(body[5]), math.sin(body[5])
        s -= per_shift * (sin * body[0] + cos * body[1]) * x
        s += per_shift * (cos * body[0] - sin * body[1]) * y
    velocity = plus(velocity, per_shift, (cos * x + sin * y, cos * y - sin * x, s))
    u = applied_back(own.work.inverse, velocity)
    put(out, u)
    put(at(out, 3), plus(applied_back(own.work.to_pose, u), per_shift, (x, y, s)))
    return u


@kernel
def _solve(own, piece, since, shift, b, w, out):
    """Solve `(shift I - J') out = b` with the matrix that `factor` prepared at the state `w.state`.

    With the wrench `e = (d z'/dV)' D^-T b_z` and S = dW/dV of each contact, its load `f` and the mass matrix M,

        shift u = b_u + sum A' (e + S' f A M^-1 u) + (d pose'/du)' pose
        shift pose = b_pose + sum (G' (e + S' f A M^-1 u) + f H' M^-1 u),      D' z = b_z + (dW/dz)' f A M^-1 u

    whose second for a free body holds the transpose of what `factor` kept as `to_pose`.
    """
    o, y, inverse_mass, none = own.bristles, w.state, own.motion.inverse_mass, (0.0, 0.0, 0.0)
    velocity, pose = three(at(b, o)), three(at(b, o + 3))
    for c in range(own.size):
        _solve_bristles(own, piece, c, y, b, out)
        by_velocity, by_pose = _pulled(own, piece, c, y, out, none, w)
        velocity, pose = plus(velocity, 1.0, by_velocity), plus(pose, 1.0, by_pose)
    u = _body_solved(own, shift, at(y, o), velocity, pose, at(out, o))
    if own.motion.body_axes:  # the wrench does not move the body
        return
    for c in range(own.size):
        pull = inverse_mass[0] * u[0], inverse_mass[1] * u[1], inverse_mass[2] * u[2]
        wrench = times(total_load(own, piece, since, c), applied(maps_of(own, c)[0], pull))
        _pulled(own, piece, c, y, w.zero, wrench, w)
        for m in range(own.contacts.state[c], own.contacts.state[c + 1]):
            w.forcing[m] += b[m]
        _solve_bristles(own, piece, c, y, w.forcing, out)


@kernel
def _step(system, own, path, k, first, since, h, d, drives, w):
    """Carry the adjoint back over `h` seconds into `w.new`, as `tangent` does its slopes forwards."""
    piece, n, shift, inputs = path.piece[k], path.state.shape[1], 1.0 / (h * GAMMA), drives.input_kind.shape[0]
    for i in range(PLACES.shape[0]):
        time = since - h * PLACES[i]
        hold(system, own, path, node_before(path, k, first, time), time, shift, w)
        stage_base(i, h, n, d, w.base)
        for m in range(n):
            w.right[m] = shift * w.base[m]
        _solve(own, piece, time, shift, w.right, w, d.new)
        keep_stage(i, shift, n, d, w.base)
        for u in range(inputs):
            partial_of(own, piece, time, w, drives.input_kind[u], drives.input_place[u], w.forcing)
            gain = 0.0
            for m in range(n):
                gain += d.new[m] * w.forcing[m]
            w.gain[i * inputs + u] = gain


@kernel
def _weight(i):
    """Return the weight of stage i in the solution."""
    return STAGES[4, i] if i < 4 else GAMMA


@kernel
def _error_of_gains(inputs, h, known, rtol, w):
    """Return the larger error estimate of what the cost gains in a step, per tolerance."""
    largest = 0.0
    for u in range(inputs):
        one, other, gained = 0.0, START * w.gain_before[u], 0.0
        for i in range(PLACES.shape[0]):
            gain = w.gain[i * inputs + u]
            one += ERROR[i] * gain
            other += AGAIN[i] * gain
            gained += _weight(i) * gain
        error, size = h * xp.maximum(abs(one), known * abs(other)), xp.maximum(w.most[u], abs(h * gained))
        if not xp.is_finite(error + size):
            return math.inf
        largest = xp.maximum(largest, error / (rtol * xp.where(size > 0.0, size, 1.0)))
    return largest


@kernel
def _gain(since, h, moments, w):
    """Add what the cost gains in a step to the moments of the inputs."""
    inputs = moments.shape[0]
    for u in range(inputs):
        w.gain_before[u] = w.gain[4 * inputs + u]
        for i in range(PLACES.shape[0]):
            gain = h * _weight(i) * w.gain[i * inputs + u]
            moments[u, 0] += gain
            moments[u, 1] += gain * (since - h * PLACES[i])
        w.most[u] = xp.maximum(w.most[u], abs(moments[u, 0]))


@jit
def propagate_back(system, path, first, last, begin, until, adjoint, drives, moments, known, rtol, atol, workspace):
    """Carry `adjoint` [n] from `begin` back to `until` seconds into a piece; add to the `moments` [U, 2] of its inputs.

    The nodes of the piece are `first` to `last` of a path; `known` is 0 where the adjoint has just jumped. Returns the
    number of steps.
    """
    own, w, n, atol = read(system), read_workspace(workspace), adjoint.shape[0], pointer(atol)
    d, taken, k, since = variation_of(w, pointer(adjoint), 0, 0, n), 0, last - 1, begin
    while since > until:
        k = node_before(path, k, first, since)
        local, remaining = path.since[k + 1] - path.since[k], since - until
        h = length(w.pace[0], local, since - path.since[xp.maximum(k + 1 - MOST, first)], remaining)
        _step(system, own, path, k, first, since, h, d, drives, w)
        taken += 1
        of_gains = _error_of_gains(moments.shape[0], h, known, rtol, w)
        error = xp.maximum(error_of(own, n, d, h, known, rtol, atol), of_gains)
        accepted, w.pace[0] = judged(w.pace[0], error, h, local)
        if accepted:
            _gain(since, h, moments, w)
            accept(n, d)
            since, known = until if h == remaining else since - h, 1.0
    return taken


@jit
def jump(system, piece, since, seeds, adjoint, drives, moments, workspace):
    """Add the jump of `adjoint` [n], and of `moments` [U, 2], where a cost sees wrenches: `seeds` [C, 3] are its slope.

    The held state is in the workspace.
    """
    own, w = read(system), read_workspace(workspace)
    y, o = w.state, own.bristles
    call(own.rates, (system, piece, since, y, w.rate))
    call(own.linearise, (system, piece, y))
    for c in range(own.size):
        load = load_of(own, piece, since, c)
        seed = seeds[c, 0], seeds[c, 1], seeds[c, 2]
        for u in range(moments.shape[0]):
            slope = wrench_by_input(own, piece, since, c, y, w, drives.input_kind[u], drives.input_place[u], w.forcing)
            moments[u, 0] += dot(seed, slope)
            moments[u, 1] += dot(seed, slope) * since
        by_velocity, by_pose = _pulled(own, piece, c, y, w.zero, times(load, seed), w)
        for m in range(own.contacts.state[c], own.contacts.state[c + 1]):
            adjoint[m] += w.forcing[m]
        for i in range(3):
            adjoint[o + i] += by_velocity[i]
            adjoint[o + 3 + i] += by_pose[i]
