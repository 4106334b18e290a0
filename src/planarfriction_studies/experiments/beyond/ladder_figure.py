"""Error against cost: medians with ranges, one line for each family of models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.plots.style import PlotFigure, new_figure, tidy
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.beyond.ladder import Row, shape_of
from planarfriction_studies.experiments.wording import span


@dataclass(frozen=True)
class Family:
    """Models of the ladder that are one line."""

    words: str
    rungs: dict[str, str]
    """Model -> what stands beside its marker."""
    colour: str
    marker: str
    place: tuple[int, int] = (5, 4)
    """Offset of the words from the marker [points]."""


FAMILIES = (
    Family("published reduced model", {"published": ""}, looks.REDUCED, "^"),
    Family(
        "ReducedModel, its parts",
        {"reduced": "1", "4 parts": "4", "6 parts": "6", "16 parts": "16"},
        looks.MOMENTS,
        "o",
        (4, -11),
    ),
    Family("distributed, its cells", {"degree 3": "28", "degree 5": "45", "full": "all"}, looks.DISTRIBUTED, "D"),
)

COLUMNS = (
    ("driven, ", "third quartile", "moved with a given velocity", "error of the force, third quartile [mN]"),
    ("load 2", "end", "in hand, load 2 (slips at once)", "distance of the end [mm]"),
    ("load 1", "end", "in hand, load 1 (barely slips)", "distance of the end [mm]"),
)
"""Columns: part of the name of their cases, the error that is shown, its title, and its axis [thousandths]."""

FLOOR = 1e-4
"""Smallest error that is drawn [mN, mm]."""

TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10)


def draw_ladder(rows: list[Row]) -> PlotFigure:
    """Draw the error over the time of a run: patches of many cells above, of few below; velocity-driven and in hand."""
    from matplotlib.ticker import FixedLocator, NullLocator

    many = {shape_of(row.case) for row in rows if row.model == "degree 5"}
    groups = [group for few in (False, True) if (group := [row for row in rows if (shape_of(row.case) in many) ^ few])]
    figure = new_figure(10.5, 0.7 + 3.1 * len(groups))
    panels: Any = figure.subplots(len(groups), len(COLUMNS), sharex="row", squeeze=False)
    for line, group in zip(panels, groups, strict=True):
        cells = [row.states // 2 for row in group if row.model == "full"]
        for axes, (case, quantity, title, label) in zip(line, COLUMNS, strict=True):
            for family in FAMILIES:
                _draw_family(axes, family, [row for row in group if case in row.case], quantity)
            axes.set(xscale="log", yscale="log", ylabel=label)
            axes.yaxis.label.set_fontsize("small")
            axes.set_title(f"{title},\npatches of {span(cells, 'd')} cells", fontsize="medium", loc="left")
            axes.margins(x=0.12, y=0.1)
            axes.xaxis.set_major_locator(FixedLocator(TICKS))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_locator(NullLocator())
            tidy(axes)
    for axes in panels[-1]:
        axes.set_xlabel("time of a run / that of the whole grid")
    figure.align_ylabels(panels)
    look = {"ls": "-", "lw": 1.4, "ms": 6.5, "mec": "white"}
    key = [looks.line_key(each.words, marker=each.marker, color=each.colour, **look) for each in FAMILIES]
    looks.legend(figure, key, len(FAMILIES), fontsize="small")
    return figure


def _draw_family(axes: Any, family: Family, rows: list[Row], quantity: str) -> None:
    """Draw medians joined by a line, and bars from the smallest to the largest; the reference, which has no error,
    dotted."""
    medians = []
    for model, words in family.rungs.items():
        found = [row for row in rows if row.model == model]
        if not found:
            continue
        cost = float(np.median([row.time for row in found]))
        errors = np.maximum([1e3 * row.errors[quantity] for row in found], FLOOR)
        if model == "full" and quantity == "end":
            axes.axvline(cost, color=family.colour, lw=1.0, ls=":")
            continue
        middle = float(np.median(errors))
        axes.vlines(cost, errors.min(), errors.max(), color=family.colour, lw=1.6, alpha=0.35)
        axes.annotate(words, (cost, middle), family.place, textcoords="offset points", fontsize=8, color=family.colour)
        medians.append((cost, middle))
    if medians:
        axes.plot(*np.transpose(medians), "-", marker=family.marker, ms=6.5, mec="white", lw=1.4, color=family.colour)
