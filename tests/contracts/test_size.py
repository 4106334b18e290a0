"""Sizes that keep the code readable: lines of files and functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = ("src", "studies/src")

MAX_FILE = 400
"""Lines of a source file; a longer one is two things."""

MAX_FUNCTION = 60
"""Lines of a function without its docstring."""

TOO_LONG = {"tables.tables"}
"""Functions that are longer still: they shrink, and none is added."""


def functions(folder: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield each function below a folder, nested ones and methods too, with its module's and its own name."""
    for file in sorted((ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                yield f"{file.stem}.{node.name}", node


def lines(function: ast.FunctionDef) -> int:
    """Return the number of lines of a function, from `def` on, without its docstring."""
    first = function.body[0]
    docstring = 0 if ast.get_docstring(function) is None else first.end_lineno - first.lineno + 1
    return function.end_lineno - function.lineno + 1 - docstring


def test_files_stay_short():
    files = [file for folder in SOURCES for file in (ROOT / folder).rglob("*.py")]
    number = {file: len(file.read_text(encoding="utf-8").splitlines()) for file in files}
    assert {str(file): count for file, count in number.items() if count > MAX_FILE} == {}


def test_functions_stay_short():
    number = {name: lines(function) for folder in SOURCES for name, function in functions(folder)}
    assert {name for name, count in number.items() if count > MAX_FUNCTION} <= TOO_LONG


def test_lines_of_a_function_are_counted_without_its_docstring():
    code = 'def f(x):\n    """Return x.\n\n    Unchanged.\n    """\n    y = x\n    return y\n'
    assert lines(ast.parse(code).body[0]) == 3
    assert lines(ast.parse("def f(x):\n    return x").body[0]) == 2
