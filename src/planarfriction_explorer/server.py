"""Server of the explorer, for this computer alone."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from typing import Any

from planarfriction._support import validation
from planarfriction.errors import FrictionError, InvalidValueError, MissingExtraError

LOOPBACK = "127.0.0.1"
"""The one address that is listened to: nobody else in the network can reach it."""

TITLE = "planarfriction explorer"


def serve(
    port: int = 0, *, browser: bool = True, ready: Callable[[str], None] | None = None
) -> None:
    """Serve the explorer at `port`, any free one for 0, until Ctrl-C.

    `browser` opens it there; `ready` is called with its address. Each visitor, and each tab of a browser, has a page
    that no other one changes.

    Raises `MissingExtraError` without Panel, the extra `[explore]`, `InvalidValueError` for a port that is none and
    `FrictionError` where it is taken.
    """
    server = open_server(port)
    from planarfriction_explorer.page import Page

    Page()  # one that nobody sees, so that what has to be compiled is so before the first visitor comes
    server.start()
    if browser:
        server.io_loop.add_callback(server.show, "/")
    if ready is not None:
        ready(f"http://localhost:{server.port}")
    server.run_until_shutdown()


def open_server(port: int) -> Any:
    """Return the server, which holds its port and answers once it is started."""
    port = validation.count("port", port, at_least=0, at_most=65535)
    try:
        import panel
    except ImportError:
        raise MissingExtraError("panel", "explore") from None
    from planarfriction_explorer import looks
    from planarfriction_explorer.page import Page

    panel.extension("plotly", raw_css=[looks.PAGE])
    heard = signal.getsignal(signal.SIGINT)
    try:
        server = panel.serve(
            lambda: Page().layout(),  # pyright: ignore[reportArgumentType]
            port=port,
            address=LOOPBACK,
            title=TITLE,
            start=False,
            show=False,
            verbose=False,
        )
        # Besides localhost, and no more: pages of other sites, which a browser has open beside this one, are refused.
        server._tornado.websocket_origins.add(f"{LOOPBACK}:{server.port}")  # pyright: ignore
        return server
    except OSError as error:
        if port == 0:
            raise FrictionError(f"no port can be opened: {error.strerror}") from None
        raise InvalidValueError("port", f"be free ({error.strerror})", port) from None
    finally:  # Panel takes Ctrl-C for its server, for the rest of the process
        if heard is not None and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, heard)
