"""One line that explains why the first simulation after an installation takes so long."""

from __future__ import annotations

import contextlib
import multiprocessing
import sys
from collections.abc import Iterator
from typing import Any

from planarfriction.compiler.internals import part

Listener: Any = part("numba.core.event", "Listener", object)
listening: Any = part("numba.core.event", "install_listener", lambda kind, listener: contextlib.nullcontext())

_LINE = "planarfriction compiles its solver, once after installation (planarfriction.warm_up() does all of it ahead)"


def watched() -> bool:
    """Return True if somebody is watching this process: at a terminal, or in a notebook."""
    alone = multiprocessing.parent_process() is None
    return alone and ("ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty()))


class _Said(Listener):
    """Listener that prints a line when the first function is compiled; machine code from the cache needs none."""

    done = False

    def on_start(self, event: Any) -> None:
        if not _Said.done:
            _Said.done = True
            print(_LINE, file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass


def expect_compilation() -> None:
    """Say nothing in this process: whoever called knows that this compiles."""
    _Said.done = True


@contextlib.contextmanager
def said_when_compiling(silent: bool = False) -> Iterator[None]:
    """Tell the user, once in a process, if something is compiled in this block and somebody is watching."""
    if silent or _Said.done or not watched():
        yield
    else:
        with listening("numba:compile", _Said()):
            yield
