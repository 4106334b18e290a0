"""Pages of the explorer that come and go: each gives its memory back."""

from __future__ import annotations

import gc
import random
from pathlib import Path

import pytest
from attack import attack
from judge import CASES, Broken

GROWTH = 0.1 * 2**20
"""Memory that a page may keep [bytes]."""

PAGES = 12


def resident() -> int:
    """Return the memory of this process [bytes]."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def visits(draw: random.Random, count: int) -> None:
    """Open pages one after the other, use each a little, and close it."""
    from planarfriction_explorer.page import Page

    for _ in range(count):
        page = Page()
        page.layout()
        page.controls.patch.value = draw.choice(["Circle", "Line", "Square"])
        page.controls.clear.clicks += draw.randint(0, 1)
        CASES["pages of the explorer, opened and closed"] += 1


@pytest.mark.slow
@attack("explorer", 1)
def test_pages_give_their_memory_back(draw: random.Random) -> None:
    pytest.importorskip("panel", reason="the explorer is not installed")
    visits(draw, PAGES)  # what the first pages load stays
    grown = []
    for _ in range(3):
        before = resident()
        visits(draw, PAGES)
        grown.append((resident() - before) / PAGES)
    if min(grown) > GROWTH:
        raise Broken(f"each page keeps {min(grown) / 2**20:.2f} MB")
