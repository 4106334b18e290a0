"""Run of a scene, a ready one with the contact on the screen or one from a file: its film and its time histories."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from planarfriction.families import MODELS, SCENES
from planarfriction.plots import plot_histories
from planarfriction.scenes import Scene, simulate
from planarfriction.scenes.files import read_table
from planarfriction.sweeps.settings import Settable
from planarfriction_explorer.drawing import as_file, plain_name
from planarfriction_explorer.state import State

DPI = 80.0
"""Dots per inch of the film: 768 across."""

_MORE = """<style>
body {margin: 0; font: 14px system-ui, sans-serif; color: #222}
.animation {display: block; max-width: 768px}
.animation img {width: 100%}
input[type=range].anim-slider {width: 96%}
.anim-buttons button {border: 1px solid #CCC; border-radius: 4px; background: #F5F5F5; padding: 4px 0;
  cursor: pointer}
.anim-buttons button:hover {background: #E0E0E0}
</style>
<script>setTimeout(() => document.querySelector("button[title=Play]").click(), 100)</script>"""
"""The player of matplotlib as wide as there is room for; it begins to play by itself."""


def ready_scene(
    state: State, name: str, model: str, pad: dict[str, Any] | None = None
) -> Scene:
    """Return the ready scene `name` with patch and law of the state in the `model`, on a pad as scene files have it.

    Raises `FrictionError` where the model does not take the law or the pad, or the scene not the patch.
    """
    model = MODELS.choose(model)(state.drawing.patch, state.law)
    scene = SCENES.choose(name)(model)
    if pad is None:
        return scene
    return Settable(scene)(**{f"{each.name}.pad": pad for each in scene.contacts})


def read_scene(name: str, content: bytes) -> Scene:
    """Return the scene in a file called `name`, of which the `content` is at hand.

    Paths of other files in it start from the folder in which the explorer was started.

    Raises `FrictionError` in one line for what is no scene.
    """
    name = plain_name(name)
    with as_file(name, content) as path:
        table = read_table(path)
    return Scene.from_dict(table, Path.cwd(), name)


class Watched(NamedTuple):
    """A scene that was run, to be looked at."""

    film: str
    """Page with a player."""
    histories: bytes
    """Picture of its time histories, as PNG."""


def film(scene: Scene, progress: Callable[[str, float], None]) -> Watched:
    """Simulate the scene; return its film and its time histories.

    `progress` is called now and then with what is being done and the share of the run that is done; what it raises
    ends the work.
    """
    solution = simulate(
        scene, progress=lambda time: progress("simulating", time / scene.t_end)
    )
    histories = BytesIO()
    end = float(solution.histories["time"].values[-1]) or 1.0
    plot_histories(solution).savefig(histories)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.html"
        solution.animate(
            path, dpi=DPI, progress=lambda time: progress("drawing", time / end)
        )
        return Watched(path.read_text(encoding="utf-8") + _MORE, histories.getvalue())
