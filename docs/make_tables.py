"""Put what was measured into the pages that show it: `python docs/make_tables.py PLACE ...`.

A place is the folder of `planarfriction reproduce`, or a file that holds what `planarfriction bench --json` printed. A
table stands below a line `<!-- table: TITLE -->`, named as in the report or here; what an experiment found stands below
`<!-- verdict: EXPERIMENT -->`. A table below `<!-- table: TITLE; selection -->` keeps the rows and columns that the
page shows. What the places do not have stays as it is. So do pictures, but for those of `docs/images` that the reports
have drawn.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping, Sequence
from itertools import compress
from pathlib import Path
from typing import Any

from PIL import Image

MARK = re.compile(
    r"<!-- table: (?P<title>.+?)(?P<selection>; selection)? -->\n\n(?:(?:\|.*\n)+\n)?"
)
VERDICT = re.compile(r"<!-- verdict: (?P<name>.+?) -->\n\n(?:(?:[^\n#<!].*\n)+\n)?")

COST = {
    "in_hand.distributed": "in-hand run of 2 s, distributed",
    "in_hand.published": "in-hand run of 2 s, published reduced, load 1",
    "in_hand.reduced": "in-hand run of 2 s, `ReducedModel`, load 1",
    "step.published.loop": "one step of the published reduced model, compiled loop",
    "step.reduced.loop": "one step of `ReducedModel`, compiled loop, random twists",
    "step.distributed.loop": "one step of the distributed model, compiled loop",
    "gradient.published": "value and gradient of a 2,000-step rollout: all parameters, twists, normal forces",
    "gradient.reduced": "the same of `ReducedModel`",
    "import": "`import planarfriction`",
}
"""Benchmark -> its row in the table of costs."""


SECONDS = (("s", 1.0), ("ms", 1e3), ("µs", 1e6))
"""Units of time, and how many of them are a second; a time is shown in the first that it is a tenth of."""


LEFT_OUT = "tolerances of this report"
"""Columns whose heading begins so stay in the reports."""


def few_colours(image: Image.Image) -> Image.Image:
    """Return a picture in 128 colours; the median cut would repaint small marks of one role as those of another."""
    return image.convert("RGB").quantize(128, method=Image.Quantize.FASTOCTREE)


def markdown(table: Mapping[str, Any]) -> str:
    """A table of a report as lines of a page."""
    kept = [not heading.startswith(LEFT_OUT) for heading in table["headings"]]
    rows = [list(compress(row, kept)) for row in (table["headings"], *table["rows"])]
    rows.insert(1, ["---"] * sum(kept))
    return "".join(
        f"| {' | '.join(each if isinstance(each, str) else rounded(each) for each in row)} |\n"
        for row in rows
    )


def rounded(value: float) -> str:
    """A number with two digits."""
    return f"{float(f'{value:.2g}'):g}"


def with_tables(page: str, tables: Mapping[str, Mapping[str, Any]]) -> str:
    """The text of a page with the tables that it names, as far as there are any; costs not measured again stay."""

    def replaced(found: re.Match[str]) -> str:
        title = found["title"]
        if title == "Cost" and title in tables:
            return (
                f"<!-- table: {title} -->\n\n{_with_costs(found[0], tables[title])}\n"
            )
        if title in tables and found["selection"]:
            return f"<!-- table: {title}; selection -->\n\n{markdown(_selected(found[0], tables[title]))}\n"
        return (
            f"<!-- table: {title} -->\n\n{markdown(tables[title])}\n"
            if title in tables
            else found[0]
        )

    return MARK.sub(replaced, page)


def _selected(before: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Rows and columns of a table that the page shows, by the first column and by the headings."""
    lines = [
        line.strip("| ").split(" | ")
        for line in before.splitlines()
        if line.startswith("|")
    ]
    columns = [k for k, heading in enumerate(table["headings"]) if heading in lines[0]]
    rows = [row for row in table["rows"] if row[0] in [line[0] for line in lines[2:]]]
    return {
        "headings": [table["headings"][k] for k in columns],
        "rows": [[row[k] for k in columns] for row in rows],
    }


def _with_costs(before: str, table: Mapping[str, Any]) -> str:
    """Lines of the table of costs, each the new one or else the one that the page has."""
    lines = {
        name: line
        for name in COST
        for line in before.splitlines()
        if line.endswith(f"| `{name}` |")
    }
    head, ruler, *new = markdown(table).splitlines()
    lines |= {
        name: line for name in COST for line in new if line.endswith(f"| `{name}` |")
    }
    return (
        "\n".join([head, ruler, *(lines[name] for name in COST if name in lines)])
        + "\n"
    )


def with_verdicts(page: str, verdicts: Mapping[str, str]) -> str:
    """The text of a page with what the experiments found that it names, as far as it is known."""

    def replaced(found: re.Match[str]) -> str:
        name = found["name"]
        return (
            f"<!-- verdict: {name} -->\n\n{verdicts[name]}\n\n"
            if name in verdicts
            else found[0]
        )

    return VERDICT.sub(replaced, page)


def shown(value: float, unit: str) -> str:
    """A time as one reads it, with two digits; another quantity as it is."""
    if unit in ("s", "us"):
        seconds = value * (1.0 if unit == "s" else 1e-6)
        unit, factor = next(
            each for each in SECONDS if seconds >= 0.1 / each[1] or each is SECONDS[-1]
        )
        value = factor * seconds
    return f"{rounded(value)} {unit}"


def costs(lines: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The table of costs, by its title; none without its benchmarks."""
    found = {line["name"]: line for line in lines if line["value"] is not None}
    rows = []
    for name, words in COST.items():
        if name in found:
            line = found[name]
            beside = (
                f"{shown(line['baseline_value'], line['unit'])}: {line['baseline']}"
            )
            rows.append(
                (
                    words,
                    shown(line["value"], line["unit"]),
                    beside,
                    line["ratio"],
                    f"`{name}`",
                )
            )
    headings = ("quantity", "cost", "baseline, in the same run", "ratio", "name")
    return {"Cost": {"headings": headings, "rows": rows}} if rows else {}


def main(places: Sequence[Path]) -> None:
    """Rewrite every page that shows what the places hold, and say which."""
    folders = [place for place in places if place.is_dir()]
    records = [
        json.loads(path.read_text("utf-8"))
        for folder in folders
        for path in sorted(folder.glob("*/result.json"))
    ]
    lines = [
        line
        for place in places
        if not place.is_dir()
        for line in json.loads(place.read_text("utf-8"))
    ]
    tables = {
        table["title"]: table for record in records for table in record["tables"]
    } | costs(lines)
    verdicts = {
        record["name"]: record["verdict"] for record in records if record["verdict"]
    }
    docs = Path(__file__).parent
    for path in sorted(docs.glob("*.md")):
        before = path.read_text(encoding="utf-8")
        after = with_verdicts(with_tables(before, tables), verdicts)
        if after != before:
            path.write_text(after, encoding="utf-8")
            print(f"{path.name}: new numbers")
    for drawn in sorted(path for folder in folders for path in folder.glob("*/*.png")):
        picture = docs / "images" / drawn.name.replace("_", "-")
        if picture.exists():
            with Image.open(drawn) as image:
                few_colours(image).save(picture, optimize=True)
            print(f"images/{picture.name}: {picture.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main([Path(each) for each in sys.argv[1:]])
