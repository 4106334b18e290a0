"""Checks of user input, used at construction: each names the parameter, the rule and the value."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from planarfriction.errors import InvalidValueError


def number(name: str, value: Any) -> float:
    """Return `value` as a finite float, or raise."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise InvalidValueError(name, "be a number", value) from None
    if not math.isfinite(result):
        raise InvalidValueError(name, "be finite", result)
    return result


def positive(name: str, value: Any) -> float:
    """Return `value` as a finite float > 0, or raise."""
    result = number(name, value)
    if result <= 0.0:
        raise InvalidValueError(name, "be > 0", result)
    return result


def non_negative(name: str, value: Any) -> float:
    """Return `value` as a finite float >= 0, or raise."""
    result = number(name, value)
    if result < 0.0:
        raise InvalidValueError(name, "be >= 0", result)
    return result


def count(name: str, value: Any, at_least: int = 1) -> int:
    """Return `value` as an integer >= `at_least`, or raise."""
    if isinstance(value, bool) or number(name, value) != int(value) or value < at_least:
        raise InvalidValueError(name, f"be an integer >= {at_least}", value)
    return int(value)


def vector(name: str, value: Any, size: int) -> np.ndarray:
    """Return `value` as a finite float array of shape `[size]`, or raise."""
    return array(name, value, (size,))


def numbers(name: str, value: Any) -> np.ndarray:
    """Return `value` as a float array of any shape (no copy where it is one), or raise."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InvalidValueError(name, "be an array of numbers", value) from None


def non_negative_numbers(name: str, value: Any) -> np.ndarray:
    """Return `value` as a finite float array >= 0 of any shape, or raise."""
    result = numbers(name, value)
    if not (np.isfinite(result).all() and (result >= 0.0).all()):
        raise InvalidValueError(name, "be finite and >= 0", value)
    return result


def array(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return `value` as a finite float array; None in `shape` accepts any length on that axis."""
    result = numbers(name, value).copy()
    matches = result.ndim == len(shape) and all(
        wanted in (None, length) for wanted, length in zip(shape, result.shape, strict=True)
    )
    if not matches:
        wanted = "[" + ", ".join("any" if n is None else str(n) for n in shape) + "]"
        raise InvalidValueError(name, f"have shape {wanted}", f"shape {list(result.shape)}")
    if not np.isfinite(result).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(result))[0])
        raise InvalidValueError(name, "be finite", f"{result[where]} at index {where}")
    return result


def non_negative_array(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return `value` as a finite float array >= 0; None in `shape` accepts any length on that axis."""
    result = array(name, value, shape)
    if (result < 0.0).any():
        where = tuple(int(i) for i in np.argwhere(result < 0.0)[0])
        raise InvalidValueError(name, "be >= 0", f"{result[where]} at index {where}")
    return result


def choice(name: str, value: Any, valid: Iterable[str]) -> str:
    """Return `value` if it is one of `valid`, or raise an error that names the nearest valid one."""
    valid = list(valid)
    if value in valid:
        return value
    near = difflib.get_close_matches(str(value), valid, n=1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    raise InvalidValueError(name, f"be one of {', '.join(valid)}", f"{value!r}{hint}")


def keys(name: str, data: Any, required: Iterable[str], optional: Iterable[str] = ()) -> None:
    """Raise unless `data` is a mapping with all `required` keys and, beyond them, only `optional` ones."""
    required = list(required)
    if not isinstance(data, Mapping):
        raise InvalidValueError(name, "be a table of keys and values", data)
    for key in data:
        choice(f"{name} key", key, dict.fromkeys([*required, *optional]))
    for key in required:
        if key not in data:
            raise InvalidValueError(name, f"have the key {key!r}", f"{', '.join(map(str, data)) or 'none'}")
