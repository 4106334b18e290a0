"""Python twins of compiled functions, which take symbols (see `trace`).

A twin has the code of its function and sees other globals: twins for compiled functions, functions of symbols for those
of `math`, and tuples for the vectors that compiled code has intrinsics for.
"""

from __future__ import annotations

import dis
import functools
import math
from collections.abc import Callable
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from planarfriction.compiler import compiled_math, memory
from planarfriction.kernels import published_contact, vectors
from planarfriction.kernels.trace import CompiledMathematics, Mathematics, Number, Table, flat


def _plus(a: Any, c: Any, b: Any) -> Any:
    return _like(a, [x + c * y for x, y in zip(a, b, strict=True)])


def _like(a: Any, numbers: list) -> Any:
    """Return a tuple of numbers, a record if `a` is one."""
    return type(a)(*numbers) if hasattr(a, "_fields") else tuple(numbers)


def _dot(a: Any, b: Any) -> Any:
    return functools.reduce(lambda total, pair: total + pair[0] * pair[1], zip(a, b, strict=True), 0.0)


class _At:
    """View of a list from a place on, as a pointer would be."""

    def __init__(self, row: Any, first: int) -> None:
        self._row, self._first = row, first

    def __getitem__(self, i: int) -> Any:
        return self._row[self._first + i]

    def __setitem__(self, i: int, value: Any) -> None:
        self._row[self._first + i] = value


def _put(row: Any, numbers: tuple) -> None:
    for i, number in enumerate(numbers):
        row[i] = number


def _rounded(x: Any) -> tuple[Any, Any]:
    """Return what `compiled_math.rounded` does, in a form that compilers may reorder."""
    k = CompiledMathematics.floor(x + 0.5)
    return k, CompiledMathematics.of_bits((CompiledMathematics.wide(k) + 1023) << 52)


def _placed(a: Any, i: int, x: Any) -> tuple:
    return tuple(x if j == i else 0.0 for j in range(len(a)))


_TWINS: dict[int, Any] = {
    id(own): twin
    for own, twin in (
        (compiled_math, CompiledMathematics),
        (compiled_math.minimum, Mathematics.minimum),
        (compiled_math.maximum, Mathematics.maximum),
        (compiled_math.rounded, _rounded),
        (math, Mathematics),
        (np, Mathematics),
        (vectors.dot, _dot),
        (vectors.times, lambda c, a: _like(a, [c * x for x in a])),
        (vectors.plus, _plus),
        (vectors.zeros, lambda a: tuple(0.0 for _ in a)),
        (vectors.placed, _placed),
        (vectors.put, _put),
        (vectors.put_all, _put),
        (memory.at, _At),
        (published_contact.read, lambda record: record),
    )
}
"""Twins by the `id` of what they stand for; those of functions are added as they are made."""

_BUILT_IN = {"int": Mathematics.integer, "float": Mathematics.real}


class _Module:
    """A module whose functions are twins."""

    def __init__(self, own: ModuleType) -> None:
        self._own = own

    def __getattr__(self, name: str) -> Any:
        return twin(getattr(self._own, name))


def twin(own: Any) -> Any:
    """Return the twin of a function, a module or a record of functions; anything else is its own twin."""
    if id(own) in _TWINS:
        return _TWINS[id(own)]
    if isinstance(own, ModuleType):
        return _Module(own)
    if isinstance(own, tuple):
        return _like(own, [twin(each) for each in own])
    function = getattr(own, "py_func", own)
    if not isinstance(function, FunctionType):
        return own
    space: dict[str, Any] = {"__builtins__": function.__globals__.get("__builtins__"), **_BUILT_IN}
    cells = [CellType() for _ in function.__closure__ or ()]
    made = FunctionType(function.__code__, space, function.__name__, function.__defaults__, tuple(cells))
    _TWINS[id(own)] = joined(made) if _has_jumps(function.__code__) else made
    _KEPT.append(own)
    for name in _global_names(function.__code__):
        if name in function.__globals__:
            space[name] = twin(function.__globals__[name])
    for cell, given in zip(cells, function.__closure__ or (), strict=True):
        cell.cell_contents = twin(given.cell_contents)
    return _TWINS[id(own)]


def joined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that joins the ways through it where it asks its symbols (see `Trace.call`)."""

    def call(*arguments: Any, **constants: Any) -> Any:
        symbol = next((each for each in flat(arguments) if isinstance(each, (Number, Table))), None)
        called = functools.partial(function, **constants) if constants else function
        return called(*arguments) if symbol is None else symbol.trace.call(called, arguments)

    return call


def _has_jumps(code: CodeType) -> bool:
    return any(each.opcode in dis.hasjrel or each.opcode in dis.hasjabs for each in dis.get_instructions(code))


_KEPT: list[Any] = []
"""Functions that have twins: their `id` stays theirs."""


def _global_names(code: CodeType) -> set[str]:
    """Return the names that code may look up, with those of the code inside it."""
    inner = [each for each in code.co_consts if isinstance(each, CodeType)]
    return set(code.co_names).union(*map(_global_names, inner))
