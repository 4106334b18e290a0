"""Cells whose pressure follows the load, as the solver of scenes reads them."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.compiled.distributed import CompiledDistributed
from planarfriction.compiled.packed import PackedModel
from planarfriction.compiler.memory import place_of, places_of, row_of, rows_of
from planarfriction.kernels.contacts import calls_of
from planarfriction.kernels.following_cells import FUNCTIONS, OWN, FollowingContact
from planarfriction.kernels.tilt import NARROW

LAG = 1e-3
"""Time [s] with which the pressure follows the load: about a step of a simulator, whose patches follow the load
of the step before."""

STATES = 2
"""States behind the bristles: how far the centre of pressure is from the centre of mass, along x and y [m]."""


def following(
    compiled: CompiledDistributed, packed: PackedModel, centre: tuple[float, float], height: float
) -> PackedModel:
    """Return packed cells whose pressure follows a load at `centre` [m] in the contact frame, `height` [m] above it."""
    (weights, numbers), positions = packed.keepalive, compiled.patch.positions[packed.cells]
    count, (x, y) = weights.shape[1], np.ascontiguousarray(positions.T)
    middle, slopes, radius = _statics_of(weights, positions)
    size = packed.states + STATES
    blanks = {"pressed": count, "trial": count, "scratch": size, "zero": size, "rows": 12}
    scratch = {name: np.zeros(length) for name, length in blanks.items()}
    by_load = {"weights": weights, "middle": middle, "slope_x": slopes[0], "slope_y": slopes[1]}
    arrays: dict[str, Any] = {"x": x, "y": y, "calls": calls_of(packed.functions, change=True)} | scratch | by_load
    cells, trial_cells = (row_of(compiled.record(numbers, scratch[name])[0]) for name in ("pressed", "trial"))
    record = FollowingContact(
        **arrays, count=count, states=packed.states, cells=place_of(cells), trial_cells=place_of(trial_cells),
        radius=radius, centre_x=centre[0], centre_y=centre[1], height=height, lag=LAG,
    )  # fmt: skip
    return packed._replace(
        functions=FUNCTIONS,
        records=rows_of(record, len(weights), **{name: places_of(each) for name, each in by_load.items()}),
        states=size,
        workspace=OWN + packed.workspace,
        state_scale=np.append(packed.state_scale, np.full(STATES, radius / np.sqrt(count + 1))),
        keepalive=(*packed.keepalive, *arrays.values(), cells, trial_cells),
    )


def _statics_of(weights: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the centres of pressure `[R, 2]` of rows of weights, their slopes by it `[2, R, n]`, and a radius [m].

    A plane over cells along a line does not tilt them across it.
    """
    middle = weights @ positions
    away = positions - middle[:, None]
    spread = np.einsum("rn,rni,rnj->rij", weights, away, away)
    slopes = np.einsum("rij,rnj->irn", np.linalg.pinv(spread, rcond=NARROW, hermitian=True), away)
    return middle, np.ascontiguousarray(slopes), float(np.sqrt(np.trace(spread, axis1=1, axis2=2).max()))
