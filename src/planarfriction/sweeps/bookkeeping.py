"""Bookkeeping of a sweep: the outcome of each run, the files that keep its results, and the dataset of them all."""

from __future__ import annotations

import contextlib
import hashlib
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction._support.writing import make_folder, replacing, write_text
from planarfriction.errors import FileError, InvalidValueError
from planarfriction.scenes import Scene
from planarfriction.scenes.signal import SAME_TIME
from planarfriction.scenes.solution import History
from planarfriction.sweeps.records import FAILED, Record, failure, pack, unpack
from planarfriction.sweeps.settings import ValueGrid

if TYPE_CHECKING:
    import xarray as xr

MOST_NUMBERS = 2 * 10**9
"""Largest number of numbers of one variable in memory: 16 GB."""

MISSING = "missing"
"""Status of a run that has not been done, in the dataset of an interrupted sweep."""

OWN = {
    "status": "how the run ended",
    "failure": "why the run failed, empty where it did not",
    "run": "digest of scene, measurement and library",
}
"""Variables of every sweep, with their descriptions."""

BETWEEN = 0.5
"""Least time between two files of runs [s]."""

SHARE = 0.02
"""Time between two files of runs as a share of the time since the sweep began."""

Index = tuple[int, ...]
"""Place of a run in the grid."""


class Bookkeeper:
    """Outcomes and results of the runs of a sweep, in memory and, if there is one, in a folder.

    The folder holds files of many runs that are done, and one of scene and reason for each that failed. A file is named
    by the digest of its content, so that any number of sweeps write to one folder, and damage is seen.
    """

    def __init__(
        self, grid: ValueGrid, timed: bool, path: str | Path | None = None
    ) -> None:
        self.grid = grid
        self.timed = timed
        self.runs: dict[Index, tuple[str, Record]] = {}
        """Keys and records of the runs that have been done."""
        self.found = self.new = self.failed = self.damaged = 0
        self._ends: set[tuple[float, float]] = set()
        self._folder = None if path is None else make_folder(path)
        self._begin = self._written = monotonic()
        self._kept: dict[str, Record] = {}
        """Records of earlier sweeps by their keys."""
        self._open: dict[str, Record] = {}
        """Records that are in no file yet."""
        for file in sorted(self._folder.glob("runs-*.npz")) if self._folder else ():
            with contextlib.suppress(OSError):
                content = file.read_bytes()
                if file.name == _name(content):
                    self._kept |= unpack(content)
                    continue
                file.unlink()
            self.damaged += 1

    def look_up(self, index: Index, key: str, scene: Scene) -> bool:
        """Return True if the run with this key was done before, and take it over."""
        self._ends.add((scene.t_end, scene.save_every))
        record = self._kept.get(key)
        if record is not None:
            self.found += 1
            self.runs[index] = key, record
        return record is not None

    def add(self, index: Index, key: str, record: Record, scene: Scene | None) -> None:
        """Keep the record of a run that has just ended for the next file, or write the file of a failure."""
        if self._folder is not None:
            failed = self._folder / f"{key}.failed.json"
            if record.status != FAILED:
                self._open[key] = record
                with contextlib.suppress(OSError):
                    failed.unlink()
            elif key:  # there is a scene
                try:
                    write_text(failed, failure(record.reason, scene))
                except FileError:
                    if not failed.is_dir():
                        raise
        self.new += 1
        if record.status == FAILED:
            self.failed += 1
        self.runs[index] = key, record

    def first_failure(self) -> str:
        """Return the values and the reason of the first run of the grid that failed, in whatever order they ended."""
        index = min(
            index for index, (_, record) in self.runs.items() if record.status == FAILED
        )
        return f"{self.grid.words(index)}: {self.runs[index][1].reason}"

    def flush(self, at_once: bool = False) -> None:
        """Write the open records as one file, whole or not at all, so seldom that a long sweep has few files."""
        now = monotonic()
        due = at_once or now - self._written > BETWEEN + SHARE * (now - self._begin)
        if self._folder is not None and self._open and due:
            content = pack(self._open)
            with replacing(self._folder / _name(content)) as file:
                file.write(content)
            self._open.clear()
            self._written = now

    def dataset(self) -> xr.Dataset:
        """Return the whole as one dataset; if the axis is the time, runs may have gone along it differently far."""
        import xarray as xr

        variables = self._results()
        labels = self.grid.labels
        texts = np.full((*self.grid.shape, 3), ["", MISSING, ""], dtype=object)
        for index, (key, record) in self.runs.items():
            texts[index] = key, record.status, record.reason
        for i, name in enumerate(("run", "status", "failure")):
            words = {"long_name": OWN[name]}
            variables[name] = History(tuple(labels), texts[..., i].astype(str), words)
        variables |= {name: ((name,), np.array(each)) for name, each in labels.items()}
        coordinates = [name for name, each in variables.items() if each[0] == (name,)]
        return xr.Dataset(variables).set_coords(coordinates)

    # ------------------------------------------------------------------ arrays

    def _results(self) -> dict[str, Any]:
        """Return the variables of all runs over the grid; a run that differs from the first one has failed."""
        done = sorted(index for index, (_, each) in self.runs.items() if each.variables)
        if not done:
            return {}
        time = instants(self._ends) if self.timed else None
        first = _over(self.runs[done[0]][1], time)
        check_names(self.grid, first)
        columns: dict[str, dict[Index, Any]] = {
            name: {} for name, each in first.items() if each.dims != (name,)
        }
        for index in done:
            key, record = self.runs[index]
            found = _over(record, time)
            if differing := difference(found, first):
                record = record._replace(status=FAILED, reason=differing)
            else:
                record = record._replace(variables={})  # the columns have them now
                for name, column in columns.items():
                    column[index] = found[name].values
            self.runs[index] = key, record
        variables: dict[str, Any] = {}
        for name, column in columns.items():
            dims = (*self.grid.labels, *first[name].dims)
            variables[name] = History(dims, self._whole(column), first[name].attrs)
        return {name: variables.get(name, each) for name, each in first.items()}

    def _whole(self, column: Mapping[Index, Any]) -> np.ndarray:
        """Return an array over the grid from the values of a variable in some runs; the others say that they are missing."""
        shape = np.shape(next(iter(column.values())))
        count = math.prod(shape)
        if self.grid.size * count > MOST_NUMBERS:
            raise InvalidValueError(
                "values",
                f"need at most {MOST_NUMBERS} numbers in memory (measure less)",
                f"{self.grid.size} runs of {count}",
            )
        kind = np.result_type(*(np.asarray(each) for each in column.values()))
        missing: Any = np.nan
        if kind.kind == "U":
            kind = np.dtype(object)
            missing = ""
        elif kind.kind not in "fc" and len(column) < self.grid.size:
            kind = np.dtype(float)
        elif kind.kind not in "fc":
            missing = 0
        full = np.full((*self.grid.shape, *shape), missing, kind)
        for index, values in column.items():
            full[index] = values
        return full


def _name(content: bytes) -> str:
    """Return the name of a file of runs."""
    return f"runs-{hashlib.sha256(content).hexdigest()[:32]}.npz"


# ---------------------------------------------------------------------- variables of a run in those of all


def instants(ends: Iterable[tuple[float, float]]) -> np.ndarray:
    """Return the times at which any of several runs records [s], from their ends and intervals."""
    from planarfriction.scenes.scene import recording_times

    times = np.unique(
        np.concatenate([recording_times(*each) for each in sorted(set(ends))])
    )
    return times[np.diff(times, prepend=-np.inf) > SAME_TIME]


def _over(record: Record, time: np.ndarray | None) -> dict[str, History]:
    """Return the variables of a run, over common instants if they are histories."""
    return record.variables if time is None else on_instants(record, time)


def on_instants(record: Record, time: np.ndarray) -> dict[str, History]:
    """Return the variables of a run over common instants, NaN at those that it does not have.

    A body that came to rest keeps its last values until its run would have ended.
    """
    own = np.asarray(record.variables["time"].values)
    at = np.searchsorted(time, own - SAME_TIME)
    on = (at < len(time)) & (
        np.abs(time[np.minimum(at, len(time) - 1)] - own) <= SAME_TIME
    )
    result = {}
    for name, each in record.variables.items():
        if name == "time" or "time" not in each.dims:
            result[name] = each
            continue
        values = np.asarray(each.values, dtype=float)
        full = np.full((len(time), *values.shape[1:]), np.nan)
        full[at[on]] = values[on]
        if record.status == "at rest":
            full[(time > own[-1]) & (time <= record.end + SAME_TIME)] = values[-1]
        result[name] = each._replace(values=full)
    result["time"] = record.variables["time"]._replace(values=time)
    return result


def check_names(grid: ValueGrid, variables: Mapping[str, History]) -> None:
    """Check that no swept quantity has the name of something else."""
    taken = {*variables, *(dim for each in variables.values() for dim in each.dims)}
    for name in grid.labels:
        if name in taken:
            raise InvalidValueError(
                "name of a swept quantity",
                "not be that of a variable or of its axis",
                name,
            )
    for name in OWN:
        if name in variables:
            raise InvalidValueError(
                "measure", f"not return anything called {', '.join(OWN)}", name
            )


def difference(found: Mapping[str, History], first: Mapping[str, History]) -> str:
    """Return the reason why the variables of a run do not fit those of the first one, or nothing."""
    if found.keys() != first.keys():
        return f"measured {', '.join(found) or 'nothing'} where the first run has {', '.join(first)}"
    for name, each in found.items():
        mine = np.asarray(each.values)
        other = np.asarray(first[name].values)
        if mine.shape != other.shape:
            return f"{name} has shape {list(mine.shape)} where the first run has {list(other.shape)}"
        if (mine.dtype.kind == "U") != (other.dtype.kind == "U"):
            return f"{name} is {mine.dtype} where the first run has {other.dtype}"
        if each.dims == (name,) and not np.array_equal(mine, other):
            return f"the axis {name} differs from that of the first run: measure what has the same axes in all runs"
    return ""
