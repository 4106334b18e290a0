"""A memory of bounded length for what a model builds, which any number of threads may use."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

T = TypeVar("T")


class Remembered(Generic[T]):
    """Results for the last `most` keys; none of them changes, and nothing that someone holds is taken away.

    Threads build at the same time. Where two of them build for one key, both get what the first one has put in.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._results: dict[Hashable, T] = {}
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[type, tuple[int]]:
        return Remembered, (self._most,)  # threads share a memory, copies of a model do not

    def get(self, key: Hashable, build: Callable[[], T]) -> T:
        """Return the result for `key`; `build` makes it if it is missing."""
        found = self._results.get(key)
        if found is None:
            built = build()
            with self._lock:
                found = self._results.setdefault(key, built)
                while len(self._results) > self._most:
                    del self._results[next(iter(self._results))]
        return found
