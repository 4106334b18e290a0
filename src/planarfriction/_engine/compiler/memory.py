"""Memory shared by Python and compiled code: records, arrays by their addresses, and layouts of scratch memory.

A record is a `NamedTuple` whose fields are numbers (`float`), counts and addresses of functions (`int`), arrays
(`Doubles`, `Integers`) or records. In memory it is a row of 8-byte words, an array being the address of its
first number; compiled code reads the row as the same `NamedTuple`, whose arrays are then pointers: `record.twist[i]`.
"""

from __future__ import annotations

import ctypes
import functools
import itertools
import math
import typing
from typing import Annotated, Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, models, register_model

Doubles = Annotated[np.ndarray, types.float64]
"""Field of a record that holds a contiguous array of doubles; in compiled code a pointer."""

Integers = Annotated[np.ndarray, types.int64]
"""Field of a record that holds a contiguous array of 64-bit integers."""

Place = int
"""Argument of a compiled function that is an address."""

_WORD = 8
"""Bytes of a word."""

_DTYPES = frozenset(map(np.dtype, (np.float64, np.int64)))
"""Types of the numbers of arrays in records."""

# ---------------------------------------------------------------------- records as rows of words


@functools.cache
def _fields(record: Any) -> tuple[tuple[str, Any], ...]:
    return tuple(typing.get_type_hints(record, include_extras=True).items())


def _number_of(kind: Any) -> Any:
    """Return the type of the numbers of an array field, None for other fields."""
    return kind.__metadata__[0] if hasattr(kind, "__metadata__") else None


def _is_integer(kind: Any) -> bool:
    return kind in (int, bool) or _number_of(kind) is not None


def place_of(array: np.ndarray) -> int:
    """Return the address of the first number of a contiguous array, which the caller keeps alive."""
    assert array.dtype in _DTYPES and array.flags.c_contiguous
    if array.size and array.flags.writeable:  # a third of the time
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    return array.__array_interface__["data"][0]


def places_of(rows: np.ndarray) -> np.ndarray:
    """Return the address of each row of a contiguous array [R, ...], int [R]."""
    return place_of(rows) + rows.strides[0] * np.arange(len(rows))


@functools.cache
def size_of(record: Any) -> int:
    """Return the number of words of a record."""
    return sum(_words(kind) for _, kind in _fields(record))


def _words(kind: Any) -> int:
    return size_of(kind) if hasattr(kind, "_fields") else 1


@functools.cache
def _plan(record: Any) -> dict[str, tuple[int, int, bool, np.dtype | None]]:
    """Return the first word of each field, the words of a record in it or 0, True for an integer, and the dtype."""
    plan = {}
    first = 0
    for name, kind in _fields(record):
        number = _number_of(kind)
        words = _words(kind)
        dtype = None if number is None else np.dtype(str(number))
        plan[name] = (
            first,
            words if hasattr(kind, "_fields") else 0,
            _is_integer(kind),
            dtype,
        )
        first += words
    return plan


def row_of(record: Any) -> np.ndarray:
    """Return the words of a record as a row of doubles; integers and addresses lie in them bit by bit.

    An array without numbers has the address 0. Words may stand for a record in the record. The caller keeps arrays
    alive.
    """
    row = np.empty(size_of(type(record)))
    _write(row, record)
    return row


def _write(row: np.ndarray, record: Any) -> None:
    integers = row.view(np.int64)
    for (first, words, integer, dtype), value in zip(
        _plan(type(record)).values(), record, strict=True
    ):
        if words:
            if isinstance(value, np.ndarray):
                row[first : first + words] = value
            else:
                _write(row[first : first + words], value)
            continue
        if isinstance(value, np.ndarray):
            assert value.dtype == dtype, (dtype, value.dtype)
            value = place_of(value) if value.size else 0
        (integers if integer else row)[first] = value


def rows_of(record: Any, count: int, **columns: np.ndarray) -> np.ndarray:
    """Return the words of `count` records `[count, size]`: copies of `record` but for the fields in `columns`.

    A column holds one row for each record; the column of an array holds addresses.
    """
    rows = np.tile(row_of(record), (count, 1))
    for name, column in columns.items():
        first, words, integer, _ = _plan(type(record))[name]
        target = (rows.view(np.int64) if integer else rows)[
            :, first : first + (words or 1)
        ]
        target[:] = np.reshape(column, target.shape)
    return rows


class StructBuffer:
    """A record, its words, and their address, which compiled functions take; it keeps the arrays alive."""

    def __init__(self, record: Any) -> None:
        self.record = record
        self.words = row_of(record)
        self.address = place_of(self.words)


# ---------------------------------------------------------------------- records in compiled code


def _field_type(kind: Any) -> Any:
    number = _number_of(kind)
    return (
        types.CPointer(number)
        if number
        else (types.int64 if _is_integer(kind) else types.float64)
    )


def _type_of(record: Any) -> Any:
    parts = [
        _type_of(kind) if hasattr(kind, "_fields") else _field_type(kind)
        for _, kind in _fields(record)
    ]
    return types.BaseTuple.from_types(parts, record)


def _load(
    context: Any, builder: Any, kind: Any, words: Any, at: int, constant: bool = False
) -> tuple[Any, int]:
    """Load a value of a type whose words begin at number `at`; return it and where the next begins.

    Words that are `constant` as long as the function runs may be loaded once for a whole loop.
    """
    if isinstance(kind, types.BaseTuple):
        values = []
        for part in kind:
            value, at = _load(context, builder, part, words, at, constant)
            values.append(value)
        return context.make_tuple(builder, kind, values), at
    place = builder.gep(words, [ir.Constant(ir.IntType(64), at)])
    value = builder.load(
        builder.bitcast(place, context.get_value_type(kind).as_pointer())
    )
    if constant:
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value, at + 1


def pointer_to(context: Any, builder: Any, kind: Any, value: Any, target: Any) -> Any:
    """Return an address, a pointer or an array as a pointer to numbers of another type."""
    if isinstance(kind, types.Array):
        value = context.make_array(kind)(context, builder, value).data
    place = context.get_value_type(types.CPointer(target))
    return (
        builder.inttoptr(value, place)
        if isinstance(kind, types.Integer)
        else builder.bitcast(value, place)
    )


class _View(types.Type):
    """A record at an address, whose fields are loaded where they are named; no compiled function changes its words."""

    def __init__(self, record: Any) -> None:
        self.record = record
        super().__init__(name=f"view of {record.__module__}.{record.__qualname__}")


@register_model(_View)
class _ViewModel(models.OpaqueModel):
    """A view is a bare address."""


def _holds_arrays(kind: Any) -> bool:
    """Return True for a record that holds arrays, itself or in a record of its own."""
    return any(
        _number_of(each) or (hasattr(each, "_fields") and _holds_arrays(each))
        for _, each in _fields(kind)
    )


def _type_in_view(kind: Any) -> Any:
    if hasattr(kind, "_fields"):
        return _View(kind) if _holds_arrays(kind) else _type_of(kind)
    return _field_type(kind)


@infer_getattr
class _Fields(AttributeTemplate):
    """Types of the fields of a view: records that hold arrays are views too."""

    key = _View

    def generic_resolve(self, view: Any, name: str) -> Any:
        kind = dict(_fields(view.record)).get(name)
        return None if kind is None else _type_in_view(kind)


@lower_getattr_generic(_View)
def _load_field(context: Any, builder: Any, view: _View, value: Any, name: str) -> Any:
    words = builder.bitcast(value, ir.DoubleType().as_pointer())
    first = _plan(view.record)[name][0]
    result = _type_in_view(dict(_fields(view.record))[name])
    if isinstance(result, _View):
        place = builder.gep(words, [ir.Constant(ir.IntType(64), first)])
        return builder.bitcast(place, context.get_value_type(result))
    return _load(context, builder, result, words, first, constant=True)[0]


def reader(record: Any) -> Any:
    """Make the compiled function that reads a record at an address, a pointer, or the beginning of a row.

    A record that holds arrays is read field by field, where they are named: functions pass it for the price of an
    address.
    """
    result = _type_in_view(record)

    @intrinsic
    def read(typingctx: Any, row: types.Type) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            words = pointer_to(context, builder, row, args[0], types.float64)
            if isinstance(result, _View):
                return builder.bitcast(words, context.get_value_type(result))
            return _load(context, builder, result, words, 0)[0]

        return result(row), generate

    return read


def _view(number: Any) -> Any:
    """Make the compiled function that takes an address or a pointer for one to numbers of a type."""

    @intrinsic
    def view(typingctx: Any, place: types.Type) -> Any:
        if not isinstance(place, (types.Integer, types.CPointer)):
            return None

        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return pointer_to(context, builder, place, args[0], number)

        return types.CPointer(number)(place), generate

    return view


doubles = _view(types.float64)
floats = _view(types.float32)
integers = _view(types.int64)
integers32 = _view(types.int32)


@intrinsic
def at(typingctx: Any, place: types.Type, i: types.Type) -> Any:
    """Return the place, pointer or address, of the number i of 8 bytes from a place on."""
    if not isinstance(i, types.Integer) or not isinstance(
        place, (types.Integer, types.CPointer)
    ):
        return None
    if isinstance(place, types.CPointer):
        return place(
            place, types.int64
        ), lambda context, builder, signature, args: builder.gep(args[0], [args[1]])

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.add(
            args[0], builder.mul(args[1], ir.Constant(ir.IntType(64), _WORD))
        )

    return types.int64(types.int64, types.int64), generate


@intrinsic
def exists(typingctx: Any, place: types.Type) -> Any:
    """Return True unless a pointer belongs to an array without numbers."""
    if not isinstance(place, types.CPointer):
        return None

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return cgutils.is_not_null(builder, args[0])

    return types.boolean(place), generate


# ---------------------------------------------------------------------- scratch memory


@functools.cache
def offsets_of(record: Any) -> Any:
    """Return the record of the same names whose arrays are offsets in words (`arrays_at` makes it a record again)."""
    twin = typing.NamedTuple(
        f"{record.__name__}Offsets", [(name, int) for name, _ in _fields(record)]
    )
    twin.record = record
    return twin


class Layout:
    """Arrays of a record one behind the other in a block of words; shapes are given by name, numbers stand for [n]."""

    def __init__(self, record: Any, **shapes: Any) -> None:
        self._record = record
        self._shapes = {name: shapes[name] for name in record._fields}
        sizes = [
            math.prod(shape) if isinstance(shape, tuple) else shape
            for shape in self._shapes.values()
        ]
        ends = [0, *itertools.accumulate(sizes)]
        self.size: int = ends[-1]
        """Words of the block."""
        self.offsets = offsets_of(record)(*ends[:-1])
        """Words at which the arrays begin (see `arrays_at`)."""
        self.slices = {
            name: slice(*each)
            for name, *each in zip(self._shapes, ends[:-1], ends[1:], strict=True)
        }
        """The numbers of each array in a block."""
        self._places = np.where(sizes, np.multiply(_WORD, ends[:-1]), -1)
        """Bytes at which the arrays begin, -1 for those without numbers."""
        self._integers = {
            name for name, kind in _fields(record) if _number_of(kind) == types.int64
        }

    def made(self, **known: np.ndarray) -> Any:
        """Return the record with its arrays in a new block of zeros, except arrays that are `known`."""
        block = np.zeros(self.size)
        arrays = {}
        for name, shape in self._shapes.items():
            flat = block[self.slices[name]]
            arrays[name] = (
                flat.view(np.int64) if name in self._integers else flat
            ).reshape(shape)
        return self._record(**{**arrays, **known})

    def placed(self, block: np.ndarray) -> Any:
        """Return the words of the record whose arrays lie in a block, which the caller keeps alive."""
        return np.where(self._places < 0, 0, self._places + place_of(block)).view(float)


layout = functools.lru_cache(64)(Layout)
"""Layout of a record with shapes by name, which is made once."""


@intrinsic
def arrays_at(typingctx: Any, offsets: types.Type, place: types.Type) -> Any:
    """Return the record of a `Layout` whose block begins at a place, from the offsets of its arrays."""
    result = _type_of(offsets.instance_class.record)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        first = pointer_to(context, builder, place, args[1], types.float64)
        fields = []
        for kind, offset in zip(
            result, cgutils.unpack_tuple(builder, args[0]), strict=True
        ):
            fields.append(
                builder.bitcast(
                    builder.gep(first, [offset]), context.get_value_type(kind)
                )
            )
        return context.make_tuple(builder, result, fields)

    return result(offsets, place), generate
