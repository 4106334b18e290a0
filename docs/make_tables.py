"""Put the tables of a reproduction into the pages that show them: `python docs/make_tables.py reproduction`.

The folder is that of `planarfriction reproduce` or of `planarfriction simulators`. A table stands below a line
`<!-- table: TITLE -->`, named as in the report; tables that the folder does not have stay as they are. So do pictures,
but for those of the names that `docs/images` has.
"""

from __future__ import annotations

import json
import re
import shutil
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
    """The text of a page with the tables that it names, as far as there are any."""

    def replaced(found: re.Match[str]) -> str:
        title = found["title"]
        return f"<!-- table: {title} -->\n\n{markdown(tables[title])}\n" if title in tables else found[0]

    return MARK.sub(replaced, page)


def main(reproduction: Path) -> None:
    """Rewrite every page that has tables, and say which."""
    records = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(reproduction.glob("*/result.json"))]
    tables = {table["title"]: table for record in records for table in record["tables"]}
    docs = Path(__file__).parent
    for path in sorted(docs.glob("*.md")):
        before = path.read_text(encoding="utf-8")
        after = with_tables(before, tables)
        if after != before:
            path.write_text(after, encoding="utf-8")
            print(f"{path.name}: new numbers")
    for picture in sorted(reproduction.glob("*/*.png")):
        if (docs / "images" / picture.name).exists():
            shutil.copyfile(picture, docs / "images" / picture.name)
            print(f"images/{picture.name}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
