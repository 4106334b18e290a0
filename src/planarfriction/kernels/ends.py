"""Ends of contacts: the instants at which no part of a contact lies on the body any more."""

from __future__ import annotations

import math

from planarfriction.compiler import kernel
from planarfriction.compiler.calls import call
from planarfriction.compiler.memory import Doubles
from planarfriction.kernels.body import SystemRecord
from planarfriction.kernels.integration import RunRecord, extend

INSTANT = 1e-9
"""Time [s] before the end of a step in which a contact may have ended."""

# Halvings of the step in which a contact ends.
_HALVINGS = 40


@kernel
def _ends(run: RunRecord, system: SystemRecord, piece: int, since: float, state: Doubles) -> bool:
    """Return True if a contact that touched the body does so no longer in a state."""
    call(system.rates, (run.system, piece, since, state, run.stages.rate))
    ends = False
    for c in range(system.size):
        ends = ends or (system.work.covered[c] == 0.0 and not run.output.ended[c] >= 0.0)
    return ends


@kernel
def share_until_end(run: RunRecord, system: SystemRecord, piece: int, since: float, step: float) -> float:
    """Return the share of a step after which a contact has ended; 1 if all go on."""
    early, late = 0.0, 1.0
    if not _ends(run, system, piece, since + step, run.stages.new):
        return late
    for _ in range(_HALVINGS):
        share = 0.5 * (early + late)
        extend(run, share, 1.0, 0.0, run.progress.y, run.stages.argument)
        if _ends(run, system, piece, since + share * step, run.stages.argument):
            late = share
        else:
            early = share
    return late


@kernel
def note_ends(run: RunRecord, system: SystemRecord, piece: int, since: float, time: float) -> bool:
    """Write which contacts have ended by now; return True if one did so now and none is left."""
    ends, left = _ends(run, system, piece, since, run.progress.y), False
    for c in range(system.size):
        left = left or system.work.covered[c] > 0.0
        if system.work.covered[c] > 0.0:
            run.output.ended[c] = math.nan
        elif not run.output.ended[c] >= 0.0:
            run.output.ended[c] = time
    return ends and not left
