"""Put the tables of a reproduction into the pages that show them: `python docs/make_tables.py reproduction`.

The folder is that of `planarfriction reproduce`. A table stands below a line `<!-- table: TITLE -->`, named as in
the report.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

MARK = re.compile(r"<!-- table: (?P<title>.+?) -->\n\n(?:(?:\|.*\n)+\n)?")


def markdown(table: dict[str, Any]) -> str:
    """A table of a report as lines of a page."""
    rows = [table["headings"], ["---"] * len(table["headings"]), *table["rows"]]
    return "".join(
        f"| {' | '.join(each if isinstance(each, str) else f'{each:.2g}' for each in row)} |\n" for row in rows
    )


def with_tables(page: str, tables: dict[str, dict[str, Any]]) -> str:
    """The text of a page with the tables that it names."""
    return MARK.sub(lambda found: f"<!-- table: {found['title']} -->\n\n{markdown(tables[found['title']])}\n", page)


def main(reproduction: Path) -> None:
    """Rewrite every page that has tables, and say which."""
    records = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(reproduction.glob("*/result.json"))]
    tables = {table["title"]: table for record in records for table in record["tables"]}
    for path in sorted(Path(__file__).parent.glob("*.md")):
        text = path.read_text(encoding="utf-8")
        if MARK.search(text):
            path.write_text(with_tables(text, tables), encoding="utf-8")
            print(f"{path.name}: {len(MARK.findall(text))} tables")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
