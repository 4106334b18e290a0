"""Rollouts of kinds of cells, their adjoint and their derivatives (see `cells_rollout`)."""

from __future__ import annotations

import functools
from typing import Any

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles, at
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells_rollout, cells_sensitivities
from planarfriction.kernels.cell_blocks import BLOCK, LANES, Kind, Limit, StepBars, scratch
from planarfriction.kernels.cell_passes import KINDS, backward_passes, forward_passes, share_passes
from planarfriction.kernels.cells import Lever
from planarfriction.kernels.derive import derive
from planarfriction.kernels.forward import forward
from planarfriction.kernels.leaning_cells import Leaning
from planarfriction.kernels.passes import Passes
from planarfriction.kernels.vectors import Vector, plus, reader_of


def _advance_of(written: Passes) -> Any:
    """Return `cell_blocks.Kind.advance` from the passes of a step."""
    step, numbers = written.run, LANES * written.rows

    @kernel
    def advance(lever: Lever, law: LawNumbers, w: Doubles, blocks: int, lanes: int, twist: Vector, dt: float) -> Vector:
        work, total = scratch(numbers), (0.0, 0.0, 0.0)
        for k in range(blocks):
            total = plus(total, 1.0, step(law, twist, (dt,), at(w, k * BLOCK), work, lanes))
        return total

    return advance


def _retreat_of(written: Passes) -> Any:
    """Return `cell_blocks.Kind.retreat` from the passes of the adjoint of a step."""
    adjoint, numbers = written.run, LANES * written.rows

    @kernel
    def retreat(
        lever: Lever, law: LawNumbers, block: Doubles, lanes: int, interval: tuple[Vector, float], pull: Vector,
        load: float,
    ) -> StepBars:  # fmt: skip
        shared = interval[1], load, 0.0 if load == 0.0 else 1.0, pull[0], pull[1], pull[2]
        s = adjoint(law, interval[0], shared, block, scratch(numbers), lanes)
        return StepBars((s[0], s[1], s[2]), s[3], (s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11]))

    return retreat


def _shares_of(written: Passes) -> Any:
    """Return `cell_blocks.Kind.shares` from its passes."""
    share, numbers = written.run, LANES * written.rows

    @kernel
    def shares(
        law: LawNumbers, block: Doubles, lanes: int, interval: tuple[Vector, float], pull: Vector, load: float
    ) -> None:
        shared = interval[1], load, 1.0, pull[0], pull[1], pull[2]
        share(law, interval[0], shared, block, scratch(numbers), lanes)

    return shares


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
    ways = _advance_of(forward_passes(kind)), _retreat_of(backward_passes(kind)), _shares_of(share_passes(kind)), pushed
    functions = Kind(kind.lever, size, *ways, law, limit, reader_of(size))
    sensitivities = cells_sensitivities.bound(functions, step, within, path, kind.name)
    rollout, gradient, tangent, shares = cells_rollout.bound(functions, kind.name)
    return rollout, gradient, sensitivities, tangent, shares
