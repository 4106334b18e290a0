"""Experiments as functions of `Work` that return a `Result` of data, figures and numbers."""

from __future__ import annotations

import functools
import hashlib
import itertools
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar
from zipfile import BadZipFile

import numpy as np

from planarfriction._support.writing import make_folder, replacing
from planarfriction.scenes import Signal
from planarfriction.scenes.signal import sample_times
from planarfriction_studies.experiments import facts

if TYPE_CHECKING:
    import xarray as xr

THREADS = 2
"""Pieces computed at once by `Work.pieces`."""

TWIST = {"vx": "m/s", "vy": "m/s", "omega": "rad/s"}
POSE = {"x": "m", "y": "m", "theta": "rad"}
WRENCH = {"fx": "N", "fy": "N", "tau": "N m"}
"""Columns of runs and of curves, and their units."""

UNITS = TWIST | POSE | WRENCH | {"normal_force": "N"}

Arrays = dict[str, np.ndarray]
Numbers = dict[str, Any]

Key = TypeVar("Key")
Item = TypeVar("Item")
Reference = Literal["published", "converged", "closed form"]


@dataclass(frozen=True)
class Comparison:
    """One of our numbers or curves beside a reference, with the tolerance that the reference supports."""

    quantity: str
    """Compared quantity, in words."""
    reference: Reference
    difference: float
    """Largest absolute difference over all samples."""
    tolerance: float
    unit: str
    samples: int
    cause: str
    """Cause of the difference, one sentence."""
    ours: float | None = None
    """Our value, where it is a single number."""
    theirs: float | None = None
    """The reference's value, where it is a single number."""
    span: float | None = None
    """Largest less smallest value of the reference's curve; None: not a curve."""
    paper: float | None = None
    """Distance of a published curve from the converged solution, which is most of its tolerance; None: not known."""

    @property
    def share(self) -> float | None:
        """The difference as a share of the span [-]; None where the reference is zero, up to the tolerance."""
        return (
            self.difference / self.span
            if self.span and self.span > self.tolerance
            else None
        )

    @property
    def holds(self) -> bool:
        """True if the difference is within the tolerance."""
        return bool(self.difference <= self.tolerance)


def compare_curve(
    quantity: str,
    time: np.ndarray,
    values: np.ndarray,
    name: str,
    allowance: float,
    cause: str,
) -> Comparison:
    """Compare our curve (`values` at `time`) with the published curve `name`, at the times of its vertices only.

    The tolerance is the error of the figure's solver, plus that of reading it, plus `allowance`, which is our own
    error (or, where the figure's solver error is unknown, an estimate that `cause` explains).
    """
    curve = facts.published_curve(name)
    tolerance = (curve.deviation or 0.0) + curve.reading + allowance
    theirs = (curve.time, curve.values)
    return _compare_at(
        "published",
        quantity,
        (time, values),
        theirs,
        tolerance,
        curve.unit,
        cause,
        curve.deviation,
    )


def compare_converged(
    quantity: str,
    time: np.ndarray,
    values: np.ndarray,
    name: str,
    allowance: float,
    cause: str,
) -> Comparison:
    """Compare our curve with the column `name` of a converged solution, `in_hand/Circle/d1/x`, at all its times."""
    solution, _, column = name.rpartition("/")
    reference = facts.converged(solution)
    theirs = reference["time"], reference[column]
    tolerance = allowance + facts.CONVERGED_SHARE * float(np.ptp(theirs[1]))
    return _compare_at(
        "converged", quantity, (time, values), theirs, tolerance, UNITS[column], cause
    )


Curve = tuple[np.ndarray, np.ndarray]
"""Times and values."""


def _compare_at(
    reference: Reference, quantity: str, ours: Curve, theirs: Curve, tolerance: float, unit: str, cause: str,
    paper: float | None = None,
) -> Comparison:  # fmt: skip
    """Compare our curve with another at the times of that; each must be recorded, for between samples lie jumps."""
    (time, values) = ours
    (wanted, expected) = theirs
    inside = wanted <= time[-1] + 1e-9  # a run may be shorter than the figure
    index = np.clip(np.searchsorted(time, wanted[inside] - 1e-7), 0, len(time) - 1)
    assert np.abs(time[index] - wanted[inside]).max() < 1e-6, (
        "the reference has times that were not recorded"
    )
    difference = float(np.abs(values[index] - expected[inside]).max())
    span = float(np.ptp(expected))
    samples = int(inside.sum())
    return Comparison(
        quantity,
        reference,
        difference,
        tolerance,
        unit,
        samples,
        cause,
        span=span,
        paper=paper,
    )


def compare_columns(
    reference: Literal["published", "converged"],
    before: str,
    run: Mapping[str, np.ndarray],
    solution: str,
    allowance: Mapping[str, float] | float,
    cause: str,
    columns: Iterable[str] = (*POSE, *WRENCH),
) -> list[Comparison]:
    """Compare columns of a run with those of a published curve or of a converged solution.

    `before` stands before the names of the columns. Columns whose unit has no `allowance` are left out.
    """
    compare = compare_curve if reference == "published" else compare_converged
    allowances = (
        allowance
        if isinstance(allowance, Mapping)
        else dict.fromkeys(UNITS.values(), allowance)
    )
    return [
        compare(
            f"{before}{name}",
            run["time"],
            run[name],
            f"{solution}/{name}",
            allowances[UNITS[name]],
            cause,
        )
        for name in columns
        if UNITS[name] in allowances
    ]


def compare_profile(
    profile: Signal, name: str, columns: Iterable[str], cause: str, *, dt: float = 0.01, allowance: float = 1e-12,
    before: str = "velocity profile, ",
) -> list[Comparison]:  # fmt: skip
    """Compare a signal, sampled every `dt` [s], with the published curves `name`."""
    time = sample_times(5.0, dt)
    ours = columns_of(time, profile(time), columns)
    return compare_columns("published", before, ours, name, allowance, cause, columns)


def compare(
    quantity: str,
    ours: Any,
    theirs: Any,
    reference: Reference,
    tolerance: float,
    unit: str,
    cause: str,
) -> Comparison:
    """Compare one number with its reference, or an array of them, of which the farthest counts."""
    difference = np.abs(np.asarray(ours) - theirs)
    values = (None, None) if difference.ndim else (float(ours), float(theirs))
    return Comparison(
        quantity,
        reference,
        float(difference.max()),
        tolerance,
        unit,
        difference.size,
        cause,
        *values,
    )


def compare_all(
    reference: Reference, rows: Iterable[tuple[str, Any, Any, float, str, str]]
) -> list[Comparison]:
    """Compare rows of quantity, ours, theirs, tolerance, unit and cause."""
    return [compare(*row[:3], reference, *row[3:]) for row in rows]


class Picture(NamedTuple):
    """A figure of the report."""

    name: str
    """File name without its ending."""
    caption: str
    """Description of the picture, one or two sentences."""
    figure: Any
    """The matplotlib figure."""


@dataclass(frozen=True)
class Table:
    """A table of the report; the first column names the rows."""

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str | float]]
    note: str = ""


def table(
    title: str,
    items: Mapping[str, Item],
    columns: Mapping[str, Callable[[Item], str | float]],
    first: str = "",
    note: str = "",
) -> Table:
    """Return a row for each item, which its name begins; columns by heading; `first` is the heading of the names."""
    rows = [
        [name, *(cell(item) for cell in columns.values())]
        for name, item in items.items()
    ]
    return Table(title, [first, *columns], rows, note)


def entry(
    *keys: Any, scale: float = 1.0, digits: int | None = None
) -> Callable[[Any], float]:
    """Return a column of a table: the number below `keys` of an item, times `scale`, rounded to `digits`."""

    def cell(item: Any) -> float:
        value = scale * functools.reduce(operator.getitem, keys, item)
        return value if digits is None else float(f"{value:.{digits}g}")

    return cell


def median_and_quartiles(values: Any) -> list[float]:
    """Return the median, first and third quartile."""
    return np.percentile(values, [50.0, 25.0, 75.0]).tolist()


def columns_of(time: np.ndarray, values: np.ndarray, names: Iterable[str]) -> Arrays:
    """Return `time` and the columns of `values` `[T, N]` by name, as a run."""
    return {"time": time} | dict(zip(names, values.T, strict=True))


def with_units(
    values: np.ndarray, units: Mapping[str, str]
) -> dict[str, tuple[np.ndarray, str]]:
    """Return the columns of `values` `[T, N]` by name, each with its unit."""
    return {
        name: (column, unit)
        for (name, unit), column in zip(units.items(), values.T, strict=True)
    }


def dataset(
    runs: Mapping[tuple[str, ...], Mapping[str, np.ndarray]],
    columns: Iterable[str],
    dims: Sequence[str],
    along: tuple[str, np.ndarray, str],
    alone: Mapping[str, tuple[np.ndarray, str]] | None = None,
) -> xr.Dataset:
    """Return columns of runs by their labels, one for each of `dims`, over `along`: its name, values and unit.

    `columns` are names in `UNITS`, or names with their units; `alone` are values and units that are the same in all
    runs.
    """
    import xarray as xr

    labels = [list(dict.fromkeys(each)) for each in zip(*runs, strict=True)]
    shape = [*map(len, labels), -1]
    name, values, unit = along
    units = (
        columns
        if isinstance(columns, Mapping)
        else {column: UNITS[column] for column in columns}
    )
    variables: dict[str, Any] = {
        column: ((*dims, name), np.array([runs[key][column] for key in itertools.product(*labels)]).reshape(shape),
                 {"units": unit})
        for column, unit in units.items()
    }  # fmt: skip
    variables |= {
        each: (name, values, {"units": unit})
        for each, (values, unit) in (alone or {}).items()
    }
    coordinates = dict(zip(dims, labels, strict=True))
    return xr.Dataset(variables, coordinates | {name: (name, values, {"units": unit})})


@dataclass(frozen=True)
class Result:
    """Findings of an experiment."""

    findings: Sequence[str]
    """Paragraphs of Markdown: what it shows, with the numbers measured in this run."""
    pictures: Sequence[Picture]
    comparisons: Sequence[Comparison]
    numbers: Mapping[str, Any]
    """Every number worth keeping, in nested dictionaries and lists."""
    tables: Sequence[Table] = ()
    data: Mapping[str, xr.Dataset] = field(default_factory=dict)
    """Curves by name, with units; written as NetCDF."""
    asked: str = ""
    """Paragraph on what is compared, and how, Markdown."""
    verdict: str = ""
    """One or two sentences for the top of the report, Markdown."""
    left_out: str = ""
    """Description of the published curve that is not compared, if there is one."""


@dataclass(frozen=True)
class Work:
    """Options of a run: its extent, the folder of finished pieces, and the receiver of progress.

    An experiment wraps what takes long in pieces. A piece that an interrupted run has finished is read from its file.
    """

    quick: bool = False
    """A small part of everything, to see that it works."""
    full: bool = False
    """True to include the parts that take more than minutes."""
    folder: Path | None = None
    """Folder that keeps finished pieces; None keeps none."""
    fingerprint: str = ""
    """Fingerprint of the code and the options: pieces with another one are computed again."""
    progress: Callable[[str], None] | None = None

    def piece(
        self, label: str, compute: Callable[[], Mapping[str, Any]]
    ) -> dict[str, Any]:
        """Return what `compute` does, nested dictionaries of numbers and arrays, from the kept file if there is one."""
        if self.progress is not None:
            self.progress(label)
        path = None if self.folder is None else self.folder / f"{_slug(label)}.npz"
        kept = None if path is None else _read_piece(path, self.fingerprint)
        if kept is None:
            kept = dict(_flat(compute()))
            if path is not None:
                _write_piece(path, self.fingerprint, kept)
        return _nested(kept)

    def pieces(
        self,
        computes: Mapping[Key, Callable[[], Mapping[str, Any]]],
        label: Callable[[Key], str] = str,
    ) -> dict[Key, dict[str, Any]]:
        """Compute independent pieces by key, two at a time: compiled code runs beside other compiled code."""
        pool = ThreadPoolExecutor(THREADS)
        try:
            futures = {
                key: pool.submit(self.piece, label(key), compute)
                for key, compute in computes.items()
            }
            return {key: future.result() for key, future in futures.items()}
        finally:
            pool.shutdown(cancel_futures=True)


_INNER = "|"
"""Separator between the names of nested dictionaries in the kept files."""


def _flat(
    values: Mapping[str, Any], before: str = ""
) -> Iterator[tuple[str, np.ndarray]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}{_INNER}")
        else:
            yield f"{before}{name}", np.asarray(value)


def _nested(arrays: Arrays) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, values in arrays.items():
        *outer, name = key.split(_INNER)
        home = functools.reduce(
            lambda place, each: place.setdefault(each, {}), outer, result
        )
        home[name] = values if values.ndim else values.item()
    return result


def _slug(label: str) -> str:
    """Return the label as a file name; its digest tells labels apart that differ in what a file name cannot hold."""
    return (
        re.sub(r"[^\w.]+", "-", label).strip("-")
        + "-"
        + hashlib.sha256(label.encode()).hexdigest()[:8]
    )


def _read_piece(path: Path, fingerprint: str) -> Arrays | None:
    # None, or cut off while it was written.
    try:
        with path.open("rb") as file, np.load(file) as stored:
            arrays = dict(stored)
    except (
        OSError,
        ValueError,
        EOFError,
        BadZipFile,
    ):
        return None
    return arrays if str(arrays.pop("fingerprint", "")) == fingerprint else None


def _write_piece(path: Path, fingerprint: str, arrays: Arrays) -> None:
    make_folder(path.parent)
    contents: dict[str, Any] = {"fingerprint": np.array(fingerprint), **arrays}
    with replacing(path) as file:
        np.savez_compressed(file, **contents)
