"""Count the words of prose of the pages: `python docs/count_words.py`; `make docs` prints them.

Prose is text outside code blocks, tables, display equations and HTML comments; a link counts by its text.
"""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted((ROOT / "docs").glob("*.md")),
]
"""Pages that users read, with the files of the repository that stand on the site."""

NOT_PROSE = re.compile(
    r"^```.*?^```$|^\$\$.*?\$\$$|^\|.*?$|<!--.*?-->|(?<=\])\([^)\s]*\)|!\[[^]]*\]",
    re.MULTILINE | re.DOTALL,
)
"""Code, equations, rows of tables, comments, targets of links, and pictures."""


def words(text: str) -> int:
    """Return the number of words of prose in the text of a page."""
    return len(re.findall(r"[^\W_][\w.,'-]*", NOT_PROSE.sub(" ", text)))


def report() -> list[str]:
    """Return a line with the number of words of each page, and one with their sum."""
    counts = {page: words(page.read_text(encoding="utf-8")) for page in PAGES}
    lines = [f"{n:6}  {page.relative_to(ROOT)}" for page, n in counts.items()]
    return [*lines, f"{sum(counts.values()):6}  words of prose on {len(counts)} pages"]


if __name__ == "__main__":
    print("\n".join(report()))
