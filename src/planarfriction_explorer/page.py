"""The page in the browser: makes a new state of every change and shows what the pure functions say of it."""

from __future__ import annotations

import html
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import panel as pn

from planarfriction.errors import FrictionError
from planarfriction.laws import LAWS, FrictionLaw
from planarfriction_explorer import code, looks, pictures
from planarfriction_explorer.controls import OWN, Controls
from planarfriction_explorer.drawing import Drawing
from planarfriction_explorer.ladder_tab import LadderTab
from planarfriction_explorer.live import Paced
from planarfriction_explorer.scene_tab import SceneTab
from planarfriction_explorer.state import (
    PRESETS,
    Answer,
    State,
    answer,
    from_link,
    to_link,
)
from planarfriction_explorer.views import MapView, SectionView, legend

FASTEST = 0.1
"""Velocity [m/s] that a drag from the middle to the edge of the map gives."""

STEPS = 30
"""Most steps that can be undone: a map of the most cells takes a megabyte."""

LADDER = 2
"""Number of the tab with the ladder of the models."""


class Page:
    """One session: its state, its controls and its pictures."""

    def __init__(self) -> None:
        self.state: State = next(iter(PRESETS.values()))
        self._past: deque[State] = deque(maxlen=STEPS)
        """States that can be gone back to, one for each step."""
        self._step: Any = None
        """Control that is being dragged: all that it changes until it is released is one step."""
        self.answer: Answer | None = None
        self._figure: dict[str, Any] = {}
        self._laws: dict[str, FrictionLaw] = {}
        """Last law of each kind, which comes back when the kind is chosen again."""
        self._pointer: tuple[float, float] | None = None
        self.slow = Paced(self._show_slow)
        self.controls = Controls(self.state)
        self.map = MapView(self._dragged, self._released)
        self.section = SectionView()
        self.ladder = LadderTab(lambda: self.state)
        self.scenes = SceneTab(lambda: self.state, self._try)
        self.surface = pn.pane.Plotly(
            None,
            config={"displaylogo": False, "responsive": True},
            aspect_ratio=0.8,
            sizing_mode="scale_width",
        )
        self.numbers = pn.pane.HTML(
            "", css_classes=["numbers"], sizing_mode="stretch_width"
        )
        self.grid = pn.pane.HTML("", sizing_mode="stretch_width")
        self.message = pn.pane.HTML(
            "", visible=False, sizing_mode="stretch_width", styles=looks.STAYS
        )
        self.python, self.toml, self.mujoco = map(
            _code_area, ("python", "toml", "mujoco")
        )
        self.tabs = pn.Tabs(
            ("Python", _copied(self.python)),
            ("Scene file (TOML)", _copied(self.toml)),
            ("Models", self.ladder.layout),
            ("Run a scene", self.scenes.layout),
            ("MuJoCo", _copied(self.mujoco)),
            dynamic=True,
            margin=(10, 0, 0, 0),
            sizing_mode="stretch_width",
            stylesheets=[looks.TABS],
        )
        self.cards: Any = (self.tabs,)
        """Parts of the page with results."""
        self.tabs.param.watch(lambda _: self._follow_ladder(), "active")
        self._listen()
        self._redraw()
        self._refresh()

    def _listen(self) -> None:
        controls = self.controls

        def on(widget: Any, act: Callable[[Any], Any]) -> None:
            controls.on(
                widget, lambda value: self._try(lambda: act(value), field=widget)
            )

        on(
            controls.patch,
            lambda name: self._draw(Drawing.published(name)) if name != OWN else None,
        )
        on(
            controls.sides,
            lambda text: self._draw(Drawing.rectangle(text)) if text else None,
        )
        on(
            controls.cell_size,
            lambda size: self._draw(self.state.drawing.scaled(1e-3 * size)),
        )
        on(controls.file, self._read)
        on(controls.law, self._choose_law)
        on(controls.load, lambda load: self._change(normal_force=load))
        on(controls.mass, lambda grams: self._change(mass=1e-3 * grams))
        on(controls.lever, lambda millimetres: self._change(lever=1e-3 * millimetres))
        for slider in (controls.vx, controls.vy, controls.omega):
            controls.on(slider, lambda _, slider=slider: self._try(self._slide, slider))
            slider.param.watch(lambda _: self._end_step(), "value_throttled")
        on(
            controls.example,
            lambda name: self._restore(PRESETS[name]) if name in PRESETS else None,
        )
        controls.undo.on_click(lambda _: self._try(self._undo, controls.undo))
        controls.link.on_click(lambda _: self._put_link())
        controls.clear.on_click(lambda _: self._try(self._clear))
        if pn.state.location is not None:
            pn.state.location.param.watch(
                lambda event: self._try(lambda: self._follow_link(event.new)), "hash"
            )
        self._offer_parameters()

    # ------------------------------------------------------------------ wishes of the user

    def _restore(self, state: State) -> None:
        """Show another state: all controls and all pictures."""
        self.state = state
        self._offer_parameters()
        self._redraw()
        self._refresh()

    def _undo(self) -> None:
        self._step = self.controls.undo  # which makes no step of its own
        if self._past:  # the button may be clicked faster than it is disabled
            self._restore(self._past.pop())

    def _put_link(self) -> None:
        location: Any = pn.state.location
        location.hash = to_link(self.state)
        self._say(
            "The address of this page now holds the state of the screen: keep it or pass it on."
        )

    def _follow_link(self, link: str) -> None:
        """Show what a link holds; the address changes too where the page itself has put it there."""
        if link and link != to_link(self.state):
            self._restore(from_link(link))

    def _offer_parameters(self) -> None:
        self.controls.offer_parameters(
            self.state.law, lambda field: self._try(self._set_law, field=field)
        )

    def _choose_law(self, kind: str) -> None:
        self._laws[str(LAWS.name_of(self.state.law))] = self.state.law
        law = self._laws.get(kind)
        self.state = (
            self.state.with_law(kind) if law is None else self.state.changed(law=law)
        )
        self._offer_parameters()
        self._refresh()

    def _set_law(self) -> None:
        self.state = self.state.with_law(
            str(self.controls.law.value), **self.controls.law_values()
        )
        self._refresh()

    def _read(self, content: bytes) -> None:
        """Show a map as wide as the one before it, since a file does not say how large its cells are."""
        before = self.state.drawing
        name = self.controls.file.filename or "map"
        found = Drawing.read(name, content, before.cell_size)
        size = (
            max(before.pressures.shape) / max(found.pressures.shape) * before.cell_size
        )
        self._draw(found.scaled(size))
        rows, columns = found.pressures.shape
        what = f"{found.name}: {rows} x {columns} cells of {1e3 * size:.3g} mm each"
        self._say(f"{what}. Set the cell size of your sensor.")

    def _clear(self) -> None:
        self.controls.tool.value = "brush"
        self._draw(self.state.drawing.cleared())

    def _slide(self) -> None:
        vx, vy, omega = (
            each.value
            for each in (self.controls.vx, self.controls.vy, self.controls.omega)
        )
        self._change(twist=(1e-3 * vx, 1e-3 * vy, omega))

    def _dragged(self, x: float, y: float) -> None:
        """Keep where the pointer is; what it has passed while the page was at work is left out, but for the brush."""
        if self.controls.tool.value in ("brush", "erase"):
            self._try(lambda: self._paint(x, y), self.map)
            return
        waiting = self._pointer is not None
        self._pointer = (x, y)
        if not waiting:
            document: Any = pn.state.curdoc
            document.add_next_tick_callback(self._follow)

    def _follow(self) -> None:
        pointer = self._pointer
        self._pointer = None
        if pointer is not None:
            self._try(lambda: self._follow_to(*pointer), self.map)

    def _follow_to(self, x: float, y: float) -> None:
        if self.controls.tool.value == "turn":
            self.state = self.state.turning_about(x, y)
        else:
            speed = (
                2.0 * FASTEST / max(self.state.drawing.width, self.state.drawing.height)
            )
            self.state = self.state.sliding(speed * x, speed * y)
        self._refresh()

    def _paint(self, x: float, y: float) -> None:
        drawing = self.state.drawing
        controls = self.controls
        pressure = 0.0 if controls.tool.value == "erase" else controls.pressure.value
        radius = (controls.brush.value - 0.5) * drawing.cell_size
        self._draw(drawing.painted(x, y, radius=radius, pressure=pressure), quick=True)

    def _released(self) -> None:
        self._follow()
        if self.controls.tool.value in ("brush", "erase"):
            self._try(lambda: self._draw(self.state.drawing), self.map)
        self._end_step()

    def _end_step(self) -> None:
        self._step = None

    def _change(self, **values: Any) -> None:
        self.state = self.state.changed(**values)
        self._refresh()

    def _draw(self, drawing: Drawing, *, quick: bool = False) -> None:
        self.state = self.state.changed(drawing=drawing)
        self._redraw(quick=quick)
        self._refresh(quick=quick)

    # ------------------------------------------------------------------ showing

    def _try(self, act: Callable[[], Any], step: Any = None, field: Any = None) -> None:
        """Carry out a wish of the user, or say in one line why not; the browser gets all changes in one message.

        What the same control, `step`, changes until it is released can be undone together. A `field` whose value is
        refused says so too, and the results, which are those of the values before, are pale until the next wish.
        """
        before = self.state
        with pn.io.unlocked():
            try:
                self.message.visible = False
                self._refuse()
                act()
            except FrictionError as error:
                pale = field is not None and self.answer is not None
                self._say(
                    f"{error}. Pale: results of the values before."
                    if pale
                    else str(error),
                    looks.ALERT,
                )
                self._refuse(field if pale else None, str(error))
            if self.state is not before:
                if step is None or step is not self._step:
                    self._past.append(before)
                self._step = step
                self.controls.undo.disabled = not self._past

    def _refuse(self, field: Any = None, words: str = "") -> None:
        self.controls.refuse(field, words)
        for card in self.cards:
            card.css_classes = [] if field is None else ["stale"]

    def _say(self, words: str, look: str = looks.HINT) -> None:
        self.message.object = (
            f"<div id='message' style='{look}'>{html.escape(words)}</div>"
        )
        self.message.visible = True

    def _redraw(self, *, quick: bool = False) -> None:
        """Draw the pictures that depend on the map alone."""
        self.map.draw(self.state.drawing)
        try:
            self._figure = pictures.surface_figure(self.state, quick=quick)
        except FrictionError:
            self._figure = {}  # nothing presses: `_refresh` says so

    def _refresh(self, *, quick: bool = False) -> None:
        """Draw the pictures that depend on the twist, the load or the law."""
        begin = time.perf_counter()
        self.controls.show(self.state)
        try:
            self.answer = found = answer(self.state)
        except FrictionError:
            self.answer = None
            self._figure = {}
            self.surface.visible = False
            self.python.value = self.toml.value = self.mujoco.value = ""
            self.numbers.object = self.grid.object = ""
            self.ladder.clear()
            if self.state.drawing.pressures.any():
                raise
            raise FrictionError(
                "Nothing presses: paint with the brush, choose a patch or load a map."
            ) from None
        finally:
            self.map.move(self.state, self.answer)
            self.section.move(self.state, self.answer, quick=quick)
        self.slow.ask()
        self._follow_ladder()
        self.numbers.object = pictures.numbers_table(
            self.state, found, time.perf_counter() - begin
        )

    def _show_slow(self) -> None:
        """Show the picture in 3-D and the code, which need not follow a drag."""
        if self.answer is not None:
            self.surface.param.update(
                object=pictures.moved(self._figure, self.answer), visible=True
            )
            self.python.value, self.toml.value = (
                code.python(self.state),
                code.toml(self.state),
            )
            self.mujoco.value = code.mujoco(self.state)
            self.grid.object = pictures.holding_line(self.state) + pictures.grid_line(
                self.state
            )

    def _follow_ladder(self) -> None:
        """Run the comparison of the models while its tab is open."""
        if self.tabs.active == LADDER and self.answer is not None:
            self.ladder.follow()
        else:
            self.ladder.stop()

    def layout(self) -> Any:
        """Return the whole page."""
        words = "<b style='font-size:20px'>planarfriction explorer</b>"
        title = pn.pane.HTML(words, margin=(8, 12, 4, 4))
        hint = pn.pane.HTML(
            "<b style='font-size:15px'>Drag over the map</b>", margin=(4, 0, 4, 0)
        )
        plane = pn.Column(
            self.controls.motion(),
            hint,
            self.controls.tool,
            pn.pane.Bokeh(
                self.map.figure,
                css_classes=["map"],
                sizing_mode="scale_width",
                aspect_ratio=1.0,
                margin=0,
            ),
            pn.pane.HTML(legend(), sizing_mode="stretch_width"),
            self.section.layout,
            stylesheets=[looks.CARD],
            styles=looks.grows(330),
        )
        space = pn.Column(
            self.numbers,
            self.grid,
            self.surface,
            stylesheets=[looks.CARD],
            styles=looks.grows(360) | {"height": "auto"},
        )
        self.cards = (plane, space, self.tabs)
        main = pn.Column(
            pn.FlexBox(
                plane,
                space,
                gap="10px",
                align_items="stretch",
                stylesheets=[looks.FIRST],
            ),
            self.tabs,
            stylesheets=[looks.OPENED],
            styles=looks.grows(600),
        )
        hidden = (self.slow.asked, self.slow.drawn)
        return pn.Column(
            pn.FlexBox(title, self.controls.head(), align_items="flex-end"),
            self.message,
            *hidden,
            pn.FlexBox(
                self.controls.layout(), main, gap="10px", align_items="flex-start"
            ),
            sizing_mode="stretch_width",
            styles={"padding": "0 10px 64px", "box-sizing": "border-box"},
        )


def _code_area(kind: str) -> Any:
    return pn.widgets.TextAreaInput(
        disabled=True,
        height=330,
        max_length=10**6,
        sizing_mode="stretch_width",
        stylesheets=[looks.CODE],
        css_classes=[kind],
    )


def _copied(area: Any) -> Any:
    """Return a text with a button that copies it."""
    copy = pn.widgets.Button(label="Copy", css_classes=[f"copy-{area.css_classes[0]}"])
    copy.js_on_click(
        args={"area": area}, code="navigator.clipboard.writeText(area.value)"
    )
    return pn.Column(copy, area, sizing_mode="stretch_width")
