"""Forward sensitivities of a planar body on its contacts: the variational equation along a computed motion.

With the right-hand side `f(t, y, p)` of `kernels.body` and its Jacobian `J`, the derivative `s = dy/dp` obeys the
linear equation `s' = J(t) s + df/dp`. It is solved by an L-stable method of order 4 with a diagonal of `gamma`: each
stage is one `factor` and, for each parameter, one `solve` of `body`,

    b_i = s + h sum_{j<i} a_ij G_j,   (I/(h gamma) - J_i) S_i = b_i/(h gamma) + df/dp,   G_i = (S_i - b_i)/(h gamma)

with `J_i` at the cubic Hermite interpolant between the accepted steps of the motion. Derivatives need fewer digits than
the motion, so that one step of theirs goes over several of it; the embedded method of order 3 tells how many.

Friction and size enter by scaling: with all coefficients `g` times m, a bristle behaves as `z/m` did,
`zdot(z; m) = zdot(z/m; 1)`; a patch `l` times as large sees `l omega` and gives `l tau`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.kernels.body import load_of, read, record_of, seen_by, times
from planarfriction.kernels.contacts import CALLS, CHANGE
from planarfriction.kernels.integration import read_run
from planarfriction.kernels.pointers import address, at, call, doubles, integers
from planarfriction.kernels.rosenbrock import PAUSED, STEPS, advance, forget_unloaded
from planarfriction.kernels.sdirk import GAMMA, PLACES, excess_of, pace_after, stage_base

FRICTION, SIZE, MASS, INERTIA, LOAD = 0, 1, 2, 3, 4
"""Parameters; each is a factor, 1 as the scene is."""

NORMAL_FORCE, FORCE, VELOCITY, INITIAL = 5, 6, 7, 8
"""What else the motion depends on: the load of one contact, a component of the applied wrench or of the prescribed
velocity, each in proportion to a weight that is linear on a piece, and a component of the start."""


class Drives(NamedTuple):
    """P numbers that a motion depends on, by way of U inputs: the knots of a signal all move the same."""

    kind: np.ndarray
    """`FRICTION` to `INITIAL`, int [P]."""
    place: np.ndarray
    """Contact, component of the wrench or velocity, or of velocity and pose at the start; int [P]."""
    weight: np.ndarray
    """Change of a signal per change of the number, at the start of the piece and its slope, [P, 2]."""
    input: np.ndarray
    """Which input, int [P]."""
    input_kind: np.ndarray
    """As `kind`, int [U]."""
    input_place: np.ndarray
    """As `place`, int [U]."""


SHORTEST = 2.0**-12
"""Shortest step, as a share of one of the motion."""

MOST = 8
"""Steps of the motion that one of the derivatives goes over at most, so that it passes over nothing sudden."""


@kernel
def _change(own, piece, c, y, dy, dz, parameter, dzdot):
    """Change of the bristle rates and of the wrench per unit load of contact c with its bristles, twist and parameter.

    Addresses of all states, `y` linearised; `own.rows` holds V, W and dV and takes dW.
    """
    first, lin = integers(own.state)[c], at(own.workspace, integers(own.linear)[c])
    d_friction = 1.0 if parameter == FRICTION else 0.0
    d_size = 1.0 if parameter == SIZE else 0.0
    function, record = integers(own.calls)[CALLS * c + CHANGE], record_of(own, piece, c)
    bristles = at(y, first), at(dy, first), lin, at(dz, first), at(dzdot, first)
    call(function, (record, *bristles, own.rows, d_friction, d_size))


@kernel
def _partial(own, piece, since, w, parameter, place, out):
    """`df/dp` of an input at the held state `w.state`, whose rates are in `w.rate`, linearised last; of a prescribed
    velocity that by its slope."""
    o, dy, rows, total = own.bristles, w.rate, doubles(own.rows), doubles(own.body)
    for i in range(out.shape[0]):
        out[i] = 0.0
    inverse_mass, acceleration = doubles(own.inverse_mass), doubles(own.acceleration)
    if parameter == INITIAL:
        return
    if parameter == VELOCITY:
        out[o + place] = 1.0
        return
    if parameter == FORCE:
        out[o + place] = inverse_mass[place]
        return
    if parameter in (MASS, INERTIA):
        for i in range(3):
            if (i == 2) == (parameter == INERTIA) and inverse_mass[i] > 0.0:
                out[o + i] = acceleration[3 * piece + i] - dy[o + i]
        return
    for i in range(3):
        total[i] = 0.0
    for c in range(own.contacts):
        if parameter == NORMAL_FORCE and c != place:
            continue
        a, wrench = doubles(at(own.maps, 27 * c)), doubles(at(own.wrench, 3 * c))
        for i in range(3):
            rows[3 + i], rows[6 + i], rows[9 + i] = wrench[i], 0.0, wrench[i]
        if parameter in (FRICTION, SIZE):
            times(a, doubles(seen_by(own, c, address(w.state, 0))), rows)
            _change(own, piece, c, address(w.state, 0), address(dy, 0), address(w.zero, 0), parameter, address(out, 0))
        load = doubles(own.count)[c] * (1.0 if parameter == NORMAL_FORCE else load_of(own, piece, since, c))
        for i in range(3):
            total[i] += load * (a[i] * rows[9] + a[3 + i] * rows[10] + a[6 + i] * rows[11])
    for i in range(3):
        out[o + i] = inverse_mass[i] * total[i]


class Path(NamedTuple):
    """The ends of accepted steps of a motion, K of them; between two of the same piece lies a step."""

    piece: np.ndarray
    """Piece between breaks, int [K]."""
    since: np.ndarray
    """Seconds into it, [K]."""
    state: np.ndarray
    """[K, n]; at the end of a piece before a contact whose load ends forgets its bristles."""
    rate: np.ndarray
    """Its rate, [K, n]."""


def path_for(most: int, n: int) -> Path:
    """Room for the ends of steps (made outside compiled code)."""
    return Path(np.zeros(most, np.int64), np.zeros(most), np.zeros((most, n)), np.zeros((most, n)))


@jit
def follow(run, path):
    """Go on with the run at an address until it ends or `path` is full; return how many nodes that has, the outcome."""
    integration, count, outcome = read_run(run), 0, PAUSED
    own, n = read(integration.system), integration.states
    y, new, start_rate = doubles(integration.y), doubles(integration.new), doubles(integration.start_rate)
    cursor, clock, counts = integers(integration.cursor), doubles(integration.clock), integers(integration.statistics)
    breaks = doubles(own.breaks)
    while outcome == PAUSED and count + 2 <= path.piece.shape[0]:
        piece, since, accepted = cursor[0], clock[0], counts[STEPS]
        starting = count == 0 or path.piece[count - 1] != piece
        if starting:
            if since == 0.0 and own.velocity != 0:
                for i in range(3):
                    y[n - 6 + i] = doubles(own.velocity)[3 * piece + i]
            path.piece[count], path.since[count] = piece, since
            for i in range(n):
                path.state[count, i] = y[i]
        outcome = advance(run, 1)
        if counts[STEPS] == accepted:
            continue
        count += starting
        ended = cursor[0] != piece
        path.piece[count], path.since[count] = piece, breaks[piece + 1] - breaks[piece] if ended else clock[0]
        for i in range(n):
            path.rate[count - 1, i], path.state[count, i] = start_rate[i], new[i]
        if ended or outcome != PAUSED or count + 3 > path.piece.shape[0]:  # else the next trial evaluates it
            call(own.rates, (integration.system, piece, path.since[count], path.state[count], path.rate[count]))
        count += 1
    return count, outcome


@kernel
def _share(drives, p, since):
    """How much of its input a number moves."""
    kind = drives.kind[p]
    if kind in (NORMAL_FORCE, FORCE):
        return drives.weight[p, 0] + drives.weight[p, 1] * since
    return drives.weight[p, 1] if kind == VELOCITY else (0.0 if kind == INITIAL else 1.0)


class Slopes(NamedTuple):
    """Workspace for P derivatives of n states by way of U inputs."""

    forcing: np.ndarray
    """`df/dp` of the inputs, [U, n]."""
    level: np.ndarray
    """Largest derivatives so far by the numbers of each input, [U, n]."""
    stages: np.ndarray
    """`G` of each stage, [P, 5, n]."""
    new: np.ndarray
    """Derivatives after a step, [P, n]."""
    before: np.ndarray
    """Rates of the derivatives at the end of the step before, [P, n]."""
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
    pace: np.ndarray
    """Length of the next step, in steps of the motion, [1]."""


def slopes_for(count: int, inputs: int, n: int) -> Slopes:
    """Workspace for `count` derivatives of n states (made outside compiled code)."""
    of_inputs, of_numbers = np.zeros((2, inputs, n)), np.zeros((2, count, n))
    stages = np.zeros((count, len(PLACES), n))
    return Slopes(*of_inputs, stages, *of_numbers, *np.zeros((5, n)), np.ones(1))


@kernel
def _interpolate(path, k, since, state):
    """State at `since` seconds into the piece, in the step after node k."""
    h = path.since[k + 1] - path.since[k]
    right = (since - path.since[k]) / h
    left = 1.0 - right
    start, end, start_rate, end_rate = path.state[k], path.state[k + 1], path.rate[k], path.rate[k + 1]
    for m in range(state.shape[0]):
        bend = (left - right) * (end[m] - start[m]) + h * (right * end_rate[m] - left * start_rate[m])
        state[m] = left * start[m] + right * end[m] - left * right * bend


@kernel
def _node(path, k, last, since):
    """The last node from k on, but for `last`, that is not behind `since`."""
    while k + 1 < last and path.since[k + 1] <= since:
        k += 1
    return k


@kernel
def _step(system, path, k, last, since, h, slope, drives, known, rtol, atol, w):
    """Carry `slope` over `h` seconds into `w.new`; how far its error estimates exceed what is allowed.

    One of them is 0 unless it is `known` (1 or 0) how fast the slope changes at the start, `w.before`.
    """
    own, piece, n = read(system), path.piece[k], w.state.shape[0]
    shift = 1.0 / (h * GAMMA)
    for i in range(PLACES.shape[0]):
        time = since + h * PLACES[i]
        _interpolate(path, _node(path, k, last, time), time, w.state)
        call(own.rates, (system, piece, time, w.state, w.rate))
        call(own.linearise, (system, piece, w.state))
        for u in range(drives.input_kind.shape[0]):
            _partial(own, piece, time, w, drives.input_kind[u], drives.input_place[u], w.forcing[u])
        call(own.factor, (system, piece, time, w.state, shift))
        for p in range(drives.kind.shape[0]):
            stages = address(w.stages, p * PLACES.shape[0] * n)
            stage_base(i, h, n, address(slope, p * n), stages, address(w.base, 0))
            share, forcing = _share(drives, p, time), w.forcing[drives.input[p]]
            for m in range(n):
                w.right[m] = shift * w.base[m]
            if share != 0.0:
                for m in range(n):
                    w.right[m] += share * forcing[m]
            new = w.new[p]
            call(own.solve, (system, piece, time, w.state, shift, w.right, new))
            for m in range(n):
                w.stages[p, i, m] = shift * (new[m] - w.base[m])
    largest = 0.0
    for p in range(drives.kind.shape[0]):
        old, new, level = address(slope, p * n), address(w.new, p * n), address(w.level, drives.input[p] * n)
        stages, before = address(w.stages, p * PLACES.shape[0] * n), address(w.before, p * n)
        excess = excess_of(own, n, (old, new, level, before, stages, address(atol, 0)), h, known, rtol)
        largest = xp.maximum(largest, excess)
    return largest


@jit
def propagate(system, path, first, last, begin, until, slope, drives, rtol, atol, w):
    """Carry `slope` [P, n] from `begin` to `until` seconds into a piece, whose nodes are `first` to `last` of a path.

    Returns how many steps that took. Each keeps its error below `rtol`, `atol` [n], but for one shorter than `SHORTEST`
    of a step of the motion: the Jacobian may jump within it.
    """
    taken, n, k, since = 0, w.right.shape[0], first, begin
    while since < until:
        k = _node(path, k, last, since)
        local, remaining = path.since[k + 1] - path.since[k], until - since
        wanted = w.pace[0] * local
        reach = xp.minimum(wanted, path.since[xp.minimum(k + MOST, last)] - since)
        h = reach if 2.0 * reach <= remaining else (remaining if reach >= remaining else 0.5 * remaining)
        largest = _step(system, path, k, last, since, h, slope, drives, 1.0 if since > 0.0 else 0.0, rtol, atol, w)
        taken += 1
        ideal = pace_after(largest) * h / local
        if largest > 1.0 and h > SHORTEST * local:
            w.pace[0] = ideal
            continue
        w.pace[0] = xp.maximum(ideal, w.pace[0] if h < wanted else SHORTEST)
        since = until if h == remaining else since + h
        for p in range(drives.kind.shape[0]):
            level = w.level[drives.input[p]]
            for m in range(n):
                slope[p, m], w.before[p, m] = w.new[p, m], w.stages[p, PLACES.shape[0] - 1, m]
                level[m] = xp.maximum(level[m], abs(w.new[p, m]))
    return taken


@jit
def forget(system, piece, slope):
    """A contact without load on a piece forgets its slopes [P, n] at the end of it."""
    own = read(system)
    for p in range(slope.shape[0]):
        forget_unloaded(own, piece, slope[p])


@jit
def state_at(path, first, last, since, state):
    """Write the state at `since` seconds into the piece whose nodes are `first` to `last` of a path."""
    _interpolate(path, _node(path, first, last, since), since, state)


@jit
def wrench_slopes(system, piece, since, y, drives, slope, wrench, out, scratch):
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
        times(a, doubles(seen_by(own, c, address(y, 0))), rows)
        for i in range(3):
            wrench[c, i] = load * unit[i]
            rows[3 + i] = unit[i]
        for p in range(drives.kind.shape[0]):
            for i in range(3):
                rows[6 + i] = 0.0
                for j in range(3):
                    rows[6 + i] += a[3 * i + j] * slope[p, o + j] + g[3 * i + j] * slope[p, o + 3 + j]
            states = address(y, 0), rate, address(slope, p * y.shape[0])
            _change(own, piece, c, *states, drives.kind[p], change)
            more = load if drives.kind[p] == LOAD else 0.0
            if drives.kind[p] == NORMAL_FORCE and drives.place[p] == c:
                more = drives.weight[p, 0] + drives.weight[p, 1] * since
            for i in range(3):
                out[c, i, p] = load * rows[9 + i] + more * unit[i]
