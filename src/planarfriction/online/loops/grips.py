"""Grip forces of the controllers of `planarfriction.online`, for one sample of every part (docs/online.md)."""

import math

import numpy as np

from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction.formulas import LARGEST
from planarfriction.online.loops.friction_filter import NO_SIGN, SEEN_TIME, known

EARLY = 32
"""Number of samples whose medians are the first grip and the load: the last ones before the filters have settled."""

STATE = np.dtype(
    [
        *(
            (name, float)
            for name in (
                "age",
                "span",
                "since",
                "start",
                "load",
                "grip",
                "found",
                "goal",
                "began",
                "balance",
                "caught",
                "eased",
                "force",
                "torque",
                "blind",
                "weight",
                "lately",
                "pressed",
                "count",
                "broke",
                "dipped",
                "before",
                "borne",
                "stood",
                "quiet",
                "mute",
                "weighed",
                "pulls",
                "felt",
                "sent",
                "still",
                "silent",
                "usual",
            )
        ),
        *((name, float, 3) for name in ("slid", "velocity", "same")),
        *((name, float, EARLY) for name in ("forces", "loads")),
    ]
)
"""State of a part in any controller, from the samples so far.

- `age`, `span`, `since`: times since the first sample, since a slip velocity, and since the part slipped [s]
- `start`, `grip`, `load`: grip from which it falls, grip, and largest holding load of late at mu = 1 [N]
- `slid`, `velocity`: displacement, and last slip velocity
- `same`: number of slip velocities in a row that were equal, of each component
- `lately`, `pressed`, `usual`: filtered holding load and grip force, and mean holding load of late [N]
- `forces`, `loads`, `count`: grips and holding loads of the first samples, and their number
- `borne`, `stood`: filtered size of the wrench, and the largest one since the part stuck [N]
- `weighed`, `pulls`: first force, and filtered force of the part [N]
- `felt`, `sent`, `still`: last grip force that was measured, the grip that was asked for when it came [N], and the time
  for which it has been the same [s]
- `blind`: time for which the part falls while the slip sensor does not say so [s]
- `weight`: largest holding load before that [N]
- `mute`, `quiet`: times since wrench and load were plausible, and since a slip velocity along the wrench [s]
- `silent`: 1 while no slip velocity comes, and `OVERDUE` while one is due
- `found`: 1 once friction is found
- `goal`, `began`: goal of a slip on purpose, and time since it began [s]
- `balance`, `caught`: grip that balances the load [N], and 1 once the part is caught
- `broke`: holding load over grip at which the part breaks loose
- `dipped`, `before`: time since a dip of the grip began [s], and displacement then
- `eased`, `force`, `torque`: share of the grip of a hinge that is left, and filtered force and torque
"""

FRESH = np.zeros((), STATE)
"""State before the first sample; what has not begun is infinitely far."""
FRESH["eased"] = 1.0
for _name in ("age", "span", "began"):
    FRESH[_name] = -math.inf
for _name in ("start", "dipped", "forces", "loads"):
    FRESH[_name] = math.inf

LOAD_TIME = 0.3
"""Time in which the largest load of late fades from the grip [s]."""

SETTLED = 0.03
"""Time after which the load of a part is known [s]."""

PAUSE = 0.1
"""Longest time between samples that grips and loads go on by, and between slip velocities while a part is let slip [s].
"""

OVERDUE = 0.5
"""Share of the time for which a slip sensor may be silent from which the grip does not fall [-]."""

LOST = 0.08
"""Share of the wrench that a part loses only if it slips, while the grip is first
lowered [-]."""

LOSES = 0.05
"""Share of the wrench that a part loses only if it slips, once it has stuck in a slip
on purpose [-]."""

LATE = 0.02
"""Time of the filter of that share, after which a slip sensor that works has said so
[s]."""

HALF = 0.5
"""Share of its first force that a part in the hand keeps at least, unless a sensor is wrong or it falls [-]."""

KEEPS = 0.65
"""Share of its mean load of late that a part keeps while it is let slip, unless it accelerates or a sensor is wrong."""

FAST = 4.0
"""Speed in quanta from which a part accelerates, and slips whatever the wrench says [-]."""

FOLLOWS = 0.2
"""Change of the asked grip after which a sensor of the grip force that always says the same is dead [-]."""

COUNTED = 0.5
"""Speed along the wrench, in quanta, below which a slip velocity says that the part sticks [-]."""

REPEATS = 4.0
"""Repetitions from which a slip velocity that is not 0 is that of a frozen sensor [-]."""

FROZEN = 8.0
"""Equal slip velocities in a row from which a grip follows no measurement [-]."""

UNSURE = 1.2
"""Grip of a part whose friction cannot be found, over the one that its load needs at the least friction [-]."""

RELEASE = 1.0
"""Rate at which a grip falls until the part slips [1/s]."""

STICKS = 0.05
"""Time without slip after which a part has stuck [s]."""

STUCK = 1.0
"""Rate at which it falls if a part that is to slip has stuck [1/s]."""

BRAKE = 1.3
"""Grip of a part that has stuck, over the one that balances it: the part stops if its
slip sensor is dead."""

BRAKES = 0.06
"""Time for which a part that has stuck is gripped so [s]."""

SURE = 0.17
"""Time without slip after which the wrench of such a part no longer changes if it has stuck [s]."""

AIM = 0.3
"""Share of the tolerance by which a part is caught before the goal: late samples let it go on."""

REGRIP = 5.0
"""Rate at which the grip of a hinge that was released rises again while the part moves [1/s]."""

HANGS = 0.12
"""Lever of the load of a part that hangs, over the contact radius [-]."""

FORCE_TIME = 0.05
"""Time of the filter of force and torque at a hinge [s]."""

CAUGHT = 1.5
"""Grip after a slip on purpose, over the one that balances the load [-]."""

REACTS = 0.03
"""Time in which a part goes on before a catch acts, beyond the delay that is stated [s]."""

NEAR = 8.0
"""Distance from the goal, over the tolerance, from which a part that sticks is let slip
in dips [-]."""

ENOUGH = 0.7
"""Distance from the goal, over the tolerance, at which a part is left [-]."""

APPROACH = 0.03
"""Time near the grip of a break before a dip [s]."""

DIP = 0.015
"""Time of a dip [s]."""

LONGER = 0.015
"""Time that a dip gains with the root of the distance over the tolerance [s]."""

WAIT = 0.13
"""Pause in which the slip of a dip is seen [s]."""

ABOVE = 1.06
"""Grip before a dip over the one in it [-]."""

DEEPER = 0.03
"""Change of the next dip after one that was too small [-]."""

LITTLE = 0.3
"""Share of the distance from the goal below which the slip of a dip is too small
[-]."""

MUCH = 0.7
"""Share of the distance from the goal above which the slip of a dip is too large
[-]."""

FADES = 0.1
"""Rate at which the largest friction while a part is let slip is forgotten [1/s]."""

SPEED_GAIN = 8.0
"""Acceleration per error of the speed of a slip on purpose [1/s]."""

PLACE_GAIN = 16.0
"""Acceleration per error of the place of a slip on purpose [1/s^2]."""


@kernel
def trapezoid(xp, time, size, duration):
    """Compute place, speed, acceleration at a time [s] of a displacement by `size` whose ramps take a quarter each."""
    ramp = 0.25 * duration
    top = size / (duration - ramp)
    t = xp.minimum(xp.maximum(time, 0.0), duration)
    left = duration - t
    rise = xp.minimum(t, ramp)
    fall = xp.minimum(left, ramp)
    place = top * (
        t - rise + 0.5 * (rise * rise - (ramp - fall) * (ramp - fall)) / ramp
    )
    push = xp.where((t > 0.0) & (t < ramp), 1.0, 0.0) - xp.where(
        (left > 0.0) & (left < ramp), 1.0, 0.0
    )
    return place, top * xp.minimum(rise, fall) / ramp, top / ramp * push


@kernel
def _median(row, count):
    """Return the median of the `count` numbers of a row, the larger of two; its other places are infinite."""
    middle = 0.0
    for i in range(EARLY):
        rank = 0
        for j in range(EARLY):
            rank += 1 if row[j] < row[i] or (row[j] == row[i] and j < i) else 0
        middle = row[i] if 2 * rank <= count < 2 * rank + 2 else middle
    return middle


@kernel
def _repeats(c):
    """Return the number of times in a row for which a component of the slip velocity has been the same."""
    return max(c.same[0], max(c.same[1], c.same[2]))


@kernel
def _speed(c, e):
    """Return the size of the last slip velocity at the rim of the contact, 0 of one that repeats itself."""
    if _repeats(c) >= REPEATS:
        return 0.0
    return math.hypot(
        math.hypot(c.velocity[0], c.velocity[1]), e.radius * c.velocity[2]
    )


@kernel
def _follow(c, e, least_load, quantum, turns, keeps):
    """Take in what an observer found; return the grip at mu = 1 that holds the present load, and the time step.

    A wrench or a load that is missing, or with which the part would have lost its weight, leaves the load as it was; so
    does a slip sensor that is frozen, as the observer learns from it.
    `turns` is the share of the torque that counts in the wrench that the part bears, `keeps` that of the mean load of
    late which a part keeps unless it slips fast: below it, the load is missing.
    """
    if c.age < 0.0 and not e.normal_force > least_load:
        return 0.0, 0.0  # nothing begins before the hand grips
    dt = min(e.dt, PAUSE) if c.age >= 0.0 else 0.0  # the first sample has none
    share = min(dt / LATE, 1.0) if c.age >= SETTLED else 1.0
    force = math.hypot(e.wrench[0], e.wrench[1])
    turn = turns * e.wrench[2] / e.radius
    size = math.hypot(force, turn)
    if e.seen > 0:
        c.borne += share * (size - c.borne)
        c.pulls += share * (force - c.pulls)
    c.still += dt
    if e.normal_force != c.felt:
        c.felt = e.normal_force
        c.sent = c.grip
        c.still = 0.0
    frozen = c.still >= PAUSE and abs(c.grip - c.sent) > FOLLOWS * c.sent
    if frozen:
        c.sent = 0.0  # until the sensor says something else
    # Filtered as the gauge is, else a grip that falls fast seems to lose load.
    if e.seen > 0:
        grown = c.pressed + (e.normal_force - c.pressed) * (
            1.0 - math.exp(-dt / SEEN_TIME)
        )
        c.pressed = grown if c.pressed > 0.0 else e.normal_force
    needed = e.gauge * c.pressed
    lacks = needed < keeps * c.usual and _speed(c, e) < FAST * quantum
    bears = (
        e.seen > 0
        and not (frozen or lacks or _repeats(c) >= FROZEN)
        and (c.age < SETTLED or c.pulls >= HALF * c.weighed)
    )
    c.mute = 0.0 if bears else c.mute + dt
    needed = needed if bears else c.lately
    c.load = max(needed, c.load * math.exp(-dt / LOAD_TIME))
    c.age = max(c.age, 0.0) + dt
    c.span += dt
    v = e.velocity
    c.quiet += dt
    if dt > 0.0 and known(v):
        for i in range(3):
            c.slid[i] += v[i] * c.span if c.span >= 0.0 else 0.0
            c.same[i] = (
                c.same[i] + 1.0 if v[i] == c.velocity[i] and v[i] != 0.0 else 0.0
            )
            c.velocity[i] = v[i]
        along = -(e.wrench[0] * v[0] + e.wrench[1] * v[1] + turn * e.radius * v[2])
        if along >= COUNTED * quantum * size and size > 0.0 and _repeats(c) < REPEATS:
            c.quiet = 0.0
        c.span = 0.0
    if c.age < SETTLED and bears:  # one wrong sample is not the grip, nor the load
        for i in range(EARLY - 1):
            c.forces[i], c.loads[i] = c.forces[i + 1], c.loads[i + 1]
        c.forces[EARLY - 1] = e.normal_force
        c.loads[EARLY - 1] = needed
        c.count = min(c.count + 1.0, float(EARLY))
        c.grip = _median(c.forces, c.count)
        c.load = _median(c.loads, c.count)
        c.weight = c.load
        c.lately = c.load
        c.weighed = c.pulls
    if bears:
        c.lately += share * (min(needed, 1.5 * c.lately) - c.lately)
        c.usual += (
            min(dt / LOAD_TIME, 1.0) * (c.lately - c.usual)
            if c.age >= SETTLED
            else c.lately - c.usual
        )
    return needed, dt


@kernel
def _unsure(c, e, dt, silence, seeks, lost):
    """Return True if friction cannot be found: it contradicts itself, sensors are silent, or slip velocities stay at 0.

    A wrench that a part which sticks bears does not change with the grip, that of one which slips falls with it.
    """
    if not seeks or c.age < SETTLED:
        c.stood = c.borne
    elif c.blind < LATE:
        c.weight = max(c.weight, c.lately)
        c.stood += max(c.borne - c.stood, 0.0) * dt / LOAD_TIME  # not by a tap
        c.blind = (
            c.blind + dt if c.quiet > LATE and c.borne < (1.0 - lost) * c.stood else 0.0
        )
    none = c.span < 0.0 and c.age >= max(silence, PAUSE)
    c.silent = (
        1.0
        if c.span >= silence or none
        else (OVERDUE if c.span > OVERDUE * silence else 0.0)
    )
    return c.silent == 1.0 or c.blind >= LATE or c.mute >= LATE or e.flags >= NO_SIGN


@kernel
def _begin(c, value, most):
    """Return the grip [N] from which a controller first lowers it: the last `value` before the filters have settled."""
    if c.start > LARGEST or c.age < SETTLED:
        c.start = value
    return min(c.start, most)


@kernel
def _set(c, asked, most):
    """Set the grip that is asked for; before the filters have settled and a slip velocity may have come, leave it.

    The grip does not fall while wrench or load are missing, or a slip velocity is overdue.
    """
    asked = max(asked, c.grip) if c.mute > 0.0 or c.silent == OVERDUE else asked
    ready = c.age >= SETTLED and (c.span >= 0.0 or c.age >= PAUSE)
    c.grip = min(max(asked if ready else c.grip, 0.0), most)


@jit
def hold(
    states,
    found,
    least_load,
    quantum,
    silence,
    most,
    least_mu,
    z,
    reserve,
    gain,
    explore,
):
    """Set the grips of `Hold` in states `[P]` from what an observer found `[P]`; `z` is the quantile of mu_c."""
    for p in range(states.shape[0]):
        c = states[p]
        e = found[p]
        _, dt = _follow(c, e, least_load, quantum, 1.0, 0.0)
        slips = e.slip > 0.5
        slid = c.slid
        v = c.velocity
        path = math.hypot(slid[0], slid[1]) + e.radius * abs(slid[2])
        if (
            slips
            and c.quiet <= LATE
            and c.age >= SETTLED
            and (e.determined[0] > 0 or path >= explore)
        ):
            c.found = 1.0
        unsure = _unsure(c, e, dt, silence, c.found == 0.0, LOST)
        low = e.mu_c * math.exp(-z * math.sqrt(e.covariance[0, 0]))
        speed = math.hypot(v[0], v[1]) + e.radius * abs(v[2]) if slips else 0.0
        held = reserve * c.load / low + gain * speed
        start = _begin(c, held, most)
        if c.found == 0.0:
            held = min(start, c.grip if slips else c.grip * math.exp(-RELEASE * dt))
        elif slips:
            held = max(held, start)  # as if nothing were known, until it sticks
        if unsure and (c.found == 0.0 or c.mute >= LATE or e.flags >= NO_SIGN):
            held = UNSURE * max(c.load, c.weight) / least_mu
        _set(c, held, most)


@jit
def slip(
    states,
    found,
    least_load,
    quantum,
    silence,
    most,
    least_mu,
    axis,
    tolerance,
    duration,
    acceleration,
    adapt,
    delay,
):
    """Set the grips of `SlideBy` (axis 1) and `TurnBy` (axis 2) in states `[P]` from what an observer found `[P]`."""
    for p in range(states.shape[0]):
        c = states[p]
        e = found[p]
        needed, dt = _follow(c, e, least_load, quantum, 1.0, KEEPS)
        slips = e.slip > 0.5 or (_speed(c, e) > FAST * quantum and c.span <= LATE)
        goal = abs(c.goal)
        sign = 1.0 if c.goal > 0.0 else -1.0
        v = sign * c.velocity[axis] if slips else 0.0
        x = sign * c.slid[axis]
        c.began += dt
        if slips and c.began < 0.0 and c.age >= SETTLED:
            c.began = 0.0
            c.balance = 1.05 * needed / max(e.gauge, 1e-9)
        # If the slip sensor is right, the wrench stays as it is.
        rests = c.since > SURE and c.quiet > STICKS
        unsure = _unsure(
            c, e, dt, silence, c.began < 0.0 or rests, LOST if c.began < 0.0 else LOSES
        )
        balance = c.balance
        time = c.began + delay if c.began >= 0.0 else 0.0
        place, speed, push = trapezoid(xp, time, goal, duration)
        there = x + v * delay
        left = goal - there
        c.since = 0.0 if slips and c.quiet <= STICKS else c.since + dt
        # Then the wrench is that of the load, and says which grip balances it.
        stuck = c.since > STICKS
        braking = 0.5 * acceleration
        if c.caught == 0.0 and c.pressed > 0.0:
            c.broke = max(c.broke * math.exp(-FADES * dt), c.lately / c.pressed)
        near = stuck and (left < NEAR * tolerance or c.began > duration)
        span = DIP + LONGER * math.sqrt(max(left / tolerance, 0.0))
        far = left - AIM * tolerance - v * REACTS - 0.5 * v * v / braking
        if c.began >= 0.0 and c.caught == 0.0 and (near or far <= 0.0):
            c.caught = 1.0
            # It may be on its way already: no dip before this is seen.
            c.dipped = APPROACH + span
        if slips and c.quiet <= LATE:
            c.balance = min(
                c.balance * math.exp(adapt * (v - speed - 2.0 * (place - there)) * dt),
                LARGEST,
            )
        if stuck and c.began >= 0.0:
            c.balance = 1.1 * needed / e.mu_c
        a = push + SPEED_GAIN * (speed - v) + PLACE_GAIN * (place - there)
        lead = min(max(a / acceleration, -0.6), 0.25 if c.quiet <= LATE else 0.0)
        start = _begin(c, 2.5 * c.load / e.mu_c, most)
        c.dipped += dt
        if c.caught > 0.0:
            if stuck and c.dipped > span + WAIT and left > ENOUGH * tolerance:
                # Before the first dip, of all: it is less deep.
                share = (x - c.before) / (goal - c.before)
                c.broke *= 1.0 + (
                    DEEPER
                    if share < LITTLE
                    else (-0.5 * DEEPER if share > MUCH else 0.0)
                )
                c.dipped = 0.0
                c.before = x
            dips = c.dipped < APPROACH + span and not unsure
            level = (
                c.lately / max(c.broke, 1e-9) * (ABOVE if c.dipped < APPROACH else 1.0)
            )
            asked = level if dips else CAUGHT * max(c.balance, c.load / e.mu_c)
        elif c.began < 0.0:
            asked = min(start, c.grip) * math.exp(-RELEASE * dt)
        else:
            brake = BRAKE if stuck and c.since < STICKS + BRAKES else 1.0
            asked = (
                brake
                * balance
                * (1.0 - lead)
                * math.exp(-STUCK * max(c.since - STICKS - BRAKES, 0.0))
            )
        if unsure:
            asked = UNSURE * max(c.load, c.weight) / least_mu
        _set(c, asked, most)


@jit
def hinge(states, found, least_load, quantum, silence, most, least_mu, reserve, gain):
    """Set the grips of `Hinge` in states `[P]` from what an observer found `[P]`."""
    for p in range(states.shape[0]):
        c = states[p]
        e = found[p]
        # a part that is to turn loses torque, but carries its weight
        _, dt = _follow(c, e, least_load, quantum, 1.0 - c.found, 0.0)
        force = math.hypot(e.wrench[0], e.wrench[1])
        torque = e.wrench[2]
        if xp.in_range(force) and xp.in_range(torque):
            share = dt / FORCE_TIME
            c.force += share * (force - c.force)
            c.torque += share * (torque - c.torque)
        slips = e.slip > 0.5
        v = c.velocity
        if slips and c.age >= SETTLED:
            c.found = 1.0
        # Near the surface a slip is probable, unseen.
        moves = slips and _speed(c, e) >= COUNTED * quantum
        c.since = 0.0 if moves else c.since + dt
        sticks = c.since > STICKS + BRAKES
        brakes = c.found > 0.0 and STICKS < c.since < STICKS + BRAKES
        eases = sticks and abs(c.torque) > HANGS * e.radius * c.force
        rate = -RELEASE if eases else (REGRIP if moves or sticks else 0.0)
        c.eased = min(c.eased * math.exp(rate * dt), 1.0)
        start = _begin(c, 2.5 * c.load / e.mu_c, most)
        speed = math.hypot(v[0], v[1]) if slips else 0.0
        carried = (
            reserve * (BRAKE if brakes else c.eased) * c.force / e.mu_c + gain * speed
        )
        asked = (
            carried if c.found > 0.0 else min(start, c.grip * math.exp(-RELEASE * dt))
        )
        if _unsure(
            c,
            e,
            dt,
            silence,
            c.found == 0.0 or c.since > SURE,
            LOST if c.found == 0.0 else LOSES,
        ):
            asked = UNSURE * max(c.load, c.weight) / least_mu
        _set(c, asked, most)
