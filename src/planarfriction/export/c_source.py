"""C source of traced functions, C99 that is C++ too, of single or double precision; and of cells in passes.

The step of a cell is a chain of hundreds of operations of which each waits for the one before. In passes over many
cells, of which each does a share of the operations, the processor has several cells in hand at a time.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from importlib import resources
from itertools import compress
from typing import Any, NamedTuple

from planarfriction._engine.codegen import operators
from planarfriction._engine.codegen.source import names_in
from planarfriction._engine.codegen.symbolic_functions import twin
from planarfriction._engine.codegen.trace import (
    Block,
    Branch,
    Number,
    Operation,
    traced,
)

TYPES = {"real": "real", "index": "int", "wide": "long long", "bool": "int"}
"""C types by the kind of a number; `real` is a typedef."""


LEAST = 1.2e-38
"""Least positive constant of single precision: thresholds below it are raised."""


def comment(text: str) -> str:
    """Return a text that stays within a comment, on its line."""
    return ascii(text)[1:-1].replace("*/", "* /").replace("/*", "/ *")


def rendered(package: str, template: str, /, **values: Any) -> str:
    """Return the text of a template of a package; a library in it that is called `friction` gets its `name`."""
    import jinja2

    name = values.get("name", "friction")
    folder = resources.files(package)

    def source(each: str) -> str:
        text = folder.joinpath(each).read_text(encoding="utf-8")
        text = re.sub(r"\bFRICTION_", f"{name.upper()}_", text)
        return re.sub(
            r"\b(jac_)?friction(?=_|\.(?:h|c|cmake)\b)", rf"\g<1>{name}", text
        )

    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(source),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    return environment.get_template(f"{template}.j2").render(values)


class Writer:
    """Differences between precisions: constants and the names of mathematical functions."""

    def __init__(self, precision: str = "double", own: bool = False) -> None:
        self.suffix = "f" if precision == "float" else ""
        self.own = own
        """True to call the library's own `exp_of`, `sin_of` and `sqrt_of`, which compilers put into vector code."""

    def constant(self, value: Any) -> str:
        """Return the text of a constant."""
        if isinstance(value, (bool, int)):
            return str(int(value))
        if math.isinf(value):
            return "INFINITY" if value > 0.0 else "-INFINITY"
        if self.suffix and 0.0 < abs(value) < LEAST:
            value = math.copysign(LEAST, value)
        text = repr(float(value))
        return f"({text}{self.suffix})" if value < 0.0 else text + self.suffix

    def atom(self, name: Any) -> str:
        """Return the text of a name or constant."""
        return name if isinstance(name, str) else self.constant(name)

    def expression(self, operation: Operation) -> str:
        """Return the text of an operation."""
        operator = operation.operator
        name = (
            f"{operator.name}_of"
            if self.own and operator.own
            else operator.name + self.suffix
        )
        return operator.c.format(*map(self.atom, operation.arguments), name=name)

    # ------------------------------------------------------------------ functions

    def lines(
        self, block: Block, outputs: Sequence[str], indent: str = "    "
    ) -> Iterator[str]:
        """Yield the lines that compute a block and assign its results to `outputs`."""
        used = used_by(block)
        for each in block.operations:
            if isinstance(each, Branch):
                yield from self._branch(each, used, indent)
            elif each.name in used:
                yield self.line(each, indent)
        for output, result in zip(outputs, block.results, strict=True):
            yield f"{indent}{output} = {self.atom(result)};"

    def line(self, operation: Operation, indent: str = "    ") -> str:
        """Return the line of an operation."""
        return f"{indent}const {TYPES[operation.kind]} {operation.name} = {self.expression(operation)};"

    def _branch(self, branch: Branch, used: set[str], indent: str) -> Iterator[str]:
        wanted = [name in used for name, _ in branch.outcomes]
        if not any(wanted):
            return
        names = []
        for name, kind in compress(branch.outcomes, wanted):
            yield f"{indent}{TYPES[kind]} {name};"
            names.append(name)
        yield f"{indent}if ({branch.condition}) {{"
        yield from self.lines(_of(branch.yes, wanted), names, indent + "    ")
        yield f"{indent}}} else {{"
        yield from self.lines(_of(branch.no, wanted), names, indent + "    ")
        yield f"{indent}}}"


SQRT = """#if defined(__AVX2__) && !defined(__NO_MATH_ERRNO__) /* that of math.h may set errno, which no vector does */
    const union { real x; unsigned long long bits; } same = { x };
    const real half = 0.5 * x;
    real y = of_bits(0x5fe6eb50c7b537a9 - (long long)(same.bits >> 1));
    y = y * (1.5 - half * y * y);
    y = y * (1.5 - half * y * y);
    y = y * (1.5 - half * y * y);
    y = y * (1.5 - half * y * y);
    return x * y + 0.5 * y * (x - (x * y) * (x * y));
#else
    return sqrt(x);
#endif""".splitlines()
"""Lines of the body of `sqrt_of`: a guess of 1/sqrt(x) within 3.5 %, Newton's method, and the rounding of the root."""


def of_compiled(function: Any) -> list[str]:
    """Return the lines of the body of a function of `compiled_math`, in double precision."""
    block = traced(lambda trace: twin(function)(Number(trace, "x")))
    *lines, last = Writer().lines(block, ["return"])
    return [each.replace(" floor(", " floor_of(") for each in lines] + [
        last.replace("return =", "return")
    ]


def _of(block: Block, wanted: list[bool]) -> Block:
    """Return a block with the wanted of its results."""
    return Block(block.operations, tuple(compress(block.results, wanted)))


def used_by(block: Block) -> set[str]:
    """Return the names that the results of a block depend on."""
    used = {each for each in block.results if isinstance(each, str)}
    for each in reversed(block.operations):
        if isinstance(each, Branch):
            wanted = [name in used for name, _ in each.outcomes]
            if any(wanted):
                used |= (
                    {each.condition}
                    | used_by(_of(each.yes, wanted))
                    | used_by(_of(each.no, wanted))
                )
        elif each.name in used:
            used.update(names_in(each))
    return used


CELLS = 56
"""Largest number of cells of a block, those of the default model: 2 kB of stack, with their new states."""

TAPED = 4
"""Largest number of cells of a block whose derivatives are taken: passes hand on all that was computed."""

OPERATIONS = 28
"""Operations of a pass: the chain of one cell is so short that a processor has several cells in hand."""

LANES = 8
"""Numbers of the widest vectors."""

MOST_MORE = 7
"""Cells for each of those that are added to fill the last vector, at least."""

SHORT = 2
"""Sums and products that each pass does itself instead of keeping their result, which would take stack."""


class CPasses(NamedTuple):
    """Source of the step of a block of cells."""

    count: int
    """Number of cells."""
    cells: int
    """Number of cells of a block; if it is the only one, there may be more than `count`."""
    blocks: int
    results: int
    """Number of results of a cell, but for its new states."""
    rows: int
    """Numbers of each cell that one pass leaves to the next."""
    shared: str
    """Lines of what all cells have in common."""
    each: list[str]
    """Lines of each pass, of cell `k` in row `i` of the block; the last leaves the results in the first rows.

    The place of a new state holds what passes hand on, until the last one writes the state there.
    """

    @property
    def width(self) -> int:
        """Number of cells of which states and tables have numbers."""
        return max(self.cells, self.count)


def passes_of(
    writer: Writer,
    block: Block,
    count: int,
    states: int,
    most: int = CELLS,
    *,
    fill: bool = False,
    new: bool = True,
) -> CPasses | None:
    """Split a function of a cell with so many states, the `new` ones first among its results; None if it has branches.

    Blocks have `most` cells; if all are one block, others may `fill` its last vector.
    """
    blocks = -(-count // most)
    cells = -(-count // blocks)
    more = -cells % LANES
    if (fill or blocks > 1) and MOST_MORE * more <= cells:
        cells += more
    width = max(cells, count)
    places = [f"next[k + {i * width}]" for i in range(states if new else 0)]
    if any(isinstance(each, Branch) for each in block.operations):
        return None
    used = used_by(block)
    operations = [each for each in block.operations if each.name in used]
    common: set[str] = set()
    for each in operations:
        if all(
            name in common or not re.search(r"^t\d|\bk\b", name)
            for name in names_in(each)
        ):
            common.add(each.name)
    own = [each for each in operations if each.name not in common]
    again = _again(own)
    own = [each for each in own if each not in again]
    ends = [0, *_cuts(own, block, count), len(own)]
    kept = [_handed(own, block, end) for end in ends]
    shared = [writer.line(each) for each in operations if each.name in common]
    truths = {each.name for each in own if each.kind == "bool"}
    room = [f"row[{row}][i]" for row in range(len(own))]
    room = [*room[:3], *places, *room[3:]]
    texts = []
    places_of = {}
    for first, last, after in zip(ends, ends[1:], kept[1:], strict=False):
        before = places_of
        places_of = {name: each for name, each in places_of.items() if name in after}
        for name in after:
            places_of.setdefault(
                name, next(each for each in room if each not in places_of.values())
            )
        read = {name for each in own[first:last] for name in names_in(each)}
        read |= set(block.results) if last == len(own) else set()
        for each in reversed(again):
            read |= set(names_in(each)) if each.name in read else set()
        lines = [
            f"    const real {name} = {place};"
            for name, place in before.items()
            if name in read
        ]
        lines += [writer.line(each) for each in again if each.name in read]
        lines += [writer.line(each) for each in own[first:last]]
        lines += [
            f"    {place} = {'(real)' if name in truths else ''}{name};"
            for name, place in places_of.items()
            if name not in before
        ]
        if last == len(own):
            results = [writer.atom(each) for each in block.results]
            lines += [
                f"    {place} = {result};"
                for place, result in zip(places, results, strict=False)
            ]
            lines += [
                f"    row[{j}][i] = {result};"
                for j, result in enumerate(results[len(places) :])
            ]
        text = "\n".join(f"        {line}" for line in lines)
        for i in reversed(range(1, states)):  # states of other cells follow
            text = text.replace(f"z[k + {i * count}]", f"z[k + {i * width}]")
        texts.append(text)
    rows = 1 + max(int(row) for row in re.findall(r"row\[(\d+)\]", "".join(texts)))
    results = len(block.results) - len(places)
    return CPasses(count, cells, blocks, results, rows, "\n".join(shared), texts)


def _again(own: list[Operation]) -> list[Operation]:
    """Return operations of so few steps that each pass does them itself."""
    steps: dict[str, int] = {}
    for each in own:
        steps[each.name] = (
            1 + sum(steps.get(name, 0) for name in names_in(each))
            if _is_short(each)
            else SHORT + 1
        )
    return [each for each in own if steps[each.name] <= SHORT]


def _is_short(operation: Operation) -> bool:
    return operation.kind == "real" and operation.operator in (
        operators.ADD,
        operators.SUBTRACT,
        operators.MULTIPLY,
    )


def _handed(own: list[Operation], block: Block, end: int) -> list[str]:
    """Return the names that operations before a place leave to those after it, in order; none behind the last."""
    later = {name for each in own[end:] for name in names_in(each)} | set(block.results)
    return (
        [each.name for each in own[:end] if each.name in later]
        if end < len(own)
        else []
    )


def _cuts(own: list[Operation], block: Block, count: int) -> list[int]:
    """Return places where few numbers are handed on, and nothing but real ones, about evenly spread."""
    kinds = {each.name: each.kind for each in own}
    passes = min(max(round(len(own) / OPERATIONS), 1), count)
    spread = len(own) // (3 * passes)

    def cost(end: int) -> float:
        names = _handed(own, block, end)
        return (
            len(names)
            if all(TYPES[kinds[name]] == "real" for name in names)
            else float("inf")
        )

    middles = (share * len(own) // passes for share in range(1, passes))
    return [
        min(range(middle - spread, middle + spread + 1), key=cost) for middle in middles
    ]
