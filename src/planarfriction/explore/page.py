"""The page in the browser: makes a new state of every change and shows what the pure functions say of it."""

from __future__ import annotations

import html
import time
from collections.abc import Callable
from typing import Any

import panel as pn
from bokeh import events
from bokeh.models import ColumnDataSource, LinearColorMapper, Range1d
from bokeh.palettes import Cividis256
from bokeh.plotting import figure

from planarfriction.errors import FrictionError
from planarfriction.explore import code, pictures
from planarfriction.explore.answers import Answer, answer
from planarfriction.explore.background import models_tab, scene_tab
from planarfriction.explore.drawing import Drawing
from planarfriction.explore.pacing import Paced
from planarfriction.explore.state import State, law_parameters
from planarfriction.laws import LAWS
from planarfriction.patch import PUBLISHED_PATCHES

TOOLS = {"Centre of rotation": "turn", "Velocity": "slide", "Brush": "brush", "Eraser": "erase"}
"""What a drag over the map does."""

OWN = "own map"
"""Choice of the patch while it is none of the published ones."""

FASTEST = 0.1
"""Velocity [m/s] that a drag from the middle to the edge of the map gives."""

_CODE = "textarea {font-family: monospace; color: #222 !important; background: #FAFAFA; opacity: 1 !important}"

_ALERT = "background:#FBE3E0;border:1px solid #C0392B;padding:6px 12px;font-size:110%"

_TABLE = "font-variant-numeric:tabular-nums;border-collapse:collapse"


class Page:
    """One session: its state, its controls and its pictures."""

    def __init__(self) -> None:
        self.state = State()
        self.answer: Answer | None = None
        self._figure: dict[str, Any] = {}
        self._silent, self._pointer = False, None
        self.slow = Paced(self._show_slow)
        self._controls()
        self._pictures()
        self._redraw()
        self._refresh()

    # ------------------------------------------------------------------ controls

    def _controls(self) -> None:
        widgets = pn.widgets
        self.patch = widgets.Select(name="Patch", options=[*PUBLISHED_PATCHES, OWN], value=self.state.drawing.name)
        self.cell_size = widgets.FloatInput(name="Cell size [mm]", step=0.1, format="0[.]0000", width=140)
        self.file = widgets.FileInput(name="Pressure map", accept="", sizing_mode="stretch_width")
        self.clear = widgets.Button(name="Clear the map", width=140, align="end")
        self.tool = widgets.RadioButtonGroup(options=TOOLS, value="turn")
        self.brush = widgets.FloatSlider(name="Brush: radius [cells]", start=0.5, end=6.0, step=0.5, value=1.5)
        self.pressure = widgets.FloatSlider(name="Brush: pressure", start=0.1, end=1.0, step=0.1, value=1.0)
        self.law = widgets.Select(name="Law", options=list(LAWS), value=LAWS.name_of(self.state.law))
        self.parameters: Any = pn.GridBox(ncols=2)
        self.load = widgets.FloatInput(name="Normal force [N]", value=self.state.normal_force, step=0.5)
        vx, vy, omega = self.state.twist
        self.vx = widgets.FloatSlider(name="vx [mm/s]", start=-100.0, end=100.0, step=0.1, value=1e3 * vx)
        self.vy = widgets.FloatSlider(name="vy [mm/s]", start=-100.0, end=100.0, step=0.1, value=1e3 * vy)
        self.omega = widgets.FloatSlider(name="ω [rad/s]", start=-10.0, end=10.0, step=0.01, value=omega)
        for name, widget in vars(self).items():  # a name for the widget in the page too
            if isinstance(widget, widgets.Widget):
                widget.css_classes = [name.replace("_", "-")]
        self._offer_parameters()
        for slider in (self.vx, self.vy, self.omega):
            slider.param.watch(self._slid, "value")
        self._on(self.patch, lambda name: self._draw(Drawing.published(name)) if name != OWN else None)
        self._on(self.cell_size, lambda size: self._draw(self.state.drawing.scaled(1e-3 * size)))
        self._on(self.load, lambda load: self._change(normal_force=load))
        self._on(self.law, self._choose_law)
        self._on(self.file, self._read)
        self.clear.on_click(lambda _: self._try(lambda: self._draw(self.state.drawing.cleared())))

    def _on(self, widget: Any, act: Callable[[Any], Any]) -> None:
        """Do `act` with each new value that the user gives."""

        def changed(event: Any) -> None:
            if not self._silent and event.new is not None:
                self._try(lambda: act(event.new))

        widget.param.watch(changed, "value")

    def _offer_parameters(self) -> None:
        """Fields for the parameters of the law; empty ones have a default that depends on others."""
        inputs = [
            pn.widgets.FloatInput(name=name, value=value, width=140, css_classes=["parameter", name])
            for name, value in law_parameters(self.state.law).items()
        ]
        for each in inputs:
            each.param.watch(lambda _: None if self._silent else self._try(self._set_law), "value")
        self.parameters.objects = inputs

    def _choose_law(self, kind: str) -> None:
        self.state = self.state.with_law(kind)
        self._offer_parameters()
        self._refresh()

    def _set_law(self) -> None:
        self.state = self.state.with_law(self.law.value, **{each.name: each.value for each in self.parameters})
        self._refresh()

    def _read(self, content: bytes) -> None:
        self._draw(Drawing.read(self.file.filename or "map", content, 1e-3 * self.cell_size.value))

    def _slid(self, _: Any) -> None:
        if not self._silent:
            self._try(lambda: self._change(twist=(1e-3 * self.vx.value, 1e-3 * self.vy.value, self.omega.value)))

    # ------------------------------------------------------------------ drags over the map

    def _dragged(self, event: Any) -> None:
        """Keep where the pointer is; what it has passed while the page was at work is left out, but for the brush."""
        if self.tool.value in ("brush", "erase"):
            self._try(lambda: self._paint(1e-3 * event.x, 1e-3 * event.y))
            return
        waiting, self._pointer = self._pointer is not None, (1e-3 * event.x, 1e-3 * event.y)
        if not waiting:
            document: Any = pn.state.curdoc
            document.add_next_tick_callback(self._follow)

    def _follow(self) -> None:
        pointer, self._pointer = self._pointer, None
        if pointer is not None:
            self._try(lambda: self._follow_to(*pointer))

    def _follow_to(self, x: float, y: float) -> None:
        if self.tool.value == "turn":
            self.state = self.state.turning_about(x, y)
        else:
            speed = 2.0 * FASTEST / max(self.state.drawing.width, self.state.drawing.height)
            self.state = self.state.sliding(speed * x, speed * y)
        self._refresh()

    def _paint(self, x: float, y: float) -> None:
        drawing = self.state.drawing
        pressure = 0.0 if self.tool.value == "erase" else self.pressure.value
        radius = (self.brush.value - 0.5) * drawing.cell_size
        self._draw(drawing.painted(x, y, radius=radius, pressure=pressure), quick=True)

    def _released(self, _: Any) -> None:
        if self.tool.value in ("brush", "erase"):
            self._try(lambda: self._draw(self.state.drawing))

    # ------------------------------------------------------------------ showing

    def _try(self, act: Callable[[], Any]) -> None:
        """Do what the user wants, or say in one line why not."""
        try:
            self.message.visible = False
            act()
        except FrictionError as error:
            self._say(str(error))

    def _say(self, text: str) -> None:
        self.message.object = f"<div id='message' style='{_ALERT}'>{html.escape(text)}</div>"
        self.message.visible = True

    def _change(self, **values: Any) -> None:
        self.state = self.state.changed(**values)
        self._refresh()

    def _draw(self, drawing: Drawing, *, quick: bool = False) -> None:
        self.state = self.state.changed(drawing=drawing)
        self._redraw(quick=quick)
        self._refresh()

    def _pictures(self) -> None:
        self.sources: dict[str, Any] = {name: ColumnDataSource() for name in ("map", "slip", "wrench", "centre")}
        plot: Any = figure(
            width=520, height=520, tools="", toolbar_location=None, x_axis_label="x [mm]", y_axis_label="y [mm]"
        )
        plot.grid.visible = False
        self._ranges = plot.x_range, plot.y_range = Range1d(), Range1d()
        shades = LinearColorMapper(palette=Cividis256, low=0.0, high=1.0, nan_color="#FFFFFF00")
        plot.image("image", "x", "y", "dw", "dh", source=self.sources["map"], color_mapper=shades, alpha=0.85)
        for name, colour, width, size in (("slip", "#444444", 1, 6), ("wrench", {"field": "colour"}, "width", 13)):
            source = self.sources[name]
            plot.segment("x0", "y0", "x1", "y1", source=source, color=colour, line_width=width)
            plot.scatter("x1", "y1", angle="angle", marker="triangle", size=size, source=source, color=colour)
        centre = {"source": self.sources["centre"], "size": 18, "line_width": 3, "color": "#D00000"}
        plot.scatter("x", "y", marker="circle_cross", fill_alpha=0.0, **centre)
        for kind in (events.PanStart, events.Pan, events.Tap):
            plot.on_event(kind, self._dragged)
        for kind in (events.PanEnd, events.Tap):
            plot.on_event(kind, self._released)
        self.map = plot
        self.surface = pn.pane.Plotly(None, config={"displaylogo": False}, name="surface")
        self.numbers = pn.pane.HTML("", css_classes=["numbers"])
        self.message = pn.pane.HTML("", visible=False, sizing_mode="stretch_width")
        self.python, self.toml = (
            pn.widgets.TextAreaInput(
                disabled=True,
                height=330,
                max_length=10**6,
                sizing_mode="stretch_width",
                stylesheets=[_CODE],
                css_classes=[kind],
            )
            for kind in ("python", "toml")
        )

    def _redraw(self, *, quick: bool = False) -> None:
        """What depends on the map alone."""
        drawing = self.state.drawing
        self.sources["map"].data = pictures.pressure_image(drawing)
        half = 0.6e3 * max(drawing.width, drawing.height)
        for each in self._ranges:
            each.update(start=-half, end=half)
        self._quietly({self.cell_size: 1e3 * drawing.cell_size})
        self._quietly({self.patch: drawing.name if drawing.origin == "published" else OWN})
        try:
            self._figure = pictures.surface_figure(self.state, quick=quick)
        except FrictionError:
            self._figure = {}  # nothing presses: `_refresh` says so

    def _refresh(self) -> None:
        """What depends on the rest of the state."""
        begin = time.perf_counter()
        self.sources["centre"].data = pictures.points_of_interest(self.state)
        self.sources["slip"].data = pictures.slip_arrows(self.state)
        vx, vy, omega = self.state.twist
        self._quietly({self.vx: 1e3 * vx, self.vy: 1e3 * vy, self.omega: omega, self.load: self.state.normal_force})
        try:
            self.answer = answer(self.state)
            self.sources["wrench"].data = pictures.wrench_arrows(self.state, self.answer)
            self.slow.ask()
            text = numbers(self.state, self.answer, time.perf_counter() - begin)
        except FrictionError:
            self.answer, self._figure, self.surface.object = None, {}, None
            self.sources["wrench"].data = {name: [] for name in self.sources["wrench"].data}
            self.python.value = self.toml.value = self.numbers.object = ""
            raise
        self.numbers.object = text

    def _show_slow(self) -> None:
        """What does not have to follow a drag: the picture in 3-D and the code."""
        if self.answer is not None:
            self.surface.object = pictures.moved(self._figure, self.answer)
            self.python.value, self.toml.value = code.python(self.state), code.toml(self.state)

    def _quietly(self, values: dict[Any, Any]) -> None:
        """Set controls to what the state is, without taking that for a wish of the user."""
        self._silent = True
        try:
            for widget, value in values.items():
                widget.value = value
        finally:
            self._silent = False

    def layout(self) -> Any:
        """The whole page."""
        left = pn.Column(
            pn.pane.HTML("<h2 style='margin:0'>planarfriction explorer</h2>"),
            self.patch,
            pn.Row(self.cell_size, self.clear),
            pn.pane.HTML("Pressure map (.csv, .npy, grey image):"),
            self.file,
            self.brush,
            self.pressure,
            pn.layout.Divider(),
            self.law,
            self.parameters,
            self.load,
            pn.layout.Divider(),
            *(self.vx, self.vy, self.omega),
            width=330,
        )
        middle = pn.Column(
            pn.pane.HTML("A drag over the map moves:"), self.tool, pn.pane.Bokeh(self.map, css_classes=["map"])
        )
        right = pn.Column(self.numbers, self.surface)
        tabs = pn.Tabs(
            ("Python", self._copied(self.python)),
            ("Scene file (TOML)", self._copied(self.toml)),
            ("Models", models_tab(lambda: self.state)),
            ("Run a scene", scene_tab(lambda: self.state)),
        )
        return pn.Column(
            self.message, self.slow.asked, self.slow.drawn, pn.Row(left, pn.Column(pn.Row(middle, right), tabs))
        )

    @staticmethod
    def _copied(area: Any) -> Any:
        """A text with a button that copies it."""
        copy = pn.widgets.Button(name="Copy", css_classes=[f"copy-{area.css_classes[0]}"])
        copy.js_on_click(args={"area": area}, code="navigator.clipboard.writeText(area.value)")
        return pn.Column(copy, area, sizing_mode="stretch_width")


def numbers(state: State, found: Answer, seconds: float) -> str:
    """Table of the wrenches, and what else there is to say in numbers, as HTML."""
    words = {"friction": "Friction, steady sliding", "surface": "Limit surface, μ<sub>c</sub> f<sub>N</sub>"}
    words["ellipsoid"] = "Ellipsoid"
    rows = "".join(
        f"<tr><td style='color:{pictures.COLOURS[name]}'><b>{text}</b></td>"
        + "".join(f"<td align=right style='padding-left:16px'>{value:.4f}</td>" for value in _shown(found, name))
        + "</tr>"
        for name, text in words.items()
    )
    (force, angle), centre = state.drawing.largest_errors, state.centre_of_rotation
    where = "none, no spin" if centre is None else f"({1e3 * centre[0]:.2f}, {1e3 * centre[1]:.2f}) mm"
    return (
        f"<div id='answer'><table style='{_TABLE}'><tr><td></td><td align=right>fx [N]</td><td align=right>fy [N]</td>"
        f"<td align=right>τ [N mm]</td></tr>{rows}</table>"
        f"Centre of rotation: {where}; dissipated power {1e3 * found.power:.4g} mW<br>"
        f"Error of the ellipsoid: {found.force_error:.3f} of μ<sub>c</sub> f<sub>N</sub> and {found.angle_error:.1f}° "
        f"in the twist here, up to {max(force, found.force_error):.3f} and {max(angle, found.angle_error):.1f}° "
        f"elsewhere<br><small>Answered in {1e3 * seconds:.1f} ms</small></div>"
    )


def _shown(found: Answer, name: str) -> list[float]:
    """A wrench in N and N mm, without -0."""
    fx, fy, tau = getattr(found, name)
    return [round(each, 4) + 0.0 for each in (fx, fy, 1e3 * tau)]
