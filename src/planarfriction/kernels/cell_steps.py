"""Contacts of cells as solver and steps call them (see `cell_passes` for their loops).

A cell sees the velocity `u = B V` of its lever B (see `cells.Lever`) and adds `w B' t` to the wrench, t being its
traction (docs/physics.md, "Distributed model").
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles, Place, at
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells, general_cells
from planarfriction.kernels.cell_blocks import LANES, divided, scratch
from planarfriction.kernels.cell_passes import DISC, KINDS, Rows, rate_passes, slope_passes, step_passes
from planarfriction.kernels.cells import CellsContact
from planarfriction.kernels.contacts import ModelFunctions, functions_of
from planarfriction.kernels.passes import Passes
from planarfriction.kernels.steps import StepFunctions, step_functions
from planarfriction.kernels.vectors import Vector, plus, put, three

SLOPES = LANES * 2 * DISC.size**2
"""Numbers of a block of derivatives."""


@kernel
def _rows_from(contact: CellsContact, z: Doubles, first: int, out: Doubles) -> Rows:
    """Return the rows of the cells of a contact from one on."""
    return Rows(at(contact.cells, first), at(z, first), at(contact.weights, first), out, contact.count)


def _run(written: Passes) -> Any:
    """Return `(law, v, dt, rows, lanes)`, which runs passes in memory of their own."""
    run, numbers = written.run, LANES * written.rows

    @kernel
    def passed(law: LawNumbers, v: Vector, dt: float, rows: Rows, lanes: int) -> Any:
        return run(law, v, (dt,), rows, scratch(numbers), lanes)

    return passed


def evaluate(contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles, *, rate: Any) -> None:
    """Write `z'`, and `W`."""
    record, twist, total = cells.read(contact), three(v), (0.0, 0.0, 0.0)
    n, (_, lanes) = record.count, divided(record.count)
    for first in range(0, n, lanes):
        rows = _rows_from(record, z, first, at(zdot, first))
        total = plus(total, 1.0, rate(record.law, twist, 0.0, rows, min(lanes, n - first)))
    put(w, total)


def linearise(contact: Place, z: Doubles, v: Doubles, lin: Doubles, *, bristle: Any, slope: Any) -> None:
    """Write A and F of each cell (see `general_cells`)."""
    record, twist, block = cells.read(contact), three(v), scratch(SLOPES)
    n, (_, lanes) = record.count, divided(record.count)
    for first in range(0, n, lanes):
        count = min(lanes, n - first)
        slope(record.law, twist, 0.0, _rows_from(record, z, first, block), count)
        for m in range(2 * bristle.size * bristle.size):
            for i in range(count):
                lin[m * n + first + i] = block[m * LANES + i]


def step(contact: Place, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles, *, advance: Any) -> None:
    """Advance the bristles by `dt` at a held twist, and write the wrench at the end."""
    record, twist, total = cells.read(contact), three(v), (0.0, 0.0, 0.0)
    n, (_, lanes) = record.count, divided(record.count)
    for first in range(0, n, lanes):
        rows = _rows_from(record, z, first, at(new, first))
        total = plus(total, 1.0, advance(record.law, twist, dt, rows, min(lanes, n - first)))
    put(out, total)


class CellFunctions(NamedTuple):
    """Functions of contacts of a kind of cells: step, rates and their derivatives in passes, the rest cell by cell."""

    rates: ModelFunctions
    steps: StepFunctions


@functools.cache
def functions_of_cells(size: int, turned: bool, leans: bool) -> CellFunctions:
    """Return the functions of contacts of a kind of cells (see `KINDS`); they are written on first use."""
    kind = KINDS[size, turned, leans]
    bristle = general_cells.bristle(kind.element.evaluate, kind.element.step, size, linear=True)
    model = {"lever": kind.lever, "bristle": bristle, "read": cells.read}
    templates, slope = (evaluate, linearise, *general_cells.RATES[2:]), _run(slope_passes(kind))
    rates = functions_of(kind.name, templates, **model, rate=_run(rate_passes(kind)), slope=slope)
    steps = step_functions(kind.name, (step, general_cells.slopes), **model, advance=_run(step_passes(kind)))
    return CellFunctions(rates, steps)
