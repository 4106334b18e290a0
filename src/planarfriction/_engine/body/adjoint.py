"""The adjoint of the variational equation of `body.tangent`, backwards along a computed motion.

With a cost that depends on motion and wrenches at some instants, `l = dcost/dy` obeys `-l' = J(t)' l` between them and
jumps by the cost's own slope at each. The method of `tangent` runs in transposed matrices, backwards in time,

    b_i = l + h sum_{j<i} a_ij G_j,   (I/(h gamma) - J_i') S_i = b_i/(h gamma),   G_i = (S_i - b_i)/(h gamma)

The cost gains the integral of `q = l' df/dp` per number, with the weights of the method. A signal that is linear on a
piece, in any number of knots, needs only the two moments `int q dt` and `int q t dt`.

The equations of a stage are solved contact by contact, as in the motion: the bristles pull back to the body, the
velocity solves a system [3, 3] with the inverse that `factor` made, and the body sends its share to the bristles.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.body.body import (
    SystemRecord,
    functions_of,
    linearisation_of,
    load_of,
    maps_of,
    read,
    record_of,
    total_load,
)
from planarfriction._engine.body.path import (
    Path,
    Stretch,
    Tolerances,
    hold,
    node_before,
)
from planarfriction._engine.body.sdirk import (
    AGAIN,
    ERROR,
    GAMMA,
    PLACES,
    PLAIN,
    STAGES,
    START,
    Variation,
    Workspace,
    accept,
    error_of,
    keep_stage,
    read_workspace,
    stage_base,
    variation_of,
    write_errors,
)
from planarfriction._engine.body.step_control import fitted, judged
from planarfriction._engine.body.tangent import (
    MOST,
    Drives,
    partial_of,
    wrench_by_input,
)
from planarfriction._engine.codegen.small_matrices import applied
from planarfriction._engine.codegen.vectors import (
    Vector,
    applied_back,
    dot,
    plus,
    put,
    three,
    times,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.compiler.calls import call, pointer
from planarfriction._engine.compiler.memory import Doubles, Place, arrays_at, at
from planarfriction._engine.protocol import ROWS

PER_STEP = 2.0
"""Most steps of the adjoint for each step of the motion, on average; half of one is usual."""


@kernel
def _pulled(
    system: SystemRecord,
    piece: int,
    c: int,
    y: Doubles,
    rates: Doubles,
    wrench: Vector,
    w: Workspace,
) -> tuple[Vector, Vector]:
    """Pull back `rates` of the bristles and `wrench` of the wrench per unit load of contact c.

    Pointers to all states; the cotangent of the bristles goes to `w.forcing`. Returns the cotangents of the body's
    velocity and pose.
    """
    first = system.contacts.state[c]
    rows = arrays_at(ROWS, system.work.rows)
    (a, g, _) = maps_of(system, c)
    put(rows.d_wrench, wrench)
    states = (
        at(y, first),
        linearisation_of(system, c),
        at(rates, first),
        system.work.rows,
        at(w.forcing, first),
    )
    call(functions_of(system, c).pull_back, (record_of(system, piece, c), *states))
    return applied_back(a, rows.d_twist), applied_back(g, rows.d_twist)


@kernel
def _solve_bristles(
    system: SystemRecord, piece: int, c: int, y: Doubles, b: Doubles, out: Doubles
) -> None:
    first = system.contacts.state[c]
    states = (
        record_of(system, piece, c),
        at(y, first),
        at(b, first),
        linearisation_of(system, c),
        at(out, first),
    )
    call(functions_of(system, c).solve_transposed, states)


@kernel
def _body_solved(
    system: SystemRecord,
    shift: float,
    body: Doubles,
    velocity: Vector,
    pose: Vector,
    out: Doubles,
) -> Vector:
    """Solve the equations of velocity and pose (see `_solve`); return the velocity."""
    (x, y, s) = pose
    per_shift = 1.0 / shift
    cos = 1.0
    sin = 0.0
    if system.motion.body_axes:
        cos = math.cos(body[5])
        sin = math.sin(body[5])
        s -= per_shift * (sin * body[0] + cos * body[1]) * x
        s += per_shift * (cos * body[0] - sin * body[1]) * y
    velocity = plus(velocity, per_shift, (cos * x + sin * y, cos * y - sin * x, s))
    u = applied_back(system.work.inverse, velocity)
    put(out, u)
    put(at(out, 3), plus(applied_back(system.work.to_pose, u), per_shift, (x, y, s)))
    return u


@kernel
def _solve(
    system: SystemRecord,
    piece: int,
    since: float,
    shift: float,
    b: Doubles,
    w: Workspace,
    out: Doubles,
) -> None:
    """Solve `(shift I - J') out = b` with the matrix that `factor` prepared at the state `w.state`.

    With the wrench `e = (d z'/dV)' D^-T b_z` and S = dW/dV of each contact, its load `f` and the mass matrix M,

        shift u = b_u + sum A' (e + S' f A M^-1 u) + (d pose'/du)' pose
        shift pose = b_pose + sum (G' (e + S' f A M^-1 u) + f H' M^-1 u),      D' z = b_z + (dW/dz)' f A M^-1 u

    whose second for a free body holds the transpose of what `factor` kept as `to_pose`.
    """
    o = system.bristles
    y = w.state
    inverse_mass = system.motion.inverse_mass
    none = (0.0, 0.0, 0.0)
    velocity = three(at(b, o))
    pose = three(at(b, o + 3))
    for c in range(system.size):
        _solve_bristles(system, piece, c, y, b, out)
        by_velocity, by_pose = _pulled(system, piece, c, y, out, none, w)
        velocity = plus(velocity, 1.0, by_velocity)
        pose = plus(pose, 1.0, by_pose)
    u = _body_solved(system, shift, at(y, o), velocity, pose, at(out, o))
    if system.motion.body_axes:  # the wrench does not move the body
        return
    for c in range(system.size):
        pull = inverse_mass[0] * u[0], inverse_mass[1] * u[1], inverse_mass[2] * u[2]
        wrench = times(
            total_load(system, piece, since, c), applied(maps_of(system, c)[0], pull)
        )
        _pulled(system, piece, c, y, w.zero, wrench, w)
        for m in range(system.contacts.state[c], system.contacts.state[c + 1]):
            w.forcing[m] += b[m]
        _solve_bristles(system, piece, c, y, w.forcing, out)


@kernel
def _step(
    address: Place,
    path: Path,
    k: int,
    first: int,
    since: float,
    h: float,
    d: Variation,
    drives: Drives,
    w: Workspace,
) -> None:
    """Carry the adjoint back over `h` seconds into `w.new`, as `tangent` does its slopes forwards."""
    system = read(address)
    piece = path.piece[k]
    n = path.state.shape[1]
    shift = 1.0 / (h * GAMMA)
    inputs = drives.input_kind.shape[0]
    for i in range(PLACES.shape[0]):
        time = since - h * PLACES[i]
        hold(address, path, node_before(path, k, first, time), time, shift, w)
        stage_base(i, h, n, d, w.base)
        for m in range(n):
            w.right[m] = shift * w.base[m]
        _solve(system, piece, time, shift, w.right, w, d.new)
        keep_stage(i, shift, n, d, w.base)
        for u in range(inputs):
            partial_of(
                system,
                piece,
                time,
                w,
                drives.input_kind[u],
                drives.input_place[u],
                w.forcing,
            )
            gain = 0.0
            for m in range(n):
                gain += d.new[m] * w.forcing[m]
            w.gain[i * inputs + u] = gain


@kernel
def _error_of_step(
    system: SystemRecord, piece: int, since: float, h: float, n: int, d: Variation, known: float,
    tolerances: Tolerances, w: Workspace,
) -> float:  # fmt: skip
    """Return the error of a step that ended at `since`, where the matrix is of, per tolerance (see `sdirk.PLAIN`)."""
    shift = 1.0 / (h * GAMMA)
    rtol = tolerances.rtol
    atol = pointer(tolerances.atol)
    write_errors(n, d, known)
    error = error_of(system, n, d, h, rtol, atol)
    if error > PLAIN:
        for i in range(2):
            estimate = at(d.stages, i * n)
            for m in range(n):
                w.right[m] = shift * estimate[m]
            _solve(system, piece, since, shift, w.right, w, estimate)
        error = error_of(system, n, d, h, rtol, atol)
    return error


@kernel
def _weight(i: int) -> float:
    """Return the weight of stage i in the solution."""
    return STAGES[4, i] if i < 4 else GAMMA


@kernel
def _error_of_gains(
    inputs: int, h: float, known: float, rtol: float, w: Workspace
) -> float:
    """Return the larger error estimate of the cost's gain in a step, per tolerance."""
    largest = 0.0
    for u in range(inputs):
        one = 0.0
        other = START * w.gain_before[u]
        gained = 0.0
        for i in range(PLACES.shape[0]):
            gain = w.gain[i * inputs + u]
            one += ERROR[i] * gain
            other += AGAIN[i] * gain
            gained += _weight(i) * gain
        error = h * xp.maximum(abs(one), known * abs(other))
        size = xp.maximum(w.most[u], abs(h * gained))
        if not xp.is_finite(error + size):
            return math.inf
        largest = xp.maximum(largest, error / (rtol * xp.where(size > 0.0, size, 1.0)))
    return largest


@kernel
def _gain(since: float, h: float, moments: np.ndarray, w: Workspace) -> None:
    """Add the cost's gain in a step to the moments of the inputs."""
    inputs = moments.shape[0]
    for u in range(inputs):
        w.gain_before[u] = w.gain[4 * inputs + u]
        for i in range(PLACES.shape[0]):
            gain = h * _weight(i) * w.gain[i * inputs + u]
            moments[u, 0] += gain
            moments[u, 1] += gain * (since - h * PLACES[i])
        w.most[u] = xp.maximum(w.most[u], abs(moments[u, 0]))


@jit
def propagate_back(
    address: Place, path: Path, stretch: Stretch, adjoint: np.ndarray, drives: Drives, moments: np.ndarray,
    known: float, tolerances: Tolerances, workspace: Place,
) -> int:  # fmt: skip
    """Carry `adjoint` [n] back along a stretch of a path, and add to the `moments` [U, 2] of the inputs.

    `known` is 0 where the adjoint has just jumped. Returns the number of steps. It stops where none is left (`w.left`);
    each step of the motion that is passed over allows `PER_STEP` more.
    """
    system = read(address)
    w = read_workspace(workspace)
    n = adjoint.shape[0]
    first = stretch.first
    d = variation_of(w, pointer(adjoint), 0, 0, n)
    taken = 0
    since = stretch.begin
    until = stretch.until
    k = node_before(path, stretch.last - 1, first, since)
    while since > until and w.left[0] > 0.0:
        before = k
        k = node_before(path, k, first, since)
        w.left[0] += PER_STEP * (before - k) - 1.0
        local = path.since[k + 1] - path.since[k]
        remaining = since - until
        reach = since - path.since[xp.maximum(k + 1 - MOST, first)]
        h = fitted(xp.minimum(w.pace[0] * local, reach), remaining)
        _step(address, path, k, first, since, h, d, drives, w)
        taken += 1
        of_gains = _error_of_gains(moments.shape[0], h, known, tolerances.rtol, w)
        of_step = _error_of_step(
            system, path.piece[k], since - h, h, n, d, known, tolerances, w
        )
        error = xp.maximum(of_step, of_gains)
        accepted, w.pace[0] = judged(w.pace[0], error, h, local)
        if accepted:
            _gain(since, h, moments, w)
            accept(n, d)
            since = until if h == remaining else since - h
            known = 1.0
    return taken


@jit
def jump(
    address: Place, piece: int, since: float, seeds: np.ndarray, adjoint: np.ndarray, drives: Drives,
    moments: np.ndarray, workspace: Place,
) -> None:  # fmt: skip
    """Add the jump of `adjoint` [n], and of `moments` [U, 2], where a cost sees wrenches: `seeds` [C, 3] are its slope.

    The workspace holds the state.
    """
    system = read(address)
    w = read_workspace(workspace)
    y = w.state
    o = system.bristles
    call(system.linearise, (address, piece, since, y, w.rate))
    for c in range(system.size):
        load = load_of(system, piece, since, c)
        seed = seeds[c, 0], seeds[c, 1], seeds[c, 2]
        for u in range(moments.shape[0]):
            slope = wrench_by_input(
                system,
                piece,
                since,
                c,
                y,
                w,
                drives.input_kind[u],
                drives.input_place[u],
                w.forcing,
            )
            moments[u, 0] += dot(seed, slope)
            moments[u, 1] += dot(seed, slope) * since
        by_velocity, by_pose = _pulled(
            system, piece, c, y, w.zero, times(load, seed), w
        )
        for m in range(system.contacts.state[c], system.contacts.state[c + 1]):
            adjoint[m] += w.forcing[m]
        for i in range(3):
            adjoint[o + i] += by_velocity[i]
            adjoint[o + 3 + i] += by_pose[i]
