"""Work that outlasts a drag, in a thread and given up when unwanted, and pictures that wait for the browser."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any

import panel as pn

from planarfriction.errors import FrictionError

PAUSE = 300
"""Time [ms] without another wish after which work begins, for `Live.soon`."""

TURN = 5e-4
"""Time [s] after which a thread lets the others go on; with the usual 5 ms a drag waits for a film at each turn."""


class GivenUp(Exception):
    """Ends work that nobody wants any more."""


class Task:
    """Handle of a piece of work: it calls the page, and checks that the work is still wanted."""

    def __init__(self, live: Live, document: Any):
        self._live = live
        self._document = document
        self._number = live.newest

    def check(self) -> None:
        """Check that the work is still wanted: raise `GivenUp` if another wish has come, or the page was closed."""
        session = self._document.session_context
        if self._number != self._live.newest or session is None or session.destroyed:
            raise GivenUp

    def tell(self, what: Callable[..., None], *values: Any) -> None:
        """Tell the page to call `what` with the values. Raises `GivenUp` as `check` does."""

        def in_page() -> None:
            if self._number == self._live.newest:
                what(*values)

        self.check()
        self._document.add_next_tick_callback(in_page)


class Live:
    """A kind of work of which the newest wish counts: another one, or `stop`, gives up what is being done.

    `failed` is called in the page with one line where the work is refused.
    """

    def __init__(self, failed: Callable[[str], None]):
        self.newest = 0
        """Number of the wish that counts."""
        self._failed = failed
        self._one_at_a_time = threading.Lock()
        self._timer = None
        sys.setswitchinterval(TURN)

    def soon(self, work: Callable[[Task], None]) -> None:
        """Begin the work in the next pause."""
        document = self.stop()
        self._timer = document.add_timeout_callback(
            lambda: self._begin(document, work), PAUSE
        )

    def now(self, work: Callable[[Task], None]) -> None:
        """Begin the work at once."""
        self._begin(self.stop(), work)

    def stop(self) -> Any:
        """Give up what is being done; return the document of the page."""
        document: Any = pn.state.curdoc
        self.newest += 1
        if self._timer is not None:
            document.remove_timeout_callback(self._timer)
            self._timer = None
        return document

    def _begin(self, document: Any, work: Callable[[Task], None]) -> None:
        self._timer, task = None, Task(self, document)

        def run() -> None:
            with self._one_at_a_time, contextlib.suppress(GivenUp):
                try:
                    task.check()
                    work(task)
                except FrictionError as error:
                    task.tell(self._failed, str(error))

        threading.Thread(target=run, daemon=True).start()


FLUENT = 0.1
"""Time [s] from a change to its picture up to which a browser keeps up with a drag."""

CATCH_UP = 250
"""Time [ms] without a change after which a browser that does not keep up draws all the same."""

_ANSWER = "requestAnimationFrame(() => requestAnimationFrame(() => { drawn.value = cb_obj.value }))"
"""Script for the browser: it answers two frames later, when the picture is on the screen. It takes the
counter as `cb_obj`: Panel keeps a widget indefinitely that is also an argument of its own script."""


class Paced:
    """Draws now where the browser has drawn the last picture, and drew it fluently; else in the next pause.

    A browser with a graphics processor draws a limit surface in a hundredth of a second, one without in half a second,
    in which it does nothing else.
    """

    def __init__(self, draw: Callable[[], None]):
        self._draw = draw
        self._took = float("inf")
        self._sent = 0.0
        self._late = False
        self._timer = None
        self._busy = False
        self.asked: Any = pn.widgets.IntInput(value=0, visible=False)
        self.drawn: Any = pn.widgets.IntInput(value=0, visible=False)
        self.asked.jscallback(value=_ANSWER, args={"drawn": self.drawn})
        # As `drawn` is kept with the script as long as `asked` lives.
        this = weakref.proxy(self)
        self.drawn.param.watch(lambda _: this._answered(), "value")

    def ask(self) -> None:
        """Draw what there is to draw, now or soon."""
        document: Any = pn.state.curdoc
        # The first picture comes with the page.
        if document is None or self.asked.value == 0:
            self._send()
        elif self._took > FLUENT:
            if self._timer is not None:
                document.remove_timeout_callback(self._timer)
            self._timer = document.add_timeout_callback(self._send, CATCH_UP)
        elif self._busy:
            self._late = True
        else:
            self._send()

    def _send(self) -> None:
        self._timer = None
        self._late = False
        self._busy = True
        self._sent = time.perf_counter()
        self._draw()
        self.asked.value += 1

    def _answered(self) -> None:
        self._took = time.perf_counter() - self._sent
        self._busy = False
        if self._late:
            self.ask()
