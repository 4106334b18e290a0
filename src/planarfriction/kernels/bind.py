"""Entry points from templates: one loop, written once, as a compiled function of each model."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

from planarfriction.kernels.definitions import definition_of


def bind(template: Callable, model: Any, name: str, compiled: Callable[[Any], Any]) -> Any:
    """Return the entry point of a template, a plain function, for one model, `compiled` by `jit` or `entry`.

    Parameters of the template that are named as fields of `model`, a record, become constants; the entry point takes
    the others. It is a function with a name and no closure, so that its machine code can be kept on disk: the name is
    unique in the file of the template.
    """
    definition = definition_of(template)
    own = {each.arg: getattr(model, each.arg) for each in definition.args.args if each.arg in model._fields}
    left = [each for each in definition.args.args if each.arg not in own]
    arguments = ast.arguments(**{**vars(definition.args), "args": left})
    bound = ast.FunctionDef(**{**vars(definition), "name": name, "args": arguments})
    space = {**template.__globals__, **own}
    exec(compile(ast.Module([bound], []), template.__code__.co_filename, "exec"), space)
    return compiled(space[name])
