"""Values are equal where their parts are: `==` and `hash` of records with arrays in them, always a plain bool.

The `==` that Python makes for dataclasses and named tuples compares arrays as a whole and raises.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

_KindT = TypeVar("_KindT", bound=type)


class ByValue:
    """Base of frozen dataclasses (`eq=False`) that compare by type and content."""

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self is other or all(same(getattr(self, name), getattr(other, name)) for name in _compared(self))

    def __hash__(self) -> int:
        return hash((type(self), *(_key(getattr(self, name)) for name in _compared(self))))


def by_parts(kind: _KindT) -> _KindT:
    """Decorator of named tuples with arrays: they compare by content."""

    def equal(self: Any, other: object) -> bool:
        return type(self) is type(other) and _same_items(self, other)

    def differ(self: Any, other: object) -> bool:
        return not equal(self, other)

    for name, method in (("__eq__", equal), ("__ne__", differ), ("__hash__", None)):
        setattr(kind, name, method)
    return kind


def same(one: Any, other: Any) -> bool:
    """Whether two parts are equal: arrays by shape and numbers (NaN equals NaN), containers item by item."""
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
            return False
        return np.array_equal(one, other, equal_nan=one.dtype.kind in "fc" and other.dtype.kind in "fc")
    if isinstance(one, (tuple, list)) and isinstance(other, (tuple, list)):
        return _same_items(one, other)
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    try:
        equal = one == other
        return bool(equal.all() if hasattr(equal, "all") else equal)  # tensors and data frames
    except Exception:  # parts of a user's own: what cannot be compared is not equal
        return False


def _same_items(one: Any, other: Any) -> bool:
    return len(one) == len(other) and all(map(same, one, other))


def _compared(record: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(record) if field.compare]


def _key(part: Any) -> Any:
    """Something to hash that is the same for parts that are the same."""
    if isinstance(part, np.ndarray):
        return part.shape, (part + 0.0).tobytes() if part.dtype.kind == "f" else part.tobytes()  # + 0.0: -0.0 is 0.0
    if isinstance(part, (tuple, list)):
        return tuple(map(_key, part))
    try:
        hash(part)
    except TypeError:  # mappings and parts of a user's own: these do not tell records apart
        return None
    return part
