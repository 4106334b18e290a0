"""The adjoint of a step of the cells of a block, pass by pass, back over the passes of `cell_passes`.

Cotangents are those that `derive` writes, one short function at a time: those of the whole step are a chain of 700
cycles. Square roots, exponentials and sines are not taken again.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels import bristle_step, cell_passes
from planarfriction.kernels.cell_blocks import BAR, BY_LOAD, LANES, WEIGHT, Z, lever_at, pair, put_pair, room
from planarfriction.kernels.cell_passes import (
    AHEAD,
    ALONG,
    ALPHA,
    DECAY,
    DECAY_DT,
    DEFLECTION,
    EFFECT,
    END,
    FREE,
    GRIP,
    LEFT,
    MEAN,
    NEW,
    SEEN,
    SIZE,
    SPEED,
    U,
    over_cells,
    sum_over_cells,
)
from planarfriction.kernels.derive import derive
from planarfriction.kernels.law import squared
from planarfriction.kernels.rules import ratio, slip_slope
from planarfriction.kernels.vectors import accumulate, dot, plus, times


class _Step(NamedTuple):
    """A `cell_passes.Step` and the cotangents that come in."""

    block: Any
    work: Any
    twist: tuple
    dt: float
    pull: tuple
    """Cotangent of the wrench."""
    load: float


class StepBars(NamedTuple):
    """Cotangents that add up over the cells; that of the law in the order of `cells_rollout.PARAMETERS`."""

    twist: tuple
    load: float
    law: tuple


_U_BAR, _BRISTLE_BAR, _SPEED_BAR, _GRIP_BAR = (cell_passes.FIELDS + LANES * n for n in (0, 2, 4, 5))
_DEFLECTION_BAR, _ALONG_BAR, _DECAY_BAR, _START_BAR, _BOUND_BAR = (cell_passes.FIELDS + LANES * n for n in range(6, 11))
"""Cotangents: of the deflection and of the decay those in turn, `_BOUND_BAR` of that which the cap starts from."""

_WORK = cell_passes.FIELDS + LANES * 11


def _ways(function: Any, by: tuple[str, ...], vectors: tuple[str, ...] = ()) -> tuple[Any, Any]:
    """Return the ways forth and back that `derive` writes for a function."""
    written = derive(function, by, vectors)
    return written.forth, written.back


_forth_power, _back_power = _ways(cell_passes.power, ("speed", "law.v_s", "law.gamma"))
_forth_grip, _back_grip = _ways(cell_passes.grip_at, ("effect", "law.sigma_0", "law.mu_c", "law.mu_s"))
_forth_seen, _back_seen = _ways(bristle_step.seen, ("z", "size", "u", "q"), ("z", "u"))
_forth_decay, _back_decay = _ways(cell_passes.decay, ("alpha", "along", "speed", "q"))
_forth_bounded, _back_bounded = _ways(bristle_step.bounded, ("far", "start"))
_forth_mean, _back_mean = _ways(cell_passes.mean_decay, ("start", "end"))
_forth_capped, _back_capped = _ways(bristle_step.capped, ("free", "far", "deflection"), ("free",))
_SIGMAS = "law.sigma_0", "law.sigma_1", "law.sigma_2"
_forth_traction, _back_traction = _ways(cell_passes.end_traction, ("new", "k", "u", *_SIGMAS), ("new", "u"))


@sum_over_cells(4)
@kernel
def _pull_back(lever, law, on, i):
    """Return the cotangents of the load and of sigma_0, sigma_1 and sigma_2."""
    work, block = on.work, on.block
    weight, pulled = block[WEIGHT + i], lever.seen(lever_at(lever, block, i), on.pull)
    (t,), tape = _forth_traction(law, pair(work, NEW, i), work[END + DECAY + i], pair(work, U, i))
    bars = _back_traction(tape, (times(on.load * weight, pulled),))
    new, work[_DECAY_BAR + i], u = bars[:3]
    put_pair(work, _BRISTLE_BAR, i, plus(new, 0.0 if on.load == 0.0 else 1.0, pair(block, BAR, i)))
    put_pair(work, _U_BAR, i, u)
    work[_SPEED_BAR + i], work[_GRIP_BAR + i] = 0.0, 0.0
    return (weight + on.load * block[BY_LOAD + i]) * dot(pulled, t), bars[3], bars[4], bars[5]


def _slip_back(of: int) -> Any:
    """Return the pass that carries the cotangent of a decay back; it returns that of the breakaway ratio."""

    @sum_over_cells(1)
    @kernel
    def slip_back(lever, law, on, i):
        work = on.work
        _, tape = _forth_decay(law, work[of + ALPHA + i], work[of + ALONG + i], work[SPEED + i], work[GRIP + i])
        alpha, work[_ALONG_BAR + i], speed, grip = _back_decay(tape, (work[_DECAY_BAR + i],))
        accumulate(work, _SPEED_BAR + i, LANES, (speed, grip))
        deflection, breakaway = work[of + DEFLECTION + i], law.breakaway_ratio
        bar = alpha * slip_slope(deflection, breakaway)
        work[_DEFLECTION_BAR + i] = bar
        return (formulas.bristle_decay_by_breakaway(xp, bar, deflection, breakaway),)

    return slip_back


_start_back, _predict_back, _finish_back = map(_slip_back, (SEEN, AHEAD, END))


@kernel
def _look_back(on, of, z, bar, i):
    """Return the cotangent of a bristle from that of its deflection and of what was seen along it."""
    work, size = on.work, on.work[of + SIZE + i]
    _, tape = _forth_seen(z, size, pair(work, U, i), 1.0, work[GRIP + i])
    by_z, by_size, u, grip = _back_seen(tape, (bar, work[_ALONG_BAR + i]))
    accumulate(work, _U_BAR + i, LANES, u)
    work[_GRIP_BAR + i] += grip
    return plus(by_z, ratio(by_size, size), z)


@over_cells
@kernel
def _settle_back(lever, law, on, i):
    work, free = on.work, pair(on.work, FREE, i)
    _, tape = _forth_capped(law, free, work[END + SIZE + i] * work[GRIP + i], work[SEEN + DEFLECTION + i])
    bars = pair(work, _BRISTLE_BAR, i), work[_DEFLECTION_BAR + i]
    by_free, far, work[_BOUND_BAR + i] = _back_capped(tape, bars)
    put_pair(work, _BRISTLE_BAR, i, plus(by_free, 1.0, _look_back(on, END, free, far, i)))


@over_cells
@kernel
def _relax_back(lever, law, on, i):
    work, free = on.work, pair(on.work, _BRISTLE_BAR, i)
    x, left, mean = work[DECAY_DT + i], work[LEFT + i], work[MEAN + i]
    by_left, by_mean = dot(pair(on.block, Z, i), free), on.dt * dot(pair(work, U, i), free)
    put_pair(on.block, BAR, i, times(left, free))
    accumulate(work, _U_BAR + i, LANES, times(on.dt * mean, free))
    work[_DECAY_BAR + i] = formulas.relaxation_slope(xp, x, left, mean) * by_mean - left * by_left


@over_cells
@kernel
def _mean_back(lever, law, on, i):
    work = on.work
    _, tape = _forth_mean(work[SEEN + DECAY + i], work[AHEAD + DECAY + i], on.dt)
    work[_START_BAR + i], work[_DECAY_BAR + i] = _back_mean(tape, (work[_DECAY_BAR + i],))


@over_cells
@kernel
def _look_ahead_back(lever, law, on, i):
    work, u = on.work, pair(on.work, U, i)
    far, start = work[AHEAD + SIZE + i] * work[GRIP + i], work[SEEN + DECAY + i]
    _, tape = _forth_bounded(far, start, on.dt, work[SEEN + DEFLECTION + i])
    by_far, by_start = _back_bounded(tape, (work[_DEFLECTION_BAR + i],))  # none by the bound, where alpha is held
    work[_DECAY_BAR + i] = work[_START_BAR + i] + by_start
    ahead = _look_back(on, AHEAD, plus(pair(on.block, Z, i), on.dt, u), by_far, i)
    accumulate(on.block, BAR + i, LANES, ahead)
    accumulate(work, _U_BAR + i, LANES, times(on.dt, ahead))


@over_cells
@kernel
def _see_back(lever, law, on, i):
    bar = on.work[_DEFLECTION_BAR + i] + on.work[_BOUND_BAR + i]
    accumulate(on.block, BAR + i, LANES, _look_back(on, SEEN, pair(on.block, Z, i), bar, i))


@sum_over_cells(3)
@kernel
def _hold_back(lever, law, on, i):
    """Return the cotangents of sigma_0, mu_c and mu_s."""
    work = on.work
    effect = work[EFFECT + i]
    _, tape = _forth_grip(law, effect)
    bars = _back_grip(tape, (work[_GRIP_BAR + i],))
    work[EFFECT + i] = -effect * bars[0]
    return bars[1:]


@sum_over_cells(2)
@kernel
def _fade_back(lever, law, on, i):
    """Return the cotangents of v_s and gamma."""
    work = on.work
    _, tape = _forth_power(law, work[SPEED + i])
    bars = _back_power(tape, (work[EFFECT + i],))
    work[_SPEED_BAR + i] += bars[0]
    return bars[1:]


@sum_over_cells(3)
@kernel
def _drive_back(lever, law, on, i):
    """Return the cotangent of the twist."""
    work = on.work
    by_speed = ratio(work[_SPEED_BAR + i], work[SPEED + i])
    u = plus(pair(work, _U_BAR, i), by_speed, pair(work, U, i))
    return lever.wrench(lever_at(lever, on.block, i), u)


@kernel
def retreat(lever, law, block, lanes, held, pull, load):
    """Carry the cotangent of the state of the cells over the step of `held` twist and dt; return the others."""
    on = _Step(block, room(_WORK), held[0], held[1], pull, load)
    cell_passes.step(lever, law, on, lanes)
    by_load, by_spring, sigma_1, sigma_2 = _pull_back(lever, law, on, lanes)
    end = _finish_back(lever, law, on, lanes)
    _settle_back(lever, law, on, lanes)
    _relax_back(lever, law, on, lanes)
    _mean_back(lever, law, on, lanes)
    ahead = _predict_back(lever, law, on, lanes)
    _look_ahead_back(lever, law, on, lanes)
    start = _start_back(lever, law, on, lanes)
    _see_back(lever, law, on, lanes)
    sigma_0, mu_c, mu_s = _hold_back(lever, law, on, lanes)
    if law.gamma == 2.0:
        v_s, gamma = _fade_back(lever, squared(law), on, lanes)
    else:
        v_s, gamma = _fade_back(lever, law, on, lanes)
    law_bar = by_spring + sigma_0, sigma_1, sigma_2, mu_c, mu_s, v_s, gamma, end[0] + ahead[0] + start[0]
    return StepBars(_drive_back(lever, law, on, lanes), by_load, law_bar)
