"""Pacing of slow pictures: they wait until the browser keeps up, so that the rest follows the hand."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import panel as pn

FLUENT = 0.1
"""Time [s] from a change to its picture up to which a browser keeps up with a drag."""

PAUSE = 250
"""Time [ms] without a change after which a browser that does not keep up draws all the same."""

_ANSWER = "requestAnimationFrame(() => requestAnimationFrame(() => { drawn.value = asked.value }))"
"""Script for the browser: it answers two frames later, when the picture is on the screen."""


class Paced:
    """Draws now where the browser has drawn the last picture, and drew it fluently; else in the next pause.

    A browser with a graphics processor draws a limit surface in a hundredth of a second, one without in half a second,
    in which it does nothing else.
    """

    def __init__(self, draw: Callable[[], None]):
        self._draw, self._took, self._sent, self._late, self._timer = draw, float("inf"), 0.0, False, None
        self._busy = False
        self.asked: Any = pn.widgets.IntInput(value=0, visible=False)
        self.drawn: Any = pn.widgets.IntInput(value=0, visible=False)
        self.asked.jscallback(value=_ANSWER, args={"asked": self.asked, "drawn": self.drawn})
        self.drawn.param.watch(self._answered, "value")

    def ask(self) -> None:
        """Draw what there is to draw, now or soon."""
        document: Any = pn.state.curdoc
        if document is None or self.asked.value == 0:  # the first picture comes with the page
            self._send()
        elif self._took > FLUENT:
            if self._timer is not None:
                document.remove_timeout_callback(self._timer)
            self._timer = document.add_timeout_callback(self._send, PAUSE)
        elif self._busy:
            self._late = True
        else:
            self._send()

    def _send(self) -> None:
        self._timer, self._late, self._busy, self._sent = None, False, True, time.perf_counter()
        self._draw()
        self.asked.value += 1

    def _answered(self, _: Any) -> None:
        self._took, self._busy = time.perf_counter() - self._sent, False
        if self._late:
            self.ask()
