"""Rollouts of kinds of cells, their adjoint and their derivatives (see `cells_rollout`)."""

from __future__ import annotations

import functools
from typing import Any

from planarfriction._engine.bristles.asymmetric_cells import Leaning
from planarfriction._engine.cells import cells_rollout, cells_sensitivities
from planarfriction._engine.cells.cell_blocks import LANES, BlockFunctions, Limit
from planarfriction._engine.cells.cell_loops import (
    KINDS,
    backward_passes,
    forward_passes,
    share_passes,
)
from planarfriction._engine.codegen.derivatives import derive, forward
from planarfriction._engine.codegen.vectors import reader_of
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles
from planarfriction.formulas import LawNumbers


@kernel
def _shared(law: LawNumbers, block: Doubles, i: int) -> LawNumbers:
    return law


def _leaning_at(first: int) -> Any:
    """Return `cell_blocks.BlockFunctions.law` of cells whose asymmetry lies in two fields of a block, from one on."""

    @kernel
    def law_of_cell(law: LawNumbers, block: Doubles, i: int) -> Leaning:
        return Leaning(law, (block[first + i], block[first + LANES + i]))

    return law_of_cell


@functools.cache
def rollouts_of_cells(size: int, turned: bool, leans: bool) -> tuple:
    """Return rollout, gradient, sensitivities, tangent and shares of a kind of cells (see `KINDS`)."""
    kind = KINDS[size, turned, leans]
    path, law = (
        ("lean.law", _leaning_at(LANES * kind.numbers)) if leans else ("law", _shared)
    )
    step = kind.element.step
    within = kind.element.within
    by = ("z", f"{path}.sigma_0", f"{path}.mu_s")
    limited = derive(within, by, kind.lengths)
    limit = Limit(
        within, limited.forth, limited.back, forward(within, by, kind.lengths)
    )
    pushed = forward(step, cells_rollout.by_of(path), kind.lengths)
    loops = forward_passes(kind).run, backward_passes(kind).run, share_passes(kind).run
    functions = BlockFunctions(
        kind.lever, size, *loops, pushed, law, limit, reader_of(size)
    )
    sensitivities = cells_sensitivities.bound(functions, kind, path)
    rollout, gradient, tangent, shares = (
        cells_rollout.entry_of(each, functions, kind.name)
        for each in (
            cells_rollout.rollout,
            cells_rollout.gradient,
            cells_rollout.tangent,
            cells_rollout.shares,
        )
    )
    return rollout, gradient, sensitivities, tangent, shares
