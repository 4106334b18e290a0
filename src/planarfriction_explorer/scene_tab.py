"""A scene, ready or from a file, run and watched."""

from __future__ import annotations

import base64
import html
from collections.abc import Callable
from typing import Any

import panel as pn

from planarfriction.families import MODELS, SCENES
from planarfriction.scenes import Scene
from planarfriction_explorer.controls import members
from planarfriction_explorer.films import Watched, film, read_scene, ready_scene
from planarfriction_explorer.live import Live, Task
from planarfriction_explorer.state import State

_WORDS = (
    "A ready scene runs with the patch and the law of the screen, a scene file (.toml, .json) with its own. "
    "Paths in a file start from the folder in which the explorer was started."
)

PADS_OFFERED = {
    "layer": ("shear_modulus", "thickness"),
    "half-space": ("shear_modulus",),
}
"""Kinds of pads and what they are given by."""

_FRAME = "width:100%;max-width:790px;aspect-ratio:790/560;min-height:350px;border:0"

_PICTURE = "width:100%;min-width:640px;max-width:960px"  # small screens scroll: its letters stay legible


class SceneTab:
    """Tab with the choice of a scene to run, its film and its time histories."""

    def __init__(
        self, state: Callable[[], State], attempt: Callable[[Callable[[], Any]], None]
    ):
        self._state = state
        self._loaded: dict[str, Scene] = {}
        self._live = Live(failed=self._fail)
        self.scene = pn.widgets.Select(
            label="Scene",
            options=list(SCENES),
            description=members(SCENES),
            css_classes=["scene"],
            width=190,
        )
        self.model = pn.widgets.Select(
            label="Model",
            options=list(MODELS),
            value="reduced",
            description=members(MODELS),
            css_classes=["model"],
            width=190,
        )
        self.pad = pn.widgets.Select(
            label="Pad",
            options=["none", *PADS_OFFERED],
            description="Elastic pad; a half-space needs sigma_1 = 0 and two mirror symmetries.",
            css_classes=["pad"],
            width=130,
        )
        self.modulus = pn.widgets.FloatInput(
            label="Shear modulus [MPa]",
            description="Of the material; of silicone 0.1 to 0.5 [MPa].",
            value=0.2,
            step=0.1,
            visible=False,
            width=150,
        )
        self.thickness = pn.widgets.FloatInput(
            label="Thickness [mm]",
            description="Of the layer, less than the size of the patch [mm].",
            value=3.0,
            step=0.5,
            visible=False,
            width=150,
        )
        self.file = pn.widgets.FileInput(
            label="Scene file", accept="", css_classes=["scene-file"], width=300
        )
        self.button = pn.widgets.Button(
            label="Run", color="primary", css_classes=["run"], align="end", width=90
        )
        self.words = pn.pane.HTML(
            "", css_classes=["run-status"], sizing_mode="stretch_width"
        )
        self.result = pn.pane.HTML("", sizing_mode="stretch_width")
        self._running = False
        for each in (self.scene, self.pad):
            each.param.watch(lambda _: self._offer(), "value")
        self.file.param.watch(
            lambda event: attempt(lambda: self._read(event.new)) if event.new else None,
            "value",
        )
        self.button.on_click(lambda _: attempt(self._pressed))
        choices = pn.FlexBox(
            self.scene,
            self.model,
            self.pad,
            self.modulus,
            self.thickness,
            self.file,
            self.button,
            align_items="flex-end",
        )
        note = pn.pane.HTML(_WORDS, sizing_mode="stretch_width")
        self.layout = pn.Column(
            note, choices, self.words, self.result, sizing_mode="stretch_width"
        )

    def _offer(self) -> None:
        """Show the fields that the scene takes."""
        ready = self.scene.value in SCENES
        self.model.visible = self.pad.visible = ready
        needs = PADS_OFFERED.get(str(self.pad.value), ())
        self.modulus.visible = ready and "shear_modulus" in needs
        self.thickness.visible = ready and "thickness" in needs

    def _pad(self) -> dict[str, Any] | None:
        """Return the pad as scene files have it, or None."""
        kind = str(self.pad.value)
        given = {
            "shear_modulus": 1e6 * (self.modulus.value or 0.0),
            "thickness": 1e-3 * (self.thickness.value or 0.0),
        }
        needs = PADS_OFFERED.get(kind)
        return needs and {"kind": kind, **{name: given[name] for name in needs}}

    def _read(self, content: bytes) -> None:
        name = self.file.filename or "scene.toml"
        scene = read_scene(name, content)
        self._loaded[name] = scene
        self.scene.param.update(options=[*SCENES, *self._loaded], value=name)

    def _pressed(self) -> None:
        if self._running:
            self._live.stop()
            self._rest("Stopped.")
            return
        name = str(self.scene.value)
        choice = self._state(), name, str(self.model.value), self._pad()
        self._running = True
        self.button.label = "Stop"
        self.result.object = ""
        self._say("Simulating (the first time this compiles) ...")
        self._live.now(
            lambda task: self._work(
                self._loaded.get(name) or ready_scene(*choice), task
            )
        )

    def _work(self, scene: Scene, task: Task) -> None:
        said = ""

        def progress(doing: str, share: float) -> None:
            nonlocal said
            task.check()
            text = f"{doing.capitalize()}: {share:.0%}"
            if text != said:
                said = text
                task.tell(self._say, text)

        task.tell(self._show, film(scene, progress))

    def _show(self, run: Watched) -> None:
        self._rest("")
        picture = f"data:image/png;base64,{base64.b64encode(run.histories).decode()}"
        self.result.object = (
            f"<iframe id='film' title='film of the scene' sandbox='allow-scripts' style='{_FRAME}' "
            f'srcdoc="{html.escape(run.film)}"></iframe><div style="overflow-x:auto">'
            f"<img id='histories' alt='time histories of the scene' style='{_PICTURE}' src='{picture}'></div>"
        )

    def _fail(self, text: str) -> None:
        self._rest("")
        self.words.object = f"<span id='refusal'>{html.escape(text)}</span>"

    def _say(self, text: str) -> None:
        self.words.object = html.escape(text)

    def _rest(self, text: str) -> None:
        self._running = False
        self.button.label = "Run"
        self._say(text)
