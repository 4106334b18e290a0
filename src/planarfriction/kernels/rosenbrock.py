"""Rosenbrock methods on the structured body system: adaptive steps, exact stops at breaks, dense output."""

from __future__ import annotations

import math

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import jit, kernel
from planarfriction.kernels.body import load_of, read
from planarfriction.kernels.integration import read_run
from planarfriction.kernels.pointers import at, call, doubles, integers

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
def forget_unloaded(own, piece, y):
    """A contact without load on the whole piece keeps no memory: it starts again from rest."""
    load, first = doubles(own.load), 2 * piece * own.contacts
    for c in range(own.contacts):
        if load[first + c] == 0.0 and load[first + own.contacts + c] == 0.0:
            for i in range(integers(own.state)[c], integers(own.state)[c + 1]):
                y[i] = 0.0


@kernel
def _interpolate(run, share, out):
    """Continuous extension at a share s of a step: `(1 - s) y + s (new + (1 - s) (d_1 + s (d_2 + ...)))`."""
    n, s, q = run.states, run.stage_count, run.order_of_dense
    k, dense, y, new = doubles(run.k), doubles(run.dense), doubles(run.y), doubles(run.new)
    for i in range(n):
        inner = 0.0
        for p in range(q - 1, -1, -1):
            row = 0.0
            for j in range(s):
                row += dense[p * s + j] * k[j * n + i]
            inner = row + share * inner
        out[i] = (1.0 - share) * y[i] + share * (new[i] + (1.0 - share) * inner)


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
        for p in range(3):
            right[n - 6 + p] += doubles(run.time_gamma)[i] * step * doubles(run.time_slope)[p]
        call(own.solve, (run.system, piece, since, run.y, shift, run.right, at(k, i * n)))
    call(run.combine, (run.m, k, s, n, run.y, run.new))
    call(run.combine, (run.e, k, s, n, run.zero, run.error))


@kernel
def _at_rest(own, y, rate):
    """Body speed, and its change within the bristles' time, are below the speed that counts as rest."""
    speed, change = 0.0, 0.0
    for i in range(3):
        arm = own.stop_radius if i == 2 else 1.0
        v, dv = arm * y[own.bristles + i], arm * rate[own.bristles + i]
        speed += v * v
        change += dv * dv
    return math.sqrt(speed) + own.stop_time * math.sqrt(change) < own.stop_speed


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
                statistics[JACOBIANS] += 1
            _step(run, own, piece, since, step)
            taken += 1
            statistics[EVALUATIONS] += s if fresh else s - 1
            norm = error_norm(own, y, doubles(run.new), doubles(run.error), run.rtol, doubles(run.atol))
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
                _interpolate(run, (here - since) / step, doubles(run.argument))
                _record(run, own, piece, here, run.argument, m)
                m += 1
            if starting:
                first_step = step * scale
                starting = False
            for i in range(n):
                y[i] = doubles(run.new)[i]
            since = reached
            h = xp.maximum(step * scale, h) if last else step * scale
            if own.stop_speed > 0.0 and _at_rest(own, y, doubles(run.start_rate)):
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
