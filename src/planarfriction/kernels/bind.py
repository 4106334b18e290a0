"""Entry points from templates: one loop, written once, as a compiled function of each model."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any


def bind(template: Any, model: Any, name: str, compiled: Callable[[Any], Any]) -> Any:
    """Return the entry point of a template for one model, `compiled` by `jit` or `entry`.

    Parameters of the template that are named as fields of `model`, a record, are bound to these; the entry point takes
    the others. It is a function with a name and no closure, so that its machine code can be kept on disk: the name is
    unique in the file of the template.
    """
    parameters = list(inspect.signature(template.py_func).parameters)
    own = {each: getattr(model, each) for each in parameters if each in model._fields}
    given = ", ".join(each for each in parameters if each not in own)
    text = f"def {name}({given}):\n    return template({', '.join(parameters)})\n"
    space = {"__name__": template.py_func.__module__, "template": template, **own}
    exec(compile(text, template.py_func.__code__.co_filename, "exec"), space)
    space[name].__doc__ = template.py_func.__doc__
    return compiled(space[name])
