"""Source of steps for Warp: the traced steps of models in native functions (see `export`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.codegen.trace import Block
from planarfriction._engine.coupled.coupling import restrain
from planarfriction._engine.coupled.coupling_steps import (
    step_all,
    step_all_with_slopes,
    write_load_slopes,
)
from planarfriction.export.body import Search
from planarfriction.export.c_source import Writer, rendered
from planarfriction.export.c_values import Array
from planarfriction.export.library import PARAMETERS, PRECISIONS, tilt_of
from planarfriction.export.pieces import Pieces


class Source(NamedTuple):
    """Native source, and the tables that it reads."""

    text: str
    numbers: np.ndarray
    """Tables of numbers, one after another."""


def source_of(model: Pieces, precision: str) -> Source:
    """Return the source of a step in single or double precision ("float", "double")."""
    (own,), numbers = _described([model], precision, slopes=False)
    return Source(rendered("planarfriction.warp", "step.cpp", own=own), numbers)


def coupled_source_of(
    models: Sequence[Pieces],
    which: Sequence[int],
    follows: Sequence[bool],
    radii: Sequence[float],
    precision: str,
) -> Source:
    """Return the source of a step in contact space.

    `which` are the models of the patches, `follows` tells whose pressure follows moments, `radii` are lever arms [m].
    """
    kinds, numbers = _described(models, precision, slopes=True)
    pieces = [models[kind] for kind in which]
    counts = {
        "columns": [len(each.parameters) + 1 for each in pieces],
        "states": [each.count * each.states for each in pieces],
        "points": [each.count for each in pieces],
    }
    starts = {name: np.cumsum([0, *each]).tolist() for name, each in counts.items()}
    writer = Writer()
    count = len(which)
    search = Search(
        count, "step_patch", radius=Array("p->lever_arm", (count,), fixed=True)
    )
    # A step has its slopes, which are not computed again.
    step = search.add(step_all_with_slopes, search.patches, search.p)
    search.loops.replaced |= {
        step_all: lambda _: step,
        step_all_with_slopes: lambda _: "(void)",
        write_load_slopes: lambda _: "load_slopes",
    }
    names = {
        "find": search.find(search.patches, precision),
        "restrain": search.add(restrain, search.patches, search.p),
    }
    texts = search.texts()
    text = rendered(
        "planarfriction.warp",
        "coupled.cpp",
        kinds=kinds,
        which=which,
        precision=precision,
        starts=starts,
        radii=[writer.constant(each) for each in radii],
        follows=follows,
        search=names
        | {
            "fields": texts["fields"],
            "functions": texts["functions"].replace("static ", "static CUDA_CALLABLE "),
        },
    )
    return Source(text, numbers)


def _described(
    models: Sequence[Pieces], precision: str, slopes: bool
) -> tuple[list[dict[str, Any]], np.ndarray]:
    """Return what a template needs of each model, and the tables of all of them."""
    writer = Writer(precision)
    described = []
    joined: list[np.ndarray] = []
    for pieces in models:
        block = _slopes_by_twist(pieces) if slopes else pieces.step
        outputs = [f"next[{i}]" for i in range(pieces.states)]
        outputs += [f"w[{i}]" for i in range(len(block.results) - pieces.states)]
        lines = list(writer.lines(block, outputs, indent=" " * 12))
        tables = {name: pieces.tables[name] for name in ("place_x", "place_y", "share")}
        for axis in "xy":  # digits that single precision has no room for, and of which the slopes of a plane make much
            place = tables[f"place_{axis}"]
            tables[f"rest_{axis}"] = place - place.astype(
                {"float": "f4", "double": "f8"}[precision]
            )
        tables |= {
            name: each
            for name, each in pieces.tables.items()
            if any(f"{name}[" in line for line in lines)
        }
        described.append(
            {
                "precision": precision,
                "pieces": pieces,
                "slopes": slopes,
                "tilt": tilt_of(pieces.count)
                .replace("static ", "CUDA_CALLABLE ")
                .replace(")\n{", ") const\n{"),
                "ranges": [PARAMETERS[each][1] for each in pieces.parameters],
                "largest": writer.constant(PRECISIONS[precision]),
                "numbers": _placed(tables, joined),
                "step": "\n".join(lines),
            }
        )
    return described, np.concatenate(joined)


def _slopes_by_twist(pieces: Pieces) -> Block:
    """Return the step with the slopes of the wrench by the twist, row by row, and of a pad by the loads of cells."""
    block = pieces.slopes()
    first = pieces.states + 3
    rows = [
        block.results[first + pieces.columns * row :][: pieces.columns]
        for row in range(3)
    ]
    results = sum(
        (row[pieces.states : pieces.states + 3] for row in rows), block.results[:first]
    )
    return Block(
        block.operations, results + tuple(row[-1] for row in rows if pieces.pad)
    )


def _placed(tables: dict[str, np.ndarray], joined: list[np.ndarray]) -> dict[str, int]:
    """Append tables to their array; return the place of each."""
    places = {}
    for name, each in tables.items():
        places[name] = sum(len(one) for one in joined)
        joined.append(each.ravel())
    return places
