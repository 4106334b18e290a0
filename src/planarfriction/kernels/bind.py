"""Entry points from templates: one loop, written once, as a compiled function of each model."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

from planarfriction.kernels.definitions import definition_of


def bind(template: Callable, name: str, compiled: Callable[[Any], Any], **constants: Any) -> Any:
    """Return the entry point of a template for one model, `compiled` by `jit` or `entry`.

    Arguments that the template, a plain function, takes by keyword only become `constants`, of which it may leave some;
    the entry point takes the others. It is a function with a name and no closure, so that its machine code can be kept
    on disk: the name is unique in the file of the template.
    """
    definition = definition_of(template)
    bound = {each.arg: constants[each.arg] for each in definition.args.kwonlyargs}
    arguments = ast.arguments(**{**vars(definition.args), "kwonlyargs": [], "kw_defaults": []})
    function = ast.FunctionDef(**{**vars(definition), "name": name, "args": arguments})
    space = {**template.__globals__, **bound}
    exec(compile(ast.Module([function], []), template.__code__.co_filename, "exec"), space)
    return compiled(space[name])
