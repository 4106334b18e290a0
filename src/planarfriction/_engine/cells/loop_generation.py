"""Loops over the cells of a block, written from a straight-line function of one cell.

The step of a cell is a chain of hundreds of operations of which each waits for the one before. Cut into passes over all
cells, each a few operations long, it leaves the processor many cells to work on at a time. The function is traced (see
`trace`); the operations of each pass become the body of a loop, and what passes hand on lies in rows of scratch memory,
which share their places if they do not live at the same time. Sums and products of two or three numbers, and
comparisons, are done again where they are needed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from planarfriction._engine.bristles.law import squared
from planarfriction._engine.cells.cell_blocks import LANES, scratch
from planarfriction._engine.codegen import operators
from planarfriction._engine.codegen.source import (
    identifier,
    line_of,
    names_in,
    needed,
    run_source,
    text_of,
)
from planarfriction._engine.codegen.trace import Block, Operation
from planarfriction._engine.codegen.vectors import plus
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel

SQUARE = "LawNumbers.gamma"
"""Exponent that is 2 more often than not."""

ARGUMENTS = "law, v, shared, block, work"


class Passes(NamedTuple):
    """Loops over the cells of a block, as one function."""

    run: Any
    """`(law, v, shared, block, lanes)`: run the passes in memory of their own; return the sums over the cells."""
    rows: int
    """Rows [LANES] of that memory."""
    source: str


class Part(NamedTuple):
    """Operations of one pass, in order."""

    operations: list[Operation]
    reads: set[str]
    """Numbers of the cell, numbers that all cells share, and results of earlier passes."""
    ends: list[int]
    """Results of the function that the pass stores or sums up."""


def passes(
    name: str,
    block: Block,
    inputs: Mapping[str, str],
    stores: Sequence[str],
    division: tuple[int, int],
) -> Passes:
    """Write a traced function of a cell as passes.

    `inputs` are the sources of its arguments by their names in the trace: numbers of a cell are read at `[... + i]`,
    all cells share the others. The first results go to the places `stores`, the others are summed up. `division`: about
    how many passes there are, and how many operations a number takes at most that they repeat.
    """
    parts = _parts(block, inputs, stores, *division)
    places, rows = _places(parts)
    texts = []
    calls = []
    for k, part in enumerate(parts):
        lines = [
            f"{identifier(each)} = {places.get(each) or inputs[each]}"
            for each in sorted(part.reads)
        ]
        for each in part.operations:
            lines.append(line_of(each))
            if each.name in places:
                lines.append(f"{places[each.name]} = {each.name}")
        lines += [
            f"{stores[each]} = {identifier(block.results[each])}"
            for each in part.ends
            if each < len(stores)
        ]
        summed = [each for each in part.ends if each >= len(stores)]
        total = "".join(f"{identifier(block.results[each])}, " for each in summed)
        texts += _loop(
            k, [*lines, f"return ({total})" if total else "return"], len(summed)
        )
        calls += _call(
            k, summed, any(SQUARE in each.arguments for each in part.operations)
        )
    sums = "".join(f"sum_{each}, " for each in range(len(stores), len(block.results)))
    lines = [
        f"work = scratch({rows * LANES})",
        *calls,
        f"return ({sums})" if sums else "return",
    ]
    texts.append(text_of("run(law, v, shared, block, lanes)", lines))
    source = "\n\n".join(texts)
    return Passes(_compiled(name, source, len(parts)), rows, source)


def _loop(k: int, body: list[str], sums: int) -> list[str]:
    """Return the source of a pass; its body apart, kernel later, leaves the compiler a loop that it can count."""
    call = f"body_{k}({ARGUMENTS}, i)"
    if sums:
        lines = [
            f"total = ({'0.0, ' * sums})",
            "for i in range(lanes):",
            f"    total = plus(total, 1.0, {call})",
        ]
        lines.append("return total")
    else:
        lines = ["for i in range(lanes):", f"    {call}"]
    return [
        text_of(f"body_{k}({ARGUMENTS}, i)", body),
        text_of(f"pass_{k}({ARGUMENTS}, lanes)", lines),
    ]


def _call(k: int, sums: list[int], power: bool) -> list[str]:
    """Return the lines that call a pass; one that raises to the exponent of the law knows if that is 2."""
    take = "".join(f"sum_{each}, " for each in sums) + "= " if sums else ""
    call = f"{take}pass_{k}({ARGUMENTS}, lanes)"
    if not power:
        return [call]
    return [
        "if law.gamma == 2.0:",
        f"    {call.replace('(law', '(squared(law)')}",
        "else:",
        f"    {call}",
    ]


def _compiled(name: str, source: str, count: int) -> Any:
    known = {"xp": xp, "math": math, "inf": math.inf, "nan": math.nan}
    space = run_source(
        name, source, {**known, "plus": plus, "scratch": scratch, "squared": squared}
    )
    for k in range(count):
        space[f"body_{k}"], space[f"pass_{k}"] = (
            kernel(space[f"body_{k}"]),
            kernel(space[f"pass_{k}"]),
        )
    return kernel(space["run"])


# ---------------------------------------------------------------------- division among passes


def _parts(
    block: Block,
    inputs: Mapping[str, str],
    stores: Sequence[str],
    count: int,
    short: int,
) -> list[Part]:
    """Divide the operations of a function among passes; results in the place of an input are stored by the last one."""
    operations = needed(block.operations, block.results)
    again = _done_again(operations, inputs, short)
    kept = [each for each in operations if each.name not in again]
    cuts = _cuts(kept, again, block, count)
    spans = list(itertools.pairwise(cuts))
    part_of = {
        each.name: k for k, span in enumerate(spans) for each in kept[slice(*span)]
    }
    made = [
        max((part_of.get(name, 0) for name in _reached([each], again)), default=0)
        for each in block.results
    ]
    for k, place in enumerate(stores):
        made[k] = len(spans) - 1 if place in inputs.values() else made[k]
    parts = []
    for k, span in enumerate(spans):
        span_operations = kept[slice(*span)]
        ends = [each for each, part in enumerate(made) if part == k]
        names = _names_needed(
            [*span_operations, *_as_operations([block.results[each] for each in ends])],
            again,
        )
        inside = {each.name for each in span_operations} | (names & again.keys())
        parts.append(
            Part(
                [each for each in operations if each.name in inside],
                names - inside,
                ends,
            )
        )
    return parts


def _as_operations(results: Sequence[Any]) -> list[Operation]:
    return [Operation("", "real", operators.REAL, (each,)) for each in results]


def _done_again(
    operations: Sequence[Operation], inputs: Mapping[str, str], short: int
) -> dict[str, Operation]:
    """Return operations that passes repeat: short ones, comparisons, and all of numbers that cells share."""
    steps = dict.fromkeys(inputs, 0)
    alike = {name for name, source in inputs.items() if not source.endswith("+ i]")}
    again = {}
    for each in operations:
        names = list(names_in(each))
        if alike.issuperset(names):
            alike.add(each.name)
            steps[each.name] = 0
        elif each.kind == "bool" or each.operator not in operators.SHORT:
            steps[each.name] = short + (each.kind != "bool")
        else:
            steps[each.name] = 1 + sum(steps[name] for name in names)
        if steps[each.name] <= short:
            again[each.name] = each
        else:
            steps[each.name] = 0  # read by those that follow
    return again


def _reached(names: Sequence[Any], again: Mapping[str, Operation]) -> set[str]:
    """Return the names that others follow from, through operations that are done again."""
    found = set()
    left = [each for each in names if isinstance(each, str)]
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            left += names_in(again[name]) if name in again else ()
    return found


def _names_needed(
    operations: Sequence[Operation], again: Mapping[str, Operation]
) -> set[str]:
    return _reached([name for each in operations for name in names_in(each)], again)


def _cuts(
    kept: Sequence[Operation], again: Mapping[str, Operation], block: Block, count: int
) -> list[int]:
    """Return where passes begin: about evenly by cost, where few numbers are handed on."""
    costs = list(itertools.accumulate((each.operator.cost for each in kept), initial=0))
    reached = [each / costs[-1] * count for each in costs]
    made = {each.name: k for k, each in enumerate(kept)}
    last = [0] * len(kept)
    for k, each in enumerate([*kept, *_as_operations(block.results)]):
        for name in _reached(list(names_in(each)), again) & made.keys():
            last[made[name]] = k
    handed = _living(last)
    ends = set()
    for middle in range(1, count if len(kept) > 1 else 1):
        near = [k for k in range(1, len(kept)) if abs(reached[k] - middle) < 0.25]
        ends.add(min(near or [1], key=handed.__getitem__))
    return [0, *sorted(ends), len(kept)]


def _living(last: Sequence[int]) -> list[int]:
    """Return how many numbers from before each place are read there or later; `last`: place that reads each last."""
    changes = [0] * (max(last, default=0) + 2)
    for made, read in enumerate(last):
        if read > made:
            changes[made + 1] += 1
            changes[read + 1] -= 1
    return list(itertools.accumulate(changes))


def _places(parts: Sequence[Part]) -> tuple[dict[str, str], int]:
    """Return the places of the numbers that passes hand on, and the number of rows of scratch that they take."""
    last = {name: k for k, part in enumerate(parts) for name in part.reads}
    places: dict[str, str] = {}
    free: list[int] = []
    rows = 0
    ends: list[list[int]] = [[] for _ in parts]
    kept = set().union(*(part.reads for part in parts))
    for k, part in enumerate(parts):
        for each in part.operations:
            if each.name not in kept or each.name in places or last[each.name] <= k:
                continue
            if not free:
                free.append(rows)
                rows += 1
            row = free.pop()
            places[each.name] = f"work[{row * LANES} + i]"
            ends[last[each.name]].append(row)
        free += ends[k]
    return places, rows
