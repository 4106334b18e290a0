"""Typed records: named in Python and in compiled loops, a row of 8-byte words in memory.

A record is a `NamedTuple` whose fields are numbers (`float`), counts and addresses (`int`), or records.
"""

from __future__ import annotations

import functools
import typing
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@functools.cache
def _fields(record: Any) -> tuple[tuple[str, Any], ...]:
    return tuple(typing.get_type_hints(record).items())


def addresses_in(*records: Any) -> list[str]:
    """Names of the fields that hold arrays, which compiled code reads by their addresses."""
    return [name for record in records for name, kind in _fields(record) if kind is np.ndarray]


def size_of(record: Any) -> int:
    """How many words a record takes."""
    return sum(size_of(kind) if hasattr(kind, "_fields") else 1 for _, kind in _fields(record))


def row_of(record: Any) -> np.ndarray:
    """The words of a record as a row of doubles; integers lie in them bit by bit."""
    row = np.empty(size_of(type(record)))
    _write(row, record)
    return row


def _write(row: np.ndarray, record: Any) -> None:
    at = 0
    for name, kind in _fields(type(record)):
        value = getattr(record, name)
        if hasattr(kind, "_fields"):
            count = size_of(kind)
            _write(row[at : at + count], value)
            at += count
            continue
        (row.view(np.int64) if kind is int else row)[at] = value
        at += 1


def rows_of(record: Any, count: int, **columns: np.ndarray) -> np.ndarray:
    """The words of `count` records `[count, size]`: those of `record` but for the fields in `columns`, one row each."""
    rows = np.tile(row_of(record), (count, 1))
    at = 0
    for name, kind in _fields(type(record)):
        width = size_of(kind) if hasattr(kind, "_fields") else 1
        if name in columns:
            target = rows.view(np.int64) if kind is int else rows
            target[:, at : at + width] = np.reshape(columns[name], (count, width))
        at += width
    return rows


def _type_of(record: Any) -> Any:
    parts = [
        _type_of(kind) if hasattr(kind, "_fields") else (types.int64 if kind is int else types.float64)
        for _, kind in _fields(record)
    ]
    return types.BaseTuple.from_types(parts, record)


def _load(context, builder, kind, words, at):
    """Value of a type whose words begin at number `at`, and where the next begins."""
    if isinstance(kind, types.BaseTuple):
        values = []
        for part in kind:
            value, at = _load(context, builder, part, words, at)
            values.append(value)
        return context.make_tuple(builder, kind, values), at
    place = builder.gep(words, [ir.Constant(ir.IntType(64), at)])
    place = builder.bitcast(place, context.get_value_type(kind).as_pointer())
    return builder.load(place), at + 1


def reader(record: Any) -> Any:
    """Make the compiled function that reads a record from the beginning of a row, or from an address."""
    result = _type_of(record)

    @intrinsic
    def read(typingctx, row):
        def generate(context, builder, signature, args):
            words = args[0]
            if isinstance(row, types.Array):
                words = context.make_array(row)(context, builder, words).data
            double = ir.DoubleType().as_pointer()
            words = (
                builder.inttoptr(words, double) if isinstance(row, types.Integer) else builder.bitcast(words, double)
            )
            return _load(context, builder, result, words, 0)[0]

        return result(row), generate

    return read
