"""Links between the pages and the repository: files beside `docs` that are pages here."""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx

PAGES = {"contributing": "CONTRIBUTING.md", "changelog": "CHANGELOG.md"}
"""Page -> the file of the repository that it is; the page beside this one only says so."""

LINKS = {
    r"(?:\.\./)?README\.md(?:#[\w-]+)?": "index.md#citation",
    r"(?:\.\./)?CONTRIBUTING\.md(#[\w-]+)?": r"contributing.md\1",
    r"(?:\.\./)?CHANGELOG\.md(#[\w-]+)?": r"changelog.md\1",
    r"docs/((?:images/)?[\w-]+\.(?:md|png)(?:#[\w-]+)?)": r"\1",
}
"""Link in a file of the repository -> link to the page."""


def rewrite(app: Sphinx, name: str, source: list[str]) -> None:
    """Replace the page by its file, and make links lead to pages."""
    if name in PAGES:
        path = Path(app.srcdir).parent / PAGES[name]
        app.env.note_dependency(path)
        source[0] = path.read_text(encoding="utf-8")
    for pattern, page in LINKS.items():
        source[0] = re.sub(rf"\]\({pattern}\)", rf"]({page})", source[0])
    if name == "index":
        source[0] = re.sub(r"^\*\n", "".join(f"{page}\n" for page in unlisted(app, source[0])), source[0], flags=re.M)


def unlisted(app: Sphinx, index: str) -> list[str]:
    """Pages that no list of the first page names: they stand where one has a line with a star."""
    pages = sorted(path.stem for path in Path(app.srcdir).glob("*.md"))
    return [page for page in pages if page != "index" and not re.search(rf"^{page}$", index, flags=re.M)]


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", rewrite)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
