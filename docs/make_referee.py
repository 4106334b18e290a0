"""Put a run of the referee into README and the pages that show it: `python docs/make_referee.py [FOLDER]`.

FOLDER is that of `planarfriction referee --out`; without it, the tables are made again from docs/referee.json.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from planarfriction_studies.referee.case import all_cases
from planarfriction_studies.referee.report import shown, table
from planarfriction_studies.referee.run import Verdict

DOCS = Path(__file__).parent
KEPT, PAGES = (
    DOCS / "referee.json",
    [DOCS.parent / "README.md", DOCS / "index.md", DOCS / "referee.md"],
)
MARK = re.compile(
    r"<!-- referee: (?P<name>[\w ]+) -->\n\n(?:(?:(?:\||Run on |Not in ).*\n)+\n)?"
)

MISSING = "Not in this run.\n"

ROWS = {
    "in_hand": "rotation of a plate that slips 23 mm in a gripper",
    "push": "rotation of a box pushed off-centre",
}
"""Case -> its row of README and first page, an angle."""

PASSED = "cases within tolerance"
"""Row of README and first page with the number of cases that an engine passes."""

COUNTS = {"ok": "ok", "step [µs]": "median step [µs]"}
"""Heading in the table of engines -> row of the referee's table."""

SAID_ONCE = (
    *(", condim 3", "; single precision", ", Warp's CPU device", ", 21 cells across"),
    *("; feet at the corners for point contact, 1e4 N/m", " (a convex approximation)"),
)
"""Parts of the settings that the text above the table of engines says for all rows."""

SHOWN = (
    *("MuJoCo", "MuJoCo, elliptic", "MuJoCo, stiff", "MuJoCo, patches"),
    *("Drake", "Drake, surfaces", "Drake, patches"),
)
"""Engines in the table of cases: as they come, as MuJoCo's documentation advises, at the settings that pass the most
cases, and with patches."""

IN_README = ("MuJoCo", "MuJoCo, stiff", "MuJoCo, patches")
"""Engines of the rows of README: as it comes, at the settings that pass the most cases, and with patches."""

PACKAGES = {
    "MuJoCo": "mujoco", "MJX": "mujoco-mjx", "MuJoCo Warp": "mujoco-warp", "Drake": "drake", "PyBullet": "pybullet",
    "Newton": "newton",
}  # fmt: skip
"""Simulators and their packages, whose versions the table of engines names."""


def tables(stored: dict[str, Any]) -> dict[str, str]:
    """Return what stands below each mark of the page, from a stored run."""
    verdicts = [Verdict(**row) for row in stored["verdicts"]]
    (_, *engines), rows = table(verdicts)
    columns = {row[0]: dict(zip(engines, row[1:], strict=True)) for row in rows}
    passed = [
        [
            engine,
            stored["versions"][PACKAGES[engine.split(",")[0]]],
            brief(settings),
            *(columns[row][engine] for row in COUNTS.values()),
        ]
        for engine, settings in stored["settings"].items()
    ]
    versions = ", ".join(
        f"{name} {version}" for name, version in stored["versions"].items()
    )
    return {
        "run": f"Run on {stored['date']}: {stored['machine']}; {versions}.\n",
        "engines": markdown(["engine", "version", "settings", *COUNTS], passed),
        "cases": markdown(["case", *SHOWN], errors(verdicts)),
    }


def brief(settings: str) -> str:
    """Return the settings of an engine without the parts that the page says once for all of them."""
    for part in SAID_ONCE:
        settings = settings.replace(part, "")
    return settings.replace("as it comes", "default")


def errors(verdicts: Sequence[Verdict]) -> list[list[str]]:
    """Return a row for each case: its words, and the errors of the engines on the page, bold beyond what is allowed."""
    found = {(each.case, each.engine): each for each in verdicts}
    cells = {
        key: f"**{shown(each)}**" if each.mark in ("off", "fails") else shown(each)
        for key, each in found.items()
    }
    return [
        [
            f"`{case.name}`: {case.title}",
            *(cells.get((case.name, engine), "") for engine in SHOWN),
        ]
        for case in all_cases().values()
    ]


def rounded(error: float) -> str:
    """Return an error with one digit behind the point, or two if it is below 0.1."""
    return f"{error:.1f}" if error >= 0.095 else f"{error:.2f}"


def markdown(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as lines of a page."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def filled(page: str, stored: dict[str, Any]) -> str:
    """Return the page with the tables and the rows of a stored run."""
    found = tables(stored)
    verdicts = {
        (row["case"], row["engine"]): Verdict(**row) for row in stored["verdicts"]
    }
    rows = {
        words: " | ".join(
            f"{rounded(math.degrees(verdicts[case, engine].error or 0.0))}°"
            for engine in IN_README
        )
        for case, words in ROWS.items()
    }
    (_, *engines), lines = table(list(verdicts.values()))
    passed = next(line for line in lines if line[0] == "ok")
    count = dict(zip(engines, passed[1:], strict=True))
    rows[PASSED] = " | ".join(count[engine] for engine in IN_README)
    for words, cells in rows.items():
        begin = re.escape(f"| {words} |")
        row = f"| {words} | {cells} |"
        page = re.sub(rf"^{begin}.*$", lambda _, row=row: row, page, flags=re.MULTILINE)
    return MARK.sub(
        lambda match: (
            f"<!-- referee: {match['name']} -->\n\n{found.get(match['name'], MISSING)}\n"
        ),
        page,
    )


def main(folders: Sequence[str]) -> None:
    """Store a run, and fill the page."""
    for folder in folders:
        stored = json.loads((Path(folder) / "referee.json").read_text())
        for row in stored["verdicts"]:
            row.pop("path")  # films are on the page that the referee writes
        KEPT.write_text(json.dumps(stored, indent=1) + "\n")
    for page in PAGES:
        page.write_text(
            filled(page.read_text(encoding="utf-8"), json.loads(KEPT.read_text())),
            encoding="utf-8",
        )


if __name__ == "__main__":
    main(sys.argv[1:])
