"""The state as one line of JSON, which the address of the page carries: whoever opens the link sees the same."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import quote, unquote

from planarfriction import validation
from planarfriction.errors import InvalidValueError, shown
from planarfriction.laws import LAWS
from planarfriction.scenes.model_files import law_from_dict
from planarfriction.scenes.section import Section
from planarfriction_explorer.drawing import MOST_SIDE, Drawing
from planarfriction_explorer.state import State, law_parameters

MOST_TEXT = 300_000
"""Most characters of a link: a map of the most cells, all with different pressures, fits twice."""

_PLAIN = ("normal_force", "twist", "mass", "lever")


def to_json(state: State) -> str:
    """Return the state as one line of JSON; a map that was painted or loaded is written out, without its name."""
    drawing, law = state.drawing, {"kind": LAWS.name_of(state.law), **law_parameters(state.law)}
    cells = {"cell_size": drawing.cell_size, "pressures": drawing.pressures.tolist()}
    data = {
        "patch": drawing.name if drawing.origin == "published" else cells,
        "law": {name: value for name, value in law.items() if value is not None},
        **{name: getattr(state, name) for name in _PLAIN},
    }
    return json.dumps(data, separators=(",", ":"))


def from_json(text: str) -> State:
    """Return the state of what `to_json` wrote; what is left out has its default.

    Raises `FrictionError` in one line for all else.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: also a number of more digits than Python converts
        raise InvalidValueError("the link", "hold a state as JSON", shown(str(error).partition(";")[0])) from None
    validation.keys("the link", data, (), ("patch", "law", *_PLAIN))
    given = {name: data[name] for name in _PLAIN if name in data}
    if "patch" in data:
        given["drawing"] = _drawing(data["patch"])
    if "law" in data:
        given["law"] = law_from_dict(Section(data["law"], "law", "the link"))
    return State(**given)


def _drawing(patch: Any) -> Drawing:
    if isinstance(patch, str):
        return Drawing.published(patch)
    validation.keys("patch", patch, ("cell_size", "pressures"))
    pressures = validation.non_negative_array("pressures", patch["pressures"], (None, None))
    if not 0 < min(pressures.shape) <= max(pressures.shape) <= MOST_SIDE:
        rule = f"have from 1 to {MOST_SIDE} rows and columns"
        raise InvalidValueError("pressures", rule, "{} x {}".format(*pressures.shape))
    drawing = Drawing(pressures, patch["cell_size"])
    if pressures.any():
        _ = drawing.patch  # refuses cells of no size in range now
    return drawing


def to_link(state: State) -> str:
    """Return what stands in the address of the page behind its path."""
    return "#" + quote(to_json(state), safe=",:")


def from_link(link: str) -> State:
    """Return the state of a link. Raises `FrictionError` in one line, also for one that is too long."""
    if len(link) > MOST_TEXT:
        raise InvalidValueError("the link", f"have at most {MOST_TEXT} characters", len(link))
    return from_json(unquote(link.removeprefix("#")))
