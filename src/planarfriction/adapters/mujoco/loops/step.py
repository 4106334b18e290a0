"""Friction of patches for MuJoCo's next step: what a control callback adds to the passive forces.

It runs after positions and velocities are known and before forces are, in `mj_step` as in `mj_forward`, and may run any
number of times before time moves. So the user data hold the state at the beginning of the step and that at its end;
only when the time of the data is that of the end does the second become the first.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import types

from planarfriction._engine.codegen.vectors import clear, copy
from planarfriction._engine.compiler import callback, entry, jit, kernel
from planarfriction._engine.compiler.calls import (
    address_of,
    c_address_of,
    call,
    call_c,
    shared_word,
)
from planarfriction._engine.compiler.memory import (
    Place,
    arrays_at,
    at,
    doubles,
    integers,
    integers32,
)
from planarfriction._engine.coupled.coupling import shortening_of, too_far
from planarfriction._engine.coupled.coupling_rows import ContactSolve
from planarfriction._engine.coupled.coupling_rows import read as read_patches
from planarfriction._engine.coupled.coupling_steps import step_all
from planarfriction._engine.coupled.face import add_faces
from planarfriction._engine.coupled.following import hold
from planarfriction.adapters.mujoco.loops.centres import follow_centres
from planarfriction.adapters.mujoco.loops.geometry import place
from planarfriction.adapters.mujoco.loops.models import (
    displacement_of,
    fits,
    scale_of,
    serves,
    write_laws,
)
from planarfriction.adapters.mujoco.loops.records import Host, Remembered, Scratch, read
from planarfriction.adapters.mujoco.loops.responses import (
    is_sparse,
    leaves_range,
    respond,
)

PASSES = 30
"""Largest number of solutions of a step, again after it has activated other constraints."""

SHORTENINGS = 4
"""Largest number of times that the displacement to a solution is shortened before the next solution is sought."""

UNFIT = -2.0
"""Number of iterations of a step that options do not allow: it has no friction."""

INSTALLED, _installed = shared_word("planarfriction_mujoco")
"""Address of the `Host` whose model the callback serves, 0 without one."""


class _Own(NamedTuple):
    host: Host
    problem: ContactSolve
    scratch: Scratch
    kept: Remembered


@kernel
def _recall(host, kept, d):
    """Bring state, guess and start of the solver to the time of the data; return True if the step is planned anew."""
    now = doubles(d + host.data.time)[0]
    warmstart = doubles(integers(d + host.data.qacc_warmstart)[0])
    started = False
    again = now == kept.time[0] and now != kept.next[0]
    for i in range(host.nv):
        started = started or warmstart[i] != 0.0
    if again and started:
        copy(kept.warmstart, warmstart, host.nv)
        return again
    if now == kept.next[0] and started:
        copy(kept.axis, kept.before, host.states + 9 * host.count)
    else:
        # other times than those of the last step, or a rollout, which clears where the solver starts but not this
        clear(kept.before, host.states + 9 * host.count)
    copy(warmstart, kept.warmstart, host.nv)
    kept.time[0] = now
    return again


@kernel
def _take_off(host, kept, d, again):
    """Keep the passive forces without friction: with it, they are still there where velocities were not updated."""
    passive = doubles(integers(d + host.data.qfrc_passive)[0])
    same = again
    for i in range(host.nv):
        same = same and passive[i] == kept.total[i]
    if same:
        copy(kept.passive, passive, host.nv)
    else:
        copy(passive, kept.passive, host.nv)


@kernel
def _apply(own, d, w):
    """Add wrenches to the passive forces."""
    nv = own.host.nv
    kept = own.kept
    passive = doubles(integers(d + own.host.data.qfrc_passive)[0])
    copy(kept.passive, passive, nv)
    for r in range(3 * own.host.count):
        if w[r] != 0.0:
            for i in range(nv):
                passive[i] += w[r] * own.scratch.jacobian[nv * r + i]
    copy(passive, kept.total, nv)


@kernel
def _accelerate(host, m, d):
    call_c(host.functions.mj_fwdAcceleration, (m, d))
    call_c(host.functions.mj_fwdConstraint, (m, d))


@kernel
def _add(own, d):
    """Write the acceleration that the change of wrenches adds, and the start of the solver's next run."""
    host = own.host
    n = 3 * own.host.count
    problem = own.problem
    more = own.scratch.more
    acceleration = doubles(integers(d + host.data.qacc)[0])
    warmstart = doubles(integers(d + host.data.qacc_warmstart)[0])
    for i in range(host.nv):
        more[i] = 0.0
        for r in range(n):
            more[i] += own.scratch.answers[(n + 1) * i + r] * (
                problem.wrench[r] - problem.guess[r]
            )
        warmstart[i] = acceleration[i] + more[i]


@kernel
def _slope(own, patches):
    """Return `move . (w(V, N) - W)` at the host's twists, loads and wrenches: positive before the root only."""
    problem = own.problem
    n = 3 * own.host.count
    copy(problem.free_twist, problem.twist, n)
    add_faces(patches, problem, problem.guess, problem.twist)
    copy(problem.free_load, problem.load, own.host.count)
    step_all(patches, problem)
    total = 0.0
    for i in range(n):
        total += own.scratch.move[i] * (
            problem.load[i // 3] * problem.unit[i] - problem.guess[i]
        )
    return total


@kernel
def _set_out(own):
    """Keep the way to the solution, and begin the next from there."""
    problem = own.problem
    s = own.scratch
    for i in range(3 * own.host.count):
        s.start[i] = problem.guess[i]
        s.goal[i] = problem.wrench[i]
        s.move[i] = problem.twist[i] - problem.free_twist[i]


@kernel
def _begin(own, far):
    """Write the next guess: this share of the displacement."""
    for i in range(3 * own.host.count):
        begin = own.scratch.start[i]
        end = own.scratch.goal[i]
        guess = end if far == 1.0 else begin + far * (end - begin)
        own.problem.guess[i] = guess
        own.problem.wrench[i] = guess


@kernel
def _solve(own, patches, m, d, nefc):
    """Solve for wrenches that fit the step, into the problem and the passive forces.

    Return iterations, passes, and True if all constraints stay in the ranges for which the last pass solved.
    """
    host = own.host
    problem = own.problem
    sparse = is_sparse(own.host, m)
    iterations = 0.0
    passes = 0
    shortenings = 0
    first = 0.0
    far = 1.0
    while True:
        respond(own, m, d, sparse, nefc)
        if passes > 0 and shortenings < SHORTENINGS:
            here = _slope(own, patches)
            if too_far(first, here):
                far *= shortening_of(first, here)
                shortenings += 1
                _begin(own, far)
                _apply(own, d, problem.guess)
                _accelerate(host, m, d)
                continue
        call(host.solve, (host.patches, own.scratch.problem))
        hold(patches, problem)
        passes += 1
        if problem.iterations[0] < 0.0:
            clear(problem.wrench, 3 * host.count)
            _apply(own, d, problem.wrench)
            return problem.iterations[0], passes, False
        iterations += problem.iterations[0]
        _add(own, d)
        _apply(own, d, problem.wrench)
        settled = not leaves_range(host, m, d, own.scratch, sparse, nefc)
        if settled or passes >= PASSES:
            return iterations, passes, settled
        _set_out(own)
        first = _slope(own, patches)
        shortenings = 0
        far = 1.0
        _begin(own, far)
        _accelerate(host, m, d)


@kernel
def _forget(host, kept, d):
    """Clear the memory: no patch is in contact, or none can have friction."""
    # And wrenches, origins, twists and loads behind the state.
    clear(kept.after, host.states + 10 * host.count)
    copy(doubles(integers(d + host.data.qfrc_passive)[0]), kept.total, host.nv)
    kept.iterations[0] = 0.0
    kept.passes[0] = 0.0
    kept.residual[0] = 0.0
    kept.converged[0] = 1.0
    kept.misplaced[0] = 0.0


@kernel
def _remember(own, m, iterations, passes, settled):
    """Store the result of the step in the user data."""
    host = own.host
    kept = own.kept
    problem = own.problem
    valid = iterations >= 0.0
    copy(problem.wrench, kept.wrench, 3 * host.count)
    for p in range(host.count):
        kept.wrench[3 * p + 2] *= scale_of(host, m, p)
    if valid:
        copy(problem.new, kept.after, host.states)
        copy(problem.twist, kept.twist, 3 * host.count)
        copy(problem.load, kept.load, host.count)
        for p in range(host.count):
            kept.twist[3 * p + 2] /= scale_of(host, m, p)
    else:
        clear(kept.after, host.states)
    kept.iterations[0] = iterations
    kept.passes[0] = passes
    kept.residual[0] = problem.residual[0]
    kept.converged[0] = problem.converged[0] if settled else 0.0


@kernel
def _carry(s, p, vectors, count):
    """Write vectors of patch p, all x before all y, in its axes of this step instead of the last ones."""
    c = s.carried[2 * p]
    sine = s.carried[2 * p + 1]
    for i in range(count):
        x = vectors[i]
        y = vectors[count + i]
        vectors[i] = c * x + sine * y
        vectors[count + i] = c * y - sine * x


@kernel
def _put_guess(host, m, p, s, kept, guess):
    """Write the last wrench of patch p about its origin before it is displaced; zero without contact."""
    dx, dy = displacement_of(host, m, p)
    for i in range(3):
        guess[i] = kept[i] if s.counts[p] > 0 else 0.0
    _carry(s, p, guess, 1)
    guess[2] += dx * guess[1] - dy * guess[0]


@entry
def plan(place_of_host: Place, m: Place, d: Place) -> None:
    """Add friction to the passive forces of the data d, for the step from where they are."""
    host = read(place_of_host)
    patches = read_patches(host.patches)
    kept = arrays_at(host.memory, integers(d + host.data.userdata)[0])
    nefc = integers32(d + host.data.nefc)[0]
    dt = doubles(m + host.model.timestep)[0]
    _take_off(host, kept, d, _recall(host, kept, d))
    kept.next[0] = doubles(d + host.data.time)[0] + dt
    call_c(host.functions.mj_markStack, (d,))
    taken = call_c(host.functions.mj_stackAllocNum, (d, host.scratch_words + 4 * nefc))
    s = arrays_at(host.scratch, taken)
    if not fits(host, m):
        _forget(host, kept, d)
        kept.iterations[0] = UNFIT
        kept.converged[0] = 0.0
    elif place(host, m, d, s, nefc, kept) == 0:
        _forget(host, kept, d)
    else:
        problem = arrays_at(patches.row, s.problem)
        own = _Own(host, problem, s, kept)
        copy(doubles(host.problem), s.problem, host.words)
        problem.dt[0] = dt
        copy(kept.state, problem.state, host.states)
        write_laws(host, m, patches, problem, at(taken, host.scratch.records))
        for p in range(host.count):
            first = patches.firsts[p]
            bent = at(problem.state, first)
            states = patches.firsts[p + 1] - first
            if patches.lag[p] > 0.0:
                states -= 3
                _carry(s, p, at(bent, states), 1)
            _carry(s, p, bent, states // patches.bristle[p])
            _put_guess(host, m, p, s, at(kept.guess, 3 * p), at(problem.guess, 3 * p))
        copy(problem.guess, problem.wrench, 3 * host.count)
        _apply(own, d, problem.guess)
        call_c(host.functions.mj_fwdActuation, (m, d))
        _accelerate(host, m, d)
        follow_centres(host, m, d, s, nefc, patches.radius, problem, kept)
        copy(problem.guess, problem.wrench, 3 * host.count)
        iterations, passes, settled = _solve(own, patches, m, d, nefc)
        _remember(own, m, iterations, passes, settled)
    call_c(host.functions.mj_freeStack, (d,))


@callback
def control(m, d):
    """Plan, as `mjcb_control`, the steps of the installed model and of its copies."""
    place_of_host = _installed()
    if place_of_host == 0:
        return
    host = read(place_of_host)
    if serves(host, m):
        call(host.plan, (place_of_host, m, d))


@jit
def plan_step(host, m, d):
    """Call `plan` from Python with the addresses of a `Host`, of model and data.

    Return False if the step has something to say: it has no friction, or a patch is misplaced.
    """
    own = read(host)
    call(own.plan, (host, m, d))
    kept = arrays_at(own.memory, integers(d + own.data.userdata)[0])
    return kept.iterations[0] >= 0.0 and kept.misplaced[0] == 0.0


@jit
def is_served(host, m):
    """Return True if the `Host` at an address serves the model at another."""
    return serves(read(host), m)


def control_address() -> int:
    """Return the address at which C code calls `control`."""
    return c_address_of(control, 2)


def compile_ahead() -> None:
    """Compile what steps inside MuJoCo take."""
    address_of(plan), control_address()
    plan_step.compile((types.int64, types.int64, types.int64))
    is_served.compile((types.int64, types.int64))
