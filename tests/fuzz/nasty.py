"""Values that people, files and other libraries pass instead of a number, an array, a name or an object."""

from __future__ import annotations

import datetime
import decimal
import fractions
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st


class Tensor:
    """Refuses to become an array, as a torch tensor that records its derivatives does."""

    shape = (3,)
    ndim = 1
    dtype = "torch.float64"
    requires_grad = True

    def __array__(self, *arguments, **options):
        raise RuntimeError(
            "Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead."
        )

    def __float__(self):
        raise ValueError("only one element tensors can be converted to Python scalars")

    def __iter__(self):
        return iter([self])

    def __len__(self):
        return 3

    def __eq__(self, other):
        raise RuntimeError(
            "Boolean value of Tensor with more than one value is ambiguous"
        )

    __hash__ = object.__hash__


class Quantity:
    """A number with a unit, as of Pint: millimetres are no metres."""

    magnitude = 3.0
    units = "millimeter"
    dimensionality = "[length]"

    def __array__(self, *arguments, **options):
        return np.asarray(self.magnitude)

    def __float__(self):
        raise TypeError("cannot convert to float: not dimensionless")


class Ambiguous:
    """Compares to something that is neither true nor false, as a symbol or a data frame does."""

    def __eq__(self, other):
        return np.array([True, False])

    def __bool__(self):
        raise ValueError("the truth value is ambiguous")

    __hash__ = object.__hash__


class Talkative:
    """Has a representation that is no line of text."""

    def __repr__(self):
        return "line\n" * 5000


def _self_containing() -> list:
    result: list = [1.0]
    result.append(result)
    return result


def _read_only(values: np.ndarray) -> np.ndarray:
    values.setflags(write=False)
    return values


WRONG: dict[str, Callable[[], Any]] = {
    "text": lambda: "soft",
    "text of a number": lambda: "123",
    "text nan": lambda: "nan",
    "empty text": lambda: "",
    "long text": lambda: "long " * 3000,
    "odd text": lambda: "φ\0\ud800\n\x1b[31m",
    "bytes": lambda: b"123",
    "bytearray": lambda: bytearray(b"\x00" * 24),
    "complex": lambda: 1.0 + 2.0j,
    "complex of NumPy": lambda: np.complex128(1.0 + 2.0j),
    "complex array": lambda: np.array([1.0 + 2.0j, 2.0, 3.0]),
    "timedelta": lambda: datetime.timedelta(seconds=1),
    "date": lambda: datetime.date(2024, 1, 1),
    "timedelta64": lambda: np.timedelta64(1, "s"),
    "timedelta64 array": lambda: np.array([0, 1, 2], dtype="timedelta64[ms]"),
    "datetime64": lambda: np.datetime64("2024-01-01"),
    "datetime64 array": lambda: np.array(
        ["2024-01-01", "2024-01-02", "2024-01-03"], dtype="datetime64[D]"
    ),
    "masked": lambda: np.ma.masked_array([1.0, 2.0, 3.0], mask=[False, True, False]),
    "masked scalar": lambda: np.ma.masked,
    "ragged": lambda: [[1.0], [2.0, 3.0]],
    "list of texts": lambda: ["1", "2", "3"],
    "array of texts": lambda: np.array(["1", "2", "3"]),
    "array of objects": lambda: np.array([1.0, None, "x"], dtype=object),
    "structured array": lambda: np.zeros(3, dtype=[("x", float), ("y", float)]),
    "dict": lambda: {"x": 1.0},
    "empty dict": dict,
    "set": lambda: {1.0, 2.0},
    "generator": lambda: (float(i) for i in range(3)),
    "iterator": lambda: iter([1.0, 2.0, 3.0]),
    "class": lambda: dict,
    "class of numbers": lambda: float,
    "function": lambda: math.sin,
    "lambda": lambda: lambda *arguments: 1.0,
    "module": lambda: math,
    "object": object,
    "ellipsis": lambda: ...,
    "not implemented": lambda: NotImplemented,
    "exception": lambda: ValueError("x"),
    "slice": lambda: slice(3),
    "path": lambda: Path("nowhere") / "at all",
    "tensor": Tensor,
    "quantity": Quantity,
    "ambiguous": Ambiguous,
    "talkative": Talkative,
    "list of itself": _self_containing,
}
"""Never a number nor an array of numbers: whatever wants one refuses these."""

ODD: dict[str, Callable[[], Any]] = {
    "none": lambda: None,
    "nan": lambda: math.nan,
    "inf": lambda: math.inf,
    "-inf": lambda: -math.inf,
    "zero": lambda: 0.0,
    "minus zero": lambda: -0.0,
    "int zero": lambda: 0,
    "one": lambda: 1.0,
    "int one": lambda: 1,
    "minus one": lambda: -1.0,
    "int minus one": lambda: -1,
    "1.5": lambda: 1.5,
    "1e300": lambda: 1e300,
    "-1e300": lambda: -1e300,
    "1e200": lambda: 1e200,
    "1e160": lambda: 1e160,
    "1e100": lambda: 1e100,
    "1e9": lambda: 1e9,
    "int 1e9": lambda: 10**9,
    "int 1e5": lambda: 10**5,
    "1e-9": lambda: 1e-9,
    "1e-100": lambda: 1e-100,
    "1e-160": lambda: 1e-160,
    "1e-300": lambda: 1e-300,
    "denormal": lambda: 5e-324,
    "largest": lambda: 1.7976931348623157e308,
    "int 2**63": lambda: 2**63,
    "10**400": lambda: 10**400,
    "-10**400": lambda: -(10**400),
    "10**5000": lambda: 10**5000,
    "true": lambda: True,
    "false": lambda: False,
    "numpy true": lambda: np.True_,
    "decimal": lambda: decimal.Decimal("0.5"),
    "fraction": lambda: fractions.Fraction(1, 3),
    "float16": lambda: np.float16(0.5),
    "float32": lambda: np.float32(0.5),
    "longdouble": lambda: np.longdouble(0.5),
    "int8": lambda: np.int8(3),
    "uint64": lambda: np.uint64(2**64 - 1),
    "0-d array": lambda: np.array(0.5),
    "1-d array of one": lambda: np.array([0.5]),
    "empty list": list,
    "empty tuple": tuple,
    "empty array": lambda: np.empty(0),
    "empty rows": lambda: np.empty((0, 3)),
    "rows of nothing": lambda: np.empty((3, 0)),
    "list": lambda: [0.5, 0.5, 0.5],
    "pair": lambda: (0.5, 0.5),
    "list of nan": lambda: [math.nan, 1.0, 2.0],
    "pair of nan": lambda: (math.nan, 1.0),
    "list of huge": lambda: [1e300, 1e300, 1e300],
    "pair of huge": lambda: (1e200, 1e200),
    "pair of tiny": lambda: (1e-200, 1e-200),
    "list of negative": lambda: [-1.0, -1.0, -1.0],
    "list of 10**400": lambda: [10**400, 1, 2],
    "list of none": lambda: [None, None, None],
    "list of true": lambda: [True, False, True],
    "nested": lambda: [[[0.5]]],
    "deeply nested": lambda: eval("[" * 40 + "]" * 40),
    "range": lambda: range(3),
    "float16 array": lambda: np.array([0.5, 0.5, 0.5], np.float16),
    "float32 array": lambda: np.array([0.5, 0.5, 0.5], np.float32),
    "big-endian array": lambda: np.array([0.5, 0.5, 0.5], ">f8"),
    "integer array": lambda: np.array([1, 2, 3]),
    "boolean array": lambda: np.array([True, False, True]),
    "strided array": lambda: np.linspace(0.1, 0.9, 6)[::2],
    "reversed array": lambda: np.linspace(0.1, 0.9, 3)[::-1],
    "read-only array": lambda: _read_only(np.linspace(0.1, 0.9, 3)),
    "transposed matrix": lambda: np.linspace(0.1, 0.9, 9).reshape(3, 3).T,
    "unmasked": lambda: np.ma.masked_array([0.1, 0.2, 0.3]),
    "repeated times": lambda: np.zeros(20),
    "rows": lambda: np.linspace(0.1, 0.9, 60).reshape(20, 3),
    "pairs": lambda: np.linspace(0.1, 0.9, 40).reshape(20, 2),
    "equal pairs": lambda: np.ones((5, 2)),
    "many": lambda: np.broadcast_to(1.0, (2000,)),
    "many rows": lambda: np.broadcast_to(1.0, (2000, 3)),
    "many pairs": lambda: np.broadcast_to(1.0, (2000, 2)),
    "huge map": lambda: np.broadcast_to(1.0, (10**5, 10**5)),
    "many axes": lambda: np.ones((1,) * 32),
    "alien name": lambda: "x",
    "list of an alien name": lambda: ["mu"],
}
"""Some of these are right in some places; where they are, what comes of them works."""

NASTY = {**WRONG, **ODD}

_NUMBERS = (
    st.floats()
    | st.integers()
    | st.floats(1e-12, 1e12)
    | st.sampled_from([0.0, -0.0, 5e-324, 1e308, math.nan])
)
_SIMPLE = (
    _NUMBERS | st.text(max_size=20) | st.none() | st.booleans() | st.complex_numbers()
)
_NESTED = st.recursive(
    _SIMPLE,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=8,
)
_ARRAYS = st.builds(
    lambda shape, value, kind: np.full(shape, value).astype(kind),
    st.lists(st.integers(0, 4), max_size=3).map(tuple),
    st.floats(-100.0, 100.0),
    st.sampled_from(["f8", "f4", "f2", ">f8", "i4", "?", "O", "c16", "m8[s]", "U5"]),
)


def nasty() -> st.SearchStrategy[tuple[str, Callable[[], Any]]]:
    """Its name, and how to make it again (a generator can be used once)."""
    listed = st.sampled_from(sorted(NASTY.items()))
    drawn = (_NUMBERS | _NESTED | _ARRAYS).map(
        lambda value: (f"{type(value).__name__} {value!r:.60}", lambda: value)
    )
    return st.one_of(listed, listed, drawn)
