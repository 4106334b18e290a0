"""Python twins of compiled functions, which take symbols (see `trace`).

A twin has the code of its function and sees other globals: twins for compiled functions, functions of symbols for those
of `math`, and tuples for the vectors that compiled code has intrinsics for.
"""

from __future__ import annotations

import dis
import functools
import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from planarfriction._engine.codegen import vectors
from planarfriction._engine.codegen.rebinding import Rewriting, like
from planarfriction._engine.codegen.trace import (
    CompiledMathematics,
    Mathematics,
    Number,
    Table,
    flat,
)
from planarfriction._engine.compiler import compiled_math, memory


def _plus(a: Any, c: Any, b: Any) -> Any:
    return like(a, [x + c * y for x, y in zip(a, b, strict=True)])


def _dot(a: Any, b: Any) -> Any:
    return functools.reduce(
        lambda total, pair: total + pair[0] * pair[1], zip(a, b, strict=True), 0.0
    )


class _At:
    """View of a list from a place on, as a pointer would be."""

    def __init__(self, row: Any, first: int) -> None:
        self._row = row
        self._first = first

    def __getitem__(self, i: int) -> Any:
        return self._row[self._first + i]

    def __setitem__(self, i: int, value: Any) -> None:
        self._row[self._first + i] = value


def _put(row: Any, numbers: tuple) -> None:
    for i, number in enumerate(numbers):
        row[i] = number


def _rounded(x: Any) -> tuple[Any, Any]:
    """Compute `compiled_math.rounded` in a form that compilers may reorder."""
    k = CompiledMathematics.floor(x + 0.5)
    return k, CompiledMathematics.of_bits((CompiledMathematics.wide(k) + 1023) << 52)


def finished(function: FunctionType) -> Callable[..., Any]:
    """Let a twin with jumps join its ways."""
    jumps = {*dis.hasjrel, *dis.hasjabs}
    return (
        joined(function)
        if any(each.opcode in jumps for each in dis.get_instructions(function))
        else function
    )


def joined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that joins the ways through it where it asks its symbols (see `Trace.call`)."""

    def call(*arguments: Any, **constants: Any) -> Any:
        symbol = next(
            (each for each in flat(arguments) if isinstance(each, (Number, Table))),
            None,
        )
        called = functools.partial(function, **constants) if constants else function
        return (
            called(*arguments)
            if symbol is None
            else symbol.trace.call(called, arguments)
        )

    return call


SYMBOLS = (
    (compiled_math, CompiledMathematics),
    (compiled_math.minimum, Mathematics.minimum),
    (compiled_math.maximum, Mathematics.maximum),
    (compiled_math.rounded, _rounded),
    (math, Mathematics),
    (np, Mathematics),
    (vectors.dot, _dot),
    (vectors.times, lambda c, a: like(a, [c * x for x in a])),
    (vectors.plus, _plus),
    (vectors.zeros, lambda a: tuple(0.0 for _ in a)),
    (vectors.put, _put),
    (vectors.put_all, _put),
    (memory.at, _At),
)
"""Globals of compiled functions, each with its counterpart for symbols."""

NAMES = {"int": Mathematics.integer, "float": Mathematics.real}
"""Built-in functions that symbols have functions of their own for."""

twin = Rewriting(SYMBOLS, NAMES, finished)
"""Twin of a function, a module or a record of functions; anything else is its own twin."""
