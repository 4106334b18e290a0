"""Work of compiled loops, which hold no lock, shared between threads."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any


def processors() -> int:
    """Return the number of processors that this process may use."""
    return (
        len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count() or 1
    )


def each(work: Callable[[Any], Any], items: Sequence[Any]) -> list[Any]:
    """Return `work(item)` for each of the items, on at most as many threads as there are processors."""
    if len(items) <= 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(min(len(items), processors())) as pool:
        return list(pool.map(work, items))


def share(count: int, most: int, work: Callable[[int, int], Any]) -> None:
    """Run `work(first, last)` over `count` items, on as many threads as there are processors, at most `most`."""
    if min(count, most) <= 1:
        work(0, count)
        return
    threads = min(processors(), count, most)
    bounds = [count * i // threads for i in range(threads + 1)]
    each(lambda span: work(*span), list(itertools.pairwise(bounds)))
