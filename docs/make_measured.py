"""Put tables and pictures of a comparison on measured data into the pages: `python docs/make_measured.py FOLDER`.

The folder is that of `planarfriction measured --out FOLDER`, which is run first where it has no measured.json. A table
stands below a line `<!-- measured: NAME -->`, with one of the names of `TABLES`.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from planarfriction.cli import main as planarfriction
from planarfriction_studies.measured import TASKS

MARK = re.compile(r"<!-- measured: (?P<name>.+?) -->\n\n(?:(?:\|.*\n)+\n)?")
PICTURES = {"measured-slides.png", "measured-pushes.png", "measured-series.png", "measured-onsets.png"}


def scores(task: str, stored: Mapping[str, Any]) -> list[list[str]]:
    """Headings and rows: models by measures, with intervals; those that the authors published below."""
    measures, rows = TASKS[task].measures, []
    for name, model in stored["models"].items():
        found = [model["scores"].get(measure.key) for measure in measures]
        cells = [
            "" if s is None else f"{s['value']:.2f} ({s['interval_95'][0]:.2f} to {s['interval_95'][1]:.2f})"
            for s in found
        ]
        rows.append([name, *cells])
    for name, means in stored.get("published", {}).items():
        rows.append([name, *(f"{means[m.key]:.2f}" if m.key in means else "" for m in measures)])
    return [["model", *(measure.heading for measure in measures)], *rows]


def differences(task: str, stored: Mapping[str, Any]) -> list[list[str]]:
    """Headings and rows: each model minus the reference, on the same cases."""
    measures, minus = TASKS[task].measures, stored["minus"]
    rows = []
    for name, found in minus["models"].items():
        cells = [f"{found[m.key][0]:+.2f} ({found[m.key][1]:+.2f} to {found[m.key][2]:+.2f})" for m in measures]
        rows.append([name, *cells])
    return [[f"minus {minus['reference']}", *(measure.heading for measure in measures)], *rows]


def fitted(task: str, stored: Mapping[str, Any]) -> list[list[str]]:
    """Headings and rows: what was fitted to the training cases."""
    told = {name: model["fitted"] for name, model in stored["models"].items() if model["fitted"]}
    keys = list(dict.fromkeys(key for found in told.values() for key in found))
    rows = [[name, *(f"{found[key]:.4g}" if key in found else "" for key in keys)] for name, found in told.items()]
    return [["fitted", *keys], *rows]


def checked(task: str, stored: Mapping[str, Any]) -> list[list[str]]:
    """Headings and rows: how large the models say that their errors are on the test cases."""
    told = {
        name: {key: value for key, value in model["checked"].items() if not isinstance(value, list)}
        for name, model in stored["models"].items()
        if model["checked"]
    }
    keys = list(dict.fromkeys(key for found in told.values() for key in found))
    rows = [[name, *(f"{found[key]:.2f}" if key in found else "" for key in keys)] for name, found in told.items()]
    return [["model", *keys], *rows]


THIRDS = [f"{which} {way}" for way in ("turn", "length") for which in ("least", "middle", "most")]


def regions(task: str, stored: Mapping[str, Any]) -> list[list[str]]:
    """Headings and rows: the share of test cases inside regions, of all and of thirds."""
    told = [model["checked"] for model in stored["models"].values() if model["checked"]]
    lists = {key: value for found in told for key, value in found.items() if isinstance(value, list)}
    return [["", "all", *THIRDS], *([key, *(f"{each:.0f}" for each in value)] for key, value in lists.items())]


TABLES: dict[str, tuple[str, Callable[[str, Mapping[str, Any]], list[list[str]]]]] = {
    **{task: (task, scores) for task in TASKS},
    **{f"{task} minus": (task, differences) for task in TASKS},
    "slides fitted": ("slides", fitted),
    "onsets fitted": ("onsets", fitted),
    "slides checked": ("slides", checked),
    "slides regions": ("slides", regions),
}


def markdown(rows: list[list[str]]) -> str:
    """Rows as lines of a page, the first as headings."""
    return "".join(f"| {' | '.join(row)} |\n" for row in [rows[0], ["---"] * len(rows[0]), *rows[1:]])


def with_tables(page: str, tasks: Mapping[str, Any]) -> str:
    """The text of a page with the tables that it names."""

    def table(found: re.Match[str]) -> str:
        task, make = TABLES[found["name"]]
        return f"<!-- measured: {found['name']} -->\n\n{markdown(make(task, tasks[task]))}\n"

    return MARK.sub(table, page)


def main(folder: Path) -> None:
    """Rewrite the pages and the pictures, and say which."""
    if not (folder / "measured.json").exists() and planarfriction(["measured", "--out", str(folder)]):
        sys.exit(1)
    tasks = json.loads((folder / "measured.json").read_text(encoding="utf-8"))["tasks"]
    pages = Path(__file__).parent
    for path in sorted(pages.glob("*.md")):
        text = path.read_text(encoding="utf-8")
        if MARK.search(text):
            path.write_text(with_tables(text, tasks), encoding="utf-8")
            print(f"{path.name}: {len(MARK.findall(text))} tables")
    for name in sorted(PICTURES):
        shutil.copy(folder / name, pages / "images" / name)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
