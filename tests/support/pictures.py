"""Faults of a figure in words: texts that are cut off or lie on each other, offsets of ticks, empty axes."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from matplotlib.transforms import Bbox

CUT = 1.0
"""Allowed overlap of a text with another or the edge of a figure [pixel]: boxes of letters are rounded up to pixels."""

SMALLEST = 6.5
"""Smallest letters [pt]."""


def faults(figure: Any) -> list[str]:
    """One line for each fault."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    texts = list(_texts(figure, canvas.get_renderer()))
    width, height = figure.bbox.size
    found = [
        f"{text!r} is cut off"
        for text, box, _ in texts
        if min(box.x0, box.y0, width - box.x1, height - box.y1) < -CUT
    ]
    found += [
        f"{text!r} has letters of {size:g} pt"
        for text, _, size in texts
        if size < SMALLEST
    ]
    for (one, first, _), (other, second, _) in itertools.combinations(texts, 2):
        both = Bbox.intersection(first, second)
        if both is not None and min(both.width, both.height) > CUT:
            found.append(f"{one!r} lies on {other!r}")
    for axes in figure.axes:
        offsets = [
            axis.get_offset_text().get_text() for axis in (axes.xaxis, axes.yaxis)
        ]
        found += [f"ticks have the offset {offset!r}" for offset in offsets if offset]
        if not (axes.has_data() or axes.images or axes.artists or axes.texts):
            found.append("axes are empty")
    return found


def _texts(figure: Any, renderer: Any) -> Iterator[tuple[str, Bbox, float]]:
    """Every text that is drawn, with its box [pixel] and its size [pt]."""
    shown = {
        each
        for axes in figure.axes
        for axis in _axes_of(axes)
        for each in _ticks_shown(axis)
    }
    ticks = {
        each
        for axes in figure.axes
        for axis in _axes_of(axes)
        for each in _all_ticks(axis)
    }
    for text in figure.findobj(Text):
        if (
            not text.get_visible()
            or not text.get_text().strip()
            or (text in ticks and text not in shown)
        ):
            continue
        box = text.get_window_extent(renderer)
        if box.width > 0.0 and box.height > 0.0:
            yield text.get_text(), box, text.get_fontsize()


def _axes_of(axes: Any) -> list[Any]:
    return [axes.xaxis, axes.yaxis, *([axes.zaxis] if hasattr(axes, "zaxis") else [])]


def _all_ticks(axis: Any) -> list[Text]:
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    return [label for tick in ticks for label in (tick.label1, tick.label2)]


def _ticks_shown(axis: Any) -> list[Text]:
    """The labels of the ticks within the view: matplotlib keeps one more on either side, which it does not draw."""
    if not axis.axes.axison:
        return []
    drawn = axis._update_ticks()
    return [
        label
        for tick in drawn
        for label in (tick.label1, tick.label2)
        if label.get_visible()
    ]
