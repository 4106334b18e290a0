"""Stored shapes of a patch that depends on the load: maps at a ladder of loads, two neighbours blended in between."""

from __future__ import annotations

import functools
import threading

import numpy as np

from planarfriction.models.reduced_map import ReducedShape, is_point, reduced_map, reduced_shape, slip_factor
from planarfriction.models.steady_sums import ScaledCells
from planarfriction.patch import ContactPatch

HALVINGS = 6
"""Largest number of halvings of an octave of the load: the closest rungs are 0.8 to 1.6 % apart."""

CHECKED = 64
"""Directions at which the blend of two rungs is compared with the sum over the cells."""

_WITHIN = (0.25, 0.5, 0.75)
"""Places between two rungs that are checked.

A cell that gets its first load beside the middle leaves no trace in the middle.
"""

ALIKE = 1e-7
"""Relative difference up to which two rungs are the same but for the rounding of their maps."""

REMEMBERED = 4096
"""Loads whose shapes a family remembers."""

MEMORY = 512e6
"""Bytes of maps beyond which a family forgets all that it has built, shared by those of a model; default ones take 1 MB
each."""


class LoadFamily:
    """Shapes of a patch at any load, from maps that are built where loads are asked for.

    Rungs stand at the powers of 2 [N] and, where `z_ss/|V_G|` blended linearly in the load is off by more than `error`
    / 2 (relative, the worst of `CHECKED` directions a quarter, half and three quarters of the way), at the middle
    between them, and so on: where they stand depends on patch and error alone. A load within `error` / 2 of one of its
    two rungs is served by that rung alone, which is faster to read than two. Maps are in scaled coordinates, `F V`, and
    F is that of the very load, so that a contact that only grows needs hardly any.

    On a grid the shape jumps or bends where a cell gets its first load. There `HALVINGS` ends the search: within these
    last intervals the error may be larger than `error` (soft fingers 12 cells across: 1e-3).

    Any number of threads may ask: one builds at a time, and what has been built never changes. A shape holds its maps,
    so that they live as long as anyone reads them, whatever the family forgets.
    """

    def __init__(
        self, patch: ContactPatch, gamma: float, segments: int, speeds: int, error: float, families: int = 1
    ) -> None:
        self._patch, self._error, self._families = patch, error, families
        self._map = gamma, segments, speeds
        self._sums: dict[float, np.ndarray | None] = {}
        self._good: dict[tuple[float, float], bool] = {}
        self._gaps: dict[tuple[float, float], float] = {}
        self._maps: dict[float, np.ndarray] = {}
        self._shapes: dict[float, ReducedShape] = {}
        self._lock = threading.Lock()
        """Held by who builds; shapes that are there are read without it."""

    def __reduce__(self) -> tuple[type, tuple]:
        return LoadFamily, (self._patch, *self._map, self._error, self._families)  # a copy builds its own

    @property
    def rungs(self) -> list[float]:
        """Loads [N] whose maps have been built and not been forgotten, ascending."""
        with self._lock:
            return sorted(self._maps)

    def shapes(self, loads: list[float]) -> list[ReducedShape]:
        """Return shapes at loads > 0 [N]: F of each load, and references to the maps of its two neighbours.

        Where one neighbour is so light that it is a point, the other is taken alone.
        """
        known = self._shapes
        found = {load: known.get(load) for load in loads}
        missing = [load for load, shape in found.items() if shape is None]
        if missing:
            with self._lock:
                found.update(self._built(missing))
        return [found[load] for load in loads]  # pyright: ignore[reportReturnType]

    def followed(self, loads: list[float], shapes: list[ReducedShape]) -> list[tuple[ReducedShape, float]]:
        """Return the `shapes` at loads > 0 [N] with the maps of both neighbours, and the slopes of their blends [1/N].

        A load that one rung serves alone has that rung's value, but moves on towards the other one all the same.
        """
        with self._lock:
            return [self._followed(load, shape) for load, shape in zip(loads, shapes, strict=True)]

    def _followed(self, load: float, shape: ReducedShape) -> tuple[ReducedShape, float]:
        rungs = [] if shape.contact_radius == 0.0 else self._neighbours(load)
        if len(rungs) < 2 or self._apart(*rungs) <= ALIKE:
            return shape, 0.0
        low, high = rungs
        if shape.other is not None:
            return shape, 1.0 / (high - low)
        if self._served(load, low, high) == low:
            return shape._replace(other=self._map_at(high)), 1.0 / (high - low)
        return shape._replace(other=self._map_at(low)), -1.0 / (high - low)

    def _built(self, loads: list[float]) -> dict[float, ReducedShape]:
        """Build the shapes at loads that were missing, unless another thread has built them since."""
        shapes = {}
        for load, factor in zip(loads, slip_factor(self._patch, np.array(loads)), strict=True):
            shape = self._shapes.get(load)
            if shape is None:
                rungs = [] if factor[2, 2] == 0.0 else self._neighbours(load)
                shape = self._blend(load, factor, *rungs) if rungs else reduced_shape(self._patch, load, *self._map)
            if len(self._shapes) >= REMEMBERED:
                self._shapes = {}
            shapes[load] = self._shapes[load] = shape
        return shapes

    def _blend(self, load: float, factor: np.ndarray, low: float, high: float | None = None) -> ReducedShape:
        """Blend two rungs linearly in the load, or take one alone where that is as close as wanted."""
        if high is None:
            return ReducedShape(factor, self._map_at(low))
        alone = self._served(load, low, high)
        if alone is not None:
            return ReducedShape(factor, self._map_at(alone))
        return ReducedShape(factor, self._map_at(low), self._map_at(high), (load - low) / (high - low))

    def _served(self, load: float, low: float, high: float) -> float | None:
        """Return the rung of two that is as close as wanted to a load, if any."""
        share, apart = (load - low) / (high - low), self._apart(low, high)
        if share * apart <= 0.5 * self._error:
            return low
        return high if (1.0 - share) * apart <= 0.5 * self._error else None

    def _neighbours(self, load: float) -> list[float]:
        """Return the two rungs around a load, without those that are points."""
        low = float(np.ldexp(0.5, np.frexp(load)[1]))  # the power of 2 below
        high = 2.0 * low
        for _ in range(HALVINGS):
            if self._is_good(low, high):
                break
            middle = 0.5 * (low + high)
            low, high = (low, middle) if load < middle else (middle, high)
        return [rung for rung in (low, high) if self._sum(rung) is not None]

    def _is_good(self, low: float, high: float) -> bool:
        """Return True if the blend of two rungs is as close as wanted."""
        if (low, high) not in self._good:
            worst = np.inf
            first, last = self._sum(low), self._sum(high)
            between = [low + share * (high - low) for share in _WITHIN]
            if first is not None and last is not None and not any(is_point(self._patch, load) for load in between):
                true = [self._cell_sums(load) for load in between]
                pairs = zip(_WITHIN, true, strict=True)
                worst = max(_largest(first + share * (last - first) - sums, sums) for share, sums in pairs)
            self._good[low, high] = bool(worst <= 0.5 * self._error)
        return self._good[low, high]

    def _apart(self, low: float, high: float) -> float:
        """Return the largest relative difference of two rungs."""
        if (low, high) not in self._gaps:
            first, last = self._sum(low), self._sum(high)
            assert first is not None and last is not None
            self._gaps[low, high] = _largest(last - first, first)
        return self._gaps[low, high]

    def _sum(self, load: float) -> np.ndarray | None:
        """Return steady sliding at a rung in the checked directions, None where one point carries the load."""
        if load not in self._sums:
            self._sums[load] = None if is_point(self._patch, load) else self._cell_sums(load)
        return self._sums[load]

    def _cell_sums(self, load: float) -> np.ndarray:
        cells = ScaledCells(self._patch, load, slip_factor(self._patch, load))
        return cells.sums(_directions(), np.empty(0), self._map[0])[:, 0]

    def _map_at(self, rung: float) -> np.ndarray:
        """Return the map of a rung."""
        found = self._maps.get(rung)
        if found is None:
            cells = ScaledCells(self._patch, rung, slip_factor(self._patch, rung))
            found = reduced_map(cells, *self._map)
            if self._families * (len(self._maps) + 1) * found.nbytes > MEMORY:
                self._maps, self._shapes = {}, {}
            self._maps[rung] = found
        return found


def _largest(error: np.ndarray, of: np.ndarray) -> float:
    """Return the largest relative length of vectors `[M, 3]`."""
    return float((np.linalg.norm(error, axis=1) / np.linalg.norm(of, axis=1)).max())


@functools.lru_cache(maxsize=1)
def _directions() -> np.ndarray:
    """Return directions `[CHECKED, 3]` spread evenly over the half of the sphere that spins counter-clockwise.

    They are on a golden spiral; both halves of an asymmetric patch differ by what is the same for all directions.
    """
    i = np.arange(CHECKED) + 0.5
    height, angle = i / CHECKED, np.pi * (1.0 + np.sqrt(5.0)) * i
    flat = np.sqrt(1.0 - height**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), height], -1)
