"""The report, one HTML file with its figures inside, made from the stored results: Markdown with formulas as HTML."""

from __future__ import annotations

import base64
import datetime
import functools
import html
import io
import itertools
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planarfriction import __version__
from planarfriction._support.writing import write_text
from planarfriction_studies.experiments.reproduction import (
    Record,
    Reproduction,
    machine,
)
from planarfriction_studies.experiments.wording import environment

if TYPE_CHECKING:
    from markdown_it import MarkdownIt

Rows = list[dict[str, Any]]

WIDEST = 1440
"""Width of most figures [px]; narrower ones are shown narrower, so that all have letters of one size."""


def write_report(reproduction: Reproduction) -> Path:
    """Write `report.html` from all results kept in the folder; returns its path."""
    from markupsafe import Markup

    page = environment().overlay()
    page.filters |= {
        "markdown": lambda text: Markup(to_html(text)),
        "inline": lambda text: Markup(_parser().renderInline(text)),
        "symbols": lambda text: Markup(name_to_html(str(text))),
        "percent": lambda share: "" if share is None else f"{100.0 * share:.2g}",
    }
    counter = itertools.count(1)
    sections: list[Record] = [
        _section(record, reproduction.folder / record["name"], counter)
        | {"number": number}
        for number, record in enumerate(reproduction.records(), 1)
    ]
    rows = [row for section in sections for row in section["comparisons"]]
    text = page.get_template("report.html.j2").render(
        sections=sections,
        every={"all": _summary(rows)} | _by_kind(rows),
        version=__version__,
        date=datetime.date.today().isoformat(),
        machine=machine(),
        mode="quick"
        if reproduction.quick
        else "full"
        if reproduction.full
        else "normal",
        seconds=sum(section["seconds"] for section in sections),
    )
    path = reproduction.folder / "report.html"
    write_text(path, text)
    return path


def _section(record: Record, home: Path, counter: Any) -> Record:
    """Return a record with its pictures as numbered data, and its comparisons split by their kind of reference."""
    comparisons = record["comparisons"]
    return record | {
        "pictures": [
            picture | _image(home / f"{picture['name']}.png") | {"index": next(counter)}
            for picture in record["pictures"]
        ],
        "every": _summary(comparisons),
        **_by_kind(comparisons),
    }


def _by_kind(rows: Rows) -> dict[str, Any]:
    """Split rows by what limits them: exact or converged, published with a tolerance, published with a known error."""
    published = [row for row in rows if row["reference"] == "published"]
    return {
        "exact": _summary([row for row in rows if row["reference"] != "published"]),
        "paper": _summary([row for row in published if row["paper"] is None]),
        "stored": _summary([row for row in published if row["paper"] is not None]),
    }


def _summary(rows: Rows) -> dict[str, Any]:
    """Summarise rows: all, those out of tolerance, by cause, and the largest shares of span, ours and the paper's."""
    causes = dict.fromkeys(row["cause"] for row in rows)
    shares = [row["share"] for row in rows if row["share"] is not None]
    paper = [row["paper"] / row["span"] for row in rows if row["paper"] and row["span"]]
    return {
        "rows": rows,
        "missed": [row for row in rows if not row["holds"]],
        "groups": [
            (cause, [row for row in rows if row["cause"] == cause]) for cause in causes
        ],
        "share": max(shares, default=None),
        "paper_share": max(paper, default=None),
        "nearest": max(
            [
                (row["difference"] / row["tolerance"], row["quantity"])
                for row in rows
                if row["tolerance"]
            ],
            default=(0, ""),
        ),
    }


def _image(path: Path) -> dict[str, Any]:
    """Return the source of an image that travels inside the page, and its width over that of the widest [%]."""
    try:
        data = path.read_bytes()
    except OSError:
        # Someone removed it: its caption still says what it was.
        return {
            "source": "",
            "width": 100,
        }
    width = int.from_bytes(data[16:20], "big")  # of the header of a PNG
    source = "data:image/png;base64," + base64.b64encode(data).decode()
    return {"source": source, "width": min(100, round(100 * width / WIDEST))}


POINTS = 100.0
"""Size of the letters of a formula as it is drawn [points], large because pictures are whole points wide and high."""

ENLARGED = 1.08
"""Size of the letters of a formula in the page [em]: those of its face are small beside the text's."""

_GREEK = {"tau": "τ", "tau/r": "τ/r", "theta": "θ", "omega": "ω", "mu": "μ"}

SYMBOLS = {
    **{letter: f"<i>{letter}</i>" for letter in ("k", "p", "r", "R", "x", "y", "θ")},
    **{
        tex + name: f"<i>{letter}</i>"
        for name, letter in _GREEK.items()
        for tex in ("", "\\")
    },
    **{
        name.replace("_", ""): f"<i>{name[0]}<sub>{name[2]}</sub></i>"
        for name in ("f_x", "f_y", "v_x", "v_y")
    },
    "f_N": "<i>f<sub>N</sub></i>",
    "dtheta": "d<i>θ</i>",
    "int": "∫",
    "<rho^2>": "⟨<i>ρ</i>²⟩",
    "m^2": "m²",
    "mm^2": "mm²",
    "um": "µm",
}
"""Symbols as the names of quantities, columns and units have them -> HTML."""

_SYMBOL = re.compile(
    r"(?<![\w<^/.$])("
    + "|".join(sorted(map(re.escape, SYMBOLS), key=len, reverse=True))
    + r")(?![\w^>])"
)


def to_html(text: str) -> str:
    """Convert paragraphs of Markdown to HTML."""
    return _parser().render(text)


def name_to_html(text: str) -> str:
    """Return the name of a quantity or a column, whose symbols are plain words, as HTML with typeset symbols."""
    parts = _SYMBOL.split(re.sub(r"(?<=\d) x (?=\d)", " × ", text))
    return "".join(
        SYMBOLS[part] if i % 2 else html.escape(part) for i, part in enumerate(parts)
    )


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
    drawn = re.sub(
        rf"<metadata>.*?</metadata>|<!--.*?-->|{ground}|\n *", " ", drawn, flags=re.S
    )
    picture = base64.b64encode(re.sub(" +", " ", drawn).encode()).decode()
    style = "; ".join(
        f"{name}: {ENLARGED * value / POINTS:.3f}em"
        for name, value in (("height", height), ("vertical-align", -depth))
    )
    source = html.escape(source)
    return f'<img class="formula" alt="{source}" style="{style}" src="data:image/svg+xml;base64,{picture}">'


@functools.cache
def _parser() -> MarkdownIt:
    from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    parser.inline.ruler.before("escape", "formula", _find_formula)
    parser.add_render_rule(
        "formula", lambda _, tokens, i, *__: formula(tokens[i].content)
    )
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
