"""The report: one HTML file with its figures inside, made from the stored results."""

from __future__ import annotations

import base64
import datetime
import itertools
from pathlib import Path
from typing import Any

from planarfriction import __version__
from planarfriction.writing import write_text
from planarfriction_studies.experiments import markup
from planarfriction_studies.experiments.reproduction import Record, Reproduction, machine
from planarfriction_studies.experiments.wording import environment

Rows = list[dict[str, Any]]

WIDEST = 1440
"""Width of most figures [px]; narrower ones are shown narrower, so that all have letters of one size."""


def write_report(reproduction: Reproduction) -> Path:
    """Write `report.html` from all results kept in the folder; returns its path."""
    from markupsafe import Markup

    page = environment().overlay()
    page.filters |= {
        "markdown": lambda text: Markup(markup.to_html(text)),
        "inline": lambda text: Markup(markup.inline(text)),
        "symbols": lambda text: Markup(markup.name_to_html(str(text))),
        "percent": percent,
    }
    counter = itertools.count(1)
    sections = [_section(record, reproduction.folder / record["name"], counter) for record in reproduction.records()]
    rows = [row for section in sections for row in section["comparisons"]]
    text = page.get_template("report.html.j2").render(
        sections=sections,
        every={"all": _summary(rows)} | _by_kind(rows),
        version=__version__,
        date=datetime.date.today().isoformat(),
        machine=machine(),
        mode="quick" if reproduction.quick else "full" if reproduction.full else "normal",
        seconds=sum(section["seconds"] for section in sections),
    )
    path = reproduction.folder / "report.html"
    write_text(path, text)
    return path


def percent(share: float | None) -> str:
    """Return a share as a percentage with two digits; nothing for None."""
    return "" if share is None else f"{100.0 * share:.2g}"


def _section(record: Record, home: Path, counter: Any) -> Record:
    """Return a record with its pictures as numbered data, and its comparisons split by their kind of reference."""
    comparisons = record["comparisons"]
    return record | {
        "pictures": [
            picture | _image(home / f"{picture['name']}.png") | {"index": next(counter)}
            for picture in record["pictures"]
        ],
        "every": _summary(comparisons),
        **_by_kind(comparisons),
    }


def _by_kind(rows: Rows) -> dict[str, Any]:
    """Split rows by their reference: exact or converged, and published."""
    return {
        "exact": _summary([row for row in rows if row["reference"] != "published"]),
        "paper": _summary([row for row in rows if row["reference"] == "published"]),
    }


def _summary(rows: Rows) -> dict[str, Any]:
    """Summarise rows: all, those out of tolerance, by cause, and the largest shares of span, ours and the paper's."""
    causes = dict.fromkeys(row["cause"] for row in rows)
    shares = [row["share"] for row in rows if row["share"] is not None]
    paper = [row["paper"] / row["span"] for row in rows if row["paper"] and row["span"]]
    return {
        "rows": rows,
        "missed": [row for row in rows if not row["holds"]],
        "groups": [(cause, [row for row in rows if row["cause"] == cause]) for cause in causes],
        "share": max(shares, default=None),
        "paper_share": max(paper, default=None),
        "of_tolerance": max((row["difference"] / row["tolerance"] for row in rows if row["tolerance"]), default=None),
    }


def _image(path: Path) -> dict[str, Any]:
    """Return the source of an image that travels inside the page, and its width over that of the widest [%]."""
    try:
        data = path.read_bytes()
    except OSError:
        return {"source": "", "width": 100}  # someone removed it: its caption still says what it was
    width = int.from_bytes(data[16:20], "big")  # of the header of a PNG
    source = "data:image/png;base64," + base64.b64encode(data).decode()
    return {"source": source, "width": min(100, round(100 * width / WIDEST))}
