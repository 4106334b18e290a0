"""Records of `ReducedModelPublished`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction.compiled.packed import PackedModel
from planarfriction.compiled.three_states import Kind
from planarfriction.compiler.memory import place_of, rows_of
from planarfriction.kernels import published_contact, published_step
from planarfriction.kernels.moments import LINEAR
from planarfriction.kernels.published_contact import PublishedContact, PublishedPatch, Root

_VELOCITY_SCALE = 0.01
"""Natural scale of the velocity, as a share of v_s [-].

The published map has several directions into which a patch that has come to a halt may go on, and 1e-5 of v_s decides
which: two pads end 9 um apart.
"""


def records(law: Any, shapes: Sequence[Any], radius: float) -> PackedModel:
    """Pack a contact with the law at each of the `shapes` (`PublishedShape`); `radius` is the lever arm [m]."""
    data = [np.ascontiguousarray(shape.surface.numbers.data, dtype=float) for shape in shapes]
    root = shapes[0].root
    record = PublishedContact(
        law.numbers, PublishedPatch(*shapes[0].numbers), Root(root[0, 0], root[0, 1], root[1, 1]), 0, 0, data[0]
    )
    rows = rows_of(
        record,
        len(shapes),
        shape=np.array([shape.numbers for shape in shapes]),
        kind=np.array([shape.surface.numbers.kind for shape in shapes]),
        size=np.array([shape.surface.numbers.size for shape in shapes]),
        data=np.array([place_of(each) for each in data]),
    )
    scale = law.largest_deflection * np.array([1.0, 1.0, radius or 1.0])
    functions, size = published_contact.FUNCTIONS, LINEAR.size
    return PackedModel(functions, rows, 3, size, scale, radius, tuple(data), velocity_scale=_VELOCITY_SCALE)


PUBLISHED = Kind(published_step.STEPS, records)
"""Kind of `ReducedModelPublished`."""
