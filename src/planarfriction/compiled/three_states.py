"""Machine form of models of three states for each part of a contact."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from planarfriction.compiled import packed
from planarfriction.compiled.base import CompiledModel
from planarfriction.compiled.packed import PackedModel, PackedParts
from planarfriction.compiled.rates import linearised
from planarfriction.compiled.shapes_by_load import Part, ShapesByLoad, shapes_by_load
from planarfriction.kernels.steps import StepFunctions
from planarfriction.patch.tilt import tilted


class Kind(NamedTuple):
    """Compiled functions and records of a kind of model of three states."""

    steps: StepFunctions
    records: Callable[[Any, Sequence[Any], float], PackedModel]
    """Pack one part: a law, its shapes at R loads and the lever arm [m]."""


class Shapes(Protocol):
    """Shapes of the parts of a patch at any load; any number of threads may ask."""

    count: int
    """Number of parts."""
    depends_on_load: bool
    """True if the shapes change with the load."""

    def at(self, loads: Sequence[float | None]) -> Iterator[tuple[Part, ...]]:
        """Yield the parts at each load > 0 [N]; None stands for any load if the shapes do not depend on it."""
        ...

    def lever_arm(self, load: float | None) -> float:
        """Return the length [m] that turns spins into speeds at a load."""
        ...

    def arrays(self, shape: Any) -> tuple[np.ndarray, ...]:
        """Return the large arrays of a shape."""
        ...


def places_of_parts(parts: Sequence[Part]) -> np.ndarray:
    """Return the centre of pressure of each part, `[P, 2]` [m]."""
    places = []
    for part in parts:
        lever = part.shape.lever  # its first two rows: the velocity at the centre, in the axes of the friction metric
        y, x = np.linalg.solve(lever[:2, :2], lever[:2, 2])
        places.append((x, -y))
    return np.reshape(places, (-1, 2))


class CompiledThreeStates(CompiledModel):
    """Machine form of a model of three states for each part of a contact.

    Parts see the same twist and know nothing of each other; the wrench is the sum of theirs, each times its share.
    """

    def __init__(self, kind: Kind, law: Any, shapes: Shapes) -> None:
        self._kind, self._law, self.shapes = kind, law, shapes
        inner = (3,) if shapes.count == 1 else (shapes.count, 3)
        super().__init__(kind.steps, inner, (*inner, 3), shapes.count)

    # ------------------------------------------------------------------ at given loads

    @functools.cached_property
    def fixed(self) -> PackedParts | None:
        """See `CompiledModel`."""
        return None if self.shapes.depends_on_load else self.packed_parts([None])

    def parts_at_each_load(self, load: np.ndarray) -> Iterator[tuple[Any, tuple[Part, ...]]]:
        """Yield the parts at each of the different loads > 0 of a batch, and the rows of the flat batch that have it.

        A contact whose shape does not depend on the load has all rows.
        """
        if not self.shapes.depends_on_load:
            yield slice(None), next(iter(self.shapes.at([None])))
            return
        flat = load.reshape(-1)
        different = np.unique(flat[flat > 0.0])
        for value, parts in zip(different, self.shapes.at(different), strict=True):  # pyright: ignore
            yield flat == value, parts

    def at_each_load(self, load: np.ndarray) -> Iterator[tuple[Any, PackedParts]]:
        """See `CompiledModel`."""
        for rows, parts in self.parts_at_each_load(load):
            yield rows, self._at(parts)

    def points(self) -> tuple[np.ndarray, int]:
        """See `CompiledModel`."""
        parts = () if self.shapes.depends_on_load else next(iter(self.shapes.at([None])))
        return places_of_parts(parts), 0

    def _following(self, load: np.ndarray, centre: np.ndarray) -> Iterator[tuple[Any, PackedParts, np.ndarray | None]]:
        """Shift load among the parts, as if they were cells, and move them where that does not reach the centre."""
        for rows, parts in self.parts_at_each_load(load):
            asked, contact, places = centre[rows], self._at(parts), places_of_parts(parts)
            shares = np.tile([part.share for part in parts], (len(asked), 1))
            shares = tilted(places, shares, asked)
            own = [part._replace(records=np.repeat(part.records, len(asked), axis=0)) for part in contact.parts]
            yield rows, PackedParts(own, shares), asked - shares @ places

    def linearisation(self, parts: tuple[Part, ...], state: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """Return linearisations of the parts `[B, P, L]` at flat states and twists (see the kernels of the model)."""
        lin = linearised(self._at(parts).joined, state, twist)
        return lin.reshape(len(lin), self.parts, lin.shape[1] // self.parts)

    def _at(self, parts: tuple[Part, ...]) -> PackedParts:
        return self.fixed or self._packed([parts])

    def _packed(self, loaded: Sequence[tuple[Part, ...]], radius: float = 0.0) -> PackedParts:
        """Pack the parts at R loads; `radius` is the lever arm [m] of the contact."""
        each = [[part.shape for part in same] for same in zip(*loaded, strict=True)]
        shares = np.array([[part.share for part in parts] for parts in loaded])
        return PackedParts([self._kind.records(self._law, shapes, radius) for shapes in each], shares)

    # ------------------------------------------------------------------ for the loops of others

    def packed(self, loads: Sequence[float | None], between: tuple[float, float] | None = None) -> PackedModel:
        """See `CompiledModel`; the lever arm of a run is that at its highest load."""
        loaded = list(self.shapes.at(loads)) if between is None else self._first(loads)
        radius = max(map(self.shapes.lever_arm, loads if between is None else between[1:]))
        return self._packed(loaded, radius).joined

    def packed_parts(self, loads: Sequence[float | None]) -> PackedParts:
        """See `CompiledModel`."""
        return self._packed(list(self.shapes.at(loads)))

    def at_loads(self, loads: np.ndarray, slopes: bool) -> ShapesByLoad:
        """Pack a contact of `ReducedModel` at different loads > 0 `[L]` [N], with its `slopes` by the load or zeros."""
        loaded, by_load = list(self.shapes.at(loads)), None  # pyright: ignore[reportArgumentType]
        if slopes:
            loaded, by_load = self.shapes.by_load(loads, loaded)  # pyright: ignore[reportAttributeAccessIssue]
        return shapes_by_load(loaded, by_load)

    def _first(self, loads: Sequence[float | None]) -> list[tuple[Part, ...]]:
        """Return parts at the first of `loads`, as many as `MAX_PACK_BYTES` and `MAX_PACK_SECONDS` allow."""
        found, counted, size, begin = [], set(), 0, time.perf_counter()
        for parts in self.shapes.at(loads):
            found.append(parts)
            arrays = [array for part in parts for array in self.shapes.arrays(part.shape)]
            new = {id(data): data.nbytes for data in arrays if id(data) not in counted}
            if new:  # no other array takes the place of one, as `found` holds it
                counted.update(new)
                size += sum(new.values())
                if size > packed.MAX_PACK_BYTES and len(found) > 1:
                    return found[:-1]
                if time.perf_counter() - begin > packed.MAX_PACK_SECONDS:
                    break
        return found
