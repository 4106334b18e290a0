"""Ends of runs: no part of a contact lies on the body any more, or the body is at rest for good, held by friction."""

from __future__ import annotations

import math

from planarfriction._engine.body.body import SystemRecord, read
from planarfriction._engine.body.integration import RunRecord, extend, read_run
from planarfriction._engine.codegen.vectors import copy, put, three, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import entry, kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import Doubles, Place, at

INSTANT = 1e-9
"""Time [s] before the end of a step in which a contact may have ended."""

# Halvings of the step in which a contact ends.
_HALVINGS = 40


@kernel
def _ends(
    run: RunRecord, system: SystemRecord, piece: int, since: float, state: Doubles
) -> bool:
    """Return True if a contact that touched the body does so no longer in a state."""
    call(system.rates, (run.system, piece, since, state, run.stages.rate))
    ends = False
    for c in range(system.size):
        ends = ends or (
            system.work.covered[c] == 0.0 and not run.output.ended[c] >= 0.0
        )
    return ends


@kernel
def share_until_end(
    run: RunRecord, system: SystemRecord, piece: int, since: float, step: float
) -> float:
    """Return the share of a step after which a contact has ended; 1 if all go on."""
    early = 0.0
    late = 1.0
    if not _ends(run, system, piece, since + step, run.stages.new):
        return late
    for _ in range(_HALVINGS):
        share = 0.5 * (early + late)
        extend(run, share, 1.0, 0.0, run.progress.y, run.stages.argument)
        if _ends(run, system, piece, since + share * step, run.stages.argument):
            late = share
        else:
            early = share
    return late


@kernel
def note_ends(
    run: RunRecord, system: SystemRecord, piece: int, since: float, time: float
) -> bool:
    """Write which contacts have ended by now; return True if one did so now and none is left."""
    ends = _ends(run, system, piece, since, run.progress.y)
    left = False
    for c in range(system.size):
        left = left or system.work.covered[c] > 0.0
        if system.work.covered[c] > 0.0:
            run.output.ended[c] = math.nan
        elif not run.output.ended[c] >= 0.0:
            run.output.ended[c] = time
    return ends and not left


# ---------------------------------------------------------------------- rest

# Distance that a body is moved to see whether it rests, in full deflections of the bristles: on that way they go from
# one side to the other, all but exp(-10) of it. Steps grow from one far below any swing to one that no bristle
# overshoots.
_FAR = 10.0
"""Distance that a body is moved to see if it rests, in full deflections of its
bristles: they go from one side to the other on the way, all but exp(-10) of it."""

_FIRST = 1e-7
"""First step on that way, in full deflections: far below any swing."""

_GROWTH = 2.5
"""Ratio of one step on that way to the one before."""

_LARGEST = 0.1
"""Largest step on that way, in full deflections: no bristle overshoots it."""

# Speed, in stop speeds, that a body at rest may reach in swinging out, which takes bristles without damping a long
# time: about what the change within the bristles' time lets through where they swing out in three periods.
_SWING = 4.0


@kernel
def speed_of(system: SystemRecord, velocity: Doubles) -> float:
    """Return the length of a velocity or acceleration of the body [3], its spin times the lever arm."""
    arm = system.motion.stop_radius
    return math.sqrt(
        velocity[0] * velocity[0]
        + velocity[1] * velocity[1]
        + arm * arm * velocity[2] * velocity[2]
    )


@entry
def at_rest(run: Place, piece: int, since: float) -> None:
    """Write into `verdict` whether the body is at rest: slow, and held by friction for good.

    Slow: its speed, and the change of its speed within the bristles' time, are together below the stop speed. For
    good: no input changes any more. Held: driven by its speed and the net force, it comes to a stop before it has gone
    `_FAR` full deflections of the bristles or is faster than `_SWING` stop speeds, and so it does when it swings back.
    For this test the body moves along the line of the net force, at the speed that follows from the work done on it
    (damping is left out), and the bristles follow. So nothing rests in free fall, without load, on a slope steeper than
    friction, or at a turning point while the bristles still push it back, however slow it is.
    """
    run = read_run(run)
    system = read(run.system)
    y = run.stages.argument
    push = run.stages.time_slope
    motion = system.motion
    verdict = run.stages.verdict
    velocity = at(run.progress.y, system.bristles)
    speed = speed_of(system, velocity)
    change = speed_of(system, at(run.stages.start_rate, system.bristles))
    verdict[1] = 0.0
    if (
        motion.breaks[piece] < motion.settled
        or not speed + motion.stop_time * change < motion.stop_speed
    ):
        return
    copy(run.progress.y, y, run.states)
    put(push, (0.0, 0.0, 0.0))
    force = _force(run, system, piece, since)
    put(push, three(at(run.stages.rate, system.bristles) if force > 0.0 else velocity))
    size = speed_of(system, push)
    energy = 0.5 * speed * speed
    for way in range(2 if size > 0.0 else 0):
        put(push, times((1.0 if way == 0 else -1.0) / size, three(push)))
        if not _is_held(run, system, piece, since, energy):
            return
        size = 1.0
        energy = 0.0
    verdict[1] = 1.0


@kernel
def _is_held(
    run: RunRecord, system: SystemRecord, piece: int, since: float, energy: float
) -> bool:
    """Return True if friction stops the body, given energy per mass, on its way along the direction `time_slope`."""
    y = run.stages.argument
    rate = run.stages.rate
    motion = system.motion
    most = 0.5 * (_SWING * motion.stop_speed) ** 2
    way = 0.0
    step = _FIRST
    force = _force(run, system, piece, since)
    while energy > 0.0 or way == 0.0:
        if way > _FAR or energy > most:
            return False
        pace = xp.maximum(math.sqrt(2.0 * energy), motion.stop_speed)
        distance = step * motion.stop_length
        _move(run, system, pace)
        call(system.rates, (run.system, piece, since, y, rate))
        for i in range(system.bristles - system.pressures):
            y[i] += distance / pace * rate[i]
        before = force
        force = _force(run, system, piece, since)
        energy += 0.5 * (before + force) * distance
        way = way + step
        step = xp.minimum(_GROWTH * step, _LARGEST)
    return True


@kernel
def _force(run: RunRecord, system: SystemRecord, piece: int, since: float) -> float:
    """Return the acceleration of the body, if it stood still, along the direction `time_slope`; its size for none."""
    push = run.stages.time_slope
    rate = at(run.stages.rate, system.bristles)
    arm = system.motion.stop_radius
    _move(run, system, 0.0)
    call(system.rates, (run.system, piece, since, run.stages.argument, run.stages.rate))
    along = push[0] * rate[0] + push[1] * rate[1] + arm * arm * push[2] * rate[2]
    return (
        along
        if push[0] != 0.0 or push[1] != 0.0 or push[2] != 0.0
        else speed_of(system, rate)
    )


@kernel
def _move(run: RunRecord, system: SystemRecord, factor: float) -> None:
    """Give the body a multiple of the velocity `time_slope`."""
    put(
        at(run.stages.argument, system.bristles),
        times(factor, three(run.stages.time_slope)),
    )
