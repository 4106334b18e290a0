"""What takes longer than a drag: the comparison of the models and the film of a scene, each at a button's press."""

from __future__ import annotations

import base64
import html
import math
import threading
from collections.abc import Callable, Iterator
from typing import Any

import panel as pn

from planarfriction.errors import FrictionError
from planarfriction.explore.films import film
from planarfriction.explore.ladder import Rung, climb
from planarfriction.explore.state import State
from planarfriction.families import MODELS, SCENES


class InBackground:
    """A button, and what comes of it: HTML that a thread gives piece by piece, so that the page goes on meanwhile."""

    def __init__(self, name: str, text: str, work: Callable[[], Iterator[str]]):
        self._work = work
        self.button = pn.widgets.Button(name=text, css_classes=[name])
        self.result = pn.pane.HTML("", sizing_mode="stretch_width")
        self.button.on_click(self._start)

    def _start(self, _: Any) -> None:
        document: Any = pn.state.curdoc
        self.button.disabled = True
        self.result.object = "at work ... (the first time it compiles)"

        def show(text: str, done: bool = False) -> None:
            def now() -> None:
                self.result.object, self.button.disabled = text, not done

            document.add_next_tick_callback(now)

        def run() -> None:
            text = ""
            try:
                for text in self._work():
                    show(text)
            except FrictionError as error:
                text = html.escape(str(error))
            show(text, done=True)

        threading.Thread(target=run, daemon=True).start()


def models_tab(state: Callable[[], State]) -> Any:
    """The ladder of the models for the state that is on the screen when the button is pressed."""

    def work() -> Iterator[str]:
        rungs: list[Rung] = []
        for rung in climb(state()):
            rungs.append(rung)
            yield table(rungs)

    tab = InBackground("compare", "Compare the models", work)
    words = "The twist of the screen: up to it, hold, and round to the opposite, in 0.2 s, from rest."
    return pn.Column(pn.pane.HTML(words), tab.button, tab.result)


def scene_tab(state: Callable[[], State]) -> Any:
    """A ready scene with patch and law of the screen, run and shown."""
    scene = pn.widgets.Select(name="Scene", options=list(SCENES), css_classes=["scene"])
    model = pn.widgets.Select(name="Model", options=list(MODELS), value="reduced", css_classes=["model"])

    def work() -> Iterator[str]:
        picture = base64.b64encode(film(state(), str(scene.value), str(model.value))).decode()
        yield f"<img id='film' alt='film of the scene' src='data:image/gif;base64,{picture}'>"

    tab = InBackground("run", "Run", work)
    return pn.Column(pn.Row(scene, model), tab.button, tab.result)


def table(rungs: list[Rung]) -> str:
    """The ladder as HTML."""
    rows = "".join(f"<tr><td>{each.name}</td>{_cells(each, rungs[0].seconds)}</tr>" for each in rungs)
    head = "".join(f"<td style='padding-right:24px'><b>{text}</b></td>" for text in _HEAD)
    return f"<table id='ladder'><tr>{head}</tr>{rows}</table>"


_HEAD = (
    "model",
    "bristle states",
    "error, rms, of μ<sub>c</sub> f<sub>N</sub>",
    "time in the solver",
    "of distributed",
)


def _cells(rung: Rung, reference: float) -> str:
    if math.isnan(rung.error):
        return f"<td colspan=4>{html.escape(rung.refusal)}</td>"
    texts = (f"{rung.states}", f"{rung.error:.4f}", f"{1e3 * rung.seconds:.2f} ms", f"{rung.seconds / reference:.1%}")
    return "".join(f"<td>{text}</td>" for text in texts)
