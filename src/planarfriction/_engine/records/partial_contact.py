"""Cells under a body with an edge, and cells whose pressure follows the load, as the solver of scenes reads them."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from planarfriction._engine.cells import edge_cells, following_cells
from planarfriction._engine.cells.given_pressure import (
    OWN,
    GivenPressure,
    Pressed,
)
from planarfriction._engine.cells.moment_pressure import NARROW
from planarfriction._engine.compiler.memory import places_of, row_of, rows_of
from planarfriction._engine.protocol import calls_of
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
    record = functools.partial(
        edge_cells.EdgeContact, turned=patch.anisotropic, discs=compiled.size == 3, radii=radii,
        middle=np.append(centre, reach), outline=corners, corners=len(corners), cells=cells,
    )  # fmt: skip
    return _packed(compiled, packed, edge_cells, record, {}, radius=reach)


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
    trace = np.trace(spread, axis1=1, axis2=2)[:, None, None]
    radius = math.sqrt(trace.max())
    det = np.linalg.det(spread)[:, None, None]
    # A plane over cells along a line does not tilt them across it.
    narrow = det <= NARROW * trace**2
    inverse = np.where(narrow, spread, trace * np.eye(2) - spread)
    per = np.where(narrow, trace**2, det)
    slopes = inverse / np.where(per > 0.0, per, 1.0) @ away.mT
    record = functools.partial(
        following_cells.FollowingContact, centre_x=centre[0], centre_y=centre[1]
    )
    by_load = {"middle": middle, "slopes": np.ascontiguousarray(slopes)}
    scale = np.full(STATES, radius / np.sqrt(weights.shape[1] + 1))
    return _packed(
        compiled, packed, following_cells, record, by_load, radius, height, LAG
    )._replace(
        states=packed.states + STATES,
        state_scale=np.append(packed.state_scale, scale),
    )


def _packed(
    compiled: CompiledDistributed, packed: PackedModel, source: Any, make: Any,
    by_load: dict[str, np.ndarray], radius: float, height: float = 0.0, lag: float = 0.0,
) -> PackedModel:  # fmt: skip
    """Pack cells with a source, a module; `make` its record with what sources share and arrays with rows by load."""
    (weights, cells) = packed.keepalive
    n = packed.states
    count = len(packed.records)
    x, y = np.ascontiguousarray(compiled.patch.positions[packed.cells].T)

    def room() -> Pressed:
        own = weights[0].copy(), cells.copy()
        return Pressed(row_of(compiled.record(own[1], own[0])[0]), *own)

    calls = calls_of(packed.functions, change=lag > 0.0)
    given = GivenPressure(
        count=len(x), numbers=len(cells), states=n, calls=calls, x=x, y=y, whole=packed.records, weights=weights,
        held=room(), trial=room(), acts=np.zeros(1), rate=np.zeros(n), wrench=np.zeros(3),
        by_input=np.zeros((3, n)), zero=np.zeros(n), rows=np.zeros(12), radius=radius,
        height=height, lag=lag,
    )  # fmt: skip
    at = {"whole": places_of(packed.records), "weights": places_of(weights)}
    columns = {name: places_of(rows) for name, rows in by_load.items()}
    columns["given"] = rows_of(given, count, **at)
    record = make(given=columns["given"][0], **by_load)
    return packed._replace(
        functions=source.FUNCTIONS,
        records=rows_of(record, count, **columns),
        workspace=OWN + packed.workspace,
        keepalive=(*packed.keepalive, given, record),
    )
