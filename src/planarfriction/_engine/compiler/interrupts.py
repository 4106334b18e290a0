"""Ctrl-C while compiling: it waits for the end of the compiler's pass.

LLVM calls back into Python. An exception that rises there is printed and forgotten, and the run would go on.
"""

from __future__ import annotations

import contextlib
import inspect
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

from numba.core import event


class _Keyboard(event.Listener):
    """Listener that holds Ctrl-C back and hands it on between passes, where an exception does no harm."""

    def __init__(self) -> None:
        self.hear: Callable[..., Any] | None = None
        """Handler of the signal, which hears of Ctrl-C later."""
        self.pressed = False

    def hold(self, number: int, frame: Any) -> None:
        """Record the signal, in place of its handler."""
        self.pressed = True

    def hand_on(self) -> None:
        """Call the handler that Ctrl-C would have called."""
        if self.pressed and self.hear is not None and _in_main_thread():
            self.pressed = False
            self.hear(signal.SIGINT, inspect.currentframe())

    def on_start(self, event: Any) -> None:
        """Hand Ctrl-C on before each pass."""
        self.hand_on()

    def on_end(self, event: Any) -> None:
        """Do nothing: a pass may have ended with an error, which is not to be hidden."""


_keyboard = _Keyboard()
event.register("numba:run_pass", _keyboard)


def _in_main_thread() -> bool:
    # No other hears signals.
    return threading.current_thread() is threading.main_thread()


@contextlib.contextmanager
def heard_between_passes() -> Iterator[None]:
    """Hear Ctrl-C within this block before the next pass of Numba's compiler, or at the end of the block."""
    hear = signal.getsignal(signal.SIGINT)
    if not _in_main_thread() or not callable(hear) or hear == _keyboard.hold:
        yield
        return
    _keyboard.hear = hear
    _keyboard.pressed = False
    signal.signal(signal.SIGINT, _keyboard.hold)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, hear)
        _keyboard.hand_on()
