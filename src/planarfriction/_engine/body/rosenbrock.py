"""Rosenbrock methods on the structured body system: adaptive steps, exact stops at breaks, dense output."""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.body.body import (
    BODY_FUNCTIONS,
    System,
    SystemRecord,
    load_of,
    maps_of,
    place_at,
    read,
    settle_all,
)
from planarfriction._engine.body.contacts import contact_map
from planarfriction._engine.body.integration import (
    IntegrationProgress,
    Method,
    Output,
    RunRecord,
    Stages,
    combine,
    extend,
    read_run,
)
from planarfriction._engine.body.springs import spring_drift
from planarfriction._engine.body.step_control import MOTION, fitted, growth
from planarfriction._engine.body.termination import (
    INSTANT,
    at_rest,
    note_ends,
    share_until_end,
    speed_of,
)
from planarfriction._engine.codegen.small_matrices import applied
from planarfriction._engine.codegen.vectors import (
    Vector,
    applied_back,
    clear,
    copy,
    norm,
    plus,
    put,
    three,
    times,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel, sequential_entry, sequential_jit
from planarfriction._engine.compiler.calls import address_of, call
from planarfriction._engine.compiler.memory import (
    Doubles,
    Place,
    StructBuffer,
    at,
    exists,
    layout,
)

DONE = 0
"""Outcome of `advance`: the motion has reached its end."""

PAUSED = 1
"""Outcome of `advance`: the number of steps of this call is used up."""

STEP_TOO_SMALL = 2
"""Outcome of `advance`: no step is small enough."""

AT_REST = 3
"""Outcome of `advance`: the body rests."""

APART = 4
"""Outcome of `advance`: the body has left its supports."""

STEPS = 0
"""Place in `IntegrationProgress.statistics` of the number of steps."""

REJECTIONS = 1
"""Place in `IntegrationProgress.statistics` of the number of rejected steps."""

EVALUATIONS = 2
"""Place in `IntegrationProgress.statistics` of the number of evaluations of the rates."""

JACOBIANS = 3
"""Place in `IntegrationProgress.statistics` of the number of Jacobians."""

PIECE = 0
"""Place in `IntegrationProgress.cursor` of the piece of time."""

SAMPLE = 1
"""Place in `IntegrationProgress.cursor` of the next sample."""

SINCE = 0
"""Place in `IntegrationProgress.clock` of the time since the piece began."""

STEP = 1
"""Place in `IntegrationProgress.clock` of the next step."""

FIRST = 2
"""Place in `IntegrationProgress.clock` of the mark of a first step."""

# Friction goes by the direction of a contact's twist. While a patch comes to a halt that direction may sweep across a
# pad, which holds the patch as soon as it is all that stands still, and a step from one side of it to the other has a
# small error estimate. So steps that turn a twist by more than an angle [rad], about half of what such a pad takes, are
# looked into: once an angle, at most some times, and what is missing there is taken for an error in excess of some
# tolerances only, since the continuous extension is less accurate than the step.
_ANGLE = 0.1
"""Turn of a twist in a step from which it is looked into [rad]."""

_LOOKS = 8
"""Looks into a step at most."""

_DOUBT = 10.0
"""Tolerances beyond which what a look finds missing counts as an error."""

# A contact with more bristle states than this has a twist for each of many cells, of which none holds the patch alone:
# looks would cost a quarter of the time and find nothing.
_MANY = 50

# Share of a step over which the rates are compared to see how they change with the time alone: what it leaves out is
# far below any tolerance, and so is what rounding makes of it.
_NUDGE = 1e-6

# Smallest step relative to the time (at least 1 s): a few units in the last place of the clock.
_RESOLUTION = 1e-15


@kernel
def _error(run: RunRecord, system: SystemRecord, error: Doubles) -> float:
    """Return the largest of errors of the body's components and of each contact's bristles (mean), per tolerance.

    Infinite where anything is not finite.
    """
    y = run.progress.y
    new = run.stages.new
    atol = run.atol
    rtol = run.rtol
    largest = 0.0
    state = system.contacts.state
    for c in range(system.size):
        total = 0.0
        count = state[c + 1] - state[c]
        for i in range(state[c], state[c + 1]):
            e = error[i] / (atol[i] + rtol * xp.maximum(abs(y[i]), abs(new[i])))
            total += e * e
        if not xp.is_finite(total):
            return math.inf
        if count > 0:
            largest = xp.maximum(largest, math.sqrt(total / count))
    for i in range(system.bristles, system.bristles + 6):
        e = abs(error[i]) / (atol[i] + rtol * xp.maximum(abs(y[i]), abs(new[i])))
        if not xp.is_finite(e):
            return math.inf
        largest = xp.maximum(largest, e)
    return largest


@kernel
def _record(
    run: RunRecord, system: SystemRecord, piece: int, since: float, state: Doubles
) -> None:
    """Write the next sample from a state."""
    out = run.output
    m = run.progress.cursor[SAMPLE]
    call(system.rates, (run.system, piece, since, state, run.stages.rate))
    copy(at(state, system.bristles), at(out.body, 6 * m), 6)
    for c in range(system.size):
        load = load_of(system, piece, since, c)
        row = m * system.size + c
        load = load if system.work.covered[c] > 0.0 else 0.0
        out.load[row] = load
        put(at(out.wrench, 3 * row), times(load, three(at(system.work.wrench, 3 * c))))
    if exists(out.bristles):
        copy(state, at(out.bristles, m * system.bristles), system.bristles)
    if exists(out.pressure):
        copy(at(state, system.bristles - 2), at(out.pressure, 2 * m), 2)
    run.progress.cursor[SAMPLE] = m + 1


@kernel
def _time_slope(system: SystemRecord, piece: int, y: Doubles, slope: Doubles) -> None:
    """Write `df/dt` of the body's accelerations [3]: forces, loads and anchors of springs are linear in time."""
    motion = system.motion
    total = three(at(system.motion.force, 6 * piece + 3))
    total = plus(total, 1.0, spring_drift(system, piece, y[system.bristles + 5]))
    for c in range(system.size):
        load = system.contacts.count[c] * motion.load[(2 * piece + 1) * system.size + c]
        total = plus(
            total,
            load,
            applied_back(maps_of(system, c)[0], at(system.work.wrench, 3 * c)),
        )
    for i in range(3):
        slope[i] = motion.inverse_mass[i] * total[i]


@kernel
def _drifts(system: SystemRecord, piece: int) -> bool:
    """Return True if rates of bristles change with the time alone: surfaces move, or limits with the load."""
    drifts = exists(system.motion.mover)
    for c in range(system.size):
        changes = system.motion.load[(2 * piece + 1) * system.size + c] != 0.0
        drifts = drifts or (changes and system.contacts.stiff[c] > 0.0)
    return drifts


@kernel
def _drift(
    run: RunRecord, system: SystemRecord, piece: int, since: float, step: float
) -> None:
    """Write `df/dt` of all states [n] where bristles see the time: a difference over a small share of a step.

    The difference is right to `_NUDGE` and costs one evaluation; no model needs a derivative by the time.
    """
    by = _NUDGE * step
    now = run.stages.start_rate
    rate = run.stages.rate
    call(system.rates, (run.system, piece, since + by, run.progress.y, rate))
    for i in range(run.states):
        run.stages.drift[i] = (rate[i] - now[i]) / by
    run.progress.statistics[EVALUATIONS] += 1


@kernel
def forget_unloaded(system: SystemRecord, piece: int, y: Doubles) -> None:
    """Clear the bristles of contacts without load on the whole piece: they start again from rest."""
    load = system.motion.load
    first = 2 * piece * system.size
    state = system.contacts.state
    for c in range(system.size):
        if load[first + c] == 0.0 and load[first + system.size + c] == 0.0:
            clear(at(y, state[c]), state[c + 1] - state[c])


@kernel
def _step(
    run: RunRecord, system: SystemRecord, piece: int, since: float, step: float
) -> None:
    """Go through the stages of one step from `y`: solution into `new`; its error estimate is the last stage."""
    n = run.states
    s = run.stage_count
    method = run.method
    work = run.stages
    y = run.progress.y
    k = work.k
    right = work.right
    shift = 1.0 / (step * method.gamma)
    drifts = _drifts(system, piece)
    call(system.factor, (run.system, piece, since, y, shift))
    for i in range(s):
        for j in range(i):
            work.coupling[j] = method.c[i * s + j] / step
        if i > 0:
            call(run.combine, (at(method.a, i * s), k, i, n, y, work.argument))
            call(
                system.rates,
                (
                    run.system,
                    piece,
                    since + method.alpha[i] * step,
                    work.argument,
                    work.rate,
                ),
            )
        call(
            run.combine,
            (work.coupling, k, i, n, work.rate if i > 0 else work.start_rate, right),
        )
        slope = method.time_gamma[i] * step
        if drifts:
            for p in range(n):
                right[p] += slope * work.drift[p]
        else:
            for p in range(3):
                right[n - 6 + p] += slope * work.time_slope[p]
        call(system.solve, (run.system, piece, since, y, shift, right, at(k, i * n)))
    last = s - 1
    whole = at(method.m, last)
    call(run.combine, (whole, at(k, last * n), 1, n, work.argument, work.new))


@kernel
def _direction(
    system: SystemRecord, piece: int, since: float, c: int, state: Doubles
) -> Vector:
    """Return the direction of the twist of contact c in a state; zeros at rest."""
    a = system.work.stiffness
    v = system.work.twist
    body = at(state, system.bristles)
    place, seen = place_at(system, piece, since, c, body)
    contact_map(system.contacts.mount[c], place, at(body, 3), a)
    put(v, applied(a, seen))
    size = speed_of(system, v)
    x, y, s = times(1.0 / xp.where(size > 0.0, size, 1.0), three(v))
    return x, y, system.motion.stop_radius * s


@kernel
def _turn(
    run: RunRecord, system: SystemRecord, piece: int, since: float, step: float
) -> float:
    """Return the largest change of direction [rad] of the twist of a contact of few states from `y` to `new`."""
    largest = 0.0
    for c in range(system.size):
        if system.contacts.state[c + 1] - system.contacts.state[c] <= _MANY:
            before = _direction(system, piece, since, c, run.progress.y)
            after = _direction(system, piece, since + step, c, run.stages.new)
            largest = xp.maximum(largest, norm(plus(after, -1.0, before)))
    return largest


@kernel
def _missed_inside(
    run: RunRecord, system: SystemRecord, piece: int, since: float, step: float
) -> float:
    """Return the error of a step that turns a contact's twist at places on its way, per tolerance.

    The residual of the continuous extension, through the matrix of the step, is the share of one more stage there.
    """
    looks = xp.minimum(
        _LOOKS, np.int64(_turn(run, system, piece, since, step) / _ANGLE)
    )
    work = run.stages
    shift = 1.0 / (step * run.method.gamma)
    largest = 0.0
    for i in range(looks):
        share = (i + 1.0) / (looks + 1.0)
        extend(run, share, 1.0, 0.0, run.progress.y, work.argument)
        call(
            system.rates,
            (run.system, piece, since + share * step, work.argument, work.rate),
        )
        extend(run, share, 0.0, -1.0 / step, work.rate, work.right)
        call(
            system.solve,
            (run.system, piece, since, run.progress.y, shift, work.right, work.error),
        )
        largest = xp.maximum(largest, _error(run, system, work.error) / _DOUBT)
    run.progress.statistics[EVALUATIONS] += looks
    return largest


@sequential_entry
def attempt(run: Place, piece: int, since: float, step: float, fresh: int) -> None:
    """Try a step, and write its error into `verdict`; `fresh` is 1 if the linearisation is yet to be made at y."""
    run = read_run(run)
    system = read(run.system)
    y = run.progress.y
    statistics = run.progress.statistics
    fresh = fresh == 1
    if fresh:
        call(system.linearise, (run.system, piece, since, y, run.stages.start_rate))
        _time_slope(system, piece, y, run.stages.time_slope)
        if _drifts(system, piece):
            _drift(run, system, piece, since, step)
        statistics[JACOBIANS] += 1
    _step(run, system, piece, since, step)
    statistics[EVALUATIONS] += run.stage_count if fresh else run.stage_count - 1
    last = (run.stage_count - 1) * run.states
    error = _error(run, system, at(run.stages.k, last))
    if error <= 1.0:
        error = xp.maximum(error, _missed_inside(run, system, piece, since, step))
    run.stages.verdict[0] = error


@kernel
def _start(run: RunRecord, system: SystemRecord, piece: int) -> None:
    """Start a piece: the prescribed velocity, a first step, and a sample where the motion begins."""
    progress = run.progress
    motion = system.motion
    if exists(motion.velocity):
        put(at(progress.y, run.states - 6), three(at(motion.velocity, 3 * piece)))
    settle_all(system, piece, progress.y)
    progress.clock[STEP] = xp.minimum(progress.clock[STEP], progress.clock[FIRST])
    if (
        piece == 0
        and progress.cursor[SAMPLE] == 0
        and run.output.time[0] == motion.breaks[0]
    ):
        _record(run, system, piece, 0.0, progress.y)
    if exists(run.output.ended):
        note_ends(run, system, piece, 0.0, motion.breaks[piece])


@kernel
def _accept(
    run: RunRecord, system: SystemRecord, piece: int, step: float, last: bool
) -> float:
    """Take the new state after a step, and record the samples on its way."""
    progress = run.progress
    samples = run.output.time
    begin = system.motion.breaks[piece]
    since = progress.clock[SINCE]
    end = system.motion.breaks[piece + 1]
    reached = end - begin if last else since + step
    time = end if last else begin + reached
    while (
        progress.cursor[SAMPLE] < run.samples
        and samples[progress.cursor[SAMPLE]] <= time
    ):
        sample = samples[progress.cursor[SAMPLE]]
        instant = reached if sample == time else sample - begin
        extend(run, (instant - since) / step, 1.0, 0.0, progress.y, run.stages.argument)
        _record(run, system, piece, instant, run.stages.argument)
    copy(run.stages.new, progress.y, run.states)
    progress.statistics[STEPS] += 1
    progress.clock[SINCE] = reached
    return time


@sequential_jit
def advance(run: Place, max_steps: int) -> int:
    """Integrate the run at an address from where it stands to the last break, or for `max_steps` trials.

    The step that ends at a break is recorded (left limit) before the next piece begins. Returns an outcome.
    """
    address = run
    run = read_run(run)
    system = read(run.system)
    progress = run.progress
    clock = run.progress.clock
    taken = 0
    while progress.cursor[PIECE] < system.pieces:
        piece = progress.cursor[PIECE]
        begin = system.motion.breaks[piece]
        span = system.motion.breaks[piece + 1] - begin
        starting = clock[SINCE] == 0.0
        fresh = True
        if starting:
            _start(run, system, piece)
        while clock[SINCE] < span:
            remaining = span - clock[SINCE]
            step = fitted(clock[STEP], remaining)
            if taken >= max_steps:
                return PAUSED
            if step <= _RESOLUTION * xp.maximum(1.0, abs(begin)):
                return STEP_TOO_SMALL
            call(run.attempt, (address, piece, clock[SINCE], step, 1 if fresh else 0))
            taken = taken + 1
            error = run.stages.verdict[0]
            # no growth right after a rejection, whose reason is still near
            longer = step * growth(
                MOTION, error, run.method.order, MOTION.growth if fresh else 1.0
            )
            fresh = error <= 1.0
            if not fresh:
                progress.statistics[REJECTIONS] += 1
                clock[STEP] = longer
                continue
            if exists(run.output.ended):
                share = share_until_end(run, system, piece, clock[SINCE], step)
                if (1.0 - share) * step > INSTANT:
                    progress.statistics[REJECTIONS] += 1
                    clock[STEP] = xp.maximum(share * step, INSTANT)
                    fresh = False
                    continue
            time = _accept(run, system, piece, step, step == remaining)
            if starting:
                clock[FIRST] = longer
                starting = False
            clock[STEP] = (
                xp.maximum(longer, clock[STEP]) if step == remaining else longer
            )
            if system.motion.stop_speed > 0.0 and _rests(
                run, system, address, piece, time
            ):
                return AT_REST
            if exists(run.output.ended) and note_ends(
                run, system, piece, clock[SINCE], time
            ):
                _record_last(run, system, piece, time)
                return APART
        forget_unloaded(system, piece, progress.y)
        progress.cursor[PIECE] = piece + 1
        clock[SINCE] = 0.0
    return DONE


@kernel
def _rests(
    run: RunRecord, system: SystemRecord, address: Place, piece: int, time: float
) -> bool:
    """Return True if the body is at rest, after a sample of its place."""
    call(run.at_rest, (address, piece, run.progress.clock[SINCE]))
    if run.stages.verdict[1] == 0.0:
        return False
    _record_last(run, system, piece, time)
    return True


@kernel
def _record_last(run: RunRecord, system: SystemRecord, piece: int, time: float) -> None:
    """Write a sample where a run ends early."""
    progress = run.progress
    if progress.cursor[SAMPLE] < run.samples:
        run.output.time[progress.cursor[SAMPLE]] = time
        _record(run, system, piece, progress.clock[SINCE], progress.y)


FUNCTIONS = (*BODY_FUNCTIONS, combine, attempt, advance)
"""Functions that every run calls, in the order in which it asks for them."""


class Run(StructBuffer):
    """An integration on which `advance` works: its steps keep their error below `rtol |y| + atol`, `atol` [n]."""

    def __init__(
        self,
        system: System,
        method: Method,
        output: Output,
        progress: IntegrationProgress,
        *,
        rtol: float,
        atol: np.ndarray,
    ) -> None:
        n = len(progress.y)
        s = len(method.m)
        shapes = dict.fromkeys(Stages._fields, n) | {
            "k": (s, n),
            "time_slope": 3,
            "coupling": s,
            "verdict": 2,
        }
        stages = layout(Stages, **shapes)
        sizes = (n, s, len(method.dense), len(output.time))
        self._block = np.zeros(stages.size)
        atol = np.ascontiguousarray(atol, dtype=float)
        rests = address_of(at_rest) if system.motion.stop_speed > 0.0 else 0
        parts = (
            system.address,
            method,
            output,
            progress,
            stages.placed(self._block),
            atol,
            float(rtol),
        )
        super().__init__(
            RunRecord(*parts, *sizes, address_of(combine), address_of(attempt), rests)
        )
        self.system = system
