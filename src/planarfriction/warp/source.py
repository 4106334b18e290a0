"""Source of steps for Warp: the traced steps of models in native functions (see `export`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction.export.c_source import Writer
from planarfriction.export.library import PRECISIONS, RANGES
from planarfriction.export.pieces import Pieces
from planarfriction.export.trace import Block, Number, Trace, traced
from planarfriction.export.twins import twin
from planarfriction.kernels import coupling

ROUNDING = {"double": (coupling.ROUNDING,) * 2, "float": (3e-7, 1e-5)}
"""Errors of a twist, in the largest speed that goes into it, by precision: below the first no step gets, and below the
second some do not get."""


class Source(NamedTuple):
    """Native source, and the tables that it reads."""

    text: str
    numbers: np.ndarray
    """Tables of numbers, one after another."""
    places: np.ndarray
    """Tables of whole numbers, one after another."""


def source_of(pieces: Pieces, point: Sequence[float], precision: str) -> Source:
    """Return the source of a step in single or double precision ("float", "double").

    `point` is the centre [m] of a patch whose pressure can follow moments, empty for others.
    """
    (own,), numbers, places = _described([pieces], precision, slopes=False)
    values = {"point": list(map(Writer(precision).constant, point)), "reach": own["largest"]}
    return Source(_rendered("step.cpp.j2", own=own, **values), numbers, places)


def coupled_source_of(
    models: Sequence[Pieces],
    which: Sequence[int],
    radii: Sequence[float],
    points: Sequence[Sequence[float]],
    precision: str,
) -> Source:
    """Return the source of a step in contact space.

    `which` are the models of the patches, `radii` their lever arms [m], `points` their centres [m], empty of patches
    whose pressure cannot follow moments.
    """
    kinds, numbers, places = _described(models, precision, slopes=True)
    columns = [len(models[kind].parameters) + 1 for kind in which]
    states = [models[kind].count * models[kind].states for kind in which]
    starts = {name: np.cumsum([0, *each]).tolist() for name, each in (("columns", columns), ("states", states))}
    writer = Writer(precision)
    names = "SHORTENINGS", "JOINT", "ROUND", "STAGES", "SHORTER"
    text = _rendered(
        "coupled.cpp.j2",
        kinds=kinds,
        which=which,
        precision=precision,
        starts=starts,
        radii=[writer.constant(each) for each in radii],
        points=[[writer.constant(each) for each in point] for point in points],
        reach=writer.constant(PRECISIONS[precision]),
        rounding=list(map(writer.constant, ROUNDING[precision])),
        shortening="\n".join(writer.lines(traced(_shortening), ["too_far", "share"], indent=" " * 16)),
        **{name.lower(): writer.constant(getattr(coupling, name)) for name in names},
    )
    return Source(text, numbers, places)


def _shortening(trace: Trace) -> Any:
    slopes = Number(trace, "first"), Number(trace, "here")
    return twin(coupling.too_far)(*slopes), twin(coupling.shortening_of)(*slopes)


def _described(
    models: Sequence[Pieces], precision: str, slopes: bool
) -> tuple[list[dict[str, Any]], np.ndarray, np.ndarray]:
    """Return what a template needs of each model, and the tables of all of them."""
    writer, described = Writer(precision), []
    all_real: list[np.ndarray] = []
    all_whole: list[np.ndarray] = []
    for pieces in models:
        outputs = [f"next[{i}]" for i in range(pieces.states)] + [f"w[{i}]" for i in range(12 if slopes else 3)]
        block = _slopes_by_twist(pieces) if slopes else pieces.step
        lines = list(writer.lines(block, outputs, indent=" " * 12))
        read = {name: each for name, each in pieces.tables.items() if any(f"{name}[" in line for line in lines)}
        whole = {name: each for name, each in read.items() if each.dtype.kind == "i"}
        real = {"share": pieces.tables["share"]} | {name: each for name, each in read.items() if name not in whole}
        described.append(
            {
                "precision": precision,
                "pieces": pieces,
                "slopes": slopes,
                "ranges": [RANGES[each] for each in pieces.parameters],
                "largest": writer.constant(PRECISIONS[precision]),
                "numbers": _placed(real, all_real),
                "places": _placed(whole, all_whole),
                "step": "\n".join(lines),
            }
        )
    return described, _joined(all_real, float), _joined(all_whole, np.int32)


def _slopes_by_twist(pieces: Pieces) -> Block:
    """Return the step with the slopes of the wrench by the twist, row by row, and no others."""
    block, first = pieces.slopes(), pieces.states + 3
    columns = pieces.states + 3 + len(pieces.parameters)
    rows = [first + columns * row + pieces.states for row in range(3)]
    return Block(block.operations, block.results[:first] + sum((block.results[at : at + 3] for at in rows), ()))


def _rendered(name: str, **values: Any) -> str:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("planarfriction.warp", "."), undefined=jinja2.StrictUndefined
    )
    return environment.get_template(name).render(values)


def _placed(tables: dict[str, np.ndarray], joined: list[np.ndarray]) -> dict[str, int]:
    """Append tables to their array; return the place of each."""
    places = {}
    for name, each in tables.items():
        places[name] = sum(len(one) for one in joined)
        joined.append(each.ravel())
    return places


def _joined(tables: list[np.ndarray], kind: type) -> np.ndarray:
    return np.concatenate(tables or [np.zeros(0)]).astype(kind)
