"""The step of the cells of a block (see `cell_blocks`), pass by pass, by the equations of `bristle_step`.

A pass does a few operations for all cells, so that the processor has many cells in flight; as one pass, the step of a
vector of cells is a chain of 400 cycles. What passes hand on stays in fields that all blocks share, and so in the
nearest cache; derivatives (see `cell_slopes`) go back over the same fields.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import at
from planarfriction.kernels.bristle_step import bounded, capped, seen
from planarfriction.kernels.cell_blocks import BLOCK, LANES, WEIGHT, Z, lever_at, pair, put_pair, room
from planarfriction.kernels.contacts import traction
from planarfriction.kernels.law import squared
from planarfriction.kernels.vectors import norm, plus, times


class Step(NamedTuple):
    """A step of the cells of a block."""

    block: Any
    work: Any
    """Fields that passes hand on."""
    twist: tuple
    dt: float


SEEN, AHEAD, END = (LANES * n for n in (0, 5, 10))
"""Views of a bristle at the start of the step, at its predicted end and at its end, five fields each."""

DEFLECTION, ALONG, SIZE, ALPHA, DECAY = (LANES * n for n in range(5))
"""These fields."""

U, SPEED, EFFECT, GRIP, DECAY_DT, LEFT, MEAN, FREE, NEW = (LANES * n for n in (15, *range(17, 24), 25))
"""Fields of the step; those that are vectors have two."""

FIELDS = LANES * 27
"""First number behind these fields, where others may begin."""

# ---------------------------------------------------------------------- functions of a bristle


@kernel
def power(law, speed):
    """Return `(v/v_s)^gamma`."""
    return formulas.stribeck_power(xp, speed, law)


@kernel
def grip_at(law, effect):
    """Return one over the steady deflection, from the Stribeck effect."""
    return law.sigma_0 / formulas.stribeck_at(effect, law)


@kernel
def decay(law, alpha, along, speed, q):
    """Return k."""
    return formulas.decay_at(xp, alpha, along, speed, q, law)


@kernel
def mean_decay(start, end, dt):
    """Return the mean decay times dt."""
    return formulas.mean_decay(start, end, dt) * dt


@kernel
def end_traction(law, new, k, u):
    """Return the traction of a cell at the end of its step, per unit load."""
    return traction(law, new, plus(u, -k, new), u)


# ---------------------------------------------------------------------- passes


def over_cells(body: Any) -> Any:
    """Return the pass over a block that does `body(lever, law, on, i)` for its cells."""

    @kernel
    def run(lever, law, on, lanes):
        for i in range(lanes):  # the body apart: kernel later, it leaves the compiler a loop that it can count
            body(lever, law, on, i)

    return run


def sum_over_cells(count: int) -> Any:
    """Return the decorator of a pass that returns the sums of so many numbers that its body returns."""
    none = (0.0,) * count

    def of_cells(body: Any) -> Any:
        @kernel
        def run(lever, law, on, lanes):
            total = none
            for i in range(lanes):
                total = plus(total, 1.0, body(lever, law, on, i))
            return total

        return run

    return of_cells


@over_cells
@kernel
def _drive(lever, law, on, i):
    u = lever.seen(lever_at(lever, on.block, i), on.twist)
    put_pair(on.work, U, i, u)
    on.work[SPEED + i] = norm(u)


@over_cells
@kernel
def _fade(lever, law, on, i):
    on.work[EFFECT + i] = xp.exp(-power(law, on.work[SPEED + i]))


@over_cells
@kernel
def _hold(lever, law, on, i):
    on.work[GRIP + i] = grip_at(law, on.work[EFFECT + i])


@kernel
def _look(on, to, z, i):
    """Write what is seen of a bristle."""
    work, size = on.work, norm(z)
    work[to + SIZE + i] = size
    work[to + DEFLECTION + i], work[to + ALONG + i] = seen(z, size, pair(work, U, i), 1.0, work[GRIP + i])


@over_cells
@kernel
def _see(lever, law, on, i):
    _look(on, SEEN, pair(on.block, Z, i), i)


@over_cells
@kernel
def _look_ahead(lever, law, on, i):
    work = on.work
    _look(on, AHEAD, plus(pair(on.block, Z, i), on.dt, pair(work, U, i)), i)
    start, deflection = work[SEEN + DECAY + i], work[SEEN + DEFLECTION + i]
    work[AHEAD + DEFLECTION + i] = bounded(work[AHEAD + DEFLECTION + i], start, on.dt, deflection)


def _slip(view: int) -> Any:
    """Return the pass that writes alpha and the decay of a bristle."""

    @over_cells
    @kernel
    def slip(lever, law, on, i):
        work = on.work
        alpha = formulas.slip_fraction(xp, work[view + DEFLECTION + i], law.breakaway_ratio)
        work[view + ALPHA + i] = alpha
        work[view + DECAY + i] = decay(law, alpha, work[view + ALONG + i], work[SPEED + i], work[GRIP + i])

    return slip


_start, _predict, _finish = map(_slip, (SEEN, AHEAD, END))


@over_cells
@kernel
def _mean(lever, law, on, i):
    on.work[DECAY_DT + i] = mean_decay(on.work[SEEN + DECAY + i], on.work[AHEAD + DECAY + i], on.dt)


@over_cells
@kernel
def _relax(lever, law, on, i):
    on.work[LEFT + i], on.work[MEAN + i] = formulas.relaxation(xp, on.work[DECAY_DT + i])


@over_cells
@kernel
def _settle(lever, law, on, i):
    work, u = on.work, pair(on.work, U, i)
    free = plus(times(work[LEFT + i], pair(on.block, Z, i)), on.dt * work[MEAN + i], u)
    put_pair(work, FREE, i, free)
    _look(on, END, free, i)
    new, work[END + DEFLECTION + i] = capped(law, free, work[END + DEFLECTION + i], work[SEEN + DEFLECTION + i])
    put_pair(work, NEW, i, new)


@kernel
def step(lever, law, on, lanes):
    """Write the fields of a step."""
    _drive(lever, law, on, lanes)
    if law.gamma == 2.0:
        _fade(lever, squared(law), on, lanes)
    else:
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


@sum_over_cells(3)
@kernel
def _pull(lever, law, on, i):
    """Take the new bristle of a cell, and return its wrench."""
    work, block, new = on.work, on.block, pair(on.work, NEW, i)
    put_pair(block, Z, i, new)
    t = end_traction(law, new, work[END + DECAY + i], pair(work, U, i))
    return lever.wrench(lever_at(lever, block, i), times(block[WEIGHT + i], t))


@kernel
def advance(lever, law, w, blocks, lanes, twist, dt):
    """Step the cells at a held twist, and return their wrench.

    `lanes` is `LANES` or less, but the compiler must not know it: a loop of constant count it would write out cell by
    cell.
    """
    work, total = room(FIELDS), (0.0, 0.0, 0.0)
    for k in range(blocks):
        on = Step(at(w, k * BLOCK), work, twist, dt)
        step(lever, law, on, lanes)
        total = plus(total, 1.0, _pull(lever, law, on, lanes))
    return total
