"""Roll-outs of kinds of cells, their adjoint and their derivatives (see `cells_rollout`)."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.kernels import cells_rollout, cells_sensitivities
from planarfriction.kernels.cell_blocks import LANES, Kind, StepBars, room
from planarfriction.kernels.cell_passes import backward_passes
from planarfriction.kernels.cell_steps import KINDS, functions_of_cells
from planarfriction.kernels.passes import Passes
from planarfriction.kernels.vectors import reader_of


def _retreat_of(written: Passes) -> Any:
    """Return `cell_blocks.Kind.retreat` from the passes of the adjoint of a step."""
    adjoint, numbers = written.run, LANES * written.rows

    @kernel
    def retreat(lever, law, block, lanes, held, pull, load):
        given = held[1], load, 0.0 if load == 0.0 else 1.0, pull[0], pull[1], pull[2]
        s = adjoint(law, held[0], given, block, room(numbers), lanes)
        return StepBars((s[0], s[1], s[2]), s[3], (s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11]))

    return retreat


class Rollouts(NamedTuple):
    """Entry points of a kind of cells."""

    rollouts: cells_rollout.CellRollouts
    sensitivities: Any


@functools.cache
def rollouts_of_cells(size: int, turned: bool) -> Rollouts:
    """Return the roll-outs of a kind of cells (see `cell_steps.KINDS`); they are written on first use."""
    name, element, lever, numbers = KINDS[size, turned]
    kind = Kind(
        lever,
        size,
        functions_of_cells(size, turned).advance,
        _retreat_of(backward_passes(element, lever, numbers)),
        cells_rollout.pushed_of(element.step),
        reader_of(size),
    )
    return Rollouts(cells_rollout.bound(kind, name), cells_sensitivities.bound(kind, element.step, name))
