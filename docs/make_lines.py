"""Set the line of each link to code on the pages, `[name](../src/file.py#L12)`: where its function or class begins."""

from __future__ import annotations

import ast
import re
from pathlib import Path

HERE = Path(__file__).parent
LINK = re.compile(
    r"\[`(?P<name>[\w.]+)`\]\((?P<file>\.\./src/[\w/]+\.py)#L(?P<line>\d+)\)"
)


def line_of(file: Path, name: str) -> int:
    """Return the line on which a function or class of a file begins, by the last part of its name."""
    wanted = name.rpartition(".")[2]
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and node.name == wanted:
            return node.lineno
    raise LookupError(f"{file} has no {wanted}")


def updated(text: str) -> str:
    """Return the text of a page with the lines of its links as they are now."""

    def link(found: re.Match[str]) -> str:
        line = line_of(HERE / found["file"], found["name"])
        return f"[`{found['name']}`]({found['file']}#L{line})"

    return LINK.sub(link, text)


if __name__ == "__main__":
    for page in sorted(HERE.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        page.write_text(updated(text), encoding="utf-8")
