"""What stands on the explorer's page after each of some wishes, to be recorded: see `tests.support.recording`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import panel as pn

from planarfriction_explorer import ladder_tab, scene_tab
from planarfriction_explorer.films import Watched
from planarfriction_explorer.ladder import RUNGS, Rung
from planarfriction_explorer.page import Page
from tests.support.recorded import text
from tests.support.shown import SCENE

PARAMETERS = (
    "label",
    "value",
    "options",
    "start",
    "end",
    "step",
    "description",
    "disabled",
    "visible",
    "css_classes",
)
"""Parameters of widgets that are told."""

WISHES: dict[str, Callable[[Page], Any]] = {
    "patch": lambda page: page.controls.patch.param.update(value="LineGrad"),
    "twist": lambda page: page.controls.vx.param.update(value=12.0),
    "spin": lambda page: page.controls.omega.param.update(value=0.0),
    "law": lambda page: page.controls.law.param.update(value="dahl"),
    "parameter": lambda page: page.controls.parameters[0].param.update(value=-1.0),
    "back": lambda page: page.controls.law.param.update(value="lugre"),
    "load": lambda page: page.controls.load.param.update(value=3.0),
    "mass": lambda page: page.controls.mass.param.update(value=600.0),
    "lever": lambda page: page.controls.lever.param.update(value=-2.5),
    "turn": lambda page: page._follow_to(0.002, -0.003),
    "slide": lambda page: (
        page.controls.tool.param.update(value="slide"),
        page._follow_to(-0.002, 0.005),
    ),
    "brush": lambda page: (
        page.controls.tool.param.update(value="brush"),
        page._dragged(0.006, 0.001),
    ),
    "released": lambda page: page._released(),
    "cells": lambda page: page.controls.cell_size.param.update(value=2.0),
    "file": lambda page: page.controls.file.param.update(
        filename="pad.csv", value=b"0,1\n2,3\n4,0\n"
    ),
    "wrong file": lambda page: page.controls.file.param.update(value=b"0,x\n"),
    "clear": lambda page: page._try(page._clear),
    "undo": lambda page: page._try(page._undo, page.controls.undo),
    "example": lambda page: page.controls.example.param.update(value="L-shaped foot"),
}


def page() -> dict[str, Any]:
    """Tell the page at first, as a whole, and what each wish changes."""
    shown = Page()
    layout = shown.layout()
    before = told(shown, layout)
    found: dict[str, Any] = {"first": before}
    for name, act in WISHES.items():
        act(shown)
        now = told(shown, layout)
        found[name] = {
            key: value
            for key, value in now.items()
            if repr(value) != repr(before.get(key))
        }
        before = now
    rungs = [Rung(name, 10, 0.01 * i, 1e-3 * (i + 1)) for i, name in enumerate(RUNGS)]
    rungs[-1] = Rung(rungs[-1].name, 0, math.nan, math.nan, "refused <here>")
    shown.ladder._show(rungs[:2])
    found["comparing"] = [shown.ladder.status.object, dict(shown.ladder._source.data)]
    shown.ladder._show(rungs)
    found["compared"] = [
        shown.ladder.status.object,
        dict(shown.ladder._source.data),
        ladder_tab.table(rungs),
    ]
    chart = ladder_tab._chart(shown.ladder._source)
    found["chart"] = [
        chart.xaxis.axis_label,
        chart.yaxis.axis_label,
        list(chart.xaxis.ticker.ticks),
    ]
    for name, words in (
        ("said", shown.scenes._say),
        ("failed", shown.scenes._fail),
        ("rest", shown.scenes._rest),
    ):
        words("a < b")
        found[name] = [shown.scenes.words.object, shown.scenes.button.label]
    return found | {"run": run_at_once(shown, rungs)}


def run_at_once(shown: Page, rungs: list[Rung]) -> list[Any]:
    """Tell what is said while a scene is run and stopped and models are compared, without threads."""
    scenes = shown.scenes
    said = list[Any]()
    works = list[Any]()

    def film(scene: Any, progress: Callable[[str, float], None]) -> Watched:
        for doing, share in (
            ("simulating", 0.1),
            ("simulating", 0.1),
            ("drawing", 0.5),
        ):
            progress(doing, share)
        return Watched(f"<p>{scene.name}", b"picture")

    def tell(what: Callable[..., None], *values: Any) -> None:
        what(*values)
        said.append(
            [
                what.__name__,
                scenes.words.object,
                scenes.button.label,
                shown.ladder.status.object,
            ]
        )

    task: Any = SimpleNamespace(check=lambda: None, tell=tell)
    live = SimpleNamespace(now=works.append, stop=lambda: said.append("stop"))
    with (
        mock.patch.object(scene_tab, "film", film),
        mock.patch.object(ladder_tab, "climb", lambda _: iter(rungs)),
        mock.patch.object(scenes, "_live", live),
    ):
        for _ in range(3):  # begin, stop, begin
            scenes._pressed()
            said.append(
                [scenes.words.object, scenes.button.label, scenes.result.object]
            )
        works[-1](task)
        shown.ladder._work(task)
    scenes.file.filename = "pad.toml"
    scenes._read(SCENE.encode())
    return [
        said,
        len(works),
        scenes.result.object,
        scenes.scene.value,
        scenes.model.visible,
    ]


def told(shown: Page, layout: Any) -> dict[str, Any]:
    """Tell all widgets, texts and charts, by their names."""
    found: dict[str, Any] = {}
    for number, each in enumerate(layout.select(pn.widgets.Widget)):
        values = {
            name: getattr(each, name) for name in PARAMETERS if name in each.param
        }
        found[f"widget {number}"] = {
            name: told_value(value) for name, value in values.items()
        }
    for number, each in enumerate(layout.select(pn.pane.HTML)):
        found[f"text {number}"] = [
            re.sub(r"Answered in .*? ms", "", str(each.object)),
            each.visible,
        ]
    for name, view, plot in (
        ("map", shown.map, shown.map.figure),
        ("section", shown.section, shown.section._plot),
    ):
        for source, data in view._sources.items():
            found[f"{name}, {source}"] = {key: np.ma.masked_invalid(np.asarray(value)) if key == "image" else value
                                          for key, value in data.data.items()}  # fmt: skip
        ranges = [plot.x_range.start, plot.x_range.end] if name == "map" else []
        found[name] = [
            plot.xaxis.axis_label,
            plot.yaxis.axis_label,
            *ranges,
            len(plot.renderers),
        ]
    found["surface"] = [
        shown.surface.visible,
        shown.surface.object and shown.surface.object["data"],
    ]
    found["section seen"] = shown.section.layout.visible
    return found


def told_value(value: Any) -> Any:
    """Tell a parameter: code by its lines, a file by its size."""
    if isinstance(value, bytes):
        return len(value)
    return text(value) if isinstance(value, str) and len(value) > 400 else value
