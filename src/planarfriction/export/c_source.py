"""C source of traced functions: C99 that is C++ too, of single or double precision."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import compress
from typing import Any

from planarfriction.export.trace import Block, Branch, Operation

TYPES = {"real": "real", "index": "int", "bool": "int"}
"""C types by the kind of a number; `real` is a typedef."""


LEAST = 1.2e-38
"""Least positive constant of single precision: thresholds below it are raised."""


class Writer:
    """Differences between precisions: constants and the names of mathematical functions."""

    def __init__(self, precision: str = "double") -> None:
        self.suffix = "f" if precision == "float" else ""

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
        arguments = [self.atom(each) for each in operation.arguments]
        if operation.kind == "real":  # constants of index arithmetic stay integers
            arguments = [
                self.constant(float(each)) if isinstance(each, int) and "[" not in operation.text else text
                for each, text in zip(operation.arguments, arguments, strict=True)
            ]
        text = operation.text.format(*arguments)
        head, sign, rest = text.partition("$")
        if not sign:
            return text
        name, bracket, inside = rest.partition("(")
        return f"{head}{name}{self.suffix}{bracket}{inside}"

    # ------------------------------------------------------------------ functions

    def lines(self, block: Block, outputs: Sequence[str], indent: str = "    ") -> Iterator[str]:
        """Yield the lines that compute a block and assign its results to `outputs`."""
        used = _used(block)
        for each in block.operations:
            if isinstance(each, Branch):
                yield from self._branch(each, used, indent)
            elif each.name in used:
                yield f"{indent}const {TYPES[each.kind]} {each.name} = {self.expression(each)};"
        for output, result in zip(outputs, block.results, strict=True):
            yield f"{indent}{output} = {self.atom(result)};"

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


def _of(block: Block, wanted: list[bool]) -> Block:
    """Return a block with the wanted of its results."""
    return Block(block.operations, tuple(compress(block.results, wanted)))


def _used(block: Block) -> set[str]:
    """Return the names that the results of a block depend on."""
    used = {each for each in block.results if isinstance(each, str)}
    for each in reversed(block.operations):
        if isinstance(each, Branch):
            wanted = [name in used for name, _ in each.outcomes]
            if any(wanted):
                used |= {each.condition} | _used(_of(each.yes, wanted)) | _used(_of(each.no, wanted))
        elif each.name in used:
            used.update(name for name in each.arguments if isinstance(name, str))
    return used
