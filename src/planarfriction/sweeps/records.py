"""Results of runs, and the folder in which they are stored: one file per run, named by the run's digest."""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planarfriction.errors import FrictionError, InvalidValueError, one_line
from planarfriction.scenes.solution import History, Solution
from planarfriction.writing import make_folder, put

if TYPE_CHECKING:
    from planarfriction.scenes import Scene

FAILED = "failed"
"""Status of a run that ended with an error; the others are those of a `Solution`."""

_META = "planarfriction"
"""Entry of a file that describes the others: never the name of a variable."""


class Record(NamedTuple):
    """The result of a run."""

    status: str
    """As that of a `Solution`, or "failed"."""
    reason: str
    """Why it failed, in one line; empty where it did not."""
    variables: dict[str, History]
    """What was measured, by name."""
    end: float = 0.0
    """When it was to end [s]."""


def run(scene: Scene, measure: Callable[[Solution], Any] | None, stopped: Callable[[], bool] | None = None) -> Record:
    """Simulate a scene and measure it, in any thread or process; what goes wrong is part of the record."""
    from planarfriction.scenes import simulate

    def look(time: float) -> None:
        if stopped is not None and stopped():
            raise Stopped

    where = ""
    try:
        solution = simulate(scene, progress=look)
        where = "measure: "
        found = solution.histories if measure is None else measure(solution)
        return Record(solution.status, "", variables(found, measure), scene.t_end)
    except Exception as error:
        return Record(FAILED, f"{where}{reason_of(error)}", {}, scene.t_end)


class Stopped(BaseException):
    """Ends a run whose result nobody waits for any longer."""


def reason_of(error: BaseException) -> str:
    """An error as one line; the kind too, where it is not one of the library."""
    words = " ".join(str(error).split())
    return one_line(
        words if isinstance(error, FrictionError) else f"{type(error).__name__}: {words}".removesuffix(": ")
    )


def variables(found: Any, measure: Callable[..., Any] | None = None) -> dict[str, History]:
    """What a measurement returned as named arrays: a number, a mapping of names, or an xarray object."""
    if hasattr(found, "data_vars"):  # a Dataset
        axes = {str(name): found[name] for name in found.coords if found[name].dims == (name,)}
        found = {**{str(name): found[name] for name in found.data_vars}, **axes}
    elif not isinstance(found, Mapping):
        found = {getattr(found, "name", None) or _name_of(measure): found}
    return {_checked_name(name): _variable(name, value) for name, value in found.items()}


def _name_of(measure: Any) -> str:
    name = getattr(measure, "__name__", "")
    return name if name.isidentifier() else "measured"  # as "<lambda>" is not


def _checked_name(name: Any) -> str:
    if not (isinstance(name, str) and name and name != _META):
        raise InvalidValueError("measure", "use texts as names of what it returns", name)
    return name


def _variable(name: str, value: Any) -> History:
    if isinstance(value, History):
        return value
    if hasattr(value, "dims") and hasattr(value, "attrs"):  # a DataArray
        values, dims = np.asarray(value.values), tuple(map(str, value.dims))
        attrs = {str(key): text for key, text in value.attrs.items() if isinstance(text, str)}
    else:
        values, attrs = np.asarray(value), {}
        dims = tuple(f"{name}_{axis}" if values.ndim > 1 else f"{name}_index" for axis in range(values.ndim))
    if values.dtype.kind not in "biufcU":
        rule = f"return numbers, texts, or arrays of them, which {name!r} is not"
        raise InvalidValueError("measure", rule, type(value).__name__)
    return History(dims, values, attrs)


def pack(record: Record) -> bytes:
    """A record as the bytes of an NPZ file, which has a checksum of each entry; equal records give equal bytes.

    Single numbers and texts are in the entry that describes the others, as JSON.
    """
    about, arrays = {}, {}
    for name, each in record.variables.items():
        values = np.asarray(each.values)
        single = values.ndim == 0 and values.dtype.kind in "biufU"
        about[name] = [each.dims, each.attrs, values.dtype.str, values.item() if single else None]
        if not single:
            arrays[_entry(name)] = values
    meta = json.dumps({"status": record.status, "reason": record.reason, "end": record.end, "variables": about})
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:  # np.savez has names of its own that no variable may have
        for name, array in {_META: np.frombuffer(meta.encode(), np.uint8), **arrays}.items():
            with file.open(f"{name}.npy", "w") as entry:
                np.lib.format.write_array(entry, array, allow_pickle=False)
    return buffer.getvalue()


def unpack(content: bytes) -> Record:
    """The record of a file; any exception for one that is damaged."""
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        meta, found = json.loads(file[_META].tobytes()), {}
        for name, (dims, attrs, kind, value) in meta["variables"].items():
            values = file[_entry(name)] if value is None else np.array(value, np.dtype(kind))
            found[name] = History(tuple(dims), values, attrs)
    return Record(meta["status"], meta["reason"], found, meta["end"])


def _entry(name: str) -> str:
    """Name of a variable in a file: letters of any alphabet are there, what paths are made of is not."""
    return re.sub(r"[^\w.+-]", lambda match: f"%{ord(match[0]):X}", name)


class Folder:
    """A folder with a file for each run that is done; one of scene and reason for each that failed."""

    def __init__(self, path: str | Path) -> None:
        self.path = make_folder(path)
        self._begin = f"{self.path}{os.sep}"
        self.damaged = 0
        """Files that were found and did not count."""

    def find(self, digest: str, index: tuple[int, ...]) -> Record | None:
        """What the run has left; None where it has not been done, and where its file is not whole."""
        try:
            with open(f"{self._begin}{digest}.npz", "rb", buffering=0) as file:
                content = file.read()
        except OSError:
            return None
        try:
            return unpack(content)
        except Exception:  # whatever a damaged file does, the run is done again
            self.damaged += 1
            return None

    def put(self, digest: str, index: tuple[int, ...], record: Record, scene: Scene | None) -> Record:
        """Keep what a run has left; a kill leaves the file out or whole. Returns it."""
        failed = f"{self._begin}{digest}.failed.json"
        if record.status == FAILED:
            put(failed, failure(record.reason, scene).encode())
            return record
        put(f"{self._begin}{digest}.npz", pack(record))
        with contextlib.suppress(OSError):
            os.unlink(failed)
        return record


def failure(reason: str, scene: Scene | None) -> str:
    """Reason and scene of a run that failed, as JSON: `Scene.from_dict` reads the scene."""
    try:
        table: Any = None if scene is None else scene.to_dict()
    except FrictionError as error:  # with a model that is not registered
        table = str(error)
    return json.dumps({"reason": reason, "scene": table}, indent=1) + "\n"
