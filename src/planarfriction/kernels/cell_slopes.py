"""The adjoint of a step of the cells of a block, pass by pass (see `cell_blocks`).

Passes forth hand the numbers of a step on, and with them what its derivatives need of square roots, exponentials and
sines; passes back carry cotangents through the same functions in the opposite order. Cotangents are those that `derive`
writes, one short function at a time: those of the whole step are a chain of 700 cycles.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels.bristle_step import cap, reachable
from planarfriction.kernels.cell_blocks import (
    BAR,
    BY_LOAD,
    LANES,
    WEIGHT,
    Z,
    end_traction,
    lever_at,
    pair,
    put_pair,
    room,
)
from planarfriction.kernels.derive import derive
from planarfriction.kernels.rules import ratio, slip_slope
from planarfriction.kernels.vectors import accumulate, dot, norm, plus, times


class _Step(NamedTuple):
    """A step of the cells of a block, and the cotangents that come in."""

    block: Any
    work: Any
    """Fields of `_WORK`."""
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


_SEEN, _AHEAD, _END = (LANES * n for n in (0, 6, 12))
"""Views of a bristle at the start of the step, at its predicted end and at its end: six fields each."""

_DEFLECTION, _ALONG, _SIZE, _ALPHA, _SLOPE, _DECAY = (LANES * n for n in range(6))
"""These fields; `_SLOPE` is that of alpha by the deflection."""

_U, _SPEED, _EFFECT, _GRIP, _DECAY_DT, _LEFT, _MEAN, _FREE, _NEW = (LANES * n for n in (18, *range(20, 27), 28))
"""Fields of the step; those that are vectors have two."""

_U_BAR, _BRISTLE_BAR, _SPEED_BAR, _GRIP_BAR = (LANES * n for n in (30, 32, 34, 35))
_DEFLECTION_BAR, _ALONG_BAR, _DECAY_BAR, _START_BAR, _BOUND_BAR = (LANES * n for n in range(36, 41))
"""Cotangents: of the deflection and of the decay those in turn, `_BOUND_BAR` of that deflection which bounds others."""

_WORK = LANES * 41

# ---------------------------------------------------------------------- functions of a bristle


@kernel
def _power(law, speed):
    return formulas.stribeck_power(xp, speed, law)


@kernel
def _grip(law, effect):
    return law.sigma_0 / formulas.stribeck_at(effect, law)


@kernel
def _seen(z, size, u, q):
    return size * q, ratio(dot(z, u), size)


@kernel
def _decay(law, alpha, along, speed, q):
    return formulas.decay_at(xp, alpha, along, speed, q, law)


@kernel
def _bounded(far, start, dt, deflection):
    return xp.minimum(far / (1.0 + start * dt), xp.maximum(deflection, 1.0))


@kernel
def _mean_decay(start, end, dt):
    return formulas.mean_decay(start, end, dt) * dt


@kernel
def _capped(law, free, far, deflection):
    back = cap(far, reachable(deflection, law))
    return times(back, free), far * back


def _ways(function: Any, by: tuple[str, ...], vectors: tuple[str, ...] = ()) -> tuple[Any, Any]:
    """Return the ways forth and back that `derive` writes for a function."""
    written = derive(function, by, vectors)
    return written.forth, written.back


_forth_power, _back_power = _ways(_power, ("speed", "law.v_s", "law.gamma"))
_forth_grip, _back_grip = _ways(_grip, ("effect", "law.sigma_0", "law.mu_c", "law.mu_s"))
_forth_seen, _back_seen = _ways(_seen, ("z", "size", "u", "q"), ("z", "u"))
_forth_decay, _back_decay = _ways(_decay, ("alpha", "along", "speed", "q"))
_forth_bounded, _back_bounded = _ways(_bounded, ("far", "start", "deflection"))
_forth_mean, _back_mean = _ways(_mean_decay, ("start", "end"))
_forth_capped, _back_capped = _ways(_capped, ("free", "far", "deflection"), ("free",))
_SIGMAS = "law.sigma_0", "law.sigma_1", "law.sigma_2"
_forth_traction, _back_traction = _ways(end_traction, ("new", "k", "u", *_SIGMAS), ("new", "u"))


def _pass(body: Any) -> Any:
    """Return the pass over a block that does `body(lever, law, on, i)` for its cells."""

    @kernel
    def over_cells(lever, law, on, lanes):
        for i in range(lanes):  # the body apart: kernel later, it leaves the compiler a loop that it can count
            body(lever, law, on, i)

    return over_cells


def _sum(count: int) -> Any:
    """Return the decorator of a pass that returns the sums of what its body does, of so many numbers."""
    none = (0.0,) * count

    def of_cells(body: Any) -> Any:
        @kernel
        def over_cells(lever, law, on, lanes):
            total = none
            for i in range(lanes):
                total = plus(total, 1.0, body(lever, law, on, i))
            return total

        return over_cells

    return of_cells


# ---------------------------------------------------------------------- forth


@_pass
@kernel
def _drive(lever, law, on, i):
    u = lever.seen(lever_at(lever, on.block, i), on.twist)
    put_pair(on.work, _U, i, u)
    on.work[_SPEED + i] = norm(u)


@_pass
@kernel
def _fade(lever, law, on, i):
    on.work[_EFFECT + i] = xp.exp(-_power(law, on.work[_SPEED + i]))


@_pass
@kernel
def _hold(lever, law, on, i):
    on.work[_GRIP + i] = _grip(law, on.work[_EFFECT + i])


@kernel
def _look(on, to, z, i):
    """Write what is seen of a bristle."""
    work, size = on.work, norm(z)
    work[to + _SIZE + i] = size
    work[to + _DEFLECTION + i], work[to + _ALONG + i] = _seen(z, size, pair(work, _U, i), work[_GRIP + i])


def _slip(to: int) -> Any:
    """Return the pass that writes alpha of a bristle with its slope, and its decay."""

    @_pass
    @kernel
    def slip(lever, law, on, i):
        work, deflection, breakaway = on.work, on.work[to + _DEFLECTION + i], law.breakaway_ratio
        alpha = formulas.slip_fraction(xp, deflection, breakaway)
        work[to + _ALPHA + i], work[to + _SLOPE + i] = alpha, slip_slope(deflection, breakaway)
        work[to + _DECAY + i] = _decay(law, alpha, work[to + _ALONG + i], work[_SPEED + i], work[_GRIP + i])

    return slip


_start, _predict, _finish = map(_slip, (_SEEN, _AHEAD, _END))


@_pass
@kernel
def _see(lever, law, on, i):
    _look(on, _SEEN, pair(on.block, Z, i), i)


@_pass
@kernel
def _look_ahead(lever, law, on, i):
    work = on.work
    _look(on, _AHEAD, plus(pair(on.block, Z, i), on.dt, pair(work, _U, i)), i)
    start, deflection = work[_SEEN + _DECAY + i], work[_SEEN + _DEFLECTION + i]
    work[_AHEAD + _DEFLECTION + i] = _bounded(work[_AHEAD + _DEFLECTION + i], start, on.dt, deflection)


@_pass
@kernel
def _mean(lever, law, on, i):
    on.work[_DECAY_DT + i] = _mean_decay(on.work[_SEEN + _DECAY + i], on.work[_AHEAD + _DECAY + i], on.dt)


@_pass
@kernel
def _relax(lever, law, on, i):
    on.work[_LEFT + i], on.work[_MEAN + i] = formulas.relaxation(xp, on.work[_DECAY_DT + i])


@_pass
@kernel
def _settle(lever, law, on, i):
    work, u = on.work, pair(on.work, _U, i)
    free = plus(times(work[_LEFT + i], pair(on.block, Z, i)), on.dt * work[_MEAN + i], u)
    put_pair(work, _FREE, i, free)
    _look(on, _END, free, i)
    new, reached = _capped(law, free, work[_END + _DEFLECTION + i], work[_SEEN + _DEFLECTION + i])
    put_pair(work, _NEW, i, new)
    work[_END + _DEFLECTION + i] = reached


# ---------------------------------------------------------------------- back


@_sum(4)
@kernel
def _pull_back(lever, law, on, i):
    """Return the cotangents of the load and of sigma_0, sigma_1 and sigma_2."""
    work, block = on.work, on.block
    weight, pulled = block[WEIGHT + i], lever.seen(lever_at(lever, block, i), on.pull)
    (t,), tape = _forth_traction(law, pair(work, _NEW, i), work[_END + _DECAY + i], pair(work, _U, i))
    bars = _back_traction(tape, (times(on.load * weight, pulled),))
    new, work[_DECAY_BAR + i], u = bars[:3]
    put_pair(work, _BRISTLE_BAR, i, plus(new, 0.0 if on.load == 0.0 else 1.0, pair(block, BAR, i)))
    put_pair(work, _U_BAR, i, u)
    work[_SPEED_BAR + i], work[_GRIP_BAR + i] = 0.0, 0.0
    return (weight + on.load * block[BY_LOAD + i]) * dot(pulled, t), bars[3], bars[4], bars[5]


def _slip_back(of: int) -> Any:
    """Return the pass that carries the cotangent of a decay back; it returns that of the breakaway ratio."""

    @_sum(1)
    @kernel
    def slip_back(lever, law, on, i):
        work = on.work
        _, tape = _forth_decay(law, work[of + _ALPHA + i], work[of + _ALONG + i], work[_SPEED + i], work[_GRIP + i])
        alpha, work[_ALONG_BAR + i], speed, grip = _back_decay(tape, (work[_DECAY_BAR + i],))
        accumulate(work, _SPEED_BAR + i, LANES, (speed, grip))
        bar = alpha * work[of + _SLOPE + i]
        work[_DEFLECTION_BAR + i] = bar
        return (formulas.bristle_decay_by_breakaway(xp, bar, work[of + _DEFLECTION + i], law.breakaway_ratio),)

    return slip_back


_start_back, _predict_back, _finish_back = map(_slip_back, (_SEEN, _AHEAD, _END))


@kernel
def _look_back(on, of, z, bar, i):
    """Return the cotangent of a bristle from that of its deflection and of what was seen along it."""
    work, size = on.work, on.work[of + _SIZE + i]
    _, tape = _forth_seen(z, size, pair(work, _U, i), work[_GRIP + i])
    by_z, by_size, u, grip = _back_seen(tape, (bar, work[_ALONG_BAR + i]))
    accumulate(work, _U_BAR + i, LANES, u)
    work[_GRIP_BAR + i] += grip
    return plus(by_z, ratio(by_size, size), z)


@_pass
@kernel
def _settle_back(lever, law, on, i):
    work, free = on.work, pair(on.work, _FREE, i)
    _, tape = _forth_capped(law, free, work[_END + _SIZE + i] * work[_GRIP + i], work[_SEEN + _DEFLECTION + i])
    bars = pair(work, _BRISTLE_BAR, i), work[_DEFLECTION_BAR + i]
    by_free, far, work[_BOUND_BAR + i] = _back_capped(tape, bars)
    put_pair(work, _BRISTLE_BAR, i, plus(by_free, 1.0, _look_back(on, _END, free, far, i)))


@_pass
@kernel
def _relax_back(lever, law, on, i):
    work, free = on.work, pair(on.work, _BRISTLE_BAR, i)
    x, left, mean = work[_DECAY_DT + i], work[_LEFT + i], work[_MEAN + i]
    by_left, by_mean = dot(pair(on.block, Z, i), free), on.dt * dot(pair(work, _U, i), free)
    put_pair(on.block, BAR, i, times(left, free))
    accumulate(work, _U_BAR + i, LANES, times(on.dt * mean, free))
    work[_DECAY_BAR + i] = formulas.relaxation_slope(xp, x, left, mean) * by_mean - left * by_left


@_pass
@kernel
def _mean_back(lever, law, on, i):
    work = on.work
    _, tape = _forth_mean(work[_SEEN + _DECAY + i], work[_AHEAD + _DECAY + i], on.dt)
    work[_START_BAR + i], work[_DECAY_BAR + i] = _back_mean(tape, (work[_DECAY_BAR + i],))


@_pass
@kernel
def _look_ahead_back(lever, law, on, i):
    work, u = on.work, pair(on.work, _U, i)
    far, start = work[_AHEAD + _SIZE + i] * work[_GRIP + i], work[_SEEN + _DECAY + i]
    _, tape = _forth_bounded(far, start, on.dt, work[_SEEN + _DEFLECTION + i])
    by_far, by_start, deflection = _back_bounded(tape, (work[_DEFLECTION_BAR + i],))
    work[_BOUND_BAR + i] += deflection
    work[_DECAY_BAR + i] = work[_START_BAR + i] + by_start
    ahead = _look_back(on, _AHEAD, plus(pair(on.block, Z, i), on.dt, u), by_far, i)
    accumulate(on.block, BAR + i, LANES, ahead)
    accumulate(work, _U_BAR + i, LANES, times(on.dt, ahead))


@_pass
@kernel
def _see_back(lever, law, on, i):
    bar = on.work[_DEFLECTION_BAR + i] + on.work[_BOUND_BAR + i]
    accumulate(on.block, BAR + i, LANES, _look_back(on, _SEEN, pair(on.block, Z, i), bar, i))


@_sum(3)
@kernel
def _hold_back(lever, law, on, i):
    """Return the cotangents of sigma_0, mu_c and mu_s."""
    work = on.work
    effect = work[_EFFECT + i]
    _, tape = _forth_grip(law, effect)
    bars = _back_grip(tape, (work[_GRIP_BAR + i],))
    work[_EFFECT + i] = -effect * bars[0]
    return bars[1:]


@_sum(2)
@kernel
def _fade_back(lever, law, on, i):
    """Return the cotangents of v_s and gamma."""
    work = on.work
    _, tape = _forth_power(law, work[_SPEED + i])
    bars = _back_power(tape, (work[_EFFECT + i],))
    work[_SPEED_BAR + i] += bars[0]
    return bars[1:]


@_sum(3)
@kernel
def _drive_back(lever, law, on, i):
    """Return the cotangent of the twist."""
    work = on.work
    by_speed = ratio(work[_SPEED_BAR + i], work[_SPEED + i])
    u = plus(pair(work, _U_BAR, i), by_speed, pair(work, _U, i))
    return lever.wrench(lever_at(lever, on.block, i), u)


@kernel
def retreat(lever, law, block, lanes, held, pull, load):
    """Carry the cotangent of the state of the cells over the step of `held` twist and dt; return the others."""
    on = _Step(block, room(_WORK), held[0], held[1], pull, load)
    _drive(lever, law, on, lanes)
    _fade(lever, law, on, lanes)
    _hold(lever, law, on, lanes)
    _see(lever, law, on, lanes)
    _start(lever, law, on, lanes)
    _look_ahead(lever, law, on, lanes)
    _predict(lever, law, on, lanes)
    _mean(lever, law, on, lanes)
    _relax(lever, law, on, lanes)
    _settle(lever, law, on, lanes)
    _finish(lever, law, on, lanes)
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
    v_s, gamma = _fade_back(lever, law, on, lanes)
    law_bar = by_spring + sigma_0, sigma_1, sigma_2, mu_c, mu_s, v_s, gamma, end[0] + ahead[0] + start[0]
    return StepBars(_drive_back(lever, law, on, lanes), by_load, law_bar)
