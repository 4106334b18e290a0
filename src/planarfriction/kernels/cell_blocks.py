"""Cells in blocks, so that loops over them are vector code without a remainder.

A block holds up to `LANES` cells, field after field. The cells of a contact are spread evenly over its blocks (see
`divided`); the last one is filled up with cells without load. A step goes over a block in short passes, in which the
processor has many cells in flight; as one pass, the step of a vector of cells is a chain of 400 cycles.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import at
from planarfriction.kernels import bristle_step
from planarfriction.kernels.contacts import traction
from planarfriction.kernels.law import grip
from planarfriction.kernels.vectors import norm, plus, times

VECTOR = 8
"""Numbers of the longest vectors that processors have."""

LANES = 64
"""Most cells of a block: several of the longest vectors of processors, so that constants are read once for all."""

Z, WEIGHT, BY_LOAD, BAR, OUT, LAW_BAR = (LANES * n for n in (5, 7, 8, 9, 11, 17))
"""Fields of a block behind the numbers of the levers: state, weights, their slopes by the load, cotangent or change of
the state, what adds up over the cells (the wrench and its change; on the way back the cotangents of twist and load),
and what adds up over the steps too: the cotangent of the law. Blocks share nothing, so that each is seen to be free of
dependences."""

BLOCK = LANES * 25
"""Numbers of a block: an odd number of fields, for if it were a power of two, blocks would drive each other out of the
cache."""


@kernel
def divided(count):
    """Return the number of blocks of so many cells and the number of cells in each, a multiple of `VECTOR`."""
    blocks = -(-count // LANES)
    return blocks, -(-count // (blocks * VECTOR)) * VECTOR


class Block(NamedTuple):
    """A block as `cells.Lever` reads it."""

    cells: Any
    count: int


@kernel
def pair(block, field, i):
    """Return two fields of cell i."""
    return block[field + i], block[field + LANES + i]


@kernel
def put_pair(block, field, i, a):
    """Write two fields of cell i."""
    block[field + i], block[field + LANES + i] = a


@kernel
def lever_at(lever, block, i):
    """Return the numbers of the lever of cell i."""
    return lever.of(Block(block, LANES), i)


@kernel
def clear(block, count):
    """Write zeros."""
    for i in range(count):
        block[i] = 0.0


@kernel
def totals(w, blocks, field, lanes):
    """Return the sums of three fields over all cells."""
    total = (0.0, 0.0, 0.0)
    for k in range(blocks):
        block = at(w, k * BLOCK + field)
        for i in range(lanes):
            total = plus(total, 1.0, (block[i], block[LANES + i], block[2 * LANES + i]))
    return total


@kernel
def total(w, blocks, field, lanes):
    """Return the sum of a field over all cells."""
    total = 0.0
    for k in range(blocks):
        block = at(w, k * BLOCK + field)
        for i in range(lanes):
            total += block[i]
    return total


@intrinsic(prefer_literal=True)
def room(typingctx, count):
    """Return memory for a constant count of doubles, which lasts until the function returns it is inlined into."""
    if not isinstance(count, types.IntegerLiteral):
        return None

    def generate(context, builder, signature, args):
        kind = ir.ArrayType(ir.DoubleType(), count.literal_value)
        with builder.goto_entry_block():
            place = builder.alloca(kind)
            place.align = 8 * VECTOR
        return builder.bitcast(place, ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(count), generate


# ---------------------------------------------------------------------- a step, pass by pass


class _Step(NamedTuple):
    """A block, what the passes of its step hand on, and what drives it."""

    block: Any
    work: Any
    twist: tuple
    dt: float


_U, _SPEED, _GRIP, _DEFLECTION, _REACHED, _ALONG, _START, _DECAY, _MEAN = (LANES * n for n in (0, *range(2, 10)))
"""Fields that passes hand on; all blocks share them, so that they stay in the nearest cache."""

_WORK = LANES * 10


def _pass(body: Any) -> Any:
    """Return the pass over a block that does `body(lever, law, on, i)` for its cells."""

    @kernel
    def over_cells(lever, law, on, lanes):
        for i in range(lanes):  # the body apart: kernel later, it leaves the compiler a loop that it can count
            body(lever, law, on, i)

    return over_cells


@kernel
def _decay(law, on, deflection, i):
    """Return the decay of a bristle of this deflection, the last that was seen."""
    work = on.work
    return formulas.bristle_decay(xp, work[deflection + i], work[_ALONG + i], work[_SPEED + i], work[_GRIP + i], law)


@_pass
@kernel
def _drive(lever, law, on, i):
    u = lever.seen(lever_at(lever, on.block, i), on.twist)
    put_pair(on.work, _U, i, u)
    on.work[_SPEED + i] = norm(u)


@_pass
@kernel
def _hold(lever, law, on, i):
    on.work[_GRIP + i] = grip(law, on.work[_SPEED + i])


@_pass
@kernel
def _see(lever, law, on, i):
    seen = bristle_step.seen(pair(on.block, Z, i), pair(on.work, _U, i), 1.0, on.work[_GRIP + i])
    on.work[_DEFLECTION + i], on.work[_ALONG + i] = seen


@_pass
@kernel
def _start(lever, law, on, i):
    on.work[_START + i] = _decay(law, on, _DEFLECTION, i)


@_pass
@kernel
def _look_ahead(lever, law, on, i):
    work, z, u = on.work, pair(on.block, Z, i), pair(on.work, _U, i)
    deflection, start = work[_DEFLECTION + i], work[_START + i]
    work[_REACHED + i], work[_ALONG + i] = bristle_step.ahead(z, u, 1.0, work[_GRIP + i], on.dt, deflection, start)


@_pass
@kernel
def _end(lever, law, on, i):
    on.work[_DECAY + i] = _decay(law, on, _REACHED, i)


@_pass
@kernel
def _average(lever, law, on, i):
    work = on.work
    work[_DECAY + i] = formulas.mean_decay(work[_START + i], work[_DECAY + i], on.dt) * on.dt


@_pass
@kernel
def _relax(lever, law, on, i):
    on.work[_DECAY + i], on.work[_MEAN + i] = formulas.relaxation(xp, on.work[_DECAY + i])


@_pass
@kernel
def _settle(lever, law, on, i):
    work, u = on.work, pair(on.work, _U, i)
    free = plus(times(work[_DECAY + i], pair(on.block, Z, i)), on.dt * work[_MEAN + i], u)
    new, work[_REACHED + i], work[_ALONG + i] = bristle_step.settle(
        law, free, u, 1.0, work[_GRIP + i], work[_DEFLECTION + i]
    )
    put_pair(on.block, Z, i, new)


@kernel
def end_traction(law, new, k, u):
    """Return the traction of a cell at the end of its step, per unit load."""
    return traction(law, new, plus(u, -k, new), u)


@kernel
def _pull(lever, law, on, i):
    """Return the wrench of a cell."""
    t = end_traction(law, pair(on.block, Z, i), on.work[_DECAY + i], pair(on.work, _U, i))
    return lever.wrench(lever_at(lever, on.block, i), times(on.block[WEIGHT + i], t))


@kernel
def _pull_all(lever, law, on, lanes):
    total = (0.0, 0.0, 0.0)
    for i in range(lanes):
        total = plus(total, 1.0, _pull(lever, law, on, i))
    return total


@kernel
def advance(lever, law, w, blocks, lanes, twist, dt):
    """Step the cells at a held twist, and return their wrench.

    `lanes` is `LANES` or less, but the compiler must not know it: a loop of constant count it would write out cell by
    cell.
    """
    work, total = room(_WORK), (0.0, 0.0, 0.0)
    for k in range(blocks):
        on = _Step(at(w, k * BLOCK), work, twist, dt)
        _drive(lever, law, on, lanes)
        _hold(lever, law, on, lanes)
        _see(lever, law, on, lanes)
        _start(lever, law, on, lanes)
        _look_ahead(lever, law, on, lanes)
        _end(lever, law, on, lanes)
        _average(lever, law, on, lanes)
        _relax(lever, law, on, lanes)
        _settle(lever, law, on, lanes)
        _end(lever, law, on, lanes)
        total = plus(total, 1.0, _pull_all(lever, law, on, lanes))
    return total
