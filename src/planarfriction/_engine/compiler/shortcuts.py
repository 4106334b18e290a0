"""Shortcuts of Numba's compiler while it compiles the package: types of operators, and no search for garbage.

Numba finds the type of `a * b` by trying dozens of rules, up to four times for each operation, and builds messages of
those that do not fit: a quarter of all its Python. Searching the objects of a compilation for cycles takes a tenth.
"""

from __future__ import annotations

import contextlib
import gc
import operator
import threading
from collections.abc import Iterator
from typing import Any

from numba.core import errors, types
from numba.core.types.functions import BaseFunction

from planarfriction._engine.compiler.numba_compat import need

need(BaseFunction, "get_call_type")

_OPERATORS = frozenset(
    value
    for name, value in vars(operator).items()
    if callable(value)
    and not name.startswith("_")
    and name not in ("getitem", "setitem", "delitem")
)
_NUMBERS = (
    types.Integer,
    types.Float,
    types.Boolean,
    types.IntegerLiteral,
    types.BooleanLiteral,
    types.Omitted,
)
_found: dict[tuple[int, tuple], tuple[Any, Any]] = {}
_searched = BaseFunction.get_call_type
_lock = threading.Lock()
_within = 0
_collected = True


def _looked_up(self: Any, context: Any, args: tuple, kws: Any) -> Any:
    """Return the signature of a call; those of operators on numbers are searched for once."""
    if (
        kws
        or self.typing_key not in _OPERATORS
        or not all(isinstance(each, _NUMBERS) for each in args)
    ):
        return _searched(self, context, args, kws)
    key = (id(self), args)
    if key not in _found:
        # The type is kept too, so that its id stays its own.
        try:
            _found[key] = (self, _searched(self, context, args, kws))
        except errors.TypingError as error:
            _found[key] = (self, error.with_traceback(None))
    result = _found[key][1]
    if isinstance(result, errors.TypingError):
        raise result
    return result


@contextlib.contextmanager
def shortcuts() -> Iterator[None]:
    """Take the shortcuts in this block; several threads may be in it."""
    global _within, _collected
    with _lock:
        if _within == 0:
            BaseFunction.get_call_type = _looked_up
            _collected = gc.isenabled()
            gc.disable()
        _within += 1
    try:
        yield
    finally:
        with _lock:
            _within -= 1
            if _within == 0:
                BaseFunction.get_call_type = _searched
                if _collected:
                    _spare()
                    gc.enable()


def _spare() -> None:
    """Let what was made count as old: it is searched with all else, which is rare."""
    if not gc.get_freeze_count():
        gc.freeze()
        gc.unfreeze()
