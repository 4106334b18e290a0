"""Checks of user input, used at construction: each names the parameter, the rule and the value.

What counts as a number is decided in one place, `why_not_numeric`: plain real numbers and arrays of them. Texts, truth
values,
complex numbers, dates and times, masked entries and tensors with a gradient are refused, never converted. The same for
what states a unit (Pint, Astropy, a DataArray with `attrs["units"]`) other than plain SI, as "m/s" or "N m": nothing is
rescaled, so that 20 mm cannot become 20 m.
"""

from __future__ import annotations

import difflib
import math
import os
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction.errors import InvalidValueError, shown
from planarfriction.formulas import LARGEST

LONGEST = 1e24
"""Largest length of a patch [m]: its area is a number in range."""

SMALLEST = 1e-50
"""Smallest of the numbers that must be > 0: products of six stay above zero."""

SI_UNITS = frozenset({"m", "s", "kg", "N", "rad", "Pa", "J", "W", "Hz"})
"""Units without prefix or factor: numbers in them and in their products are numbers in SI."""

MOST_NUMBERS = 30_000_000
"""Numbers of an array that is copied: 240 MB. A view of one number may be of any size."""

MOST_DRAWS = MOST_NUMBERS // 10
"""Largest number of draws of a set of parameters."""

_MOST_AXES = 32
"""Axes that arrays of all front ends may have."""

LONGEST_NAME = 100
"""Characters of a name."""

DEEPEST = 16
"""Axes of an array, and levels of lists in lists that one may be given as; NumPy broadcasts no more than 32."""

_FLOAT = np.dtype(float)
_FINITE = np.finfo(float).max
_PLAIN = frozenset({float, int, np.float64, np.float32, np.int64, np.int32})
_OF_KIND = {
    "b": " and no truth value",
    "c": " and not complex",
    "m": " and no time with a separate unit (give seconds)",
    "M": " and no date (give seconds)",
}


def why_not_numeric(value: Any, depth: int = 0) -> str | None:
    """Return what is wrong with `value` as a number or an array of numbers ("be a number" + ...), or None."""
    if type(value) in _PLAIN:
        return None
    if isinstance(value, (list, tuple)):
        return _refusal_inside(value, depth)
    if isinstance(value, (np.ndarray, np.generic)):
        if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
            return " and not masked"
        if value.ndim > DEEPEST:
            return f" along at most {DEEPEST} axes"
        return None if value.dtype.kind in "fiu" else _OF_KIND.get(value.dtype.kind, "")
    if isinstance(value, (bool, complex)):
        return _OF_KIND["b" if isinstance(value, bool) else "c"]
    if isinstance(value, (str, bytes, bytearray, Mapping)):
        return ""
    if _states_a_unit(value):
        return f" in SI units ({shown(str(_unit(value)))} is none that is taken: convert, then pass plain numbers)"
    if getattr(value, "requires_grad", False) is True:
        return " without a gradient (detach the tensor)"
    if isinstance(value, Sequence):
        return _refusal_inside(value, depth)
    if hasattr(value, "__array__"):
        try:
            found = np.asarray(value)
        except Exception:  # tensors on a device, tracers: the reasons are theirs
            return ""
        return why_not_numeric(found)
    return (
        None
        if hasattr(type(value), "__float__") or hasattr(type(value), "__index__")
        else ""
    )


def _refusal_inside(values: Sequence[Any], depth: int) -> str | None:
    """Return the first refusal of its items."""
    if depth == DEEPEST:
        return f" in lists at most {DEEPEST} deep"
    if _PLAIN.issuperset(map(type, values)):
        return None
    return next(
        (
            reason
            for each in values
            if (reason := why_not_numeric(each, depth + 1)) is not None
        ),
        None,
    )


def _unit(value: Any) -> Any:
    """Return the unit that a quantity, a DataArray or a variable of a file states, or None."""
    for name in ("units", "unit"):
        if (stated := getattr(value, name, None)) is not None and not callable(stated):
            return stated
    attributes = getattr(value, "attrs", None)
    return attributes.get("units") if isinstance(attributes, Mapping) else None


def _states_a_unit(value: Any) -> bool:
    """Return True if it states a unit that is not plain SI, given as text."""
    unit = _unit(value)
    if unit is None:
        return False
    return (
        not isinstance(unit, str)
        or not set(re.findall(r"[^\W\d_]+|[%°]", unit)) <= SI_UNITS
    )


def numbers(name: str, value: Any) -> np.ndarray:
    """Return `value` as a float array of any shape (no copy where it is one), or raise."""
    if type(value) is np.ndarray and value.dtype == _FLOAT and value.ndim <= DEEPEST:
        return value
    if type(value) is float:
        return np.array(value)
    reason = why_not_numeric(value)
    if reason is not None:
        raise InvalidValueError(name, f"be an array of numbers{reason}", quoted(value))
    _check_size(name, value)
    # Rows of different lengths; what an __array__ or __float__ raises.
    try:
        return np.asarray(value, dtype=float)
    except OverflowError:
        raise InvalidValueError(name, "be finite", value) from None
    except Exception:
        raise InvalidValueError(
            name, "be an array of numbers, with rows of equal length", value
        ) from None


def _check_size(name: str, value: Any) -> None:
    """Raise, before memory is asked for, where an array is too large to be copied."""
    if isinstance(value, np.ndarray) and value.size > MOST_NUMBERS:
        raise InvalidValueError(
            name, f"hold at most {MOST_NUMBERS} numbers", f"shape {list(value.shape)}"
        )


def number(name: str, value: Any) -> float:
    """Return `value` as a finite float, or raise."""
    if type(value) is not float:
        value = _scalar(name, value)
    if not -LARGEST <= value <= LARGEST:
        rule = (
            f"be at most {LARGEST:g} in size" if math.isfinite(value) else "be finite"
        )
        raise InvalidValueError(name, rule, value)
    return value


def _scalar(name: str, value: Any) -> float:
    """Return `value` as a float, where it is one number of any kind."""
    reason = why_not_numeric(value)
    if reason is None and getattr(value, "ndim", isinstance(value, Sequence)) == 0:
        try:
            return float(value)
        except OverflowError:
            raise InvalidValueError(name, "be finite", value) from None
        except Exception:  # what a __float__ raises
            reason = None
    raise InvalidValueError(name, f"be a number{reason or ''}", quoted(value))


def number_in(name: str, value: str) -> float:
    """Return the finite number that a text spells, as on a command line, or raise."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise InvalidValueError(name, "be a number", value) from None
    return number(name, result)


def quoted(value: Any) -> Any:
    """Return `value` for a message, with texts in quotes: "0.02" is no number."""
    return repr(value[:200]) if isinstance(value, str) else value


def positive(name: str, value: Any) -> float:
    """Return `value` as a finite float > 0, or raise."""
    result = number(name, value)
    if result < SMALLEST:
        raise InvalidValueError(
            name, "be > 0" if result <= 0.0 else f"be at least {SMALLEST:g}", result
        )
    return result


def length(name: str, value: Any) -> float:
    """Return `value` [m] as a float > 0 whose square is a number in range, or raise."""
    result = positive(name, value)
    if result > LONGEST:
        raise InvalidValueError(name, f"be at most {LONGEST:g}", result)
    return result


def positive_load(name: str, value: Any) -> float:
    """Return `value` as a finite float > 0, however small: loads fade out."""
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


def count(name: str, value: Any, at_least: int = 1, at_most: int = 2**63 - 1) -> int:
    """Return `value` as an integer from `at_least` to `at_most`, or raise.

    A limit stands where memory or time would go beyond all use: it is stated before any is asked for.
    """
    result = value if type(value) is int else number(name, value)
    if result < at_least or result != int(result):
        raise InvalidValueError(name, f"be an integer >= {at_least}", value)
    if result > at_most:
        raise InvalidValueError(name, f"be at most {at_most}", value)
    return int(result)


def batched(batch: Any, inner: tuple[int, ...]) -> tuple[int, ...]:
    """Return a shape with batch axes, an integer or a sequence of them, before those of `inner`, or raise."""
    lengths = batch if isinstance(batch, (tuple, list)) else (batch,)
    shape = *(count("batch", length, 0) for length in lengths), *inner
    if len(shape) > _MOST_AXES or math.prod(shape) > MOST_NUMBERS:
        rule = f"give at most {_MOST_AXES} axes and {MOST_NUMBERS} numbers"
        raise InvalidValueError("batch", rule, f"shape {list(shape)}")
    return shape


def vector(name: str, value: Any, size: int) -> np.ndarray:
    """Return `value` as a finite float array of shape `[size]`, or raise."""
    return array(name, value, (size,))


def vectors(name: str, value: Any, size: int) -> np.ndarray:
    """Return `value` as a float array `[..., size]` (no copy where it is one), or raise."""
    result = numbers(name, value)
    if result.shape[-1:] != (size,):
        raise InvalidValueError(
            name, f"have shape [..., {size}]", f"shape {list(result.shape)}"
        )
    return result


def finite_numbers(name: str, value: Any, *, largest: float = LARGEST) -> np.ndarray:
    """Return `value` as a finite float array of any shape (no copy where it is one), no number beyond `largest`."""
    result = numbers(name, value)
    _check_size(name, result)
    _check_finite(name, result, largest)
    return result


def within_range(name: str, low: Any, high: Any) -> None:
    """Raise unless the smallest and the largest of some numbers are within `LARGEST`; NaN spreads to both."""
    if not (low >= -LARGEST and high <= LARGEST):
        worst = float(high if low >= -LARGEST else low)
        beyond = f"be between {-LARGEST:g} and {LARGEST:g}"
        raise InvalidValueError(
            name, beyond if math.isfinite(worst) else "be finite", worst
        )


def non_negative_numbers(name: str, value: Any) -> np.ndarray:
    """Return `value` as a finite float array >= 0 of any shape, or raise."""
    result = numbers(name, value)
    _check_size(name, result)
    if not ((result >= 0.0) & (result <= LARGEST)).all():
        large = ((result >= 0.0) & (result < np.inf)).all()
        rule = f"be at most {LARGEST:g}" if large else "be finite and >= 0"
        raise InvalidValueError(name, rule, value)
    return result


def array(
    name: str, value: Any, shape: tuple[int | None, ...], *, largest: float = LARGEST
) -> np.ndarray:
    """Return `value` as a new finite float array, no number beyond `largest`; None in `shape` takes any length."""
    result = numbers(name, value)
    fits = (
        wanted in (None, length)
        for wanted, length in zip(shape, result.shape, strict=False)
    )
    if result.ndim != len(shape) or not all(fits):
        wanted = "[" + ", ".join("any" if n is None else str(n) for n in shape) + "]"
        raise InvalidValueError(
            name, f"have shape {wanted}", f"shape {list(result.shape)}"
        )
    _check_size(name, result)
    result = result.copy()
    _check_finite(name, result, largest)
    return result


def filled(name: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return finite numbers of that shape from an array that broadcasts to it, or raise."""
    result = numbers(name, value)
    try:
        return array(name, np.broadcast_to(result, shape), shape)
    except ValueError as error:
        if isinstance(error, InvalidValueError):
            raise
        raise InvalidValueError(
            name, f"have shape {list(shape)}", f"shape {list(result.shape)}"
        ) from None


def positive_array(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return `value` as an array of that shape of numbers > 0."""
    result = array(name, value, shape)
    if not (result > 0.0).all():
        raise InvalidValueError(
            name, "be > 0", f"{result.min()} at index {result.argmin()}"
        )
    return result


def non_negative_array(
    name: str, value: Any, shape: tuple[int | None, ...], *, largest: float = LARGEST
) -> np.ndarray:
    """Return `value` as a new finite float array >= 0, as `array` does."""
    result = array(name, value, shape, largest=largest)
    _check_each(name, result, result >= 0.0, "be >= 0")
    return result


def _check_finite(name: str, values: np.ndarray, largest: float) -> None:
    limit = min(largest, LARGEST)
    # the sum of squares, which is found faster, bounds them all
    if not np.vdot(values, values) <= limit * limit and not np.abs(values).max(
        initial=0.0
    ) <= min(largest, _FINITE):
        _check_each(name, values, np.isfinite(values), "be finite")
        _check_each(
            name, values, np.abs(values) <= largest, f"be at most {largest:g} in size"
        )


def _check_each(name: str, values: np.ndarray, good: np.ndarray, rule: str) -> None:
    if not good.all():
        where = tuple(
            int(i) for i in np.unravel_index(int(np.argmin(good)), good.shape)
        )
        raise InvalidValueError(
            name, rule, f"{values[where]} at index {where}" if where else float(values)
        )


def instance(name: str, value: Any, kind: type | tuple[type, ...], what: str) -> Any:
    """Return `value` if it is one of the kind, which messages call `what` ("a ContactPatch"), or raise."""
    if not isinstance(value, kind):
        raise InvalidValueError(name, f"be {what}", quoted(value))
    return value


def text(name: str, value: Any) -> str:
    """Return `value` if it is a text that can be a name: printable, not empty, not long, no spaces at its ends."""
    if not (
        isinstance(value, str)
        and value.isprintable()
        and value.strip() == value
        and value
    ):
        rule = (
            "be a text that is not empty, is printable, and has no spaces at its ends"
        )
        raise InvalidValueError(name, rule, quoted(value))
    if len(value) > LONGEST_NAME:
        raise InvalidValueError(
            name, f"have at most {LONGEST_NAME} characters", f"{len(value)}"
        )
    return value


def path(name: str, value: Any) -> Path:
    """Return `value` as a path, or raise."""
    if not isinstance(value, (str, os.PathLike)) or isinstance(os.fspath(value), bytes):
        raise InvalidValueError(name, "be a path: a text or a pathlib.Path", value)
    return Path(value)  # pyright: ignore[reportArgumentType]


def hint(value: Any, valid: Iterable[str]) -> str:
    """Return " (did you mean 'x'?)" with the one of `valid` that is nearest to a text, or nothing."""
    near = (
        difflib.get_close_matches(value[:200], valid, n=1)
        if isinstance(value, str)
        else []
    )
    return f" (did you mean {near[0]!r}?)" if near else ""


def choice(name: str, value: Any, valid: Iterable[str]) -> str:
    """Return `value` if it is one of `valid`, or raise an error that names the nearest valid one."""
    valid = list(valid)
    if isinstance(value, str) and value in valid:
        return value
    near = hint(value, valid)
    raise InvalidValueError(
        name,
        f"be one of {', '.join(valid)}",
        f"{value!r}{near}" if near else quoted(value),
    )


def choices(name: str, value: Any, valid: Iterable[str]) -> list[str]:
    """Return `value` as a list if it is a list or another sequence of `valid` ones, or raise."""
    valid = list(valid)
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InvalidValueError(name, f"be a list of {', '.join(valid)}", quoted(value))
    return [choice(name, each, valid) for each in value]


def keys(
    name: str, data: Any, required: Iterable[str], optional: Iterable[str] = ()
) -> None:
    """Raise unless `data` is a mapping with all `required` keys and, beyond them, only `optional` ones."""
    required = list(required)
    if not isinstance(data, Mapping):
        raise InvalidValueError(name, "be a table of keys and values", data)
    for key in data:
        choice(f"{name} key", key, dict.fromkeys([*required, *optional]))
    for key in required:
        if key not in data:
            raise InvalidValueError(
                name, f"have the key {key!r}", f"{', '.join(map(str, data)) or 'none'}"
            )


def broadcast(**arrays: np.ndarray) -> tuple[int, ...]:
    """Return the common shape of `arrays`, or raise an error that names them and their shapes."""
    return common_shape(" and ".join(arrays), [each.shape for each in arrays.values()])


def common_shape(
    name: str, shapes: Collection[tuple[int, ...]], rule: str = "broadcast"
) -> tuple[int, ...]:
    """Return the shape to which all `shapes` broadcast."""
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise InvalidValueError(
            name, rule, f"shapes {', '.join(str(list(each)) for each in shapes)}"
        ) from None
