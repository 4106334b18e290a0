"""Syntax trees of functions, of which each file is parsed once (`inspect` does it anew each time), and templates."""

from __future__ import annotations

import ast
import functools
import inspect
import linecache
import textwrap
from collections.abc import Callable
from typing import Any


@functools.lru_cache(maxsize=256)
def _definitions(source: str) -> dict[int, ast.FunctionDef]:
    """Return the functions of a file by their first line, decorators included."""
    nodes = (
        node
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef)
    )
    return {
        min([node.lineno, *(each.lineno for each in node.decorator_list)]): node
        for node in nodes
    }


def definition_of(function: Callable) -> ast.FunctionDef:
    """Return the syntax tree of a function, not to be changed, with the numbers of its lines in the file.

    Raises OSError if its source is not to be had.
    """
    code = function.__code__
    lines = linecache.getlines(code.co_filename, function.__globals__)
    try:
        return _definitions("".join(lines))[code.co_firstlineno]
    except (KeyError, SyntaxError):  # part of a file of another kind
        (definition,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
        return ast.increment_lineno(definition, code.co_firstlineno - 1)  # type: ignore[return-value]


def bind(
    template: Callable, name: str, compiled: Callable[[Any], Any], **constants: Any
) -> Any:
    """Return the entry point of a template for one model, `compiled` by `jit` or `entry`.

    Arguments that the template, a plain function, takes by keyword only become `constants`, of which it may leave some;
    the entry point takes the others. It is a function with a name and no closure, so that its machine code can be kept
    on disk: the name is unique in the file of the template.
    """
    definition = definition_of(template)
    bound = {each.arg: constants[each.arg] for each in definition.args.kwonlyargs}
    arguments = ast.arguments(
        **{**vars(definition.args), "kwonlyargs": [], "kw_defaults": []}
    )
    function = ast.FunctionDef(**{**vars(definition), "name": name, "args": arguments})
    space = {**template.__globals__, **bound}
    exec(
        compile(ast.Module([function], []), template.__code__.co_filename, "exec"),
        space,
    )
    return compiled(space[name])
