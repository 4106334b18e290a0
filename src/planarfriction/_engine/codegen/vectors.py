"""Vectors of two or three components as tuples, and matrices [3, 3] as nine numbers, row by row."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, pointer_to

Vector = tuple[float, ...]
"""Vector in compiled code, or a matrix row by row."""

_FLAGS = ("reassoc", "contract", "nsz", "arcp")


@intrinsic
def dot(typingctx: Any, a: types.Type, b: types.Type) -> Any:
    """Return `a . b`."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        parts = zip(
            *(cgutils.unpack_tuple(builder, vector) for vector in args), strict=True
        )
        products = [builder.fmul(x, y, flags=_FLAGS) for x, y in parts]
        total = products[0]
        for product in products[1:]:
            total = builder.fadd(total, product, flags=_FLAGS)
        return total

    return types.float64(a, b), generate


@intrinsic
def times(typingctx: Any, c: types.Type, a: types.Type) -> Any:
    """Return `c a`."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        parts = cgutils.unpack_tuple(builder, args[1])
        return context.make_tuple(
            builder,
            signature.return_type,
            [builder.fmul(args[0], x, flags=_FLAGS) for x in parts],
        )

    return types.UniTuple(types.float64, len(a))(types.float64, a), generate


@intrinsic
def plus(typingctx: Any, a: types.Type, c: types.Type, b: types.Type) -> Any:
    """Return `a + c b`, a record if a is one."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        parts = zip(
            cgutils.unpack_tuple(builder, args[0]),
            cgutils.unpack_tuple(builder, args[2]),
            strict=True,
        )
        sums = [
            builder.fadd(x, builder.fmul(args[1], y, flags=_FLAGS), flags=_FLAGS)
            for x, y in parts
        ]
        return context.make_tuple(builder, signature.return_type, sums)

    result = (
        a
        if isinstance(a, types.BaseNamedTuple)
        else types.UniTuple(types.float64, len(a))
    )
    return result(a, types.float64, b), generate


@intrinsic
def zeros(typingctx: Any, a: types.Type) -> Any:
    """Return a vector of zeros as long as a."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        zero = context.get_constant(types.float64, 0.0)
        return context.make_tuple(builder, signature.return_type, [zero] * len(a))

    return types.UniTuple(types.float64, len(a))(a), generate


def _spread(add: bool) -> Callable[..., Any]:
    """Return the code of `accumulate` or `scatter`."""

    def numbers(builder: Any, kind: Any, value: Any) -> list[Any]:
        if not isinstance(kind, types.BaseTuple):
            return [value]
        parts = zip(kind, cgutils.unpack_tuple(builder, value), strict=True)
        return [number for each in parts for number in numbers(builder, *each)]

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        first = pointer_to(context, builder, signature.args[0], args[0], types.float64)
        at = args[1]
        for number in numbers(builder, signature.args[3], args[3]):
            place = builder.gep(first, [at])
            builder.store(
                builder.fadd(builder.load(place), number, flags=_FLAGS)
                if add
                else number,
                place,
            )
            at = builder.add(at, args[2], flags=("nsw",))
        return context.get_dummy_value()

    return generate


@intrinsic
def accumulate(
    typingctx: Any,
    row: types.Type,
    at: types.Type,
    stride: types.Type,
    record: types.Type,
) -> Any:
    """Add the numbers of a record, which may hold records, one by one to `row[at]`, `row[at + stride]`, ...

    `row` is an array or a pointer.
    """
    return types.void(row, types.intp, types.intp, record), _spread(add=True)


@intrinsic
def scatter(
    typingctx: Any,
    row: types.Type,
    at: types.Type,
    stride: types.Type,
    record: types.Type,
) -> Any:
    """Write the numbers of a record as `accumulate` adds them."""
    return types.void(row, types.intp, types.intp, record), _spread(add=False)


@intrinsic(prefer_literal=True)
def gathered(
    typingctx: Any,
    row: types.Type,
    at: types.Type,
    stride: types.Type,
    count: types.Type,
) -> Any:
    """Return `row[at]`, `row[at + stride]`, ... of an array or a pointer as a tuple of a constant count."""
    if not isinstance(count, types.IntegerLiteral):
        return None
    result = types.UniTuple(types.float64, count.literal_value)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        first = pointer_to(context, builder, signature.args[0], args[0], types.float64)
        at = args[1]
        numbers = []
        for _ in range(result.count):
            numbers.append(builder.load(builder.gep(first, [at])))
            at = builder.add(at, args[2], flags=("nsw",))
        return context.make_tuple(builder, result, numbers)

    return result(row, types.intp, types.intp, count), generate


def reader_of(count: int) -> Any:
    """Return a kernel `(row, first, stride)` that returns so many numbers of a pointer as a tuple."""

    @kernel
    def taken(row: Doubles, first: int, stride: int) -> Vector:
        return gathered(row, first, stride, count)

    return taken


def _products(
    rows: int, inner: int, columns: int, place: Callable[[int, int], int]
) -> Callable[..., Any]:
    """Return the code of a product; number (i, j) of the first factor is at `place(i, j)`."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        m, a = (cgutils.unpack_tuple(builder, each) for each in args)
        numbers = []
        for i in range(rows):
            for k in range(columns):
                terms = [
                    builder.fmul(m[place(i, j)], a[j * columns + k], flags=_FLAGS)
                    for j in range(inner)
                ]
                total = terms[0]
                for term in terms[1:]:
                    total = builder.fadd(total, term, flags=_FLAGS)
                numbers.append(total)
        return context.make_tuple(builder, signature.return_type, numbers)

    return generate


@intrinsic
def matrix_applied(typingctx: Any, m: types.Type, a: types.Type) -> Any:
    """Return `M a` of a square matrix, row by row."""
    d = len(a)
    return types.UniTuple(types.float64, d)(m, a), _products(
        d, d, 1, lambda i, j: i * d + j
    )


@intrinsic
def matrix_applied_back(typingctx: Any, m: types.Type, a: types.Type) -> Any:
    """Return `M' a` of a square matrix, row by row."""
    d = len(a)
    return types.UniTuple(types.float64, d)(m, a), _products(
        d, d, 1, lambda i, j: j * d + i
    )


@intrinsic
def matrix_product(typingctx: Any, m: types.Type, a: types.Type) -> Any:
    """Return `M A` of square matrices, row by row."""
    d = math.isqrt(len(m))
    return types.UniTuple(types.float64, d * d)(m, a), _products(
        d, d, d, lambda i, j: i * d + j
    )


@kernel
def square(a: Vector) -> float:
    """Return `a . a`."""
    return dot(a, a)


@kernel
def norm(a: Vector) -> float:
    """Return `|a|`."""
    return math.sqrt(dot(a, a))


@kernel
def three(row: Doubles) -> Vector:
    """Return the first three numbers of a row."""
    return row[0], row[1], row[2]


@kernel
def put(row: Doubles, a: Vector) -> None:
    """Write a vector to the beginning of a row."""
    row[0], row[1], row[2] = a


@kernel
def add(row: np.ndarray, a: Vector) -> None:
    """Add a vector to the beginning of a row."""
    row[0], row[1], row[2] = row[0] + a[0], row[1] + a[1], row[2] + a[2]


@kernel
def put_all(row: Doubles, numbers: Vector) -> None:
    """Write a tuple of any length to the beginning of a row."""
    for i in range(len(numbers)):
        row[i] = numbers[i]


@kernel
def copy(source: Any, target: Any, count: int) -> None:
    """Write the first numbers of one row to another."""
    for i in range(count):
        target[i] = source[i]


@kernel
def clear(target: Any, count: int) -> None:
    """Write zeros to the first numbers of a row."""
    for i in range(count):
        target[i] = 0.0


@kernel
def applied_back(m: Any, a: Any) -> Vector:
    """Return `M' a`."""
    return (
        m[0] * a[0] + m[3] * a[1] + m[6] * a[2],
        m[1] * a[0] + m[4] * a[1] + m[7] * a[2],
        m[2] * a[0] + m[5] * a[1] + m[8] * a[2],
    )
