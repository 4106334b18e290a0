"""The search of `coupled.coupling` in C, for Warp too, and that for a body on patches of one model."""

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

_TABLES = "radius", "stuck", "viscous", "pad", "compliance", "back", "lag"
"""Arrays of `Patches` that are tables of the source: the first, with known slopes four, with faces all."""

_GIVEN = "dt", "state", "new"
"""Fields of the struct in the precision of the library."""

ROUNDING = {"double": coupling.ROUNDING, "float": 1e-5}
"""Error of a twist, in the largest speed that goes into it, below which no step gets, by precision."""


class Search:
    """Functions of the search in C, always in double precision, and the struct `search_t *p` that they work on."""

    def __init__(self, patches: int, slopes: str, **known: Any) -> None:
        """Prepare for a number of patches; `slopes` is the function for steps with slopes, `known` are `Patches`."""
        row = layout(patches, 0)
        self.counts = {
            name: part.stop - part.start for name, part in row.slices.items()
        }
        fields = self.counts | dict.fromkeys(_GIVEN, 1)
        self.record = np.dtype([(name, "f8", (n,)) for name, n in fields.items() if n])
        none = dict.fromkeys(Patches._fields, Fixed(0))
        own = {"count": Fixed(patches), "steps": _STEP, "slopes": _SLOPES}
        given: dict[str, Any] = none | own | known
        self.patches = Patches(**given)
        self.p = CStruct("p", self.record)
        self.loops = Loops(Writer(), {self.record: "search_t"})
        names = {_STEP: "step_patch", _SLOPES: slopes}
        self.loops.replaced[coupling_steps.step_patch] = lambda given: names[given[2]]

    def add(self, kernel: Any, *arguments: Any) -> str:
        """Write a kernel for arguments like these; return its name."""
        return self.loops.add(kernel, arguments)[0]

    def find(self, patches: Patches, precision: str) -> str:
        """Write `coupling.find`; return its name."""
        rounding = Fixed(ROUNDING[precision])
        most = Scalar("most", "int"), Scalar("again", "int")
        return self.add(coupling.find, patches, self.p, rounding, *most)

    def texts(self) -> dict[str, Any]:
        """Return the functions, and the fields of the struct but for those of another precision."""
        functions = re.sub(r"\breal\b", "double", "\n\n".join(self.loops.functions))
        fields = [
            f"{name}[{count}]"
            for name, count in self.counts.items()
            if name not in _GIVEN and f"p->{name}" in functions
        ]
        return {"functions": functions, "fields": fields}


def body_of(model: Any, pieces: Pieces, precision: str, patches: int) -> dict[str, Any]:
    """Return fields and functions of the search, and its constants.

    Those of a pad's face are among them, for all patches and for one `alone`.
    """
    tables = {"lever_arm": np.full(patches, lever_of(model) or 1.0)}
    compiled = model.reduction.compiled
    stuck, viscous = compiled.held
    linear = stuck.any()
    if linear:
        tables |= {
            "stuck_stiffness": np.tile(stuck.ravel(), patches),
            "stuck_damping": np.tile(viscous.ravel(), patches),
            "of_pad": np.full(patches, float(pieces.pad)),
        }
    if pieces.face:
        back = np.linalg.pinv(compiled.compliance, hermitian=True)
        tables |= {
            "common_compliance": np.tile(compiled.compliance.ravel(), patches),
            "common_stiffness": np.tile(back.ravel(), patches),
            "common_lag": np.full(patches, compiled.lag),
        }
    known = [Array(name, each.shape, fixed=True) for name, each in tables.items()]
    search = Search(
        patches,
        "slope_patch",
        firsts=Array("firsts", (patches + 1,), "int", fixed=True),
        soft=Fixed(int(pieces.pad)),
        linear=Fixed(int(linear)),
        **dict(zip(_TABLES, known, strict=False)),
    )
    own = search.patches
    p = search.p
    # The load is given.
    search.loops.replaced[coupling_steps.write_load_slopes] = lambda _: "(void)"
    names = {"find": search.find(own, precision)}
    if pieces.face:
        alone = own._replace(count=Fixed(1))
        none = Fixed(0)
        hanging = Hanging(none, none, none, Scalar("limit"), *known[1:3])  # pyright: ignore
        names |= {
            "soften": search.add(face.soften, own, p),
            "move_faces": search.add(face.move_faces, own, p),
            "find_alone": search.find(alone, precision),
            "soften_alone": search.add(face.soften, alone, p),
            "move_alone": search.add(face.move_faces, alone, p),
            "found": search.add(face_steps.found, hanging, alone, p),
        }
    texts = search.texts()
    # Others are in the other precision.
    functions = re.sub(r"\b(\w+_of_vectors)\b", r"\1_in_double", texts["functions"])
    functions = re.sub(r"p->new(\[.*\]) = ", r"p->next\1 = (real)", functions)
    writer = search.loops.writer
    return names | {
        "fields": texts["fields"],
        "functions": functions,
        "tables": {
            name: [writer.constant(float(x)).strip("()") for x in each]
            for name, each in tables.items()
        },
        "iterations": ITERATIONS,
        "alone": face_steps.MOST,
        "tolerance": writer.constant(TOLERANCE),
        "rounding": writer.constant(ROUNDING[precision]),
    }
