"""Work of compiled loops, which hold no lock, shared between threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any


def share(count: int, most: int, work: Callable[[int, int], Any]) -> None:
    """Run `work(first, last)` over `count` items, on as many threads as there are processors, at most `most`."""
    if min(count, most) <= 1:
        work(0, count)
        return
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads = min(available, count, most)
    bounds = [count * i // threads for i in range(threads + 1)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, bounds[:-1], bounds[1:]))
