"""Scene files: any scene as TOML or JSON, with patches by name and with signals and pressure maps from files.

The layout is that of `Scene.to_dict`. Reading accepts shorter forms too: a number for a constant signal, a path for a
sampled one, a shape and its size for a patch, a rectangle's `size` for the inertia and the outline of a body.
"""

from __future__ import annotations

import dataclasses
import json
import os
import re
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.reading import Section, read_text
from planarfriction._support.writing import write_text
from planarfriction.errors import FileError, InvalidValueError, shown
from planarfriction.scenes.body import Body, Spring
from planarfriction.scenes.contact import Contact
from planarfriction.scenes.model_files import model_from_dict, model_to_dict
from planarfriction.scenes.signal import Signal, read_signal

_OPTIONS = ("name", "t_end", "save_every", "rtol", "atol", "stop_speed", "start")
SCENE_KEYS = (*_OPTIONS, "body", "force", "velocity", "spring", "contact")
_MOST_NAMES = 100
"""Names of a dotted key that are read: the time of the reader grows with their square."""

# names are taken whole, from their beginning: of a long one each letter would be tried as the first and the last
_LONG_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{_MOST_NAMES}}}"""
)

BODY_KEYS = (*(field.name for field in dataclasses.fields(Body)), "size")
CONTACT_KEYS = (
    *("name", "mounted_on", "position", "angle", "count", "pressure", "height", "edge"),
    *("normal_force", "support_velocity", "model", "patch", "law", "pad"),
)
SPRING_KEYS = ("stiffness", "damping", "at", "torsion", "torsion_damping", "anchor")


def rectangle_outline(size: Sequence[float]) -> np.ndarray:
    """Return the corners `[4, 2]` [m] of a rectangle of `size` (width, height) about the origin."""
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return 0.5 * corners * validation.positive_array("size", size, (2,))


def rectangle_inertia(mass: float, size: Sequence[float]) -> float:
    """Return the moment of inertia of a uniform rectangle about its centre, `m (w^2 + h^2) / 12` [kg m^2]."""
    width, height = validation.positive_array("size", size, (2,)).tolist()
    return validation.positive("mass", mass) / 12.0 * (width**2 + height**2)


def part_to_dict(part: Any) -> dict[str, Any]:
    """Return a signal or the entries of a model as numbers, texts, lists and tables."""
    return part.to_dict() if isinstance(part, Signal) else model_to_dict(part)


def scene_to_dict(
    scene: Any, of_part: Callable[[Any], dict[str, Any]] = part_to_dict
) -> dict[str, Any]:
    """Return the scene as numbers, texts, lists and tables, without parts that it does not have.

    `of_part` makes the tables of signals and the entries of a contact's model.
    """

    def table(record: Any, keys: Sequence[str], left_out: Any = ()) -> dict[str, Any]:
        """Return the values of a record that are not None."""
        found = {key: getattr(record, key) for key in keys if key not in left_out}
        return {
            key: of_part(value) if isinstance(value, Signal) else _plain(value)
            for key, value in found.items()
            if value is not None
        }

    data = table(scene, _OPTIONS, ["start"] if scene.start == "rest" else ())
    data["body"] = table(scene.body, BODY_KEYS[:-1])
    data |= table(scene, ("force", "velocity"))
    if scene.springs:
        data["spring"] = [table(each, SPRING_KEYS) for each in scene.springs]
    data["contact"] = []
    for each in scene.contacts:
        # A fixed pressure and no edge go without saying.
        left_out = ["pressure", "height"] if each.pressure == "fixed" else []
        left_out += [] if each.edge else ["edge"]
        entries = table(each, CONTACT_KEYS[:10], left_out)
        data["contact"].append(entries | of_part(each.model))
    return data


def _plain(value: Any) -> Any:
    return (
        np.asarray(value).tolist() if isinstance(value, np.ndarray | tuple) else value
    )


def parts_of_scene(
    data: dict[str, Any], folder: str | Path | None = None, source: str = "scene"
) -> tuple[Section, dict[str, Any]]:
    """Read the table of a scene, which `source` names in errors: returns it with the arguments of `Scene`.

    Relative paths in it start from `folder`.
    """
    place = None if folder is None else validation.path("folder", folder)
    table = Section(data, "", source, place).only(SCENE_KEYS)
    contacts = _contacts(table)
    table.get("t_end")
    options = {key: table.get(key) for key in _OPTIONS if key in table}
    options |= {
        key: read_signal(table, key) for key in ("force", "velocity") if key in table
    }
    if "spring" in table:
        options["springs"] = [_spring(each) for each in _tables(table, "spring")]
    prescribed = "velocity" in table and "body" not in table
    body = None if prescribed else _body(table.section("body"))
    return table, {"body": body, "contacts": contacts, **options}


def _body(table: Section) -> Body:
    given = dict(table.only(BODY_KEYS).data)
    table.get("mass")
    size = given.pop("size", None)
    with table.located():
        if size is not None:
            given.setdefault("inertia", rectangle_inertia(given["mass"], size))
            given.setdefault("outline", rectangle_outline(size))
        elif "inertia" not in given:
            table.fail(
                "missing key 'inertia' (or size = [width, height] of a uniform rectangle)"
            )
        return Body(**given)


def _tables(scene: Section, name: str) -> list[Section]:
    """Return the one or more tables of contacts or springs."""
    tables = scene.get(name)
    if isinstance(tables, dict):
        tables = [tables]
    if not isinstance(tables, list) or not tables:
        scene.fail(f"{name} must be one or more tables [[{name}]]")
    several = len(tables) > 1
    return [
        scene.section(f"{name}.{number}" if several else name, data)
        for number, data in enumerate(tables, 1)
    ]


def _spring(table: Section) -> Spring:
    """Return the spring of a table."""
    given = dict(table.only(SPRING_KEYS).data)
    table.get("stiffness")
    with table.located():
        if "anchor" in table:
            given["anchor"] = read_signal(table, "anchor")
        return Spring(**given)


def _contacts(scene: Section) -> list[Contact]:
    contacts: list[Contact] = []
    tables = _tables(scene, "contact")
    for number, table in enumerate(tables, 1):
        table.only(CONTACT_KEYS)
        options = {key: table.get(key) for key in CONTACT_KEYS[:8] if key in table}
        if "name" not in table and len(tables) > 1:
            options["name"] = f"contact {number}"
        load = read_signal(table, "normal_force")
        model = model_from_dict(table)
        if "support_velocity" in table:
            options["support_velocity"] = read_signal(table, "support_velocity")
        with table.located():
            contacts.append(Contact(model, load, **options))
    return contacts


def read_table(path: Path) -> dict[str, Any]:
    """Return the table of a `.toml` or `.json` file, as it is written."""
    kind = path.suffix.lower()
    if kind not in (".toml", ".json"):
        missing = "" if os.path.exists(path) else ", and there is no such file"
        raise FileError(f"{path}: a scene file ends in .toml or .json{missing}")
    text = read_text(path, "a scene file")
    if kind == ".toml" and _LONG_KEY.search(text):
        raise FileError(
            f"{path}: not valid TOML: a key of more than {_MOST_NAMES} names"
        )
    try:
        return (
            tomllib.loads(text)
            if kind == ".toml"
            else json.loads(text, object_pairs_hook=_table)
        )
    # ValueError: also a number of more digits than Python converts.
    except (ValueError, RecursionError) as error:
        raise FileError(
            f"{path}: not valid {kind[1:].upper()}: {shown(str(error).partition(';')[0])}"
        ) from None


def _table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the table of a JSON object, in which each key stands once, as in TOML."""
    table: dict[str, Any] = {}
    for key, value in pairs:
        if key in table:
            raise ValueError(f"two keys {shown(repr(key))}")
        table[key] = value
    return table


def write_table(data: dict[str, Any], path: str | Path) -> None:
    """Write the table of a scene to a `.toml` or `.json` file."""
    path = validation.path("path", path)
    kind = path.suffix.lower()
    if kind not in (".toml", ".json"):
        raise InvalidValueError(
            "path of a scene file", "end in .toml or .json", str(path)
        )
    text = (
        to_toml(data)
        if kind == ".toml"
        else json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    )
    write_text(path, text)


def to_toml(data: dict[str, Any]) -> str:
    """Return the TOML text of a table of numbers, texts, lists and tables; floats keep every bit.

    Lists of tables become `[[name]]`; None has no TOML form and must not occur.
    """
    return "\n".join(_lines(data, ())) + "\n"


def _lines(table: dict[str, Any], path: tuple[str, ...]) -> list[str]:
    plain = {key: value for key, value in table.items() if not _is_table(value)}
    lines = [f"{_key(key)} = {_value(value)}" for key, value in plain.items()]
    for key, value in table.items():
        if not _is_table(value):
            continue
        here = (*path, key)
        name = ".".join(_key(part) for part in here)
        header = f"[{name}]" if isinstance(value, dict) else f"[[{name}]]"
        for child in [value] if isinstance(value, dict) else value:
            lines += ["", header, *_lines(child, here)]
    return lines


def _is_table(value: Any) -> bool:
    items = value if isinstance(value, list) else [value]
    return bool(items) and all(isinstance(item, dict) for item in items)


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else _text(key)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, dict):
        items = (f"{_key(key)} = {_value(item)}" for key, item in value.items())
        return f"{{{', '.join(items)}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return repr(value)
