"""Results of the library, to be recorded in `tests/recorded`: see `tests.support.recording`."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tests.identify import golden as fits
from tests.limit_surface import golden as surfaces
from tests.support import bridged, computed, recorded, refused, replies, shown

FOLDER = Path(__file__).parents[1] / "recorded"


def each_of(sources: Mapping[str, Callable[[], Any]]) -> Callable[[], dict[str, Any]]:
    """Return a function that computes several results."""
    return lambda: {name: source() for name, source in sources.items()}


def check(name: str, found: Any, part: str | None = None) -> None:
    """Assert that a result, or a part of one, is the recorded one."""
    recorded.check(FOLDER / f"{name}.json", recorded.plain(found), part)


SUBJECTS: dict[str, Callable[[], Any]] = {
    "figures": shown.figures,
    "commands": shown.printed,
    "fits": each_of(fits.SOURCES),
    "surfaces": each_of(surfaces.SOURCES),
    **{each.__name__: each for each in (
        computed.patches, computed.grips, computed.scenes, computed.films,
        replies.replies, replies.swept, replies.explored, refused.refused,
    )},
    **bridged.SUBJECTS,
}  # fmt: skip
"""Name of a file -> function that computes what it holds."""

if importlib.util.find_spec("panel"):
    from tests.support import paged

    SUBJECTS["page"] = paged.page
