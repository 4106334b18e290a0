"""Contacts of cells as solver and steps call them (see `cell_loops` for their loops).

A cell sees the velocity `u = B V` of its lever B (see `cells.Lever`) and adds `w B' t` to the wrench, t being its
traction (docs/physics.md, "Distributed model").

Cells of a pad (see `elastic`) see their load: that of the contact comes behind the twist.
"""

from __future__ import annotations

import functools
from typing import Any

from planarfriction._engine.cells import cells, general_cells
from planarfriction._engine.cells.cell_blocks import LANES, divided, scratch
from planarfriction._engine.cells.cell_loops import (
    DISC,
    KINDS,
    CellKind,
    CellRows,
    StepRows,
    jacobian_passes,
    rate_passes,
    slope_passes,
    step_passes,
    step_slope_passes,
)
from planarfriction._engine.cells.cells import CellsContact
from planarfriction._engine.codegen.definitions import bind
from planarfriction._engine.codegen.vectors import (
    Vector,
    clear,
    copy,
    plus,
    put,
    put_all,
    three,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import entry, kernel, wide_entry
from planarfriction._engine.compiler.memory import Doubles, Place, at
from planarfriction._engine.protocol import (
    SLOPES,
    ModelFunctions,
)

RESULTS = LANES * (4 * DISC.size**2 + DISC.size)
"""Numbers of the results of a block of cells, row by row: derivatives of rates and tractions, and rates or bristles."""

BLOCK = RESULTS + LANES * 12
"""Numbers of a block of cells: results, and copies of up to eight numbers, of the bristle and of the weight."""


@kernel
def _in_place(
    contact: CellsContact,
    z: Doubles,
    first: int,
    lanes: int,
    out: Doubles,
    block: Doubles,
) -> Any:
    """Return the rows of cells of a contact from one on, and their number."""
    rows = CellRows(
        at(contact.cells, first),
        at(z, first),
        at(contact.weights, first),
        out,
        contact.count,
    )
    return rows, xp.minimum(lanes, contact.count - first)


def _filled(numbers: int, size: int) -> Any:
    """Return a function like `_in_place` that copies cells into a block, filled up with cells without load.

    Loops over it need not ask which of their rows overlap: that takes as long as a loop over a few dozen cells.
    """
    bristle = RESULTS + numbers * LANES
    weight = RESULTS + (numbers + size) * LANES

    @kernel
    def filled(
        contact: CellsContact,
        z: Doubles,
        first: int,
        lanes: int,
        out: Doubles,
        block: Doubles,
    ) -> Any:
        n = contact.count
        count = xp.minimum(lanes, contact.count - first)
        for m in range(numbers + size + 1):
            clear(at(block, RESULTS + m * LANES + count), lanes - count)
        for m in range(numbers):
            copy(
                at(contact.cells, m * n + first), at(block, RESULTS + m * LANES), count
            )
        for m in range(size):
            copy(at(z, m * n + first), at(block, bristle + m * LANES), count)
        copy(at(contact.weights, first), at(block, weight), count)
        return CellRows(
            at(block, RESULTS), at(block, bristle), at(block, weight), out, LANES
        ), lanes

    return filled


@kernel
def _through(
    record: CellsContact,
    z: Doubles,
    v: Vector,
    shared: Vector,
    out: Doubles,
    cell_rows: Any,
    run: Any,
    copied: int,
    none: Vector,
) -> Vector:
    """Run passes over all cells, which write `copied` rows to `out`, or any number if it is 0; return their sums.

    `none` are as many zeros.
    """
    total = none
    block = scratch(BLOCK)
    n = record.count
    (_, lanes) = divided(record.count)
    for first in range(0, n, lanes):
        rows, count = cell_rows(
            record, z, first, lanes, block if copied > 0 else at(out, first), block
        )
        total = plus(total, 1.0, run(record.law, v, shared, rows, count))
        for m in range(copied):
            copy(
                at(block, m * LANES),
                at(out, m * n + first),
                xp.minimum(lanes, n - first),
            )
    return total


def evaluate(
    contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles, *, cell_rows: Any, rate: Any, copied: int,
    pad: bool, read: Any,
) -> None:  # fmt: skip
    """Write `z'`, and `W`; behind V is the load of a `pad`."""
    shared = (0.0, v[3] if pad else 0.0)
    none = (0.0, 0.0, 0.0)
    found = _through(
        read(contact), z, three(v), shared, zdot, cell_rows, rate, copied, none
    )
    put(w, found)


def linearise(
    contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles, lin: Doubles, *, bristle: Any, cell_rows: Any,
    slope: Any, pad: bool, read: Any,
) -> None:  # fmt: skip
    """Evaluate, and write A and F of each cell, and C and E unless tractions are linear (see `general_cells`)."""
    record = read(contact)
    twist = three(v)
    total = (0.0, 0.0, 0.0)
    square = bristle.size * bristle.size
    slopes = 2 * square if bristle.linear else 4 * square
    shared = (0.0, v[3] if pad else 0.0)
    block = scratch(BLOCK)
    n = record.count
    (_, lanes) = divided(record.count)
    for first in range(0, n, lanes):
        rows, count = cell_rows(record, z, first, lanes, block, block)
        total = plus(total, 1.0, slope(record.law, twist, shared, rows, count))
        some = xp.minimum(lanes, n - first)
        for m in range(slopes):
            row = m if m < 2 * square else m + square  # behind the inverse
            copy(at(block, m * LANES), at(lin, row * n + first), some)
        for m in range(bristle.size):
            copy(at(block, (slopes + m) * LANES), at(zdot, m * n + first), some)
    put(w, total)


def step(
    contact: Place, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles, *, cell_rows: Any, advance: Any,
    copied: int, pad: bool, read: Any, none: Vector,
) -> None:  # fmt: skip
    """Advance the bristles by `dt` at a held twist, and write the sums over cells, wrench first; behind V is a load."""
    shared = (dt, v[3] if pad else 0.0)
    found = _through(
        read(contact), z, three(v), shared, new, cell_rows, advance, copied, none
    )
    put_all(out, found)


def jacobian(
    contact: Place, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles, *, advance: Any, pad: bool,
    read: Any, size: int,
) -> None:  # fmt: skip
    """Step with all derivatives."""
    record = read(contact)
    n = record.count
    slopes = at(out, SLOPES)
    rows = StepRows(record.cells, z, record.weights, new, n, slopes)
    shared = dt, v[3] if pad else 0.0
    found = advance(record.law, three(v), shared, rows, n)
    put_all(out, found[:SLOPES])
    if pad:
        put(at(slopes, (7 + size) * size * n), found[SLOPES:])


@functools.cache
def functions_of_cells(
    size: int, turned: bool, sort: str
) -> tuple[ModelFunctions, CellSteps]:
    """Return the functions of contacts of a kind of cells (see `KINDS`); they are written on first use."""
    kind = KINDS[size, turned, sort]
    return rates_of(kind, cells.read), CellSteps(kind, cells.read)


def _model_of(kind: CellKind, read: Any) -> dict[str, Any]:
    """Return the arguments of templates that rates and steps of a kind of cells share."""
    size = kind.element.size
    copied = size if size == DISC.size else 0  # points come by the hundred
    cell_rows = _filled(kind.rows, size) if copied else _in_place
    bristle = general_cells.bristle(size, kind.linear)
    return {
        "lever": kind.lever,
        "bristle": bristle,
        "read": read,
        "copied": copied,
        "cell_rows": cell_rows,
        "pad": kind.pad,
    }


def rates_of(kind: CellKind, read: Any) -> ModelFunctions:
    """Return the functions of the solver for contacts of a kind of cells whose records `read` reads."""
    model = _model_of(kind, read)
    rate = rate_passes(kind).run
    slope = slope_passes(kind).run
    return ModelFunctions(
        bind(evaluate, f"{kind.name}_evaluate", wide_entry, **model, rate=rate),
        bind(linearise, f"{kind.name}_linearise", wide_entry, **model, slope=slope),
        *(
            bind(each, f"{kind.name}_{each.__name__}", entry, **model)
            for each in general_cells.FUNCTIONS
        ),
    )


class CellSteps:
    """Steps of contacts of a kind of cells whose records `read` reads (see `protocol.StepFunctions`).

    Each is written on first use: derivatives of a step take ten times as long to write as the step.
    """

    def __init__(self, kind: CellKind, read: Any) -> None:
        self._kind = kind
        self._model = _model_of(kind, read)

    @functools.cached_property
    def step(self) -> Any:
        """See `protocol.StepFunctions`."""
        advance = step_passes(self._kind).run
        name = f"{self._kind.name}_step"
        return bind(step, name, entry, **self._model, advance=advance, none=(0.0,) * 3)

    @functools.cached_property
    def slopes(self) -> Any:
        """See `protocol.StepFunctions`."""
        advance = step_slope_passes(self._kind).run
        none = (0.0,) * SLOPES
        name = f"{self._kind.name}_slopes"
        return bind(step, name, wide_entry, **self._model, advance=advance, none=none)

    @functools.cached_property
    def jacobian(self) -> Any:
        """See `protocol.StepFunctions`."""
        advance = jacobian_passes(self._kind).run
        size = self._kind.element.size
        name = f"{self._kind.name}_jacobian"
        return bind(
            jacobian, name, wide_entry, **self._model, advance=advance, size=size
        )
