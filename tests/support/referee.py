"""Straight-line kernels and their derivatives in 60 digits: the referee of what compiled code finds in 16.

A kernel runs here as the Python function that it was written as, with `dot`, `xp` and the like exchanged for those of
mpmath. So it decides about derivatives whatever they were written with. At a kink it takes the side on which the exact
numbers lie.
"""

from __future__ import annotations

import inspect
import math
import types
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf
from numba import njit

from planarfriction._engine.codegen import vectors
from planarfriction._engine.codegen.derivatives import Derivative
from planarfriction._engine.codegen.ratios import per
from planarfriction._engine.compiler import compiled_math

DIGITS = 60
_STEP = mpf(10) ** -24
"""Relative step of the central differences: what they leave out is 1e-48 of the third derivative."""


def _where(condition: Any, a: Any, b: Any) -> Any:
    return a if condition else b


_NUMBERS = types.SimpleNamespace(
    exp=mpmath.exp, log=mpmath.log, sin=mpmath.sin, cos=mpmath.cos, expm1=mpmath.expm1, where=_where,
    power=lambda x, e: mpf(0) if x == 0 else mpmath.power(x, e),
    minimum=lambda a, b: a if a < b else b, maximum=lambda a, b: a if a > b else b,
)  # fmt: skip
"""The `xp` of mpmath."""


def _dot(a: Sequence, b: Sequence) -> Any:
    return sum((x * y for x, y in zip(a, b, strict=True)), mpf(0))


def _plus(a: Sequence, c: Any, b: Sequence) -> tuple:
    return tuple(x + c * y for x, y in zip(a, b, strict=True))


_EXCHANGED: dict[int, Any] = {
    id(math): mpmath,
    id(compiled_math): _NUMBERS,
    id(vectors.dot): _dot,
    id(vectors.plus): _plus,
    id(vectors.times): lambda c, a: tuple(c * x for x in a),
    id(vectors.norm): lambda a: mpmath.sqrt(_dot(a, a)),
    id(per): lambda x: 1 / x if x > 0 else mpf(0),
}


def exact(function: Any, exchanged: dict[Any, Callable] | None = None) -> Callable:
    """Return the function that a kernel was compiled from, with numbers of mpmath, and functions of it `exchanged`."""
    return _exact(
        function,
        {**_EXCHANGED, **{id(key): value for key, value in (exchanged or {}).items()}},
    )


def _exact(function: Any, known: dict[int, Any]) -> Callable:
    plain = getattr(function, "py_func", function)
    names = {}
    cells = [types.CellType() for _ in plain.__closure__ or ()]
    known[id(function)] = found = types.FunctionType(
        plain.__code__, names, plain.__name__, None, tuple(cells)
    )
    outer = dict(
        zip(
            plain.__code__.co_freevars,
            (each.cell_contents for each in plain.__closure__ or ()),
            strict=True,
        )
    )
    exchanged = _exchanged(outer, set(outer), known)
    for name, cell in zip(outer, cells, strict=True):
        cell.cell_contents = exchanged[name]
    used = set(plain.__code__.co_names)
    names.update(_exchanged(plain.__globals__, used, known))
    for name, value in names.items():
        if isinstance(value, types.ModuleType) and value.__name__.startswith(
            "planarfriction._engine"
        ):
            names[name] = types.SimpleNamespace(**_exchanged(vars(value), used, known))
    return found


def _exchanged(
    values: dict[str, Any], used: set[str], known: dict[int, Any]
) -> dict[str, Any]:
    """Return those of some named values that a function uses, with kernels in exact numbers."""
    found = {}
    for name in used & set(values):
        value = values[name]
        kernel = id(value) not in known and hasattr(value, "py_func")
        found[name] = _exact(value, known) if kernel else known.get(id(value), value)
    return found


def derivative(function: Callable[[mpf], Sequence], x: float) -> list:
    """Return the derivative of each result of a function of one number, by central differences."""
    with mpmath.workdps(DIGITS):
        step = _STEP * (abs(mpf(x)) if x else mpf(1))
        after = function(mpf(x) + step)
        before = function(mpf(x) - step)
        return [(b - a) / (2 * step) for a, b in zip(before, after, strict=True)]


@njit
def pulled(forth: Any, back: Any, arguments: tuple, bars: tuple) -> tuple:
    """Return the cotangents that `back` finds of some arguments."""
    _, tape = forth(*arguments)
    return back(tape, bars)


def flat(values: Any) -> list:
    """Return the numbers of nested tuples one behind the other."""
    return [
        x
        for each in values
        for x in (flat(each) if isinstance(each, tuple) else (each,))
    ]


def _units(results: tuple) -> Iterator[tuple]:
    """Yield the shape of some results with a 1 at each number in turn, zeros elsewhere."""
    kinds = [len(each) if isinstance(each, tuple) else 0 for each in results]
    for chosen, length in enumerate(kinds):
        for i in range(max(length, 1)):
            yield tuple(
                tuple(float(at == chosen and k == i) for k in range(n))
                if n
                else float(at == chosen)
                for at, n in enumerate(kinds)
            )


def _with(value: Any, path: str, i: int, x: Any) -> Any:
    """Return an argument with x in one place: a field of a record, component i of a vector, or itself."""
    if path:
        head, _, rest = path.partition(".")
        return value._replace(**{head: _with(getattr(value, head), rest, i, x)})
    return (
        tuple(x if k == i else each for k, each in enumerate(value))
        if isinstance(value, tuple)
        else x
    )


def jacobians(
    derivative_of: Derivative, arguments: tuple, function: Any = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return all results by all numbers of `by`, [results, numbers]: in compiled code, and in 60 digits.

    Each column is multiplied by the size of its number, or of the vector that it is a component of. `function`: another
    one than was derived, as the referee sees it.
    """
    function = exact(derivative_of.function) if function is None else function
    rows = [
        flat(pulled(derivative_of.forth, derivative_of.back, arguments, bars))
        for bars in _units(function(*arguments))
    ]
    names = list(inspect.signature(derivative_of.function).parameters)
    columns = []
    sizes = []
    for path in derivative_of.by:
        name, _, rest = path.partition(".")
        at = names.index(name)
        value = arguments[at]
        for field in filter(None, rest.split(".")):
            value = getattr(value, field)
        size = float(np.linalg.norm(value))
        for i, x in enumerate(value if isinstance(value, tuple) else (value,)):

            def change(x, at=at, rest=rest, i=i):
                return flat(
                    function(
                        *arguments[:at],
                        _with(arguments[at], rest, i, x),
                        *arguments[at + 1 :],
                    )
                )

            columns.append(derivative(change, x))
            sizes.append(size)
    return np.array(rows) * sizes, np.array(columns, float).T * sizes


def misfit(derivative_of: Derivative, arguments: tuple, function: Any = None) -> float:
    """Return the largest error of `jacobians`, each row in the largest of its numbers."""
    found, expected = jacobians(derivative_of, arguments, function)
    largest = np.abs(expected).max(axis=1, keepdims=True)
    return float(
        np.max(np.abs(found - expected) / np.where(largest > 0.0, largest, 1.0))
    )
