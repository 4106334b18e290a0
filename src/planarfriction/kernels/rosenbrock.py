"""Rosenbrock methods on the structured body system: adaptive steps, exact stops at breaks, dense output."""

from __future__ import annotations

import math

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.kernels.body import load_of, place_at, read, times
from planarfriction.kernels.contacts import contact_map
from planarfriction.kernels.integration import read_run
from planarfriction.kernels.pointers import at, call, doubles, integers

DONE, PAUSED, STEP_TOO_SMALL, AT_REST = 0, 1, 2, 3
"""Outcomes of `advance`."""

STEPS, REJECTIONS, EVALUATIONS, JACOBIANS = 0, 1, 2, 3
"""Rows of the statistics."""

# Step control. A decaying transient is followed through all its scales only if the steps do not grow too fast: a
# factor of 2.5 needs 8 % fewer steps than 6 for the same error of the in-hand runs.
_SAFETY, _GROWTH, _SHRINKAGE = 0.8, 2.5, 0.1

# Friction goes by the direction of a contact's twist. While a patch comes to a halt that direction may sweep across a
# pad, which holds the patch as soon as it is all that stands still, and a step from one side of it to the other has a
# small error estimate. So steps that turn a twist by more than an angle [rad], about half of what such a pad takes, are
# looked into: once an angle, at most some times, and what is missing there is taken for an error in excess of some
# tolerances only, since the continuous extension is less accurate than the step.
_ANGLE, _LOOKS, _DOUBT = 0.1, 8, 10.0

# A contact with more bristle states than this has a twist for each of many cells, of which none holds the patch alone:
# looks would cost a quarter of the time and find nothing.
_MANY = 100

# Share of a step over which the rates are compared to see how they change with the time alone: what it leaves out is
# far below any tolerance, and so is what rounding makes of it.
_NUDGE = 1e-6

# Smallest step relative to the time (at least 1 s): a few units in the last place of the clock.
_RESOLUTION = 1e-15

# How far a body is moved to see whether it rests, in full deflections of the bristles: on that way they go from one
# side to the other, all but exp(-10) of it. Steps grow from one far below any swing to one that no bristle overshoots.
_FAR, _FIRST, _LARGEST = 10.0, 1e-7, 0.1

# How much faster than the stop speed a body at rest may become in swinging out, which takes bristles without damping
# a long time: about what the change within the bristles' time lets through where they swing out in three periods.
_SWING = 4.0


@kernel
def error_norm(own, y, new, error, rtol, atol):
    """Largest of the body's components and of each contact's mean over its bristles, in units of the tolerance.

    Infinite where anything is not finite.
    """
    largest, state = 0.0, integers(own.state)
    for c in range(own.contacts):
        total, count = 0.0, state[c + 1] - state[c]
        for i in range(state[c], state[c + 1]):
            e = error[i] / (atol[i] + rtol * xp.maximum(abs(y[i]), abs(new[i])))
            total += e * e
        if not xp.is_finite(total):
            return math.inf
        if count > 0:
            largest = xp.maximum(largest, math.sqrt(total / count))
    for i in range(own.bristles, own.bristles + 6):
        e = abs(error[i]) / (atol[i] + rtol * xp.maximum(abs(y[i]), abs(new[i])))
        if not xp.is_finite(e):
            return math.inf
        largest = xp.maximum(largest, e)
    return largest


@kernel
def _record(run, own, piece, since, state, m):
    """Write sample m from the state at an address."""
    many, y = own.contacts, doubles(state)
    call(own.rates, (run.system, piece, since, state, run.rate))
    for i in range(6):
        doubles(run.body)[6 * m + i] = y[own.bristles + i]
    for c in range(many):
        load = load_of(own, piece, since, c)
        doubles(run.load)[m * many + c] = load
        for i in range(3):
            doubles(run.wrench)[3 * (m * many + c) + i] = load * doubles(own.wrench)[3 * c + i]
    if run.bristle_samples > 0:
        for i in range(own.bristles):
            doubles(run.bristles)[m * own.bristles + i] = y[i]


@kernel
def _time_slope(own, piece, slope):
    """`df/dt` of the body's accelerations [3]: forces and loads are linear in time."""
    many, maps, wrench = own.contacts, doubles(own.maps), doubles(own.wrench)
    for i in range(3):
        total = doubles(own.force)[6 * piece + 3 + i]
        for c in range(many):
            load = doubles(own.count)[c] * doubles(own.load)[(2 * piece + 1) * many + c]
            for p in range(3):
                total += load * maps[27 * c + 3 * p + i] * wrench[3 * c + p]
        slope[i] = doubles(own.inverse_mass)[i] * total


@kernel
def _drift(run, own, piece, since, step):
    """`df/dt` of all states [n] where what a contact touches moves: a difference over a small share of a step.

    That is right to `_NUDGE` and costs one evaluation, while each model would have to know what its bristles say.
    """
    by, now, out = _NUDGE * step, doubles(run.start_rate), doubles(run.drift)
    call(own.rates, (run.system, piece, since + by, run.y, run.rate))
    for i in range(run.states):
        out[i] = (doubles(run.rate)[i] - now[i]) / by


@kernel
def forget_unloaded(own, piece, y):
    """A contact without load on the whole piece keeps no memory: it starts again from rest."""
    load, first = doubles(own.load), 2 * piece * own.contacts
    for c in range(own.contacts):
        if load[first + c] == 0.0 and load[first + own.contacts + c] == 0.0:
            for i in range(integers(own.state)[c], integers(own.state)[c + 1]):
                y[i] = 0.0


@kernel
def _extend(run, share, value, slope, base, out):
    """Write `base` plus multiples of the continuous extension, less y, and of its slope in s, at a share s of a step.

    It is `(1 - s) y + s (new + (1 - s) (d_1 + s (d_2 + ...)))` with `new = y + sum m_j k_j`: a sum of stages.
    """
    s, q, m, dense, coupling = (
        run.stage_count,
        run.order_of_dense,
        doubles(run.m),
        doubles(run.dense),
        doubles(run.coupling),
    )
    for j in range(s):
        inner, change = 0.0, 0.0
        for p in range(q - 1, -1, -1):
            change = inner + share * change
            inner = dense[p * s + j] + share * inner
        coupling[j] = value * share * (m[j] + (1.0 - share) * inner)
        coupling[j] += slope * (m[j] + (1.0 - 2.0 * share) * inner + share * (1.0 - share) * change)
    call(run.combine, (run.coupling, run.k, s, run.states, base, out))


@kernel
def _step(run, own, piece, since, step):
    """The stages of one step from `y`: solution into `new`, its error estimate into `error`."""
    n, s, k, right, coupling = run.states, run.stage_count, run.k, doubles(run.right), doubles(run.coupling)
    shift = 1.0 / (step * run.gamma)
    call(own.factor, (run.system, piece, since, run.y, shift))
    for i in range(s):
        for j in range(i):
            coupling[j] = doubles(run.c)[i * s + j] / step
        if i > 0:
            call(run.combine, (at(run.a, i * s), k, i, n, run.y, run.argument))
            time = since + doubles(run.alpha)[i] * step
            call(own.rates, (run.system, piece, time, run.argument, run.rate))
        call(run.combine, (run.coupling, k, i, n, run.rate if i > 0 else run.start_rate, run.right))
        slope = doubles(run.time_gamma)[i] * step
        if own.mover != 0:
            for p in range(n):
                right[p] += slope * doubles(run.drift)[p]
        else:
            for p in range(3):
                right[n - 6 + p] += slope * doubles(run.time_slope)[p]
        call(own.solve, (run.system, piece, since, run.y, shift, run.right, at(k, i * n)))
    call(run.combine, (run.m, k, s, n, run.y, run.new))
    call(run.combine, (run.e, k, s, n, run.zero, run.error))


@kernel
def _length(own, vector):
    """Length of a velocity or acceleration of the body [3], its spin times the lever arm."""
    arm = own.stop_radius
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + arm * arm * vector[2] * vector[2])


@kernel
def _direction(own, piece, since, c, state, out):
    """Write the direction of the twist of contact c in a state into `out` [3]; zeros at rest."""
    a, v, y = doubles(own.stiffness), doubles(own.twist), at(state, own.bristles)
    place, seen = place_at(own, piece, since, c, y)
    contact_map(integers(own.mount)[c], doubles(place), doubles(at(y, 3)), a)
    times(a, doubles(seen), v)
    size = _length(own, v)
    per_size = 1.0 / xp.where(size > 0.0, size, 1.0)
    out[0], out[1], out[2] = per_size * v[0], per_size * v[1], per_size * own.stop_radius * v[2]


@kernel
def _turn(run, own, piece, since, step):
    """Largest change of direction of the twist of a contact of few states from `y` to `new`, as an angle [rad]."""
    before, after, largest = doubles(own.body), doubles(own.matrix), 0.0
    for c in range(own.contacts):
        if integers(own.state)[c + 1] - integers(own.state)[c] > _MANY:
            continue
        _direction(own, piece, since, c, run.y, before)
        _direction(own, piece, since + step, c, run.new, after)
        x, y, z = after[0] - before[0], after[1] - before[1], after[2] - before[2]
        largest = xp.maximum(largest, math.sqrt(x * x + y * y + z * z))
    return largest


@kernel
def _look_inside(run, own, piece, since, step):
    """Norm of what a step that turns a contact's twist misses on its way, and how many places were looked at.

    The residual of the continuous extension, through the matrix of the step, is what a stage there would have added.
    """
    looks = xp.minimum(_LOOKS, int(_turn(run, own, piece, since, step) / _ANGLE))
    shift, largest = 1.0 / (step * run.gamma), 0.0
    for i in range(looks):
        share = (i + 1.0) / (looks + 1.0)
        _extend(run, share, 1.0, 0.0, run.y, run.argument)
        call(own.rates, (run.system, piece, since + share * step, run.argument, run.rate))
        _extend(run, share, 0.0, -1.0 / step, run.rate, run.right)
        call(own.solve, (run.system, piece, since, run.y, shift, run.right, run.error))
        norm = error_norm(own, doubles(run.y), doubles(run.new), doubles(run.error), run.rtol, doubles(run.atol))
        largest = xp.maximum(largest, norm / _DOUBT)
    return largest, looks


@kernel
def _at_rest(run, own, piece, since):
    """Whether the body is at rest: slow, and held by friction for good.

    Slow: its speed, and what that changes by within the bristles' time, are together below the stop speed. For good: no
    input changes any more. Held: driven by its speed and the net force, it comes to a stop before it has moved by
    `_FAR` full deflections of the bristles or is faster than `_SWING` stop speeds, and so it does when it swings back.
    That is tried: the body moves along the line of the net force, at the speed that follows from the work done on it
    (damping is left out), and the bristles follow. So nothing rests in free fall, without load, on a slope steeper than
    friction, or at a turning point while the bristles still push it back, however slow it is.
    """
    bristles, y, rate, push = own.bristles, doubles(run.argument), doubles(run.rate), doubles(run.time_slope)
    speed = _length(own, doubles(at(run.y, bristles)))
    change = _length(own, doubles(at(run.start_rate, bristles)))
    if doubles(own.breaks)[piece] < own.settled or not speed + own.stop_time * change < own.stop_speed:
        return False
    for i in range(run.states):
        y[i] = doubles(run.y)[i]
    for i in range(3):
        push[i] = 0.0
    force = _force(run, own, piece, since, push)
    for i in range(3):
        push[i] = rate[bristles + i] if force > 0.0 else doubles(run.y)[bristles + i]
    size = _length(own, push)
    if not size > 0.0:
        return True
    for i in range(3):
        push[i] /= size
    energy, most = 0.5 * speed * speed, 0.5 * (_SWING * own.stop_speed) ** 2
    for _ in range(2):
        way, step, force = 0.0, _FIRST, _force(run, own, piece, since, push)
        while energy > 0.0 or way == 0.0:
            if way > _FAR or energy > most:
                return False
            pace, moved = xp.maximum(math.sqrt(2.0 * energy), own.stop_speed), step * own.stop_length
            _move(y, bristles, push, pace)
            call(own.rates, (run.system, piece, since, run.argument, run.rate))
            for i in range(bristles):
                y[i] += moved / pace * rate[i]
            before, force = force, _force(run, own, piece, since, push)
            energy += 0.5 * (before + force) * moved
            way, step = way + step, xp.minimum(_GROWTH * step, _LARGEST)
        energy = 0.0
        for i in range(3):
            push[i] = -push[i]
    return True


@kernel
def _force(run, own, piece, since, push):
    """Acceleration of the body, if it stood still, along a direction; its size for no direction."""
    rate, arm = doubles(at(run.rate, own.bristles)), own.stop_radius
    _move(doubles(run.argument), own.bristles, push, 0.0)
    call(own.rates, (run.system, piece, since, run.argument, run.rate))
    along = push[0] * rate[0] + push[1] * rate[1] + arm * arm * push[2] * rate[2]
    return along if push[0] != 0.0 or push[1] != 0.0 or push[2] != 0.0 else _length(own, rate)


@kernel
def _move(y, bristles, push, factor):
    """Give the body a multiple of a velocity."""
    for i in range(3):
        y[bristles + i] = factor * push[i]


@jit
def advance(run, max_steps):
    """Integrate the run at an address from where it stands to the last break, or for `max_steps` trials; an outcome.

    The step that ends at a break is recorded (left limit) before the next piece begins.
    """
    run = read_run(run)
    own, n, s, samples = read(run.system), run.states, run.stage_count, run.samples
    y, breaks, times, clock = doubles(run.y), doubles(own.breaks), doubles(run.time), doubles(run.clock)
    cursor, statistics = integers(run.cursor), integers(run.statistics)
    piece, m = cursor[0], cursor[1]
    since, h, first_step = clock[0], clock[1], clock[2]
    taken = 0
    fresh = True  # the linearisation is yet to be made at y
    outcome = DONE
    while piece < own.pieces and outcome == DONE:
        begin, end = breaks[piece], breaks[piece + 1]
        starting = since == 0.0
        if starting:
            if own.velocity != 0:
                for i in range(3):
                    y[n - 6 + i] = doubles(own.velocity)[3 * piece + i]
            h = xp.minimum(h, first_step)
            if piece == 0 and m == 0 and times[0] == begin:
                _record(run, own, piece, 0.0, run.y, m)
                m += 1
        while since < end - begin:
            # stretch the last step to the break, or halve what is left, so that no sliver of a step remains
            remaining = end - begin - since
            step = h
            if 2.0 * h > remaining:
                step = remaining if h >= remaining else 0.5 * remaining
            last = step == remaining
            if taken >= max_steps or step <= _RESOLUTION * xp.maximum(1.0, abs(begin)):
                outcome = PAUSED if taken >= max_steps else STEP_TOO_SMALL
                break
            if fresh:
                call(own.rates, (run.system, piece, since, run.y, run.start_rate))
                call(own.linearise, (run.system, piece, run.y))
                _time_slope(own, piece, doubles(run.time_slope))
                if own.mover != 0:
                    _drift(run, own, piece, since, step)
                    statistics[EVALUATIONS] += 1
                statistics[JACOBIANS] += 1
            _step(run, own, piece, since, step)
            taken += 1
            statistics[EVALUATIONS] += s if fresh else s - 1
            norm = error_norm(own, y, doubles(run.new), doubles(run.error), run.rtol, doubles(run.atol))
            if norm <= 1.0:
                missed, looks = _look_inside(run, own, piece, since, step)
                norm = xp.maximum(norm, missed)
                statistics[EVALUATIONS] += looks
            # no growth right after a rejection, whose reason is still near
            growth = _GROWTH if fresh else 1.0
            scale = _SHRINKAGE
            if xp.is_finite(norm):
                ideal = _SAFETY * xp.maximum(norm, 1e-10) ** (-1.0 / run.order)
                scale = xp.minimum(growth, xp.maximum(_SHRINKAGE, ideal))
            fresh = norm <= 1.0
            if not fresh:
                statistics[REJECTIONS] += 1
                h = step * scale
                continue
            statistics[STEPS] += 1
            reached = end - begin if last else since + step
            time = end if last else begin + reached
            while m < samples and times[m] <= time:
                here = reached if times[m] == time else times[m] - begin
                _extend(run, (here - since) / step, 1.0, 0.0, run.y, run.argument)
                _record(run, own, piece, here, run.argument, m)
                m += 1
            if starting:
                first_step = step * scale
                starting = False
            for i in range(n):
                y[i] = doubles(run.new)[i]
            since = reached
            h = xp.maximum(step * scale, h) if last else step * scale
            if own.stop_speed > 0.0 and _at_rest(run, own, piece, since):
                outcome = AT_REST
                if m < samples:
                    times[m] = time
                    _record(run, own, piece, since, run.y, m)
                    m += 1
                break
        if outcome == DONE:
            forget_unloaded(own, piece, y)
            piece += 1
            since = 0.0
    cursor[0], cursor[1] = piece, m
    clock[0], clock[1], clock[2] = since, h, first_step
    return outcome
