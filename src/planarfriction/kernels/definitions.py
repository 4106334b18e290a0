"""Syntax trees of functions, of which each file is parsed once: `inspect` reads a file anew for every function."""

from __future__ import annotations

import ast
import functools
import linecache
from collections.abc import Callable


@functools.lru_cache(maxsize=256)
def _definitions(source: str) -> dict[int, ast.FunctionDef]:
    """Return the functions of a file by their first line, that of a decorator if there is one."""
    found = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef))
    return {min([node.lineno, *(each.lineno for each in node.decorator_list)]): node for node in found}


def definition_of(function: Callable) -> ast.FunctionDef:
    """Return the syntax tree of a function, not to be changed.

    Raises OSError if its source is not to be had.
    """
    code = function.__code__
    try:
        lines = linecache.getlines(code.co_filename, function.__globals__)
        return _definitions("".join(lines))[code.co_firstlineno]
    except (KeyError, SyntaxError) as error:
        raise OSError(f"no source of {function.__qualname__} in {code.co_filename}") from error
