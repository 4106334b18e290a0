"""Equations as MathML, made by docutils: browsers set it themselves, and no page loads anything from elsewhere."""

from __future__ import annotations

import itertools
import re
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.application import Sphinx

BAR = re.compile(r"(?<!\\)(?<!left)(?<!right)\|")


def fenced(source: str) -> str:
    """The bars of `|v|` as fences, which have no space around them: the first of a pair opens, the second closes."""
    sides = itertools.cycle((r"\lvert ", r"\rvert "))
    return BAR.sub(lambda bar: next(sides), source)


def mathml(node: nodes.math | nodes.math_block, as_block: bool) -> str:
    """The equation, with bars that neither stretch nor stand apart, and rows of aligned equations in full size."""
    text = latex2mathml.tex2mathml(fenced(node.astext()), as_block=as_block)
    bar = '<mo stretchy="false" lspace="0" rspace="0" form="{}">|</mo>'
    for side, form in (("mathopen", "prefix"), ("mathclose", "postfix")):
        text = text.replace(f'<mo class="{side}">|</mo>', bar.format(form))
    # With an exponent docutils forgets which side it is.
    text = text.replace("<mo>|</mo>", bar.format("postfix"))
    return text.replace(
        '<mtable class="ams-align">', '<mtable class="ams-align" displaystyle="true">'
    )


def inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def block(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="math">{mathml(node, as_block=True)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
