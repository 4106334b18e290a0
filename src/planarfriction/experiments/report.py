"""The report: one HTML file with its figures inside, made from the stored results."""

from __future__ import annotations

import base64
import datetime
import itertools
from pathlib import Path
from typing import Any

from planarfriction import __version__
from planarfriction.experiments.reproduction import Record, Reproduction, machine
from planarfriction.writing import write_text


def write_report(reproduction: Reproduction) -> Path:
    """Write `report.html` from all results kept in the folder; returns its path."""
    import jinja2

    loader = jinja2.PackageLoader("planarfriction.experiments", "")
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["number"] = number
    counter = itertools.count(1)
    sections = [_section(record, reproduction.folder / record["name"], counter) for record in reproduction.records()]
    page = environment.get_template("report.html.j2").render(
        sections=sections,
        version=__version__,
        date=datetime.date.today().isoformat(),
        machine=machine(),
        mode="quick" if reproduction.quick else "full" if reproduction.full else "normal",
        seconds=sum(section["seconds"] for section in sections),
    )
    path = reproduction.folder / "report.html"
    write_text(path, page)
    return path


def number(value: Any) -> str:
    """A number as text with four digits; other things as they are; nothing for None."""
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    return f"{value:d}" if isinstance(value, int) else f"{value:.4g}"


def _section(record: Record, home: Path, counter: Any) -> Record:
    """A record with its pictures as data, numbered, and its comparisons grouped by the cause of their differences."""
    comparisons = record["comparisons"]
    causes = dict.fromkeys(row["cause"] for row in comparisons)
    return record | {
        "pictures": [
            picture | _image(home / f"{picture['name']}.png") | {"index": next(counter)}
            for picture in record["pictures"]
        ],
        "groups": [(cause, [row for row in comparisons if row["cause"] == cause]) for cause in causes],
        "missed": [row for row in comparisons if not row["holds"]],
        "share": max(
            (row["difference"] / row["tolerance"] for row in comparisons if row["tolerance"] > 0.0), default=0.0
        ),
    }


def _image(path: Path) -> dict[str, str]:
    """The source of an image that travels inside the page."""
    try:
        return {"source": "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()}
    except OSError:
        return {"source": ""}  # someone removed it: its caption still says what it was
