"""Cells in blocks, so that loops over them are vector code without a remainder.

A block holds up to `LANES` cells, field after field. The cells of a contact are spread evenly over its blocks (see
`divided`); the last one is filled up with cells without load. See `cell_loops` for loops over them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from planarfriction._engine.codegen.vectors import Vector, plus
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, at

VECTOR = 8
"""Numbers of the longest vectors that processors have."""

LANES = 64
"""Most cells of a block: several of the longest vectors of processors, so that constants are read once for all."""

Z = LANES * 8
"""Field of a block behind the numbers of the levers and an asymmetry: bristles, three
numbers a cell, of which points use two. Blocks share nothing, so that each is seen to
be free of dependences."""

WEIGHT = LANES * 11
"""Field of a block: weights of the cells."""

BY_LOAD = LANES * 12
"""Field of a block: slopes of the weights by the load."""

BAR = LANES * 13
"""Field of a block: cotangent or change of the bristles."""

OUT = LANES * 16
"""Field of a block: wrench and its change, which add up over the cells; cotangents of their loads."""

HEAVIER = LANES * 22
"""Field of a block: changes of the loads of the cells."""

BLOCK = LANES * 23
"""Numbers of a block: an odd number of fields, for if it were a power of two, blocks would drive each other out of the
cache."""


@kernel
def divided(count: int) -> tuple[int, int]:
    """Return the number of blocks of so many cells and the number of cells in each, a multiple of `VECTOR`."""
    blocks = -(-count // LANES)
    return blocks, -(-count // (blocks * VECTOR)) * VECTOR


class BlockFunctions(NamedTuple):
    """Compiled functions of a kind of cells in blocks."""

    lever: Any
    size: int
    """Components of a bristle."""
    advance: Any
    """`(law, twist, (dt, load), block, lanes)`: step the cells of a block, and return their wrench."""
    retreat: Any
    """`(law, twist, (dt, load, 1 or 0 without load, pull[3]), block, lanes)`: carry the cotangent of the state over a
    step; return the sums of `cell_loops.backward_passes`."""
    pushed: Any
    """`(law, z, u, dt, dz, du, changes of the law, change of the cell's load)`: step a cell and its change."""
    law: Any
    """See `cell_loops.law_of`."""
    vector: Any
    """`(row, first, stride)`: return the components of a bristle."""


@kernel
def totals(w: Doubles, blocks: int, field: int, lanes: int) -> Vector:
    """Return the sums of three fields over all cells."""
    total = (0.0, 0.0, 0.0)
    for k in range(blocks):
        block = at(w, k * BLOCK + field)
        for i in range(lanes):
            total = plus(total, 1.0, (block[i], block[LANES + i], block[2 * LANES + i]))
    return total


@intrinsic(prefer_literal=True)
def scratch(typingctx: Any, count: types.Type) -> Any:
    """Return memory for a constant count of doubles, which lasts until the function returns it is inlined into."""
    if not isinstance(count, types.IntegerLiteral):
        return None

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.ArrayType(ir.DoubleType(), count.literal_value)
        with builder.goto_entry_block():
            place = builder.alloca(kind)
            place.align = 8 * VECTOR
        return builder.bitcast(place, ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(count), generate
