"""Put tables and pictures of a comparison on measured data into the pages: `python docs/make_measured.py FOLDER`.

The folder is that of `planarfriction measured --out FOLDER`, which is run first where it has no measured.json. A table
stands below a line `<!-- measured: TASK -->`.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planarfriction.cli import main as planarfriction
from planarfriction_studies.measured import TASKS

MARK = re.compile(r"<!-- measured: (?P<task>.+?) -->\n\n(?:(?:\|.*\n)+\n)?")
PICTURES = (
    "measured-slides.png",
    "measured-slides-paths.png",
    "measured-pushes.png",
)


def scores(task: str, stored: Mapping[str, Any]) -> list[list[str]]:
    """Headings and rows: models by measures, with intervals; those that the authors published below.

    A star marks a model whose difference from the reference on the same cases has an interval without zero.
    """
    measures = TASKS[task].measures
    rows = []
    minus = stored["minus"]["models"]
    for name, model in stored["models"].items():
        cells = []
        for key in (measure.key for measure in measures):
            if (found := model["scores"].get(key)) is None:
                cells.append("")
                continue
            low, high = found["interval_95"]
            star = "*" if name in minus and differs(minus[name][key]) else ""
            cells.append(f"{found['value']:.2f}{star} [{low:.2f}, {high:.2f}]")
        rows.append([name, *cells])
    for name, means in stored.get("published", {}).items():
        rows.append(
            [name, *(f"{means[m.key]:.2f}" if m.key in means else "" for m in measures)]
        )
    return [["model", *(measure.heading for measure in measures)], *rows]


def differs(difference: list[float]) -> bool:
    """Return True if an interval, behind its value, has no zero to the digits that the page shows."""
    _, low, high = (round(each, 2) for each in difference)
    return low * high > 0.0


def markdown(rows: list[list[str]]) -> str:
    """Rows as lines of a page, the first as headings."""
    return "".join(
        f"| {' | '.join(row)} |\n"
        for row in [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    )


def with_tables(page: str, tasks: Mapping[str, Any]) -> str:
    """The text of a page with the tables that it names."""

    def table(found: re.Match[str]) -> str:
        task = found["task"]
        return f"<!-- measured: {task} -->\n\n{markdown(scores(task, tasks[task]))}\n"

    return MARK.sub(table, page)


def main(folder: Path) -> None:
    """Rewrite the pages and the pictures, and say which."""
    if not (folder / "measured.json").exists() and planarfriction(
        ["measured", "--out", str(folder)]
    ):
        sys.exit(1)
    tasks = json.loads((folder / "measured.json").read_text(encoding="utf-8"))["tasks"]
    pages = Path(__file__).parent
    for path in sorted(pages.glob("*.md")):
        text = path.read_text(encoding="utf-8")
        if MARK.search(text):
            path.write_text(with_tables(text, tasks), encoding="utf-8")
            print(f"{path.name}: {len(MARK.findall(text))} tables")
    for name in PICTURES:
        shutil.copy(folder / name, pages / "images" / name)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
