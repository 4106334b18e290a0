"""Table of pictures: `.plot()` and the like of a record find the functions of `plots` by name when they are called."""

from __future__ import annotations

import importlib
from typing import Any

PICTURES = {
    "patch": "patch:plot_patch",
    "patch in a notebook": "notebook:patch_html",
    "limit surface in a notebook": "notebook:surface_html",
    "law in a notebook": "notebook:law_html",
    "model in a notebook": "notebook:model_html",
    "scene in a notebook": "notebook:scene_html",
    "solution": "motion:plot_solution",
    "solution in a notebook": "notebook:solution_html",
    "animation": "animation:animate_solution",
    "identification": "identification:plot_identification",
    "joint": "identification:plot_joint",
    "grip": "planning:plot_grip",
    "hold": "holding:plot_hold",
    "push": "planning:plot_push",
    "push plan": "push_plan:plot_push_plan",
}
"""Functions that draw a record, by the name of the picture: `module:function` within `planarfriction.plots`."""


def picture(name: str, record: Any, *arguments: Any, **options: Any) -> Any:
    """Return the picture of a record, drawn by the function that `PICTURES` names."""
    module, _, function = PICTURES[name].partition(":")
    return getattr(importlib.import_module(f"planarfriction.plots.{module}"), function)(
        record, *arguments, **options
    )
