"""Memory of bounded length for parts that a model builds, for any number of threads."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

T = TypeVar("T")


class Remembered(Generic[T]):
    """Results for the last `most` keys; none changes, and none that someone holds is taken away.

    Threads build at the same time. Where two build for one key, both get the result of the first.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._results: dict[Hashable, T] = {}
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[type, tuple[int]]:
        return Remembered, (self._most,)  # threads share a memory, copies of a model do not

    def get(self, key: Hashable, build: Callable[[], T]) -> T:
        """Return the result for `key`; `build` makes it if it is missing."""
        result = self._results.get(key)
        if result is None:
            built = build()
            with self._lock:
                result = self._results.setdefault(key, built)
                while len(self._results) > self._most:
                    del self._results[next(iter(self._results))]
        return result
