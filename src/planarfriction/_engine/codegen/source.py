"""Python source of traced operations, and its functions."""

from __future__ import annotations

import hashlib
import linecache
import re
from collections.abc import Iterator, Sequence
from typing import Any

from planarfriction._engine.codegen.trace import Operation


def identifier(atom: Any) -> str:
    """Return a name of a trace as one of Python (`law.mu_c` as `law_mu_c`), or a constant."""
    return re.sub(r"\W+", "_", atom).strip("_") if isinstance(atom, str) else repr(atom)


def line_of(operation: Operation) -> str:
    """Return the line of an operation."""
    return f"{operation.name} = {operation.operator.python.format(*map(identifier, operation.arguments))}"


def names_in(operation: Operation) -> Iterator[str]:
    """Yield the names that an operation reads."""
    return (each for each in operation.arguments if isinstance(each, str))


def needed(operations: Sequence[Operation], results: Sequence[Any]) -> list[Operation]:
    """Return the operations that results, names or constants, depend on."""
    used = {each for each in results if isinstance(each, str)}
    found = []
    for each in reversed(operations):
        if each.name in used:
            used.update(names_in(each))
            found.append(each)
    return found[::-1]


def text_of(head: str, lines: Sequence[str]) -> str:
    """Return the source of a function."""
    return "\n    ".join([f"def {head}:", *lines]) + "\n"


def run_source(where: str, source: str, names: dict[str, Any]) -> dict[str, Any]:
    """Run generated source, and let tracebacks show it."""
    file = f"<code of {where} {hashlib.sha256(source.encode()).hexdigest()[:8]}>"
    linecache.cache[file] = len(source), None, source.splitlines(True), file
    space = dict(names)
    exec(compile(source, file, "exec"), space)
    return space
