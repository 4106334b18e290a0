"""What the reduced model knows of one of its parts, at any load."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction.equality import by_parts
from planarfriction.kernels.contacts import calls_of
from planarfriction.kernels.parts import FUNCTIONS, PartsContact
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.records import rows_of
from planarfriction.models.base import PackedModel
from planarfriction.models.load_family import LoadFamily
from planarfriction.models.reduced_map import ReducedShape, reduced_shape
from planarfriction.models.remembered import Remembered
from planarfriction.patch import ContactPatch

REMEMBERED = 64
"""Loads whose shapes are remembered where each has a map of its own."""

_FIXED: weakref.WeakKeyDictionary[ContactPatch, dict[tuple[float, int, int], ReducedShape]] = (
    weakref.WeakKeyDictionary()
)
"""What models on the same patch have in common, whatever their friction, as long as the patch is in use."""

_LOCK = threading.Lock()


def fixed_shape(patch: ContactPatch, maps: tuple[float, int, int]) -> ReducedShape:
    """The shape of a patch that does not depend on the load, built once for all models on it that live together."""
    with _LOCK:
        known = _FIXED.setdefault(patch, {})
    found = known.get(maps)
    return known.setdefault(maps, reduced_shape(patch, None, *maps)) if found is None else found


@by_parts
class Part(NamedTuple):
    """A part of a contact at one load."""

    share: float
    """Of the load."""
    shape: Any
    """What the model knows of its cells."""


class PartShapes:
    """The shapes of one of `parts` parts, built where loads are asked for; any number of threads may ask.

    `maps` are the exponent, the segments and the speeds of its maps, `error` the largest from blending them, relative
    to the whole patch; 0 builds a map for each load.
    """

    def __init__(self, patch: ContactPatch, maps: tuple[float, int, int], error: float, parts: int) -> None:
        self.patch, self._maps, self._error, self._parts = patch, maps, error, parts
        self._fixed = None if patch.depends_on_load else fixed_shape(patch, maps)
        self._forget()

    def _forget(self) -> None:
        self._family = LoadFamily(self.patch, *self._maps, self._parts * self._error, self._parts)
        self._recent: Remembered[ReducedShape] = Remembered(REMEMBERED)

    def at(self, loads: Sequence[float | None]) -> list[ReducedShape]:
        """Shapes at loads > 0 of the whole patch [N], which costs less than one by one."""
        if self._fixed is not None:
            return [self._fixed for _ in loads]
        return self._family.shapes(loads) if self._error > 0.0 else [self._built(load) for load in loads]  # pyright: ignore

    def followed(self, loads: list[float], shapes: list[ReducedShape]) -> list[tuple[ReducedShape, float]]:
        """See `LoadFamily.followed`."""
        return self._family.followed(loads, shapes)

    @property
    def rungs(self) -> list[float]:
        """Loads [N] at which maps have been built and not been forgotten, ascending."""
        return self._family.rungs

    def _built(self, load: float) -> ReducedShape:
        return self._recent.get(load, lambda: reduced_shape(self.patch, load, *self._maps))

    def __getstate__(self) -> dict[str, Any]:
        """What a copy gets: memories are shared by threads, not by models."""
        return {name: value for name, value in self.__dict__.items() if name not in ("_family", "_recent")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._forget()


def together(parts: Sequence[PackedModel], shares: np.ndarray) -> PackedModel:
    """A contact of P parts as the solver sees it, from its parts at the same R loads and their shares `[R, P]`."""
    one, count = parts[0], len(parts)
    calls = calls_of(one.functions, change=True)
    records = np.stack([place_of(part.records) + part.records.strides[0] * np.arange(len(shares)) for part in parts], 1)
    records, shares = np.ascontiguousarray(records), np.ascontiguousarray(shares)
    row = 8 * count * np.arange(len(shares))
    record = PartsContact(count, one.states, one.workspace, place_of(calls), 0, 0)
    return one._replace(
        functions=FUNCTIONS,
        records=rows_of(record, len(shares), records=place_of(records) + row, shares=place_of(shares) + row),
        states=count * one.states,
        workspace=count * one.workspace,
        state_scale=np.tile(one.state_scale, count),
        keepalive=(calls, records, shares, *(array for part in parts for array in (part.records, *part.keepalive))),
    )
