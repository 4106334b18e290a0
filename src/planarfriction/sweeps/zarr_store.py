"""A sweep in a zarr store, one chunk per run: for more runs than fit into memory, and for readers on other machines."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.errors import FileError, MissingExtraError
from planarfriction.scenes.solution import History
from planarfriction.sweeps.dataset import MISSING, OWN, check_names, difference, on_instants
from planarfriction.sweeps.quantities import Grid
from planarfriction.sweeps.records import FAILED, Record, failure, reason_of
from planarfriction.writing import make_folder, put

if TYPE_CHECKING:
    import xarray as xr

    from planarfriction.scenes import Scene

_JOURNAL = "runs.jsonl"
"""What says which runs are in the store: a line for each, written after its chunks. It lies in the folder of the array
`run`, where readers of zarr do not look."""


class ZarrStore:
    """Runs as regions of the arrays of a store; finds again what the journal says is whole.

    The first run that is done decides which arrays there are.
    """

    def __init__(self, path: Path, grid: Grid, time: np.ndarray | None) -> None:
        try:
            import zarr
        except ImportError:
            raise MissingExtraError("zarr", "sweep") from None
        self.path, self.grid, self.damaged = path, grid, 0
        self._time = time
        make_folder(path.parent)
        self._layout: dict[str, History] | None = None
        self._arrays: dict[str, Any] = {}
        self._outcomes: dict[int, tuple[str, str, str]] = {}
        """Place of a run in the grid -> its digest, its status, why it failed."""
        try:
            self._group: Any = zarr.open_group(path, mode="a", zarr_format=3)
            self._begin()
        except FileError:
            raise
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise FileError(f"{path}: no zarr store of a sweep, and none can be made: {reason_of(error)}") from None
        self._journal = (path / "run" / _JOURNAL).open("a+b", buffering=0)
        if self._journal.tell() and not self._ends_a_line():
            self._journal.write(b"\n")

    def close(self) -> None:
        """Let go of the journal."""
        self._journal.close()

    # ------------------------------------------------------------------ arrays

    def _begin(self) -> None:
        """Make the axes of what is swept, or see that the store has them, and read the journal."""
        names = sorted(self._group)
        if not names:
            for name, labels in self.grid.labels.items():
                self._write(name, (name,), np.array(labels), {})
            for name, words in OWN.items():
                self._write(name, tuple(self.grid.labels), np.full(self.grid.shape, ""), {"long_name": words})
            return
        for name, labels in self.grid.labels.items():
            there = self._group[name][...].tolist() if name in names else None
            if there != labels:
                raise FileError(f"{self.path}: holds another sweep ({name} differs): name another path")
        if self._group["run"].shape != self.grid.shape:
            raise FileError(f"{self.path}: holds a sweep over other quantities: name another path")
        self._read_journal()
        variables = {name: self._group[name] for name in names if name not in (*self.grid.labels, *OWN)}
        if variables:
            self._arrays = variables
            swept = len(self.grid.shape)
            self._layout = {}
            for name, array in variables.items():
                dims = tuple(array.metadata.dimension_names)
                own = dims if dims == (name,) else dims[swept:]
                values = array[...] if dims == (name,) else np.empty(array.shape[swept:], array.dtype)
                self._layout[name] = History(own, values, {})
            time = self._layout.get("time")
            if self._time is not None and time is not None and not np.array_equal(time.values, self._time):
                raise FileError(f"{self.path}: holds a sweep with other instants: name another path")

    def _write(self, name: str, dims: tuple[str, ...], values: np.ndarray, attrs: Mapping[str, str]) -> None:
        """Make an array in one chunk, or fill the one that is there."""
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
        """Make the arrays for all runs, empty, from what the first one has left."""
        from zarr.codecs import Crc32cCodec, ZstdCodec

        check_names(self.grid, variables)
        ones = (1,) * len(self.grid.shape)
        for name, each in variables.items():
            values = np.asarray(each.values)
            if each.dims == (name,):
                self._write(name, each.dims, values, each.attrs)
                continue
            text = values.dtype.kind == "U"
            self._arrays[name] = self._group.create_array(
                name,
                shape=(*self.grid.shape, *values.shape),
                dtype="string" if text else np.result_type(values.dtype, float),
                chunks=(*ones, *(max(length, 1) for length in values.shape)),
                fill_value="" if text else np.nan,
                compressors=(ZstdCodec(), Crc32cCodec()),
                dimension_names=(*self.grid.labels, *each.dims),
                attributes=dict(each.attrs),
            )
        self._layout = dict(variables)

    # ------------------------------------------------------------------ runs

    def find(self, digest: str, index: tuple[int, ...]) -> Record | None:
        """That the run is there, without its variables; None where it is not."""
        there = self._outcomes.get(self._number(index))
        if there is None or there[0] != digest or there[1] == FAILED:
            return None
        return Record(there[1], "", {})

    def put(self, digest: str, index: tuple[int, ...], record: Record, scene: Scene | None) -> Record:
        """Write the chunks of a run, then the line that makes them count; returns what it is now."""
        if record.status != FAILED:
            found = record.variables if self._time is None else on_instants(record, self._time)
            if self._layout is None:
                self._make(found)
            reason = difference(found, self._layout or found)
            if reason:
                record = Record(FAILED, reason, {})
            else:
                for name, each in found.items():
                    if each.dims != (name,):
                        values = np.asarray(each.values)
                        self._arrays[name][index] = values.astype(object) if values.dtype.kind == "U" else values
        if record.status == FAILED:
            folder = make_folder(self.path.with_suffix(".failed"))
            put(str(folder / f"{digest}.json"), failure(record.reason, scene).encode())
        number = self._number(index)
        line = json.dumps([number, digest, record.status, record.reason])
        self._journal.write(f"{line}\n".encode())
        return record

    def note(self, index: tuple[int, ...], digest: str, record: Record) -> None:
        """Remember how a run ended."""
        self._outcomes[self._number(index)] = digest, record.status, record.reason

    def _number(self, index: tuple[int, ...]) -> int:
        return int(np.ravel_multi_index(index, self.grid.shape))

    def _read_journal(self) -> None:
        """The last word on each run; a line that a kill has cut counts as no line."""
        try:
            lines = (self.path / "run" / _JOURNAL).read_bytes().split(b"\n")
        except FileNotFoundError:
            return
        for line in lines:
            try:
                number, digest, status, reason = json.loads(line)
                if line:
                    self._outcomes[int(number)] = str(digest), str(status), str(reason)
            except (ValueError, TypeError):
                continue

    def _ends_a_line(self) -> bool:
        """Whether the journal ends as it should: a kill may have cut its last line."""
        self._journal.seek(-1, os.SEEK_END)
        return self._journal.read() == b"\n"

    # ------------------------------------------------------------------ the whole

    def dataset(self) -> xr.Dataset:
        """Write how each run ended, and open everything: variables are read when they are looked at."""
        import xarray as xr

        own = {name: np.full(self.grid.size, text, dtype=object) for name, text in (("run", ""), ("status", MISSING))}
        own["failure"] = np.full(self.grid.size, "", dtype=object)
        for number, outcome in self._outcomes.items():
            for name, text in zip(("run", "status", "failure"), outcome, strict=True):
                own[name][number] = text
        for name, values in own.items():
            self._write(name, tuple(self.grid.labels), values.reshape(self.grid.shape).astype(str), {})
        return xr.open_zarr(self.path, chunks=None, consolidated=False)
