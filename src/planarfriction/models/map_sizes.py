"""The sizes of stored maps of steady sliding, and where each of several maps begins."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from planarfriction.kernels.steady import HEADER


class MapSizes(NamedTuple):
    """Sizes of a map, as `kernels.steady` names them."""

    faces: int
    segments: int
    coarse: int
    levels: int

    @property
    def middle(self) -> int:
        """Number of entries in front of the Stribeck part."""
        return HEADER + self.faces * 12 * (2 * self.segments + 1) ** 2

    @property
    def count(self) -> int:
        """Number of entries of the map."""
        return self.middle + self.faces * 12 * (2 * self.coarse + 1) ** 2 * self.levels


def sizes_of(data: Any) -> MapSizes:
    """Return the sizes of a map from its entries, which compiled loops read."""
    return MapSizes(*(int(value) for value in data[:4]))


def starts_of(sizes: Sequence[MapSizes]) -> list[int]:
    """Return the index of the first entry of each map, in an array of maps one behind the other."""
    return [0, *itertools.accumulate(size.count for size in sizes)][: len(sizes)]


def maps_of(data: Any, sizes: Sequence[MapSizes]) -> Iterator[Any]:
    """Yield the entries of each map from an array of maps one behind the other."""
    return (data[at : at + size.count] for at, size in zip(starts_of(sizes), sizes, strict=True))
