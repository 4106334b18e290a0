"""Reading of files and tables: what is no file, or larger than anyone needs, is refused; each mistake is one line."""

from __future__ import annotations

import contextlib
import csv
import io
import itertools
import math
import os
import re
import stat
from array import array
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from operator import length_hint
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import FileError, FrictionError, shown
from planarfriction.formulas import LARGEST

MOST_TEXT = 256_000_000
"""Largest text file that is read at once [bytes]."""

MOST_TABLE = 4_000_000_000
"""Largest CSV file that is read, line by line [bytes]: a log of thirty million samples fits."""

AT_ONCE = 50_000
"""Number of lines of a CSV file that are parsed together."""

TRUTH = {"true": 1.0, "false": 0.0}
"""Numbers of truth values, in small letters."""

SEPARATORS = (";", ",", "\t")
"""Separators of cells; the first that a file has is taken."""

UTF_16 = b"\xff\xfe", b"\xfe\xff"
"""First bytes of a text in UTF-16, as Excel and Windows write it."""

_SEPARATOR_LINE = re.compile(r"sep=(.)\s*", re.IGNORECASE)
_UNIT = re.compile(r"[\[(]?[A-Za-zµ°%1][\w\s/*^·.°µ%-]*[\])]?")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def read_bytes(path: str | Path, what: str, most: int | None = None) -> bytes:
    """Return the content of the file `path`; `what` says what was expected, as in "a scene file".

    Raises FileError in one line for a missing file, a folder, a device, a named pipe (nobody may ever write to it), and
    a file of more than `most` bytes. The pipes that a shell makes (`<(...)`, `/dev/stdin`) are read.
    """
    with opened(path, what, most) as file:
        content = file.read() if most is None else file.read(most + 1)
    if most is not None and len(content) > most:
        raise _too_large(path, what, most)
    return content


@contextmanager
def opened(path: str | Path, what: str, most: int | None) -> Iterator[BinaryIO]:
    """Open a file as `read_bytes` does, which see for what is refused; a pipe may have more than `most` bytes."""
    path = validation.path("path", path)
    try:
        status = os.stat(path)
        if stat.S_ISDIR(status.st_mode):
            raise FileError(f"{path}: is a folder, not {what}")
        regular = stat.S_ISREG(status.st_mode)
        if not (
            regular or (stat.S_ISFIFO(status.st_mode) and path.is_relative_to("/dev"))
        ):
            raise FileError(f"{path}: is a device or a pipe, not {what}")
        if most is not None and status.st_size > most:
            raise _too_large(path, what, most)
        with path.open("rb") as file:
            yield file
    except (FileError, UnicodeDecodeError):
        raise
    except FileNotFoundError:
        raise FileError(f"{path}: no such file (expected {what})") from None
    except (
        OSError,
        ValueError,
        MemoryError,
    ) as error:  # ValueError: a path with a zero byte
        reason = (
            getattr(error, "strerror", None)
            or " ".join(str(error).split())
            or "not enough memory"
        )
        raise FileError(f"{path}: cannot be read: {reason}") from None


def read_text(path: str | Path, what: str) -> str:
    """Return the text of the file `path` in UTF-8, or UTF-16 with its mark, of at most `MOST_TEXT` bytes."""
    content = read_bytes(path, what, MOST_TEXT)
    try:
        return content.decode(_encoding(content))
    except UnicodeDecodeError:
        raise _no_text(path, what) from None


def _encoding(start: bytes) -> str:
    """Return the encoding of a text by its first bytes."""
    return "utf-16" if start[:2] in UTF_16 and len(start) > 2 else "utf-8-sig"


def _no_text(path: str | Path, what: str) -> FileError:
    return FileError(
        f"{path}: not a text file (expected {what}); if it is one, save it as UTF-8"
    )


def read_rows(path: str | Path, what: str) -> Iterator[tuple[int, list[str]]]:
    """Return the rows of a CSV file, each with the number of its line and its stripped cells.

    Cells are separated by what stands in the first line: a semicolon, else a comma, else a tab; beside the first and
    the last of these, numbers may have a decimal comma. Empty lines and lines that start with # are left out; a quoted
    cell may go over several lines.

    Raises FileError in one line, also for a cell that is not well quoted or larger than `csv.field_size_limit`.
    """
    return _rows(path, _lines(path, what, MOST_TEXT))


def _lines(path: str | Path, what: str, most: int) -> Iterator[tuple[int, str]]:
    """Yield the lines of a text file with their numbers, without reading all of it first."""
    size = 0
    try:
        with opened(path, what, most) as file:
            encoding = _encoding(file.peek(3)[:3])  # pyright: ignore[reportAttributeAccessIssue]
            text = io.TextIOWrapper(file, encoding=encoding, newline="")
            for number, line in enumerate(
                iter(lambda: text.readline(MOST_TEXT + 1), ""), 1
            ):
                size += len(line)
                if size > most or len(line) > MOST_TEXT:
                    raise _too_large(path, what, most)
                if "\0" in line:  # UTF-16 without its mark
                    raise _no_text(path, what)
                yield number, line
    except UnicodeError:  # UTF-16 may end within a sign
        raise _no_text(path, what) from None


def _rows(
    path: str | Path, lines: Iterator[tuple[int, str]], separator: str = ""
) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows in numbered lines; their first one shows the separator, if it is not given."""
    number = 0
    try:
        for number, line in lines:
            if _holds_cells(line):
                separator = separator or _separator(line)
                record = itertools.chain([line], (more for _, more in lines))
                cells = [
                    cell.strip()
                    for cell in next(
                        csv.reader(record, strict=True, delimiter=separator)
                    )
                ]
                yield (
                    number,
                    cells
                    if separator == ","
                    else [_with_point(cell) for cell in cells],
                )
    except csv.Error as error:
        raise FileError(f"{path}: line {number} is not CSV: {error}") from None


def _holds_cells(line: str) -> bool:
    """Return True if a line is neither empty nor a remark, nor `sep=;`, which tells Excel the separator."""
    return (
        bool(line.strip())
        and not line.lstrip().startswith("#")
        and not _SEPARATOR_LINE.fullmatch(line)
    )


def width(cells: Sequence[str]) -> int:
    """Return the number of cells without the empty one that a separator at the end of a line leaves."""
    return len(cells) - (len(cells) > 1 and not cells[-1])


def _separator(line: str) -> str:
    """Return the separator of the cells of a line."""
    return next((each for each in SEPARATORS if each in line), ",")


def _with_point(cell: str) -> str:
    """Return a number with a decimal point where it has a decimal comma; anything else as it is."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


def _is_unit(cell: str) -> bool:
    """Return True if a cell below a name may be its unit, or is empty."""
    return not _is_float(cell) and (not cell or _UNIT.fullmatch(cell) is not None)


class Table:
    """A CSV file with a header line and rows of numbers, read once: `names` first, then the columns that are wanted."""

    def __init__(self, path: str | Path):
        self._path = path
        self._lines = _lines(path, "a CSV file with a header line", MOST_TABLE)
        first = [
            *itertools.islice(
                (each for each in self._lines if _holds_cells(each[1])), 1
            )
        ]
        self._separator = _separator(first[0][1]) if first else ","
        line, self.names = next(
            _rows(path, itertools.chain(first, self._lines), self._separator), (0, [])
        )
        """Names of the columns, with units in brackets that stand below them."""
        if not self.names:
            raise FileError(
                f"{path}: is empty (expected a header line and rows of numbers)"
            )
        for name in filter(None, self.names):
            if self.names.count(name) > 1:
                raise FileError(
                    f"{path}: line {line} has two columns {shown(repr(name))}"
                )
        self._read_units()

    def _read_units(self) -> None:
        """Put units in brackets behind the names if the row below them has units in place of numbers."""
        second = [
            *itertools.islice(
                (each for each in self._lines if _holds_cells(each[1])), 1
            )
        ]
        units = (
            [cell.strip() for cell in second[0][1].split(self._separator)]
            if second
            else []
        )
        if len(units) == len(self.names) and any(units) and all(map(_is_unit, units)):
            pairs = zip(self.names, [unit.strip("[]()") for unit in units], strict=True)
            self.names = [
                f"{name} [{unit}]" if unit and "[" not in name else name
                for name, unit in pairs
            ]
        else:
            self._lines = itertools.chain(second, self._lines)

    def numbers(
        self, names: Sequence[str], spare: Sequence[str] = (), flags: Sequence[str] = ()
    ) -> np.ndarray:
        """Return the columns `names`, finite, `[rows, len(names)]`; raises FileError with the line and the column.

        Columns that are `spare` too hold NaN where a cell is no finite number, `flags` may hold true and false.
        """
        self._flags = flags
        for name in names:
            if not (isinstance(name, str) and name in self.names):
                hint = (
                    validation.hint(name, self.names)
                    or f" (valid: {shown(', '.join(self.names))})"
                )
                raise FileError(
                    f"{self._path}: no column {shown(validation.quoted(name))}{hint}"
                )
        columns = [(name, self.names.index(name)) for name in names]
        values = array("d")
        while block := list(itertools.islice(self._lines, AT_ONCE)):
            found = self._at_once(
                [text for _, text in block], [column for _, column in columns]
            )
            if found is None:  # slowly, with the words for what is wrong
                self._one_by_one(iter(block), columns, spare, values)
            else:
                values.frombytes(found.tobytes())
        if not values:
            raise FileError(f"{self._path}: has a header line but no rows")
        return np.frombuffer(values).reshape(-1, len(names))

    def _at_once(
        self, lines: Sequence[str], columns: Sequence[int]
    ) -> np.ndarray | None:
        """Return the columns of lines of plain numbers; None if any line or number is of another kind."""
        text = "".join(lines)
        separators = len(self.names) - 1
        odd = '"' in text or "#" in text or (self._separator != "," and "," in text)
        if (
            odd
            or not separators
            or any(line.count(self._separator) != separators for line in lines)
        ):
            return None
        try:
            found = np.loadtxt(
                lines,
                delimiter=self._separator,
                comments=None,
                usecols=columns,
                ndmin=2,
            )
        except ValueError:
            return None
        return (
            found
            if (np.abs(found) <= LARGEST).all() and len(found) == len(lines)
            else None
        )

    def _one_by_one(
        self,
        lines: Iterator[Any],
        columns: Sequence[Any],
        spare: Sequence[str],
        values: array,
    ) -> None:
        """Append the numbers of numbered lines row by row; a quoted cell may go on behind them."""
        for line, row in _rows(
            self._path, itertools.chain(lines, self._lines), self._separator
        ):
            if len(row) != len(self.names) and width(row) != width(self.names):
                raise FileError(
                    f"{self._path}: line {line} has {len(row)} columns, the header has {len(self.names)}"
                )
            values.extend(
                self._number(line, name, row[column], name in spare)
                for name, column in columns
            )
            if not length_hint(lines):
                return

    def _number(self, line: int, name: str, cell: str, spare: bool) -> float:
        if name in self._flags and cell.lower() in TRUTH:
            return TRUTH[cell.lower()]
        try:
            return number(self._path, line, f"column {name!r}", cell)
        except FileError:
            if spare:
                return math.nan
            raise


def number(path: str | Path, line: int, place: str, cell: str) -> float:
    """Return the number in a cell of a table; raises FileError that says the line and the place in it.

    The number is finite and at most `LARGEST`, in the digits 0 to 9, without a separator of thousands.
    """
    where = f"{path}: line {line}, {place}: {shown(repr(cell))}"
    try:
        value = float(cell) if cell.isascii() and "_" not in cell else None
    except ValueError:
        value = None
    if value is None:
        raise FileError(f"{where} is not a number{_remedy(cell)}")
    if not math.isfinite(value):
        raise FileError(f"{where} is not finite")
    if abs(value) > LARGEST:
        raise FileError(f"{where} is beyond {LARGEST:g}, the largest that is read")
    return value


def _remedy(cell: str) -> str:
    """Return the remedy for a cell that is a number, or several, in another form."""
    if len(cell.split()) > 1 and all(map(_is_float, cell.split())):
        return ": part cells by commas, semicolons or tabs"
    if cell and not cell.isascii() and _is_float(cell):
        return ": write the digits 0 to 9"
    if len(cell) > 1 and _is_float(cell.replace(",", "").replace("_", "")):
        return ": write thousands without a separator"
    return ""


def _is_float(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _too_large(path: str | Path, what: str, most: int) -> FileError:
    return FileError(
        f"{path}: is larger than {most / 1e6:g} MB, the most that is read as {what}"
    )


_REQUIRED: Any = object()


class Section:
    """One table of a scene file, which knows its position so that errors can name it.

    `where` is the dotted name of the table ("contact.law", "" at the top), `source` names the file in messages, and
    relative paths start from `folder`.
    """

    def __init__(
        self,
        data: Any,
        where: str = "",
        source: str = "scene",
        folder: Path | None = None,
    ):
        self.where = where
        self.source = source
        self.folder = folder or Path()
        if not isinstance(data, dict):
            self.fail(f"must be a table of keys and values, got {_shown(data)}")
        self.data: dict[str, Any] = data

    def __contains__(self, key: str) -> bool:
        return key in self.data

    def error(self, message: str) -> FileError:
        """Return the error for this table: `file: [table]: message`."""
        table = f"[{self.where}]: " if self.where else ""
        return FileError(f"{self.source}: {table}{message}")

    def fail(self, message: str) -> None:
        """Raise the error for this table."""
        raise self.error(message)

    def only(self, keys: Iterable[str]) -> Section:
        """Return this table if it has no other keys than `keys`, or raise an error with the nearest valid name."""
        keys = list(keys)
        valid = f" (valid: {', '.join(keys)})"
        for key in self.data:
            if key not in keys:
                self.fail(
                    f"unknown key {_shown(key)}{validation.hint(key, keys) or valid}"
                )
        return self

    def get(self, key: str, default: Any = _REQUIRED) -> Any:
        """Return the value under `key`; without a default the key must be there."""
        if key not in self.data:
            if default is _REQUIRED:
                self.fail(f"missing key {key!r}")
            return default
        return self.data[key]

    def name_of(self, key: str) -> str:
        """Return the dotted name of the table `key` below this one."""
        return f"{self.where}.{key}" if self.where else key

    def section(self, key: str, value: Any = _REQUIRED) -> Section:
        """Return the table below this one; `value` stands in for a table that was written in a shorter form."""
        data = self.get(key) if value is _REQUIRED else value
        return Section(data, self.name_of(key), self.source, self.folder)

    def choice(self, key: str, valid: Iterable[str], default: Any = _REQUIRED) -> str:
        """Return the value under `key` if it is one of `valid`, or raise an error that names the nearest valid one."""
        with self.located():
            return validation.choice(key, self.get(key, default), valid)

    def path(self, key: str) -> Path:
        """Return the path under `key`, taken from the folder of the scene file."""
        return self._path(key, self.get(key))

    def paths(self, key: str) -> list[Path]:
        """Return the list of paths under `key`, taken from the folder of the scene file."""
        value = self.get(key)
        if not isinstance(value, list):
            self.fail(f"{key} must be a list of paths, got {_shown(value)}")
        return [self._path(key, each) for each in value]

    def _path(self, key: str, value: Any) -> Path:
        if not isinstance(value, str) or not value:
            self.fail(f"{key} must be the path of a file, got {_shown(value)}")
        return self.folder / value

    @contextlib.contextmanager
    def located(self) -> Iterator[None]:
        """Put file and table in front of the errors raised inside."""
        try:
            yield
        except FrictionError as error:
            message = str(error)
            raise (
                error if message.startswith(f"{self.source}: ") else self.error(message)
            ) from None


def _shown(value: Any) -> str:
    return shown(validation.quoted(value))
