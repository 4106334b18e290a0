"""Rosenbrock methods on the structured body system: adaptive steps, exact stops at breaks, dense output."""

from __future__ import annotations

import math

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import jit, kernel
from planarfriction.kernels.body import load_of, read
from planarfriction.kernels.integration import method_of, read_run, stages_of
from planarfriction.kernels.pointers import call, doubles, integers, vector

DONE, PAUSED, STEP_TOO_SMALL, AT_REST = 0, 1, 2, 3
"""Outcomes of `advance`."""

STEPS, REJECTIONS, EVALUATIONS, JACOBIANS = 0, 1, 2, 3
"""Rows of the statistics."""

# Step control. A decaying transient is followed through all its scales only if the steps do not grow too fast: a
# factor of 2.5 needs 8 % fewer steps than 6 for the same error of the in-hand runs.
_SAFETY, _GROWTH, _SHRINKAGE = 0.8, 2.5, 0.1

# Smallest step relative to the time (at least 1 s): a few units in the last place of the clock.
_RESOLUTION = 1e-15


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
def _record(run, own, piece, since, y, m):
    """Write sample m from the state y."""
    many = own.contacts
    call(own.rates, (run.system, piece, since, y, run.rate))
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
def forget_unloaded(own, piece, y):
    """A contact without load on the whole piece keeps no memory: it starts again from rest."""
    load, at = doubles(own.load), 2 * piece * own.contacts
    for c in range(own.contacts):
        if load[at + c] == 0.0 and load[at + own.contacts + c] == 0.0:
            for i in range(integers(own.state)[c], integers(own.state)[c + 1]):
                y[i] = 0.0


@kernel
def _interpolate(method, k, y, new, s, out):
    """Continuous extension at the fraction `s` of a step: `(1 - s) y + s (new + (1 - s) (d_1 + s (d_2 + ...)))`."""
    q = method.dense.shape[0]
    for i in range(y.shape[0]):
        inner = 0.0
        for p in range(q - 1, -1, -1):
            row = 0.0
            for j in range(k.shape[0]):
                row += method.dense[p, j] * k[j, i]
            inner = row + s * inner
        out[i] = (1.0 - s) * y[i] + s * (new[i] + (1.0 - s) * inner)


@kernel
def _step(run, own, method, piece, since, step, y, stages):
    """The stages of one step from `y`: solution into `stages.new`, its error estimate into `stages.error`."""
    n, s = run.states, run.stage_count
    k, argument, right, coupling = stages.k, stages.argument, stages.right, stages.coupling
    shift = 1.0 / (step * method.gamma)
    call(own.factor, (run.system, piece, since, y, shift))
    for i in range(s):
        for j in range(i):
            coupling[j] = method.c[i, j] / step
        if i > 0:
            call(run.combine, (method.a[i], k, i, n, y, argument))
            call(own.rates, (run.system, piece, since + method.alpha[i] * step, argument, stages.rate))
        call(run.combine, (coupling, k, i, n, run.rate if i > 0 else run.start_rate, right))
        for p in range(3):
            right[n - 6 + p] += method.time_gamma[i] * step * stages.time_slope[p]
        call(own.solve, (run.system, piece, since, y, shift, right, k[i]))
    call(run.combine, (method.m, k, s, n, y, stages.new))
    call(run.combine, (method.e, k, s, n, stages.zero, stages.error))


@kernel
def _at_rest(own, y, rate):
    """Body speed, and its change within the bristles' time, are below the speed that counts as rest."""
    speed, change = 0.0, 0.0
    for i in range(3):
        arm = own.stop_radius if i == 2 else 1.0
        speed += (arm * y[own.bristles + i]) ** 2
        change += (arm * rate[own.bristles + i]) ** 2
    return math.sqrt(speed) + own.stop_time * math.sqrt(change) < own.stop_speed


@jit
def advance(run, max_steps):
    """Integrate the run at an address from where it stands to the last break, or for `max_steps` trials; an outcome.

    The step that ends at a break is recorded (left limit) before the next piece begins.
    """
    run = read_run(run)
    system, own, method, stages = run.system, read(run.system), method_of(run), stages_of(run)
    n, samples = run.states, run.samples
    y, breaks, times, clock = vector(run.y, n), doubles(own.breaks), doubles(run.time), doubles(run.clock)
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
                _record(run, own, piece, 0.0, y, m)
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
                call(own.rates, (system, piece, since, y, stages.start_rate))
                call(own.linearise, (system, piece, y))
                _time_slope(own, piece, stages.time_slope)
                statistics[JACOBIANS] += 1
            _step(run, own, method, piece, since, step, y, stages)
            taken += 1
            statistics[EVALUATIONS] += method.m.shape[0] if fresh else method.m.shape[0] - 1
            norm = error_norm(own, y, stages.new, stages.error, run.rtol, vector(run.atol, n))
            # no growth right after a rejection, whose reason is still near
            growth = _GROWTH if fresh else 1.0
            scale = _SHRINKAGE
            if xp.is_finite(norm):
                ideal = _SAFETY * xp.maximum(norm, 1e-10) ** (-1.0 / method.order)
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
                at = reached if times[m] == time else times[m] - begin
                _interpolate(method, stages.k, y, stages.new, (at - since) / step, stages.argument)
                _record(run, own, piece, at, stages.argument, m)
                m += 1
            if starting:
                first_step = step * scale
                starting = False
            for i in range(n):
                y[i] = stages.new[i]
            since = reached
            h = xp.maximum(step * scale, h) if last else step * scale
            if own.stop_speed > 0.0 and _at_rest(own, y, stages.start_rate):
                outcome = AT_REST
                if m < samples:
                    times[m] = time
                    _record(run, own, piece, since, y, m)
                    m += 1
                break
        if outcome == DONE:
            forget_unloaded(own, piece, y)
            piece += 1
            since = 0.0
    cursor[0], cursor[1] = piece, m
    clock[0], clock[1], clock[2] = since, h, first_step
    return outcome
