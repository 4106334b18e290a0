"""A memory for what a model builds, which any number of threads may use."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

T = TypeVar("T")


class Remembered(Generic[T]):
    """What was built for the last `most` keys; none of it changes, and nothing that someone holds is taken away.

    Threads build at the same time. Where two of them build for one key, both get what the first one has put in.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._kept: dict[Hashable, T] = {}
        self._lock = threading.Lock()

    def get(self, key: Hashable, build: Callable[[], T]) -> T:
        """What was built for `key`, or `build()`."""
        found = self._kept.get(key)
        if found is None:
            built = build()
            with self._lock:
                found = self._kept.setdefault(key, built)
                while len(self._kept) > self._most:
                    del self._kept[next(iter(self._kept))]
        return found
