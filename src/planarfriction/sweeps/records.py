"""Results of runs: simulating and measuring a scene, the files that keep results, and the dataset of them all."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import math
import secrets
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planarfriction._support.writing import make_folder, replacing, write_text
from planarfriction.errors import FileError, FrictionError, InvalidValueError, one_line
from planarfriction.scenes import Scene, Solution
from planarfriction.scenes.signal import SAME_TIME
from planarfriction.scenes.solution import History
from planarfriction.sweeps.settings import ValueGrid

if TYPE_CHECKING:
    import xarray as xr

FAILED = "failed"
"""Status of a run that ended with an error; the others are those of a `Solution`."""

TURN = 0.25
"""Time after which a worker hands back what it has [s]: short to whoever waits, long beside handing over."""


class Record(NamedTuple):
    """Result of a run."""

    status: str
    """Status of the `Solution`, or "failed"."""
    reason: str
    """Reason of a failure in one line, or nothing."""
    variables: dict[str, History]
    """Measured variables by name."""
    end: float | None = None
    """Time at which a run whose result is a `Solution` was to end [s]."""


def run(
    scene: Scene,
    measure: Callable[[Solution], Any] | None,
    bristles: str = "none",
    stopped: Callable[[], bool] | None = None,
) -> Record:
    """Simulate a scene and measure it, in any thread or process; errors become part of the record."""
    from planarfriction.scenes import simulate

    def check(time: float) -> None:
        if stopped is not None and stopped():
            raise Stopped

    where = ""
    try:
        solution = simulate(scene, bristles=bristles, progress=check)
        where = "measure: "
        found = solution if measure is None else measure(solution)
        if isinstance(found, Solution):
            named = variables(found.histories)
            return Record(solution.status, "", named, scene.t_end)
        return Record(solution.status, "", variables(found, measure))
    except Exception as error:
        return Record(FAILED, f"{where}{reason_of(error)}", {})


@dataclass(frozen=True, eq=False)
class Batch:
    """Scenes that a worker is handed together."""

    scenes: list[Scene]
    measure: Callable[[Solution], Any] | None
    bristles: str
    stopped: Callable[[], bool] | None = None
    """Return True if nobody waits for the results any longer."""

    def __dask_tokenize__(self) -> str:
        """Return a name of its own, for which dask would go through all numbers of the scenes."""
        return secrets.token_hex(16)


def run_all(batch: Batch) -> tuple[list[Record], float]:
    """Run scenes until `TURN` is over, at least the first one; returns the records of those that were run, and time."""
    begin = monotonic()
    found = []
    with contextlib.suppress(Stopped):
        for scene in batch.scenes:
            found.append(run(scene, batch.measure, batch.bristles, batch.stopped))
            if monotonic() - begin > TURN:
                break
    return found, monotonic() - begin


class Stopped(BaseException):
    """Exception that ends a run whose result nobody waits for any longer."""


def reason_of(error: BaseException) -> str:
    """Return an error as one line, with its class if it is not one of the library."""
    words = " ".join(str(error).split())
    return one_line(
        words
        if isinstance(error, FrictionError)
        else f"{type(error).__name__}: {words}".removesuffix(": ")
    )


def variables(
    found: Any, measure: Callable[..., Any] | None = None
) -> dict[str, History]:
    """Convert the result of a measurement to named arrays: a number, a mapping of names, or an xarray object."""
    if hasattr(found, "data_vars"):  # a Dataset
        axes = [name for name in found.coords if found[name].dims == (name,)]
        found = {str(name): found[name] for name in (*found.data_vars, *axes)}
    elif not isinstance(found, Mapping):
        name = getattr(measure, "__name__", "")
        name = name if name.isidentifier() else "measured"  # as "<lambda>" is not
        found = {getattr(found, "name", None) or name: found}
    for name in found:
        if not (isinstance(name, str) and name):
            raise InvalidValueError(
                "measure", "use texts as names of what it returns", name
            )
    return {name: _variable(name, value) for name, value in found.items()}


def _variable(name: str, value: Any) -> History:
    if isinstance(value, History):
        return value
    if hasattr(value, "dims") and hasattr(value, "attrs"):  # a DataArray
        values = np.asarray(value.values)
        dims = tuple(map(str, value.dims))
        attrs = {
            str(key): text for key, text in value.attrs.items() if isinstance(text, str)
        }
    else:
        values = np.asarray(value)
        attrs = {}
        dims = tuple(f"{name}_{axis}" for axis in range(values.ndim))
        dims = (f"{name}_index",) if values.ndim == 1 else dims
    if values.dtype.kind not in "biufcU":
        raise InvalidValueError(
            "measure",
            f"return numbers, texts, or arrays of them, which {name!r} is not",
            type(value).__name__,
        )
    return History(dims, values, attrs)


def pack(runs: Mapping[str, Record]) -> bytes:
    """Convert the records of runs, by their keys, to the bytes of an NPZ file; equal records give equal bytes.

    Variables of the same names, axes, types and shapes are stacked into one array each.
    """
    groups: dict[Any, list[tuple[str, Record]]] = {}
    for key, record in sorted(runs.items()):  # runs end in any order
        layout = tuple(map(_layout, record.variables.items()))
        groups.setdefault(layout, []).append((key, record))
    meta = []
    arrays = {}
    for number, group in enumerate(groups.values()):
        first = group[0][1].variables
        outcomes = [[key, each.status, each.reason, each.end] for key, each in group]
        kinds = [[name, each.dims, each.attrs] for name, each in first.items()]
        meta.append([kinds, outcomes])
        for place, name in enumerate(first):
            values = [record.variables[name].values for _, record in group]
            arrays[f"{number}.{place}"] = np.stack(values)
    buffer = io.BytesIO()
    np.savez(buffer, meta=np.frombuffer(json.dumps(meta).encode(), np.uint8), **arrays)
    return buffer.getvalue()


def _layout(item: tuple[str, History]) -> tuple[Any, ...]:
    name, each = item
    values = np.asarray(each.values)
    return name, each.dims, tuple(each.attrs.items()), values.dtype, values.shape


def unpack(content: bytes) -> dict[str, Record]:
    """Convert the bytes of a file to the records of its runs, by their keys."""
    runs = {}
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        meta = json.loads(file["meta"].tobytes())
        for number, (variables, outcomes) in enumerate(meta):
            stacks = [
                (each, file[f"{number}.{place}"])
                for place, each in enumerate(variables)
            ]
            for row, (key, status, reason, end) in enumerate(outcomes):
                found = {
                    name: History(tuple(dims), stack[row, ...], attrs)
                    for (name, dims, attrs), stack in stacks
                }
                runs[key] = Record(status, reason, found, end)
    return runs


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

    def __init__(self, grid: ValueGrid, path: str | Path | None = None) -> None:
        self.grid = grid
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
            elif scene is not None:
                try:
                    table: Any = scene.to_dict()
                except FrictionError as error:  # with a model that is not registered
                    table = str(error)
                content = {"reason": record.reason, "scene": table}
                try:
                    write_text(failed, json.dumps(content, indent=1) + "\n")
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
        first = self.runs[done[0]][1]
        time = None if first.end is None else instants(self._ends)
        first = over(first, time)
        check_names(self.grid, first)
        columns: dict[str, dict[Index, Any]] = {
            name: {} for name, each in first.items() if each.dims != (name,)
        }
        for index in done:
            key, record = self.runs[index]
            found = over(record, time)
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
        """Return an array over the grid from the values of a variable in some runs; the other entries say "missing"."""
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


def over(record: Record, time: np.ndarray | None) -> dict[str, History]:
    """Return the variables of a run; histories over common instants, if given, NaN at those that the run does not have.

    A body that came to rest keeps its last values until its run would have ended.
    """
    if time is None or record.end is None:
        return record.variables
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
            return f"the axis {name} differs from that of the first run: measure values with the same axes in all runs"
    return ""
