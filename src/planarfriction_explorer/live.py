"""Work that takes longer than a drag: in a thread, reported to the page in pieces, given up when no longer wanted."""

from __future__ import annotations

import contextlib
import sys
import threading
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
        self._live, self._document, self._number = live, document, live.newest

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
        self._failed, self._one_at_a_time, self._timer = failed, threading.Lock(), None
        sys.setswitchinterval(TURN)

    def soon(self, work: Callable[[Task], None]) -> None:
        """Begin the work in the next pause."""
        document = self._give_up()
        self._timer = document.add_timeout_callback(lambda: self._begin(document, work), PAUSE)

    def now(self, work: Callable[[Task], None]) -> None:
        """Begin the work at once."""
        self._begin(self._give_up(), work)

    def stop(self) -> None:
        """Give up what is being done."""
        self._give_up()

    def _give_up(self) -> Any:
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
