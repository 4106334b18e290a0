"""Text of `help()` for a record: its docstring, then each argument with its meaning, shape and unit.

Those stand once, in the line below each field, where Python itself forgets them.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import itertools
import textwrap
from typing import Any, TypeVar

_KindT = TypeVar("_KindT", bound=type)

HEADING = "Arguments"
"""Heading of the list of arguments."""


def described(kind: _KindT) -> _KindT:
    """Decorate a dataclass or named tuple: `help()` shows its arguments too."""
    kind.__doc__ = _Description(kind.__doc__ or "")  # pyright: ignore[reportAttributeAccessIssue]
    return kind


def field_docs(kind: type) -> dict[str, str]:
    """Return the docstring below each field of a class and of its bases, from the source; none without a source."""
    found = {}
    for each in reversed(kind.__mro__):
        try:
            (tree,) = ast.parse(textwrap.dedent(inspect.getsource(each))).body
        except (
            OSError,
            TypeError,
            SyntaxError,
            ValueError,
        ):  # typed into a prompt, or made by Python itself
            continue
        body = getattr(tree, "body", [])
        for field, below in itertools.pairwise(body):
            name = getattr(getattr(field, "target", None), "id", None)
            if (
                isinstance(field, ast.AnnAssign)
                and name
                and isinstance(below, ast.Expr)
            ):
                words = getattr(below.value, "value", None)
                if isinstance(words, str):
                    found[name] = inspect.cleandoc(words)
    return found


class _Description:
    """A docstring that is completed when somebody reads it: sources are looked at then, and not at import."""

    def __init__(self, words: str):
        self._words = inspect.cleandoc(words)
        self._whole: str | None = None

    def __get__(self, record: object, kind: type) -> str:
        if self._whole is None:
            owner = next(
                (each for each in kind.__mro__ if each.__dict__.get("__doc__") is self),
                kind,
            )
            if (
                dataclasses.is_dataclass(owner)
                and "__match_args__" not in owner.__dict__
            ):
                return self._words  # the decorator `dataclass` is at work, and looks whether there is a docstring
            docs = field_docs(owner)
            lines = [
                f"{name}\n{textwrap.indent(docs[name], '    ')}"
                for name in _arguments(owner)
                if name in docs
            ]
            self._whole = "\n\n".join(
                [self._words, "\n".join([f"{HEADING}:", *lines])]
                if lines
                else [self._words]
            )
        return self._whole


def _arguments(kind: Any) -> list[str]:
    if dataclasses.is_dataclass(kind):
        return [field.name for field in dataclasses.fields(kind) if field.init]
    return list(getattr(kind, "_fields", ()))
