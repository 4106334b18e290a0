"""Response of MuJoCo Warp's step to wrenches on patches, for a fixed set of active constraints, as kernels.

As in MuJoCo's adapter, in double precision, as stiff contacts next to inertia need, and with accelerations that are
exact for these constraints: `H a = f + Jp' W_0 + Jc' (D a_ref + c)`. One thread a world, unless it is `done`.
"""

# No `from __future__ import annotations` here: Warp reads the types themselves.

import mujoco
import warp as wp

from planarfriction._engine.coupled import placing
from planarfriction.adapters.mujoco_warp.loops.geometry import (
    ContactSolveArrays,
    Frames,
    Host,
    PatchArrays,
    Places,
)

EQUALITY = wp.constant(int(mujoco.mjtConstraint.mjCNSTR_EQUALITY))
DOF_LOSS = wp.constant(int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF))
TENDON_LOSS = wp.constant(int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON))

SLACK = wp.constant(1e-6)
"""Speed [m/s] by which a constraint may leave its range without a new solution: single precision knows no less."""


@wp.struct
class Scratch:
    """Arrays that the kernels of a step hand on."""

    done: wp.array(dtype=int)
    active: wp.array2d(dtype=int)
    """0: no force, 1: force that follows the acceleration, 2, 3: at the friction loss, positive or negative."""
    stiff: wp.array3d(dtype=wp.float64)
    answers: wp.array3d(dtype=wp.float64)
    """H^-1 J' and, last, the acceleration under the guess [E, nv, 3k + 1]."""
    gains: wp.array3d(dtype=wp.float64)
    """Velocities per dt that the integrator gains from these."""
    acceleration: wp.array2d(dtype=wp.float64)
    pressed: wp.array2d(dtype=wp.vec2)
    """Centres of pressure of the first pass, which is held [E, k]."""
    rounds: wp.array(dtype=int)
    passes: wp.array(dtype=int)


@wp.func
def count_of(host: Host, w: int, r: int, nv: int) -> int:
    """Return the count of numbers in a row of the constraints' Jacobian."""
    if host.sparse != 0:
        return host.nnz[w, r]
    return nv


@wp.func
def column_of(host: Host, w: int, r: int, i: int) -> int:
    """Return the column of a number in a row."""
    if host.sparse != 0:
        return host.column[w, 0, host.first[w, r] + i]
    return i


@wp.func
def number_of(host: Host, w: int, r: int, i: int) -> wp.float64:
    """Return a number in a row."""
    if host.sparse != 0:
        return wp.float64(host.jacobian[w, 0, host.first[w, r] + i])
    return wp.float64(host.jacobian[w, r, i])


@wp.func
def gap_of(
    host: Host, acceleration: wp.array2d(dtype=wp.float64), w: int, r: int
) -> wp.float64:
    """Return the excess of the acceleration of a row over the one at which it has no force."""
    total = -wp.float64(host.aref[w, r])
    for i in range(count_of(host, w, r, acceleration.shape[1])):
        total += number_of(host, w, r, i) * acceleration[w, column_of(host, w, r, i)]
    return total


@wp.func
def range_of(kind: int, force: wp.float64, loss: wp.float64) -> int:
    """Return the range of a row with a force."""
    if kind == EQUALITY:
        return 1
    if kind == DOF_LOSS or kind == TENDON_LOSS:
        if force >= loss:
            return 2
        if force <= -loss:
            return 3
        return 1
    if force > wp.float64(0.0):
        return 1
    return 0


@wp.func
def write_inertia(
    host: Host,
    numbers: wp.array2d(dtype=float),
    w: int,
    out: wp.array3d(dtype=wp.float64),
):
    nv = out.shape[1]
    for i in range(nv):
        for j in range(nv):
            out[w, i, j] = wp.float64(0.0)
    for i in range(nv):
        for n in range(host.inertia_nnz[i]):
            at = host.inertia_first[i] + n
            j = host.inertia_column[at]
            out[w, i, j] = wp.float64(numbers[w, at])
            out[w, j, i] = wp.float64(numbers[w, at])


@wp.func
def solve(h: wp.array3d(dtype=wp.float64), w: int, x: wp.array3d(dtype=wp.float64)):
    """Solve `h x' = x` for all columns in place, by factors `L' L`; h is lost.

    The last degrees of freedom come first: they are the leaves of trees, and zeros between branches stay.
    """
    nv = h.shape[1]
    columns = x.shape[2]
    zero = wp.float64(0.0)
    for m in range(nv):
        k = nv - 1 - m
        root = wp.sqrt(wp.max(h[w, k, k], wp.float64(1e-30)))
        h[w, k, k] = root
        for c in range(columns):
            x[w, k, c] = x[w, k, c] / root
        for i in range(k):
            share = h[w, k, i] / root
            h[w, k, i] = share
            if share != zero:
                for j in range(i + 1):
                    h[w, i, j] = h[w, i, j] - share * h[w, k, j]
                for c in range(columns):
                    x[w, i, c] = x[w, i, c] - share * x[w, k, c]
    for k in range(nv):
        for i in range(k):
            share = h[w, k, i]
            if share != zero:
                for c in range(columns):
                    x[w, k, c] = x[w, k, c] - share * x[w, i, c]
        for c in range(columns):
            x[w, k, c] = x[w, k, c] / h[w, k, k]


@wp.func
def accelerate(host: Host, frames: Frames, s: Scratch, w: int, nefc: int):
    """Write the answers of accelerations to wrenches, and the acceleration under the guess."""
    nv = s.stiff.shape[1]
    last = s.answers.shape[2] - 1
    write_inertia(host, host.inertia, w, s.stiff)
    for i in range(nv):
        for c in range(last):
            s.answers[w, i, c] = wp.float64(frames.jacobian[w, c, i])
        s.answers[w, i, last] = wp.float64(host.smooth[w, i])
    for r in range(nefc):
        kind = s.active[w, r]
        if kind == 0:
            continue
        count = count_of(host, w, r, nv)
        weight = wp.float64(host.stiffness[w, r])
        pushed = weight * wp.float64(host.aref[w, r])
        if kind == 2:
            pushed = wp.float64(host.loss[w, r])
        if kind == 3:
            pushed = -wp.float64(host.loss[w, r])
        for n in range(count):
            i = column_of(host, w, r, n)
            one = number_of(host, w, r, n)
            s.answers[w, i, last] = s.answers[w, i, last] + one * pushed
            if kind == 1 and one != wp.float64(0.0):
                for m in range(count):
                    j = column_of(host, w, r, m)
                    s.stiff[w, i, j] = s.stiff[w, i, j] + weight * one * number_of(
                        host, w, r, m
                    )
    solve(s.stiff, w, s.answers)


@wp.func
def gain(host: Host, s: Scratch, w: int, dt: wp.float64):
    """Write what the integrator makes of these accelerations: `Mh^-1 M a` with its own metric."""
    nv = s.stiff.shape[1]
    for i in range(nv):
        for c in range(s.answers.shape[2]):
            s.gains[w, i, c] = s.answers[w, i, c]
    if host.implicit == 0:
        return
    write_inertia(host, host.inertia, w, s.stiff)
    for c in range(s.answers.shape[2]):
        for i in range(nv):
            total = wp.float64(0.0)
            for j in range(nv):
                total += s.stiff[w, i, j] * s.answers[w, j, c]
            s.gains[w, i, c] = total
    if host.implicit == 2:
        write_inertia(host, host.metric, w, s.stiff)
    else:
        for i in range(nv):
            s.stiff[w, i, i] = s.stiff[w, i, i] + dt * wp.float64(
                host.damping[w % host.damping.shape[0], i]
            )
    solve(s.stiff, w, s.gains)


@wp.func
def write_twists(
    host: Host,
    frames: Frames,
    s: Scratch,
    out: ContactSolveArrays,
    w: int,
    n: int,
    dt: wp.float64,
):
    """Write the twists at the end of the step and their response."""
    for c in range(n):
        v = wp.float64(frames.drift[w, c / 3][c % 3])
        for e in range(n):
            out.response[w, c, e] = 0.0
        for i in range(s.stiff.shape[1]):
            share = wp.float64(frames.jacobian[w, c, i])
            if share != wp.float64(0.0):
                v += share * (wp.float64(host.qvel[w, i]) + dt * s.gains[w, i, n])
                for e in range(n):
                    out.response[w, c, e] = out.response[w, c, e] + float(
                        dt * share * s.gains[w, i, e]
                    )
        out.twist[w, c / 3, c % 3] = float(v)


@wp.func
def write_loads(
    patches: PatchArrays,
    host: Host,
    frames: Frames,
    s: Scratch,
    out: ContactSolveArrays,
    w: int,
    nefc: int,
    first_pass: int,
):
    """Write the loads at the end of the step, their response, and their moments as the first pass finds them."""
    n = 3 * patches.count
    for p in range(patches.count):
        load = wp.float64(0.0)
        moments = wp.vec2()
        for e in range(n):
            out.load_response[w, p, e] = 0.0
        for r in range(nefc):
            if frames.owner[w, r] == p and s.active[w, r] == 1:
                weight = wp.float64(host.stiffness[w, r])
                force = -weight * gap_of(host, s.acceleration, w, r)
                load = load + force
                moments = moments + float(force) * frames.lever[w, r]
                for i in range(count_of(host, w, r, s.stiff.shape[1])):
                    share = weight * number_of(host, w, r, i)
                    if share != wp.float64(0.0):
                        j = column_of(host, w, r, i)
                        for e in range(n):
                            out.load_response[w, p, e] = out.load_response[
                                w, p, e
                            ] - float(share * s.answers[w, j, e])
        out.load[w, p] = wp.max(float(load), 0.0)
        if first_pass != 0:
            s.pressed[w, p] = wp.vec2()
            if load > wp.float64(0.0):
                s.pressed[w, p] = moments / float(load)
        out.moments[w, p, 0] = s.pressed[w, p][1] * out.load[w, p]
        out.moments[w, p, 1] = -s.pressed[w, p][0] * out.load[w, p]


@wp.kernel(enable_backward=False)
def respond(
    patches: PatchArrays,
    host: Host,
    frames: Frames,
    s: Scratch,
    out: ContactSolveArrays,
    first_pass: int,
):
    """Write twists, loads and their responses; first with the constraints that MuJoCo's solver has found."""
    w = wp.tid()
    nefc = wp.min(host.nefc[w], frames.owner.shape[1])
    if first_pass != 0:
        touching = int(0)
        for p in range(patches.count):
            touching += frames.touching[w, p]
        s.done[w] = wp.where(touching == 0, 1, 0)
        s.passes[w] = 0
        s.rounds[w] = 0
        for r in range(nefc):
            s.active[w, r] = range_of(
                host.type[w, r],
                wp.float64(host.force[w, r]),
                wp.float64(host.loss[w, r]),
            )
    if s.done[w] != 0:
        return
    dt = wp.float64(host.timestep[w % host.timestep.shape[0]])
    accelerate(host, frames, s, w, nefc)
    gain(host, s, w, dt)
    n = 3 * patches.count
    for i in range(s.stiff.shape[1]):
        s.acceleration[w, i] = s.answers[w, i, n]
    write_twists(host, frames, s, out, w, n, dt)
    write_loads(patches, host, frames, s, out, w, nefc, first_pass)


@wp.kernel(enable_backward=False)
def settle(
    host: Host,
    frames: Frames,
    s: Scratch,
    problem: ContactSolveArrays,
    wrench: wp.array3d(dtype=float),
    rounds: wp.array(dtype=int),
):
    """Find the acceleration under the wrenches; a world is done if no constraint leaves its range by it."""
    w = wp.tid()
    if s.done[w] != 0:
        return
    s.passes[w] = s.passes[w] + 1
    s.rounds[w] = s.rounds[w] + rounds[w]
    last = s.answers.shape[2] - 1
    for i in range(s.answers.shape[1]):
        total = s.answers[w, i, last]
        for c in range(last):
            change = wrench[w, c / 3, c % 3] - problem.guess[w, c / 3, c % 3]
            total += s.answers[w, i, c] * wp.float64(change)
        s.acceleration[w, i] = total
    s.done[w] = 1
    dt = wp.float64(host.timestep[w % host.timestep.shape[0]])
    for r in range(wp.min(host.nefc[w], frames.owner.shape[1])):
        gap = gap_of(host, s.acceleration, w, r)
        loss = wp.float64(host.loss[w, r])
        weight = wp.float64(host.stiffness[w, r])
        now = range_of(host.type[w, r], -weight * gap, loss)
        if now != s.active[w, r]:
            s.active[w, r] = now
            if dt * wp.abs(wp.abs(gap) - loss / weight) > wp.float64(SLACK):
                s.done[w] = 0


@wp.kernel(enable_backward=False)
def remember(
    patches: PatchArrays,
    at: Places,
    host: Host,
    frames: Frames,
    s: Scratch,
    problem: ContactSolveArrays,
    state: wp.array2d(dtype=float),
    wrench: wp.array3d(dtype=float),
    twist: wp.array3d(dtype=float),
    load: wp.array2d(dtype=float),
    residual: wp.array(dtype=float),
    converged: wp.array(dtype=int),
    memory: wp.array2d(dtype=float),
):
    """Write the result of the step into the memory, the passive forces and the start of the solver."""
    w = wp.tid()
    touches = s.passes[w] > 0
    misplaced = int(0)
    for i in range(patches.states):
        memory[w, at.after + i] = wp.where(touches, state[w, i], 0.0)
    for p in range(patches.count):
        if frames.fault[w, p] != 0:
            misplaced = wp.static(placing.FAULTS) * p + frames.fault[w, p]
        memory[w, at.load + p] = wp.where(touches, load[w, p], 0.0)
        for i in range(3):
            place = 3 * p + i
            memory[w, at.centre + place] = frames.centre[w, p][i]
            memory[w, at.axis + place] = frames.axis[w, p][i]
            memory[w, at.wrench + place] = wp.where(touches, wrench[w, p, i], 0.0)
            memory[w, at.twist + place] = wp.where(touches, twist[w, p, i], 0.0)
            if touches:
                change = wrench[w, p, i] - problem.guess[w, p, i]
                for j in range(host.passive.shape[1]):
                    host.passive[w, j] = (
                        host.passive[w, j] + frames.jacobian[w, place, j] * change
                    )
    if touches:
        for j in range(host.passive.shape[1]):
            host.warmstart[w, j] = float(s.acceleration[w, j])
    memory[w, at.misplaced] = float(misplaced)
    memory[w, at.iterations] = float(s.rounds[w])
    memory[w, at.passes] = float(s.passes[w])
    memory[w, at.residual] = wp.where(touches, residual[w], 0.0)
    memory[w, at.converged] = wp.where(touches, float(converged[w]), 1.0)
