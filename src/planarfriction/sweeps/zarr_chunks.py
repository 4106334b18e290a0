"""Arrays of a zarr store, whose chunks hold many runs: filled in memory, and written now and then."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction.errors import FileError
from planarfriction.sweeps.bookkeeping import Index
from planarfriction.sweeps.records import reason_of
from planarfriction.writing import put

CHUNK = 2**16
"""Bytes of a chunk, if that is more than one run."""

_CODECS = [{"name": "zstd", "configuration": {"level": 0, "checksum": True}}]
"""Codecs of the chunks of numbers; a store of an earlier version may have others."""


def chunk_of(shape: Sequence[int], nbytes: int) -> Index:
    """Return how many runs a chunk holds along each dimension of the grid, if a run has some bytes."""
    found, room = [], CHUNK // max(nbytes, 1)
    for length in reversed(shape):
        found.append(max(1, min(length, room)))
        room //= length
    return tuple(reversed(found))


class ChunkedArray:
    """An array over a grid of runs; what runs have changed is in memory until it is written."""

    def __init__(self, array: Any, folder: str, swept: int) -> None:
        self._array, self._folder, self._swept = array, folder, swept
        self._text = array.dtype.kind not in "biufc"
        self._plain = not self._text and [each.to_dict() for each in array.compressors] == _CODECS
        self._chunks: dict[Index, np.ndarray] = {}
        """Chunks that were changed since the last time but one that they were written."""
        self._changed: set[Index] = set()

    def fill(self, index: Index, values: np.ndarray) -> None:
        """Set the values of a run."""
        if not self._array.size:
            return
        pairs = [divmod(i, length) for i, length in zip(index, self._array.chunks, strict=False)]
        chunk = tuple(first for first, _ in pairs)
        if chunk not in self._chunks:
            self._chunks[chunk] = self._read(chunk)
        self._chunks[chunk][tuple(second for _, second in pairs)] = values
        self._changed.add(chunk)

    def write(self) -> None:
        """Write the chunks that have changed: zarr takes milliseconds for each, as it hands them between threads."""
        from numcodecs.zstd import Zstd

        for chunk in self._changed:
            values = self._chunks[chunk]
            if self._plain:
                os.makedirs(os.path.dirname(self._file(chunk)), exist_ok=True)
                put(self._file(chunk), Zstd(checksum=True).encode(values.tobytes()))
            else:
                region = self._region(chunk)
                inside = tuple(slice(each.stop - each.start) for each in region)
                self._array[region] = values[inside]
        self._chunks = {chunk: self._chunks[chunk] for chunk in self._changed}
        self._changed.clear()

    def lost(self, indices: Sequence[Index]) -> set[Index]:
        """Return those of the runs whose chunks are not there."""
        if not (self._array.size and indices):
            return set()
        chunks = np.array(indices) // self._array.chunks[: self._swept]
        different, which = np.unique(chunks, axis=0, return_inverse=True)
        there = np.array([os.path.isfile(self._file(chunk)) for chunk in different.tolist()])
        return {indices[i] for i in np.flatnonzero(~there[which.ravel()]).tolist()}

    def _read(self, chunk: Index) -> np.ndarray:
        """Return the content of a chunk, fill values where it has none."""
        values = np.full(self._array.chunks, self._array.fill_value, object if self._text else self._array.dtype)
        if os.path.isfile(self._file(chunk)):
            region = self._region(chunk)
            try:
                values[tuple(slice(each.stop - each.start) for each in region)] = self._array[region]
            except Exception as error:
                words = f"is damaged: remove it, and its runs are done again ({reason_of(error)})"
                raise FileError(f"{self._file(chunk)}: {words}") from None
        return values

    def _region(self, chunk: Index) -> tuple[slice, ...]:
        """Return the part of the array that a chunk covers."""
        lengths, shape = self._array.chunks[: self._swept], self._array.shape
        swept = zip(chunk, lengths, shape, strict=False)
        begun = (slice(i * length, min((i + 1) * length, end)) for i, length, end in swept)
        return (*begun, *(slice(0, end) for end in shape[self._swept :]))

    def _file(self, chunk: Sequence[int]) -> str:
        place = (*chunk, *(0 for _ in self._array.shape[self._swept :]))
        return f"{self._folder}/{self._array.metadata.encode_chunk_key(place)}"
