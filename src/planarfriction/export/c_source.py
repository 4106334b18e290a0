"""C source of traced functions: C99 that is C++ too, of single or double precision."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import compress
from typing import Any

from planarfriction.export.trace import Block, Branch, Number, Operation, traced
from planarfriction.export.twins import twin

TYPES = {"real": "real", "index": "int", "wide": "long long", "bool": "int"}
"""C types by the kind of a number; `real` is a typedef."""


LEAST = 1.2e-38
"""Least positive constant of single precision: thresholds below it are raised."""


class Writer:
    """Differences between precisions: constants and the names of mathematical functions."""

    def __init__(self, precision: str = "double", own: bool = False) -> None:
        self.suffix = "f" if precision == "float" else ""
        self.own = own
        """True to call the library's own `exp_of` and `sin_of`, which compilers put into vector code."""

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
        if "@" in text:
            text = text.replace("@", "" if self.own else "$").replace("(", "_of(" if self.own else "(", 1)
        head, sign, rest = text.partition("$")
        if not sign:
            return text
        name, bracket, inside = rest.partition("(")
        return f"{head}{name}{self.suffix}{bracket}{inside}"

    # ------------------------------------------------------------------ functions

    def lines(self, block: Block, outputs: Sequence[str], indent: str = "    ") -> Iterator[str]:
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


def of_compiled(function: Any) -> list[str]:
    """Return the lines of the body of a function of `compiled_math`, in double precision."""
    block = traced(lambda trace: twin(function)(Number(trace, "x")))
    *lines, last = Writer().lines(block, ["return"])
    return [each.replace(" floor(", " floor_of(") for each in lines] + [last.replace("return =", "return")]


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
                used |= {each.condition} | used_by(_of(each.yes, wanted)) | used_by(_of(each.no, wanted))
        elif each.name in used:
            used.update(name for name in each.arguments if isinstance(name, str))
    return used
