"""The search of `coupled.coupling` in C, for a body on patches of one model."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from planarfriction._engine.coupled import coupling, coupling_steps
from planarfriction._engine.coupled.coupling_rows import Patches, layout
from planarfriction.coupling import ITERATIONS, TOLERANCE
from planarfriction.export.c_source import Writer
from planarfriction.export.c_values import Array, CStruct, Fixed, Scalar
from planarfriction.export.loops import Loops
from planarfriction.models.base import lever_of

_STEP = Fixed(0)
"""Stands in place of the address of a patch's step."""

_SLOPES = Fixed(1)
"""Stands in place of the address of a patch's step with its slopes."""

_FUNCTIONS = {_STEP: "step_patch", _SLOPES: "slope_patch"}

ROUNDING = {"double": coupling.ROUNDING, "float": 1e-5}
"""Error of a twist, in the largest speed that goes into it, below which no step gets, by precision."""


def body_of(model: Any, precision: str, patches: int) -> dict[str, Any]:
    """Return fields and functions of the search, always in double precision, and its constants."""
    row = layout(patches, 0, 0, 0)
    counts = {name: part.stop - part.start for name, part in row.slices.items()}
    record = np.dtype(
        [(name, "f8", (count,)) for name, count in counts.items() if count]
    )
    own = Patches(**dict.fromkeys(Patches._fields, Fixed(0)))._replace(  # pyright: ignore
        count=Fixed(patches),
        steps=_STEP,
        slopes=_SLOPES,
        radius=Array("lever_arm", (patches,), fixed=True),
    )
    writer = Writer()
    p = CStruct("p", record)
    loops = Loops(writer, {record: "search_t"})
    loops.replaced[coupling_steps.step_patch] = lambda given: _FUNCTIONS[given[2]]
    # The load is given.
    loops.replaced[coupling_steps.write_load_slopes] = lambda _: "(void)"
    loops.add(
        coupling.find,
        (
            own,
            p,
            Fixed(ROUNDING[precision]),
            Scalar("most", "int"),
            Scalar("again", "int"),
        ),
    )
    functions = re.sub(r"\breal\b", "double", "\n\n".join(loops.functions))
    # Others are in the other precision.
    functions = re.sub(r"\b(\w+_of_vectors)\b", r"\1_in_double", functions)
    return {
        "fields": [
            f"{name}[{count}]"
            for name, count in counts.items()
            if f"p->{name}" in functions
        ],
        "functions": functions,
        "levers": ", ".join([writer.constant(lever_of(model) or 1.0)] * patches),
        "iterations": ITERATIONS,
        "tolerance": writer.constant(TOLERANCE),
    }
