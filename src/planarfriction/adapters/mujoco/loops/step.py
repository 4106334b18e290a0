"""Friction of patches for MuJoCo's next step: what a control callback adds to the passive forces.

It runs after positions and velocities are known and before forces are, in `mj_step` as in `mj_forward`, and may run any
number of times before time moves. So the user data hold the state at the beginning of the step and that at its end;
only when the time of the data is that of the end does the second become the first.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import types

from planarfriction.adapters.mujoco.loops.geometry import place, take
from planarfriction.adapters.mujoco.loops.records import Host, read
from planarfriction.adapters.mujoco.loops.responses import is_sparse, leaves_range, respond
from planarfriction.compiler import callback, entry, jit, kernel
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler.calls import address, address_of, c_address_of, call, call_c, shared_word
from planarfriction.compiler.memory import arrays_at, at, doubles, integers, integers32
from planarfriction.kernels.coupling import step_all
from planarfriction.kernels.coupling_rows import Offsets
from planarfriction.kernels.coupling_rows import read as read_patches

PASSES = 10
"""Largest number of solutions of a step, again after it has activated other constraints."""

SHORTENINGS = 4
"""Largest number of times that the displacement to a solution is shortened before the next solution is sought."""

DOWNHILL = 0.5
"""Excess beyond the root along the displacement that is accepted, as a share of the slope at its start."""

INSTALLED, _installed = shared_word("planarfriction_mujoco")
"""Address of the `Host` whose model the callback serves, 0 without one."""


class _Own(NamedTuple):
    host: Host
    row: Offsets


@kernel
def _copy(source, target, count):
    for i in range(count):
        target[i] = source[i]


@kernel
def _clear(target, count):
    for i in range(count):
        target[i] = 0.0


@kernel
def _recall(own, d, u):
    """Bring state, guess and start of the solver to the time of the data. Whether the step is planned anew."""
    memory, n, now = own.memory, 3 * own.count, doubles(d + own.data.time)[0]
    words, warmstart = doubles(u), doubles(integers(d + own.data.qacc_warmstart)[0])
    started, again = False, now == words[memory.time] and now != words[memory.next]
    for i in range(own.nv):
        started = started or warmstart[i] != 0.0
    if again and started:
        _copy(doubles(at(u, memory.warmstart)), warmstart, own.nv)
        return again
    if now == words[memory.next] and started:
        _copy(doubles(at(u, memory.new)), doubles(at(u, memory.state)), own.states)
        _copy(doubles(at(u, memory.wrench)), doubles(at(u, memory.guess)), n)
    else:
        # other times than those of the last step, or a roll-out, which clears where the solver starts but not this
        _clear(doubles(at(u, memory.state)), own.states)
        _clear(doubles(at(u, memory.guess)), n)
    _copy(warmstart, doubles(at(u, memory.warmstart)), own.nv)
    words[memory.time] = now
    return again


@kernel
def _take_off(own, d, u, again):
    """Keep the passive forces without friction: with it, they are still there where velocities were not updated."""
    memory, passive = own.memory, doubles(integers(d + own.data.qfrc_passive)[0])
    base, total = doubles(at(u, memory.passive)), doubles(at(u, memory.total))
    same = again
    for i in range(own.nv):
        same = same and passive[i] == total[i]
    if same:
        _copy(base, passive, own.nv)
    else:
        _copy(passive, base, own.nv)


@kernel
def _apply(own, d, u, s, w):
    """Add wrenches to the passive forces."""
    nv, memory, passive = own.nv, own.memory, doubles(integers(d + own.data.qfrc_passive)[0])
    jacobian, total = doubles(s.jacobian), doubles(at(u, memory.total))
    _copy(doubles(at(u, memory.passive)), passive, nv)
    for r in range(3 * own.count):
        if w[r] != 0.0:
            for i in range(nv):
                passive[i] += w[r] * jacobian[nv * r + i]
    _copy(passive, total, nv)


@kernel
def _accelerate(own, m, d):
    call_c(own.functions.mj_fwdAcceleration, (m, d))
    call_c(own.functions.mj_fwdConstraint, (m, d))


@kernel
def _add(own, d, s, problem):
    """Write the acceleration that the change of wrenches adds, and the start of the solver's next run."""
    host, n = own.host, 3 * own.host.count
    more, answers = doubles(s.more), doubles(s.answers)
    acceleration = doubles(integers(d + host.data.qacc)[0])
    warmstart = doubles(integers(d + host.data.qacc_warmstart)[0])
    for i in range(host.nv):
        more[i] = 0.0
        for r in range(n):
            change = problem[own.row.wrench + r] - problem[own.row.guess + r]
            more[i] += answers[(n + 1) * i + r] * change
        warmstart[i] = acceleration[i] + more[i]


@kernel
def _slope(own, patches, s):
    """Return `move . (w(V, N) - W)` at the twists, loads and wrenches of the host: positive before the root, then
    negative."""
    problem, row, n = doubles(s.problem), own.row, 3 * own.host.count
    _copy(doubles(at(s.problem, row.free_twist)), doubles(at(s.problem, row.twist)), n)
    _copy(doubles(at(s.problem, row.free_load)), doubles(at(s.problem, row.load)), own.host.count)
    step_all(patches, arrays_at(patches.row, s.problem))
    total = 0.0
    for i in range(n):
        gap = problem[row.load + i // 3] * problem[row.unit + i] - problem[row.guess + i]
        total += doubles(s.move)[i] * gap
    return total


@kernel
def _set_out(own, s):
    """Keep the way to the solution, and begin the next from there."""
    problem, row = doubles(s.problem), own.row
    for i in range(3 * own.host.count):
        doubles(s.start)[i], doubles(s.goal)[i] = problem[row.guess + i], problem[row.wrench + i]
        doubles(s.move)[i] = problem[row.twist + i] - problem[row.free_twist + i]


@kernel
def _begin(own, s, far):
    """Write the next guess: this share of the displacement."""
    for i in range(3 * own.host.count):
        begin, end = doubles(s.start)[i], doubles(s.goal)[i]
        guess = end if far == 1.0 else begin + far * (end - begin)
        doubles(s.problem)[own.row.guess + i] = guess
        doubles(s.problem)[own.row.wrench + i] = guess


@kernel
def _solve(own, m, d, u, s, nefc):
    """Solve for wrenches that fit the step, into the problem and the passive forces; return iterations and passes."""
    host, row, sparse, patches = own.host, own.row, is_sparse(own.host, m), read_patches(own.host.patches)
    problem, n = doubles(s.problem), 3 * own.host.count
    iterations, passes, shortenings, first, far = 0.0, 0, 0, 0.0, 1.0
    while True:
        respond(own, m, d, s, sparse, nefc)
        if passes > 0 and shortenings < SHORTENINGS:
            here = _slope(own, patches, s)
            if here < -DOWNHILL * first:
                far *= xp.minimum(xp.maximum(first / (first - here), 0.1), 0.7)
                shortenings += 1
                _begin(own, s, far)
                _apply(host, d, u, s, doubles(at(s.problem, row.guess)))
                _accelerate(host, m, d)
                continue
        call(host.solve, (host.patches, s.problem))
        passes += 1
        if problem[row.iterations] < 0.0:
            _clear(doubles(at(s.problem, row.wrench)), n)
            _apply(host, d, u, s, doubles(at(s.problem, row.wrench)))
            return problem[row.iterations], passes
        iterations += problem[row.iterations]
        _add(own, d, s, problem)
        _apply(host, d, u, s, doubles(at(s.problem, row.wrench)))
        if passes >= PASSES or not leaves_range(host, m, d, s, sparse, nefc):
            break
        _set_out(own, s)
        first, shortenings, far = _slope(own, patches, s), 0, 1.0
        _begin(own, s, far)
        _accelerate(host, m, d)
    return iterations, passes


@kernel
def _forget(host, d, u):
    """Clear the memory: no patch is in contact."""
    memory, k = host.memory, host.count
    _clear(doubles(at(u, memory.new)), host.states)
    _clear(doubles(at(u, memory.wrench)), 3 * k)
    _clear(doubles(at(u, memory.twist)), 3 * k)
    _clear(doubles(at(u, memory.load)), k)
    passive = doubles(integers(d + host.data.qfrc_passive)[0])
    _copy(passive, doubles(at(u, memory.total)), host.nv)
    words = doubles(u)
    words[memory.iterations], words[memory.passes], words[memory.residual], words[memory.converged] = 0.0, 0.0, 0.0, 1.0


@kernel
def _remember(own, u, s, iterations, passes):
    """Store the result of the step in the user data."""
    host, row, memory, words = own.host, own.row, own.host.memory, doubles(u)
    problem, n, valid = doubles(s.problem), 3 * own.host.count, iterations >= 0.0
    _copy(doubles(at(s.problem, row.wrench)), doubles(at(u, memory.wrench)), n)
    if valid:
        _copy(doubles(at(s.problem, row.new)), doubles(at(u, memory.new)), host.states)
        _copy(doubles(at(s.problem, row.twist)), doubles(at(u, memory.twist)), n)
        _copy(doubles(at(s.problem, row.load)), doubles(at(u, memory.load)), host.count)
    else:
        _clear(doubles(at(u, memory.new)), host.states)
    words[memory.iterations], words[memory.passes] = iterations, passes
    words[memory.residual], words[memory.converged] = problem[row.residual], problem[row.converged] if valid else 0.0


@entry
def plan(place_of_host, m, d):
    """Add friction to the passive forces of the data d, for the step from where they are."""
    host = read(place_of_host)
    own = _Own(host, read_patches(host.patches).row)
    u, nefc = integers(d + host.data.userdata)[0], integers32(d + host.data.nefc)[0]
    again = _recall(host, d, u)
    _take_off(host, d, u, again)
    doubles(u)[host.memory.next] = doubles(d + host.data.time)[0] + doubles(m + host.model.timestep)[0]
    call_c(host.functions.mj_markStack, (d,))
    s = take(host, d, nefc)
    if place(host, m, d, s, nefc) == 0:
        _forget(host, d, u)
    else:
        problem, n = doubles(s.problem), 3 * host.count
        _copy(doubles(host.problem), problem, host.words)
        problem[own.row.dt] = doubles(m + host.model.timestep)[0]
        _copy(doubles(at(u, host.memory.state)), doubles(at(s.problem, own.row.state)), host.states)
        guess = doubles(at(s.problem, own.row.guess))
        for i in range(n):
            guess[i] = doubles(u)[host.memory.guess + i] if integers(s.counts)[i // 3] > 0 else 0.0
        _copy(guess, doubles(at(s.problem, own.row.wrench)), n)
        _apply(host, d, u, s, guess)
        call_c(host.functions.mj_fwdActuation, (m, d))
        _accelerate(host, m, d)
        iterations, passes = _solve(own, m, d, u, s, nefc)
        _remember(own, u, s, iterations, passes)
    call_c(host.functions.mj_freeStack, (d,))


@callback
def control(m, d):
    """Plan, as `mjcb_control`, the steps of the installed model and of its copies."""
    place_of_host = _installed()
    if place_of_host == 0:
        return
    host = read(place_of_host)
    nv, nuserdata = integers32(m + host.model.nv)[0], integers32(m + host.model.nuserdata)[0]
    if nv == host.nv and nuserdata == host.nuserdata:
        call(host.plan, (place_of_host, m, d))


@jit
def plan_step(host, m, d):
    """Call `plan` from Python with the row of a `Host` and the addresses of model and data."""
    call(read(host).plan, (address(host, 0), m, d))


def plan_address() -> int:
    """Return the address of `plan` in this process."""
    return address_of(plan, "ppp")


def control_address() -> int:
    """Return the address at which C code calls `control`."""
    return c_address_of(control, 2)


def compile_ahead() -> None:
    """Compile what steps inside MuJoCo take."""
    plan_address(), control_address()
    plan_step.compile((types.float64[::1], types.int64, types.int64))
