"""Records of `ReducedModel`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction.compiled.packed import PackedModel
from planarfriction.compiled.three_states import Kind
from planarfriction.compiler.memory import place_of, rows_of
from planarfriction.kernels import reduced_contact, reduced_step
from planarfriction.kernels.moments import LINEAR
from planarfriction.kernels.reduced_contact import ReducedContact, ReducedPatch


def records(law: Any, shapes: Sequence[Any], radius: float) -> PackedModel:
    """Pack one part with the law at each of the `shapes` (`ReducedShape`); `radius` is the lever arm [m]."""
    maps = {id(data): data for shape in shapes for data in (shape.data, shape.other) if data is not None}
    at = {name: place_of(data) for name, data in maps.items()}
    data = np.array([at[id(shape.data)] for shape in shapes])
    other = np.array([at[id(shape.data if shape.other is None else shape.other)] for shape in shapes])
    factors = np.array([shape.factor for shape in shapes])[:, *np.triu_indices(3)]
    numbers = np.column_stack([factors, [shape.blend for shape in shapes]])
    record = ReducedContact(law.numbers, ReducedPatch(*numbers[0]), shapes[0].data, 0)
    keepalive = tuple(maps.values())
    rows = rows_of(record, len(shapes), shape=numbers, data=data, other=(other - data) // keepalive[0].itemsize)
    scale = np.full(3, law.largest_deflection)
    return PackedModel(reduced_contact.FUNCTIONS, rows, 3, LINEAR.size, scale, radius, keepalive)


REDUCED = Kind(reduced_step.STEPS, records)
"""Kind of `ReducedModel`."""
