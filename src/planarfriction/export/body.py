"""The search of `coupled.coupling` in C, for a body on patches of one model."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from planarfriction._engine.coupled import coupling, coupling_steps, face, face_steps
from planarfriction._engine.coupled.coupling_rows import Patches, layout
from planarfriction._engine.coupled.face_steps import Hanging
from planarfriction.coupling import ITERATIONS, TOLERANCE
from planarfriction.export.c_source import Writer
from planarfriction.export.c_values import Array, CStruct, Fixed, Scalar
from planarfriction.export.loops import Loops
from planarfriction.export.pieces import Pieces
from planarfriction.models.base import lever_of

_STEP = Fixed(0)
"""Stands in place of the address of a patch's step."""

_SLOPES = Fixed(1)
"""Stands in place of the address of a patch's step with its slopes."""

_TABLES = "radius", "stuck", "viscous", "compliance", "back", "lag"
"""Arrays of `Patches` that are tables of the source, in their order: the first, of pads three, with faces all."""

_FUNCTIONS = {_STEP: "step_patch", _SLOPES: "slope_patch"}

ROUNDING = {"double": coupling.ROUNDING, "float": 1e-5}
"""Error of a twist, in the largest speed that goes into it, below which no step gets, by precision."""


def body_of(model: Any, pieces: Pieces, precision: str, patches: int) -> dict[str, Any]:
    """Return fields and functions of the search, always in double precision, and its constants.

    Those of a pad's face are among them, for all patches and for one `alone`.
    """
    row = layout(patches, 0)
    counts = {name: part.stop - part.start for name, part in row.slices.items()}
    given = dict.fromkeys(("dt", "state", "new"), 1)
    record = np.dtype(
        [(name, "f8", (count,)) for name, count in (counts | given).items() if count]
    )
    tables = {"lever_arm": np.full(patches, lever_of(model) or 1.0)}
    compiled = model.reduction.compiled
    if pieces.pad:
        stuck, viscous = compiled.held
        tables |= {
            "stuck_stiffness": np.tile(stuck.ravel(), patches),
            "stuck_damping": np.tile(viscous.ravel(), patches),
        }
    if pieces.face:
        back = np.linalg.pinv(compiled.compliance, hermitian=True)
        tables |= {
            "common_compliance": np.tile(compiled.compliance.ravel(), patches),
            "common_stiffness": np.tile(back.ravel(), patches),
            "common_lag": np.full(patches, compiled.lag),
        }
    known = [Array(name, each.shape, fixed=True) for name, each in tables.items()]
    own = Patches(**dict.fromkeys(Patches._fields, Fixed(0)))._replace(  # pyright: ignore
        count=Fixed(patches),
        steps=_STEP,
        slopes=_SLOPES,
        firsts=Array("firsts", (patches + 1,), "int", fixed=True),
        soft=Fixed(int(pieces.pad)),
        **dict(zip(_TABLES, known, strict=False)),
    )
    writer = Writer()
    p = CStruct("p", record)
    loops = Loops(writer, {record: "search_t"})
    loops.replaced[coupling_steps.step_patch] = lambda given: _FUNCTIONS[given[2]]
    # The load is given.
    loops.replaced[coupling_steps.write_load_slopes] = lambda _: "(void)"
    rounding = Fixed(ROUNDING[precision])
    most = Scalar("most", "int"), Scalar("again", "int")
    names = {"find": loops.add(coupling.find, (own, p, rounding, *most))[0]}
    if pieces.face:
        alone = own._replace(count=Fixed(1))
        none = Fixed(0)
        hanging = Hanging(none, none, none, Scalar("limit"), *known[1:3])  # pyright: ignore
        names |= {
            "soften": loops.add(face.soften, (own, p))[0],
            "move_faces": loops.add(face.move_faces, (own, p))[0],
            "find_alone": loops.add(coupling.find, (alone, p, rounding, *most))[0],
            "soften_alone": loops.add(face.soften, (alone, p))[0],
            "move_alone": loops.add(face.move_faces, (alone, p))[0],
            "found": loops.add(face_steps.found, (hanging, alone, p))[0],
        }
    functions = re.sub(r"\breal\b", "double", "\n\n".join(loops.functions))
    # Others are in the other precision.
    functions = re.sub(r"\b(\w+_of_vectors)\b", r"\1_in_double", functions)
    functions = re.sub(r"p->new(\[.*\]) = ", r"p->next\1 = (real)", functions)
    return names | {
        "fields": [
            f"{name}[{count}]"
            for name, count in counts.items()
            if name not in given and f"p->{name}" in functions
        ],
        "functions": functions,
        "tables": {
            name: [writer.constant(float(x)).strip("()") for x in each]
            for name, each in tables.items()
        },
        "iterations": ITERATIONS,
        "alone": face_steps.MOST,
        "tolerance": writer.constant(TOLERANCE),
        "rounding": writer.constant(rounding.value),
    }
