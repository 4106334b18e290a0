"""Rollouts of kinds of cells, their adjoint and their derivatives (see `cells_rollout`)."""

from __future__ import annotations

import functools
from typing import Any

from planarfriction._engine.cells import cells_rollout, cells_sensitivities
from planarfriction._engine.cells.cell_blocks import (
    BAR,
    LANES,
    WEIGHT,
    BlockFunctions,
    Z,
)
from planarfriction._engine.cells.cell_loops import (
    KINDS,
    CellKind,
    CellRows,
    backward_passes,
    law_of,
    step_passes,
)
from planarfriction._engine.codegen.derivatives import forward
from planarfriction._engine.codegen.vectors import Vector, reader_of
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, at
from planarfriction.formulas import LawNumbers


def _pushed(kind: CellKind) -> Any:
    """Return `cell_blocks.BlockFunctions.pushed`: only a pad sees the load of a cell."""
    by = cells_rollout.by_of(kind.path, kind.pad)
    changed = forward(kind.element.step, by, kind.lengths)

    @kernel
    def plain(
        law: Any, z: Vector, u: Vector, dt: float, dz: Vector, du: Vector, d_law: tuple, heavier: float
    ) -> Any:  # fmt: skip
        return changed(law, z, u, dt, dz, du, *d_law)

    @kernel
    def of_pad(
        law: Any, z: Vector, u: Vector, dt: float, dz: Vector, du: Vector, d_law: tuple, heavier: float
    ) -> Any:  # fmt: skip
        return changed(law, z, u, dt, dz, du, *d_law, heavier)

    return of_pad if kind.pad else plain


def _of_block(run: Any, field: int) -> Any:
    """Return passes over the cells of a block, with results in a field."""

    @kernel
    def of_block(
        law: LawNumbers, twist: Vector, shared: Vector, block: Doubles, lanes: int
    ) -> Vector:
        bristles = at(block, Z)
        rows = CellRows(block, bristles, at(block, WEIGHT), at(block, field), LANES)
        return run(law, twist, shared, rows, lanes)

    return of_block


@functools.cache
def rollouts_of_cells(size: int, turned: bool, sort: str) -> tuple:
    """Return rollout, gradient, sensitivities and tangent of a kind of cells (see `KINDS`)."""
    kind = KINDS[size, turned, sort]
    steps = _of_block(step_passes(kind).run, Z)
    loops = steps, _of_block(backward_passes(kind).run, BAR)
    functions = BlockFunctions(
        kind.lever, size, *loops, _pushed(kind), law_of(kind), reader_of(size)
    )
    sensitivities = cells_sensitivities.bound(functions, kind)
    rollout, gradient, tangent = (
        cells_rollout.entry_of(each, functions, kind.name)
        for each in (
            cells_rollout.rollout,
            cells_rollout.gradient,
            cells_rollout.tangent,
        )
    )
    return rollout, gradient, sensitivities, tangent
