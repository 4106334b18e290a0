"""`Names` of the library in backticks become links to their reference, on pages and in docstrings alike.

`LuGre`, `pf.LuGre(mu_s=1.2)`, `formulas.stribeck`, `ContactPatch.weights` are found; what names no public object stays
plain code. So pages need no roles, and read the same everywhere.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util.nodes import make_refnode

NAME = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*$")
CALL = re.compile(r"\(.*\)$")
PLAIN_WORDS = {"step", "state", "twist", "wrench", "rate"}
"""Names that are words too: parameters and columns are called so."""
PARENTS = (nodes.reference, nodes.title, nodes.term)


class CodeLinks(SphinxPostTransform):
    """Links literals of a page to the objects that the reference documents."""

    default_priority = 6

    def run(self, **kwargs: Any) -> None:
        del kwargs
        objects = self.env.domains.python_domain.objects
        ends = self._by_their_ends(objects)
        for literal in list(self.document.findall(nodes.literal)):
            if any(isinstance(parent, PARENTS) for parent in ancestors(literal)):
                continue
            found = self._object(CALL.sub("", literal.astext()), objects, ends)
            if found is None:
                continue
            target = objects[found]
            reference = make_refnode(
                self.app.builder,
                self.env.docname,
                target.docname,
                target.node_id,
                literal.deepcopy(),
                found,
            )
            literal.replace_self(reference)

    def _by_their_ends(self, objects: Any) -> dict[str, str | None]:
        """Last one or two parts of a full name -> the name, None where several share them."""
        if not hasattr(self.env, "_name_ends"):
            ends: dict[str, str | None] = {}
            for name, each in objects.items():
                if each.aliased or each.objtype in (
                    "method",
                    "attribute",
                    "property",
                    "module",
                ):
                    continue
                last = name.rsplit(".", 1)[-1]
                ends[last] = None if ends.get(last, name) != name else name
            self.env._name_ends = ends  # pyright: ignore
        return self.env._name_ends  # pyright: ignore

    @staticmethod
    def _object(text: str, objects: Any, ends: dict[str, str | None]) -> str | None:
        text = re.sub(r"^(pf|planarfriction)\.", "", text)
        text = re.sub(r"^pj\.", "jax.", text)
        if not NAME.match(text) or text in PLAIN_WORDS:
            return None
        if ("." in text or not text.islower()) and f"planarfriction.{text}" in objects:
            return f"planarfriction.{text}"  # of models that have one name in several front ends, the one in NumPy
        first, _, rest = text.partition(".")
        # A module, from which the object is documented elsewhere.
        if rest and f"planarfriction.{first}" in objects:
            first, _, rest = rest.partition(".")
        full = ends.get(first)
        if full is None or (
            not rest
            and first.islower()
            and "_" not in first
            and first not in ("simulate", "rollout")
        ):
            return None
        name = f"{full}.{rest}" if rest else full
        return name if name in objects else None


def ancestors(node: nodes.Node) -> Any:
    while node.parent is not None:
        node = node.parent
        yield node


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_post_transform(CodeLinks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
