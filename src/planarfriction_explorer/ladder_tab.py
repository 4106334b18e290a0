"""The ladder of the models, which follows what is on the screen while it is looked at."""

from __future__ import annotations

import html
import math
from collections.abc import Callable
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource, FixedTicker, NumeralTickFormatter
from bokeh.plotting import figure

from planarfriction.plots.style import DISTRIBUTED, PUBLISHED, SHADES
from planarfriction_explorer import looks
from planarfriction_explorer.ladder import RUNGS, Rung, climb
from planarfriction_explorer.live import Live, Task
from planarfriction_explorer.state import State

_WORDS = (
    "Every model starts from rest and follows the same motion for 0.2 s: up to the twist on the screen, hold, and over "
    "to its opposite. The error is the root mean square difference from the distributed model."
)

_COLOURS = dict(zip(RUNGS, (DISTRIBUTED, *SHADES[:0:-1], PUBLISHED), strict=True))

_HEAD = (
    "model",
    "bristle states",
    "error [% of μ<sub>c</sub> f<sub>N</sub>]",
    "time in the solver [ms]",
)


class LadderTab:
    """Table and chart of the models; `follow` compares them again in the next pause."""

    def __init__(self, state: Callable[[], State]):
        self._state = state
        self._live = Live(failed=self._say)
        self.status = pn.pane.HTML("")
        self.table = pn.pane.HTML("", styles=looks.grows(340))
        self._source = ColumnDataSource(
            {key: [] for key in ("seconds", "error", "colour")}
        )
        self.layout = pn.Column(
            pn.pane.HTML(_WORDS, sizing_mode="stretch_width"),
            self.status,
            pn.FlexBox(
                self.table,
                pn.pane.Bokeh(_chart(self._source), styles=looks.grows(340)),
                gap="16px",
            ),
            sizing_mode="stretch_width",
        )

    def follow(self) -> None:
        """Compare the models of the state on the screen, in the next pause."""
        self._say("The models are compared when the hand rests.")
        self._live.soon(self._work)

    def clear(self) -> None:
        """Show nothing: nothing presses."""
        self.stop()
        self._say("")
        self._show_rungs([])

    def stop(self) -> None:
        """Give up a comparison."""
        self._live.stop()

    def _work(self, task: Task) -> None:
        rungs: list[Rung] = []
        for rung in climb(self._state()):
            rungs.append(rung)
            task.tell(self._show, list(rungs))

    def _show(self, rungs: list[Rung]) -> None:
        done = f"Comparing: {len(rungs)} of {len(RUNGS)} models (the first time this compiles)."
        self._say(
            done
            if len(rungs) < len(RUNGS)
            else "For the patch, the law and the twist on the screen."
        )
        self._show_rungs(rungs)

    def _show_rungs(self, rungs: list[Rung]) -> None:
        self.table.object = table(rungs) if rungs else ""
        ran = [each for each in rungs if not math.isnan(each.error)]
        self._source.data = {
            "seconds": [1e3 * each.seconds for each in ran],
            "error": [100.0 * each.error for each in ran],
            "colour": [_COLOURS[each.name] for each in ran],
        }

    def _say(self, text: str) -> None:
        self.status.object = f"<small id='ladder-status'>{html.escape(text)}</small>"


def table(rungs: list[Rung]) -> str:
    """Return the ladder as HTML."""
    head = "".join(f"<th>{text}</th>" for text in _HEAD)
    names = [
        f"<span style='color:{_COLOURS[each.name]}'>●</span> {each.name}"
        for each in rungs
    ]
    rows = "".join(
        f"<tr><td>{name}</td>{_cells(each)}</tr>"
        for name, each in zip(names, rungs, strict=True)
    )
    return f"{looks.TABLE}<table id='ladder'><tr>{head}</tr>{rows}</table>"


def _cells(rung: Rung) -> str:
    if math.isnan(rung.error):
        return f"<td colspan=3 class=words>{html.escape(rung.refusal)}</td>"
    error = (
        "reference" if rung.name == next(iter(RUNGS)) else f"{100.0 * rung.error:.2f}"
    )
    return "".join(
        f"<td>{text}</td>"
        for text in (f"{rung.states}", error, f"{1e3 * rung.seconds:.2f}")
    )


def _chart(source: ColumnDataSource) -> Any:
    plot: Any = figure(
        height=260,
        sizing_mode="stretch_width",
        x_axis_type="log",
        tools="",
        toolbar_location=None,
        x_axis_label="time in the solver [ms]",
        y_axis_label="error [% of μ_c f_N]",
    )
    looks.tidy(plot)
    plot.x_range.range_padding = plot.y_range.range_padding = 0.1
    plot.xaxis.formatter = NumeralTickFormatter(format="0.[00]")
    plot.xaxis.ticker = FixedTicker(
        ticks=[digit * 10.0**power for power in range(-2, 4) for digit in (1, 2, 5)]
    )
    plot.scatter("seconds", "error", size=12, color="colour", source=source)
    return plot
