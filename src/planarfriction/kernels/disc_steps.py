"""Contacts of discs as solver and steps call them (see `disc_passes` for their loops)."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import at
from planarfriction.kernels import cells, disc_cells, distributed_step
from planarfriction.kernels.cell_blocks import BLOCK, LANES, divided, room
from planarfriction.kernels.contacts import ModelFunctions, functions_of
from planarfriction.kernels.disc_passes import RATES_AT, SLOPES_AT, forward_passes, rate_passes, slope_passes
from planarfriction.kernels.general_cells import RATES
from planarfriction.kernels.passes import Passes
from planarfriction.kernels.steps import StepFunctions, step_functions
from planarfriction.kernels.vectors import plus, put, three

LEVERS = ("discs", disc_cells.POSITIONS, 3), ("turned_discs", disc_cells.LEVERS, 6)
"""Name, lever and numbers of a lever of discs, and of discs with a metric."""


def advance_of(written: Passes) -> Any:
    """Return `cell_blocks.Kind.advance` from the passes of a step."""
    step, numbers = written.run, LANES * written.rows

    @kernel
    def advance(lever, law, w, blocks, lanes, twist, dt):
        work, total = room(numbers), (0.0, 0.0, 0.0)
        for k in range(blocks):
            total = plus(total, 1.0, step(law, twist, (dt,), at(w, k * BLOCK), work, lanes))
        return total

    return advance


def _run(written: Passes) -> Any:
    """Return `(law, v, block, lanes)`, which runs passes in memory of their own."""
    run, numbers = written.run, LANES * written.rows

    @kernel
    def passed(law, v, block, lanes):
        return run(law, v, (0.0,), block, room(numbers), lanes)

    return passed


def evaluate(lever, rate, contact, z, v, zdot, w):
    """Write `z'`, and `W`."""
    own, twist, total, block = cells.read(contact), three(v), (0.0, 0.0, 0.0), room(SOLVER_BLOCK)
    n, (_, lanes) = own.count, divided(own.count)
    for first in range(0, n, lanes):
        count = min(lanes, n - first)
        distributed_step.fill(lever, 3, own, z, first, count, lanes, block)
        total = plus(total, 1.0, rate(own.law, twist, block, lanes))
        for m in range(3):
            distributed_step.copy(count, at(block, RATES_AT + m * LANES), at(zdot, m * n + first))
    put(w, total)


def linearise(lever, slope, contact, z, v, lin):
    """Write A and F of each cell (see `general_cells`)."""
    own, twist, block = cells.read(contact), three(v), room(SOLVER_BLOCK)
    n, (_, lanes) = own.count, divided(own.count)
    for first in range(0, n, lanes):
        count = min(lanes, n - first)
        distributed_step.fill(lever, 3, own, z, first, count, lanes, block)
        slope(own.law, twist, block, lanes)
        for m in range(18):
            distributed_step.copy(count, at(block, SLOPES_AT + m * LANES), at(lin, m * n + first))


SOLVER_BLOCK = SLOPES_AT + LANES * 18
"""Numbers of a block of the solver."""


class DiscFunctions(NamedTuple):
    """Functions of contacts of discs."""

    rates: ModelFunctions
    """Rates and slopes in passes, the rest disc by disc."""
    steps: StepFunctions
    advance: Any
    """See `cell_blocks.Kind`."""


@functools.cache
def functions_of_discs(turned: bool) -> DiscFunctions:
    """Return the functions of contacts of discs, `turned` with a metric; they are written on first use."""
    name, lever, numbers = LEVERS[turned]
    advance = advance_of(forward_passes(lever, numbers))
    model = {"lever": lever, "bristle": disc_cells.BRISTLE, "read": cells.read}
    vector = {"rate": _run(rate_passes(lever, numbers)), "slope": _run(slope_passes(lever, numbers))}
    rates = functions_of(name, (evaluate, linearise, *RATES[2:]), **model, **vector)
    steps = step_functions(name, distributed_step.TEMPLATES, **model, advance=advance, size=3)
    return DiscFunctions(rates, steps, advance)
