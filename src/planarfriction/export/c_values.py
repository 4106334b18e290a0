"""Values in translated source: numbers, arrays and structs, by their expressions in C (see `loops`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np


class Scalar(NamedTuple):
    """A number in C."""

    text: str
    kind: str = "real"
    """"real" or "int"."""


class Fixed(NamedTuple):
    """A number that every function knows, so that none takes it as an argument."""

    value: float


class Array(NamedTuple):
    """An array in C, by the expression of its first number."""

    text: str
    shape: tuple[int, ...]
    kind: Any = "real"
    """"real", "int" or the dtype of structs."""
    fixed: bool = False
    """True for a table of the source, which no function takes as an argument."""


class CStruct(NamedTuple):
    """A struct in C, by the expression of its address."""

    text: str
    kind: np.dtype


LEAVES = Scalar, Fixed, Array, CStruct
"""Values that are not taken apart."""


def leaves(value: Any) -> Iterator[Any]:
    """Yield the numbers and arrays of nested records."""
    if isinstance(value, tuple) and not isinstance(value, LEAVES):
        for each in value:
            yield from leaves(each)
    else:
        yield value


def mapped(value: Any, change: Callable[[Any], Any]) -> Any:
    """Return nested records with their leaves changed, in order."""
    if isinstance(value, tuple) and not isinstance(value, LEAVES):
        items = [mapped(each, change) for each in value]
        return type(value)(*items) if hasattr(value, "_fields") else tuple(items)
    return change(value)


def kinds_of(value: Any) -> Any:
    """Return what tells functions of such arguments apart."""
    return tuple(
        each
        if isinstance(each, Fixed) or getattr(each, "fixed", False)
        else kind_of(each)
        for each in leaves(value)
    )


def kind_of(value: Any) -> Any:
    """Return the kind of a number, or of the numbers of an array, and the shape."""
    if isinstance(value, (Scalar, Array, CStruct)):
        return value.kind, getattr(value, "shape", None)
    return "real" if isinstance(plain(value), float) else "int", None


def plain(value: Any) -> Any:
    """Return the value of a fixed number."""
    return value.value if isinstance(value, Fixed) else value
