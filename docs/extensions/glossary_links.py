"""Terms of the glossary are linked where a page uses them first, so that pages need no roles for it."""

from __future__ import annotations

import re
from typing import Any

from code_links import ancestors
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util.nodes import make_refnode

NOT_IN = (
    nodes.reference,
    nodes.title,
    nodes.literal,
    nodes.literal_block,
    nodes.math,
    nodes.math_block,
    nodes.caption,
    nodes.term,
    nodes.thead,
    nodes.raw,
)
LEFT_OUT = ("glossary", "changelog", "gallery/index", "notebooks/index", "api/", "cli")
"""Pages on which terms stay plain: lists, and pages for those who look something up."""


def spelled(term: str) -> str:
    """A pattern of the term in singular and plural: centres of rotation, load families, contact radii."""
    words = [re.escape(word) for word in term.lower().split()]
    words = [re.sub("y$", "(?:y|ies)", re.sub("us$", "(?:us|i)", word)) + "(?:s|es)?" for word in words]
    return r"\s+".join(words)


class GlossaryLinks(SphinxPostTransform):
    """Links the first use of each term."""

    default_priority = 7

    def run(self, **kwargs: Any) -> None:
        del kwargs
        here = self.env.docname
        terms = {
            term: place for (kind, term), place in self.env.domains.standard_domain.objects.items() if kind == "term"
        }
        if here.startswith(LEFT_OUT) or not terms:
            return
        left = {term.lower(): place for term, place in terms.items()}
        for text in list(self.document.findall(nodes.Text)):
            if left and not any(isinstance(parent, NOT_IN) for parent in ancestors(text)):
                self._link(text, left)

    def _link(self, text: nodes.Text, left: dict[str, tuple[str, str]]) -> None:
        terms = sorted(left, key=len, reverse=True)
        words = "|".join(f"({spelled(term)})" for term in terms)
        pieces: list[nodes.Node] = []
        end, whole = 0, text.astext()
        for match in re.finditer(rf"(?<![\w-])(?:{words})(?![\w-])", whole, re.IGNORECASE):
            place = left.pop(terms[(match.lastindex or 1) - 1], None)
            if place is None:
                continue
            pieces.append(nodes.Text(whole[end : match.start()]))
            shown = nodes.inline("", match[0], classes=["term"])
            pieces.append(make_refnode(self.app.builder, self.env.docname, place[0], place[1], shown))
            end = match.end()
        if pieces and text.parent is not None:
            text.parent.replace(text, [*pieces, nodes.Text(whole[end:])])


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_post_transform(GlossaryLinks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
