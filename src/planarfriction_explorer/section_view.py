"""The section of the limit surface: force in the direction of the friction against torque."""

from __future__ import annotations

from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

from planarfriction_explorer import looks, pictures
from planarfriction_explorer.answers import Answer
from planarfriction_explorer.pictures import COLOURS
from planarfriction_explorer.state import State

_WORDS = "<b style='font-size:15px'>Section of the limit surface</b> at the centre of pressure"


class SectionView:
    """Chart of the section with its heading, as `layout`; neither is seen where nothing presses."""

    def __init__(self) -> None:
        self._sources: dict[str, Any] = {name: ColumnDataSource({"force": [], "torque": []}) for name in COLOURS}
        plot: Any = figure(
            name="section",
            height=240,
            sizing_mode="stretch_width",
            tools="hover",
            tooltips=[("force [N]", "@force"), ("torque [N mm]", "@torque")],
            toolbar_location=None,
            y_axis_label="torque [N mm]",
        )
        looks.tidy(plot)
        names = ("surface", "limit surface", "solid"), ("ellipsoid", "ellipsoid", "dashed")
        for name, words, dash in names:
            look = {"color": COLOURS[name], "line_dash": dash, "line_width": 2, "legend_label": words}
            plot.line("force", "torque", source=self._sources[name], **look)
        look = {"color": COLOURS["friction"], "size": 11, "legend_label": "friction"}
        plot.scatter("force", "torque", source=self._sources["friction"], **look)
        plot.legend.update(
            orientation="horizontal",
            border_line_color=None,
            padding=2,
            margin=0,
            spacing=12,
            label_text_font_size="12px",
        )
        plot.add_layout(plot.legend[0], "above")
        self._plot = plot
        self.layout: Any = pn.Column(
            pn.pane.HTML(_WORDS, margin=(10, 0, 0, 0)),
            pn.pane.Bokeh(plot, css_classes=["section"], sizing_mode="stretch_width", margin=0),
            sizing_mode="stretch_width",
        )

    def move(self, state: State, answer: Answer | None, *, quick: bool = False) -> None:
        """Show the section that holds the friction of the answer; `quick` as in `pictures.surface_figure`."""
        self.layout.visible = answer is not None
        if answer is not None:
            angle, lines = pictures.section_lines(state, answer, quick=quick)
            self._plot.xaxis.axis_label = f"force at {angle:.0f}° to x [N]"
            for name, points in lines.items():
                self._sources[name].data = {"force": points[:, 0].tolist(), "torque": points[:, 1].tolist()}
