"""Swept quantities and the grid of their values; values of a scene by dotted path, such as `fingers.law.mu_c`."""

from __future__ import annotations

import inspect
import itertools
import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import FrictionError, InvalidValueError, shown
from planarfriction.families import LAWS, MODELS, PADS, SHAPES, SURFACES, Family
from planarfriction.scenes import Scene
from planarfriction.scenes.files import BODY_KEYS, CONTACT_KEYS, SCENE_KEYS, read_table

MOST_RUNS = 100_000_000
"""Largest number of runs of a sweep."""


@dataclass(frozen=True)
class ValueGrid:
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
            places = zip(self.values.items(), index, strict=True)
            yield index, {name: each[i] for (name, each), i in places}

    def words(self, index: tuple[int, ...]) -> str:
        """Describe a point in words: "mass=0.2, pad=disc"."""
        return ", ".join(
            f"{name}={shown(each[i])}"
            for (name, each), i in zip(self.labels.items(), index, strict=True)
        )


def grid_of(values: Any) -> ValueGrid:
    """Make the grid of a mapping from names to lists of scalars, or to mappings from labels to anything.

    Raises InvalidValueError for what is neither, for empty lists and for values that are there twice.
    """
    if not isinstance(values, Mapping) or not values:
        raise InvalidValueError(
            "values", "be a mapping from names to lists of values, not empty", values
        )
    labels = {}
    behind = {}
    for name, given in values.items():
        validation.text("name of a swept quantity in values", name)
        labelled = isinstance(given, Mapping)
        labels[name] = _scalars(name, list(given) if labelled else given)
        behind[name] = list(given.values()) if labelled else labels[name]
    result = ValueGrid(labels, behind)
    if result.size > MOST_RUNS:
        raise InvalidValueError("values", f"make at most {MOST_RUNS} runs", result.size)
    return result


def _scalars(name: str, given: Any) -> list[Any]:
    """Return the values of a quantity as plain Python scalars, or raise InvalidValueError."""
    rule = "be a list of numbers, texts or booleans (for other values: a mapping from labels to values)"
    if isinstance(given, (str, bytes)) or not (
        isinstance(given, (Sequence, range)) or hasattr(given, "__array__")
    ):
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
        raise InvalidValueError(
            name, "have each value once", f"{shown(twice)} {result.count(twice)} times"
        )
    return result


def _of_one_kind(values: Sequence[Any]) -> bool:
    """Return True if all are numbers, or all texts, or all truth values."""
    return any(
        all(isinstance(value, kind) for value in values)
        for kind in (str, (bool, np.bool_))
    ) or all(
        isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
        for value in values
    )


def check_takes(make_scene: Any, names: Sequence[str]) -> Callable[..., Any]:
    """Return `make_scene` if it can be called with these names, or raise InvalidValueError."""
    try:
        inspect.signature(make_scene).bind(**dict.fromkeys(names))
    except TypeError as error:
        raise InvalidValueError(
            "make_scene",
            f"take the swept quantities by name ({', '.join(names)})",
            f"one for which {error}",
        ) from None
    except ValueError:  # of functions that are not written in Python
        pass
    return make_scene


MOST_VALUES = 1_000_000
"""Largest number of values of a setting."""

_BY_NAME = {"model": "kind", "surface": "kind", "law": "kind", "pressure": "law"}
"""Tables that may be written as a name alone, and the key that the name then has."""

_FAMILIES: dict[str, tuple[Family, str]] = {
    "law": (LAWS, "kind"),
    "model": (MODELS, "kind"),
    "pad": (PADS, "kind"),
    "patch": (SHAPES, "shape"),
    "surface": (SURFACES, "kind"),
}
"""Tables of a member of a family, and the key that names the member."""


def try_ends(make: Callable[..., Any], values: Mapping[str, list[Any]]) -> None:
    """Make the scene of the first values, or else that of the last; raise its error if neither can be made."""
    try:
        make(**{path: each[0] for path, each in values.items()})
    except FrictionError:
        make(**{path: each[-1] for path, each in values.items()})


class Settable:
    """Scene as a table whose values can be set: each call makes the scene of some values."""

    def __init__(
        self, scene: Scene | str | Path | Mapping[str, Any], others: Sequence[str] = ()
    ) -> None:
        """Read the table of a scene, or of a scene file; `others` are names that messages list too.

        Raises FileError for a file that holds no table.
        """
        self._source = "scene"
        self._folder = None
        self._others = others
        self._table: Any = scene.to_dict() if isinstance(scene, Scene) else scene
        if not isinstance(self._table, Mapping):
            path = validation.path("scene", scene)
            self._table = read_table(path)
            self._source = str(path)
            self._folder = path.parent
            if not isinstance(self._table, dict):
                Scene.from_dict(self._table, source=self._source)  # says what is wrong

    def __call__(self, /, **values: Any) -> Scene:
        """Make the scene with values by their paths. Raises InvalidValueError for a path that leads nowhere."""
        table: Any = self._table
        for path, value in values.items():
            table = self._changed(table, path, value)
        return Scene.from_dict(table, self._folder, self._source)

    def check(self, values: Mapping[str, list[Any]]) -> None:
        """Check that the first or the last of the values make a scene; if neither does, a path is wrong."""
        for path, each in values.items():
            self._changed(self._table, path, each[0])
        try_ends(self, values)

    def _changed(
        self, table: Mapping[str, Any], path: str, value: Any
    ) -> dict[str, Any]:
        tables = table.get("contact", [])
        tables = tables if isinstance(tables, list) else [tables]
        # As a solution names them.
        names = []
        for number, each in enumerate(tables, 1):
            name = each.get("name") if isinstance(each, Mapping) else None
            default = "contact" if len(tables) == 1 else f"contact {number}"
            names.append(str(name or default))
        for number, name in enumerate(names):
            if path.startswith(f"{name}."):
                parts = path[len(name) + 1 :].split(".")
                changed = _set(tables[number], parts, value, path, name, CONTACT_KEYS)
                tables = [*tables[:number], changed, *tables[number + 1 :]]
                return {**table, "contact": tables}
        if path in ("body", *names):
            keys = BODY_KEYS if path == "body" else CONTACT_KEYS
            there = ", ".join(f"{path}.{key}" for key in keys)
            raise InvalidValueError(
                path, f"be one value, not a table of them: {there}", "the table"
            )
        keys = [key for key in SCENE_KEYS if key != "contact"]
        keys += [*names, *self._others]
        return _set(table, path.split("."), value, path, "the scene", keys)


def _set(
    table: Any,
    parts: list[str],
    value: Any,
    path: str,
    where: str,
    valid: Sequence[str] | None = None,
) -> Any:
    """Return a copy of a table, or of a list, with a value changed; other parts are shared."""
    key, *rest = parts
    if isinstance(table, list):
        if not (key.isdecimal() and int(key) < len(table)):
            raise InvalidValueError(
                path, f"be an index from 0 to {len(table) - 1} in {where}", repr(key)
            )
        number = int(key)
        inner = (
            _set(table[number], rest, value, path, f"{where}.{key}") if rest else value
        )
        return [*table[:number], inner, *table[number + 1 :]]
    if not isinstance(table, Mapping):
        raise InvalidValueError(
            path, f"end at {where}, which is {shown(table)}", f"{key!r} after it"
        )
    valid = list(table) if valid is None else list(dict.fromkeys(valid))
    if key not in valid:
        raise InvalidValueError(
            path,
            f"name a value of the scene: {where} has {', '.join(valid)}",
            f"{key!r}{validation.hint(key, valid)}",
        )
    name = key if where == "the scene" else f"{where}.{key}"
    if not rest:
        return {**table, key: value}
    if key not in table:
        raise InvalidValueError(
            path, f"name an existing table: {where} has no {key!r}", repr(key)
        )
    inner = table[key]
    if isinstance(inner, str) and key in _BY_NAME:
        inner = {_BY_NAME[key]: inner}
    return {
        **table,
        key: _set(inner, rest, value, path, name, _keys(key, inner)),
    }


def _keys(key: str, table: Any) -> list[str] | None:
    """Return the keys that a table may have, or None if only those that are written are known."""
    if key == "body":
        return list(BODY_KEYS)
    family, kind = _FAMILIES.get(key, (None, ""))
    if family is None or not isinstance(table, Mapping):
        return None
    make = family.get(table.get(kind, "lugre"))
    keys = [kind, *table]
    if make is not None:
        own = inspect.signature(make).parameters
        keys[1:1] = [name for name in own if name not in ("patch", "law", "pad")]
    keys += ["metric", "asymmetry"] if key == "patch" else []
    return list(dict.fromkeys(keys))


# ---------------------------------------------------------------------- as a command line spells them


def parse(text: str) -> tuple[str, dict[Any, Any]]:
    """Parse `path=value`, `path=value,value,...` or `path=start:stop:count` into the path and values by label.

    A value is a number, true, false, a list in brackets, or a text.

    Raises InvalidValueError in one line.
    """
    path, equals, spelled = text.partition("=")
    path = path.strip()
    spelled = spelled.strip()
    if not (path and equals and spelled):
        raise InvalidValueError(
            "--set",
            "be PATH=VALUE, PATH=VALUE,VALUE,... or PATH=START:STOP:COUNT",
            repr(text),
        )
    if re.fullmatch(r"[^:\[\]{}\"']*:[^:]*:[^:]*", spelled):
        values = _spaced(path, spelled)
        return path, dict(zip(values, values, strict=True))
    pieces = _separated(spelled)
    values = [_value(path, each) for each in pieces]
    labels = [
        each if isinstance(value, (list, dict)) else value
        for each, value in zip(pieces, values, strict=True)
    ]
    for label in labels:
        if (times := labels.count(label)) > 1:
            raise InvalidValueError(
                f"--set {path}", "have each value once", f"{label} {times} times"
            )
    return path, dict(zip(labels, values, strict=True))


def parse_all(texts: Sequence[str]) -> dict[str, dict[Any, Any]]:
    """Parse several texts, each with another path, into values by path and label."""
    found: dict[str, dict[Any, Any]] = {}
    for text in texts:
        path, values = parse(text)
        if path in found:
            raise InvalidValueError(f"--set {path}", "be given once", repr(text))
        found[path] = values
    return found


def _spaced(path: str, spelled: str) -> list[float]:
    """Return evenly spaced numbers, both ends included."""
    first, last, number = spelled.split(":")
    try:
        count = int(number)
    except ValueError:
        raise InvalidValueError(
            f"--set {path}", "be START:STOP:COUNT with a whole number as COUNT", spelled
        ) from None
    validation.count(f"COUNT of --set {path}", count, 2, MOST_VALUES)
    start = validation.number_in(f"START of --set {path}", first)
    stop = validation.number_in(f"STOP of --set {path}", last)
    if start == stop:
        raise InvalidValueError(
            f"--set {path}", "have a STOP that differs from START", spelled
        )
    return np.linspace(start, stop, count).tolist()


def _separated(spelled: str) -> list[str]:
    """Split at commas that are in no brackets and no quotes."""
    pieces = [""]
    depth = 0
    quote = ""
    for letter in spelled:
        if letter in "\"'" and quote in ("", letter):
            quote = "" if quote else letter
        depth += 0 if quote else (letter in "[{") - (letter in "]}")
        if letter == "," and depth <= 0 and not quote:
            pieces.append("")
        else:
            pieces[-1] += letter
    return [each.strip() for each in pieces]


def _value(path: str, spelled: str) -> Any:
    if not spelled:
        raise InvalidValueError(
            f"--set {path}", "have a value between commas", repr(spelled)
        )
    if spelled[0] in "[{\"'":
        try:
            return tomllib.loads(f"value = {spelled}")["value"]
        except (ValueError, RecursionError):
            raise InvalidValueError(
                f"--set {path}", "be a list or a text as in TOML", spelled
            ) from None
    if spelled in ("true", "false"):
        return spelled == "true"
    try:
        return int(spelled)
    except ValueError:
        pass
    try:
        number = float(spelled)
    except ValueError:
        return spelled
    return validation.number(f"--set {path}", number)
