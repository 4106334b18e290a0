"""Markdown with formulas between dollar signs as HTML; formulas are small pictures that travel inside the page."""

from __future__ import annotations

import base64
import functools
import html
import io
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from markdown_it import MarkdownIt

POINTS = 100.0
"""Size of the letters of a formula as it is drawn [points], large because pictures are whole points wide and high."""

ENLARGED = 1.08
"""Size of the letters of a formula in the page [em]: those of its face are small beside the text's."""

SYMBOLS = {
    "fx": "<i>f<sub>x</sub></i>",
    "fy": "<i>f<sub>y</sub></i>",
    "vx": "<i>v<sub>x</sub></i>",
    "vy": "<i>v<sub>y</sub></i>",
    "f_N": "<i>f<sub>N</sub></i>",
    **{letter: f"<i>{letter}</i>" for letter in ("k", "p", "r", "R", "x", "y")},
    "tau": "<i>τ</i>",
    "tau/r": "<i>τ/r</i>",
    "theta": "<i>θ</i>",
    "θ": "<i>θ</i>",
    "dtheta": "d<i>θ</i>",
    "omega": "<i>ω</i>",
    "mu": "<i>μ</i>",
    "int": "∫",
    "<rho^2>": "⟨<i>ρ</i>²⟩",
    "m^2": "m²",
    "mm^2": "mm²",
    "um": "µm",
}
"""Symbols as the names of quantities, columns and units have them -> HTML."""

_SYMBOL = re.compile(
    r"(?<![\w<^/.$])(" + "|".join(sorted(map(re.escape, SYMBOLS), key=len, reverse=True)) + r")(?![\w^>])"
)


def to_html(text: str) -> str:
    """Convert paragraphs of Markdown to HTML."""
    return _parser().render(text)


def inline(text: str) -> str:
    """Convert one line of Markdown to HTML, without a paragraph around it."""
    return _parser().renderInline(text)


def name_to_html(text: str) -> str:
    """Return the name of a quantity or a column, whose symbols are plain words, as HTML with typeset symbols."""
    parts = _SYMBOL.split(re.sub(r"(?<=\d) x (?=\d)", " × ", text))
    return "".join(SYMBOLS[part] if i % 2 else html.escape(part) for i, part in enumerate(parts))


@functools.cache
def formula(source: str) -> str:
    """Return a formula in TeX as an HTML image whose height and baseline fit the text around it."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.mathtext import math_to_image

    buffer = io.BytesIO()
    face = FontProperties(size=POINTS, math_fontfamily="cm")
    depth = math_to_image(f"${source}$", buffer, prop=face, dpi=72, format="svg")
    drawn = buffer.getvalue().decode()
    height = float(drawn.split('height="')[1].split("pt")[0])
    ground = r'<g id="patch_1">.*?</g>'
    drawn = re.sub(rf"<metadata>.*?</metadata>|<!--.*?-->|{ground}|\n *", " ", drawn, flags=re.S)
    picture = base64.b64encode(re.sub(" +", " ", drawn).encode()).decode()
    style = "; ".join(
        f"{name}: {ENLARGED * value / POINTS:.3f}em" for name, value in (("height", height), ("vertical-align", -depth))
    )
    source = html.escape(source)
    return f'<img class="formula" alt="{source}" style="{style}" src="data:image/svg+xml;base64,{picture}">'


@functools.cache
def _parser() -> MarkdownIt:
    from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"html": False})
    parser.inline.ruler.before("escape", "formula", _find_formula)
    parser.add_render_rule("formula", lambda _, tokens, i, *__: formula(tokens[i].content))
    return parser


def _find_formula(state: Any, silent: bool) -> bool:
    """Parse a formula between two dollar signs (a rule of the parser)."""
    end = state.src.find("$", state.pos + 1) if state.src[state.pos] == "$" else -1
    if end < 0:
        return False
    if not silent:
        state.push("formula", "img", 0).content = state.src[state.pos + 1 : end]
    state.pos = end + 1
    return True
