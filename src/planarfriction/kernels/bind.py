"""Entry points from templates: one loop, written once, as a compiled function of each model."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable
from typing import Any


def bind(template: Callable, model: Any, name: str, compiled: Callable[[Any], Any]) -> Any:
    """Return the entry point of a template, a plain function, for one model, `compiled` by `jit` or `entry`.

    Parameters of the template that are named as fields of `model`, a record, become constants; the entry point takes
    the others. It is a function with a name and no closure, so that its machine code can be kept on disk: the name is
    unique in the file of the template.
    """
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(template))).body
    assert isinstance(definition, ast.FunctionDef)
    own = {each.arg: getattr(model, each.arg) for each in definition.args.args if each.arg in model._fields}
    definition.args.args = [each for each in definition.args.args if each.arg not in own]
    definition.name = name
    ast.increment_lineno(definition, template.__code__.co_firstlineno - 1)
    space = {**template.__globals__, **own}
    exec(compile(ast.Module([definition], []), template.__code__.co_filename, "exec"), space)
    return compiled(space[name])
