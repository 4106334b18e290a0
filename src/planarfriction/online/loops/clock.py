"""Time steps of samples from a clock that may stop, jump or run at a wrong rate."""

from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel

RESTART = 10.0
"""Samples in a row with an odd time after which the clock is set anew, and samples count as the period apart."""

ODD = 30.0
"""Ratio of a time step to the period, or of the period to a time step, above which the clock has jumped [-]."""

STEADIES = 100.0
"""Samples after which the period is known well enough to doubt the clock by it."""

PERIODS = 10.0
"""Samples over which the mean of the period is taken."""


@kernel
def time_step(s, now):
    """Return the time step [s] of a sample, 0 for one that is left out; `back` tells if its time is odd.

    Time is odd if it is missing, does not go on, or jumps. A jump is a pause if it stays alone; if odd times go on, the
    clock is wrong, and samples are the last good period apart.
    """
    dt = now - s.time
    period = s.period
    known = s.steady >= STEADIES
    there = xp.in_range(now)
    far = there and known and dt > ODD * period
    if there and dt > 0.0 and not far and (not known or ODD * dt >= period):
        s.back = 0.0
        if dt <= 1.0:  # not the first sample, nor a long pause
            s.steady = min(s.steady + 1.0, STEADIES)
            step = min(max(dt, 0.5 * period), 2.0 * period) if period > 0.0 else dt
            s.period += (step - period) / min(s.steady, PERIODS)
    else:
        s.back += 1.0
        pause = far and s.back == 1.0
        dt = dt if pause else (period if s.back > RESTART else 0.0)
    if not there:
        s.time += dt
    elif s.back == 0.0 or s.back >= RESTART or far:
        s.time = now
    return dt if dt <= 1.0 else (period if period > 0.0 else 1e-3)
