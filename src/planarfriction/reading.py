"""Reading of files: what is no file, or larger than anyone needs, is refused before it is read."""

from __future__ import annotations

import csv
import difflib
import io
import itertools
import math
import os
import re
import stat
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from planarfriction import validation
from planarfriction.errors import FileError, shown

MOST_TEXT = 256_000_000
"""Largest text file that is read [bytes]: a log of a million samples fits."""

SEPARATORS = (";", ",", "\t")
"""Separators of cells; the first that a file has is taken."""

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def read_bytes(path: str | Path, what: str, most: int | None = None) -> bytes:
    """Return the content of the file `path`; `what` says what was expected, as in "a scene file".

    Raises FileError in one line for a missing file, a folder, a device, a named pipe (nobody may ever write to it), and
    a file of more than `most` bytes. The pipes that a shell makes (`<(...)`, `/dev/stdin`) are read.
    """
    path = validation.path("path", path)
    try:
        status = os.stat(path)
        if stat.S_ISDIR(status.st_mode):
            raise FileError(f"{path}: is a folder, not {what}")
        regular = stat.S_ISREG(status.st_mode)
        if not (regular or (stat.S_ISFIFO(status.st_mode) and path.is_relative_to("/dev"))):
            raise FileError(f"{path}: is a device or a pipe, not {what}")
        if most is not None and status.st_size > most:
            raise _too_large(path, what, most)
        with path.open("rb") as file:
            content = file.read() if regular or most is None else file.read(most + 1)
    except FileError:
        raise
    except FileNotFoundError:
        raise FileError(f"{path}: no such file (expected {what})") from None
    except (OSError, ValueError, MemoryError) as error:  # ValueError: a path with a zero byte
        reason = getattr(error, "strerror", None) or " ".join(str(error).split()) or "not enough memory"
        raise FileError(f"{path}: cannot be read: {reason}") from None
    if most is not None and len(content) > most:
        raise _too_large(path, what, most)
    return content


def read_text(path: str | Path, what: str) -> str:
    """Return the text of the UTF-8 file `path`, as `read_bytes` reads it, of at most `MOST_TEXT` bytes."""
    try:
        return read_bytes(path, what, MOST_TEXT).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise FileError(f"{path}: not a text file (expected {what})") from None


def read_rows(path: str | Path, what: str) -> Iterator[tuple[int, list[str]]]:
    """Return the rows of a CSV file, each with the number of its line and its stripped cells.

    Cells are separated by what stands in the first line: a semicolon, else a comma, else a tab; beside the first and
    the last of these, numbers may have a decimal comma. Empty lines and lines that start with # are left out; a quoted
    cell may go over several lines.

    Raises FileError in one line, also for a cell that is not well quoted or larger than `csv.field_size_limit`.
    """
    content = io.BytesIO(read_bytes(path, what, MOST_TEXT))
    lines = enumerate(io.TextIOWrapper(content, encoding="utf-8-sig", newline=""), 1)
    number, separator = 0, ""
    try:
        for number, line in lines:
            if line.strip() and not line.lstrip().startswith("#"):
                separator = separator or next((each for each in SEPARATORS if each in line), ",")
                record = itertools.chain([line], (more for _, more in lines))
                cells = [cell.strip() for cell in next(csv.reader(record, strict=True, delimiter=separator))]
                yield number, cells if separator == "," else [_with_point(cell) for cell in cells]
    except csv.Error as error:
        raise FileError(f"{path}: line {number} is not CSV: {error}") from None
    except UnicodeDecodeError:
        raise FileError(f"{path}: not a text file (expected {what})") from None


def _with_point(cell: str) -> str:
    """Return a number with a decimal point where it has a decimal comma; anything else as it is."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


class Table:
    """A CSV file with a header line and rows of numbers, read once: `names` first, then the columns that are wanted."""

    def __init__(self, path: str | Path):
        self._path, self._rows = path, read_rows(path, "a CSV file with a header line")
        line, self.names = next(self._rows, (0, []))
        """Names of the columns."""
        if not self.names:
            raise FileError(f"{path}: is empty (expected a header line and rows of numbers)")
        for name in filter(None, self.names):
            if self.names.count(name) > 1:
                raise FileError(f"{path}: line {line} has two columns {shown(repr(name))}")

    def numbers(self, names: Sequence[str], spare: Sequence[str] = ()) -> np.ndarray:
        """Return the columns `names`, finite, `[rows, len(names)]`; raises FileError with the line and the column.

        Columns that are `spare` too hold NaN where a cell is no finite number.
        """
        for name in names:
            if not (isinstance(name, str) and name in self.names):
                near = difflib.get_close_matches(name[:200], self.names, n=1) if isinstance(name, str) else []
                hint = f"did you mean {near[0]!r}?" if near else f"valid: {shown(', '.join(self.names))}"
                raise FileError(f"{self._path}: no column {shown(validation.quoted(name))} ({hint})")
        columns = [(name, self.names.index(name)) for name in names]
        values = array("d")
        for line, row in self._rows:
            if len(row) != len(self.names):
                raise FileError(f"{self._path}: line {line} has {len(row)} columns, the header has {len(self.names)}")
            values.extend(self._number(line, name, row[column], name in spare) for name, column in columns)
        if not values:
            raise FileError(f"{self._path}: has a header line but no rows")
        return np.array(values).reshape(-1, len(names))

    def _number(self, line: int, name: str, cell: str, spare: bool) -> float:
        try:
            return number(self._path, line, f"column {name!r}", cell)
        except FileError:
            if spare:
                return math.nan
            raise


def number(path: str | Path, line: int, place: str, cell: str) -> float:
    """Return the finite number in a cell of a table; raises FileError that says the line and the place in it."""
    try:
        value = float(cell)
    except ValueError:
        raise FileError(f"{path}: line {line}, {place}: {shown(repr(cell))} is not a number") from None
    if not math.isfinite(value):
        raise FileError(f"{path}: line {line}, {place}: {shown(repr(cell))} is not finite")
    return value


def _too_large(path: Path, what: str, most: int) -> FileError:
    return FileError(f"{path}: is larger than {most / 1e6:g} MB, the most that is read as {what}")
