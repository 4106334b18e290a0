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

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import at
from planarfriction.kernels import bristle_step
from planarfriction.kernels.contacts import traction
from planarfriction.kernels.law import grip
from planarfriction.kernels.vectors import norm, plus, scatter, times

VECTOR = 8
"""Numbers of the longest vectors that processors have."""

LANES = 64
"""Most cells of a block: several of the longest vectors of processors, so that constants are read once for all."""

Z, WEIGHT, BY_LOAD, BAR, OUT, LAW_BAR = (LANES * n for n in (5, 7, 8, 9, 11, 17))
"""Fields of a block behind the numbers of the levers: state, weights, their slopes by the load, cotangent or change of
the state, what adds up over the cells (the wrench and its change; on the way back the cotangents of twist and load),
and what adds up over the steps too: the cotangent of the law. Blocks share nothing, so that each is seen to be free of
dependences."""

_U, _SPEED, _GRIP, _DEFLECTION, _START, _DECAY = (LANES * n for n in (25, 27, 28, 29, 30, 31))
"""Fields that passes of a step hand on."""

BLOCK = LANES * 33
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


@kernel
def end_traction(law, new, k, u):
    """Return the traction of a cell at the end of its step, per unit load."""
    return traction(law, new, plus(u, -k, new), u)


@kernel
def _drive(lever, law, block, i, twist):
    u = lever.seen(lever_at(lever, block, i), twist)
    speed = norm(u)
    put_pair(block, _U, i, u)
    block[_SPEED + i], block[_GRIP + i] = speed, grip(law, speed)


@kernel
def _begin(law, block, i):
    deflection, start = bristle_step.begin(
        law, pair(block, Z, i), pair(block, _U, i), block[_SPEED + i], 1.0, block[_GRIP + i]
    )
    block[_DEFLECTION + i], block[_START + i] = deflection, start


@kernel
def _aim(law, block, i, dt):
    z, u, v, q = pair(block, Z, i), pair(block, _U, i), block[_SPEED + i], block[_GRIP + i]
    block[_DECAY + i] = bristle_step.aim(law, z, u, v, 1.0, q, dt, block[_DEFLECTION + i], block[_START + i])


@kernel
def _relax(block, i, dt):
    put_pair(block, Z, i, bristle_step.relax(pair(block, Z, i), pair(block, _U, i), dt, block[_DECAY + i]))


@kernel
def _settle(lever, law, block, i):
    free, u, v, q = pair(block, Z, i), pair(block, _U, i), block[_SPEED + i], block[_GRIP + i]
    new, k = bristle_step.settle(law, free, u, v, 1.0, q, block[_DEFLECTION + i])
    put_pair(block, Z, i, new)
    pull = times(block[WEIGHT + i], end_traction(law, new, k, u))
    scatter(block, OUT + i, LANES, lever.wrench(lever_at(lever, block, i), pull))


@kernel
def _drive_all(lever, law, block, twist, lanes):
    for i in range(lanes):  # the body apart: kernel later, it leaves the compiler a loop that it can count
        _drive(lever, law, block, i, twist)


@kernel
def _begin_all(law, block, lanes):
    for i in range(lanes):
        _begin(law, block, i)


@kernel
def _aim_all(law, block, dt, lanes):
    for i in range(lanes):
        _aim(law, block, i, dt)


@kernel
def _relax_all(block, dt, lanes):
    for i in range(lanes):
        _relax(block, i, dt)


@kernel
def _settle_all(lever, law, block, lanes):
    for i in range(lanes):
        _settle(lever, law, block, i)


@kernel
def advance(lever, law, w, blocks, lanes, twist, dt):
    """Step the cells at a held twist, and write their wrenches.

    `lanes` is `LANES`, but the compiler must not know it: a loop of constant count it would write out cell by cell.
    """
    for k in range(blocks):
        _drive_all(lever, law, at(w, k * BLOCK), twist, lanes)
    for k in range(blocks):
        _begin_all(law, at(w, k * BLOCK), lanes)
    for k in range(blocks):
        _aim_all(law, at(w, k * BLOCK), dt, lanes)
    for k in range(blocks):
        _relax_all(at(w, k * BLOCK), dt, lanes)
    for k in range(blocks):
        _settle_all(lever, law, at(w, k * BLOCK), lanes)
