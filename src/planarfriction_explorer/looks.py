"""Layout of the page, and the styles of tables, charts and cards."""

from __future__ import annotations

import json
from typing import Any

_NARROW = "@media (max-width: 920px)"

PAGE = f"""
:root {{color-scheme: only light}}
html {{scroll-padding: 10px 0 160px}}
body {{margin: 0; background: #F3F5F7; font-family: system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif;
  --design-primary-color: #0072B2}}
{_NARROW} {{.bk-Tooltip {{left: 8px !important; max-width: calc(100vw - 32px) !important;
  translate: 0 calc(50% + 14px)}}}}
"""
"""Style of the whole page, which browsers shall not darken: black curves would be lost. Tooltips, which would be cut
beside their controls on a small screen, lie below them there."""

CARD = """:host {background: white; border: 1px solid #DFE3E8; border-radius: 8px; padding: 10px 14px;
  box-sizing: border-box}
:host(.stale) {opacity: 0.3; filter: grayscale(1)}"""
"""Style of a part of the page, pale where its results are not those of the fields."""

SIDE = f"{CARD}\n{_NARROW} {{:host {{max-width: none !important}}}}"
"""Style of the controls, which are as wide as a small screen."""

OPENED = f"{_NARROW} {{:host {{display: contents !important}}}}"
"""Style of a column whose parts mix with those around it on a small screen."""

FIRST = f"{_NARROW} {{:host {{order: -1}}}}"
"""Style of what stands before all else on a small screen."""

TABS = f"""{CARD}
.bk-header, .bk-headers-wrapper {{flex-wrap: wrap; min-width: 0}}
{_NARROW} {{:host {{flex: 1 0 100% !important; margin-top: 0 !important}}}}"""
"""Style of the tabs, of which a small screen needs two rows."""

CODE = f"""textarea {{font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: 13px; white-space: pre;
  color: #222 !important; background: #FAFAFA; opacity: 1 !important}}
{_NARROW} {{textarea {{white-space: pre-wrap; overflow-wrap: anywhere}}}}"""
"""Style of code to copy; a small screen breaks its lines."""

ALERT = "background:#FBE3E0;border:1px solid #C0392B;border-radius:6px;padding:8px 12px;font-size:15px"
"""Style of the line that says what is wrong."""

STAYS = {
    "position": "fixed",
    "bottom": "8px",
    "left": "8px",
    "right": "8px",
    "width": "auto",
    "margin": "0 auto",
}
STAYS |= {
    "max-width": "760px",
    "z-index": "20",
    "box-shadow": "0 2px 10px #0005",
    "border-radius": "6px",
}
"""Styles of a line that is seen wherever the page is scrolled to, and moves nothing."""

HINT = "background:#E8F1F8;border:1px solid #0072B2;border-radius:6px;padding:8px 12px;font-size:15px"
"""Style of the line that says what to do next."""

TABLE = """<style>
table {font-variant-numeric: tabular-nums; border-collapse: collapse}
th {font-weight: 600; text-align: right; padding: 3px 0 3px 14px; color: #555; vertical-align: bottom}
td {text-align: right; padding: 3px 0 3px 14px; border-top: 1px solid #E6E9ED}
th:first-child, td:first-child, td.words {text-align: left}
th:first-child, td:first-child {padding-left: 0}
p {margin: 8px 0 0}
</style>"""
"""Style of a table, to stand before it."""


def wrong(words: str) -> str:
    """Return the style of a field whose value is refused, with the reason below it."""
    # Quotes and backslashes are escaped as in CSS.
    reason = json.dumps(words, ensure_ascii=False)
    return f"""input, select {{border-color: #C0392B !important; background-color: #FBE3E0 !important}}
.bk-input-group::after {{content: {reason}; color: #C0392B; font-size: 12px;
  white-space: normal; width: 0; min-width: 100%}}"""


def grows(least: int, *, most: int | None = None) -> dict[str, str]:
    """Return styles of a part that shares the room of its row and gets a row of its own below `least` pixels."""
    limit = {} if most is None else {"max-width": f"{most}px"}
    return {"flex": f"1 1 {least}px", "min-width": "0", "width": "auto", **limit}


def tidy(plot: Any) -> None:
    """Give a chart thin lines and plain letters."""
    plot.outline_line_color = None
    plot.background_fill_color = plot.border_fill_color = None
    for axis in plot.axis:
        axis.axis_label_text_font_style = "normal"
        axis.minor_tick_line_color = None
        axis.axis_line_color = axis.major_tick_line_color = "#9AA3AD"
    plot.grid.grid_line_color = "#E6E9ED"
