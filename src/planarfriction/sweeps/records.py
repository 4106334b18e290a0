"""Results of runs: simulating and measuring a scene, and the bytes of the files that keep results."""

from __future__ import annotations

import contextlib
import io
import json
import secrets
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planarfriction.errors import FrictionError, InvalidValueError, one_line
from planarfriction.scenes import Scene, Solution
from planarfriction.scenes.solution import History

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
    end: float = 0.0
    """Time at which the run was to end [s]."""


def run(
    scene: Scene,
    measure: Callable[[Solution], Any] | None,
    stopped: Callable[[], bool] | None = None,
) -> Record:
    """Simulate a scene and measure it, in any thread or process; errors become part of the record."""
    from planarfriction.scenes import simulate

    def check(time: float) -> None:
        if stopped is not None and stopped():
            raise Stopped

    where = ""
    try:
        solution = simulate(scene, progress=check)
        where = "measure: "
        found = solution.histories if measure is None else measure(solution)
        return Record(solution.status, "", variables(found, measure), scene.t_end)
    except Exception as error:
        return Record(FAILED, f"{where}{reason_of(error)}", {}, scene.t_end)


@dataclass(frozen=True, eq=False)
class Batch:
    """Scenes that a worker is handed together."""

    scenes: list[Scene]
    measure: Callable[[Solution], Any] | None
    stopped: Callable[[], bool] | None = None
    """Return True if nobody waits for the results any longer."""

    def __dask_tokenize__(self) -> str:
        """Return a name of its own, for which dask would go through all numbers of the scenes."""
        return secrets.token_hex(16)


def run_all(batch: Batch) -> tuple[list[Record], float]:
    """Run scenes until `TURN` is over, at least the first one; returns the records of those that were run, and time."""
    begin = time.monotonic()
    found = []
    with contextlib.suppress(Stopped):
        for scene in batch.scenes:
            found.append(run(scene, batch.measure, batch.stopped))
            if time.monotonic() - begin > TURN:
                break
    return found, time.monotonic() - begin


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


def failure(reason: str, scene: Scene | None) -> str:
    """Return reason and scene of a failed run as JSON; `Scene.from_dict` reads the scene."""
    try:
        table: Any = None if scene is None else scene.to_dict()
    except FrictionError as error:  # with a model that is not registered
        table = str(error)
    return json.dumps({"reason": reason, "scene": table}, indent=1) + "\n"
