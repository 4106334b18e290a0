"""Cells under a body with an edge, and cells whose pressure follows the load, as the solver of scenes reads them."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction._engine.cells import edge_cells, following_cells
from planarfriction._engine.cells.moment_pressure import NARROW
from planarfriction._engine.compiler.memory import place_of, places_of, row_of, rows_of
from planarfriction._engine.protocol import calls_of
from planarfriction._engine.records.distributed import CompiledDistributed
from planarfriction._engine.records.packed import PackedModel
from planarfriction.errors import InvalidValueError

SMALLEST = 1e-9
"""Least radius of the disc that a cell stands for [m]: a point without size is covered or not."""


def under_edge(
    compiled: CompiledDistributed, packed: PackedModel, outline: np.ndarray
) -> PackedModel:
    """Return packed cells that carry load where the body is above them, whose `outline` is `[M, 2]` [m].

    Raises InvalidValueError for an outline around nothing.
    """
    (weights, cells) = packed.keepalive
    chosen = packed.cells
    patch = compiled.patch
    x, y = np.ascontiguousarray(patch.positions[chosen].T)
    # A disc of the same area.
    sides = np.sqrt(patch.cell_extents()[chosen].prod(axis=1) / np.pi)
    radii = np.maximum(
        np.where(patch.radii[chosen] > 0.0, patch.radii[chosen], sides), SMALLEST
    )
    centre = np.array([x.mean(), y.mean()])
    middle = np.append(centre, (np.hypot(x - centre[0], y - centre[1]) + radii).max())
    # A corner may stand there twice.
    outline = outline[(outline != np.roll(outline, 1, axis=0)).any(axis=1)]
    ahead = np.roll(outline, -1, axis=0)
    area = 0.5 * float(
        (outline[:, 0] * ahead[:, 1] - outline[:, 1] * ahead[:, 0]).sum()
    )
    if area == 0.0:
        raise InvalidValueError(
            "outline", "enclose an area where a contact has an edge", "none"
        )
    corners = np.ascontiguousarray(outline if area > 0.0 else outline[::-1])
    shapes = {"rate": packed.states, "by_place": (3, packed.states), "wrench": 3}
    for name in ("held", "trial"):
        shapes |= {f"{name}_weights": len(x), f"{name}_cells": cells.shape}
    room = {name: np.zeros(shape) for name, shape in shapes.items()}
    held, trial = (
        row_of(compiled.record(room[f"{name}_cells"], room[f"{name}_weights"])[0])
        for name in ("held", "trial")
    )
    arrays = {
        "x": x,
        "y": y,
        "radii": radii,
        "middle": middle,
        "outline": corners,
        "weights": weights,
        "cells": cells,
    }
    arrays |= {"calls": calls_of(packed.functions), **room}
    record = edge_cells.EdgeContact(
        **arrays, count=len(x), numbers=len(cells), turned=patch.anisotropic, discs=compiled.size == 3,
        corners=len(corners), whole=place_of(packed.records), held=place_of(held), trial=place_of(trial),
        states=packed.states,
    )  # fmt: skip
    return packed._replace(
        functions=edge_cells.FUNCTIONS,
        records=rows_of(
            record,
            len(weights),
            weights=places_of(weights),
            whole=places_of(packed.records),
        ),
        workspace=edge_cells.OWN + packed.workspace,
        keepalive=(*packed.keepalive, packed.records, held, trial, *arrays.values()),
    )


LAG = 1e-3
"""Time [s] with which the pressure follows the load: about a step of a simulator, whose patches follow the load
of the step before."""

STATES = 2
"""States behind the bristles: how far the centre of pressure is from the centre of mass, along x and y [m]."""


def following(
    compiled: CompiledDistributed,
    packed: PackedModel,
    centre: tuple[float, float],
    height: float,
) -> PackedModel:
    """Return packed cells whose pressure follows a load at `centre` [m] in the contact frame, `height` [m] above it."""
    (weights, numbers) = packed.keepalive
    positions = compiled.patch.positions[packed.cells]
    count = weights.shape[1]
    (x, y) = np.ascontiguousarray(positions.T)
    middle, slopes, radius = _statics_of(weights, positions)
    size = packed.states + STATES
    blanks = {
        "pressed": count,
        "trial": count,
        "scratch": size,
        "zero": size,
        "rows": 12,
    }
    scratch = {name: np.zeros(length) for name, length in blanks.items()}
    by_load = {
        "weights": weights,
        "middle": middle,
        "slope_x": slopes[0],
        "slope_y": slopes[1],
    }
    arrays: dict[str, Any] = (
        {"x": x, "y": y, "calls": calls_of(packed.functions, change=True)}
        | scratch
        | by_load
    )
    cells, trial_cells = (
        row_of(compiled.record(numbers, scratch[name])[0])
        for name in ("pressed", "trial")
    )
    record = following_cells.FollowingContact(
        **arrays, count=count, states=packed.states, cells=place_of(cells), trial_cells=place_of(trial_cells),
        radius=radius, centre_x=centre[0], centre_y=centre[1], height=height, lag=LAG,
    )  # fmt: skip
    return packed._replace(
        functions=following_cells.FUNCTIONS,
        records=rows_of(
            record,
            len(weights),
            **{name: places_of(each) for name, each in by_load.items()},
        ),
        states=size,
        workspace=following_cells.OWN + packed.workspace,
        state_scale=np.append(
            packed.state_scale, np.full(STATES, radius / np.sqrt(count + 1))
        ),
        keepalive=(*packed.keepalive, *arrays.values(), cells, trial_cells),
    )


def _statics_of(
    weights: np.ndarray, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the centres of pressure `[R, 2]` of rows of weights, their slopes by it `[2, R, n]`, and a radius [m].

    A plane over cells along a line does not tilt them across it.
    """
    middle = weights @ positions
    away = positions - middle[:, None]
    spread = np.einsum("rn,rni,rnj->rij", weights, away, away)
    slopes = np.einsum(
        "rij,rnj->irn", np.linalg.pinv(spread, rcond=NARROW, hermitian=True), away
    )
    return (
        middle,
        np.ascontiguousarray(slopes),
        float(np.sqrt(np.trace(spread, axis1=1, axis2=2).max())),
    )
