"""Machine form of `ReducedModelPublished`: three bristles and a limit surface."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from planarfriction._engine.compiler.memory import place_of, rows_of
from planarfriction._engine.published import published_contact
from planarfriction._engine.published.published_contact import (
    LINEAR,
    PublishedContact,
    PublishedPatch,
    Root,
)
from planarfriction._engine.published.published_step import STEPS
from planarfriction._engine.records import packed
from planarfriction._engine.records.base import CompiledModel
from planarfriction._engine.records.packed import PackedModel, linearised

_VELOCITY_SCALE = 0.01
"""Natural scale of the velocity, as a share of v_s [-].

The published map has several directions into which a patch that has come to a halt may go on, and 1e-5 of v_s decides
which: two pads end 9 um apart.
"""


class CompiledPublished(CompiledModel):
    """Machine form of a `ReducedModelPublished` with a law, and `PublishedShapes` of the patch at any load."""

    def __init__(self, law: Any, shapes: Any) -> None:
        self._law = law
        self.shapes = shapes
        self.depends_on_load = shapes.depends_on_load
        super().__init__(STEPS, (3,), (3, 3))

    # ------------------------------------------------------------------ at given loads

    def shape_at_each_load(self, load: np.ndarray) -> Iterator[tuple[Any, Any]]:
        """Yield the shape at each of the different loads > 0 of a batch, and the rows of the flat batch that have it.

        A contact whose shape does not depend on the load has all rows.
        """
        if not self.depends_on_load:
            yield slice(None), self.shapes.shape_at(None)
            return
        flat = load.reshape(-1)
        for value in np.unique(flat[flat > 0.0]):
            yield flat == value, self.shapes.shape_at(value)

    def pressed(
        self, load: np.ndarray, pressure: Any = None
    ) -> Iterator[tuple[Any, PackedModel, np.ndarray | None]]:
        """See `CompiledModel`; the patch moves as a whole to the centre of pressure."""
        for rows, shape in self.shape_at_each_load(load):
            yield (
                rows,
                self._at(shape),
                pressure
                if pressure is None
                else pressure.reshape(-1, 2)[rows] - shape.place,
            )

    def points(self) -> tuple[np.ndarray, int]:
        """See `CompiledModel`."""
        if self.depends_on_load:
            return np.empty((0, 3)), 0
        return np.array([[*self.shapes.shape_at(None).place, 0.0]]), 0

    def linearisation(
        self, shape: Any, state: np.ndarray, twist: np.ndarray
    ) -> np.ndarray:
        """Return linearisations `[B, L]` at flat states and twists (see `published_contact.LinearPublished`)."""
        return linearised(self._at(shape), state, twist)

    def _at(self, shape: Any) -> PackedModel:
        return self.fixed or self._packed([shape])

    def _packed(self, shapes: Sequence[Any], radius: float = 0.0) -> PackedModel:
        """Pack a contact at each of the `shapes` (`PublishedShape`); `radius` is the lever arm [m]."""
        data = [
            np.ascontiguousarray(shape.surface.numbers.data, dtype=float)
            for shape in shapes
        ]
        numbers = self._law.numbers
        root = shapes[0].root
        patch = PublishedPatch(*shapes[0].numbers)
        metric = Root(root[0, 0], root[0, 1], root[1, 1])
        rows = rows_of(
            PublishedContact(numbers, patch, metric, 0, 0, data[0]),
            len(shapes),
            shape=np.array([shape.numbers for shape in shapes]),
            kind=np.array([shape.surface.numbers.kind for shape in shapes]),
            size=np.array([shape.surface.numbers.size for shape in shapes]),
            data=np.array([place_of(each) for each in data]),
        )
        scale = self._law.largest_deflection * np.array([1.0, 1.0, radius or 1.0])
        return PackedModel(
            published_contact.FUNCTIONS, rows, 3, LINEAR.size, scale, radius, tuple(data),
            velocity_scale=_VELOCITY_SCALE,
        )  # fmt: skip

    # ------------------------------------------------------------------ for the loops of others

    def packed(
        self, loads: Sequence[float | None], between: tuple[float, float] | None = None
    ) -> PackedModel:
        """See `CompiledModel`; the lever arm of a run is that at its highest load."""
        shapes = (
            list(map(self.shapes.shape_at, loads))
            if between is None
            else self._first(loads)
        )
        ends = loads if between is None else between[1:]
        return self._packed(
            shapes, max(self.shapes.shape_at(load).contact_radius for load in ends)
        )

    def with_all_states(self, loads: Sequence[float | None]) -> PackedModel:
        """See `CompiledModel`."""
        return self._packed(list(map(self.shapes.shape_at, loads)))

    def _first(self, loads: Sequence[float | None]) -> list[Any]:
        """Return shapes at the first of `loads`, as many as `MAX_PACK_BYTES` and `MAX_PACK_SECONDS` allow."""
        shapes = []
        surfaces = {}
        begin = time.perf_counter()
        for load in loads:
            shapes.append(self.shapes.shape_at(load))
            data = shapes[-1].surface.numbers.data
            # No other array takes the place of one, as `shapes` holds it.
            if id(data) in surfaces:
                continue
            surfaces[id(data)] = data.nbytes
            if sum(surfaces.values()) > packed.MAX_PACK_BYTES and len(shapes) > 1:
                return shapes[:-1]
            if time.perf_counter() - begin > packed.MAX_PACK_SECONDS:
                break
        return shapes
