"""Roll-outs of discs, their adjoint and their derivatives (see `cells_rollout`)."""

from __future__ import annotations

from typing import Any

from planarfriction.compiler import kernel
from planarfriction.kernels import cells_rollout, cells_sensitivities, discs
from planarfriction.kernels.cell_blocks import LANES, Kind, room
from planarfriction.kernels.cell_slopes import StepBars
from planarfriction.kernels.disc_passes import backward_passes
from planarfriction.kernels.disc_steps import LEVERS, functions_of_discs
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


def _kind_of(turned: bool) -> Kind:
    _, lever, numbers = LEVERS[turned]
    advance, retreat = functions_of_discs(turned).advance, _retreat_of(backward_passes(lever, numbers))
    return Kind(lever, 3, advance, retreat, cells_rollout.pushed_of(discs.step), reader_of(3))


_DISCS, _TURNED_DISCS = _kind_of(False), _kind_of(True)
DISCS = cells_rollout.bound(_DISCS, "discs"), cells_sensitivities.bound(_DISCS, discs.step, "discs")
TURNED_DISCS = (
    cells_rollout.bound(_TURNED_DISCS, "turned_discs"),
    cells_sensitivities.bound(_TURNED_DISCS, discs.step, "turned_discs"),
)
"""`CellRollouts` and sensitivities of discs, and of discs with a metric."""
