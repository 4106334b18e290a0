"""The fields and sliders of the page."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import panel as pn

from planarfriction._support.described import field_docs
from planarfriction.cli.options import parse_sides
from planarfriction.families import Family
from planarfriction.laws import LAWS
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction_explorer import looks
from planarfriction_explorer.drawing import Drawing
from planarfriction_explorer.state import PRESETS, State, law_parameters

TOOLS = {
    "Centre of rotation": "turn",
    "Velocity": "slide",
    "Brush": "brush",
    "Eraser": "erase",
}
"""Actions of a drag over the map."""

OWN = "own map"
"""Choice of the patch while it is none of the published ones."""

CHANGED = "choose one"
"""Choice of the example while the screen shows none of them."""

TOOLTIPS = {
    "example": "Contact of a robot to begin with.",
    "undo": "Goes back by one change, or by one drag as a whole.",
    "link": "Puts all that is on the screen into the address of the page.",
    "patch": "Published contact patch, of which the map shows the pressure.",
    "sides": "Width and height of a rectangle with uniform pressure: 12x20mm, 1.2x2cm, or 0.012x0.02 in metres.",
    "file": "Table or picture of relative pressures, of at most 64 x 64 cells; only their ratios matter.",
    "clear": "Takes all pressure away, for a map of your own.",
    "tool": "Effect of a drag over the map.",
    "brush": "Radius of brush and eraser [cells].",
    "pressure": "Relative pressure that the brush leaves [-]; only ratios matter.",
    "vx": "Velocity of the origin along x [mm/s].",
    "vy": "Velocity of the origin along y [mm/s].",
    "omega": "Angular velocity, positive from x to y [rad/s].",
}
"""Tooltips of what is no field of a record."""


class Controls:
    """All that can be set; `values` of a law are in `parameters`, a field each."""

    def __init__(self, state: State):
        widgets = pn.widgets
        self.example = widgets.Select(label="Example", options=[CHANGED, *PRESETS])
        self.undo = widgets.Button(label="Undo", disabled=True)
        self.link = widgets.Button(label="Link")
        self.patch = widgets.Select(
            label="Patch", options=[*PUBLISHED_PATCHES, OWN], value=state.drawing.name
        )
        self.sides = widgets.TextInput(label="Rectangle", placeholder="12x20mm")
        self.file = widgets.FileInput(
            label="Pressure map from a file (.csv, .npy, grey image)", accept=""
        )
        self.cell_size = widgets.FloatInput(
            label="Cell size [mm]", step=0.1, format="0[.]0000"
        )
        self.clear = widgets.Button(label="Clear the map", align="end")
        self.tool = widgets.RadioButtonGroup(
            options=TOOLS, value="turn", color="primary", variant="outline"
        )
        self.brush = widgets.FloatSlider(
            label="Radius of the brush [cells]", start=0.5, end=6.0, step=0.5, value=1.5
        )
        self.pressure = widgets.FloatSlider(
            label="Pressure of the brush", start=0.1, end=1.0, step=0.1, value=1.0
        )
        self.law = widgets.Select(
            label="Law", options=list(LAWS), value=LAWS.name_of(state.law)
        )
        self.load = widgets.FloatInput(
            label="Normal force [N]", value=state.normal_force, step=0.5
        )
        self.mass = widgets.FloatInput(
            label="Mass of the part [g]", value=_thousandfold(state.mass), step=10.0
        )
        self.lever = widgets.FloatInput(
            label="Off-centre by [mm]", value=_thousandfold(state.lever), step=1.0
        )
        vx, vy, omega = state.twist
        self.vx = widgets.FloatSlider(
            label="vx [mm/s]", start=-100.0, end=100.0, step=0.1, value=1e3 * vx
        )
        self.vy = widgets.FloatSlider(
            label="vy [mm/s]", start=-100.0, end=100.0, step=0.1, value=1e3 * vy
        )
        self.omega = widgets.FloatSlider(
            label="ω [rad/s]", start=-10.0, end=10.0, step=0.01, value=omega
        )
        docs = field_docs(State) | field_docs(Drawing)
        tooltips = TOOLTIPS | {
            "law": members(LAWS),
            "load": docs.get("normal_force", ""),
        }
        for each in ("cell_size", "mass", "lever"):
            tooltips[each] = (
                docs.get(each, "").replace("[m]", "[mm]").replace("[kg]", "[g]")
            )
        for name, widget in vars(self).items():  # a name for the widget in the page too
            widget.css_classes = [name.replace("_", "-")]
            widget.sizing_mode = "stretch_width"
            widget.margin = (3, 0, 5, 0)
            if "description" in widget.param:  # sliders have none: `_slider`
                widget.description = tooltips[name]
        self._silent = False
        self._refused: Any = None
        self.parameters: Any = pn.FlexBox(gap="0 8px", sizing_mode="stretch_width")

    def on(self, widget: Any, act: Callable[[Any], Any]) -> None:
        """Call `act` with each new value that the user gives."""
        widget.param.watch(
            lambda event: None if self._silent or event.new is None else act(event.new),
            "value",
        )

    def offer_parameters(self, law: Any, changed: Callable[[Any], Any]) -> None:
        """Put up fields for the parameters of the law; empty ones have a default that depends on others.

        `changed` is called with a field that the user changes.
        """
        fields = []
        docs = field_docs(type(law))
        for name, value in law_parameters(law).items():
            words = docs.get(name, "")
            unit = re.search(r"\[[^]-]+\]", words)
            fields.append(
                pn.widgets.FloatInput(
                    label=f"{name} {unit[0]}" if unit else name,
                    description=words or None,
                    value=value,
                    css_classes=["parameter", name],
                    tags=[name],
                    styles=looks.grows(130),
                    margin=(3, 0, 5, 0),
                )
            )
            fields[-1].param.watch(
                lambda event: None if self._silent else changed(event.obj), "value"
            )
        self.parameters.objects = fields

    def law_values(self) -> dict[str, float | None]:
        """Return the values in the fields of the law, by parameter; None where a field is empty."""
        return {each.tags[0]: each.value for each in self.parameters}

    def refuse(self, field: Any = None, words: str = "") -> None:
        """Say at the field why its value is refused, and nothing any more at the last one."""
        if self._refused is not None:
            self._refused.stylesheets = []
        if field is not None:
            field.stylesheets = [looks.wrong(words)]
        self._refused = field

    def show(self, state: State) -> None:
        """Set the controls to the state, without taking that for a wish of the user."""
        vx, vy, omega = state.twist
        drawing = state.drawing
        values: dict[Any, Any] = {
            self.example: next(
                (name for name, each in PRESETS.items() if each is state), CHANGED
            ),
            self.law: LAWS.name_of(state.law),
            self.mass: _thousandfold(state.mass),
            self.lever: _thousandfold(state.lever),
            self.vx: 1e3 * vx,
            self.vy: 1e3 * vy,
            self.omega: omega,
            self.load: state.normal_force,
            self.cell_size: _thousandfold(drawing.cell_size),
            self.patch: drawing.name if drawing.origin == "published" else OWN,
            self.sides: drawing.name if parse_sides(drawing.name) else "",
            **{
                each: law_parameters(state.law)[each.tags[0]]
                for each in self.parameters
            },
        }
        self._silent = True
        try:
            for widget, value in values.items():
                if widget.value != value:
                    widget.value = value
        finally:
            self._silent = False

    def head(self) -> Any:
        """Return the controls of the whole screen, beside each other."""
        self.example.styles = looks.grows(200, most=260)
        self.undo.styles = self.link.styles = looks.grows(60, most=90)
        parts = self.example, self.undo, self.link
        return pn.FlexBox(
            *parts, gap="0 8px", align_items="flex-end", styles=looks.grows(340)
        )

    def layout(self) -> Any:
        """Return the controls, except for the tool and those of `head` and `motion`, one below the other."""
        return pn.Column(
            _heading("Contact"),
            self.patch,
            self.sides,
            self.file,
            pn.Row(
                self.cell_size,
                pn.Spacer(width=8),
                self.clear,
                sizing_mode="stretch_width",
            ),
            self._slider("brush"),
            self._slider("pressure"),
            _heading("Friction"),
            self.law,
            self.parameters,
            self.load,
            _heading("Grasped by two such contacts"),
            pn.Row(
                self.mass, pn.Spacer(width=8), self.lever, sizing_mode="stretch_width"
            ),
            stylesheets=[looks.SIDE],
            styles=looks.grows(270, most=320),
        )

    def motion(self) -> Any:
        """Return the sliders of the twist."""
        rows = map(self._slider, ("vx", "vy", "omega"))
        return pn.Column(
            _heading("Motion of the origin"), *rows, sizing_mode="stretch_width"
        )

    def _slider(self, name: str) -> Any:
        icon = pn.widgets.TooltipIcon(value=TOOLTIPS[name], margin=(0, 0, 0, 10))
        return pn.Row(vars(self)[name], icon, sizing_mode="stretch_width")


def members(family: Family) -> str:
    """Return what the members of a family are, as a list for a tooltip."""
    return "\n".join(f"- {name}: {family.words(name)}" for name in family)


def _thousandfold(value: float) -> float:
    """Return g of kg and mm of m, as somebody would type them: 70.3, not 70.30000000000001."""
    return float(f"{1e3 * value:.12g}")


def _heading(text: str) -> Any:
    return pn.pane.HTML(f"<b style='font-size:15px'>{text}</b>", margin=(8, 0, 2, 0))
