"""Cells under a body with an edge, and cells whose pressure follows the load, as the solver of scenes reads them."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction._engine.cells import edge_cells, following_cells
from planarfriction._engine.cells.given_pressure import (
    OWN,
    GivenPressure,
    Pressed,
    Source,
)
from planarfriction._engine.cells.moment_pressure import NARROW
from planarfriction._engine.compiler.memory import places_of, row_of, rows_of
from planarfriction._engine.protocol import ModelFunctions, calls_of
from planarfriction._engine.records.distributed import CompiledDistributed
from planarfriction._engine.records.packed import PackedModel
from planarfriction.errors import InvalidValueError

SMALLEST = 1e-9
"""Least radius of the disc that a cell stands for [m]: a point without size is covered or not."""

LAG = 1e-3
"""Time [s] with which the pressure follows the load: about a step of a simulator, whose patches follow the load
of the step before."""

STATES = 2
"""States behind the bristles: how far the centre of pressure is from the centre of mass, along x and y [m]."""


def under_edge(
    compiled: CompiledDistributed, packed: PackedModel, outline: np.ndarray
) -> PackedModel:
    """Return packed cells that carry load where the body is above them, whose `outline` is `[M, 2]` [m].

    Raises InvalidValueError for an outline around nothing.
    """
    cells = packed.keepalive[1]
    patch = compiled.patch
    positions = patch.positions[packed.cells]
    # A disc of the same area.
    sides = np.sqrt(patch.cell_extents().prod(axis=1) / np.pi)
    radii = np.where(patch.radii > 0.0, patch.radii, sides)[packed.cells]
    radii = np.maximum(radii, SMALLEST)
    centre = positions.mean(axis=0)
    reach = (np.hypot(*(positions - centre).T) + radii).max()
    # A corner may stand there twice.
    outline = outline[(outline != np.roll(outline, 1, axis=0)).any(axis=1)]
    ahead = np.roll(outline, -1, axis=0)
    area = float((outline[:, 0] * ahead[:, 1] - outline[:, 1] * ahead[:, 0]).sum())
    if area == 0.0:
        rule = "enclose an area where a contact has an edge"
        raise InvalidValueError("outline", rule, "none")
    corners = np.ascontiguousarray(outline if area > 0.0 else outline[::-1])
    record = edge_cells.EdgeContact(
        given=_given(compiled, packed, edge_cells.SOURCE, radius=reach), turned=patch.anisotropic,
        discs=compiled.size == 3, radii=radii, middle=np.append(centre, reach), outline=corners, corners=len(corners),
        cells=cells,
    )  # fmt: skip
    return _packed(packed, edge_cells.FUNCTIONS, record)


def following(
    compiled: CompiledDistributed,
    packed: PackedModel,
    centre: tuple[float, float],
    height: float,
) -> PackedModel:
    """Return packed cells whose pressure follows a load at `centre` [m] in the contact frame, `height` [m] above it."""
    (weights, _) = packed.keepalive
    positions = compiled.patch.positions[packed.cells]
    middle = weights @ positions
    away = positions - middle[:, None]
    spread = away.mT * weights[:, None] @ away
    radius = float(np.sqrt(np.trace(spread, axis1=1, axis2=2).max()))
    # A plane over cells along a line does not tilt them across it.
    slopes = np.linalg.pinv(spread, rcond=NARROW, hermitian=True) @ away.mT
    by_load = {"middle": middle, "slopes": np.ascontiguousarray(slopes)}
    lagging = {"radius": radius, "height": height, "lag": LAG}
    given = _given(compiled, packed, following_cells.SOURCE, **lagging)
    record = following_cells.FollowingContact(
        given=given, **by_load, centre_x=centre[0], centre_y=centre[1]
    )
    scale = np.full(STATES, radius / np.sqrt(weights.shape[1] + 1))
    return _packed(packed, following_cells.FUNCTIONS, record, **by_load)._replace(
        states=packed.states + STATES,
        state_scale=np.append(packed.state_scale, scale),
    )


def _given(
    compiled: CompiledDistributed,
    packed: PackedModel,
    source: Source,
    radius: float,
    height: float = 0.0,
    lag: float = 0.0,
) -> GivenPressure:
    """Return packed cells with room for two pressures."""
    (weights, cells) = packed.keepalive
    n = packed.states
    x, y = np.ascontiguousarray(compiled.patch.positions[packed.cells].T)

    def room() -> Pressed:
        own = weights[0].copy(), cells.copy()
        return Pressed(row_of(compiled.record(own[1], own[0])[0]), *own)

    calls = calls_of(packed.functions, change=source.follows)
    return GivenPressure(
        count=len(x), numbers=len(cells), states=n, calls=calls, x=x, y=y, whole=packed.records, weights=weights,
        held=room(), trial=room(), acts=np.zeros(1), rate=np.zeros(n), wrench=np.zeros(3),
        by_input=np.zeros((source.inputs, n)), zero=np.zeros(n), rows=np.zeros(12), radius=radius, height=height,
        lag=lag,
    )  # fmt: skip


def _packed(
    packed: PackedModel, functions: ModelFunctions, record: Any, **by_load: np.ndarray
) -> PackedModel:
    """Pack a contact whose cells are those of a packed model, some of its arrays having a row for each load."""
    count = len(packed.records)
    columns = {name: places_of(rows) for name, rows in by_load.items()}
    own = {
        "whole": places_of(packed.records),
        "weights": places_of(record.given.weights),
    }
    given = rows_of(record.given, count, **own)
    return packed._replace(
        functions=functions,
        records=rows_of(record, count, given=given, **columns),
        workspace=OWN + packed.workspace,
        keepalive=(*packed.keepalive, record),
    )
