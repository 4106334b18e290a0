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
    held, trial = ((np.zeros(len(x)), np.zeros_like(cells)) for _ in range(2))
    held_row, trial_row = (row_of(compiled.record(numbers, share)[0]) for share, numbers in (held, trial))
    rate, by_place, wrench = np.zeros(packed.states), np.zeros((3, packed.states)), np.zeros(3)
    calls = calls_of(packed.functions)
    record = EdgeContact(
        count=len(x),
        numbers=len(cells),
        turned=patch.anisotropic,
        discs=compiled.size == 3,
        x=x,
        y=y,
        radii=radii,
        middle=middle,
        outline=corners,
        corners=len(corners),
        weights=weights,
        cells=cells,
        whole=place_of(packed.records),
        held=place_of(held_row),
        held_weights=held[0],
        held_cells=held[1],
        trial=place_of(trial_row),
        trial_weights=trial[0],
        trial_cells=trial[1],
        calls=calls,
        states=packed.states,
        rate=rate,
        by_place=by_place,
        wrench=wrench,
    )
    rows, room = (packed.records, held_row, trial_row), (*held, *trial, rate, by_place, wrench)
    return packed._replace(
        functions=FUNCTIONS,
        records=rows_of(record, len(weights), weights=places_of(weights), whole=places_of(packed.records)),
        workspace=OWN + packed.workspace,
        keepalive=(*packed.keepalive, x, y, radii, middle, corners, calls, *rows, *room),
    )
