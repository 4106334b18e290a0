"""A ready scene with the contact on the screen, as a moving picture."""

from __future__ import annotations

import tempfile
from pathlib import Path

from planarfriction.explore.state import State
from planarfriction.families import MODELS, SCENES
from planarfriction.scenes import simulate

DPI = 70.0
"""Dots per inch of the film: about 600 across."""


def film(state: State, scene: str, model: str) -> bytes:
    """Simulate the ready `scene` with patch and law of the state in the `model`; its film, a GIF.

    Raises `FrictionError` where the model does not take the law, or the scene not the patch.
    """
    solution = simulate(SCENES.choose(scene)(MODELS.choose(model)(state.drawing.patch, state.law)))
    with tempfile.TemporaryDirectory() as folder:
        return solution.animate(Path(folder) / "film.gif", dpi=DPI).read_bytes()
