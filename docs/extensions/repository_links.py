"""Pages are plain Markdown; here their links into the repository and their lists get words of Sphinx."""

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
    r"docs/((?:images/|static/)?[\w-]+\.(?:md|png|html)(?:#[\w-]+)?)": r"\1",
}
"""Link in a file of the repository -> link to the page."""

DRESSED = {
    r"\[([^\]]+)\]\(static/([\w-]+\.html)\)": r'<a href="_static/\2">\1</a>',
    r"\[([^\]]+)\]\(\.\./examples/(gallery|notebooks)\)": r"{doc}`\1 <\2/index>`",
    r"\[([^\]]+)\]\(\.\./examples/((?:gallery|notebooks)/[\w/]+)\.py\)": r"{doc}`\1 <\2>`",
    r"\[([^\]]+)\]\(\.\./src/planarfriction\)": r"{doc}`\1 <api/index>`",
    r"\[([^\]]+)\]\(\.\./src/planarfriction/[\w/]+\.py#L\d+\)": r"\1",
    r"<!-- cards -->": "{.cards}",
    r"<!-- cards pictures -->": "{.cards .pictures}",
    r"<!-- commands -->": "```{eval-rst}\n.. click:: planarfriction.cli.app:app\n"
    "   :prog: planarfriction\n   :nested: full\n```",
}
"""Plain Markdown -> words of Sphinx."""

ITEM = re.compile(r"^- \*\*(.+)\*\*: (.*\n(?:  .*\n)*)", re.MULTILINE)
"""Pages of one kind, or a term and its meaning."""

PLACE = re.compile(r"\]\(([\w-]+)\.md\)|<([\w/]+)>`")
"""Page of a link."""


def rewrite(app: Sphinx, name: str, source: list[str]) -> None:
    """Replace the page by its file, make links lead to pages, and put Sphinx's own words for plain lists."""
    if name in PAGES:
        path = Path(app.srcdir).parent / PAGES[name]
        app.env.note_dependency(path)
        source[0] = path.read_text(encoding="utf-8")
    for pattern, page in LINKS.items():
        source[0] = re.sub(rf"\]\({pattern}\)", rf"]({page})", source[0])
    for pattern, words in DRESSED.items():
        source[0] = re.sub(pattern, words, source[0])
    if name == "index":
        text, _, lists = source[0].partition("## All pages\n")
        source[0] = text + ITEM.sub(contents, lists)
    if name == "glossary":
        source[0] = re.sub(
            rf"(?:{ITEM.pattern})+", glossary, source[0], flags=re.MULTILINE
        )


def contents(kind: re.Match[str]) -> str:
    """Return the table of contents of one kind of pages."""
    pages = [page or other for page, other in PLACE.findall(kind[2])]
    return "\n".join(
        [":::{toctree}", f":caption: {kind[1]}", ":hidden:", "", *pages, ":::", "", ""]
    )


def glossary(terms: re.Match[str]) -> str:
    """Return a list of terms as a glossary."""
    return ":::{glossary}\n" + ITEM.sub(r"\1\n  \2\n", terms[0]) + ":::\n"


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", rewrite)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
