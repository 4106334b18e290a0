"""Rollouts of kinds of cells, their adjoint and their derivatives (see `cells_rollout`)."""

from __future__ import annotations

import functools
from typing import Any

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells_rollout, cells_sensitivities
from planarfriction.kernels.cell_blocks import LANES, Kind, Limit
from planarfriction.kernels.cell_passes import KINDS, backward_passes, forward_passes, share_passes
from planarfriction.kernels.derive import derive
from planarfriction.kernels.forward import forward
from planarfriction.kernels.leaning_cells import Leaning
from planarfriction.kernels.vectors import reader_of


@kernel
def _shared(law: LawNumbers, block: Doubles, i: int) -> LawNumbers:
    return law


def _leaning_at(first: int) -> Any:
    """Return `cell_blocks.Kind.law` of cells whose asymmetry lies in two fields of a block, from one on."""

    @kernel
    def law_of_cell(law: LawNumbers, block: Doubles, i: int) -> Leaning:
        return Leaning(law, (block[first + i], block[first + LANES + i]))

    return law_of_cell


@functools.cache
def rollouts_of_cells(size: int, turned: bool, leans: bool) -> tuple:
    """Return rollout, gradient, sensitivities, tangent and shares of a kind of cells (see `KINDS`)."""
    kind = KINDS[size, turned, leans]
    path, law = ("lean.law", _leaning_at(LANES * kind.numbers)) if leans else ("law", _shared)
    step, within, by = kind.element.step, kind.element.within, ("z", f"{path}.sigma_0", f"{path}.mu_s")
    limited = derive(within, by, ("z",))
    limit = Limit(within, limited.forth, limited.back, forward(within, by, ("z",)))
    pushed = forward(step, cells_rollout.by_of(path), ("z", "u"))
    loops = forward_passes(kind).run, backward_passes(kind).run, share_passes(kind).run
    functions = Kind(kind.lever, size, *loops, pushed, law, limit, reader_of(size))
    sensitivities = cells_sensitivities.bound(functions, step, within, path, kind.name)
    rollout, gradient, tangent, shares = (
        cells_rollout.entry_of(each, functions, kind.name)
        for each in (cells_rollout.rollout, cells_rollout.gradient, cells_rollout.tangent, cells_rollout.shares)
    )
    return rollout, gradient, sensitivities, tangent, shares
