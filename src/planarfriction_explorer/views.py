"""Charts of the page: the map in the plane, and the section of the limit surface."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import panel as pn
from bokeh import events
from bokeh.models import ColumnDataSource, LinearColorMapper, Range1d, SaveTool
from bokeh.palettes import Cividis256
from bokeh.plotting import figure

from planarfriction_explorer import looks, pictures
from planarfriction_explorer.drawing import Drawing
from planarfriction_explorer.pictures import COLOURS
from planarfriction_explorer.state import Answer, State

ROOM = 0.6
"""Half of the side of the view, in the longer side of the map [-]."""

PRESSURE = Cividis256[::-1]
"""Colours of the pressure: dark is much, as in `plots`."""


class MapView:
    """The picture of the map, as `figure`; `dragged` is called with a place [m], `released` at the end of a drag."""

    def __init__(
        self, dragged: Callable[[float, float], None], released: Callable[[], None]
    ):
        self._sources: dict[str, Any] = {
            name: ColumnDataSource() for name in ("map", "slip", "wrench", "centre")
        }
        plot: Any = figure(
            name="map",
            sizing_mode="scale_width",
            aspect_ratio=1.0,
            width=400,
            height=400,
            tools=[SaveTool(filename="map")],
            toolbar_location="above",
            toolbar_inner=True,  # beside the frame it would take from its height
            x_axis_label="x [mm]",
            y_axis_label="y [mm]",
            x_range=Range1d(),
            y_range=Range1d(),
            min_border_left=56,  # borders of equal sums: the frame is as square as the whole, and so are the cells
            min_border_right=10,
            min_border_top=10,
            min_border_bottom=56,
        )
        looks.tidy(plot)
        plot.toolbar.logo = None
        plot.grid.visible = False
        shades = LinearColorMapper(
            palette=PRESSURE, low=0.0, high=1.0, nan_color="#FFFFFF00"
        )
        plot.image(
            "image",
            "x",
            "y",
            "dw",
            "dh",
            source=self._sources["map"],
            color_mapper=shades,
            alpha=0.85,
        )
        arrows = (  # those of slip with a pale rim, so that they show on dark cells too
            ("slip", "#FFFFFF", 3, 10),
            ("slip", "#333333", 1, 6),
            ("wrench", {"field": "colour"}, "width", 13),
        )
        for name, colour, width, size in arrows:
            source = self._sources[name]
            plot.segment(
                "x0", "y0", "x1", "y1", source=source, color=colour, line_width=width
            )
            plot.scatter(
                "x1",
                "y1",
                angle="angle",
                marker="triangle",
                size=size,
                source=source,
                color=colour,
            )
        centre = {
            "source": self._sources["centre"],
            "size": 16,
            "line_width": 2,
            "line_color": "black",
        }
        plot.scatter("x", "y", marker="circle_dot", fill_color="white", **centre)
        for kind in (events.PanStart, events.Pan, events.Tap):
            plot.on_event(kind, lambda event: dragged(1e-3 * event.x, 1e-3 * event.y))
        for kind in (events.PanEnd, events.Tap):
            plot.on_event(kind, lambda _: released())
        self.figure = plot

    def draw(self, drawing: Drawing) -> None:
        """Show another map."""
        self._sources["map"].data = pictures.pressure_image(drawing)
        half = ROOM * pictures.MM * max(drawing.width, drawing.height)
        for each in (self.figure.x_range, self.figure.y_range):
            each.update(start=-half, end=half)

    def move(self, state: State, answer: Answer | None) -> None:
        """Show another twist, and the forces of the answer if there is one."""
        self._sources["centre"].data = pictures.points_of_interest(state)
        self._sources["slip"].data = pictures.slip_arrows(state)
        self._sources["wrench"].data = pictures.wrench_arrows(state, answer)


def legend() -> str:
    """Return what the shades and marks of the map stand for."""
    colours = ", ".join(PRESSURE[::51])
    bar = f"display:inline-block;width:70px;height:10px;background:linear-gradient(90deg, {colours})"
    return (
        f"<div style='font-size:13px'>0 <span style='{bar}'></span> 1 of the highest pressure. Thin arrows: slip. "
        "Thick arrows: forces, as in the table. ⊙: centre of rotation.</div>"
    )


_WORDS = "<b style='font-size:15px'>Section of the limit surface</b> at the centre of pressure"


class SectionView:
    """Chart of the section with its heading, as `layout`; neither is seen where nothing presses."""

    def __init__(self) -> None:
        self._sources: dict[str, Any] = {
            name: ColumnDataSource({"force": [], "torque": []}) for name in COLOURS
        }
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
        names = (
            ("surface", "limit surface", "solid"),
            ("ellipsoid", "ellipsoid", "dashed"),
        )
        for name, words, dash in names:
            look = {
                "color": COLOURS[name],
                "line_dash": dash,
                "line_width": 2,
                "legend_label": words,
            }
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
            pn.pane.Bokeh(
                plot, css_classes=["section"], sizing_mode="stretch_width", margin=0
            ),
            sizing_mode="stretch_width",
        )

    def move(self, state: State, answer: Answer | None, *, quick: bool = False) -> None:
        """Show the section that holds the friction of the answer; `quick` as in `pictures.surface_figure`."""
        self.layout.visible = answer is not None
        if answer is not None:
            angle, lines = pictures.section_lines(state, answer, quick=quick)
            self._plot.xaxis.axis_label = f"force at {angle:.0f}° to x [N]"
            for name, points in lines.items():
                self._sources[name].data = {
                    "force": points[:, 0].tolist(),
                    "torque": points[:, 1].tolist(),
                }
