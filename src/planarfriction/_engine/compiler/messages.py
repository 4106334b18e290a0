"""One line that explains why the first call after an installation takes so long."""

from __future__ import annotations

import multiprocessing
import sys
from typing import Any

from planarfriction._engine.compiler.numba_compat import part

Listener: Any = part("numba.core.event", "Listener", object)
register: Any = part("numba.core.event", "register", lambda kind, listener: None)

_LINE = "planarfriction compiles its loops, once after installation (planarfriction.warm_up() does all of it ahead)"

WIDTH = 60
"""Columns of a line that is written over."""


def watched() -> bool:
    """Return True if somebody is watching this process: at a terminal, or in a notebook."""
    alone = multiprocessing.parent_process() is None
    return alone and (
        "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())
    )


def show(words: str) -> None:
    """Write over the line before, for whoever watches."""
    print(f"\r{words}".ljust(WIDTH), end="", file=sys.stderr, flush=True)


class _Said(Listener):
    """Listener that prints a line when the first function is compiled; machine code from the cache needs none."""

    done = False

    def on_start(self, event: Any) -> None:
        # None of functions that are made from others.
        module = event.data["dispatcher"].py_func.__module__ or ""
        if _Said.done or not module.startswith("planarfriction"):
            return
        _Said.done = True
        if watched():
            print(_LINE, file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass


def expect_compilation() -> None:
    """Say nothing in this process: whoever called knows that this compiles."""
    _Said.done = True


register("numba:compile", _Said())
