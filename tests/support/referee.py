"""Straight-line kernels and their derivatives in 60 digits: the referee of what compiled code finds in 16.

A kernel runs here as the Python function that it was written as, with `dot`, `xp` and the like exchanged for those of
mpmath. So it decides about derivatives whatever they were written with. At a kink it takes the side on which the exact
numbers lie.
"""

from __future__ import annotations

import math
import types
from collections.abc import Callable, Sequence
from typing import Any

import mpmath
from mpmath import mpf

from planarfriction.compiler import compiled_math
from planarfriction.kernels import vectors
from planarfriction.kernels.rules import per

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


def exact(function: Any) -> Callable:
    """Return the function that a kernel was compiled from, with the numbers and functions of mpmath."""
    if id(function) in _EXCHANGED or not hasattr(function, "py_func"):
        return _EXCHANGED.get(id(function), function)
    plain, names = function.py_func, {}
    _EXCHANGED[id(function)] = found = types.FunctionType(plain.__code__, names, plain.__name__)
    names.update((name, exact(value)) for name, value in plain.__globals__.items() if name in plain.__code__.co_names)
    return found


def derivative(function: Callable[[mpf], Sequence], x: float) -> list:
    """Return the derivative of each result of a function of one number, by central differences."""
    with mpmath.workdps(DIGITS):
        step = _STEP * (abs(mpf(x)) if x else mpf(1))
        after, before = function(mpf(x) + step), function(mpf(x) - step)
        return [(b - a) / (2 * step) for a, b in zip(before, after, strict=True)]
