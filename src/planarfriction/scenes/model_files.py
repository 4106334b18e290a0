"""Friction models as plain data: the entries `model`, `patch` and `law` of a contact in a scene file."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from typing import Any

from planarfriction.errors import InvalidValueError
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.scenes.reading import Section

MODELS = {
    "distributed": "DistributedModel",
    "reduced": "ReducedModel",
    "reduced_published": "ReducedModelPublished",
}
"""Name in scene files -> class in `planarfriction.models`."""

_MAP_SIZES = ("segments", "speeds", "load_error")

SURFACES = {
    "table_published": "LimitSurfaceTablePublished",
    "table": "LimitSurfaceTable",
    "ellipsoid": "LimitSurfaceEllipsoid",
    "cells": "LimitSurfaceCells",
}
"""Name in scene files -> class in `planarfriction.limit_surface`."""

SHAPES = ("disc", "disc_published", "rectangle", "ring", "line", "polygon", "points")
"""Shapes that are made by the class method of `ContactPatch` with the same name, and take its parameters as keys."""

OTHER_SHAPES = ("pressure_map", "published", "cells")
"""Shapes with their own keys: a measured map, one of the published patches, the cells themselves."""


def model_to_dict(model: Any) -> dict[str, Any]:
    """`{"model": ..., "patch": ..., "law": ...}` of a model, as numbers, texts, lists and tables."""
    kind = _name_of(model, MODELS, "planarfriction.models", "model")
    table: dict[str, Any] = {"kind": kind}
    if kind == "reduced":
        table |= {name: getattr(model, name) for name in _MAP_SIZES}
    if kind == "reduced_published":
        table |= {"surface": _surface_to_dict(model), "on_load_change": model.on_load_change}
    return {"model": table, "patch": model.patch.to_dict(), "law": law_to_dict(model.law)}


def model_from_dict(contact: Section) -> Any:
    """Model of the table of a contact: `patch` and `law` are tables, `model` is a name or a table.

    The table of a model holds `kind`, for "reduced" also `segments`, `speeds` and `load_error`, and for
    "reduced_published" also `on_load_change` and `surface`: a name, or a table with `kind`, `segments` (tables),
    `normal_force` and `patch` (where they are not those of the model).
    """
    patch = patch_from_dict(contact.section("patch"))
    law = law_from_dict(contact.section("law"))
    value = contact.get("model", "distributed")
    table = contact.section("model", {"kind": value} if isinstance(value, str) else value)
    kind = table.choice("kind", MODELS)
    make = _class(MODELS, kind, "planarfriction.models")
    if kind == "distributed":
        table.only(["kind"])
        with table.located():
            return make(patch, law)
    if kind == "reduced":
        table.only(["kind", *_MAP_SIZES])
        with table.located():
            return make(patch, law, **{name: table.get(name) for name in _MAP_SIZES if name in table})
    table.only(["kind", "surface", "on_load_change"])
    options = {key: table.get(key) for key in ("on_load_change",) if key in table}
    if "surface" in table:
        options["surface"] = _surface_from_dict(table, patch)
    with table.located():
        return make(patch, law, **options)


def _surface_to_dict(model: Any) -> dict[str, Any]:
    surface = model.surface
    table = {"kind": _name_of(surface, SURFACES, "planarfriction.limit_surface", "surface")}
    parameters = {name: getattr(surface, name) for name in _surface_parameters(type(surface))}
    table |= {name: value for name, value in parameters.items() if value is not None}
    if surface.patch is not model.patch:
        table["patch"] = surface.patch.to_dict()
    return table


def _surface_from_dict(model: Section, patch: Any) -> Any:
    value = model.get("surface")
    table = model.section("surface", {"kind": value} if isinstance(value, str) else value)
    make = _class(SURFACES, table.choice("kind", SURFACES), "planarfriction.limit_surface")
    names = _surface_parameters(make)
    table.only(["kind", *names, "patch"])
    of = patch_from_dict(table.section("patch")) if "patch" in table else patch
    with table.located():
        return make(of, **{name: table.get(name) for name in names if name in table})


def _surface_parameters(surface_class: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(surface_class) if field.init and field.name != "patch"]


def law_to_dict(law: LuGre) -> dict[str, Any]:
    """Parameters of a law by name; `elasto_plastic` is left out where there is none."""
    if type(law) is not LuGre:
        raise InvalidValueError("law", "be a LuGre to be written to a file", law)
    return {name: value for name, value in dataclasses.asdict(law).items() if value is not None}


def law_from_dict(table: Section) -> LuGre:
    """Law of a table with the parameters of `LuGre`; `elasto_plastic` is a breakaway ratio or a table that holds it."""
    given = dict(table.only([field.name for field in dataclasses.fields(LuGre)]).data)
    if "elasto_plastic" in given:
        value = given["elasto_plastic"]
        bristles = table.section("elasto_plastic", value if isinstance(value, dict) else {"breakaway_ratio": value})
        with bristles.only(["breakaway_ratio"]).located():
            given["elasto_plastic"] = ElastoPlastic(**bristles.data)
    with table.located():
        return LuGre(**given)


def patch_from_dict(table: Section) -> Any:
    """Contact patch of a table: `shape` names the constructor, the other keys are its parameters.

    `shape = "pressure_map"` takes `file` (a path) or `values` (rows from the top), `cell_size` and `name`, and for maps
    measured at several loads `loads` with `files` or with `values` of each;
    `shape = "published"` takes `name`, `cells` and `width`; `shape = "cells"` is what `ContactPatch.to_dict` writes.

    Every shape takes `metric` and `asymmetry` as `ContactPatch.with_friction_metric` does; `metric` may also be a table
    with the parameters of `grain`: `along`, `across` and `angle` [rad], 0 if left out.
    """
    directions = {key: table.get(key) for key in ("metric", "asymmetry") if key in table}
    if not directions:
        return _patch_from_dict(table)
    rest = {key: value for key, value in table.data.items() if key not in directions}
    patch = _patch_from_dict(Section(rest, table.where, table.source, table.folder))
    if isinstance(directions.get("metric"), dict):
        from planarfriction.patch import grain

        metric = table.section("metric").only(["angle", "along", "across"])
        with metric.located():
            directions["metric"] = grain(metric.get("angle", 0.0), metric.get("along"), metric.get("across"))
    with table.located():
        return patch.with_friction_metric(directions.get("metric"), directions.get("asymmetry"))


def _patch_from_dict(table: Section) -> Any:
    from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch

    shape = table.choice("shape", (*SHAPES, *OTHER_SHAPES))
    given = {key: value for key, value in table.data.items() if key != "shape"}
    if shape == "cells":
        table.only(["shape", "name", "positions", "areas", "pressure", "grid", "cell_size", "outline"])
        with table.located():
            return ContactPatch.from_dict(table.data)
    if shape == "published":
        table.only(["shape", "name", "cells", "width"])
        name = table.choice("name", PUBLISHED_PATCHES)
        with table.located():
            return PUBLISHED_PATCHES[name](**{key: value for key, value in given.items() if key != "name"})
    if shape == "pressure_map":
        table.only(["shape", "file", "files", "values", "loads", "cell_size", "name"])
        if sum(key in table for key in ("file", "files", "values")) != 1:
            table.fail("must have either file or values (or files, one for each of the loads)")
        cell_size, options = table.get("cell_size"), {key: table.get(key, None) for key in ("name", "loads")}
        if "files" in table and "loads" not in table:
            table.fail("missing key 'loads', the normal force of each of the files")
        with table.located():
            return ContactPatch.from_pressure(_maps_of(table), cell_size, **options)
    make = getattr(ContactPatch, shape)
    parameters = inspect.signature(make).parameters
    table.only(["shape", *parameters])
    for name, parameter in parameters.items():
        if parameter.default is parameter.empty:
            table.get(name)
    if "pressure" in given:
        given["pressure"] = pressure_from_dict(table)
    with table.located():
        return make(**given)


def _maps_of(table: Section) -> Any:
    """Numbers or paths of the pressure maps that a table names."""
    if "values" in table:
        return table.get("values")
    if "file" in table:
        return table.path("file")
    files = table.get("files")
    if not isinstance(files, list):
        table.fail(f"files must be a list of paths, got {files!r}")
    one = [Section({"files": name}, table.where, table.source, table.folder) for name in files]
    return [section.path("files") for section in one]


def pressure_from_dict(patch: Section) -> Any:
    """Pressure law under the key `pressure` of a patch: "uniform", a table `{law, ...}`, or a list, one per cell."""
    from planarfriction.patch import Pressure

    value = patch.get("pressure")
    if isinstance(value, list):
        return value
    table = patch.section("pressure", {"law": value} if isinstance(value, str) else value)
    with table.located():
        return Pressure.from_dict(table.data)


def _class(names: dict[str, str], name: str, module: str) -> Any:
    return getattr(importlib.import_module(module), names[name])


def _name_of(value: Any, names: dict[str, str], module: str, what: str) -> str:
    for name in names:
        if type(value) is _class(names, name, module):
            return name
    raise InvalidValueError(
        what, f"be one of {', '.join(names.values())} to be written to a file", type(value).__name__
    )
