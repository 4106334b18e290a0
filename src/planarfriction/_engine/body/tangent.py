"""Forward sensitivities of a planar body on its contacts: the variational equation along a computed motion.

With the right-hand side `f(t, y, p)` of `body.body` and its Jacobian `J`, the derivative `s = dy/dp` obeys the
linear equation `s' = J(t) s + df/dp`. It is solved by an L-stable method of order 4 with a diagonal of `gamma`: each
stage is one `factor` and, for each parameter, one `solve` of `body`,

    b_i = s + h sum_{j<i} a_ij G_j,   (I/(h gamma) - J_i) S_i = b_i/(h gamma) + df/dp,   G_i = (S_i - b_i)/(h gamma)

with `J_i` at the cubic Hermite interpolant between the accepted steps of the motion. Derivatives need fewer digits than
the motion, so that one of their steps spans several steps of the motion; the embedded method of order 3 tells how many.

Friction and size enter by scaling: with all coefficients `g` times m, a bristle behaves as `z/m` did, `zdot(z; m) =
zdot(z/m; 1)`; a patch `l` times as large sees `l omega` and gives `l tau`. So does the load of a fixed stiffness, whose
rates and wrenches per unit load are functions of `z/f`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction._engine.body.body import (
    NO_LOAD,
    SystemRecord,
    functions_of,
    hardly_loaded,
    linearisation_of,
    load_of,
    maps_of,
    read,
    record_of,
    seen_by,
)
from planarfriction._engine.body.path import Path, Stretch, Tolerances, hold, node_after
from planarfriction._engine.body.rosenbrock import forget_unloaded
from planarfriction._engine.body.sdirk import (
    GAMMA,
    PLACES,
    PLAIN,
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
from planarfriction._engine.codegen.small_matrices import applied
from planarfriction._engine.codegen.vectors import (
    Vector,
    applied_back,
    clear,
    copy,
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

FRICTION = 0
"""Parameter: factor on the friction of a contact, 1 as the scene is."""

SIZE = 1
"""Parameter: factor on the size of a contact."""

MASS = 2
"""Parameter: factor on the mass."""

INERTIA = 3
"""Parameter: factor on the moment of inertia."""

LOAD = 4
"""Parameter: factor on the loads."""

NORMAL_FORCE = 5
"""Input: load of one contact, in proportion to a weight that is linear on a piece."""

FORCE = 6
"""Input: component of the applied wrench, in proportion to such a weight."""

VELOCITY = 7
"""Input: component of the prescribed velocity, in proportion to such a weight."""

INITIAL = 8
"""Input: component of the start."""


class Drives(NamedTuple):
    """P numbers that a motion depends on, by way of U inputs: the knots of a signal all move the same."""

    kind: np.ndarray
    """`FRICTION` to `INITIAL`, int [P]."""
    place: np.ndarray
    """Contact, component of the wrench or velocity, or of velocity and pose at the start; int [P]."""
    weight: np.ndarray
    """Change of a signal per change of the number, at the start of the piece and its slope, [P, 2]."""
    input: np.ndarray
    """Input of each number, int [P]."""
    input_kind: np.ndarray
    """Kind of each input, as `kind`, int [U]."""
    input_place: np.ndarray
    """Place of each input, as `place`, int [U]."""


MOST = 8
"""Most steps of the motion in a step of derivatives, which so passes over nothing sudden."""


@kernel
def change_of(
    system: SystemRecord,
    piece: int,
    c: int,
    y: Doubles,
    dy: Doubles,
    dz: Doubles,
    parameter: int,
    dzdot: Doubles,
) -> None:
    """Write the change of the bristle rates and of the wrench per unit load of contact c, for one of a parameter.

    Pointers to all states, `y` linearised; `system.work.rows` holds V, W and dV and takes dW.
    """
    first = system.contacts.state[c]
    states = (
        at(y, first),
        at(dy, first),
        linearisation_of(system, c),
        at(dz, first),
        at(dzdot, first),
    )
    by = (1.0 if parameter == FRICTION else 0.0), (1.0 if parameter == SIZE else 0.0)
    call(
        functions_of(system, c).change,
        (record_of(system, piece, c), *states, system.work.rows, *by),
    )


@kernel
def gained_load(parameter: int, place: int, c: int, load: float) -> float:
    """Return the change of the load of contact c per change of an input."""
    if parameter == NORMAL_FORCE:
        return 1.0 if c == place else 0.0
    return load if parameter == LOAD else 0.0


@kernel
def follow_load(
    system: SystemRecord, c: int, y: Doubles, load: float, more: float, dy: Doubles
) -> None:
    """Add to the change `dy` of the bristles of contact c, if they are of a pad, the change by `more` load."""
    stiff = system.contacts.stiff[c]
    if stiff > 0.0 and load > NO_LOAD * stiff:
        for m in range(system.contacts.state[c], system.contacts.state[c + 1]):
            dy[m] -= more / load * y[m]


@kernel
def partial_of(
    system: SystemRecord,
    piece: int,
    since: float,
    w: Workspace,
    parameter: int,
    place: int,
    out: Doubles,
) -> None:
    """Write `df/dp` of an input at the state linearised last; of a prescribed velocity, `df/d slope`."""
    o = system.bristles
    inverse_mass = system.motion.inverse_mass
    clear(out, o + 6)
    if parameter == VELOCITY:
        out[o + place] = 1.0
    elif parameter == FORCE:
        out[o + place] = inverse_mass[place]
    elif parameter in (MASS, INERTIA):
        for i in range(3):
            if (i == 2) == (parameter == INERTIA) and inverse_mass[i] > 0.0:
                out[o + i] = system.motion.acceleration[3 * piece + i] - w.rate[o + i]
    elif parameter != INITIAL:
        _partial_of_contacts(system, piece, since, w, parameter, place, out)


@kernel
def _partial_of_contacts(
    system: SystemRecord,
    piece: int,
    since: float,
    w: Workspace,
    parameter: int,
    place: int,
    out: Doubles,
) -> None:
    total = (0.0, 0.0, 0.0)
    for c in range(system.size):
        if parameter != NORMAL_FORCE or c == place:
            change = wrench_by_input(
                system, piece, since, c, w.state, w, parameter, place, out
            )
            total = plus(
                total,
                system.contacts.count[c],
                applied_back(maps_of(system, c)[0], change),
            )
    for i in range(3):
        out[system.bristles + i] = system.motion.inverse_mass[i] * total[i]


@kernel
def wrench_by_input(
    system: SystemRecord, piece: int, since: float, c: int, y: Doubles, w: Workspace, parameter: int, place: int,
    out: Doubles,
) -> Vector:  # fmt: skip
    """Return the change of the wrench of contact c by an input that scales it, and write the changes of bristle rates.

    The workspace holds the state, linearised last; `w.right` is scratch.
    """
    rows = arrays_at(ROWS, system.work.rows)
    load = load_of(system, piece, since, c)
    unit = three(at(system.work.wrench, 3 * c))
    state = system.contacts.state
    more = gained_load(parameter, place, c, load)
    put(rows.d_wrench, (0.0, 0.0, 0.0))
    if parameter in (FRICTION, SIZE) or (more > 0.0 and system.contacts.stiff[c] > 0.0):
        put(rows.twist, applied(maps_of(system, c)[0], seen_by(system, c, y)))
        put(rows.wrench, unit)
        put(rows.d_twist, (0.0, 0.0, 0.0))
        clear(at(w.right, state[c]), state[c + 1] - state[c])
        follow_load(system, c, y, load, more, w.right)
        change_of(system, piece, c, y, w.rate, w.right, parameter, out)
    return plus(times(load, three(rows.d_wrench)), more, unit)


@kernel
def _share(drives: Drives, p: int, since: float) -> float:
    """Return the share of a number's change in the change of its input."""
    kind = drives.kind[p]
    if kind in (NORMAL_FORCE, FORCE):
        return drives.weight[p, 0] + drives.weight[p, 1] * since
    return (
        drives.weight[p, 1] if kind == VELOCITY else (0.0 if kind == INITIAL else 1.0)
    )


@kernel
def _step(
    address: Place,
    path: Path,
    k: int,
    last: int,
    since: float,
    h: float,
    slope: Doubles,
    drives: Drives,
    w: Workspace,
) -> None:
    """Carry `slope` over `h` seconds into `w.new`."""
    system = read(address)
    piece = path.piece[k]
    n = path.state.shape[1]
    shift = 1.0 / (h * GAMMA)
    for i in range(PLACES.shape[0]):
        time = since + h * PLACES[i]
        hold(address, path, node_after(path, k, last, time), time, shift, w)
        for u in range(drives.input_kind.shape[0]):
            partial_of(
                system,
                piece,
                time,
                w,
                drives.input_kind[u],
                drives.input_place[u],
                at(w.forcing, u * n),
            )
        for p in range(drives.kind.shape[0]):
            d = variation_of(w, slope, p, drives.input[p], n)
            forcing = at(w.forcing, drives.input[p] * n)
            stage_base(i, h, n, d, w.base)
            share = _share(drives, p, time)
            for m in range(n):
                w.right[m] = shift * w.base[m]
            if share != 0.0:
                for m in range(n):
                    w.right[m] += share * forcing[m]
            call(system.solve, (address, piece, time, w.state, shift, w.right, d.new))
            keep_stage(i, shift, n, d, w.base)


@kernel
def _error_of_step(
    address: Place, piece: int, since: float, h: float, n: int, d: Variation, known: float, tolerances: Tolerances,
    w: Workspace,
) -> float:  # fmt: skip
    """Return the error of a step that ended at `since`, where the matrix is of, per tolerance (see `sdirk.PLAIN`)."""
    system = read(address)
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
            call(
                system.solve, (address, piece, since, w.state, shift, w.right, estimate)
            )
        error = error_of(system, n, d, h, rtol, atol)
    return error


@jit
def propagate(
    address: Place, path: Path, stretch: Stretch, slope: np.ndarray, drives: Drives, tolerances: Tolerances,
    workspace: Place,
) -> int:  # fmt: skip
    """Carry `slope` [P, n] along a stretch of a path; return the number of steps.

    Each step keeps its error below the tolerances, unless it is one of the shortest.
    """
    w = read_workspace(workspace)
    n = slope.shape[1]
    slope = pointer(slope)
    last = stretch.last
    until = stretch.until
    taken = 0
    k = stretch.first
    since = stretch.begin
    while since < until:
        k = node_after(path, k, last, since)
        local = path.since[k + 1] - path.since[k]
        remaining = until - since
        reach = path.since[xp.minimum(k + MOST, last)] - since
        h = fitted(xp.minimum(w.pace[0] * local, reach), remaining)
        _step(address, path, k, last, since, h, slope, drives, w)
        taken += 1
        error = 0.0
        known = 1.0 if since > 0.0 else 0.0
        for p in range(drives.kind.shape[0]):
            d = variation_of(w, slope, p, drives.input[p], n)
            error = xp.maximum(
                error,
                _error_of_step(
                    address, path.piece[k], since + h, h, n, d, known, tolerances, w
                ),
            )
        accepted, w.pace[0] = judged(w.pace[0], error, h, local)
        if accepted:
            since = until if h == remaining else since + h
            for p in range(drives.kind.shape[0]):
                accept(n, variation_of(w, slope, p, drives.input[p], n))
    return taken


@jit
def forget(address: Place, piece: int, slope: np.ndarray) -> None:
    """Clear the slopes [P, n] of contacts without load on a piece, at its end."""
    system = read(address)
    for p in range(slope.shape[0]):
        forget_unloaded(system, piece, at(pointer(slope), p * slope.shape[1]))


@jit
def settle(address: Place, piece: int, slope: np.ndarray) -> None:
    """Clear the slopes [P, n] of contacts that start a piece with hardly any load (see `body.settle_all`)."""
    system = read(address)
    state = read(address).contacts.state
    for c in range(system.size):
        if hardly_loaded(system, piece, c):
            for p in range(slope.shape[0]):
                clear(
                    at(pointer(slope), p * slope.shape[1] + state[c]),
                    state[c + 1] - state[c],
                )


@jit
def wrench_slopes(
    address: Place, piece: int, since: float, y: np.ndarray, drives: Drives, slope: np.ndarray, wrench: np.ndarray,
    out: np.ndarray, scratch: np.ndarray,
) -> None:  # fmt: skip
    """Write wrenches [C, 3] of one of the identical contacts, and from the slopes [P, n] of y theirs, `out` [C, 3, P].

    `scratch` [3, n] needs no values.
    """
    system = read(address)
    n = y.shape[0]
    y = pointer(y)
    slope = pointer(slope)
    rate = pointer(scratch)
    rows = arrays_at(ROWS, system.work.rows)
    call(system.linearise, (address, piece, since, y, rate))
    for c in range(system.size):
        load = load_of(system, piece, since, c)
        (a, g, _) = maps_of(system, c)
        unit = three(at(system.work.wrench, 3 * c))
        first = system.contacts.state[c]
        put(rows.twist, applied(a, seen_by(system, c, y)))
        put(rows.wrench, unit)
        wrench[c, 0], wrench[c, 1], wrench[c, 2] = times(load, unit)
        for p in range(drives.kind.shape[0]):
            body = at(slope, p * n + system.bristles)
            dz = at(rate, 2 * n)
            put(rows.d_twist, plus(applied(a, body), 1.0, applied(g, at(body, 3))))
            more = gained_load(drives.kind[p], drives.place[p], c, load)
            if drives.kind[p] == NORMAL_FORCE:
                more *= drives.weight[p, 0] + drives.weight[p, 1] * since
            copy(
                at(slope, p * n + first),
                at(dz, first),
                system.contacts.state[c + 1] - first,
            )
            follow_load(system, c, y, load, more, dz)
            change_of(system, piece, c, y, rate, dz, drives.kind[p], at(rate, n))
            out[c, 0, p], out[c, 1, p], out[c, 2, p] = plus(
                times(load, three(rows.d_wrench)), more, unit
            )
