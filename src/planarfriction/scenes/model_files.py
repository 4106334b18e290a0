"""Friction models as plain data: the entries `model`, `patch` and `law` of a contact in a scene file.

Members of a family are written and read alike: `kind` is the name in `planarfriction.families`, the other keys are the
parameters of what makes the member.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction._support.reading import Section
from planarfriction.errors import InvalidValueError
from planarfriction.families import LAWS, MODELS, PADS, SHAPES, SURFACES, Family
from planarfriction.laws import ElastoPlastic

_GIVEN = ("patch", "law", "pad")
"""Parameters of models and surfaces that are not keys of their tables."""

_MISSING = object()


def model_to_dict(
    model: Any, of_patch: Callable[[Any], Any] = lambda patch: patch.to_dict()
) -> dict[str, Any]:
    """Return `{"model": ..., "patch": ..., "law": ...}` of a model, as numbers, texts, lists and tables; its "pad" too.

    `of_patch` makes the tables of patches.
    """
    table = _described(MODELS, model)
    if "surface" in table:
        table["surface"] = _surface_to_dict(model.surface, model.patch, of_patch)
    entries = {
        "model": table,
        "patch": of_patch(model.patch),
        "law": _described(LAWS, model.law),
    }
    pad = getattr(model, "pad", None)
    return entries if pad is None else {**entries, "pad": _described(PADS, pad)}


def _surface_to_dict(
    surface: Any, patch: Any, of_patch: Callable[[Any], Any]
) -> dict[str, Any]:
    table = _described(SURFACES, surface)
    if "surface" in table:
        table["surface"] = _surface_to_dict(surface.surface, surface.patch, of_patch)
    return (
        table if surface.patch is patch else {**table, "patch": of_patch(surface.patch)}
    )


def model_from_dict(contact: Section) -> Any:
    """Return the model of the table of a contact: `patch`, `law` and `pad` are tables, `model` is a name or a table.

    The table of a model, a law or a pad holds its `kind` and its parameters; `surface` is a name, or a table with its
    `kind`, its parameters, and `patch` where that is not the model's.
    """
    patch = patch_from_dict(contact.section("patch"))
    law = law_from_dict(contact.section("law"))
    table, make = _member(MODELS, contact, "model", "distributed")
    pad = {}
    if "pad" in contact:
        given = contact.section("pad")
        pad["pad"] = _made(given, PADS[given.choice("kind", PADS)], ())
        if "pad" not in inspect.signature(make).parameters:
            rule = "be left out of a contact whose model has none"
            raise InvalidValueError("pad", rule, given.get("kind"))
    return _made(table, functools.partial(make, **pad), (patch, law))


def law_from_dict(table: Section) -> Any:
    """Return the law of a table with its `kind`, "lugre" if left out, and its parameters."""
    return _made(table, LAWS[table.choice("kind", LAWS, "lugre")], ())


def patch_from_dict(table: Section) -> Any:
    """Return the patch of a table: `shape` names what makes it, the other keys are its parameters; files are paths.

    Every shape takes `metric` and `asymmetry` as `ContactPatch.with_friction_metric` does; `metric` may also be a table
    with the parameters of `friction_metric`: `along`, `across` and `angle` [rad], 0 if left out.
    """
    rest = dict(table.data)
    given_metric = rest.pop("metric", None)
    asymmetry = rest.pop("asymmetry", None)
    patch = _shape_from_dict(Section(rest, table.where, table.source, table.folder))
    if given_metric is None and asymmetry is None:
        return patch
    if isinstance(given_metric, dict):
        from planarfriction.patch import friction_metric

        metric = table.section("metric").only(["angle", "along", "across"])
        with metric.located():
            given_metric = friction_metric(
                metric.get("angle", 0.0), metric.get("along"), metric.get("across")
            )
    with table.located():
        return patch.with_friction_metric(given_metric, asymmetry)


def _shape_from_dict(table: Section) -> Any:
    shape = table.choice("shape", SHAPES)
    given = _arguments(table, SHAPES[shape], "shape")
    if "pressure" in given and shape != "cells":
        given["pressure"] = pressure_from_dict(table)
    if "file" in given:
        given["file"] = table.path("file")
    if "files" in given:
        given["files"] = table.paths("files")
    with table.located():
        return SHAPES[shape](**given)


def pressure_from_dict(patch: Section) -> Any:
    """Return the pressure law under `pressure` of a patch: "uniform", a table `{law, ...}`, or a list, one per cell."""
    from planarfriction.patch import Pressure

    value = patch.get("pressure")
    if isinstance(value, list):
        return value
    table = patch.section(
        "pressure", {"law": value} if isinstance(value, str) else value
    )
    with table.located():
        return Pressure.from_dict(table.data)


# ---------------------------------------------------------------------- members of any family


@functools.cache
def _parameters(make: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """Return the parameters that are keys of the table of a member."""
    parameters = inspect.signature(make).parameters
    return {name: each for name, each in parameters.items() if name not in _GIVEN}


def _described(family: Family, member: Any) -> dict[str, Any]:
    """Return the kind and parameters of a member; a limit surface stays as it is."""
    kind = family.name_of(member)
    if kind is None:
        rule = (
            f"be one of {', '.join(family)}, or be registered, to be written to a file"
        )
        raise InvalidValueError(family.what, rule, type(member).__name__)
    values = {name: _plain(member, name) for name in _parameters(family[kind])}
    known = {name: value for name, value in values.items() if value is not None}
    return {"kind": kind, **known}


def _plain(member: Any, name: str) -> Any:
    value = getattr(member, name, _MISSING)
    if isinstance(value, ElastoPlastic):
        return dataclasses.asdict(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    plain = bool | int | float | str | list | tuple | dict | None
    if name == "surface" or isinstance(value, plain):
        return value
    rule = f"be an attribute of {type(member).__name__} and plain data to be written to a file"
    given = "no attribute" if value is _MISSING else type(value).__name__
    raise InvalidValueError(name, rule, given)


def _member(
    family: Family, parent: Section, key: str, *default: str
) -> tuple[Section, Callable[..., Any]]:
    """Return the table of a member under `key`, where its name alone will do too, and what makes it."""
    value = parent.get(key, *default)
    table = parent.section(key, {"kind": value} if isinstance(value, str) else value)
    return table, family[table.choice("kind", family)]


def _made(
    table: Section, make: Callable[..., Any], given: tuple[Any, ...], *others: str
) -> Any:
    """Return the member of a table, with the keys `others` beside its own; `given` begins with its patch."""
    options = _arguments(table, make, "kind", *others)
    if "surface" in options:
        options["surface"] = _surface_from_dict(table, given[0])
    with table.located():
        return make(*given, **options)


def _surface_from_dict(parent: Section, patch: Any) -> Any:
    table, make = _member(SURFACES, parent, "surface")
    patch = patch_from_dict(table.section("patch")) if "patch" in table else patch
    return _made(table, make, (patch,), "patch")


def _arguments(
    table: Section, make: Callable[..., Any], *others: str
) -> dict[str, Any]:
    """Return the values of a table for the parameters of `make`, checked to be neither unknown nor missing."""
    parameters = _parameters(make)
    table.only([*others, *parameters])
    for name, parameter in parameters.items():
        if parameter.default is parameter.empty:
            table.get(name)
    return {name: value for name, value in table.data.items() if name in parameters}
