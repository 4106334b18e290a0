"""Contacts of cells as solver and steps call them, in blocks (see `cell_passes` for their loops).

A cell sees the velocity `u = B V` of its lever B (see `cells.Lever`) and adds `w B' t` to the wrench, t being its
traction (docs/physics.md, "Distributed model").
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles, at
from planarfriction.kernels import cells, disc_cells, general_cells
from planarfriction.kernels.cell_blocks import BLOCK, LANES, WEIGHT, Z, divided, room
from planarfriction.kernels.cell_passes import (
    DISC,
    POINT,
    Element,
    Rows,
    forward_passes,
    rate_passes,
    slope_passes,
)
from planarfriction.kernels.cells import CellsContact, Lever
from planarfriction.kernels.contacts import ModelFunctions, functions_of
from planarfriction.kernels.passes import Passes
from planarfriction.kernels.steps import StepFunctions, step_functions
from planarfriction.kernels.vectors import plus, put, three


class CellKind(NamedTuple):
    """Element of a kind of cells and their lever, which has so many numbers."""

    name: str
    element: Element
    lever: Lever
    numbers: int


KINDS = {
    (2, False): CellKind("isotropic", POINT, cells.POSITIONS, 2),
    (2, True): CellKind("turned", POINT, cells.LEVERS, 5),
    (3, False): CellKind("discs", DISC, disc_cells.POSITIONS, 3),
    (3, True): CellKind("turned_discs", DISC, disc_cells.LEVERS, 6),
}
"""Kinds of cells by the components of a bristle and whether there is a metric."""


SLOPES = LANES * 2 * DISC.size**2
"""Numbers of a block of derivatives."""


@kernel
def copy(count: int, source: Doubles, target: Doubles) -> None:
    """Copy numbers."""
    for i in range(count):
        target[i] = source[i]


@kernel
def fill(lever: Lever, size: int, contact: CellsContact, z: Doubles, first: int, lanes: int, block: Doubles) -> None:
    """Copy cells into a block, and fill its lanes up with cells without load at the origin."""
    n, numbers, count = contact.count, len(lever.of(contact, first)), min(lanes, contact.count - first)
    for i in range(count, lanes):
        for m in range(numbers):
            block[m * LANES + i] = 0.0
        for m in range(size):
            block[Z + m * LANES + i] = 0.0
        block[WEIGHT + i] = 0.0
    for m in range(size):
        copy(count, at(z, m * n + first), at(block, Z + m * LANES))
    copy(count, at(contact.weights, first), at(block, WEIGHT))
    for m in range(numbers):
        copy(count, at(contact.cells, m * n + first), at(block, m * LANES))


@kernel
def empty(rows: int, field: int, block: Doubles, first: int, lanes: int, n: int, target: Doubles) -> None:
    """Copy fields of a block to rows [n] of cells."""
    count = min(lanes, n - first)
    for m in range(rows):
        copy(count, at(block, field + m * LANES), at(target, m * n + first))


@kernel
def rows_from(contact: CellsContact, z: Doubles, first: int, out: Doubles) -> Rows:
    """Return the rows of the cells of a contact from one on."""
    return Rows(at(contact.cells, first), at(z, first), at(contact.weights, first), out, contact.count)


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


def evaluate(contact, z, v, zdot, w, *, rate):
    """Write `z'`, and `W`."""
    record, twist, total = cells.read(contact), three(v), (0.0, 0.0, 0.0)
    n, (_, lanes) = record.count, divided(record.count)
    for first in range(0, n, lanes):
        rows = rows_from(record, z, first, at(zdot, first))
        total = plus(total, 1.0, rate(record.law, twist, rows, min(lanes, n - first)))
    put(w, total)


def linearise(contact, z, v, lin, *, bristle, slope):
    """Write A and F of each cell (see `general_cells`)."""
    record, twist, block = cells.read(contact), three(v), room(SLOPES)
    n, (_, lanes) = record.count, divided(record.count)
    for first in range(0, n, lanes):
        slope(record.law, twist, rows_from(record, z, first, block), min(lanes, n - first))
        empty(2 * bristle.size * bristle.size, 0, block, first, lanes, n, lin)


def step(contact, z, v, dt, new, out, *, lever, bristle, advance):
    """Advance the bristles by `dt` at a held twist, and write the wrench at the end."""
    record, twist, total, block = cells.read(contact), three(v), (0.0, 0.0, 0.0), room(BLOCK)
    n, (_, lanes) = record.count, divided(record.count)
    for first in range(0, n, lanes):
        fill(lever, bristle.size, record, z, first, lanes, block)
        total = plus(total, 1.0, advance(lever, record.law, block, 1, lanes, twist, dt))
        empty(bristle.size, Z, block, first, lanes, n, new)
    put(out, total)


class CellFunctions(NamedTuple):
    """Functions of contacts of a kind of cells."""

    rates: ModelFunctions
    """Rates and slopes in passes, the rest cell by cell."""
    steps: StepFunctions
    advance: Any
    """See `cell_blocks.Kind`."""


@functools.cache
def functions_of_cells(size: int, turned: bool) -> CellFunctions:
    """Return the functions of contacts of a kind of cells (see `KINDS`); they are written on first use."""
    name, element, lever, numbers = KINDS[size, turned]
    advance = advance_of(forward_passes(element, lever, numbers))
    rate, slope = _run(rate_passes(element, lever, numbers)), _run(slope_passes(element, lever, numbers))
    bristle = general_cells.bristle(element.evaluate, element.step, size, linear=True)
    model = {"lever": lever, "bristle": bristle, "read": cells.read}
    rates = functions_of(name, (evaluate, linearise, *general_cells.RATES[2:]), **model, rate=rate, slope=slope)
    return CellFunctions(rates, step_functions(name, (step, general_cells.slopes), **model, advance=advance), advance)
