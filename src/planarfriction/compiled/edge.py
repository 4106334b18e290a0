"""Cells under a body with an edge, as the solver of scenes reads them."""

from __future__ import annotations

import numpy as np

from planarfriction.compiled.distributed import CompiledDistributed
from planarfriction.compiled.packed import PackedModel
from planarfriction.compiler.memory import place_of, places_of, row_of, rows_of
from planarfriction.errors import InvalidValueError
from planarfriction.kernels.contacts import calls_of
from planarfriction.kernels.edge_cells import FUNCTIONS, OWN, EdgeContact

SMALLEST = 1e-9
"""Least radius of the disc that a cell stands for [m]: a point without size is covered or not."""


def under_edge(compiled: CompiledDistributed, packed: PackedModel, outline: np.ndarray) -> PackedModel:
    """Return packed cells that carry load where the body is above them, whose `outline` is `[M, 2]` [m].

    Raises InvalidValueError for an outline around nothing.
    """
    (weights, cells), chosen, patch = packed.keepalive, packed.cells, compiled.patch
    x, y = np.ascontiguousarray(patch.positions[chosen].T)
    sides = np.sqrt(patch.cell_extents()[chosen].prod(axis=1) / np.pi)  # a disc of the same area
    radii = np.maximum(np.where(patch.radii[chosen] > 0.0, patch.radii[chosen], sides), SMALLEST)
    centre = np.array([x.mean(), y.mean()])
    middle = np.append(centre, (np.hypot(x - centre[0], y - centre[1]) + radii).max())
    outline = outline[(outline != np.roll(outline, 1, axis=0)).any(axis=1)]  # a corner may stand there twice
    ahead = np.roll(outline, -1, axis=0)
    area = 0.5 * float((outline[:, 0] * ahead[:, 1] - outline[:, 1] * ahead[:, 0]).sum())
    if area == 0.0:
        raise InvalidValueError("outline", "enclose an area where a contact has an edge", "none")
    corners = np.ascontiguousarray(outline if area > 0.0 else outline[::-1])
    shapes = {"rate": packed.states, "by_place": (3, packed.states), "wrench": 3}
    for name in ("held", "trial"):
        shapes |= {f"{name}_weights": len(x), f"{name}_cells": cells.shape}
    room = {name: np.zeros(shape) for name, shape in shapes.items()}
    held, trial = (
        row_of(compiled.record(room[f"{name}_cells"], room[f"{name}_weights"])[0]) for name in ("held", "trial")
    )
    arrays = {"x": x, "y": y, "radii": radii, "middle": middle, "outline": corners, "weights": weights, "cells": cells}
    arrays |= {"calls": calls_of(packed.functions), **room}
    record = EdgeContact(
        **arrays, count=len(x), numbers=len(cells), turned=patch.anisotropic, discs=compiled.size == 3,
        corners=len(corners), whole=place_of(packed.records), held=place_of(held), trial=place_of(trial),
        states=packed.states,
    )  # fmt: skip
    return packed._replace(
        functions=FUNCTIONS,
        records=rows_of(record, len(weights), weights=places_of(weights), whole=places_of(packed.records)),
        workspace=OWN + packed.workspace,
        keepalive=(*packed.keepalive, packed.records, held, trial, *arrays.values()),
    )
