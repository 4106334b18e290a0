"""Source of steps for Warp: the traced step of a model in a native function (see `export`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.export.c_source import Writer
from planarfriction.export.library import PRECISIONS, RANGES
from planarfriction.export.pieces import Pieces


class Source(NamedTuple):
    """Native source, and the tables that it reads."""

    text: str
    numbers: np.ndarray
    """Tables of numbers, one after another."""
    places: np.ndarray
    """Tables of whole numbers, one after another."""


def source_of(pieces: Pieces, precision: str) -> Source:
    """Return the source of a step in single or double precision ("float", "double")."""
    import jinja2

    writer = Writer(precision)
    outputs = [f"next[{i}]" for i in range(pieces.states)]
    lines = list(writer.lines(pieces.step, [*outputs, "w[0]", "w[1]", "w[2]"], indent=" " * 12))
    read = {name: each for name, each in pieces.tables.items() if any(f"{name}[" in line for line in lines)}
    whole = {name: each for name, each in read.items() if each.dtype.kind == "i"}
    real = {"share": pieces.tables["share"]} | {name: each for name, each in read.items() if name not in whole}
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("planarfriction.warp", "."), undefined=jinja2.StrictUndefined
    )
    text = environment.get_template("step.cpp.j2").render(
        precision=precision,
        pieces=pieces,
        ranges=[RANGES[each] for each in pieces.parameters],
        largest=writer.constant(PRECISIONS[precision]),
        numbers=_places(real),
        places=_places(whole),
        step="\n".join(lines),
    )
    return Source(text, _joined(real, float), _joined(whole, np.int32))


def _places(tables: dict[str, np.ndarray]) -> dict[str, int]:
    """Return the place of each table in their array."""
    ends = np.cumsum([0, *(each.size for each in tables.values())])
    return dict(zip(tables, map(int, ends), strict=False))


def _joined(tables: dict[str, np.ndarray], kind: type) -> np.ndarray:
    return np.concatenate([each.ravel() for each in tables.values()] or [np.zeros(0)]).astype(kind)
