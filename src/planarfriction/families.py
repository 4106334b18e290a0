"""Families of laws, surfaces, models, shapes and scenes: each member has a name, a class, and a description.

Nothing else lists the members: a new one needs one file and one line here, or a call of `register` at run time.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from planarfriction.errors import InvalidValueError


class Family(Mapping[str, Any]):
    """The members of a family by name, in order; `family[name]` is the class or function, loaded on first use."""

    def __init__(self, what: str, members: Mapping[str, tuple[str, str]]):
        self.what = what
        """Word for a member in messages."""
        self._members: dict[str, tuple[str, Any]] = dict(members)
        """Description of each member, and the class or function that makes it, or where to find that: "module:name"."""

    def __getitem__(self, name: str) -> Any:
        _, make = self._members[name]
        if not isinstance(make, str):
            return make
        module, _, path = make.partition(":")
        found = importlib.import_module(f"planarfriction.{module}")
        for part in path.split("."):
            found = getattr(found, part)
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    def __contains__(self, name: object) -> bool:
        return name in self._members

    def words(self, name: str) -> str:
        """Return the description of a member, in one line."""
        return self._members[name][0]

    def classes(self) -> str:
        """Return the names of all classes or functions, for messages."""
        return ", ".join(make.__name__ for make in self.values())

    def choose(self, name: str) -> Any:
        """Return the class or function of a member. Raises `InvalidValueError` with all names if there is none."""
        # Brings NumPy with it, which names alone do not need.
        from planarfriction._support import validation

        return self[validation.choice(self.what, name, self)]

    def name_of(self, member: Any) -> str | None:
        """Return the name of the class of `member`, or None if it is not a member; load nothing."""
        kind = type(member)
        path = f"{kind.__module__.removeprefix('planarfriction.')}:{kind.__qualname__}"
        return next(
            (name for name, (_, make) in self._members.items() if make in (kind, path)),
            None,
        )

    def register(self, name: str, make: Callable[..., Any], words: str = "") -> None:
        """Add a member of your own, which files and the command line of this process then know by `name`.

        `words` describes it in one line. A member that was registered before is replaced.

        Raises `InvalidValueError` if the name has other characters than lower-case letters, digits and hyphens, if it
        is that of a member of the library, and if `make` cannot be called.
        """
        called = f"name of a {self.what}"
        if not (
            isinstance(name, str) and re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name)
        ):
            given = repr(name[:80]) if isinstance(name, str) else name
            raise InvalidValueError(
                called, "consist of lower-case letters, digits and hyphens", given
            )
        if name in self and isinstance(self._members[name][1], str):
            raise InvalidValueError(
                called, "not be the name of a member of the library", name
            )
        if not callable(make):
            raise InvalidValueError(
                self.what, "be a class, or a function that makes one", make
            )
        self._members[name] = words, make


LAWS = Family(
    "law",
    {
        "lugre": (
            "LuGre bristles, plain or elasto-plastic, with Stribeck and viscous terms",
            "laws.lugre:LuGre",
        ),
        "dahl": (
            "Dahl's bristles: a force that depends on the distance, not on the speed",
            "laws.dahl:Dahl",
        ),
        "coulomb-stribeck": (
            "Coulomb with Stribeck and viscous terms, regularised by a creep speed",
            "laws.coulomb_stribeck:CoulombStribeck",
        ),
    },
)

PADS = Family(
    "pad",
    {
        "layer": ("a thin layer bonded to a rigid back", "pads:Layer"),
        "half-space": (
            "a body that is thick compared with the patch",
            "pads:HalfSpace",
        ),
        "measured": ("by the stiffness of a stuck patch", "pads:Measured"),
        "at-load": ("with the stiffness of the law under a load", "pads:AtLoad"),
    },
)

SURFACES = Family(
    "limit surface",
    {
        "cells": ("sum over the cells", "limit_surface.cells:LimitSurfaceCells"),
        "exact": ("exact", "limit_surface.exact:LimitSurfaceExact"),
        "table": ("table, smooth", "limit_surface.table:LimitSurfaceTable"),
        "table-published": (
            "table, as published",
            "limit_surface.table_published:LimitSurfaceTablePublished",
        ),
        "ellipsoid": ("ellipsoid", "limit_surface.ellipsoid:LimitSurfaceEllipsoid"),
        "quartic": ("convex quartic", "limit_surface.quartic:LimitSurfaceQuartic"),
    },
)

MODELS = Family(
    "model",
    {
        "distributed": (
            "a bristle in every cell",
            "models.distributed:DistributedModel",
        ),
        "reduced": ("bristles on a few small discs", "models.reduced:ReducedModel"),
        "reduced-published": (
            "three bristles and a limit surface, as published",
            "models.reduced_published:ReducedModelPublished",
        ),
    },
)

PRESSURES = Family(
    "pressure law",
    {
        "uniform": ("the same everywhere", "patch.pressure:Uniform"),
        "linear_gradient": ("linear over the patch", "patch.pressure:LinearGradient"),
        "soft_finger": (
            "a soft fingertip that grows with the load",
            "patch.pressure:SoftFinger",
        ),
        "pressure_maps": (
            "maps measured at several loads",
            "patch.pressure_maps:PressureMaps",
        ),
        "shared": ("that of the cells of another patch", "patch.shared:SharedPressure"),
    },
)

SHAPES = Family(
    "shape",
    {
        "disc": ("a disc", "patch:ContactPatch.disc"),
        "disc-published": (
            "whole cells within a radius, as published",
            "patch:ContactPatch.disc_published",
        ),
        "rectangle": ("a rectangle or a square", "patch:ContactPatch.rectangle"),
        "ring": ("a disc with a hole", "patch:ContactPatch.ring"),
        "line": ("a line", "patch:ContactPatch.line"),
        "polygon": ("a simple polygon", "patch:ContactPatch.polygon"),
        "points": ("points", "patch:ContactPatch.points"),
        "pressure-map": (
            "a measured pressure map, or several",
            "patch.published:pressure_map",
        ),
        "published": (
            "a patch of the published experiments",
            "patch.published:published",
        ),
        "cells": ("the cells themselves", "patch.published:cells"),
    },
)

PUBLISHED_PATCHES = Family(
    "published patch",
    {
        "Square": ("a square", "patch.published:square"),
        "Circle": ("a disc", "patch.published:circle"),
        "Line": ("a line along y", "patch.published:line"),
        "LineGrad": (
            "a line along y, with higher pressure at its top",
            "patch.published:line_grad",
        ),
        "LineGradX": (
            "a line along x, with higher pressure at its left",
            "patch.published:line_grad_x",
        ),
        "NonConvex1": ("two square pads", "patch.published:non_convex_1"),
        "NonConvex2": (
            "a T lying on its side, of two bars",
            "patch.published:non_convex_2",
        ),
    },
)
"""Name -> function of `(cells=21, width=0.02)` that makes the published patch."""

SCENES = Family(
    "scene",
    {
        "in-hand": (
            "a plate that slips and rotates between finger pads",
            "scenes.ready:in_hand",
        ),
        "drift": (
            "a loaded puck whose elastic patch must not drift",
            "scenes.ready:drift",
        ),
        "free-slide": ("a puck thrown onto a table", "scenes.ready:free_slide"),
        "driven": ("a patch moved with a prescribed velocity", "scenes.ready:driven"),
        "pushed": (
            "a plate on a table, pushed along by finger pads that move",
            "scenes.ready:pushed",
        ),
        "pivot": (
            "a part that rotates down in a loosened grip and is caught",
            "scenes.ready:pivot",
        ),
        "foot": (
            "a robot that rotates on one foot as its weight moves",
            "scenes.ready:foot",
        ),
        "curling": (
            "a curling stone that slides and rotates to rest",
            "scenes.ready:curling",
        ),
    },
)
