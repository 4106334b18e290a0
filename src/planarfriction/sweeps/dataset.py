"""One labelled dataset from the results of all runs, with a dimension for each swept quantity."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.scenes.signal import SAME_TIME
from planarfriction.scenes.solution import History
from planarfriction.sweeps.quantities import Grid
from planarfriction.sweeps.records import FAILED, Record

if TYPE_CHECKING:
    import xarray as xr

MOST_NUMBERS = 2 * 10**9
"""Numbers of one variable in memory: 16 GB."""

MISSING = "missing"
"""Status of a run that has not been done, in what an interrupted sweep returns."""

OWN = {
    "status": "how the run ended",
    "failure": "why the run failed, empty where it did not",
    "run": "digest of scene, measurement and equations",
}
"""Variables of every sweep, and what they are."""


def instants(ends: Iterable[tuple[float, float]]) -> np.ndarray:
    """Times at which any of several runs records [s], of their ends and intervals."""
    from planarfriction.scenes.options import recording_times

    times = np.unique(np.concatenate([recording_times(*each) for each in sorted(set(ends))]))
    return times[np.diff(times, prepend=-np.inf) > SAME_TIME]


def on_instants(record: Record, time: np.ndarray) -> dict[str, History]:
    """Variables of a run over common instants: NaN where it has none.

    A body that came to rest keeps its last values until its run would have ended.
    """
    own = np.asarray(record.variables["time"].values)
    at = np.searchsorted(time, own - SAME_TIME)
    on = (at < len(time)) & (np.abs(time[np.minimum(at, len(time) - 1)] - own) <= SAME_TIME)
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


def check_names(grid: Grid, variables: Mapping[str, History]) -> None:
    """Raise where a swept quantity and something else have the same name."""
    taken = {*OWN, *variables, *(dim for each in variables.values() for dim in each.dims)}
    for name in grid.labels:
        if name in taken:
            raise InvalidValueError("name of a swept quantity", "not be that of a variable or of its axis", name)
    for name in OWN:
        if name in variables:
            raise InvalidValueError("measure", f"not return anything called {', '.join(OWN)}", name)


class Collected:
    """Records of a sweep as they come in, in any order."""

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self._records: dict[tuple[int, ...], Record] = {}
        self._runs: dict[tuple[int, ...], str] = {}

    def put(self, index: tuple[int, ...], digest: str, record: Record) -> None:
        """Keep what the run at a place of the grid has left."""
        self._runs[index] = digest
        self._records[index] = record

    def dataset(self, ends: Iterable[tuple[float, float]], timed: bool) -> xr.Dataset:
        """Everything as one dataset; with `timed`, `time` is an axis that runs may have gone along differently far."""
        import xarray as xr

        done = {index: each for index, each in self._records.items() if each.variables}
        variables: dict[str, Any] = {}
        if done:
            first = done[min(done)]
            if timed:
                time = instants(ends)
                first = first._replace(variables=on_instants(first, time))
            check_names(self.grid, first.variables)
            axes = [name for name, each in first.variables.items() if each.dims == (name,)]
            arrays = {name: self._empty(each, done) for name, each in first.variables.items() if name not in axes}
            for index in sorted(done):
                found = on_instants(done[index], time) if timed else done[index].variables
                self._place(index, found, first.variables, arrays)
            variables = {
                name: History((*self.grid.labels, *each.dims), arrays[name], each.attrs)
                for name, each in first.variables.items()
                if name in arrays
            }
            variables |= {name: first.variables[name] for name in axes}
        variables |= self._own()
        variables |= {name: ((name,), np.array(labels)) for name, labels in self.grid.labels.items()}
        coordinates = [name for name, each in variables.items() if each[0] == (name,)]
        return xr.Dataset(variables).set_coords(coordinates)

    def _empty(self, example: History, done: Mapping[tuple[int, ...], Record]) -> np.ndarray:
        values = np.asarray(example.values)
        shape = (*self.grid.shape, *values.shape)
        if self.grid.size * values.size > MOST_NUMBERS:
            rule = f"need at most {MOST_NUMBERS} numbers in memory (use a .zarr store as out, or measure less)"
            raise InvalidValueError("values", rule, f"{self.grid.size} runs of {values.size}")
        if values.dtype.kind == "U":
            return np.full(shape, "", dtype=object)
        complete = len(done) == self.grid.size
        kind = values.dtype if complete or values.dtype.kind in "fc" else np.dtype(float)
        return np.full(shape, np.nan if kind.kind in "fc" else 0, kind)

    def _place(
        self,
        index: tuple[int, ...],
        found: Mapping[str, History],
        first: Mapping[str, History],
        arrays: dict[str, np.ndarray],
    ) -> None:
        differing = difference(found, first)
        if differing:
            self._records[index] = Record(FAILED, differing, {})
            return
        for name, array in list(arrays.items()):
            values = np.asarray(found[name].values)
            if array.dtype.kind != "O" and not np.can_cast(values.dtype, array.dtype, "same_kind"):
                arrays[name] = array = array.astype(np.result_type(array, values))
            array[index] = values
        self._records[index] = self._records[index]._replace(variables={})  # they are in the arrays now

    def _own(self) -> dict[str, Any]:
        shape = self.grid.shape
        status, failure, run = (np.full(shape, text, dtype=object) for text in (MISSING, "", ""))
        for index, record in self._records.items():
            status[index], failure[index], run[index] = record.status, record.reason, self._runs[index]
        own = {"status": status, "failure": failure, "run": run}
        return {
            name: History(tuple(self.grid.labels), values.astype(str), {"long_name": OWN[name]})
            for name, values in own.items()
        }


def difference(found: Mapping[str, History], first: Mapping[str, History]) -> str:
    """Why the variables of a run do not fit those of the first one; empty where they do."""
    if found.keys() != first.keys():
        return f"measured {', '.join(found) or 'nothing'} where the first run has {', '.join(first)}"
    for name, each in found.items():
        mine, other = np.asarray(each.values), np.asarray(first[name].values)
        if mine.shape != other.shape:
            return f"{name} has shape {list(mine.shape)} where the first run has {list(other.shape)}"
        if (mine.dtype.kind == "U") != (other.dtype.kind == "U"):
            return f"{name} is {mine.dtype} where the first run has {other.dtype}"
        if each.dims == (name,) and not np.array_equal(mine, other):
            return f"the axis {name} differs from that of the first run: measure what has the same axes in all runs"
    return ""
