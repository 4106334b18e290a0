"""Scenes: a planar body, its contacts, the signals that drive them, scene files, and the results of simulations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

from planarfriction.families import SCENES
from planarfriction.scenes.body import Body, Spring
from planarfriction.scenes.contact import Contact
from planarfriction.scenes.ready import (
    curling,
    drift,
    driven,
    foot,
    free_slide,
    in_hand,
    in_hand_load,
    pivot,
    published_velocity,
    pushed,
)
from planarfriction.scenes.scene import Scene, SolverOptions
from planarfriction.scenes.signal import Signal
from planarfriction.scenes.solution import Solution, Statistics

if TYPE_CHECKING:
    from planarfriction.scenes.simulation import simulate

__all__ = [
    "SCENES",
    "Body",
    "Contact",
    "Scene",
    "Signal",
    "Solution",
    "SolverOptions",
    "Spring",
    "Statistics",
    "curling",
    "drift",
    "driven",
    "foot",
    "free_slide",
    "in_hand",
    "in_hand_load",
    "pivot",
    "published_velocity",
    "pushed",
    "register",
    "simulate",
]

register = SCENES.register

# it brings the compiled solver with it
__getattr__, _, _ = lazy_loader.attach(
    __name__, submod_attrs={"simulation": ["simulate"]}
)
__dir__ = __all__.copy
