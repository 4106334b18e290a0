"""Friction models as C libraries of one header and one source."""

from __future__ import annotations

import contextlib
import hashlib
import re
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction._engine.cells import moment_pressure
from planarfriction._engine.compiler import compiled_math
from planarfriction._engine.published.surfaces import CELLS
from planarfriction._support import validation, writing
from planarfriction.errors import InvalidValueError
from planarfriction.export.body import body_of
from planarfriction.export.c_source import (
    SQRT,
    TAPED,
    Writer,
    comment,
    of_compiled,
    passes_of,
    rendered,
    used_by,
)
from planarfriction.export.c_values import Array, Fixed, Scalar
from planarfriction.export.loops import Loops
from planarfriction.export.pieces import Pieces, pieces_of
from planarfriction.export.slip import samples_of, slip_of
from planarfriction.formulas import LARGEST
from planarfriction.online.loops import friction_filter, grips


def grip_of(controller: Any, name: str) -> dict[str, Any]:
    """Return the lines and tables of `planarfriction.online.Hold` of one part, in double precision.

    Raises InvalidValueError for anything else, and for an observer of many parts or with a sum of cells as its surface.
    """
    if getattr(controller, "_grip", None) is not grips.hold or controller.state.shape:
        raise InvalidValueError(
            "controller",
            "be a Hold of one part (without batch)",
            type(controller).__name__,
        )
    observer = controller.observer
    writer = Writer()
    own = observer._filter
    if own.kind == CELLS:
        rule = "have an ellipsoid or a table as its surface"
        raise InvalidValueError("controller", rule, type(observer.surface).__name__)
    arrays = {
        each: value
        for each, value in own._asdict().items()
        if isinstance(value, np.ndarray)
    }
    known = [
        Array(f"own_{n}", v.shape, fixed=True) if n in arrays else Fixed(v)
        for n, v in own._asdict().items()
    ]
    structs = {
        "estimate": friction_filter.ESTIMATE,
        "observer": observer.state.dtype,
        "control": controller.state.dtype,
    }
    estimate, state, control = structs.values()
    loops = Loops(writer, {each: f"{name}_{own}" for own, each in structs.items()})
    found = Array("found", (1,), estimate)
    loops.add(
        friction_filter.update,
        (
            own._make(known),
            Array("states", (1,), state),
            Array("samples", (1, 8)),
            found,
        ),
    )
    loops.add(
        controller._grip,
        (Array("states", (1,), control), found, *map(Fixed, controller._settings)),
    )
    functions = "\n\n".join(loops.functions)
    return {
        "tables": {
            f"own_{each}": [writer.constant(float(x)) for x in value.ravel()]
            for each, value in arrays.items()
            if f"own_{each}[" in functions
        },
        "functions": functions,
        "fresh": [
            ", ".join(_fresh(each.state, writer)) for each in (observer, controller)
        ],
        "structs": {own: _fields(each) for own, each in structs.items()},
    }


def _fields(record: np.dtype) -> list[str]:
    """Return the fields of a struct."""
    kinds = {
        field: ("double" if kind.base.kind == "f" else "int", kind)
        for field, (kind, *_) in (record.fields or {}).items()
    }
    return [
        f"{own} {field}{f'[{np.prod(kind.shape)}]' if kind.shape else ''};"
        for field, (own, kind) in kinds.items()
    ]


def _fresh(state: Any, writer: Writer) -> list[str]:
    """Return the constants of a struct."""
    rows = (
        [writer.constant(float(x)) for x in np.ravel(state[field])]
        for field in state.dtype.names
    )
    return [row[0] if len(row) == 1 else f"{{ {', '.join(row)} }}" for row in rows]


PRECISIONS = {"double": LARGEST, "float": 1e9}
"""Largest number that a step takes, by precision."""

MOST_PATCHES = 64
"""Patches of a body at most."""

LONGEST_NAME = 40
"""Characters of the name of a library: compilers of C99 tell apart names of 63, and files have such names too."""

HEADERS = """assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdalign stdarg
stdatomic stdbool stddef stdint stdio stdlib stdnoreturn string tgmath threads time uchar wchar wctype"""
"""Headers of C, which a library of that name would hide."""

PARAMETERS = {
    "sigma_0": ("bristle stiffness per unit normal load [1/m]", "p->sigma_0 > 0"),
    "sigma_1": ("bristle damping per unit normal load [s/m]", "p->sigma_1 >= 0"),
    "sigma_2": ("viscous friction per unit normal load [s/m]", "p->sigma_2 >= 0"),
    "mu_c": ("Coulomb coefficient", "p->mu_c > 0"),
    "mu_s": ("static coefficient, at least mu_c", "p->mu_s >= p->mu_c"),
    "v_s": ("Stribeck speed [m/s]", "p->v_s > 0"),
    "breakaway_ratio": (
        "fraction of the largest deflection below which bristles are elastic, below 1",
        "p->breakaway_ratio >= 0 && p->breakaway_ratio < 1",
    ),
}
"""Parameters: their words in the header, and their conditions."""

FILES = {
    "library.h": ".h", "library.c": ".c", "library.test.c": "_test.c", "library.cmake": ".cmake",
    "library.casadi.c": "_casadi.c", "grip.h": "_grip.h", "grip.c": "_grip.c",
}  # fmt: skip
"""Ends of the names of files by their templates; those for CasADi and of a controller are written if asked for."""


def checked_name(name: Any) -> None:
    """Check the name of a library; raises InvalidValueError for one that is no name of C, or that of a header."""
    if not (
        isinstance(name, str)
        and re.fullmatch(r"[a-zA-Z]\w*", name, re.ASCII)
        and len(name) <= LONGEST_NAME
    ):
        raise InvalidValueError(
            "name",
            f"be a letter, then letters, digits and _, {LONGEST_NAME} in all",
            name,
        )
    if name.lower() in HEADERS.split():
        raise InvalidValueError("name", "not be that of a header of C", name)


def export_c(
    model: Any,
    folder: Any,
    *,
    name: str = "friction",
    precision: str = "double",
    casadi: bool = False,
    controller: Any = None,
    patches: int = 1,
) -> tuple[Path, ...]:
    """Write a model as C source into a folder; return the files `<name>.h`, `.c`, `_test.c` and `.cmake`.

    The source is C99 and C++17, calls nothing but `math.h`, allocates nothing and keeps no state of its
    own. Its step is the model's own (see `FrictionModel.step`), traced from the same formulas. The test is a program
    that compares the library with numbers of the model; the CMake file has a target for each.
    With `casadi`, `<name>_casadi.c` holds the step and its Jacobian as functions that `casadi.external` loads.
    `patches` is the number of patches of this model that `<name>_body_step` puts a body on.
    With `controller`, a `planarfriction.online.Hold`, `<name>_grip.h` and `.c` hold that with its observer.

    Raises InvalidValueError for a name that is no name of C, an unknown precision, fewer than 1 or more than 64
    patches, and models and controllers without source (see `pieces_of`, `grip_of`); FileError if the folder cannot be
    written.
    """
    checked_name(name)
    validation.choice("precision", precision, PRECISIONS)
    patches = validation.count("patches", patches, 1, MOST_PATCHES)
    validation.instance("casadi", casadi, bool, "True or False")
    if (casadi or controller is not None) and precision != "double":
        raise InvalidValueError(
            "precision", "be double for CasADi and controllers", precision
        )
    given = {"patches": patches} | (
        {} if controller is None else {"grip": grip_of(controller, name)}
    )
    folder = validation.path("folder", folder)
    kinds = [
        kind
        for kind in FILES
        if (casadi or "casadi" not in kind) and ("grip" in given or "grip" not in kind)
    ]
    texts = _texts(
        model, pieces_of(model, precision, fixed=False), name, precision, given, kinds
    )
    writing.make_folder(folder)
    files = tuple(folder / f"{name}{FILES[kind]}" for kind in kinds)
    with contextlib.ExitStack() as stack:  # all can be written, or none is
        for file, text in zip(files, texts, strict=True):
            stack.enter_context(writing.replacing(file)).write(text.encode())
    return files


def _texts(
    model: Any, pieces: Pieces, name: str, precision: str, given: dict, kinds: list[str]
) -> list[str]:
    """Return the text of each kind of file."""
    import planarfriction

    writer = Writer(precision)
    slip = slip_of(model.patch, writer)
    functions = _functions(writer, pieces) | {"tilt": tilt_of(pieces.count)}
    read = "\n".join(functions.values())
    always = "share", "rungs", "place_x", "place_y"
    tables = {
        table: each
        for table, each in pieces.tables.items()
        if table in always or f"{table}[" in read
    }
    tables |= {} if slip is None else slip.tables
    step = functions["step"].splitlines()
    body = body_of(model, pieces, precision, given["patches"])
    vector = Writer(precision, own=precision == "double")
    share = (
        "(at->low[k] + at->part * (at->high[k] - at->low[k]))"
        if pieces.rungs
        else "share[k]"
    )
    # The step of a pad reads the shares of its cells, and these alone.
    sizes = pieces.count, pieces.states
    passes = passes_of(vector, pieces.step, *sizes, fill=not pieces.pad)
    turns = pieces.turns and passes_of(vector, pieces.turns(), *sizes, TAPED, new=False)
    if passes:
        more = passes.width - pieces.count
        tables |= {
            table: np.pad(each, (0, more), mode="edge")
            for table, each in tables.items()
            if table in pieces.tables and table not in ("share", "rungs")
        }
    tables = {
        table: _table(writer, table, numbers) for table, numbers in tables.items()
    }
    bodies = {
        "exp": of_compiled(compiled_math.exp),
        "sin": of_compiled(compiled_math.sin),
        "sqrt": SQRT,
    }
    stepping = "".join(
        "".join([each.shared, *each.each]) for each in (passes, turns) if each
    )
    own = {
        each: "\n".join(lines)
        for each, lines in bodies.items()
        if f"{each}_of(" in stepping
    }
    values = (
        functions
        | given
        | {
            "name": name,
            "version": planarfriction.__version__,
            "model": comment(
                f"{type(model).__name__} of {model.patch.name or 'a patch'}, {type(model.law).__name__}"
            ),
            "digest": hashlib.sha256(
                "\n".join(
                    [
                        functions["step"],
                        repr(tables) + pieces.face * repr(body["tables"]),
                    ]
                ).encode()
            ).hexdigest()[:16],
            "pieces": pieces,
            "states": pieces.all_states,
            "precision": precision,
            "parameters": {
                each: (writer.constant(value), PARAMETERS[each][0])
                for each, value in pieces.parameters.items()
            },
            "ranges": " && ".join(PARAMETERS[each][1] for each in pieces.parameters),
            "tables": tables,
            "pattern": _pattern(pieces),
            "suffix": writer.suffix,
            "largest": writer.constant(PRECISIONS[precision]),
            "slip": slip and slip.words,
            "passes": passes,
            "turns": turns,
            "body": body,
            "share": share,
            "own": own,
            "samples": samples_of(model, slip, writer, pieces.tables.get("rungs")),
            "operations": pieces.count * sum("=" in line for line in step),
            "functions": pieces.count
            * sum(
                any(f"{each}{writer.suffix}(" in line for each in _SLOW)
                for line in step
            ),
        }
    )
    return [rendered("planarfriction.export", kind, **values) for kind in kinds]


def _places(pieces: Pieces) -> list[str]:
    """Return the places of the new states of cell k."""
    return [f"next[k + {i * pieces.count}]" for i in range(pieces.states)]


def _pattern(pieces: Pieces) -> list[int]:
    """Return rows, columns, starts of columns and rows of entries of the derivative of new states by states.

    A face moves all of them: behind rows and columns, 1 stands for all entries.
    """
    states = pieces.all_states
    if pieces.face:
        return [states, states, 1]
    rows = [
        c % pieces.count + pieces.count * i
        for c in range(states)
        for i in range(pieces.states)
    ]
    return [states, states, *range(0, len(rows) + 1, pieces.states), *rows]


def _functions(writer: Writer, pieces: Pieces) -> dict[str, str]:
    """Return the lines of the functions of cell k."""
    wrench = ["w[0]", "w[1]", "w[2]"]
    results = [*_places(pieces), *wrench]
    rows = [
        f"rows[{row}][{column}]"
        for row in range(3 + pieces.states)
        for column in range(pieces.columns)
    ]
    traces = {
        "step": (pieces.step, results),
        "steady": (pieces.steady, wrench),
        "slopes": (pieces.slopes(), [*results, *rows]),
    }
    functions = {}
    for name, (block, outputs) in traces.items():
        reads_k = any("[k" in each for each in (*used_by(block), *outputs))
        functions[name] = "\n".join(
            [*([] if reads_k else ["    (void)k;"]), *writer.lines(block, outputs)]
        )
    return functions


def tilt_of(count: int) -> str:
    """Return the functions that shift shares of the load to a centre of pressure, always in double precision."""
    loops = Loops(Writer())
    shares = Array("shares", (count,))
    x, y = (Array(name, (count,), fixed=True) for name in ("place_x", "place_y"))
    loops.add(moment_pressure.centre, (Scalar("mx"), Scalar("my"), Scalar("load")))
    if count > 1:
        loops.add(
            moment_pressure.tilt,
            (x, y, shares, Fixed(count), Scalar("cx"), Scalar("cy"), shares),
        )
    return re.sub(r"\breal\b", "double", "\n\n".join(loops.functions))


_SLOW = "sqrt", "exp", "sin", "cos", "pow", "atan2"


def _table(writer: Writer, name: str, numbers: np.ndarray) -> tuple[str, list[str]]:
    """Return the type and the constants of a table: in single precision where that is how it is stored.

    Places are always of double precision, as the functions that read them are (see `tilt_of`).
    """
    single = numbers.dtype == np.float32
    if name.startswith("place_"):
        return "double", [
            Writer().constant(float(each)).strip("()") for each in numbers
        ]
    return ("float" if single else "real"), [
        f"{np.float32(each)!s}f" if single else writer.constant(float(each)).strip("()")
        for each in numbers.ravel()
    ]
