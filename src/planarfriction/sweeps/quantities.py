"""Swept quantities with their values, and the grid of all their combinations."""

from __future__ import annotations

import inspect
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError, shown

MOST_RUNS = 100_000_000
"""Largest number of runs of a sweep."""


@dataclass(frozen=True)
class Grid:
    """Swept quantities by name, each with labels and the values behind them."""

    labels: dict[str, list[Any]]
    """Labels along each dimension: numbers, texts, booleans."""
    values: dict[str, list[Any]]
    """Values that `make_scene` receives."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each quantity."""
        return tuple(map(len, self.values.values()))

    @property
    def size(self) -> int:
        """Number of runs."""
        return math.prod(self.shape)

    def points(self) -> Iterator[tuple[tuple[int, ...], dict[str, Any]]]:
        """Yield the places in the grid, the last quantity fastest, each with its values by name."""
        for index in itertools.product(*map(range, self.shape)):
            yield index, {name: each[i] for (name, each), i in zip(self.values.items(), index, strict=True)}

    def words(self, index: tuple[int, ...]) -> str:
        """Describe a point in words: "mass=0.2, pad=disc"."""
        return ", ".join(f"{name}={shown(each[i])}" for (name, each), i in zip(self.labels.items(), index, strict=True))


def grid_of(values: Any) -> Grid:
    """Make the grid of a mapping from names to lists of scalars, or to mappings from labels to anything.

    Raises InvalidValueError for what is neither, for empty lists and for values that are there twice.
    """
    if not isinstance(values, Mapping) or not values:
        raise InvalidValueError("values", "be a mapping from names to lists of values, not empty", values)
    labels, behind = {}, {}
    for name, given in values.items():
        validation.text("name of a swept quantity in values", name)
        behind[name] = list(given.values()) if isinstance(given, Mapping) else _scalars(name, given)
        labels[name] = _scalars(name, list(given)) if isinstance(given, Mapping) else behind[name]
    result = Grid(labels, behind)
    if result.size > MOST_RUNS:
        raise InvalidValueError("values", f"make at most {MOST_RUNS} runs", result.size)
    return result


def _scalars(name: str, given: Any) -> list[Any]:
    """Return the values of a quantity as plain Python scalars, or raise InvalidValueError."""
    rule = "be a list of numbers, texts or booleans (for other values: a mapping from labels to values)"
    if isinstance(given, (str, bytes)) or not (isinstance(given, (Sequence, range)) or hasattr(given, "__array__")):
        raise InvalidValueError(name, rule, validation.quoted(given))
    if isinstance(given, (list, tuple)) and not _of_one_kind(given):
        raise InvalidValueError(name, rule, given)
    array = np.asarray(given)
    if array.ndim != 1 or array.dtype.kind not in "biufU":
        raise InvalidValueError(name, rule, given)
    result = array.tolist()
    if not result:
        raise InvalidValueError(name, "have at least one value", "none")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise InvalidValueError(name, "be finite", given)
    if len(set(result)) < len(result):
        twice = next(each for each in result if result.count(each) > 1)
        raise InvalidValueError(name, "have each value once", f"{shown(twice)} {result.count(twice)} times")
    return result


def _of_one_kind(values: Sequence[Any]) -> bool:
    """Return True if all are numbers, or all texts, or all truth values."""
    return any(all(isinstance(value, kind) for value in values) for kind in (str, (bool, np.bool_))) or all(
        isinstance(value, (int, float, np.number)) and not isinstance(value, bool) for value in values
    )


def check_takes(make_scene: Any, names: Sequence[str]) -> Callable[..., Any]:
    """Return `make_scene` if it can be called with these names, or raise InvalidValueError."""
    if not callable(make_scene):
        raise InvalidValueError("make_scene", "be a function that returns a Scene", make_scene)
    try:
        inspect.signature(make_scene).bind(**dict.fromkeys(names))
    except TypeError as error:
        rule = f"take the swept quantities by name ({', '.join(names)})"
        raise InvalidValueError("make_scene", rule, f"one for which {error}") from None
    except ValueError:  # of functions that are not written in Python
        pass
    return make_scene
