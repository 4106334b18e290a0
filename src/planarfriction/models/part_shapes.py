"""Shapes of the parts of a reduced model at any load."""

from __future__ import annotations

import functools
import itertools
import threading
import weakref
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.compiled.remembered import Remembered
from planarfriction.compiled.shapes_by_load import Part
from planarfriction.models.load_family import LoadFamily
from planarfriction.models.reduced_map import ReducedShape, reduced_shape, slip_factor
from planarfriction.patch import ContactPatch
from planarfriction.patch.parts import part_of

REMEMBERED = 64
"""Number of loads whose shapes are remembered where each has a map of its own."""

STEP = 1e-5
"""Relative step of a central difference by the load: it errs by 1e-10 of the number through its third derivative, and
by a few 1e-11 through rounding. Closer than that to a load at which a cell gets its first load it mixes both sides."""

_TOGETHER = 32
"""Number of loads whose shapes and weights are asked for at once: those of all would not fit into the memory."""

_FIXED: weakref.WeakKeyDictionary[ContactPatch, dict[tuple[float, int, int], ReducedShape]] = (
    weakref.WeakKeyDictionary()
)
"""Shapes that models on the same patch have in common, whatever their friction, as long as the patch is in use."""

_LOCK = threading.Lock()


def fixed_shape(patch: ContactPatch, maps: tuple[float, int, int]) -> ReducedShape:
    """Return the shape of a patch that does not depend on the load, built once for all models on it that coexist."""
    with _LOCK:
        known = _FIXED.setdefault(patch, {})
    found = known.get(maps)
    return known.setdefault(maps, reduced_shape(patch, None, *maps)) if found is None else found


class OnePart:
    """Shapes of one of `parts` parts, built where loads are asked for; any number of threads may ask.

    `maps` are the exponent, the segments and the speeds of its maps, `error` the largest from blending them, relative
    to the whole patch; 0 builds a map for each load.
    """

    def __init__(self, patch: ContactPatch, maps: tuple[float, int, int], error: float, parts: int) -> None:
        self.patch, self._maps, self._error = patch, maps, error
        self._fixed = None if patch.depends_on_load else fixed_shape(patch, maps)
        self.family = LoadFamily(patch, *maps, parts * error, parts)
        self._recent: Remembered[ReducedShape] = Remembered(REMEMBERED)

    def at(self, loads: Sequence[float | None]) -> list[ReducedShape]:
        """Return shapes at loads > 0 of the whole patch [N], which costs less than one by one."""
        if self._fixed is not None:
            return [self._fixed for _ in loads]
        return self.family.shapes(loads) if self._error > 0.0 else [self._built(load) for load in loads]  # pyright: ignore

    def _built(self, load: float) -> ReducedShape:
        return self._recent.get(load, lambda: reduced_shape(self.patch, load, *self._maps))


class ReducedShapes:
    """Shapes of the parts of a patch at any load (see `compiled.three_states.Shapes`).

    `labels` `[N]` are the parts to which cells belong; `maps` and `error` as in `OnePart`.
    """

    def __init__(self, patch: ContactPatch, labels: np.ndarray, maps: tuple[float, int, int], error: float) -> None:
        self._patch, self.count, self.depends_on_load = patch, int(labels.max()) + 1, patch.depends_on_load
        self._cells = [labels == k for k in range(self.count)]
        patches = [patch] if self.count == 1 else [part_of(patch, each) for each in self._cells]
        self.each = [OnePart(part, maps, error, self.count) for part in patches]

    def at(self, loads: Sequence[float | None]) -> Iterator[tuple[Part, ...]]:
        """Yield the parts at each load."""
        if not self.depends_on_load:
            return itertools.repeat(self.fixed, len(loads))
        spans = (loads[first : first + _TOGETHER] for first in range(0, len(loads), _TOGETHER))
        return itertools.chain.from_iterable(map(self._together, spans))

    @functools.cached_property
    def fixed(self) -> tuple[Part, ...]:
        """Parts of a patch that does not depend on the load."""
        return self._together([None])[0]

    @property
    def rungs(self) -> list[float]:
        """Loads [N] for which maps have been computed and not been forgotten, ascending."""
        return sorted({load for part in self.each for load in part.family.rungs})

    def lever_arm(self, load: float | None) -> float:
        """Return the radius of gyration [m] of the whole patch."""
        return float(slip_factor(self._patch, load)[2, 2])

    def arrays(self, shape: ReducedShape) -> tuple[np.ndarray, ...]:
        """Return the maps of a shape."""
        return (shape.data,) if shape.other is None else (shape.data, shape.other)

    def _together(self, loads: Sequence[float | None]) -> list[tuple[Part, ...]]:
        loads = self._checked(loads)
        shapes = zip(*(part.at(loads) for part in self.each), strict=True)
        if self.count == 1:
            return [(Part(1.0, shape),) for (shape,) in shapes]
        given = None if loads[0] is None else np.array(loads)
        weights = self._patch.tile_weights(given).reshape(-1, self._patch.cells)
        # rows that lie in one piece: NumPy sums others in an order that depends on how many there are
        shares = np.stack([np.ascontiguousarray(weights[:, mine]).sum(-1) for mine in self._cells], -1).tolist()
        return [tuple(map(Part, *loaded)) for loaded in zip(shares, shapes, strict=True)]

    def _checked(self, loads: Any) -> list[float | None]:
        if not self.depends_on_load:
            return list(loads)
        if isinstance(loads, np.ndarray) and (loads > 0.0).all() and (loads < np.inf).all():
            return loads.tolist()  # one by one takes longer than all else
        return [validation.positive_load("normal_force", load) for load in loads]

    # ------------------------------------------------------------------ slopes by the load

    def by_load(
        self, loads: np.ndarray, parts: Sequence[tuple[Part, ...]]
    ) -> tuple[list[tuple[Part, ...]], np.ndarray]:
        """Return the `parts` at loads `[L]` with the maps on both sides, and slopes by the load `[P, L, 8]` [1/N].

        Slopes are those of the numbers of each shape and of its share; blends move along the chord between two maps.
        """
        beside, slopes = [], []
        for k, one in enumerate(self.each):
            shapes = [each[k].shape for each in parts]
            numbers = np.array([[*shape.numbers[:6], each[k].share] for shape, each in zip(shapes, parts, strict=True)])
            found = one.family.followed(loads.tolist(), shapes)
            beside.append([shape for shape, _ in found])
            smooth = self._differences(k, loads, numbers)
            slopes.append(np.insert(smooth, 6, [slope for _, slope in found], axis=1))
        moved = [
            tuple(Part(part.share, shape) for part, shape in zip(each, shapes, strict=True))
            for each, *shapes in zip(parts, *beside, strict=True)
        ]
        return moved, np.array(slopes)

    def _differences(self, k: int, loads: np.ndarray, middle: np.ndarray) -> np.ndarray:
        """Return central differences `[L, 7]` of factor and share of part k, one-sided beside those of another kind.

        The kind shows in the zeros of the last two numbers: contacts that shrink to a point, parts without load.
        """
        patch, sides = self.each[k].patch, []

        def numbers(loads: np.ndarray) -> np.ndarray:
            share = np.ones(len(loads)) if self.count == 1 else self._patch.weights(loads)[:, self._cells[k]].sum(-1)
            return np.column_stack([slip_factor(patch, loads)[:, *np.triu_indices(3)], share])

        for place in (loads * (1.0 - STEP), loads * (1.0 + STEP)):
            spans = (place[first : first + _TOGETHER] for first in range(0, len(place), _TOGETHER))
            end = np.concatenate([numbers(span) for span in spans])
            same = ((end[:, -2:] == 0.0) == (middle[:, -2:] == 0.0)).all(axis=1)
            sides.append((np.where(same[:, None], end, middle), np.where(same, place, loads)))
        (low, begin), (high, end) = sides
        wide = np.where(end > begin, end - begin, np.inf)
        return (high - low) / wide[:, None]
