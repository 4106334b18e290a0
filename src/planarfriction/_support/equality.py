"""Records that contain arrays: `==` and `hash` by content, and a `repr` of one line.

The `==` of Python's own dataclasses and named tuples raises for arrays; their `repr` prints every number.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from planarfriction._support.described import described

_KindT = TypeVar("_KindT", bound=type)
_GivenT = TypeVar("_GivenT")
_KeptT = TypeVar("_KeptT")

_SHORT = 9
"""Numbers of an array, items of a sequence, that a `repr` shows."""


class Kept(Generic[_GivenT, _KeptT]):
    """Type of a field that is given as one type and kept, after its check, as another; only type checkers use it."""

    if TYPE_CHECKING:

        def __get__(self, record: object, kind: type) -> _KeptT: ...

        def __set__(self, record: object, value: _GivenT) -> None: ...


def checked(check: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Return a dataclass field that keeps `check(name, value, *arguments)`, such as `validation.positive`.

    `options` are those of `dataclasses.field`. A default of None is kept without a check.
    """
    return dataclasses.field(metadata={"check": (check, arguments)}, **options)


@functools.cache
def _checks(kind: Any) -> list[tuple[str, bool, Any]]:
    """Return the fields of a record that are checked, whether each may be None, and its check with arguments."""
    fields = [each for each in dataclasses.fields(kind) if "check" in each.metadata]
    return [
        (each.name, each.default is None, each.metadata["check"]) for each in fields
    ]


class Checked:
    """Base of frozen dataclasses, `described`, whose fields are checked when a record is made (see `checked`)."""

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if cls.__dict__.get("__doc__"):
            described(cls)

    def __post_init__(self) -> None:
        for name, optional, (check, arguments) in _checks(type(self)):
            value = getattr(self, name, None)
            if not (value is None and optional):
                object.__setattr__(self, name, check(name, value, *arguments))

    def _set(self, **values: Any) -> None:
        """Set fields of a record that is being made; later it is frozen."""
        for name, value in values.items():
            object.__setattr__(self, name, value)


class ByValue(Checked):
    """Base of frozen dataclasses (`eq=False`) that are compared by type and content and have a `repr` of one line."""

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        # Else the decorator `dataclass` writes one of its own.
        if "__repr__" not in cls.__dict__:
            cls.__repr__ = super(cls, cls).__repr__  # pyright: ignore[reportAttributeAccessIssue]

    def __repr__(self) -> str:
        shown = [field for field in dataclasses.fields(self) if field.repr]  # pyright: ignore[reportArgumentType]
        return _record(
            self, {field.name: getattr(self, field.name, None) for field in shown}
        )

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self is other or all(
            equal(getattr(self, name), getattr(other, name)) for name in _compared(self)
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields for a copy or another process in one step: another thread may be adding one meanwhile."""
        return dict(self.__dict__)

    def __hash__(self) -> int:
        return hash(
            (type(self), *(_key(getattr(self, name)) for name in _compared(self)))
        )


def by_parts(kind: _KindT) -> _KindT:
    """Decorate a named tuple with arrays: it is compared by content and has a `repr` of one line."""

    def content_equal(self: Any, other: object) -> bool:
        return type(self) is type(other) and _same_items(self, other)

    def differ(self: Any, other: object) -> bool:
        return not content_equal(self, other)

    def show(self: Any) -> str:
        return _record(self, self._asdict())

    for name, method in (
        ("__eq__", content_equal),
        ("__ne__", differ),
        ("__hash__", None),
        ("__repr__", show),
    ):
        setattr(kind, name, method)
    return described(kind)


def short_repr(value: Any) -> str:
    """Return a short text for `value`: long arrays by their shape, long sequences by their length."""
    if isinstance(value, np.ndarray):
        return (
            np.array2string(value, separator=", ")
            if value.size <= _SHORT and value.ndim < 2
            else _shape(value)
        )
    if isinstance(value, (tuple, list)) and type(value) in (tuple, list):
        if len(value) > _SHORT:
            return f"{type(value).__name__} of {len(value)}"
        items = ", ".join(map(short_repr, value))
        return (
            f"[{items}]"
            if isinstance(value, list)
            else f"({items}{',' if len(value) == 1 else ''})"
        )
    if isinstance(value, Mapping) and len(value) > _SHORT:
        return f"{type(value).__name__} of {len(value)}"
    return " ".join(repr(value).split())


def unusual(record: Any, but: tuple[str, ...] = ()) -> list[str]:
    """Return the arguments of a dataclass that are not as by default, as `name=value`; those in `but` are left out."""
    return [
        f"{field.name}={short_repr(getattr(record, field.name))}"
        for field in dataclasses.fields(record)
        if field.init
        and field.repr
        and field.name not in but
        and not equal(getattr(record, field.name), field.default)
    ]


def _record(record: Any, parts: Mapping[str, Any]) -> str:
    return f"{type(record).__name__}({', '.join(f'{name}={short_repr(part)}' for name, part in parts.items())})"


def _shape(array: np.ndarray) -> str:
    return f"array {list(array.shape)}"


def equal(one: Any, other: Any) -> bool:
    """Return True if two values are equal: arrays by shape and numbers (NaN equals NaN), containers item by item."""
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
            return False
        return np.array_equal(
            one, other, equal_nan=one.dtype.kind in "fc" and other.dtype.kind in "fc"
        )
    if isinstance(one, (tuple, list)) and isinstance(other, (tuple, list)):
        return _same_items(one, other)
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(
            equal(one[key], other[key]) for key in one
        )
    try:
        found = one == other
        # Tensors and data frames.
        return bool(found.all() if hasattr(found, "all") else found)
    except Exception:  # parts of a user's own: what cannot be compared is not equal
        return False


def _same_items(one: Any, other: Any) -> bool:
    return len(one) == len(other) and all(map(equal, one, other))


def _compared(record: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(record) if field.compare]


def _key(part: Any) -> Any:
    """Return something to hash that is the same for parts that are the same."""
    if isinstance(part, np.ndarray):
        return part.shape, (
            part + 0.0
        ).tobytes() if part.dtype.kind == "f" else part.tobytes()  # + 0.0: -0.0 is 0.0
    if isinstance(part, (tuple, list)):
        return tuple(map(_key, part))
    # Mappings and parts of a user's own: these do not tell records apart.
    try:
        hash(part)
    except TypeError:
        return None
    return part
