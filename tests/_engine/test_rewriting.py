"""Twins of functions are whole before another thread sees them."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

from planarfriction._engine.codegen.rebinding import Rewriting


def inner() -> str:
    return "original"


def middle() -> str:
    return inner()


def outer() -> str:
    return middle()


def test_threads_see_twins_whose_globals_are_there():
    half = threading.Event()
    asked = threading.Event()

    def finish(twin):
        if twin.__name__ == "middle":  # outer has begun, and has no global yet
            half.set()
            # As long as the other thread has to get hold of outer too soon.
            asked.wait(0.2)
        return twin

    twins = Rewriting([(inner, lambda: "twin")], finished=finish)

    def ask() -> str:
        assert half.wait(10.0)
        twin = twins(outer)
        asked.set()
        return twin()

    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(ask)
        assert twins(outer)() == "twin"
        assert other.result() == "twin"
