"""An observer and a grip controller as source code, translated from the compiled loops of both (see `loops`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.export.c_source import Writer
from planarfriction.export.c_values import Array, Fixed
from planarfriction.export.loops import Loops
from planarfriction.kernels import friction_filter, grips
from planarfriction.kernels.surfaces import CELLS

CONTROLLERS = (grips.hold,)
"""Loops of controllers that have source."""


def grip_of(controller: Any, name: str) -> dict[str, Any]:
    """Return the lines and tables of `planarfriction.online.Hold` of one part, in double precision.

    Raises InvalidValueError for anything else, and for an observer of many parts or with a sum of cells as its surface.
    """
    if getattr(controller, "_grip", None) not in CONTROLLERS or controller.state.shape:
        raise InvalidValueError("controller", "be a Hold of one part (without batch)", type(controller).__name__)
    observer, writer = controller.observer, Writer()
    own, state = observer._filter, observer.state
    if own.kind == CELLS:
        raise InvalidValueError(
            "controller", "know an ellipsoid or a table as its surface", type(observer.surface).__name__
        )
    arrays = {each: value for each, value in own._asdict().items() if isinstance(value, np.ndarray)}
    known = [Array(f"own_{n}", v.shape, fixed=True) if n in arrays else Fixed(v) for n, v in own._asdict().items()]
    estimate, control = friction_filter.ESTIMATE, grips.STATE
    loops = Loops(writer, {estimate: f"{name}_estimate", control: f"{name}_control"})
    found = Array("found", (1,), estimate)
    loops.add(
        friction_filter.update, (own._make(known), Array("states", (1, len(state))), Array("samples", (1, 8)), found)
    )
    loops.add(controller._grip, (Array("states", (1,), control), found, *map(Fixed, controller._settings)))
    functions = "\n\n".join(loops.functions)
    return {
        "tables": {
            f"own_{each}": [writer.constant(float(x)) for x in value.ravel()]
            for each, value in arrays.items()
            if f"own_{each}[" in functions
        },
        "functions": functions,
        "state": [writer.constant(float(x)) for x in state],
        "control": ", ".join(_fresh(controller.state, writer)),
        "structs": {"estimate": _fields(estimate), "control": _fields(control)},
    }


def _fields(record: np.dtype) -> list[str]:
    """Return the fields of a struct."""
    kinds = {field: ("double" if kind.base.kind == "f" else "int", kind) for field, (kind, *_) in record.fields.items()}  # pyright: ignore
    return [f"{own} {field}{f'[{np.prod(kind.shape)}]' if kind.shape else ''};" for field, (own, kind) in kinds.items()]


def _fresh(state: Any, writer: Writer) -> list[str]:
    """Return the constants of a struct."""
    rows = ([writer.constant(float(x)) for x in np.ravel(state[field])] for field in state.dtype.names)
    return [row[0] if len(row) == 1 else f"{{ {', '.join(row)} }}" for row in rows]
