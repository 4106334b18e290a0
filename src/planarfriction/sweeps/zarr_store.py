"""A sweep in a zarr store: for more runs than fit into memory, and for readers on other machines."""

from __future__ import annotations

import importlib
import io
import json
import os
import weakref
from collections.abc import Mapping
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.errors import FileError, MissingExtraError
from planarfriction.scenes.solution import History
from planarfriction.sweeps.bookkeeping import MISSING, OWN, Bookkeeper, Index, check_names, difference, on_instants
from planarfriction.sweeps.quantities import Grid
from planarfriction.sweeps.records import FAILED, Record, failure, reason_of
from planarfriction.sweeps.zarr_chunks import ChunkedArray, chunk_of
from planarfriction.writing import make_folder, making_folder, put, reporting, write_all

if TYPE_CHECKING:
    import xarray as xr

    from planarfriction.scenes import Scene

_JOURNAL = "runs.jsonl"
"""File with a line for each run that is in the store, written after its chunks. It lies in the folder of the array
`run`, which readers of zarr do not list."""

_ARRAYS = "arrays"
"""Attribute of the store with the names of the arrays that runs have filled: one that is not there has been lost."""

_ALL_CHUNKS = {"array.write_empty_chunks": True}
"""Setting of zarr under which a chunk that is not there has been lost: by default one without values is not written."""

_BETWEEN = 0.5
"""Time between two times that results are written [s]."""

_LOCKED_BYTE = 2**30
"""Place in the journal that is locked where only parts of a file can be."""

_LOCKED: weakref.WeakSet[io.FileIO] = weakref.WeakSet()
"""Locked journals of this process. A process forked from it closes them: it may live longer, and keep the lock."""

if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: [each.close() for each in _LOCKED])


def _lock(journal: io.FileIO, path: Path) -> None:
    """Lock the journal of the store `path` until it is closed or the process ends, where the system has such locks.

    Raises FileError if another sweep has locked it.
    """
    try:
        import fcntl
    except ImportError:  # on Windows
        fcntl, msvcrt = None, importlib.import_module("msvcrt")
    try:
        if fcntl is not None:
            fcntl.flock(journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:  # a byte far behind the end, as nobody can read what is locked
            journal.seek(_LOCKED_BYTE)
            msvcrt.locking(journal.fileno(), msvcrt.LK_NBLCK, 1)
            journal.seek(0, io.SEEK_END)
    except (BlockingIOError, PermissionError):
        raise FileError(f"{path}: another sweep is writing to it: wait for its end, or name another path") from None
    except OSError:  # a file system without locks
        return
    _LOCKED.add(journal)


class ZarrBookkeeper(Bookkeeper):
    """Bookkeeper whose results are regions of the arrays of a store; runs count that its journal lists.

    The first run that is done decides which arrays there are.
    """

    def __init__(self, grid: Grid, time: np.ndarray | None, path: Path) -> None:
        super().__init__(grid, time is not None)
        try:
            import zarr
        except ImportError:
            raise MissingExtraError("zarr", "sweep") from None
        self.path, self._time = path, time
        make_folder(path.parent)
        self._layout: dict[str, History] | None = None
        self._arrays: dict[str, ChunkedArray] = {}
        self._listed: dict[Index, tuple[str, Record]] = {}
        """Keys and records, without variables, in the journal."""
        self._lines: list[bytes] = []
        """Lines of the journal of runs whose results are in memory."""
        self._written = monotonic()
        self._journal: Any = None
        if not path.exists() or (path.is_dir() and not any(path.iterdir())):
            self._create()
        try:
            self._group: Any = zarr.open_group(path, mode="r+", zarr_format=3)
            self._journal = (path / "run" / _JOURNAL).open("a+b", buffering=0)
            _lock(self._journal, path)
            if self._journal.tell():  # a kill may have cut the last line
                write_all(self._journal, b"\n")
            with zarr.config.set(_ALL_CHUNKS):
                self._begin()
        except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:  # the last from decompression
            self.close()
            if isinstance(error, FileError):
                raise
            raise FileError(f"{path}: no zarr store of a sweep, and none can be made: {reason_of(error)}") from None

    def close(self) -> None:
        """Close the journal, and so let other sweeps write."""
        if self._journal is not None:
            self._journal.close()

    # ------------------------------------------------------------------ arrays

    def _create(self) -> None:
        """Make a store with the axes of the swept quantities, whole or not at all."""
        import zarr

        with making_folder(self.path) as part:
            self._group = zarr.open_group(part, mode="w", zarr_format=3)
            for name, labels in self.grid.labels.items():
                self._write(name, (name,), np.array(labels), {})
            for name, words in OWN.items():
                self._write(name, tuple(self.grid.labels), np.full(self.grid.shape, ""), {"long_name": words})

    def _begin(self) -> None:
        """Check that the store has the axes of the swept quantities, read the journal, and find the arrays.

        Arrays in which no run counts are removed: a sweep may have been killed before it had made them all.
        """
        names = sorted(self._group)
        for name, labels in self.grid.labels.items():
            there = self._group[name][...].tolist() if name in names else None
            if there != labels:
                raise FileError(f"{self.path}: holds another sweep ({name} differs): name another path")
        if self._group["run"].shape != self.grid.shape:
            raise FileError(f"{self.path}: holds a sweep over other quantities: name another path")
        self._read_journal()
        swept = len(self.grid.shape)
        begun = any(record.status != FAILED for _, record in self._listed.values())
        lost = sorted({*self._group.attrs.get(_ARRAYS, ())} - {*names}) if begun else []
        if lost:
            raise FileError(f"{self.path}: has lost {', '.join(lost)}: name another path")
        for name in names:
            if name in (*self.grid.labels, *OWN):
                continue
            if not begun:
                del self._group[name]
                continue
            array = self._group[name]
            dims = tuple(array.metadata.dimension_names)
            axis = dims == (name,)
            if not axis:
                self._arrays[name] = self._chunked(name, array)
            values = array[...] if axis else np.empty(array.shape[swept:], array.dtype)
            if self._time is not None and name == "time" and axis and not np.array_equal(values, self._time):
                raise FileError(f"{self.path}: holds a sweep with other instants: name another path")
            self._layout = {**(self._layout or {}), name: History(dims if axis else dims[swept:], values, {})}
        self._forget_lost()

    def _forget_lost(self) -> None:
        """Take runs off the journal of which a chunk is not there."""
        done = [index for index, (_, record) in self._listed.items() if record.status != FAILED]
        lost = set().union(*(array.lost(done) for array in self._arrays.values()))
        self.damaged += len(lost)
        for index in lost:
            del self._listed[index]
        write_all(self._journal, b"".join(_line(index, "", Record(MISSING, "", {})) for index in sorted(lost)))

    def _chunked(self, name: str, array: Any) -> ChunkedArray:
        return ChunkedArray(array, f"{self.path}/{name}", len(self.grid.shape))

    def _write(self, name: str, dims: tuple[str, ...], values: np.ndarray, attrs: Mapping[str, str]) -> None:
        """Make an array in one chunk, or fill an existing one."""
        text = values.dtype.kind == "U"
        array = self._group.get(name)
        if array is None:
            array = self._group.create_array(
                name,
                shape=values.shape,
                dtype="string" if text else values.dtype,
                chunks=tuple(max(length, 1) for length in values.shape),
                dimension_names=dims,
                attributes=dict(attrs),
            )
        array[...] = values.astype(object) if text else values

    def _make(self, variables: Mapping[str, History]) -> None:
        """Make the empty arrays of all runs from the variables of the first one."""
        from zarr.codecs import ZstdCodec

        for name, each in variables.items():
            values = np.asarray(each.values)
            if each.dims == (name,):
                self._write(name, each.dims, values, each.attrs)
                continue
            text = values.dtype.kind == "U"
            array = self._group.create_array(
                name,
                shape=(*self.grid.shape, *values.shape),
                dtype="string" if text else np.result_type(values.dtype, float),
                chunks=(*chunk_of(self.grid.shape, values.nbytes), *(max(length, 1) for length in values.shape)),
                fill_value="" if text else np.nan,
                compressors=(ZstdCodec(checksum=True),),
                dimension_names=(*self.grid.labels, *each.dims),
                attributes=dict(each.attrs),
                config={"write_empty_chunks": True},
            )
            self._arrays[name] = self._chunked(name, array)
        self._group.attrs[_ARRAYS] = list(variables)
        self._layout = dict(variables)

    # ------------------------------------------------------------------ runs

    def _find(self, index: Index, key: str) -> Record | None:
        """Return the record of a run that is in the store, without its variables, or None."""
        run, record = self._listed.get(index, ("", None))
        if run != key or record is None or record.status == FAILED:
            return None
        return record

    def _store(self, index: Index, key: str, record: Record, scene: Scene | None) -> Record:
        """Keep the results of a run for the next time that results are written; returns the record as it counts."""
        if not key:  # no scene was made
            return record
        if record.status != FAILED:
            found = record.variables if self._time is None else on_instants(record, self._time)
            if self._layout is None:
                check_names(self.grid, found)
                with reporting(self.path):
                    self._make(found)
            reason = difference(found, self._layout or found)
            if reason:
                record = Record(FAILED, reason, {})
            else:
                for name, array in self._arrays.items():
                    array.fill(index, np.asarray(found[name].values))
        if record.status == FAILED:
            folder = make_folder(self.path.with_suffix(".failed"))
            put(str(folder / f"{key}.json"), failure(record.reason, scene).encode())
        self._lines.append(_line(index, key, record))
        return record._replace(variables={})

    def flush(self, at_once: bool = False) -> None:
        """Write the results in memory from time to time, then the lines that make them count."""
        if not self._lines or (monotonic() - self._written < _BETWEEN and not at_once):
            return
        with reporting(self.path):
            for array in self._arrays.values():
                array.write()
            write_all(self._journal, b"".join(self._lines))
        self._lines.clear()
        self._written = monotonic()

    def _read_journal(self) -> None:
        """Read the last outcome of each run; a line that a kill has cut counts as no line."""
        try:
            lines = (self.path / "run" / _JOURNAL).read_bytes().split(b"\n")
        except FileNotFoundError:
            return
        for line in lines:
            try:
                index, key, *outcome = json.loads(line)
                np.ravel_multi_index(index, self.grid.shape)  # raises for what is no place in the grid
                self._listed[tuple(index)] = key, Record(*outcome, variables={})
                if outcome[0] == MISSING:
                    del self._listed[tuple(index)]
            except (ValueError, TypeError):
                continue

    def dataset(self) -> xr.Dataset:
        """Write the outcomes of all runs, and open the store: variables are read on demand."""
        import xarray as xr

        self.runs = {**self._listed, **self.runs}  # an interrupted sweep does not reach all of the journal
        with reporting(self.path):
            for name, values in self._outcome_arrays().items():
                self._write(name, tuple(self.grid.labels), values, {})
        return xr.open_zarr(self.path, chunks=None, consolidated=False)


def _line(index: Index, key: str, record: Record) -> bytes:
    """Return the line of a run in the journal."""
    return f"{json.dumps([index, key, record.status, record.reason])}\n".encode()
